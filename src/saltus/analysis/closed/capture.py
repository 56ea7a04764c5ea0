"""Neighbourhoods of periodic attractors in which every trajectory is known to stay: who enters one
need not be followed any further.

About each point p of an orbit of period n the ellipsoid |W (x - p)| <= r is written in a norm in
which the derivative M of the n-th return map contracts (discrete Lyapunov equation). r is taken
such that some returns together were seen to contract: each of a set of points on two shells comes
back at most half as far from p, in that norm, after the very same sequence of contacts as the
orbit's own. Then every later visit is nearer still. That is a check at points, not a proof for all;
within one sequence of contacts the return map is smooth.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

from saltus.analysis.closed.motions import ClosedMotion
from saltus.analysis.solve.tolerances import JITTER
from saltus.codegen.module import capture_module
from saltus.flow.maps import Map

#: Radii tried, in units of the scale of the states: from half the range down to a millionth, then
#: what lies between two of them.
RADII = 2.0 ** -np.arange(1.0, 21.0, 2.0)
BETWEEN = (2.0**1.5, 2.0, 2.0**0.5)
#: Radii tried first where those of the same orbit at other values are known, in units of these.
LIKE = (2.0**0.25, 1.0, 2.0**-0.5, 0.5)
#: Points on the outer shell for each dimension beyond the first; the inner shell has as many.
DIRECTIONS = 16
#: Every so-manyth point of the outer shell is followed first: a radius that is too large is nearly
#: always seen to be by these alone.
SPARSE = 4
#: Share of the distance that is left after the returns that are looked at together.
CONTRACTION = 0.5
#: Most returns that are looked at together.
MOST_RETURNS = 64
#: Points of an orbit that get a neighbourhood: a trajectory on its way passes all of them in a
#: response.
MOST_POINTS = 8
#: Work of one radius: iterates times the cube of the number of states. What is above it is left
#: out: points of the orbit first, then returns, directions last. It binds from four states on; of
#: twenty a radius has 8000 iterates, four times those for which a start is followed.
WORK = 2**26
#: Fewest directions for each dimension.
FEWEST = 2
#: Part of the verified radius that is used.
SAFETY = 0.9


@dataclass(frozen=True)
class Neighbourhoods:
    """Ellipsoids about the points of attractors.

    Attributes
    ----------
    centres : float64[m, D]
        Ascending in the first state.
    weights : float64[m, D, D]
        W/r of each: inside where |W (x - c)| <= r.
    owners : int64[m]
        The attractor of each.
    """

    centres: np.ndarray
    weights: np.ndarray
    owners: np.ndarray

    def capture(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """For trajectories float64[k, n, D]: the attractor that captures each (-1: none), and the
        index of the point at which it does.
        """
        label, when = np.full(len(points), -1, np.int64), np.zeros(len(points), np.int64)
        if len(self.centres):
            capture_module().propagate(
                np.ascontiguousarray(points),
                self.centres,
                self.weights,
                self.owners,
                self._extents,
                label,
                when,
            )
        return label, when

    @classmethod
    def none(cls, size: int) -> Neighbourhoods:
        """No neighbourhoods, of points with this number of states."""
        return cls(np.zeros((0, size)), np.zeros((0, size, size)), np.zeros(0, np.int64))

    def joined(self, other: Neighbourhoods) -> Neighbourhoods:
        """Those of both, in the order that :meth:`capture` needs."""
        centres, weights = (
            np.concatenate([self.centres, other.centres]),
            np.concatenate([self.weights, other.weights]),
        )
        order = np.argsort(centres[:, 0], kind="stable")
        owners = np.concatenate([self.owners, other.owners])[order]
        return Neighbourhoods(
            np.ascontiguousarray(centres[order]), np.ascontiguousarray(weights[order]), owners
        )

    def renumbered(self, ids: np.ndarray) -> Neighbourhoods:
        """The same, owner i now being ids[i]."""
        return Neighbourhoods(self.centres, self.weights, ids[self.owners])

    def of(self, kept: np.ndarray) -> Neighbourhoods:
        """Those of the owners int64[m] that are kept, ascending; owner kept[i] now being i."""
        rows = np.isin(self.owners, kept)
        return Neighbourhoods(
            self.centres[rows], self.weights[rows], np.searchsorted(kept, self.owners[rows])
        )

    def radii(self, points: np.ndarray, norms: np.ndarray) -> np.ndarray:
        """Radii r of the neighbourhoods nearest to points float64[k, D], in norms float64[k, D, D]
        like those in which they were found, float64[k].
        """
        apart = np.linalg.norm(norms[:, None] @ (points[:, None] - self.centres)[..., None], axis=2)
        nearest = apart[..., 0].argmin(axis=1)
        one, other = (np.linalg.slogdet(each)[1] for each in (norms, self.weights[nearest]))
        return np.asarray(np.exp((one - other) / points.shape[1]))

    @functools.cached_property
    def _extents(self) -> np.ndarray:
        """Half the extent of each along the first coordinate, float64[m]: sqrt of the corner of
        (W'W)^-1.
        """
        return np.sqrt(np.linalg.inv(self.weights.transpose(0, 2, 1) @ self.weights)[:, 0, 0]) * (
            1 + 1e-9
        )


def neighbourhoods(
    map_: Map,
    orbit: ClosedMotion,
    owner: int,
    scale: np.ndarray,
    like: Neighbourhoods | None = None,
) -> Neighbourhoods:
    """Verified neighbourhoods of the points of a stable periodic orbit.

    Parameters
    ----------
    map_ : Map
        The map.
    orbit : ClosedMotion
        An attractor.
    owner : int
        Its number.
    scale : float64[D]
        Range of each state.
    like : Neighbourhoods, optional
        Of the same orbit at other parameter values: radii like theirs are tried first, and larger
        ones hardly.
    """
    centres, weights = _verified(map_, orbit, scale, like)
    return Neighbourhoods.none(len(scale)).joined(
        Neighbourhoods(centres, weights, np.full(len(centres), owner, np.int64))
    )


def _verified(
    map_: Map, orbit: ClosedMotion, scale: np.ndarray, like: Neighbourhoods | None
) -> tuple[np.ndarray, np.ndarray]:
    """Centres and weights about points of one orbit: of each the largest radius tried at which the
    returns were seen to contract.

    Where no radius passes, what lies within the map's own errors of the point is taken to be on it.
    """
    size = len(scale)
    most, returns, count = _affordable(orbit, size)
    points = orbit.points[:: -(-orbit.period // most)]
    _, monodromy = map_.tangent(points, orbit.period)
    n, iterates = len(points), orbit.period * returns
    norms = np.stack([_norm(matrix, scale) for matrix in monodromy])
    _, own = map_.sequences(points, iterates)
    outer, asked = sphere(size, count), _asked(orbit, returns)
    few = np.arange(2 * len(outer)) % SPARSE == 0
    few[len(outer) :] = False
    shell = np.concatenate([outer, 0.5 * outer])

    def contracts(radius: np.ndarray, which: np.ndarray, some: np.ndarray) -> np.ndarray:
        starts = points[which, None, :] + radius[:, None, None] * (
            some @ np.linalg.inv(norms[which]).transpose(0, 2, 1)
        )
        with np.errstate(all="ignore"):  # what escapes doesn't contract
            ends, met = map_.sequences(starts.reshape(-1, size), iterates)
            back = np.linalg.norm(
                (ends.reshape(starts.shape) - points[which, None, :])
                @ norms[which].transpose(0, 2, 1),
                axis=2,
            )
            nearer = (back <= asked * radius[:, None] * np.linalg.norm(some, axis=1)).all(axis=1)
        contracting: np.ndarray = nearer & [
            _alike(met[i * len(some) : (i + 1) * len(some)], own[k]) for i, k in enumerate(which)
        ]
        return contracting

    def passes(radius: np.ndarray, which: np.ndarray) -> np.ndarray:
        passed = contracts(radius, which, shell[few])
        if passed.any():
            passed[passed] = contracts(radius[passed], which[passed], shell[~few])
        return passed

    best, largest = np.zeros(n), np.full(n, np.inf)
    if like is not None and len(like.centres):
        largest = like.radii(points, norms) / SAFETY
        for factor in LIKE:
            waiting = np.flatnonzero(best == 0.0)
            if len(waiting):
                tried = factor * largest[waiting]
                passed = passes(tried, waiting)
                best[waiting[passed]] = tried[passed]
    for radius in RADII:
        waiting = np.flatnonzero((best == 0.0) & (radius < LIKE[-1] * largest))
        if len(waiting):
            best[waiting[passes(np.full(len(waiting), radius), waiting)]] = radius
    have = np.flatnonzero((best > 0.0) & (best < np.minimum(RADII[0], LIKE[-1] * largest)))
    for factor in BETWEEN:  # a little larger still?
        if len(have):
            better = passes(best[have] * factor, have)
            best[have[better]] *= factor
            have = have[~better]
    best = np.where(best > 0.0, SAFETY * best, max(map_.noise, JITTER * orbit.mismatch))
    return points, norms / best[:, None, None]


def _returns(orbit: ClosedMotion) -> int:
    """Returns after which the linear part alone contracts to half of what is asked for, if these
    aren't too many.
    """
    slowest = float(np.abs(orbit.multipliers[0]))
    return (
        1
        if slowest <= 0.5 * CONTRACTION
        else min(math.ceil(math.log(0.5 * CONTRACTION) / math.log(slowest)), MOST_RETURNS)
    )


def _affordable(orbit: ClosedMotion, size: int) -> tuple[int, int, int]:
    """Points of an orbit that get a neighbourhood, returns, and directions: as many as :data:`WORK`
    is enough for.
    """
    count, returns, points = directions(size), _returns(orbit), min(MOST_POINTS, orbit.period)
    left = WORK / size**3 / (2 * orbit.period)
    points = int(np.clip(left / (count * returns), 1, points))
    returns = int(np.clip(left / (count * points), 1, returns))
    while count >= 2 * FEWEST * size and count > left:
        count //= 2
    return points, returns, count


def _asked(orbit: ClosedMotion, returns: int) -> float:
    """Share of a distance that may be left after those returns: half way to what the norm promises,
    where that is more than CONTRACTION.
    """
    slowest = float(np.abs(orbit.multipliers[0]))
    return max(CONTRACTION, 0.5 * (1.0 + _rate(slowest) ** returns))


def _rate(radius: float) -> float:
    """Rate at which the norm of :func:`_norm` contracts, from the spectral radius."""
    return 0.5 * (1.0 + radius)


def _alike(met: list[np.ndarray], own: np.ndarray) -> bool:
    """True where all sequences of contacts are that of the orbit, but for a contact at its very
    start or end.
    """
    first, last = own[:1], own[-1:]
    ends = (
        np.concatenate([head, middle, tail])
        for head in (first[:0], last)
        for middle in (own, own[1:])
        for tail in (first[:0], first)
    )
    same = {
        one.tobytes()
        for one in (*ends, *(np.concatenate([head, own[:-1]]) for head in (first[:0], last)))
    }
    return all(one.tobytes() in same for one in met)


def _norm(matrix: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """W with |W M x| <= q |W x|, q halfway between the spectral radius of M and 1; W x is at least
    x in units of the scale.
    """
    scaled = matrix * scale[None, :] / scale[:, None]
    try:
        q = _rate(float(np.abs(np.linalg.eigvals(scaled)).max()))
        gram = solve_discrete_lyapunov((scaled / q).T, np.eye(len(scale)))
        norm: np.ndarray = np.linalg.cholesky(0.5 * (gram + gram.T)).T / scale[None, :]
        return norm
    except np.linalg.LinAlgError:  # next to a bifurcation: nothing to be verified
        return np.diag(1.0 / scale)


def directions(size: int) -> int:
    """Points on the outer shell of so many dimensions; powers of two are evenest."""
    return 2 ** math.ceil(math.log2(DIRECTIONS * (size - 1) * 2)) if size > 1 else 2


def sphere(size: int, count: int | None = None) -> np.ndarray:
    """Points on the unit sphere, float64[count, size]: evenly spaced in the plane, a fixed
    quasi-random set beyond it.
    """
    if size == 1:
        return np.array([[1.0], [-1.0]])
    count = count or directions(size)
    if size == 2:
        angle = np.arange(count) * 2.0 * np.pi / count
        return np.stack([np.cos(angle), np.sin(angle)], axis=1)
    from scipy.stats import qmc  # 0.7 s that systems of one or two states don't need

    normal = qmc.MultivariateNormalQMC(np.zeros(size), seed=1).random(count)
    unit: np.ndarray = normal / np.linalg.norm(normal, axis=1)[:, None]
    return unit
