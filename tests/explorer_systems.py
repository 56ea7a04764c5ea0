"""Small systems for the explorer's page: a structure with sensors, and one that moves by itself."""

from __future__ import annotations

import numpy as np

import saltus as sl


def beam():
    """Two masses in a row, one before a stop: modes, and what sensors see of them."""
    stiffness = 4e4 * np.array([[2.0, -1.0], [-1.0, 1.0]])
    return sl.structure(
        np.eye(2),
        stiffness,
        modes=2,
        damping_ratio=0.02,
        names=["middle", "tip"],
        forces=[sl.Force("tip", "5 N")],
        contacts=[sl.Contact("tip", stiffness="20 kN/m", gap="0.5 mm", name="stop")],
        frequency="20 Hz",
        sensors={
            "tip": "tip",
            "tip speed": sl.velocity("tip"),
            "stop force": sl.contact_force("stop"),
        },
        name="two masses",
    )


@sl.system(states="x y")
def van_der_pol(t, x, y, *, mu=1.0):
    """A limit cycle about an unstable equilibrium."""
    return y, mu * (1 - x**2) * y - x
