"""Stability of the limit cycle that is born at a Hopf point: the first Lyapunov coefficient, from
the derivatives of the expressions themselves.

Kuznetsov, Elements of Applied Bifurcation Theory (2004), section 5.4.
"""

from __future__ import annotations

import numpy as np

from saltus.analysis.branches.equilibrium_curves import EquilibriumCurves

#: A Lyapunov coefficient smaller than this, in units of the frequency, has no sign.
NEUTRAL = 1e-9
#: Most states of a system whose third derivatives are written down.
MOST_STATES = 8


def criticality(curves: EquilibriumCurves, row: int, z: np.ndarray) -> str:
    """``supercritical`` where the cycles born at the Hopf point float64[z] are stable,
    ``subcritical`` where they aren't; empty where the coefficient has no sign, or isn't known.
    """
    if curves.size > MOST_STATES:
        return ""
    coefficient, frequency = first_lyapunov(curves, row, z)
    if not abs(coefficient) > NEUTRAL * frequency:
        return ""
    return "supercritical" if coefficient < 0 else "subcritical"


def first_lyapunov(curves: EquilibriumCurves, row: int, z: np.ndarray) -> tuple[float, float]:
    """The first Lyapunov coefficient at a Hopf point float64[z], equation (5.62), for an
    eigenvector of unit length in units of the scale, and the angular frequency [rad/s] of the cycle
    born there.
    """
    one, two, three = curves.derivatives(z, row)
    values, vectors = np.linalg.eig(one)
    here = np.argmin(np.where(values.imag > 0, np.abs(values.real), np.inf))
    omega, q = float(values[here].imag), vectors[:, here]
    values, vectors = np.linalg.eig(one.T)
    p = vectors[:, np.argmin(np.abs(values + 1j * omega))]
    p = p / np.vdot(q, p)  # <p, q> = 1, and vdot conjugates its first argument
    both = np.einsum("ijk,j,k->i", two, q, q.conj())
    twice = np.einsum("ijk,j,k->i", two, q, q)
    still = np.linalg.solve(one, both)
    turning = np.linalg.solve(2j * omega * np.eye(len(q)) - one, twice)
    sum_of = (
        np.einsum("ijkl,j,k,l->i", three, q, q, q.conj())
        - 2.0 * np.einsum("ijk,j,k->i", two, q, still)
        + np.einsum("ijk,j,k->i", two, q.conj(), turning)
    )
    return float(np.vdot(p, sum_of).real / (2.0 * omega)), omega
