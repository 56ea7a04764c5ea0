"""A stretch that is interrupted gives what it has; a trajectory that fails says so."""

import importlib
import pickle

import numpy as np
import pytest

import saltus as sl
from conformance.systems import bent, lab
from saltus.flow import engine

simulate_module = importlib.import_module("saltus.analysis.motion.simulate")

STOP = {
    "spring": 1.0,
    "damping": 0.02,
    "force": 0.8,
    "boundary": 0.3,
    "stiffness": 40.0,
    "frequency": 0.2,
}
ENERGY = {"energy": lambda x: x**2, "supplied": lambda v: v, "dissipated": lambda v: v**2}


def interrupt(share):
    raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("ask", "arguments", "variable"),
    [
        (sl.poincare, {"surface": "boundary"}, "crossing_time"),
        (sl.impact_statistics, {}, "contacts"),
        (sl.energy_balance, ENERGY, "residual"),
    ],
)
def test_an_interrupted_stretch_holds_what_was_computed(ask, arguments, variable):
    starts = {"x": np.linspace(0, 0.2, 500), "v": 0.5}
    with pytest.raises(sl.Interrupted) as caught:
        ask(lab, starts, periods=2000, values=STOP, progress=interrupt, threads=1, **arguments)
    partial = caught.value.partial
    assert variable in partial
    assert {"interrupted", "not_computed"} & set(partial.status.values.tolist())


@pytest.mark.parametrize(
    ("ask", "arguments"), [(sl.simulate, {"samples": 1}), (sl.stroboscope, {})]
)
def test_samples_that_no_trajectory_has_reached_are_cut_off(ask, arguments, monkeypatch):
    monkeypatch.setattr(engine, "SLICE", 200)
    whole = ask(lab, (0.0, 0.5), periods=2000, values=STOP, progress=False, threads=1, **arguments)
    with pytest.raises(sl.Interrupted) as caught:
        ask(lab, (0.0, 0.5), periods=2000, values=STOP, progress=interrupt, threads=1, **arguments)
    partial = caught.value.partial
    reached = partial.x.shape[-1]
    assert 1 < reached < 2000
    assert np.isfinite(partial.x.values).all()
    np.testing.assert_array_equal(partial.x.values, whole.x.values[..., :reached])
    np.testing.assert_array_equal(partial.period.values, whole.period.values[:reached])


def test_ctrl_c_while_the_result_is_put_together_loses_nothing(monkeypatch):
    whole = sl.simulate(lab, (0.0, 0.5), periods=20, values=STOP, time_errors="local")
    put_together, pressed = simulate_module.build, []

    def press(*parts, **more):
        if not pressed:
            pressed.append(True)
            raise KeyboardInterrupt
        return put_together(*parts, **more)

    monkeypatch.setattr(simulate_module, "build", press)
    with pytest.raises(sl.Interrupted) as caught:
        sl.simulate(lab, (0.0, 0.5), periods=20, values=STOP, time_errors="local")
    assert caught.value.partial.identical(whole)


def test_a_stop_puts_together_what_it_has_when_it_is_asked_for():
    calls = []
    stop = sl.Interrupted(lambda: calls.append(1) or [5.0])
    doubled = stop.then(lambda values: [2 * values[0]])
    assert "stands in `partial`" in str(doubled)
    assert not calls
    assert doubled.partial is doubled.partial
    assert pickle.loads(pickle.dumps(doubled)).partial == [10.0]
    assert calls == [1]
    assert "before anything was finished" in str(sl.Interrupted())


def test_the_outcome_of_a_run_inside_is_no_answer():
    with pytest.raises(sl.Interrupted) as caught:
        sl.attractors(
            lab.with_values(**STOP),
            {"x": np.linspace(0, 0.2, 500), "v": 0.5},
            progress=interrupt,
            threads=1,
        )
    found = caught.value.partial
    assert (found.sizes["trajectory"], "attractor_x" in found) == (500, True)


def test_a_trajectory_that_fails_says_so():
    with pytest.warns(sl.errors.SaltusWarning, match="1 of 2 trajectories: nonfinite"):
        both = sl.impact_statistics(
            bent, {"x": [0.0, 1.0], "v": 0.0}, periods=3, values=STOP | {"cubic": [0.0, -1e3]}
        )
    assert both.status.values.tolist() == ["ok", "nonfinite"]
    with pytest.warns(sl.errors.SaltusWarning, match="nonfinite"):
        balance = sl.energy_balance(
            bent,
            {"x": [0.0, 1.0], "v": 0.0},
            periods=3,
            values=STOP | {"cubic": [0.0, -1e3]},
            **ENERGY,
        )
    assert np.isnan(balance.imbalance.values[1])
    assert np.isfinite(balance.imbalance.values[0])
