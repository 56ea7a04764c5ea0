"""The tables of a run for pandas. Truth: contacts of a sine, known in closed form (conftest.py)."""

import numpy as np
import pandas as pd
import pytest

from saltus.errors import ParameterError
from saltus.results import contacts, samples
from unit.results.conftest import GAP, sine_points, sine_run


def test_contacts_are_a_row_each(run):
    frame = contacts(run)
    period = np.repeat(np.arange(3), 2)
    first = np.arcsin(GAP / 2e-3) / (2 * np.pi)
    np.testing.assert_allclose(frame["time"], period + np.tile([first, 0.5 - first], 3), rtol=1e-15)
    assert frame["guard"].tolist() == ["gap"] * 6
    assert frame["direction"].tolist() == [1, -1] * 3
    assert (np.sign(frame["velocity"]) == frame["direction"]).all()
    np.testing.assert_array_equal(frame["x"], GAP)
    np.testing.assert_array_equal(frame["v"], frame["velocity"])
    assert list(frame.columns) == [
        "time", "time_error", "guard", "direction", "velocity", "kind", "mode_before", "mode_after",
        "steps", "x", "v",
    ]  # fmt: skip
    assert frame.attrs["units"] == {
        "time": "s", "time_error": "s", "guard": "", "direction": "1", "velocity": "m/s",
        "kind": "", "mode_before": "1", "mode_after": "1",
        "steps": "1", "x": "m", "v": "m/s",
    }  # fmt: skip


def test_contacts_of_a_batch_know_their_trajectory(batch):
    frame = contacts(batch)
    assert frame.columns[0] == "trajectory"
    # the second never reaches the gap
    assert frame.groupby("trajectory").size().to_dict() == {0: 6, 2: 6}
    assert contacts(batch.isel(trajectory=2))["trajectory"].tolist() == [2] * 6
    assert contacts(batch.isel(trajectory=1)).empty
    assert contacts(batch.sel(trajectory=[1, 2]))["trajectory"].tolist() == [2] * 6
    pd.testing.assert_frame_equal(frame, contacts(batch.copy()))


def test_samples_are_a_row_each(run, batch):
    frame = samples(run)
    assert list(frame.columns) == ["time", "period", "x", "v", "mode"]
    np.testing.assert_array_equal(frame["x"], run["x"])
    assert frame.attrs["units"]["v"] == "m/s"
    frame = samples(batch)
    assert len(frame) == batch["x"].size
    for k in range(3):
        np.testing.assert_array_equal(frame[frame.trajectory == k]["x"], batch["x"][k])
        np.testing.assert_array_equal(frame[frame.trajectory == k]["time"], batch["time"])


def test_samples_with_periods_of_their_own():
    frame = samples(sine_run((2e-3, 3e-3), batch=True, frequencies=(1.0, 4.0)))
    assert frame.groupby("trajectory")["time"].max().to_dict() == {0: 3.0, 1: 0.75}
    assert samples(sine_points()).groupby("trajectory").size().to_dict() == {0: 4, 1: 4}


def test_no_contacts_are_an_empty_table():
    assert contacts(sine_run((0.5e-3,))).shape == (0, 11)


@pytest.mark.parametrize("function", [contacts, samples])
def test_what_is_no_run_is_refused(function, run):
    with pytest.raises(
        ParameterError, match=f"sl.{function.__name__} takes the Dataset that sl.simulate"
    ):
        function(run["x"])
    with pytest.raises(ParameterError, match=r"this Dataset is from sl\.stroboscope"):
        contacts(sine_points())
