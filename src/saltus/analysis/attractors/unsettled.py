"""Trajectories that never settle, watched for much longer: what they do, and whether any leaves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from saltus.analysis.attractors.aperiodic import SURVEY_ITERATES, mismatch, survey
from saltus.analysis.attractors.arrivals import Arrivals
from saltus.analysis.attractors.attractor_set import INSIDE, AttractorSet
from saltus.analysis.attractors.noisy import Noisy, Stray, blurred, keep_to, stray_of
from saltus.analysis.attractors.recurrence import REPEATS, recurrence
from saltus.analysis.solve.tolerances import ROUND
from saltus.flow.maps import Travel
from saltus.results.dataset.kinds import Kind

#: Trajectories of up to seven states that never recur whose motion is surveyed.
MAX_SURVEYED = 24
#: Fewest of them.
FEWEST_SURVEYED = 4
#: Iterates of the survey, of up to seven states.
WATCHING_ITERATES = 32 * 1024
#: Recurrence below which its survivor is periodic after all.
ARRIVED = 1e-5


def watched(states: int) -> tuple[int, int]:
    """Most trajectories of so many states that never recur whose motion is surveyed, and the
    iterates for which they are: fewer of many states, as each costs more.
    """
    share = max(states // 4, 1)
    return max(MAX_SURVEYED // share, FEWEST_SURVEYED), WATCHING_ITERATES // share


def longest_survey(states: int) -> int:
    """Most iterates for which trajectories of so many states are followed after the others."""
    return SURVEY_ITERATES + watched(states)[1]


def survey_unsettled(
    arrivals: Arrivals, travel: Travel, going: np.ndarray, tell: Callable[[int], None]
) -> None:
    """Follow unsettled trajectories much longer. Accept an aperiodic attractor only if none leaves
    it.

    A chaotic saddle holds trajectories for thousands of periods too; what is seen to leave it
    betrays it.
    """
    found, scale = arrivals.found, arrivals.scale
    survivors, points, leavers = _watch(arrivals, travel, going, tell)
    if not len(survivors):
        return
    few, watching = watched(len(scale))
    chosen = np.unique(np.linspace(0, len(survivors) - 1, min(few, len(survivors))).astype(int))
    noisy, strays = _blurred(arrivals, travel.state[chosen], points[chosen])
    keeps = keep_to(noisy, points[chosen], INSIDE) >= 0
    # stays on an orbit that doesn't attract
    rests = np.array([mismatch(points[i, -ROUND:], scale) < ARRIVED for i in chosen])
    free = chosen[~keeps & ~rests]
    seen = [*noisy, *survey(arrivals.map_, travel.state[free], points[free], scale)]
    moves = chosen[keeps | ~rests]
    if len(moves):  # a long transient, if nothing is seen
        watching = watching if seen else SURVEY_ITERATES
        going_on = arrivals.map_.launch(travel.state[moves], watching)
        ends = _leave(arrivals, going_on, watching, noisy, lambda age: tell(travel.age + age))
        leave = np.isfinite(ends).all(axis=(1, 2))
        leavers.append(points[moves][leave, -ROUND:])
        who, age = going[survivors[moves[leave]]], travel.age + going_on.age
        _arrive(arrivals, ends[leave], who, age)
    for one in seen:
        if not any((one.share(iterates) >= INSIDE).any() for iterates in leavers if len(iterates)):
            found.add_sampled(one)
    label = (
        keeps_to_sampled(found, points[:, -ROUND:], scale)
        if found.sampled
        else np.full(len(survivors), -1)
    )
    for i, one in zip(going[survivors], label, strict=True):
        if one >= 0 and arrivals.owner[i] is None:
            arrivals.owner[i] = found.sampled[one]
    found.astray = (
        [stray for stray, one in zip(strays, label[chosen], strict=True) if one < 0]
        if strays
        else []
    )


def _watch(
    arrivals: Arrivals, travel: Travel, going: np.ndarray, tell: Callable[[int], None]
) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Trajectories that don't settle for SURVEY_ITERATES more, int64[k], their iterates, and those
    of the ones that do.
    """
    survivors = np.arange(len(going))
    runs: list[np.ndarray] = []
    leavers: list[np.ndarray] = []
    for _ in range(SURVEY_ITERATES // ROUND):
        points = travel.advance(ROUND)
        caught = arrivals.captured(points, going[survivors], travel.age - ROUND)
        leavers += [iterates[caught] for iterates in runs]
        stays = ~caught & travel.going
        travel.keep(stays)
        survivors, runs = survivors[stays], [*(iterates[stays] for iterates in runs), points[stays]]
        tell(travel.age)
        if not len(survivors):
            break
    return survivors, np.concatenate(runs, axis=1), leavers


def _blurred(
    arrivals: Arrivals, state: np.ndarray, runs: np.ndarray
) -> tuple[list[Noisy], list[Stray]]:
    """The noisy orbits that trajectories float64[k, SURVEY_ITERATES, D] keep to, and how far each
    strays from an exact one.

    They stand at float64[k, D]. Nothing of an exact map.
    """
    if not arrivals.blurs:
        return [], []
    map_, scale, orbits = arrivals.map_, arrivals.scale, arrivals.exactly(state)
    strays = [
        stray_of(map_, orbit, iterates, scale) for orbit, iterates in zip(orbits, runs, strict=True)
    ]
    about = [
        blurred(map_, orbit, scale)
        for orbit in {id(orbit): orbit for orbit in orbits if orbit is not None}.values()
    ]
    return [one for one in about if one is not None and (one.share(runs) >= INSIDE).any()], strays


def _arrive(arrivals: Arrivals, ends: np.ndarray, who: np.ndarray, age: int) -> None:
    """Note the orbits that trajectories float64[k, ROUND, D] have come to after very long."""
    if not len(ends):
        return
    while arrivals.add_orbits(ends, np.full(1, np.inf)):
        pass
    left = ~arrivals.captured(ends, who, age)
    arrivals.on_families(ends[left], who[left], age)


def _leave(
    arrivals: Arrivals, travel: Travel, most: int, noisy: list[Noisy], tell: Callable[[int], None]
) -> np.ndarray:
    """Last iterates of trajectories, followed for very long, that reach an orbit after all,
    float64[k, ROUND, D]; NaN of others. Those near a noisy orbit don't count.
    """
    going, scale = np.arange(len(travel.state)), arrivals.scale
    left = np.full((len(going), ROUND, len(scale)), np.nan)
    while len(going) and travel.age < most:
        points = travel.advance(ROUND)
        arrives = arrivals.found.near.capture(points)[0] >= 0
        if travel.age % (8 * ROUND) == 0:
            arrives |= [mismatch(iterates, scale) < ARRIVED for iterates in points] & (
                keep_to(noisy, points, INSIDE) < 0
            )
        left[going[arrives]] = points[arrives]
        stays = ~arrives & travel.going
        travel.keep(stays)
        going = going[stays]
        tell(travel.age)
    return left


def keeps_to_sampled(found: AttractorSet, runs: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """For trajectories float64[k, m, D]: which attractor of those that never repeat each keeps to,
    -1 if none; none if it repeats.
    """
    shares = np.stack([one.share(runs) for one in found.sampled], axis=1)
    _, apart = recurrence(runs, scale)
    best = shares.argmax(axis=1)
    recurring = (Kind.LIMIT_CYCLE.word, Kind.NOISY_PERIODIC.word)  # iterates on these may recur
    turns = np.array([one.kind in recurring for one in found.sampled])
    return np.where((shares.max(axis=1) >= INSIDE) & ((apart > REPEATS) | turns[best]), best, -1)
