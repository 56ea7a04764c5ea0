"""Grids of parameters and the responses over them: what users may write, threads,
shares, Ctrl-C.
"""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.attractors.grid import axis, grid_of
from saltus.analysis.inputs.starts import ensemble
from saltus.errors import ParameterError, UnitError

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")


# -- what users write ------------------------------------------------------------------------------
def test_an_axis_is_linear_or_logarithmic_or_an_array():
    np.testing.assert_allclose(axis(RIG, "frequency", ("10 Hz", "0.02 kHz", 3)), [10, 15, 20])
    np.testing.assert_allclose(
        axis(RIG, "contact_stiffness", ("1 kN/m", 1e5, 3, "log")), [1e3, 1e4, 1e5]
    )
    np.testing.assert_allclose(axis(RIG, "frequency", np.array([3.0, 4.0])), [3, 4])


@pytest.mark.parametrize(
    "given",
    [
        [2, 3, 4],
        [2.0, 3, "4 Hz"],
        ["2 Hz", "3 Hz", "0.004 kHz"],
        (2, 4, 3),
        ("2 Hz", 4.0, 3.0),
        np.array([2, 3, 4]),
    ],
)
def test_a_list_holds_the_values_and_a_tuple_is_a_range(given):
    np.testing.assert_allclose(axis(RIG, "frequency", given), [2, 3, 4])
    values = ensemble(RIG, (0.0, 0.0), {"frequency": given}).varied["frequency"]
    np.testing.assert_allclose(values, [2, 3, 4])


def test_a_tuple_of_starts_is_a_range_too():
    group = ensemble(RIG, {"x": (0.0, "2 mm", 3), "v": [0.0, 1.0, 2.0]}, None)
    np.testing.assert_allclose(group.start, [[0.0, 0.0], [1e-3, 1.0], [2e-3, 2.0]])


@pytest.mark.parametrize(
    ("name", "given", "words"),
    [
        ("frequenzy", ("1 Hz", "2 Hz", 3), "Did you mean 'frequency'"),
        ("frequency", ("2 Hz", "1 Hz", 3), "must ascend"),
        ("frequency", ("1 Hz", "2 Hz", 3, "logarithmic"), "Known: linear, log"),
        ("frequency", ("1 Hz", "2 Hz"), "must be a range \\(first, last, number of values\\)"),
        ("frequency", ("1 Hz", "2 Hz", 2.5), "whole number"),
        ("frequency", np.array([1.0, np.nan]), "nan|finite"),
        ("force", ("-1 N", "1 N", 3, "log"), "can't have a log scale"),
        ("frequency", 3.0, "must be"),
    ],
)
def test_a_wrong_axis_says_what_to_write(name, given, words):
    with pytest.raises(ParameterError, match=words):
        axis(RIG, name, given)


def test_a_wrong_unit_is_refused():
    with pytest.raises(UnitError, match="frequency"):
        axis(RIG, "frequency", ("1 mm", "2 Hz", 3))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (dict(start="random"), "sweep_up|random 20"),
        (dict(start="random 20"), "box="),
        (dict(start="sweep_upp"), "Did you mean 'sweep_up'"),
        (dict(start="random 20", box={"x": (1.0, -1.0)}), "must ascend"),
        (dict(start="random 20", box={"y": (-1.0, 1.0)}), "Did you mean|no state 'y'"),
        (dict(start=(0.0, 0.0), box={"x": (-1.0, 1.0)}), "box= is for random starts"),
        (dict(start=(0.0,)), "2 numbers"),
        (dict(start=(np.nan, 0.0)), "isn't finite"),
        (dict(start=(0.0, 0.0), values={"forse": 1.0}), "Did you mean 'force'"),
        (dict(start=(0.0, 0.0), periods=0), "periods"),
    ],
)
def test_wrong_arguments_say_what_to_write(arguments, words):
    with pytest.raises(ParameterError, match=words):
        sl.frequency_response(RIG, ("14 Hz", "15 Hz", 2), **arguments)


def test_two_parameters_can_not_be_swept_and_three_not_varied():
    two = {"frequency": ("14 Hz", "15 Hz", 2), "force": ("1 N", "2 N", 2)}
    with pytest.raises(ParameterError, match="a sweep follows one parameter"):
        sl.bifurcation_diagram(RIG, two, follow=True)
    with pytest.raises(ParameterError, match="one or two"):
        sl.bifurcation_diagram(RIG, {**two, "mass": ("2 kg", "3 kg", 2)})


def test_an_unforced_system_is_told_what_to_give():
    @sl.system(states="x v")
    def free(t, x, v, *, stiffness=1.0):
        return v, -stiffness * x

    with pytest.raises(
        ParameterError,
        match=r"Take sl\.bifurcation_diagram over another "
        r"parameter;",
    ):
        sl.frequency_response(free, (1.0, 2.0, 3))
    with pytest.raises(ParameterError, match="it has no stroboscope"):
        sl.bifurcation_diagram(free, {"stiffness": (1.0, 2.0, 3)}, every=1.0, sample="stroboscope")
    with pytest.raises(ParameterError, match=r"is forced.*Leave every= out"):
        sl.bifurcation_diagram(RIG, {"force": (1.0, 2.0, 3)}, every=1.0)


def test_a_huge_grid_is_refused_before_it_fills_memory():
    with pytest.raises(ParameterError, match="coarser grid"):
        grid_of(
            RIG,
            {"frequency": ("1 Hz", "2 Hz", 100_000)},
            {"x": np.zeros(100_000), "v": 0.0},
            None,
            None,
            1,
            False,
        )


def test_contacts_of_a_method_without_them_are_refused():
    with pytest.raises(ParameterError, match="locates no contacts"):
        sl.bifurcation_diagram(
            RIG, {"force": ("1 N", "2 N", 2)}, sample="contacts", method=sl.ODE45(events="ignore")
        )
    with pytest.raises(ParameterError, match="Did you mean 'stroboscope'"):
        sl.bifurcation_diagram(RIG, {"force": ("1 N", "2 N", 2)}, sample="stroboscop")


# -- what comes out --------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def few():
    return sl.frequency_response(
        RIG,
        ("14.5 Hz", "16 Hz", 4),
        start="random 40",
        box={"x": ("-5 mm", "5 mm"), "v": ("-1 m/s", "1 m/s")},
    )


def test_threads_change_nothing_and_the_order_of_starts_only_the_last_digits(few):
    box = {"x": ("-5 mm", "5 mm"), "v": ("-1 m/s", "1 m/s")}
    one = sl.frequency_response(RIG, ("14.5 Hz", "16 Hz", 4), start="random 40", box=box, threads=1)
    assert one.attrs["result_hash"] == few.attrs["result_hash"]
    starts = {"x": few.start_x.values[11::-1], "v": few.start_v.values[11::-1]}
    alone = sl.frequency_response(RIG, np.array([15.0]), start=starts)
    # Newton's method from another start
    np.testing.assert_allclose(alone.rms.values[0, ::-1], few.rms.values[1, :12], rtol=1e-12)
    np.testing.assert_array_equal(alone.period.values[0, ::-1], few.period.values[1, :12])


def test_shares_of_random_starts_add_up_and_lie_in_their_intervals(few):
    for value in few.frequency.values:
        here = few.response_frequency.values == value
        settled = (few.response_of.sel(frequency=value) >= 0).mean().item()
        assert few.response_share.values[here].sum() == pytest.approx(settled)
    assert (
        (few.response_share_low <= few.response_share)
        & (few.response_share <= few.response_share_high)
    ).all()


def test_every_cell_is_that_of_its_response(few):
    of = few.response_of.values
    for name, column in (
        ("rms", "response_rms"),
        ("peak", "response_peak"),
        ("period", "response_period"),
    ):
        np.testing.assert_array_equal(few[name].values[of >= 0], few[column].values[of[of >= 0]])
    assert (
        few.response_frequency.values[of[of >= 0]]
        == np.broadcast_to(few.frequency.values[:, None], of.shape)[of >= 0]
    ).all()


def test_results_survive_a_file(few, tmp_path):
    again = sl.load(sl.save(few, tmp_path / "few.nc"))
    assert again.attrs["result_hash"] == few.attrs["result_hash"]
    np.testing.assert_array_equal(again.response_of.values, few.response_of.values)


def test_two_parameters_give_a_map_of_types():
    vary = {"frequency": ("14 Hz", "16 Hz", 3), "force": ("1 N", "4 N", 2)}
    ds = sl.bifurcation_diagram(RIG, vary, start=(1e-3, 0.0))
    assert ds.response_of.dims == ("frequency", "force", "start")
    one = sl.frequency_response(RIG, np.array([15.0]), start=(1e-3, 0.0), values={"force": "1 N"})
    assert ds.rms.sel(frequency=15.0, force=1.0).item() == one.rms.item()


def test_ctrl_c_keeps_what_is_known():
    calls = []

    def press(share):
        calls.append(share)
        if share > 1 / 9:  # the first of nine frequencies is done
            raise KeyboardInterrupt

    with pytest.raises(sl.Interrupted) as stop:
        sl.frequency_response(
            RIG, ("14 Hz", "16 Hz", 9), follow=True, start=(0.0, 0.0), progress=press
        )
    part = stop.value.partial
    assert part.response_of.values[0, 0] == 0
    assert (part.type.values[1:] == "not_computed").all()


def test_a_chaotic_response_is_typed_and_shown():
    rig = sl.models.delangre("c", force="4 N", frequency="5 Hz")
    ds = sl.bifurcation_diagram(rig, {"contact_stiffness": np.array([3e8])}, start=(0.32e-3, 0.0))
    assert ds.type.item() == "chaotic"
    assert ds.response_exponent.item() > 4 * ds.response_exponent_error.item() > 0
    assert np.isfinite(ds.sample_x.values).sum() > 100


@pytest.mark.parametrize(
    "axes",
    [
        {"frequency": ("14 Hz", "16 Hz", 2)},
        {"frequency": ("14 Hz", "16 Hz", 2), "force": ("1 N", "2 N", 2)},
    ],
)
def test_where_nothing_is_found_the_result_says_so(axes, tmp_path):
    """Starts beyond the range of numbers: all escape."""
    ds = sl.bifurcation_diagram(RIG, axes, {"x": 1e200, "v": 0.0}, progress=False)
    assert ds.sizes["response"] == 0
    assert (ds["response_of"].values == -1).all()
    assert (ds["type"].values == "escaped").all()
    sl.save(ds, tmp_path / "none.nc")
    assert sl.load(tmp_path / "none.nc").identical(ds)
