"""Which branch an orbit lies on, so that each is followed once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from saltus.analysis.branches.arclength import correct
from saltus.analysis.branches.branch import Branch

#: Orbits nearer than this, in units of the scale, are one.
SAME = 1e-6
#: An orbit may lie on a branch whose points, joined by lines, pass it by less.
PASSES = 0.3


def branch_of(z: np.ndarray, n: int, branches: Sequence[Branch]) -> int:
    """The branch on which an orbit of n periods or its mirror image lies, -1 if it is none of
    these.
    """
    mine = [
        i
        for i, branch in enumerate(branches)
        if branch.orbits.n == n and branch.z.shape[1] == len(z)  # equilibria are no limit cycles
    ]
    same = [z]
    if mine and branches[mine[0]].orbits.symmetric:
        same.append(branches[mine[0]].orbits.mirrored(z[None])[0])
    there = (i for one in same for i in mine if _lies_on(one, branches[i]))
    return next(there, -1)


def has_twin(branch: Branch) -> bool:
    """Whether the mirror image of a branch is another one."""
    middle = branch.z[len(branch.z) // 2][None]
    return branch.orbits.symmetric and not _lies_on(branch.orbits.mirrored(middle)[0], branch)


def _lies_on(z: np.ndarray, branch: Branch) -> bool:
    normal = np.zeros((1, len(z)))
    normal[0, -1] = 1.0
    for guess in _passes(branch, float(z[-1])):
        if _apart(z, guess, branch) > PASSES:
            continue
        orbits = branch.orbits.near(guess[None], np.array([branch.row]))
        point = correct(orbits, guess[None], normal, np.array([0]), 2 * PASSES)
        if point.found[0] and _apart(z, point.z[0], branch, exact=True) < SAME:
            return True
    return False


def _passes(branch: Branch, value: float) -> np.ndarray:
    """Where a branch passes a value of the parameter, float64[g, z]: by cubics between its points,
    which turn back beyond a fold as it does.
    """
    step = np.diff(branch.z, axis=0) / branch.scale
    length = np.append(0.0, np.cumsum(np.linalg.norm(step, axis=1)))
    each = np.append(True, np.diff(length) > 0.0)
    if each.sum() < 2:
        return np.zeros((0, len(branch.scale)))
    curve = CubicHermiteSpline(
        length[each], branch.z[each] / branch.scale, branch.tangent[each], extrapolate=False
    )
    own = CubicHermiteSpline(
        curve.x, branch.z[each, -1] / branch.scale[-1], branch.tangent[each, -1]
    )
    level = value / branch.scale[-1]
    places = own.solve(level, extrapolate=False)
    ends = curve.x[[0, -1]]  # of which rounding would say whether they are passed
    ends = ends[np.abs(own(ends) - level) < SAME]
    result = curve(np.append(places[np.isfinite(places)], ends)) * branch.scale
    result[:, -1] = value
    return np.asarray(result)


def _apart(a: np.ndarray, b: np.ndarray, branch: Branch, exact: bool = False) -> float:
    """How far two orbits lie apart, in units of the scale, from whichever point they begin; for
    limit cycles only roughly unless ``exact``.
    """
    orbits, row = branch.orbits, branch.row
    size = orbits.n * orbits.size
    if orbits.free:
        periods = abs(a[size] - b[size]) / abs(b[size])
        return max(periods, orbits.beside(b, a[: orbits.size], row) if exact else 0.0)
    others = orbits.alike(a[None], np.array([row]))[0]
    return float(np.abs((others - b)[:, :size] / branch.scale[:size]).max(axis=1).min())
