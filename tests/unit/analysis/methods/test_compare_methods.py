"""Runs by several methods side by side, the work that is refused, and what Ctrl-C hands out."""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.methods import compare_methods as compared
from saltus.errors import ParameterError

METHODS = [sl.ODE45(1e-4, 1e-7), sl.ODE45(1e-7, 1e-10)]
RUN = {"start": (1.0, 0.0), "t_end": 10.0, "samples": 500, "progress": False}


@sl.system(states="x v")
def oscillator(t, x, v, *, k=1.0):
    return v, -k * x


def test_runs_are_compared_sample_by_sample():
    table = sl.compare_methods(oscillator, sl.simulate, METHODS, **RUN)
    t, label = table.time.values, METHODS[0].label
    run = sl.simulate(oscillator, method=METHODS[0], **RUN)
    apart = np.maximum(abs(run.x - np.cos(t)), abs(run.v + np.sin(t))).values
    wide = np.ptp(np.cos(t)), np.ptp(np.sin(t))
    row = table.sel({"method": label})
    np.testing.assert_allclose(row.orbit_distance, apart / 2, rtol=2e-3, atol=1e-13)
    assert wide == pytest.approx((2, 2), rel=1e-3)
    assert row.agrees.values.tolist() == (row.orbit_distance < 1e-3).values.tolist()
    assert row.method_agreement.item() == pytest.approx(float((apart / 2 < 1e-3).mean()))
    assert table.orbit_distance.max("time").values[2] < 1e-6
    assert table.method_contacts.values.tolist() == [0, 0, 0]
    assert "of the samples" in str(sl.describe(table))


def test_contacts_of_many_runs_are_counted():
    rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    start = {"x": ["0 mm", "5 mm"], "v": 0}
    table = sl.compare_methods(rig, sl.simulate, METHODS[1:], start=start, periods=3, samples=20)
    exact = sl.simulate(rig, start, 3, samples=20)
    assert table.method_contacts.values[0] == exact.events.sum()
    assert table.orbit_distance.dims == ("method", "trajectory", "time")
    assert (table.method_agreement == 1.0).all()


def test_a_method_that_takes_too_long_is_refused_with_what_would_do(monkeypatch):
    rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    asked = {"frequency": ["17 Hz"], "start": (0.0, 0.0)}
    monkeypatch.setattr(compared, "WORK", 1e4)
    with pytest.raises(ParameterError, match=r"too many for 2000 periods .* sl\.simulate") as said:
        sl.compare_methods(rig, sl.frequency_response, METHODS[:1], **asked)
    most = int(str(said.value).split("periods=")[1].split()[0])
    assert 10 < most < 2000
    with pytest.raises(ParameterError, match=f"too many for {most + 1} periods"):
        sl.compare_methods(rig, sl.frequency_response, METHODS[:1], periods=most + 1, **asked)
    known = sl.frequency_response(rig, method=METHODS[0], **asked)
    exact = sl.frequency_response(rig, **asked)
    both = {"Taylor": exact, METHODS[0].label: known}
    table = sl.compare_methods(rig, sl.frequency_response, METHODS[:1], computed=both, **asked)
    assert table.method_agreement.values.tolist() == [1.0, 1.0]


@pytest.mark.parametrize("done", [1, 2])
def test_the_methods_that_are_done_are_handed_out(monkeypatch, done):
    timed, left = compared._timed, [True] * done

    def interrupted(*given):
        if not left:
            raise KeyboardInterrupt
        left.pop()
        return timed(*given)

    monkeypatch.setattr(compared, "_timed", interrupted)
    with pytest.raises(sl.Interrupted) as caught:
        sl.compare_methods(oscillator, sl.simulate, METHODS, **RUN)
    if done == 1:
        assert caught.value.partial is None
    else:
        assert caught.value.partial.method.values.tolist() == ["Taylor", METHODS[0].label]
