r"""Two masses in a row with two clearances: one to the ground, one between the masses.

.. math::
    m_1 \dot v_1 &= F \cos(2 \pi f t) - k_1 x_1 - c_1 v_1 - f_1(x_1)
        + k_2 (x_2 - x_1) + c_2 (v_2 - v_1) + f_2(x_2 - x_1) \\
    m_2 \dot v_2 &= -k_2 (x_2 - x_1) - c_2 (v_2 - v_1) - f_2(x_2 - x_1)

where :math:`f_i` is zero inside a symmetric clearance and a linear spring beyond it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from saltus.contact import freeplay
from saltus.language import cos, pi
from saltus.models.model import model


@model(
    states={"x1": "m", "x2": "m", "v1": "m/s", "v2": "m/s"},
    forced_at="frequency",
    source="Textbook configuration; round values chosen for saltus.",
)
def chain(
    t,
    x1,
    x2,
    v1,
    v2,
    *,
    first_mass="1 kg",
    second_mass="0.5 kg",
    ground_stiffness="1e3 N/m",
    coupling_stiffness="400 N/m",
    ground_damping="4 N*s/m",
    coupling_damping="2 N*s/m",
    ground_contact_stiffness="20e3 N/m",
    ground_gap="1 mm",
    coupling_contact_stiffness="10e3 N/m",
    coupling_gap="0.5 mm",
    force="2 N",
    frequency="7 Hz",
):
    """Chain of two masses with two clearances, shaken harmonically.

    States are the displacements ``x1``, ``x2`` [m] and velocities ``v1``, ``v2`` [m/s]; it is
    forced at ``frequency``.

    ==========================  =========  =================================================
    parameter                   default    meaning
    ==========================  =========  =================================================
    first_mass, second_mass     1, 0.5 kg
    ground_stiffness            1 kN/m     spring from the ground to the first mass
    coupling_stiffness          400 N/m    spring between the masses
    ground_damping              4 N*s/m    damper from the ground to the first mass
    coupling_damping            2 N*s/m    damper between the masses
    ground_contact_stiffness    20 kN/m    contact at x1 = -ground_gap, ground_gap
    ground_gap                  1 mm
    coupling_contact_stiffness  10 kN/m    contact at x2 - x1 = -coupling_gap, coupling_gap
    coupling_gap                0.5 mm
    force                       2 N        amplitude, on the first mass
    frequency                   7 Hz       of the force
    ==========================  =========  =================================================

    Notes
    -----
    A textbook configuration with round values chosen here, not one publication's. One clearance
    acts on a state, the other on the difference of two. Without contact it is linear; its undamped
    natural frequencies are then 3.412 Hz and 6.639 Hz. At the default values it settles from rest
    to an orbit of one forcing period with 12 contacts a period.
    """
    stretch, rate = x2 - x1, v2 - v1
    ground = (
        ground_stiffness * x1
        + ground_damping * v1
        + freeplay(x1, stiffness=ground_contact_stiffness, gap=ground_gap)
    )
    coupling = (
        coupling_stiffness * stretch
        + coupling_damping * rate
        + freeplay(stretch, stiffness=coupling_contact_stiffness, gap=coupling_gap)
    )
    drive = force * cos(2 * pi * frequency * t)
    return v1, v2, (drive - ground + coupling) / first_mass, -coupling / second_mass


# -- energy ----------------------------------------------------------------------------------------
def _stored(
    x1,
    x2,
    v1,
    v2,
    *,
    first_mass,
    second_mass,
    ground_stiffness,
    coupling_stiffness,
    ground_contact_stiffness,
    ground_gap,
    coupling_contact_stiffness,
    coupling_gap,
):
    """Energy of the masses, the springs and the contacts."""
    stretch = x2 - x1
    springs = ground_stiffness * x1**2 + coupling_stiffness * stretch**2
    ground = ground_contact_stiffness * freeplay(x1, stiffness=1.0, gap=ground_gap) ** 2
    coupling = coupling_contact_stiffness * freeplay(stretch, stiffness=1.0, gap=coupling_gap) ** 2
    return (first_mass * v1**2 + second_mass * v2**2 + springs + ground + coupling) / 2


def _supplied(t, v1, *, force, frequency):
    """Power of the force on the first mass."""
    return force * cos(2 * pi * frequency * t) * v1


def _dissipated(v1, v2, *, ground_damping, coupling_damping):
    """Power dissipated in the two dampers."""
    return ground_damping * v1**2 + coupling_damping * (v2 - v1) ** 2


#: Stored energy [J], power supplied and dissipated [W].
ENERGY: dict[str, Callable[..., Any]] = {
    "energy": _stored,
    "supplied": _supplied,
    "dissipated": _dissipated,
}
