r"""The dry-friction oscillator of the theory of sliding bifurcations.

.. math::
    \ddot x + x = \sin \omega t - F \operatorname{sign} \dot x
"""

from __future__ import annotations

from saltus.contact import friction
from saltus.language import sin
from saltus.models.model import model


@model(
    states={"x": "1", "v": "1"},
    forced_at="frequency",
    source="P. Kowalczyk, P. T. Piiroinen, Two-parameter sliding bifurcations of periodic "
    "solutions in a dry-friction oscillator, Physica D 237, 1053-1073 (2008); M. Guardia, S. J. "
    "Hogan, T. M. Seara, SIAM J. Appl. Dyn. Syst. 9, 769-798 (2010).",
)
def dry_friction(t, x, v, *, friction_force=0.4, frequency="0.5 rad/s"):
    r"""Oscillator with dry friction and its sliding bifurcations (Kowalczyk and Piiroinen).

    States are ``x`` and ``v``; all is dimensionless. It is forced at ``frequency``.

    ===============  =======  ==========  =======================================================
    parameter        symbol   default     meaning
    ===============  =======  ==========  =======================================================
    friction_force   F        0.4         over the amplitude of the force
    frequency        omega    0.5 rad/s
    ===============  =======  ==========  =======================================================

    Notes
    -----
    At omega = 1/2 the symmetric response moves without stops up to F = 1/3: the point of
    codimension two. Half the natural frequency is special: the free motion repeats in half a period
    of the force, so the responses without stops aren't isolated; one multiplier is 1.
    """
    return v, sin(frequency * t) - x - friction(v, slip=friction_force)
