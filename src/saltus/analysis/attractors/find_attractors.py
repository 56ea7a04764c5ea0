"""From trajectories of a map to its attractors: let them settle, close what recurs, and find out
what never does.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from saltus.analysis.attractors.aperiodic import (
    REPEATS,
    SURVEY_ITERATES,
    SampledMotion,
    merge,
    mismatch,
    survey,
)
from saltus.analysis.attractors.attractor_set import INSIDE, AttractorSet, is_about
from saltus.analysis.attractors.families import on_families
from saltus.analysis.attractors.growth import BUDGET, NEWTON, tangent_cost
from saltus.analysis.attractors.limit_cycles import limit_cycles
from saltus.analysis.attractors.noisy import Noisy, Stray, blurred, keep_to, stray_of
from saltus.analysis.attractors.recurrence import recurrence
from saltus.analysis.closed.capture import Neighbourhoods
from saltus.analysis.closed.field_zeros import autonomous
from saltus.analysis.closed.motions import ClosedMotion, same
from saltus.analysis.closed.orbits import find_orbits
from saltus.analysis.solve.tolerances import NEAR, ROUND, SAME
from saltus.flow.maps import Map, Stroboscope, Travel
from saltus.interrupt import PartInterrupted
from saltus.results.dataset.kinds import Kind

#: The attractor of each trajectory, None as long as it isn't known.
Owners = list[ClosedMotion | SampledMotion | None]
#: Candidates for orbits in one round; what isn't tried has its turn in the next.
MAX_CANDIDATES = 12
#: Trajectories of up to seven states that never recur whose motion is surveyed.
MAX_SURVEYED = 24
#: Fewest of them.
FEWEST_SURVEYED = 4
#: Iterates of the survey, of up to seven states.
WATCHING_ITERATES = 32 * 1024
#: Recurrence below which its survivor is periodic after all.
ARRIVED = 1e-5


def find_attractors(
    map_: Map,
    start: np.ndarray,
    scale: np.ndarray,
    most: int,
    known: AttractorSet | None = None,
    progress: Callable[[float], None] | None = None,
    kept: bool = False,
    surveyed: bool = True,
) -> tuple[AttractorSet, np.ndarray, np.ndarray]:
    """The attractors that trajectories from given starts settle to.

    Each is followed for ``most`` iterates, and for :data:`SURVEY_ITERATES` more if it hasn't
    settled; some of these again, for as long as :func:`watched` says. Newton's method may cost
    :data:`~saltus.analysis.attractors.growth.BUDGET` times what they were followed for.

    Parameters
    ----------
    map_ : Map
        The map.
    start : float64[k, D]
        Starts.
    scale : float64[D]
        Range of each state.
    most : int
        Iterates after which a trajectory that hasn't settled is surveyed for chaos.
    known : AttractorSet, optional
        Attractors that are known already.
    progress : callable, optional
        Called with the share done.
    kept : bool
        Whether a trajectory that keeps to a known attractor that never repeats has arrived, as in a
        map's cells. Else it is followed as one that hasn't settled.
    surveyed : bool
        Whether trajectories that haven't settled are surveyed; else nothing is said of them.

    Returns
    -------
    found : AttractorSet
        Known and new attractors, in the order of their ids.
    label : int64[k]
        The attractor of each start; -1 where none was established.
    settled : int64[k]
        Iterates after which it was captured; -1 if it wasn't.

    Raises
    ------
    PartInterrupted
        On Ctrl-C. Its ``partial`` is what was found; the label of starts that haven't settled by
        then is ``Kind.NOT_COMPUTED``.
    """
    found = known or AttractorSet(Neighbourhoods.none(start.shape[1]))
    found = AttractorSet(found.near, list(found.orbits), list(found.sampled), list(found.unstable))
    owner: Owners = [None] * len(start)
    settled = np.full(len(start), -1, np.int64)

    def known_now(unsettled: int) -> tuple[AttractorSet, np.ndarray, np.ndarray]:
        result = found.ordered(scale)
        label = [unsettled if one is None else result.index(one) for one in owner]
        return result, np.array(label, np.int64), settled

    try:
        _settle(map_, start, scale, most, found, owner, settled, progress, kept, surveyed)
    except KeyboardInterrupt:
        raise PartInterrupted(lambda: known_now(Kind.NOT_COMPUTED)) from None
    return known_now(-1)


def _settle(
    map_: Map, start: np.ndarray, scale: np.ndarray, most: int, found: AttractorSet, owner: Owners,
    settled: np.ndarray, progress: Callable[[float], None] | None, kept: bool,
    surveyed: bool,
) -> None:  # fmt: skip
    """Follow trajectories until each has settled, or was surveyed; note their owners."""
    travel, going = map_.launch(start, most), np.arange(len(start))
    total, purse = most + SURVEY_ITERATES + watched(len(scale))[1], np.zeros(1)

    def tell(age: int) -> None:
        if progress:
            progress(max(1.0 - len(going) / len(start), min(age / total, 1.0)))

    noisy, never = Kind.NOISY_PERIODIC.word, (Kind.CHAOTIC.word, Kind.QUASI_PERIODIC.word)
    turns = isinstance(map_, Stroboscope) and autonomous(map_.system)
    while len(going) and travel.age < most:
        points = travel.advance(ROUND)
        purse += BUDGET * ROUND * len(going)
        here = np.flatnonzero(~_captured(found, points, going, travel.age - ROUND, owner, settled))
        for kind in (noisy, *(never if kept else ())):
            on = _keeping(found, kind, points[here], going[here], travel.age, owner, settled)
            here = here[~on]
        while len(here) and _add_orbits(map_, points[here], scale, found, most, purse):
            here = here[
                ~_keeping(found, noisy, points[here], going[here], travel.age, owner, settled)
            ]
            here = here[
                ~_captured(found, points[here], going[here], travel.age - ROUND, owner, settled)
            ]
        if turns and len(here):
            here = here[
                ~_on_cycles(
                    map_, found, points[here], going[here], travel, here, scale, owner, settled
                )
            ]
        if len(here):
            here = here[
                ~_on_families(
                    map_, found, points[here], going[here], travel.age, owner, settled, scale
                )
            ]
        stay = np.zeros(len(going), bool)
        stay[here] = travel.going[here]
        travel.keep(stay)
        going = going[stay]
        tell(travel.age)
    if len(going) and surveyed:
        _survey(map_, travel, going, scale, found, owner, settled, most, tell)


def _captured(
    found: AttractorSet,
    points: np.ndarray,
    who: np.ndarray,
    age: int,
    owner: Owners,
    settled: np.ndarray,
) -> np.ndarray:
    """Note which of the trajectories are captured, and after how many iterates."""
    label, when = found.near.capture(points)
    caught = label >= 0
    for i, orbit, at in zip(who[caught], label[caught], when[caught], strict=True):
        owner[i], settled[i] = found.orbits[orbit], age + at + 1
    return caught


def _keeping(
    found: AttractorSet,
    kind: str,
    points: np.ndarray,
    who: np.ndarray,
    age: int,
    owner: Owners,
    settled: np.ndarray,
) -> np.ndarray:
    """Note which trajectories float64[k, m, D] keep to an attractor of a kind that is known by
    where it goes, bool[k].
    """
    ones = [one for one in found.sampled if one.kind == kind]
    on = keep_to(ones, points, INSIDE)
    for i in np.flatnonzero(on >= 0):
        owner[who[i]], settled[who[i]] = ones[on[i]], age
    return on >= 0


def _on_families(
    map_: Map, found: AttractorSet, points: np.ndarray, who: np.ndarray, age: int, owner: Owners,
    settled: np.ndarray, scale: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Note which trajectories float64[k, m, D] are on families of orbits, bool[k]."""
    homes = on_families(map_, points, scale, found)
    for i, home in zip(who, homes, strict=True):
        if home is not None:
            owner[i], settled[i] = home, age
    return np.array([home is not None for home in homes])


def watched(states: int) -> tuple[int, int]:
    """Most trajectories of so many states that never recur whose motion is surveyed, and the
    iterates for which they are: fewer of many states, as each costs more.
    """
    share = max(states // 4, 1)
    return max(MAX_SURVEYED // share, FEWEST_SURVEYED), WATCHING_ITERATES // share


def _add_orbits(
    map_: Map, points: np.ndarray, scale: np.ndarray, found: AttractorSet, most: int,
    purse: np.ndarray,
) -> bool:  # fmt: skip
    """Add the attracting orbits not known yet that some of the trajectories float64[k, ROUND, D]
    follow; whether there are any. What closing orbits costs is taken off the purse [iterates].
    """
    period, apart = recurrence(points, scale)
    near = max(NEAR, map_.noise)
    tried: list[int] = []
    for i in np.argsort(apart, kind="stable")[: np.count_nonzero(apart < near)]:
        known = any(
            _lies_on(points[i, -1], orbit, scale, 10 * apart[i]) for orbit in found.unstable
        )
        price = NEWTON * period[i] * tangent_cost(len(scale))
        if (
            not known
            and price <= purse[0]
            and not any(np.abs((points[i, -1] - points[j, -1]) / scale).max() < near for j in tried)
        ):
            tried.append(i)
            purse -= price
        if len(tried) == MAX_CANDIDATES:
            break
    place, k = points[tried, -1], len(tried)
    orbits = find_orbits(
        map_, place, period[tried], np.broadcast_to(scale, place.shape), np.full(k, map_.noise)
    )
    right = (orbits.period > 0) & (
        orbits.distance(place, np.broadcast_to(scale, place.shape)) < 100 * near
    )
    added = False
    for i in np.flatnonzero(right).tolist():
        orbit = orbits[i]
        if any(is_about(one, orbit) for one in found.sampled):
            continue
        known_ones = found.orbits if orbits.stable[i] else found.unstable
        if any(same(orbit, one, scale, max(SAME, 4 * map_.noise)) for one in known_ones):
            continue
        if not orbits.stable[i]:
            found.unstable.append(orbit)
            continue
        noisy = _behind(map_, orbit, scale, most)
        if noisy is None:
            found.add(map_, orbit, scale)
        else:
            found.add_sampled(noisy)
        added = True
    return added


def _behind(map_: Map, orbit: ClosedMotion, scale: np.ndarray, most: int) -> Noisy | None:
    """The exact orbit of another period about which an inexact map's orbit is scatter: its loops
    are made, or lost, by errors.
    """
    exact = _exactly(map_, orbit.points[:1], scale, most)[0] if _blurs(map_) else None
    noisy = None if exact is None or exact.period == orbit.period else blurred(map_, exact, scale)
    return noisy if noisy is not None and is_about(noisy, orbit) else None


def _blurs(map_: Map) -> bool:
    """True where a map has errors beyond rounding, and its motions have periods to blur."""
    return map_.exact_map is not None and not (
        isinstance(map_, Stroboscope) and autonomous(map_.system)
    )


def _exactly(
    map_: Map, state: np.ndarray, scale: np.ndarray, most: int
) -> list[ClosedMotion | None]:
    """The orbits to which the exact map settles from float64[k, D]."""
    assert map_.exact_map is not None
    exact, label, _ = find_attractors(map_.exact_map, state, scale, most)
    return [exact.orbits[i] if 0 <= i < len(exact.orbits) else None for i in label]


def _lies_on(place: np.ndarray, orbit: ClosedMotion, scale: np.ndarray, tolerance: float) -> bool:
    return bool(np.abs((orbit.points - place) / scale).max(axis=1).min() < tolerance)


def _on_cycles(
    map_: Map, found: AttractorSet, points: np.ndarray, who: np.ndarray, travel: Travel,
    rows: np.ndarray, scale: np.ndarray, owner: Owners, settled: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """True where a trajectory of an unforced flow is on a limit cycle, bool[k]. Looks for new
    cycles; notes the owners.
    """
    cycles = [one for one in found.sampled if one.kind == Kind.LIMIT_CYCLE.word]
    alone = np.flatnonzero(keep_to(cycles, points, INSIDE) < 0)
    some = (
        alone[
            np.unique(np.linspace(0, len(alone) - 1, min(MAX_CANDIDATES, len(alone))).astype(int))
        ]
        if len(alone)
        else alone
    )
    some = some[travel.going[rows[some]]]
    if len(some) and isinstance(map_, Stroboscope):
        fresh = limit_cycles(map_, points[some, -1], ROUND * float(map_.period[0]), scale)
        found.sampled = merge([*found.sampled, *fresh])
    return _keeping(found, Kind.LIMIT_CYCLE.word, points, who, travel.age, owner, settled)


def _survey(
    map_: Map, travel: Travel, going: np.ndarray, scale: np.ndarray, found: AttractorSet,
    owner: Owners, settled: np.ndarray, most: int, tell: Callable[[int], None],
) -> None:  # fmt: skip
    """Follow unsettled trajectories much longer. Accept an aperiodic attractor only if none leaves
    it.

    A chaotic saddle holds trajectories for thousands of periods too; what is seen to leave it
    betrays it.
    """
    survivors, points, leavers = _watch(travel, going, found, owner, settled, tell)
    if not len(survivors):
        return
    few, watching = watched(len(scale))
    chosen = np.unique(np.linspace(0, len(survivors) - 1, min(few, len(survivors))).astype(int))
    noisy, strays = _blurred(map_, travel.state[chosen], points[chosen], scale, most)
    keeps = keep_to(noisy, points[chosen], INSIDE) >= 0
    # stays on an orbit that doesn't attract
    rests = np.array([mismatch(points[i, -ROUND:], scale) < ARRIVED for i in chosen])
    free = chosen[~keeps & ~rests]
    seen = [*noisy, *survey(map_, travel.state[free], points[free], scale)]
    moves = chosen[keeps | ~rests]
    if len(moves):  # a long transient, if nothing is seen
        watching = watching if seen else SURVEY_ITERATES
        going_on = map_.launch(travel.state[moves], watching)
        ends = _leave(going_on, watching, found, noisy, scale, lambda age: tell(travel.age + age))
        leave = np.isfinite(ends).all(axis=(1, 2))
        leavers.append(points[moves][leave, -ROUND:])
        who, age = going[survivors[moves[leave]]], travel.age + going_on.age
        _arrive(map_, ends[leave], who, age, scale, found, most, owner, settled)
    for one in seen:
        if not any((one.share(iterates) >= INSIDE).any() for iterates in leavers if len(iterates)):
            found.add_sampled(one)
    label = (
        keeps_to_sampled(found, points[:, -ROUND:], scale)
        if found.sampled
        else np.full(len(survivors), -1)
    )
    for i, one in zip(going[survivors], label, strict=True):
        if one >= 0 and owner[i] is None:
            owner[i] = found.sampled[one]
    found.astray = (
        [stray for stray, one in zip(strays, label[chosen], strict=True) if one < 0]
        if strays
        else []
    )


def _watch(
    travel: Travel, going: np.ndarray, found: AttractorSet, owner: Owners, settled: np.ndarray,
    tell: Callable[[int], None],
) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:  # fmt: skip
    """Trajectories that don't settle for SURVEY_ITERATES more, int64[k], their iterates, and those
    of the ones that do.
    """
    survivors = np.arange(len(going))
    runs: list[np.ndarray] = []
    leavers: list[np.ndarray] = []
    for _ in range(SURVEY_ITERATES // ROUND):
        points = travel.advance(ROUND)
        caught = _captured(found, points, going[survivors], travel.age - ROUND, owner, settled)
        leavers += [iterates[caught] for iterates in runs]
        stays = ~caught & travel.going
        travel.keep(stays)
        survivors, runs = survivors[stays], [*(iterates[stays] for iterates in runs), points[stays]]
        tell(travel.age)
        if not len(survivors):
            break
    return survivors, np.concatenate(runs, axis=1), leavers


def _blurred(
    map_: Map, state: np.ndarray, runs: np.ndarray, scale: np.ndarray, most: int
) -> tuple[list[Noisy], list[Stray]]:
    """The noisy orbits that trajectories float64[k, SURVEY_ITERATES, D] keep to, and how far each
    strays from an exact one.

    They stand at float64[k, D]. Nothing of an exact map.
    """
    if not _blurs(map_):
        return [], []
    orbits = _exactly(map_, state, scale, most)
    strays = [
        stray_of(map_, orbit, iterates, scale) for orbit, iterates in zip(orbits, runs, strict=True)
    ]
    about = [
        blurred(map_, orbit, scale)
        for orbit in {id(orbit): orbit for orbit in orbits if orbit is not None}.values()
    ]
    return [one for one in about if one is not None and (one.share(runs) >= INSIDE).any()], strays


def _arrive(
    map_: Map, ends: np.ndarray, who: np.ndarray, age: int, scale: np.ndarray, found: AttractorSet,
    most: int, owner: Owners, settled: np.ndarray,
) -> None:  # fmt: skip
    """Note the orbits that trajectories float64[k, ROUND, D] have come to after very long."""
    if not len(ends):
        return
    while _add_orbits(map_, ends, scale, found, most, np.full(1, np.inf)):
        pass
    left = ~_captured(found, ends, who, age, owner, settled)
    _on_families(map_, found, ends[left], who[left], age, owner, settled, scale)


def _leave(
    travel: Travel, most: int, found: AttractorSet, noisy: list[Noisy], scale: np.ndarray,
    tell: Callable[[int], None],
) -> np.ndarray:  # fmt: skip
    """Last iterates of trajectories, followed for very long, that reach an orbit after all,
    float64[k, ROUND, D]; NaN of others. Those near a noisy orbit don't count.
    """
    going = np.arange(len(travel.state))
    left = np.full((len(going), ROUND, len(scale)), np.nan)
    while len(going) and travel.age < most:
        points = travel.advance(ROUND)
        arrives = found.near.capture(points)[0] >= 0
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
