"""Events on branches of orbits, and on curves of bifurcations."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Event:
    """A bifurcation on a branch, a change of its contacts, or a point of codimension two on a
    curve.

    Attributes
    ----------
    kind : str
        A key of special_points.KINDS; ``graze``: a contact appears or vanishes; ``corner``: two
        contacts come at once; of equilibria ``hopf`` and ``boundary_equilibrium``; on curves of
        bifurcations one of codimension_two.KINDS, ``isola_birth``, ``branches_join`` or
        ``double_graze``.
    after : int
        The point of the branch that it comes after.
    z : float64[z]
        The unknowns there: the orbit and the parameters.
    multipliers : complex128[D]
        There.
    tangent, derivative : float64[m + 1], float64[m, m + 1]
        The direction of the branch, and the derivative of the equations, in units of the scale.
    guards : tuple of int
        The guard that is grazed, or met by an equilibrium; the two that are met at once.
    phase : float
        When, in forcing periods since the orbit's first point.
    outcome : str
        How a branch goes on behind a graze with an impact or a boundary equilibrium:
        ``persistence`` or ``nonsmooth_fold``; of a Hopf point ``supercritical`` or ``subcritical``.
    sqrt_coefficient : float
        Of a graze: see grazing_orbits.py.
    extremum : int
        Which of two parameters has its extremum; -1 for other kinds.
    """

    kind: str
    after: int
    z: np.ndarray
    multipliers: np.ndarray
    tangent: np.ndarray = field(default_factory=lambda: np.zeros(0))
    derivative: np.ndarray = field(default_factory=lambda: np.zeros(0))
    guards: tuple[int, ...] = ()
    phase: float = np.nan
    outcome: str = ""
    sqrt_coefficient: float = np.nan
    extremum: int = -1
