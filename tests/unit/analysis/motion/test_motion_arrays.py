"""Motions as arrays: numbers and codes of the very run that a Dataset tells in words."""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.motion.motion_arrays import motion_arrays
from saltus.errors import ParameterError
from saltus.flow.until import STATUS
from saltus.kernels import status as st

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")
JUMPING = sl.models.impact_oscillator()
SENSED = RIG.with_outputs({"power": (lambda v, force: force * v, "W")})


@pytest.mark.parametrize(
    ("system", "asked"),
    [
        (RIG, {"start": (1e-3, 0.0), "periods": 12}),
        (RIG, {"start": (1e-3, 0.0), "periods": 9, "samples": 7, "keep": 2}),
        (RIG, {"start": (1e-3, 0.0), "at": [0.3, 0.1]}),
        (RIG, {"start": (1e-3, 0.0), "periods": 9, "until": "x < -0.6 mm"}),
        (RIG, {"periods": 5, "values": {"frequency": [14.0, 15.0]}}),
        (SENSED, {"start": {"x": [1e-3, 2e-3], "v": 0.0}, "periods": 5}),
        (JUMPING, {"start": (0.1, 0.0), "periods": 5}),
    ],
)
def test_the_dataset_says_the_same(system, asked):
    quiet = {"time_errors": "local", "threads": 1}
    run = sl.simulate(system, **asked, **quiet, progress=False)
    found = motion_arrays(system, **asked, **quiet)
    names = [*system.states, *system.outputs.names]

    def equal(name, array):
        np.testing.assert_array_equal(run[name].values.reshape(np.shape(array)), array)

    equal("time", found.time)
    equal("mode", found.mode)
    for i, name in enumerate(names):
        equal(name, found.values[..., i])
        equal(f"contact_{name}", found.contact_values[:, i])
        equal(f"end_{name}", found.end_values[:, i])
        if f"contact_{name}_before" in run:
            equal(f"contact_{name}_before", found.before[:, i])
    equal("contact_time", found.contacts.time)
    equal("contact_time_error", found.time_error)
    equal("contact_direction", found.contacts.direction)
    guards = [system.guards[i].name for i in found.contacts.guard]
    equal("contact_guard", np.array(guards))
    equal("contact_kind", np.array([st.CONTACT_KIND[i] for i in found.contacts.kind]))
    equal("status", np.array([STATUS[i][0] for i in found.outcome.status]))
    equal("end_time", found.outcome.time)
    assert len(found.contacts) > 0


def test_nothing_stands_before_contacts_where_nothing_jumps():
    assert motion_arrays(RIG, (1e-3, 0.0), 2).before is None
    assert motion_arrays(JUMPING, (0.1, 0.0), 5).before is not None


def test_bad_input_is_told_as_by_the_dataset():
    with pytest.raises(ParameterError, match="a start of"):
        motion_arrays(RIG, (1.0,), 2)
