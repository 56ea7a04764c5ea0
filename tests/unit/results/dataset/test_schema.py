"""What comes back has the names, dims, units and types that the schema promises."""

import numpy as np
import pytest
import xarray as xr

from saltus.errors import ParameterError
from saltus.results import Guards
from saltus.results.dataset import schema
from unit.results.conftest import GAP, sine_points, sine_run


@pytest.mark.parametrize(
    "make", [sine_run, lambda: sine_run((2e-3, 0.5e-3), batch=True), sine_points]
)
def test_every_variable_says_what_it_is(make):
    for name, variable in make().variables.items():
        assert isinstance(variable.attrs["units"], str), name
        assert variable.attrs["long_name"], name
        assert variable.dtype.kind in "fiU", name


def test_a_single_trajectory_has_no_trajectory_dim(run):
    assert dict(run.sizes) == {"time": 49, "contact": 6, "guard": 1}
    assert run["x"].dims == ("time",)
    assert run["status"].item() == "ok"
    assert run["events"].item() == 6
    assert run.attrs["forcing_period_s"] == 1.0
    assert "contact_trajectory" not in run


def test_a_batch_has_one_table_of_contacts(batch):
    assert batch["x"].dims == ("trajectory", "time")
    assert batch["mode"].dtype == np.int64
    assert batch["contact_trajectory"].values.tolist() == [0] * 6 + [2] * 6
    assert batch["events"].values.tolist() == [6, 0, 6]


def test_contacts_are_those_of_the_closed_form(run):
    assert run["contact_time"].values[0] == np.arcsin(0.5) / (2 * np.pi)
    assert run["contact_x"].values.tolist() == [GAP] * 6
    assert run["contact_guard"].values.tolist() == ["gap"] * 6
    assert run["contact_direction"].values.tolist() == [1, -1] * 3
    assert run["contact_mode_after"].values.tolist() == [1, 0] * 3


def test_units_follow_the_states_and_guards(run):
    units = {name: run[name].attrs["units"] for name in run.variables}
    assert [
        units[name]
        for name in (
            "time",
            "x",
            "v",
            "contact_x",
            "end_v",
            "contact_velocity",
            "guard_boundary",
            "period",
            "mode",
        )
    ] == ["s", "m", "m/s", "m", "m/s", "m/s", "m", "1", "1"]
    assert schema.rate_unit("m/s") == "m/s^2"
    assert schema.rate_unit("") == ""


def test_guards_of_different_units_have_no_common_one():
    assert sine_run()["guard_units"].values.tolist() == ["m"]
    other = sine_points(guards=Guards(("gap", "speed"), ("x", "v"), np.array([GAP, 1.0])))
    assert other["guard_units"].values.tolist() == ["m", "m/s"]
    assert other["guard_boundary"].attrs["units"] == ""


def test_periods_of_their_own_make_time_a_table():
    run = sine_run((2e-3, 2e-3), frequencies=[1.0, 4.0], batch=True)
    assert run["x"].dims == ("trajectory", "period")
    assert run["time"].dims == ("trajectory", "period")
    assert run["time"].values[1, -1] == 3 / 4
    assert run["frequency"].values.tolist() == [1.0, 4.0]
    assert run["frequency"].attrs["units"] == "Hz"
    assert schema.forcing_period(run.isel(trajectory=1)) == 0.25
    assert schema.sample_dim(run) == "period"


def test_boundaries_may_differ_between_trajectories():
    guards = Guards(("gap",), ("x",), np.array([[1e-3, 2e-3]]))
    assert sine_points()["guard_boundary"].dims == ("guard",)
    points = sine_points(guards=guards)
    assert points["guard_boundary"].dims == ("guard", "trajectory")
    assert points.isel(trajectory=1)["guard_boundary"].values.tolist() == [2e-3]


def test_a_state_called_velocity_keeps_both_variables():
    assert schema.contact_name("x") == "contact_x"
    assert schema.contact_name("velocity") == "contact_state_velocity"
    assert schema.before_name("x") == "contact_x_before"
    assert schema.before_name("mode") == "contact_state_mode_before"
    x = np.zeros((1, 49))
    run = sine_run(
        states=("x", "velocity"),
        values={"x": x, "velocity": x + 1},
        end={"x": [0.0], "velocity": [1.0]},
    )
    assert np.abs(run["contact_velocity"].values).max() > 0
    assert "contact_state_velocity" in run


@pytest.mark.parametrize("name", ["time", "mode", "status", "contact"])
def test_a_state_can_not_take_a_name_of_the_result(name):
    with pytest.raises(ParameterError, match=f"state '{name}'.*Rename"):
        sine_run(states=(name, "v"), values={name: np.zeros((1, 49)), "v": np.zeros((1, 49))})


def test_one_trajectory_only_without_the_dim():
    with pytest.raises(ParameterError, match="batch=True"):
        sine_run((1e-3, 2e-3), batch=False)


@pytest.mark.parametrize(
    ("thing", "message"),
    [
        ({"x": 1}, "not a dict"),
        (xr.DataArray([1.0]), "whole Dataset"),
        (xr.Dataset({"x": ("time", [1.0])}), "saltus_result"),
        (sine_points(), "from sl.stroboscope"),
        (sine_run()[["x", "status"]], "misses v"),
    ],
)
def test_check_teaches(thing, message):
    with pytest.raises(ParameterError, match=message):
        schema.check(thing, caller="plot.history", kinds=[schema.TRAJECTORY])
