"""The damper that docs/systems.md gives a stop so that it rebounds with a given coefficient of
restitution.
"""

import math

import pytest

import saltus as sl
from conformance.systems import contacts, lab


@pytest.mark.parametrize("e", [0.2, 0.5, 0.8, 0.99])
def test_a_stiff_stop_rebounds_with_e(e):
    zeta = -math.log(e) / math.sqrt(math.pi**2 + math.log(e) ** 2)
    stiffness = 1e4
    rig = lab.with_values(
        boundary=1.0, stiffness=stiffness, dashpot=2 * zeta * math.sqrt(stiffness)
    )
    met, left = contacts(sl.simulate(rig, (0.0, 3.0), t_end=0.6))
    assert met.velocity == pytest.approx(3.0, rel=1e-13)
    assert left.velocity == pytest.approx(-3.0 * e, rel=1e-12)
    assert left.time - met.time == pytest.approx(
        math.pi / math.sqrt(stiffness * (1 - zeta**2)), rel=1e-11
    )
