"""Files: netCDF of both kinds, CSV, MATLAB. Numbers come back bit for bit, the same result gives
the same bytes.
"""

import csv

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy.io import loadmat

from made_results import Contacts
from saltus.errors import ParameterError
from saltus.results import content_hash, load, save, to_csv, to_mat
from saltus.results.files import export
from unit.results.conftest import PROVENANCE, sine_points, sine_run

# exact in every version of pandas, and the default from version 4 on
pytestmark = pytest.mark.filterwarnings("ignore:The 'float_precision' argument is deprecated")
CASES = {
    "single": sine_run,
    "batch": lambda: sine_run((2e-3, 0.5e-3), batch=True),
    "own periods": lambda: sine_run((2e-3, 2e-3), frequencies=[1.0, 4.0], batch=True),
    "no contact": lambda: sine_run((0.5e-3,)),
    "no guard": lambda: sine_run(guards=()),
    "stroboscope": sine_points,
}


@pytest.fixture(params=["h5netcdf", "scipy"])
def engine(request, monkeypatch):
    """Both kinds of netCDF; without h5netcdf, save falls back to SciPy's."""
    if request.param == "scipy":
        monkeypatch.setattr(export, "_has", lambda _: False)
    return request.param


@pytest.mark.parametrize("case", CASES)
def test_netcdf_of_xarray_keeps_everything(case, engine, tmp_path, untried):
    run = CASES[case]()
    run.to_netcdf(tmp_path / "run.nc", engine=engine)
    back = load(tmp_path / "run.nc")
    xr.testing.assert_identical(back, run)
    assert xr.load_dataset(tmp_path / "run.nc", engine=engine).identical(run)


@pytest.mark.parametrize("case", CASES)
def test_save_and_load_return_the_same(case, engine, tmp_path):
    run = CASES[case]()
    back = load(save(run, tmp_path / "run.nc"))
    xr.testing.assert_identical(back, run)
    for name, variable in run.variables.items():
        assert back[name].dtype.kind == variable.dtype.kind, name
        assert variable.dtype.kind == "U" or back[name].dtype == variable.dtype, name
    assert {key: type(value) for key, value in back.attrs.items()} == {
        key: type(value) for key, value in run.attrs.items()
    }
    assert content_hash(back) == run.attrs["result_hash"]


def test_nan_and_infinity_come_back(engine, tmp_path):
    run = sine_run()
    run["x"].values[:3] = np.nan, np.inf, -0.0
    back = load(save(run, tmp_path / "run.nc"))
    assert back["x"].values.tobytes() == run["x"].values.tobytes()


def test_a_count_beyond_32_bits_needs_netcdf4(engine, tmp_path):
    run = sine_run(counters={"steps": [2**40]})
    if engine == "scipy":
        with pytest.raises(ParameterError, match=r"saltus\[io\]"):
            save(run, tmp_path / "run.nc")
        assert not list(tmp_path.iterdir())
    else:
        assert load(save(run, tmp_path / "run.nc"))["steps"].item() == 2**40


@pytest.mark.parametrize("suffix", [".nc", ".csv", ".mat"])
def test_the_same_result_gives_the_same_bytes(suffix, engine, tmp_path):
    first, second = (save(sine_run(), tmp_path / f"{i}{suffix}").read_bytes() for i in range(2))
    assert first == second
    assert b"Created on" not in first  # scipy's header of .mat holds the time of day


def test_save_refuses_other_suffixes(run, tmp_path):
    with pytest.raises(ParameterError, match=r"Did you mean '\.nc'"):
        save(run, tmp_path / "run.ncd")


@pytest.mark.parametrize("write", [save, to_csv, to_mat])
def test_only_results_are_written(write, tmp_path):
    with pytest.raises(ParameterError, match="saltus_result"):
        write(xr.Dataset({"x": 1.0}), tmp_path / "run.nc")


# -- CSV -------------------------------------------------------------------------------------------
def read(path):
    return pd.read_csv(path, comment="#", float_precision="round_trip")


def test_csv_has_units_and_all_digits(run, tmp_path):
    table = read(to_csv(run, tmp_path / "run.csv"))
    assert table.columns.tolist() == ["time [s]", "period", "x [m]", "v [m/s]", "mode"]
    assert table["v [m/s]"].values.tobytes() == run["v"].values.tobytes()
    assert table["mode"].tolist() == run["mode"].values.tolist()


def test_csv_of_contacts(run, tmp_path):
    to_csv(run, tmp_path / "run.csv")
    table = read(tmp_path / "run_contacts.csv")
    assert table.columns.tolist() == [
        "time [s]",
        "time_error [s]",
        "guard",
        "direction",
        "velocity [m/s]",
        "kind",
        "mode_before",
        "mode_after",
        "steps",
        "x [m]",
        "v [m/s]",
    ]
    assert table["time [s]"].values.tobytes() == run["contact_time"].values.tobytes()
    assert table["kind"].unique().tolist() == ["crossing"]
    assert len(list(tmp_path.iterdir())) == 2


def test_csv_of_a_batch_is_long(batch, tmp_path):
    table = read(to_csv(batch, tmp_path / "run.csv"))
    assert table["trajectory"].tolist() == np.repeat([0, 1, 2], 49).tolist()
    assert np.array_equal(table["x [m]"].values.reshape(3, 49), batch["x"].values)
    assert np.array_equal(table["time [s]"].values.reshape(3, 49)[2], batch["time"].values)
    each = read(tmp_path / "run_trajectories.csv")
    assert each["status"].tolist() == ["ok"] * 3
    assert each["events"].tolist() == [6, 0, 6]
    assert (
        read(tmp_path / "run_contacts.csv")["trajectory"].tolist()
        == batch["contact_trajectory"].values.tolist()
    )


def test_csv_of_trajectories_with_periods_of_their_own(tmp_path):
    run = CASES["own periods"]()
    table = read(to_csv(run, tmp_path / "run.csv"))
    assert np.array_equal(table["time [s]"].values.reshape(2, 49), run["time"].values)
    assert read(tmp_path / "run_trajectories.csv")["frequency [Hz]"].tolist() == [1.0, 4.0]


def test_csv_says_where_it_comes_from(tmp_path):
    run = sine_run(attrs={**PROVENANCE, "source": "two\nlines"})
    to_csv(run, tmp_path / "run.csv")
    lines = (tmp_path / "run.csv").read_text(encoding="utf-8").splitlines()
    notes = [line for line in lines if line.startswith("#")]
    assert len(lines) == len(notes) + 1 + 49
    for part in (
        "# system: sine",
        '# source: "two\\nlines"',
        f"# result_hash: {run.attrs['result_hash']}",
        "# status: ok",
        "# guard gap: x = 0.001 m",
    ):
        assert part in notes


def test_csv_of_stroboscope(tmp_path):
    table = read(to_csv(sine_points(), tmp_path / "points.csv"))
    assert table.columns.tolist() == ["trajectory", "period", "x [m]", "v [m/s]"]
    assert table["period"].tolist() == [10**6, 10**6 + 1, 10**6 + 2, 10**6 + 3] * 2
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "points.csv",
        "points_trajectories.csv",
    ]


def test_csv_quotes_what_holds_a_comma(tmp_path):
    run = sine_run(guards=("max(x, 0)",))
    to_csv(run, tmp_path / "run.csv")
    rows = [
        row
        for row in csv.reader((tmp_path / "run_contacts.csv").open())
        if not row[0].startswith("#")
    ]
    assert {len(row) for row in rows} == {11}
    assert rows[1][2] == "max(x, 0)"


# -- MATLAB ----------------------------------------------------------------------------------------
def test_mat_reads_back(run, tmp_path):
    back = loadmat(to_mat(run, tmp_path / "run.mat"), simplify_cells=True)
    assert back["x"].tobytes() == run["x"].values.tobytes()
    assert back["contact"]["time"].tobytes() == run["contact_time"].values.tobytes()
    assert list(back["contact"]["guard"]) == ["gap"] * 6
    assert (back["guard"]["name"], back["guard"]["boundary"]) == ("gap", 1e-3)
    assert (back["status"], back["events"], back["units"]["v"]) == ("ok", 6, "m/s")
    assert back["provenance"]["source"] == "Müller & Söhne, §3"
    assert back["provenance"]["result_hash"] == run.attrs["result_hash"]
    assert "names" not in back


def test_mat_has_columns_and_cells(batch, tmp_path):
    back = loadmat(to_mat(batch, tmp_path / "run.mat"))
    assert back["time"].shape == (49, 1)
    assert back["x"].shape == (49, 3)
    assert np.array_equal(back["x"], batch["x"].values.T)
    assert back["status"].dtype == object
    assert back["contact"]["kind"][0, 0].dtype == object
    assert back["mode"].dtype == np.int64


def test_mat_names_are_ones_that_matlab_takes(tmp_path):
    states = ("end", "_y", "größe", "a" * 40, "a" * 41)
    x = np.zeros((1, 49))
    run = sine_run(
        guards=(),
        states=states,
        values=dict.fromkeys(states, x),
        end=dict.fromkeys(states, (0.0,)),
        units={},
        contacts=_no_contacts(5),
    )
    back = loadmat(to_mat(run, tmp_path / "run.mat"), simplify_cells=True)
    names = [
        name
        for name in (*back, *back["contact"], *back["provenance"], *back["units"])
        if not name.startswith("__")
    ]
    assert all(
        name.isascii()
        and name.isidentifier()
        and name[0].isalpha()
        and len(name) <= 31
        and name != "end"
        for name in names
    )
    assert back["names"]["v_end"] == "end"
    assert back["names"]["gr__e"] == "größe"
    assert {back["names"]["a" * 31], back["names"]["a" * 29 + "_2"]} == {"a" * 40, "a" * 41}


def _no_contacts(states):
    none = np.empty(0)
    return Contacts(*[none] * 6, [], np.empty((0, states)), none, none, none)


@pytest.mark.parametrize("case", CASES)
def test_every_result_becomes_a_mat_file(case, tmp_path):
    run = CASES[case]()
    back = loadmat(to_mat(run, tmp_path / "run.mat"), simplify_cells=True)
    assert back["provenance"]["result_hash"] == run.attrs["result_hash"]


def test_the_accessor_does_the_same(run, tmp_path):
    assert (
        run.saltus.to_csv(tmp_path / "a.csv").read_bytes()
        == to_csv(run, tmp_path / "b.csv").read_bytes()
    )
    assert (
        run.saltus.to_mat(tmp_path / "a.mat").read_bytes()
        == to_mat(run, tmp_path / "b.mat").read_bytes()
    )
    assert run.saltus.save(tmp_path / "a.nc").exists()
    assert "sine" in run.saltus.describe()
