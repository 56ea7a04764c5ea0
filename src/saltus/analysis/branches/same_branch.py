"""Find the branch on which an orbit lies, so that each branch is followed once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from saltus.analysis.branches.arclength import correct
from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.harmonics.equations import HarmonicOrbits

#: Orbits nearer than this, in units of the scale, are one.
SAME = 1e-6
#: An orbit may lie on a branch whose points, joined by lines, pass it by less.
PASSES = 0.3


def branch_of(z: np.ndarray, n: int, branches: Sequence[Branch]) -> int:
    """The branch on which an orbit of n periods or its mirror image lies, -1 if it is none of
    these.
    """
    mine = [i for i, branch in enumerate(branches) if _is_alike(branch, n, len(z))]
    same = [z[None], *(_mirrored(z[None], branches[i]) for i in mine[:1])]
    there = (i for one in same for i in mine if _on(one, branches[i]).any())
    return next(there, -1)


def on_branch(z: np.ndarray, n: int, branch: Branch) -> np.ndarray:
    """True for orbits of n periods float64[r, z] that lie on a branch, bool[r]."""
    return _on(z, branch) if _is_alike(branch, n, z.shape[1]) else np.zeros(len(z), bool)


def has_twin(branch: Branch) -> bool:
    """True if the mirror image of a branch is another branch."""
    middle = branch.z[len(branch.z) // 2][None]
    mirrored = _mirrored(middle, branch)
    return len(mirrored) > 0 and not _on(mirrored, branch)[0]


def _mirrored(z: np.ndarray, branch: Branch) -> np.ndarray:
    """The mirror images of orbits float64[r, z] if they are orbits of the same equations; none
    otherwise.
    """
    orbits = branch.orbits
    if isinstance(orbits, PeriodicOrbits | HarmonicOrbits) and orbits.symmetric:
        return orbits.mirrored(z)
    return z[:0]


def _is_alike(branch: Branch, n: int, width: int) -> bool:
    """True if orbits of n periods may lie on a branch; equilibria are no limit cycles."""
    return branch.orbits.n == n and branch.z.shape[1] == width


def _on(z: np.ndarray, branch: Branch) -> np.ndarray:
    """True for orbits float64[r, z] that lie on a branch of their kind, bool[r]."""
    result, (guess, which) = np.zeros(len(z), bool), _passes(branch, z[:, -1])
    near = [_apart(z[i], one, branch) <= PASSES for i, one in zip(which, guess, strict=True)]
    guess, which = guess[near], which[near]
    if not len(guess):
        return result
    normal = np.zeros(guess.shape)
    normal[:, -1] = 1.0
    orbits = branch.orbits.near(guess, np.full(len(guess), branch.row))
    point = correct(orbits, guess, normal, np.arange(len(guess)), 2 * PASSES)
    for i, found in zip(which[point.found], point.z[point.found], strict=True):
        result[i] = result[i] or _apart(z[i], found, branch, exact=True) < SAME
    return result


def _passes(branch: Branch, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points float64[g, z] at which a branch passes values of the parameter float64[r], and the
    number of the value at each, int64[g]. Cubics between the points of the branch turn back beyond
    a fold as the branch does.
    """
    step = np.diff(branch.z, axis=0) / branch.scale
    length = np.append(0.0, np.cumsum(np.linalg.norm(step, axis=1)))
    each = np.append(True, np.diff(length) > 0.0)
    none = np.zeros((0, len(branch.scale))), np.zeros(0, np.int64)
    if each.sum() < 2:
        return none
    curve = CubicHermiteSpline(
        length[each], branch.z[each] / branch.scale, branch.tangent[each], extrapolate=False
    )
    own = CubicHermiteSpline(
        curve.x, branch.z[each, -1] / branch.scale[-1], branch.tangent[each, -1]
    )
    ends = curve.x[[0, -1]]  # of which rounding would say whether they are passed
    found, which = list[np.ndarray](), list[int]()
    for i, level in enumerate(values / branch.scale[-1]):
        places = own.solve(level, extrapolate=False)
        places = np.append(places[np.isfinite(places)], ends[np.abs(own(ends) - level) < SAME])
        found.append(places)
        which += [i] * len(places)
    if not which:
        return none
    result = np.asarray(curve(np.concatenate(found)) * branch.scale)
    result[:, -1] = values[which]
    return result, np.array(which, np.int64)


def _apart(a: np.ndarray, b: np.ndarray, branch: Branch, exact: bool = False) -> float:
    """Distance between two orbits in units of the scale, from whichever point they begin; for limit
    cycles only rough unless ``exact``.
    """
    orbits, row = branch.orbits, branch.row
    size = orbits.n * orbits.size
    if isinstance(orbits, PeriodicOrbits) and orbits.free:
        periods: float = abs(a[size] - b[size]) / abs(b[size])
        return max(periods, orbits.beside(b, a[: orbits.size], row) if exact else 0.0)
    others = orbits.alike(a[None], np.array([row]))[0]
    return float(np.abs((others - b)[:, :size] / branch.scale[:size]).max(axis=1).min())
