r"""Two masses on a spring; one rubs on the floor, the other is pulled: code_aster's test SDND106.

.. math::
    m \ddot x_1 = k (x_2 - x_1) - f(\dot x_1), \qquad
    m \ddot x_2 = -k (x_2 - x_1) + F\, H(t_1 - t)

:math:`f` is dry friction: :math:`\mu_d N` in slip, up to :math:`\mu_s N` in stick.
"""

from __future__ import annotations

from saltus.contact import friction
from saltus.language import where
from saltus.models.model import model


@model(
    states={"x1": "m", "x2": "m", "v1": "m/s", "v2": "m/s"},
    source="code_aster, Validation manual, test SDND106 (two masses, one with friction).",
)
def pulled_pair(
    t,
    x1,
    x2,
    v1,
    v2,
    *,
    mass="5 kg",
    stiffness="1e4 N/m",
    force="3000 N",
    pull_time="0.2 s",
    normal_force="1e4 N",
    static_friction=0.3,
    kinetic_friction=0.2,
):
    r"""Two masses on a spring; one rubs on the floor, the other is pulled (code_aster, SDND106).

    States are ``x1``, ``x2`` [m] and their rates ``v1``, ``v2`` [m/s]. It isn't forced.

    ================  =======  ========  =========================================================
    parameter         symbol   default   meaning
    ================  =======  ========  =========================================================
    mass              m        5 kg      of either
    stiffness         k        10 kN/m   between them
    force             F        3000 N    on the second mass
    pull_time         t_1      0.2 s     how long it acts
    normal_force      N        10 kN     under the first mass
    static_friction   mu_s     0.3
    kinetic_friction  mu_d     0.2
    ================  =======  ========  =========================================================

    Notes
    -----
    From rest the first mass begins to slide at a quarter of a period of the second,
    :math:`\pi/2 \sqrt{m/k}` = 0.0351240737 s. The manual prints 0.03512 s.
    """
    spring = stiffness * (x2 - x1)
    rubbing = friction(
        v1, slip=kinetic_friction * normal_force, stick=static_friction * normal_force
    )
    pull = where(t < pull_time, force, 0.0)
    return v1, v2, (spring - rubbing) / mass, (pull - spring) / mass
