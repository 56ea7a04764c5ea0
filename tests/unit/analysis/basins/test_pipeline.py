"""Plans of basin maps: what users may write, which starts that means, and how they are cut."""

import math

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.basins import pipeline as plans
from saltus.analysis.basins.pipeline import basin_plan
from saltus.errors import ParameterError, UnitError

RIG = sl.models.delangre("b")
X, V = ("-5 mm", "5 mm", 5), ("-1 m/s", "1 m/s", 3)
SPAN_X, SPAN_V = ("-5 mm", "5 mm"), ("-1 m/s", "1 m/s")


@sl.system(states="x v", units={"x": "m", "v": "m/s"})
def unforced(t, x, v):
    """An oscillator that nothing drives."""
    return v, -x - 0.1 * v


@sl.system(states="x v", units={"x": "m", "v": "m/s"}, check_units=False)
def driven(t, x, v):
    """Something grows with time, and never repeats."""
    return v, -x + 1e-3 * t


@sl.system(states="a b c", forced_at="f", units={"a": "m", "b": "m", "c": "m/s"}, check_units=False)
def three(t, a, b, c, *, f=1.0):
    """Three states, two of a kind."""
    return -a, -b, sl.cos(2 * sl.pi * f * t) - c


def plan(axes=None, at=None, periods=10, every=None, system=RIG):
    return basin_plan(
        system, {"x": X, "v": V} if axes is None else axes, at, sl.Taylor(), periods, every
    )


# -- starts ----------------------------------------------------------------------------------------
def test_cells_run_along_the_second_axis_and_states_keep_their_order():
    rows = plan().starts(np.arange(15))
    x, v = np.linspace(-5e-3, 5e-3, 5), np.linspace(-1, 1, 3)
    np.testing.assert_array_equal(rows, np.stack([np.repeat(x, 3), np.tile(v, 5)], axis=1))
    turned = plan({"v": V, "x": X})
    assert turned.shape == (3, 5)
    np.testing.assert_array_equal(
        turned.starts(np.arange(15)), np.stack([np.tile(x, 3), np.repeat(v, 5)], axis=1)
    )


def test_other_states_start_where_at_says():
    rows = plan({"a": (0, 1, 2), "c": (2, 3, 2)}, {"b": "5 mm"}, system=three).starts(np.arange(4))
    np.testing.assert_array_equal(rows, [[0, 5e-3, 2], [0, 5e-3, 3], [1, 5e-3, 2], [1, 5e-3, 3]])
    assert plan({"a": (0, 1, 2), "c": (2, 3, 2)}, system=three).starts(np.array([0]))[0, 1] == 0.0


def test_the_scale_of_a_state_without_axis_is_that_of_its_kind():
    assert plan({"a": (0, 4, 2), "c": (0, 7, 2)}, system=three).scale.tolist() == [4.0, 4.0, 7.0]
    assert plan({"a": (0, 4, 2), "b": (0, 3, 2)}, system=three).scale.tolist() == [4.0, 3.0, 4.0]


@pytest.mark.parametrize("size", [1, 4, 15, 100])
def test_chunks_cover_every_cell_once(monkeypatch, size):
    monkeypatch.setattr(plans, "CHUNK", size)
    one = plan()
    parts = [one.cells_of(i) for i in range(one.chunks)]
    np.testing.assert_array_equal(np.concatenate(parts), np.arange(15))
    assert max(map(len, parts)) <= size


def test_axes_may_be_arrays_and_must_ascend():
    given = np.array([-1e-3, 0.0, 5e-3])
    np.testing.assert_array_equal(plan({"x": given, "v": V}).axes["x"], given)
    for wrong in (
        given[::-1],
        given[:1],
        np.array([0, np.nan]),
        np.array([0, np.inf]),
        np.zeros((2, 2)),
        np.array([0.0, 0.0]),
    ):
        with pytest.raises(
            ParameterError,
            match=r"starts along x must ascend|Give finite "
            r"starts|must be a range",
        ):
            plan({"x": wrong, "v": V})


def test_an_axis_of_text_is_refused_in_words():
    with pytest.raises((ParameterError, UnitError), match="x"):
        plan({"x": np.array(["one", "two"]), "v": V})


def test_whole_periods_may_be_written_as_a_float():
    assert plan(periods=20.0).periods == 20
    assert isinstance(plan(periods=np.int64(7)).periods, int)


def test_a_list_that_looks_like_a_range_is_refused():
    with pytest.raises(
        ParameterError,
        match=r"x = \['-1 mm', '1 mm', 5\] is a list.*5 has no unit. A range is a "
        r"tuple: x=\('-1 mm', '1 mm', 5\)",
    ):
        plan({"x": ["-1 mm", "1 mm", 5], "v": V})


def test_a_list_holds_the_starts_and_a_tuple_is_a_range():
    rows = plan({"x": ["0 mm", "1 mm", "5 mm"], "v": (0, 1, 2.0)})
    assert rows.axes["x"].tolist() == [0.0, 1e-3, 5e-3]
    assert rows.axes["v"].tolist() == [0.0, 1.0]


# -- what is refused, in words ---------------------------------------------------------------------
@pytest.mark.parametrize(
    ("axes", "message"),
    [
        ({"y": X, "v": V}, r"no state 'y'\. Known: x, v"),
        ({"xx": X, "v": V}, r"no state 'xx'\. Did you mean 'x'\?"),
        ({"x": X}, "two axes, not 1.*400"),
        ({}, "two axes, not 0"),
        ({"x": ("1 mm", "1 mm", 4), "v": V}, "starts along x must ascend"),
        ({"x": (1, 0, 4), "v": V}, "starts along x must ascend"),
        ({"x": (math.nan, 1, 4), "v": V}, "x = nan is not a finite number"),
        ({"x": (-math.inf, 1, 4), "v": V}, "x = -inf is not a finite number"),
        (
            {"x": (0, 1, 1), "v": V},
            "number of starts along x must be a whole number of at least 2, not 1",
        ),
        ({"x": (0, 1, 2.5), "v": V}, r"at least 2, not 2\.5"),
        ({"x": (0, 1), "v": V}, "A tuple is a range; a list holds the starts themselves"),
        ({"x": (0, 1, True), "v": V}, "at least 2, not True"),
        ({"x": "5 mm", "v": V}, r"must be a range \(first, last, number of starts\)"),
        ({"x": 3.0, "v": V}, r"must be a range \(first, last, number of starts\)"),
        ({"x": (0, 1, 100_000), "v": (0, 1, 100_000)}, "coarser grid, or sl.basin_fractions"),
        ({"x": (0, 1, 10**12), "v": V}, "Take a coarser grid"),
    ],
    ids=[
        "unknown",
        "nearest",
        "one",
        "none",
        "empty",
        "reversed",
        "nan",
        "inf",
        "count 1",
        "count not whole",
        "two",
        "count bool",
        "text",
        "number",
        "huge",
        "huge axis",
    ],
)
def test_axes_that_are_refused(axes, message):
    with pytest.raises(ParameterError, match=message):
        plan(axes)


def test_a_wrong_unit_is_refused():
    with pytest.raises(UnitError, match="x is measured in m"):
        plan({"x": ("1 kg", "2 kg", 3), "v": V})


def test_an_unknown_state_in_at_is_refused():
    with pytest.raises(ParameterError, match="no state 'z'"):
        plan(at={"z": 1.0})


WRONG_COUNTS = [-1, 0, 1.5, True, math.nan, math.inf, "many", None]


@pytest.mark.parametrize("periods", WRONG_COUNTS[:-1])  # None stands for the budget
def test_periods_that_are_refused(periods):
    with pytest.raises(ParameterError, match="periods must be a whole number of at least 1"):
        sl.basins(RIG, periods=periods, x=X, v=V)


@pytest.mark.parametrize("periods", WRONG_COUNTS[:-1])  # None stands for the budget
def test_periods_that_attractors_refuses(periods):
    with pytest.raises(ParameterError, match="periods must be a whole number of at least 1"):
        sl.attractors(RIG, [0.0, 0.0], periods=periods)


@pytest.mark.parametrize("periods", WRONG_COUNTS[:-1])  # None stands for the budget
def test_periods_that_basin_fractions_refuses(periods):
    with pytest.raises(ParameterError, match="periods must be a whole number of at least 1"):
        sl.basin_fractions(RIG, periods=periods, samples=4, x=SPAN_X, v=SPAN_V)


@pytest.mark.parametrize("samples", WRONG_COUNTS)
def test_samples_that_are_refused(samples):
    with pytest.raises(ParameterError, match="samples must be a whole number of at least 1"):
        sl.basin_fractions(RIG, samples=samples, x=SPAN_X, v=SPAN_V)


@pytest.mark.parametrize("seed", [None, -1, "a", 1.5])
def test_seeds_that_are_refused(seed):
    with pytest.raises(ParameterError, match="seed"):
        sl.basin_fractions(RIG, samples=4, seed=seed, x=SPAN_X, v=SPAN_V)


@pytest.mark.parametrize("call", ["basins", "attractors", "basin_fractions"])
def test_every_is_found_without_forcing_and_refused_with_it(call):
    rest = {
        "basins": dict(x=X, v=V),
        "attractors": dict(start=[0.1, 0.0]),
        "basin_fractions": dict(samples=4, x=SPAN_X),
    }[call]
    turn = 2 * np.pi / np.sqrt(1 - 0.05**2)
    assert getattr(sl, call)(unforced, **rest).attrs["every"] == pytest.approx(turn, rel=0.2)
    with pytest.raises(ParameterError, match="name it by forced_at="):
        getattr(sl, call)(driven, **rest)
    with pytest.raises(ParameterError, match=r"is forced.*Leave every= out"):
        getattr(sl, call)(RIG, every=1.0, **rest)


@pytest.mark.parametrize("every", [0, -1.0, math.nan, math.inf, True, [1.0]])
def test_every_must_be_a_positive_time(every):
    with pytest.raises(ParameterError, match="every"):
        sl.attractors(unforced, [0.1, 0.0], every=every)
    with pytest.raises(UnitError, match="every"):
        sl.attractors(unforced, [0.1, 0.0], every="1 m")


@pytest.mark.parametrize("call", ["basins", "attractors", "basin_fractions"])
def test_a_system_must_be_one(call):
    rest = {
        "basins": dict(x=X, v=V),
        "attractors": dict(start=[0.1, 0.0]),
        "basin_fractions": dict(samples=4, x=SPAN_X),
    }[call]
    with pytest.raises(ParameterError, match="must be a System, not str"):
        getattr(sl, call)("rig", **rest)
    with pytest.raises(ParameterError, match=r"Call it: sl\.models\.delangre\(\)\.$"):
        getattr(sl, call)(sl.models.delangre, **rest)
    with pytest.raises(ParameterError, match=r"sl\.System\.from_dict"):
        getattr(sl, call)(sl.models.delangre().to_dict(), **rest)
    with pytest.raises(ParameterError, match=r"Put @sl\.system"):
        getattr(sl, call)(lambda t, x, v: (v, -x), **rest)


@pytest.mark.parametrize("call", ["basins", "attractors", "basin_fractions"])
def test_a_method_must_be_one(call):
    rest = {
        "basins": dict(x=X, v=V),
        "attractors": dict(start=[0.1, 0.0]),
        "basin_fractions": dict(samples=4, x=SPAN_X),
    }[call]
    with pytest.raises(ParameterError, match="method must be such as"):
        getattr(sl, call)(RIG, method="Taylor", **rest)


def test_starts_of_attractors_are_checked():
    with pytest.raises(ParameterError, match="start of x isn't finite"):
        sl.attractors(RIG, [math.nan, 0.0])
    with pytest.raises(ParameterError, match="no state 'y'"):
        sl.attractors(RIG, {"y": 0.0, "v": 0.0})
    with pytest.raises(ParameterError, match="2 numbers"):
        sl.attractors(RIG, [0.0])


@pytest.mark.parametrize(
    ("box", "message"),
    [
        ({"y": SPAN_X}, "no state 'y'"),
        ({}, "give a range for at least one state of x, v"),
        ({"x": (0, 0)}, "range of x is empty"),
        ({"x": (1, 0)}, "range of x is empty"),
        ({"x": (math.nan, 1)}, "not a finite number"),
        ({"x": (0, math.inf)}, "not a finite number"),
        ({"x": (0, 1, 5)}, r"x must be \(low, high\)"),
        ({"x": ("1 kg", "2 kg")}, "x is measured in m"),
        ({"x": 1.0}, r"x must be \(low, high\)"),
    ],
    ids=["unknown", "none", "empty", "reversed", "nan", "inf", "three", "unit", "number"],
)
def test_boxes_that_are_refused(box, message):
    with pytest.raises((ParameterError, UnitError), match=message):
        sl.basin_fractions(RIG, samples=4, **box)


def test_at_is_checked_by_basin_fractions():
    with pytest.raises(ParameterError, match="no state 'y'"):
        sl.basin_fractions(RIG, samples=4, at={"y": 0.0}, x=SPAN_X)


def test_the_number_of_scouts_is_read_when_a_plan_is_made(monkeypatch):
    """Tests set it: a default that was read with the class made all of them run with 1024."""
    monkeypatch.setattr(plans, "SCOUTS", 7)
    assert plan().scouts == 7
