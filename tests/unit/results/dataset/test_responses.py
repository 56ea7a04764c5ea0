"""Steady responses over parameters: what the schema promises, and files that bring
all of it back.
"""

import csv
import dataclasses

import numpy as np
import pytest
import xarray as xr

from made_results import Responses, Starts
from saltus.errors import ParameterError
from saltus.results import Guards, content_hash, describe, load, save
from saltus.results.dataset import schema
from saltus.results.dataset.kinds import Kind

from .responses_data import NO_RESPONSE, RESPONSE_OF, TABLE, responses, two_parameters

SAMPLED = Responses(
    TABLE,
    np.array([[0], [0], [1], [2], [2]]),
    np.array([0, 1, 0, 0, 2]),
    [np.full((n, 2), 1e-3 * n) for n in (2, 6, 2, 4, 9)],
)
CASES = {
    "frequency response": responses,
    "no guards": lambda: responses(guards=None),
    "a gap that varies": lambda: responses(
        guards=Guards(("stop",), ("x",), np.array([[1e-3, 2e-3, 3e-3]]))
    ),
    "two parameters": two_parameters,
    "samples": lambda: responses(responses=SAMPLED, sample="turning_points"),
    "no events": lambda: responses(events=None),
    "no response": lambda: responses(
        responses=Responses(NO_RESPONSE, np.zeros((0, 1)), np.zeros(0)),
        response_of=np.full((3, 2), -3),
        events=None,
    ),
    "sweep": lambda: responses(starts=Starts(directions=["up", "down"])),
    "no shares": lambda: responses(
        responses=Responses(
            dataclasses.replace(TABLE, fractions=None), SAMPLED.place, SAMPLED.branch
        )
    ),
}


@pytest.mark.parametrize("make", CASES.values(), ids=CASES)
@pytest.mark.parametrize("netcdf3", [False, True])
def test_a_file_brings_back_every_bit(make, netcdf3, tmp_path, monkeypatch):
    if netcdf3:
        monkeypatch.setattr("saltus.results.files.export._has", lambda package: False)
    ds = make()
    back = load(save(ds, tmp_path / "responses.nc"))
    xr.testing.assert_identical(back, ds)
    assert content_hash(back) == ds.attrs["result_hash"]
    assert {name: back[name].dtype.kind for name in back.variables} == {
        name: ds[name].dtype.kind for name in ds.variables
    }


@pytest.mark.parametrize("make", CASES.values(), ids=CASES)
def test_every_variable_says_what_it_is(make):
    ds = make()
    for name, variable in ds.variables.items():
        assert isinstance(variable.attrs["units"], str), name
        assert variable.attrs["long_name"], name
    assert schema.kind_of(ds) == "responses"


def test_the_grid_is_looked_up_in_the_responses():
    ds = responses()
    assert ds["response_of"].dims == ("frequency", "start")
    assert ds["response_of"].values.tolist() == RESPONSE_OF.tolist()
    assert ds["rms"].values.tolist() == [
        [5e-4, 1e-3],
        [1.5e-3, pytest.approx(np.nan, nan_ok=True)],
        [2e-3, 2.5e-3],
    ]
    assert ds["period"].values.tolist() == [[1, 3], [1, 0], [1, 0]]
    assert ds["type"].values.tolist() == [
        ["periodic", "periodic"],
        ["periodic", "escaped"],
        ["periodic", "chaotic"],
    ]
    assert ds["contacts_per_period"].values[0].tolist() == [2.0, 3.0]
    assert ds["response_frequency"].values.tolist() == [4.0, 4.0, 5.0, 6.0, 6.0]
    assert ds["response_frequency"].attrs["units"] == "Hz"
    assert ds["response_contacts"].values.tolist() == [2.0, 3.0, 2.0, 4.0, 2.4]
    assert ds["event_frequency"].values.tolist() == [5.5]


@pytest.mark.parametrize("code", [-1, -2, -3, -4])
def test_a_start_without_a_response_is_named(code):
    ds = responses(response_of=np.where(RESPONSE_OF == 4, code, RESPONSE_OF))
    assert ds["type"].values[2, 1] == Kind(code).word
    assert np.isnan(ds["rms"].values[2, 1])


def test_orbits_are_padded():
    ds = responses(responses=SAMPLED, sample="contacts")
    assert ds["response_x"].dims == ("response", "phase")
    assert np.isfinite(ds["response_x"].values).sum(axis=1).tolist() == [1, 3, 1, 1, 7]
    assert np.isfinite(ds["sample_x"].values).sum(axis=1).tolist() == [2, 6, 2, 4, 9]
    assert ds.attrs["sample"] == "contacts"


def test_two_parameters_are_two_dims():
    ds = two_parameters()
    assert ds["type"].dims == ("frequency", "gap", "start")
    assert schema.parameters_of(ds) == ("frequency", "gap")
    assert ds["response_gap"].values.tolist() == [1e-3, 2e-3, 1e-3, 2e-3, 2e-3]


def test_a_sweep_names_its_directions():
    ds = responses(starts=Starts({"x": np.zeros(2)}, ["up", "down"]))
    assert ds["start_direction"].values.tolist() == ["up", "down"]
    assert ds["start_x"].values.tolist() == [0.0, 0.0]


@pytest.mark.parametrize("name", ["peak", "branch"])
def test_a_state_with_a_name_that_is_taken_gets_another(name):
    units = {name: "m", "v": "m/s", "frequency": "Hz"}
    ds = responses(states=(name, "v"), units=units, starts=Starts({name: np.zeros(2)}))
    assert ds[f"response_own_{name}"].dims == ("response", "phase")
    assert ds[f"response_{name}"].dims == ("response",)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"axes": {"start": np.zeros(3)}}, "'start'.*Rename"),
    ],
)
def test_what_does_not_fit_is_refused(changes, message):
    with pytest.raises(ParameterError, match=message):
        responses(**changes)


def test_describe_counts():
    text = describe(responses())
    assert "3 values, frequency from 4 to 6 Hz, 2 starts at each" in text
    assert "5 responses on 3 branches: 3 T, 1 3T, 1 chaotic" in text
    assert "events   1 graze" in text
    assert "5 of 6 starts, 1 escaped" in text


def test_describe_a_map_without_branches():
    text = describe(two_parameters())
    assert (
        "3 x 2 values, frequency from 4 to 6 Hz, gap from 0.001 to 0.002 m, 1 start at each"
    ) in text
    assert "5 responses: 3 T, 1 3T, 1 chaotic" in text


def test_csv_has_a_row_for_each_response(tmp_path):
    with save(responses(), tmp_path / "a.csv").open(encoding="utf-8") as file:
        header, *rows = csv.reader(line for line in file if not line.startswith("#"))
    assert header[:3] == ["response", "frequency [Hz]", "branch"]
    assert [row[1] for row in rows] == ["4.0", "4.0", "5.0", "6.0", "6.0"]
    assert float(rows[1][header.index("rms [m]")]) == TABLE.rms[1]
    with (tmp_path / "a_events.csv").open(encoding="utf-8") as file:
        header, row = csv.reader(line for line in file if not line.startswith("#"))
    assert dict(zip(header, row, strict=True)) == {
        "event": "0",
        "kind": "graze",
        "branch": "0",
        "frequency [Hz]": "5.5",
    }
    save(responses(events=None), tmp_path / "b.csv")
    assert not (tmp_path / "b_events.csv").exists()
