"""What sl.fit takes, refuses and says."""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.fits.measurement import measurement
from saltus.errors import ParameterError, SaltusError, SaltusWarning, UnitError

RIG = sl.models.delangre("a", force="4 N", frequency="8 Hz")
GAP = {"upper_gap": ("0.1 mm", "2 mm")}
TIME = np.linspace(0.01, 1.0, 50)
X = 1e-3 * np.sin(40 * TIME)


def changed(array, place, value):
    array = array.copy()
    array[place] = value
    return array


@pytest.mark.parametrize(
    ("measured", "free", "more", "message"),
    [
        ({"t": TIME, "x": changed(X, 7, np.nan)}, GAP, {}, r"isn't finite at 1 .* index 7"),
        ({"t": changed(TIME, 3, np.nan), "x": X}, GAP, {}, "times .* finite numbers .*index 3"),
        ({"t": changed(TIME, 4, 0.0), "x": X}, GAP, {}, r"don't ascend: 0 follows .* Sort"),
        ({"t": TIME, "x": np.ones(50)}, GAP, {}, "measured x is constant"),
        ({"t": TIME, "x": X[1:]}, GAP, {}, "t has 50, x has 49"),
        ({"t": TIME, "y": X}, GAP, {}, r"holds 'y'.*neither the time t nor a state"),
        ({"x": X}, GAP, {}, "no times"),
        ({"t": TIME}, GAP, {}, "no state or output"),
        (3, GAP, {}, "measured must be a Dataset, a mapping of arrays or the path"),
        ({"t": TIME, "x": (X, "N")}, GAP, {}, "measured x is in 'N'"),
        ({"t": TIME[:1], "x": X[:1]}, GAP, {}, "constant"),
        ({"t": TIME[:2], "x": X[:2]}, {**GAP, "force": (1, 9)}, {}, "too few for 2 unknowns"),
        ({"t": TIME, "x": X}, {"upper_gap": ("2 mm", "0.1 mm")}, {}, "must ascend"),
        ({"t": TIME, "x": X}, {"x(0)": ("1 mm", "-1 mm")}, {}, r"bounds of x\(0\) must ascend"),
        ({"t": TIME, "x": X}, {"uper_gap": (0, 1)}, {}, "Did you mean 'upper_gap'"),
        ({"t": TIME, "x": X}, {"upper_gap": "1 mm"}, {}, r"must be \(low, high\)"),
        ({"t": TIME, "x": X}, {"upper_gap": ("1 N", "2 N")}, {}, "upper_gap"),
        ({"t": TIME, "x": X}, {}, {}, "free must be unknowns with their bounds"),
        ({"t": TIME, "x": X}, GAP, {"noise": 0}, "noise of x must be positive.*estimated"),
        ({"t": TIME, "x": X}, GAP, {"noise": {"v": 1}}, "noise of 'v', which wasn't measured"),
        ({"t": TIME, "x": X}, GAP, {"noise": "1 s"}, "noise of x"),
        ({"t": TIME, "x": X}, GAP, {"noise": 1, "weights": 1}, "only one of them"),
        ({"t": TIME, "x": X}, GAP, {"t_start": 0.5}, "motion starts at 0.5 s"),
        ({"t": TIME, "x": X}, GAP, {"start": {"x": [0, 1], "v": 0}}, "one start"),
        ("none.csv", GAP, {}, "none.csv"),
        ({"frequency": 8 + TIME, "x": X}, {"x(0)": (0, 1)}, {}, r"x\(0\) can't be free where resp"),
        ({"frequency": 8 + TIME, "x": X}, {"frequency": (7, 9)}, {}, "frequency can't be free"),
        ({"frequency": 8 + TIME, "x": X}, GAP, {"quantity": "size"}, "quantity='size'"),
    ],
)  # fmt: skip
def test_what_can_not_be_used_is_answered_in_a_sentence(measured, free, more, message):
    with pytest.raises(SaltusError, match=message) as refused:
        sl.fit(RIG, measured, free, **more)
    assert str(refused.value).count("\n") == 0


def test_a_file_needs_units_and_says_where_it_is_wrong(tmp_path):
    file = tmp_path / "run.csv"
    for text, message in (
        ("t [s], x\n0.1, 1\n", "column 'x' has no unit"),
        ("t [s], x [N]\n0.1, 1\n", "wrong unit"),
        ("t [s], x [mm]\n0.1, one\n", "line 2"),
        ("t [s], x [mm]\n0.1, 1\n0.2,\n", "line 3"),
        ("", "no times"),
    ):
        file.write_text(text)
        with pytest.raises(SaltusError, match=message):
            sl.fit(RIG, file, GAP)


def test_units_of_a_mapping_a_dataset_and_a_file_are_read(tmp_path):
    run = sl.simulate(RIG, periods=6, samples=8)
    file = tmp_path / "run.csv"
    rows = [
        f"{1e3 * t!r}, {1e3 * x!r}, 7"
        for t, x in zip(run.time.values.tolist(), run.x.values.tolist(), strict=True)
    ]
    file.write_text("\n".join(["time [ms], x [mm], other", *rows]))
    given = (
        run[["x"]],
        {"t": run.time.values, "x": run.x.values},
        {"t": (1e3 * run.time.values, "ms"), "x": (1e3 * run.x.values, "mm")},
        file,
    )
    for one in given:
        found = measurement(RIG, one, missing=False)
        assert (found.outputs, found.units, found.along) == (("x",), ("m",), "time")
        assert found.at == pytest.approx(run.time.values, rel=1e-14)
        assert found.values[:, 0] == pytest.approx(run.x.values, rel=1e-14)


def test_a_missing_sample_counts_for_nothing_where_it_is_said_to_be_one():
    run = sl.simulate(RIG, periods=6, samples=8)
    x = run.x.values.copy()
    x[5:9] = np.nan
    found = sl.fit(
        RIG, {"t": run.time.values, "x": x}, GAP, values={"upper_gap": "0.5 mm"}, starts=4,
        missing=True,
    )  # fmt: skip
    assert found.value.item() == pytest.approx(RIG.values["upper_gap"], rel=1e-9)
    assert np.isnan(found.residual.values[5:9]).all()
    assert f"{run.sizes['time'] - 4} measured values" in sl.describe(found)


def test_a_budget_ends_the_search_and_is_told():
    run = sl.simulate(RIG, periods=6, samples=8)
    found = sl.fit(RIG, run[["x"]], GAP, values={"upper_gap": "1.5 mm"}, flows=9, starts=8)
    assert found.flows.item() <= 9
    assert found.attrs["ended"] == "budget"
    assert "budget of motions ended the search" in sl.describe(found)


def test_stopped_by_the_user_it_gives_the_best_so_far():
    run, stop = sl.simulate(RIG, periods=6, samples=8), sl.Stop()
    with stop, pytest.raises(sl.Interrupted) as stopped:
        sl.fit(
            RIG, run[["x"]], GAP, values={"upper_gap": "1.5 mm"},
            progress=lambda share: stop.set() if share > 0.1 else None,
        )  # fmt: skip
    part = stopped.value.partial
    assert part.misfit.item() > 0
    assert 1e-4 < part.value.item() < 2e-3


def test_units_must_fit():
    with pytest.raises(UnitError):
        sl.fit(RIG, {"t": (TIME, "mm"), "x": X}, GAP)
    with pytest.raises(ParameterError, match="start of x isn't finite"):
        sl.fit(RIG, {"t": TIME, "x": X}, GAP, start=(np.nan, 0))


@pytest.mark.parametrize(
    ("measured", "message"),
    [
        ({"t": 1e3 * TIME[:9], "x": X[:9]}, "162 forcing periods apart.*milliseconds"),
        ({"t": TIME[:9], "x": 1e3 * X[:9]}, r"measured x is \S+ times as large.*are in m:"),
    ],
)
def test_a_unit_that_was_forgotten_is_doubted(measured, message):
    with pytest.warns(SaltusWarning, match=message):
        sl.fit(RIG, measured, GAP, starts=1, flows=2)
