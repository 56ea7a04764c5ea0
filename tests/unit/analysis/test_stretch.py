"""A stretch that is interrupted gives what it has; a trajectory that fails says so."""

import numpy as np
import pytest

import saltus as sl
from conformance.systems import lab

STOP = {"spring": 1.0, "damping": 0.02, "force": 0.8, "boundary": 0.3, "stiffness": 40.0, "frequency": 0.2}
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
    starts = {"x": np.linspace(0, 0.2, 3000), "v": 0.5}
    with pytest.raises(sl.Interrupted) as caught:
        ask(lab, starts, periods=2000, values=STOP, progress=interrupt, threads=1, **arguments)
    partial = caught.value.partial
    assert variable in partial
    assert {"interrupted", "not_computed"} & set(partial.status.values.tolist())


def test_a_trajectory_that_fails_says_so():
    with pytest.warns(sl.errors.SaltusWarning, match="1 of 2 trajectories: nonfinite"):
        both = sl.impact_statistics(lab, {"x": [0.0, 1.0], "v": 0.0}, periods=3, values=STOP | {"cubic": [0.0, -1e3]})
    assert both.status.values.tolist() == ["ok", "nonfinite"]
    with pytest.warns(sl.errors.SaltusWarning, match="nonfinite"):
        balance = sl.energy_balance(lab, {"x": [0.0, 1.0], "v": 0.0}, periods=3, values=STOP | {"cubic": [0.0, -1e3]}, **ENERGY)
    assert np.isnan(balance.imbalance.values[1])
    assert np.isfinite(balance.imbalance.values[0])
