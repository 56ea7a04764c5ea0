"""Lyapunov spectra of trajectories of a flow or of any map, and the kinds of their motions.

A trajectory that settles to a periodic orbit has the exponents of the orbit, ln |multiplier| per
period, exact but for rounding. Any other has the means of its growth rates, and the statistics of
these say how sure they are.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from saltus.analysis.attractors.aperiodic import SURE
from saltus.analysis.attractors.recurrence import recurring_orbits
from saltus.analysis.attractors.settling import may_settle
from saltus.analysis.closed.motions import ClosedMotion
from saltus.analysis.lyapunov.qr import GOOD, Growth, carry, grow
from saltus.analysis.lyapunov.segments import TangentFlow
from saltus.analysis.solve.tolerances import NEAR, ROUND, SAME
from saltus.analysis.statistics import BOUNDED, UNCLEAR, Means, batch_means, running_ends
from saltus.results.dataset.kinds import Kind

#: Logarithm of the ratio of growths in one block above which the slower one is lost in the rounding
#: of the faster: three digits are left.
LOST = 29.0
#: Factor on the rounding of a monodromy matrix above which a multiplier is lost.
AMPLIFIED = 1e6
#: Blocks of the round trips that find a lost multiplier.
TRIPS = 256
#: A slow approach to an orbit must shrink its distance to this share over half of the last segment.
GAINED = 0.5


@dataclass(frozen=True)
class Spectrum:
    """Exponents of k trajectories of D states, per block.

    Attributes
    ----------
    exponents, errors, half_width : float64[k, m]
        The m largest in descending order, their standard errors, and half of the 95 % confidence
        interval.
    volume : float64[k]
        Mean growth of volumes, found without the tangent: the sum of the exponents.
    batches : int64[k]
        Independent batches that the error of the largest comes from; 0 for an orbit.
    orbits : list of ClosedMotion or None
        The periodic orbit to which each settles.
    kinds : list of str
        ``periodic``, ``quasi_periodic``, ``chaotic``, ``equilibrium``, ``limit_cycle`` or
        ``unclear``.
    ends : int64[..]
        Blocks after which running means are kept,
    running : Means
        and these, float64[k, m, ends].
    growth : Growth
        The growth that they come from.
    """

    exponents: np.ndarray
    errors: np.ndarray
    half_width: np.ndarray
    volume: np.ndarray
    batches: np.ndarray
    orbits: list[ClosedMotion | None]
    kinds: list[str]
    ends: np.ndarray
    running: Means
    growth: Growth


def spectrum(
    flow: TangentFlow,
    start: np.ndarray,
    count: int,
    transient: int,
    forced: bool = True,
    progress: Callable[[float], None] | None = None,
    most: int | None = None,
) -> Spectrum:
    """The ``most`` largest exponents (default: all) over ``count`` blocks after a transient, of
    trajectories from float64[k, D].

    Without forcing a motion that repeats has an exponent of zero along itself, which changes its
    kind.
    """
    size = start.shape[1]
    most = size if most is None else most
    growth = grow(flow, start, count, transient, most, progress)
    rates = _told(
        np.take_along_axis(
            growth.rates,
            np.argsort(-growth.rates.mean(axis=1), axis=1, kind="stable")[:, None],
            axis=2,
        ),
        growth.volume if most == size else None,
    )
    ends = running_ends(count)
    running = batch_means(np.swapaxes(rates, 1, 2), ends)
    exponents, errors, half_width = (
        part[..., -1].copy() for part in (running.mean, running.error, running.half_width)
    )
    batches, volume = running.batches[:, 0, -1].copy(), growth.volume.mean(axis=1)
    orbits = _orbits(flow, growth)
    kinds = []
    for i, orbit in enumerate(orbits):
        if orbit is None:
            kind = kind_of(rates[i], errors[i], forced)
            torus = forced and kind == Kind.QUASI_PERIODIC.word
            kinds.append("unclear" if torus and _may_settle(flow, i, growth) else kind)
            _vanish(size - growth.zeros[i], exponents[i], errors[i], half_width[i])
            continue
        kinds.append((Kind.PERIODIC if forced else Kind.EQUILIBRIUM).word)
        volume[i], zeros = _volume(flow, i, orbit)
        every = _of_orbit(flow, i, orbit, growth.scale[i], volume[i], zeros > 0)
        exponents[i], errors[i] = (one[:most] for one in every)
        _vanish(size - zeros, exponents[i], errors[i])
        half_width[i], batches[i] = errors[i], 0
    return Spectrum(
        exponents, errors, half_width, volume, batches, orbits, kinds, ends, running, growth
    )


def _told(rates: np.ndarray, volume: np.ndarray | None) -> np.ndarray:
    """Rates float64[k, n, m] without directions lost in the rounding of the fastest one. A single
    lost direction of all has the rest of the growth of volumes float64[k, n]; others are NaN.
    """
    with np.errstate(invalid="ignore"):
        lost = ~((rates[:, :, :1] - rates).mean(axis=1) < LOST)
        if volume is None:
            return np.where(lost[:, None], np.nan, rates)
        left = volume - np.where(lost[:, None], 0.0, rates).sum(axis=2)
    left[lost.sum(axis=1) > 1] = np.nan
    return np.where(lost[:, None], left[:, :, None], rates)


def _vanish(last: int, exponents: np.ndarray, *errors: np.ndarray) -> None:
    """Set the exponents of a trajectory float64[m] from one on to those of vanishing directions,
    without an error: a held contact keeps no deviation from it.
    """
    exponents[last:] = -np.inf
    for one in errors:
        one[last:] = 0.0


# -- orbits ----------------------------------------------------------------------------------------
def _orbits(flow: TangentFlow, growth: Growth) -> list[ClosedMotion | None]:
    """The stable periodic orbit to which each trajectory has come, None for the others."""
    points, scale = growth.segment.points, growth.scale
    orbits, _, noise = recurring_orbits(flow.map, points[:, -ROUND - 1 :], scale, NEAR)
    good = (orbits.stable | orbits.neutral) & np.isin(growth.segment.status, GOOD)
    found: list[ClosedMotion | None] = [None] * len(points)
    for row in np.flatnonzero(good).tolist():
        if _arrives(points[row], orbits[row], scale[row], float(noise[row])):
            found[row] = orbits[row]
    return found


def _arrives(points: np.ndarray, orbit: ClosedMotion, scale: np.ndarray, noise: float) -> bool:
    """True if a trajectory float64[m, D] lies on an orbit at its end, or approaches it all the
    time.
    """
    n, half = orbit.period, len(points) // 2
    distance = np.abs((points[:, None] - orbit.points[None]) / scale).max(axis=2).min(axis=1)
    early, late = distance[max(half - n, 0) : half + 1].max(), distance[-n:].max()
    return bool(
        late <= max(SAME, 4.0 * noise) or (late <= max(NEAR, 4.0 * noise) and late < GAINED * early)
    )


def _may_settle(flow: TangentFlow, i: int, growth: Growth) -> bool:
    """True if a trajectory is on its way to an orbit, or may be."""
    which = np.array([i])
    found = may_settle(flow.map.rows(which), growth.segment.points[which], growth.scale[which])
    return bool(found[0])


def _of_orbit(
    flow: TangentFlow, i: int, orbit: ClosedMotion, scale: np.ndarray, volume: float, vanish: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Exponents of an orbit per block, and their error from the map's own errors (Bauer & Fike:
    times the condition of the eigenvectors).

    Multipliers that are lost in the rounding of the largest are found as growth round the orbit,
    block by block; the last one, if the others are known, from the mean growth of volumes, which
    rounding hides nothing of. A growth of zero is true where volumes ``vanish``, and rounding
    elsewhere.
    """
    map_, n = flow.map.rows(np.array([i])), orbit.period
    noise, monodromy = map_.noise, map_.tangent(orbit.points[:1], n)[1][0] * scale / scale[:, None]
    condition = min(np.linalg.cond(np.linalg.eig(monodromy)[1]), 1.0 / noise)
    magnitudes = -np.sort(-np.abs(orbit.multipliers))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # a multiplier may be 0
        exponents, amplified = (
            np.log(magnitudes) / n,
            condition * np.linalg.norm(monodromy, 2) / magnitudes,
        )
        errors = noise * amplified / n
    lost = amplified > AMPLIFIED
    if lost.any():
        exponents[lost], errors[lost] = (part[lost] for part in _round_trips(flow, i, orbit, scale))
        last = len(exponents) - 1
        with np.errstate(invalid="ignore"):
            known = (np.isneginf(exponents) & vanish) | (exponents[0] - exponents < LOST)
        if lost[last] and known[:last].all() and np.isfinite(volume):
            exponents[last] = volume - exponents[:last].sum()
            errors[last] = errors[:last].sum() + flow.map.noise * (1.0 + abs(volume))
        else:
            exponents[~known], errors[~known] = np.nan, np.nan
    return exponents, errors


def _round_trips(
    flow: TangentFlow, i: int, orbit: ClosedMotion, scale: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Mean growth per block over the later half of many round trips of an orbit, and the difference
    of that half's two halves.
    """
    n, size = orbit.points.shape
    blocks = flow.rows(np.full(n, i)).derivatives(orbit.points[:, None])[:, 0]
    trips = max(-(-TRIPS // n), 8) // 4 * 4
    rates, _ = carry(np.tile(blocks, (trips, 1, 1))[None], np.eye(size)[None], scale[None])
    early, late = rates[0, trips // 2 * n :].reshape(2, -1, size).mean(axis=1)
    with np.errstate(invalid="ignore"):  # both may be -inf
        return 0.5 * (early + late), np.abs(late - early) + flow.map.noise


def _volume(flow: TangentFlow, i: int, orbit: ClosedMotion) -> tuple[float, int]:
    """Mean growth of volumes over an orbit, and directions that vanish on it."""
    growth, lost = flow.rows(np.full(orbit.period, i)).divergences(orbit.points[:, None])
    return float(growth.mean()), int(lost.max())


# -- kinds -----------------------------------------------------------------------------------------
def kind_of(rates: np.ndarray, errors: np.ndarray, forced: bool) -> str:
    """The kind of a motion that isn't an orbit of the map, from rates float64[n, D] and the errors
    of their means.
    """
    mean, first, second = (
        rates.mean(axis=0),
        *(half.mean(axis=0) for half in np.array_split(rates, 2)),
    )
    if not np.isfinite(mean[0]) or not errors[0] <= UNCLEAR:
        return "unclear"
    limit = np.maximum(SURE * errors, BOUNDED / len(rates))
    if mean[0] > limit[0] and second[0] > 0.5 * first[0]:  # not one that was chaotic only at first
        return Kind.CHAOTIC.word
    bounded = 2 * BOUNDED / len(rates)
    if abs(second[0]) > min(limit[0], bounded):  # zero only if the growth stays bounded
        return "unclear"
    if mean[0] < -SURE * errors[0]:  # deviations die out: a motion that hasn't settled yet
        return "unclear"
    torus = forced or (len(mean) > 2 and abs(second[1]) <= limit[1])
    # a cycle's own exponent is zero; that of a torus may be less, if its error is that wide
    if torus and SURE * errors[0] > bounded:
        return "unclear"
    return (Kind.QUASI_PERIODIC if torus else Kind.LIMIT_CYCLE).word
