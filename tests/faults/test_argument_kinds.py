"""Odd arguments of what takes a result, of a System's methods, of pictures and of the functions of
an equation are refused in words.
"""

import inspect
import random

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import pytest
import xarray as xr

import motions_data
import saltus as sl
from faults.test_python_arguments import ODD, only_arguments, rig  # noqa: F401  a fixture
from saltus.errors import LONGEST, ParameterError, StudyError, UnitError, shown
from saltus.results.files.atomic import ResultFileError
from unit.plot.responses_data import resonance
from unit.results.conftest import sine_points, sine_run
from unit.results.dataset.responses_data import responses

pytestmark = pytest.mark.filterwarnings("ignore")

#: What is long, beside what is odd.
LONG = [
    "y" * 10_000,
    b"z" * 10_000,
    list(range(9000)),
    {str(i): i for i in range(3000)},
    ["q" * 5000],
    {"x": "w" * 9999},
    np.arange(5000.0),
    np.array(["one"])[0],
    "\x1b[31m" * 500,
    [[[[[[1]]]]]],
]
RESULTS = [
    sine_run(),
    sine_run((2e-3, 1e-3), batch=True),
    sine_points(),
    responses(),
    resonance(20),
    motions_data.section(),
    motions_data.spectrum(2),
    motions_data.impacts(),
    motions_data.energy(),
    xr.Dataset(),
    sine_run().assign_attrs(states=5),
]
#: What suits an argument, by its name.
SUITS = {
    "state": ["x", "v", ["x", "v"]], "window": ["hann", "none"], "last": [1, 2],
    "tolerance": [1e-3], "output": ["x"], "to": ["v"],
    "by": ["rms"], "series": [np.sin(np.arange(400) ** 1.1)],
    "sampling_interval": [0.1, np.arange(400.0)], "t": [0.0, np.zeros(3)],
    "y": [(1e-3, 0.0), np.zeros((2, 3))], "name": ["x", "force"], "value": [1.0, "1 N"],
    "values": [None, {}, {"frequency": 5.0}],
    "trajectory": [0, None], "units": [{"x": "mm"}], "periods": [1, (0, 1)], "quantity": ["peak"],
    "a": [0.5], "b": [0.5],
    "stiffness": [2.0], "gap": [0.25], "surface": [("x", 0.0)], "start": [(1e-3, 0.0)],
    "direction": [0, 1], "system": [rig],
    "condition": [True], "energy": [lambda x: x * x], "supplied": [lambda x: x],
    "dissipated": [lambda x: x],
}  # fmt: skip
FUNCTIONS = {
    f"sl.{name}": getattr(sl, name)
    for name in ("transmissibility", "compare", "spectrum", "settled", "wolf", "contacts",
        "samples", "describe", "poincare",
                 "impact_statistics", "energy_balance", "abs", "atan2", "clip", "cosh", "freeplay",
                 "heaviside", "hypot", "log", "mod",
                 "piecewise", "sign", "sin", "sqrt", "where")
} | {
    f"sl.plot.{name}": getattr(sl.plot,
        name) for name in sl.plot.__all__ if name not in ("OKABE_ITO", "style")
} | {
    f"rig.{name}": getattr(rig, name) for name in ("rhs", "with_values", "resolve", "period",
        "state_unit", "parameter_text", "from_dict")
}  # fmt: skip


def arguments(function, draw):
    """Some of a function's arguments: odd ones, long ones, and those that suit it."""
    given = {}
    for name, parameter in inspect.signature(function).parameters.items():
        if parameter.kind == parameter.VAR_KEYWORD:
            given[draw.choice(["force", "frequency", "mass"])] = draw.choice(ODD + LONG)
        elif name in ("ds", "run", "runs", "map_a", "map_b"):
            given[name] = draw.choice(RESULTS) if draw.random() < 0.9 else draw.choice(ODD)
        elif (
            parameter.kind != parameter.VAR_POSITIONAL
            and name not in ("method", "measured")
            and (parameter.default is parameter.empty or draw.random() < 0.25)
        ):
            suits = SUITS.get(name) if draw.random() < 0.6 else None
            given[name] = draw.choice(suits or ODD + LONG)
    return given


@pytest.mark.parametrize(
    ("seed", "trials"), [(3, 3000), pytest.param(None, 60_000, marks=pytest.mark.nightly)]
)
def test_arguments_of_another_kind_are_refused_in_words(only_arguments, seed, trials):  # noqa: F811
    seed = random.randrange(2**31) if seed is None else seed
    draw, refused, taken, messages = random.Random(seed), set(), set(), []
    for trial in range(trials):
        name, function = draw.choice(list(FUNCTIONS.items()))
        given = arguments(function, draw)
        try:
            function(**given)
            taken.add(name)
        except sl.SaltusError as error:
            refused.add(name)
            messages.append(f"{name}: {error}")
        except Exception as error:
            raise AssertionError(
                f"seed {seed}, trial {trial}: {name}({given}) ends in {error!r}"
            ) from error
        plt.close("all")
    assert refused == set(FUNCTIONS)
    assert len(taken) > len(FUNCTIONS) / 2, taken
    assert max(map(len, messages)) < 1000, max(messages, key=len)
    assert not [message for message in messages if "np.str_" in message or "np.float" in message]


# -- the words -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("call", "told"),
    [
        (
            lambda: rig.rhs(0, 5),
            "delangre has the states x, v, but y holds no row of them. Give "
            "one entry or row for each.",
        ),
        (lambda: rig.rhs("now", (0, 0)), "t must be a time"),
        (
            lambda: rig.rhs(np.zeros(3), np.zeros((2, 4))),
            r"t of the shape \(3,\) and y of the "
            r"shape \(2, 4\) don't fit",
        ),
        (
            lambda: sl.poincare(rig, (0, 0), ("x", 0.0), direction=np.array([1, 1]), periods=1),
            r"direction must be 0, 1 or -1, not array\(\[1, 1\]\)",
        ),
        (
            lambda: sl.frequency_response(rig, (14, 15, 2), threads=-1),
            "threads must be a whole number of at least 1",
        ),
        (
            lambda: sl.settled(sine_run(), tolerance=None),
            "sl.settled: tolerance must be a number, not None.",
        ),
        (
            lambda: sl.spectrum(sine_run(), last=[1]),
            r"last must be a whole number of at least 1, "
            r"not \[1\]",
        ),
        (
            lambda: sl.plot.history(sine_run(), units="mm"),
            "plot.history: units must be a mapping such as {'x': 'mm'}",
        ),
        (
            lambda: sl.plot.history(sine_run(), stat="x"),
            "plot.history has no argument 'stat'. Did you mean 'state'?",
        ),
        (
            lambda: sl.impact_statistics(rig, (0, 0), periods=1, force=np.array([1.0, 2.0])),
            "force must be a mapping by the names of boundaries",
        ),
        (lambda: sl.sqrt(-1.0), r"sl.sqrt\(-1.0\) has no finite real value"),
        (lambda: sl.sin([1.0]), "an equation holds"),
        (lambda: rig.with_values(force=np.str_("one")), "force = 'one' can't be read"),
        (lambda: sl.to_csv(sine_run(), "a\0b"), "isn't the path of a file"),
        (lambda: sl.to_csv(sine_run(), "a" * 5000), "can't be written"),
    ],
)
def test_what_once_ended_inside(call, told):
    with pytest.raises(sl.SaltusError, match=told):
        call()


def test_numbers_of_numpy_and_without_axes_are_numbers():
    run = sine_run()
    assert sl.settled(run, tolerance=np.float32(2**-20), last=np.int64(2)).identical(
        sl.settled(run, tolerance=2**-20, last=2)
    )
    np.testing.assert_array_equal(rig.rhs(0, [1, 0]), rig.rhs(0.0, (1.0, 0.0)))


class Angry:
    def __repr__(self):
        raise RuntimeError("never")


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (np.str_("one"), "'one'"),
        ([np.float64(0.5)], "[0.5]"),
        (np.array(["a"]), "array(['a'], dtype='<U1')"),
        (10**400, "a whole number of some 401 digits"),
        (-(10**5000), "a whole number of some 5001 digits"),
        ("a  b\n", r"'a  b\n'"),
        ("x" * 100, "'" + "x" * 75 + "...'"),
    ],
    ids=[
        "text of numpy",
        "number of numpy",
        "array",
        "large",
        "beyond what Python writes",
        "line end",
        "long",
    ],
)
def test_a_value_as_a_message_shows_it(value, text):
    assert shown(value) == text


def test_a_value_that_can_not_be_shown_is_named():
    assert "Angry" in shown(Angry())
    assert "\n" not in shown(rig)
    assert len(shown(list(range(10**6)))) <= 80


@pytest.mark.parametrize("kind", [ParameterError, StudyError, UnitError, ResultFileError])
def test_a_long_message_keeps_its_beginning_and_its_end(kind):
    text = str(kind("what is wrong " + "x" * 10_000 + " what to do"))
    assert len(text) <= LONGEST
    assert text.startswith("what is wrong")
    assert text.endswith("what to do")
    assert str(kind("short")) == "short"


# -- what would be lost in silence -----------------------------------------------------------------
MASKED = np.ma.array([1e-3, 9.0], mask=[False, True])


@pytest.mark.parametrize(
    "ask",
    [
        lambda: sl.simulate(rig, {"x": MASKED, "v": 0.0}, 2),
        lambda: sl.simulate(rig, [MASKED], 2),
        lambda: sl.simulate(rig, (0.0, 0.0), 2, values={"force": MASKED}),
        lambda: sl.basins(rig, x=MASKED, v=[0.0, 1.0]),
        lambda: sl.frequency_response(rig, MASKED),
        lambda: sl.table(0.5, MASKED, [0.0, 1.0]),
    ],
)
def test_a_mask_is_not_dropped(ask):
    with pytest.raises(sl.SaltusError, match="masks aren't supported"):
        ask()


def test_an_array_that_may_have_a_mask_and_has_none_is_an_array():
    masked, plain = ({"x": kind([1e-3, 2e-3]), "v": 0.0} for kind in (np.ma.array, np.array))
    assert sl.stroboscope(rig, masked, 2).identical(sl.stroboscope(rig, plain, 2))


@pytest.mark.parametrize(
    "column", [pd.Series, lambda values, index: xr.DataArray(values, {"run": index})]
)
def test_columns_whose_labels_differ_are_not_paired_row_by_row(column):
    x, v, turned = (
        column([1e-3, 2e-3], index=[0, 1]),
        column([0.1, 0.2], index=[0, 1]),
        column([0.2, 0.1], index=[1, 0]),
    )
    with pytest.raises(ParameterError, match="different labels in their index"):
        sl.stroboscope(rig, {"x": x, "v": turned}, 2)
    with pytest.raises(ParameterError, match="different labels"):
        sl.stroboscope(rig, {"x": x, "v": 0.0}, 2, values={"force": turned})
    plain = sl.stroboscope(rig, {"x": [1e-3, 2e-3], "v": [0.1, 0.2]}, 2)
    assert sl.stroboscope(rig, {"x": x, "v": v}, 2).identical(plain)


def test_a_state_is_not_called_as_another_in_a_result():
    with pytest.raises(sl.SaltusError, match="'end_x'; rename it"):

        @sl.system(states="x end_x")
        def first(t, x, end_x):
            return end_x, -x

    with pytest.raises(sl.SaltusError, match="'contact_v'; rename it"):

        @sl.system(states="contact_v v")
        def second(t, contact_v, v):
            return v, -contact_v


def test_a_parameter_is_not_called_as_something_else_in_the_result():
    @sl.system(states="x v")
    def spring(t, x, v, *, end_x=1.0):
        return v, -end_x * x

    with pytest.raises(ParameterError, match="'end_x' would stand for two things"):
        sl.simulate(spring, (1.0, 0.0), t_end=1.0, values={"end_x": [1.0, 2.0]})


def test_an_equation_nested_too_deeply_is_refused():
    @sl.system(states="x v")
    def tower(t, x, v):
        for _ in range(600):
            x = sl.sin(x) + 1.0
        return v, -x

    with pytest.raises(sl.SaltusError, match="hundreds of operations stand within one another"):
        sl.simulate(tower, (0.1, 0.0), t_end=1.0)


@pytest.mark.parametrize("what", [sl.models.delangre, lambda t, x: x])
def test_a_function_is_no_system(what):
    with pytest.raises(sl.SaltusError, match=r"Call it|@sl\.system"):
        sl.simulate(what, periods=3)
