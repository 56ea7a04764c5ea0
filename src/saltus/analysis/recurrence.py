"""From trajectories of a map to its attractors: settle, notice what recurs, polish it, and find out what never does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from saltus.analysis.capture import Neighbourhoods, neighbourhoods
from saltus.analysis.equilibria import autonomous
from saltus.analysis.limit_cycles import LIMIT_CYCLE, limit_cycles
from saltus.analysis.orbits import Orbit, polish, same
from saltus.analysis.wandering import REPEATS, TRAIL, Wandering, merge, mismatch, survey
from saltus.flow.maps import Map, Stroboscope, Travel

#: Longest period looked for [iterates].
LONGEST = 64
#: Iterates between two looks: two of the longest periods.
ROUND = 2 * LONGEST
#: States a period apart that agree so well, in units of the scale, are worth a try by Newton.
NEAR = 1e-3
#: Largest distance between equal orbits, in units of the scale.
SAME = 1e-6
#: Orbits tried in one round; what isn't tried has its turn in the next.
TRIES = 12
#: Trajectories that never recur whose motion is surveyed.
SURVEYED = 24
#: Iterates that they are watched, and what their repeats come to, in units of the scale, when they are on an orbit after all.
WATCHED, ARRIVED = 32 * 1024, 1e-5
#: Share of a trajectory's points that must lie in an attractor's boxes to belong to it.
INSIDE = 0.9


@dataclass
class Found:
    """Attractors of a map, in the order of their ids.

    Attributes
    ----------
    near : Neighbourhoods
        Where the periodic ones capture.
    orbits : list of Orbit
        The periodic ones, stable.
    wandering : list of Wandering
        Those that never repeat: their ids follow.
    unstable : list of Orbit
        Periodic orbits met on the way that don't attract.
    """

    near: Neighbourhoods
    orbits: list[Orbit] = field(default_factory=list)
    wandering: list[Wandering] = field(default_factory=list)
    unstable: list[Orbit] = field(default_factory=list)

    def __len__(self) -> int:
        return len(self.orbits) + len(self.wandering)

    def add(self, map_: Map, orbit: Orbit, scale: np.ndarray) -> None:
        """One more periodic attractor, and where it captures."""
        self.near = self.near.joined(neighbourhoods(map_, orbit, len(self.orbits), scale))
        self.orbits.append(orbit)

    def ordered(self, scale: np.ndarray) -> Found:
        """The same with ids that don't depend on the order of discovery: by period, then by size, then by place."""
        order = sorted(range(len(self.orbits)), key=lambda i: (self.orbits[i].period, *_rounded(self.orbits[i], scale)))
        wandering = sorted(self.wandering, key=lambda w: (w.kind, *w.first))
        near = self.near.renumbered(np.argsort(np.array(order, np.int64)))
        return Found(near, [self.orbits[i] for i in order], wandering, self.unstable)


def _rounded(orbit: Orbit, scale: np.ndarray) -> tuple[float, ...]:
    """Size and place of an orbit, coarse enough that rounding can't change their order."""
    sizes = np.sqrt(np.mean((orbit.points / scale) ** 2, axis=0))
    return tuple(np.round(np.concatenate([sizes, orbit.points[0] / scale]), 7).tolist())


def find(
    map_: Map,
    start: np.ndarray,
    scale: np.ndarray,
    most: int,
    known: Found | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[Found, np.ndarray, np.ndarray]:
    """The attractors that trajectories from given starts settle to.

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
    known : Found, optional
        Attractors that are known already.
    progress : callable, optional
        Called with the share done.

    Returns
    -------
    found : Found
        Known and new attractors, in the order of their ids.
    label : int64[k]
        The attractor of each start; -1 where none was established.
    settled : int64[k]
        Iterates after which it was captured; -1 if it wasn't.
    """
    found = known or Found(Neighbourhoods.none(start.shape[1]))
    found = Found(found.near, list(found.orbits), list(found.wandering), list(found.unstable))
    owner: list[Orbit | Wandering | None] = [None] * len(start)
    settled = np.full(len(start), -1, np.int64)
    travel, going = map_.launch(start, most), np.arange(len(start))
    turns = isinstance(map_, Stroboscope) and autonomous(map_.system)
    while len(going) and travel.age < most:
        points = travel.advance(ROUND)
        here = np.flatnonzero(~_captured(found, points, going, travel.age - ROUND, owner, settled))
        while len(here):
            orbit = _new_orbit(map_, points[here], scale, found)
            if orbit is None:
                break
            found.add(map_, orbit, scale)
            here = here[~_captured(found, points[here], going[here], travel.age - ROUND, owner, settled)]
        if turns and len(here):
            here = here[~_on_cycles(map_, found, points[here], going[here], travel, here, scale, owner, settled)]
        stay = np.zeros(len(going), bool)
        stay[here] = travel.going[here]
        travel.keep(stay)
        going = going[stay]
        if progress:
            progress(max(1.0 - len(going) / len(start), travel.age / most))
    if len(going):
        _survey(map_, travel, going, scale, found, owner, settled)
    result = found.ordered(scale)
    label = np.array([-1 if one is None else _index(result, one) for one in owner], np.int64)
    return result, label, settled


def _index(found: Found, attractor: Orbit | Wandering) -> int:
    for i, one in enumerate([*found.orbits, *found.wandering]):
        if one is attractor:
            return i
    raise AssertionError("an owner that isn't an attractor")


def _captured(found: Found, points: np.ndarray, who: np.ndarray, age: int, owner: list, settled: np.ndarray) -> np.ndarray:
    """Note which of the trajectories are captured, and after how many iterates."""
    label, when = found.near.capture(points)
    caught = label >= 0
    for i, orbit, at in zip(who[caught], label[caught], when[caught], strict=True):
        owner[i], settled[i] = found.orbits[orbit], age + at + 1
    return caught


def _new_orbit(map_: Map, points: np.ndarray, scale: np.ndarray, found: Found) -> Orbit | None:
    """An attracting orbit not known yet that one of the trajectories float64[k, ROUND, D] follows, if there is one."""
    period, apart = recurrence(points, scale)
    near = max(NEAR, map_.noise)
    tries = [i for i in np.argsort(apart, kind="stable") if apart[i] < near]
    seen: list[np.ndarray] = []
    for i in tries:
        place = points[i, -1]
        if any(_lies_on(place, orbit, scale, 10 * apart[i]) for orbit in found.unstable) or any(
            np.abs((place - other) / scale).max() < near for other in seen
        ):
            continue
        if len(seen) >= TRIES:
            break
        seen.append(place)
        orbit = polish(map_, place, int(period[i]), scale)
        if orbit is None or not _lies_on(place, orbit, scale, 100 * near):
            continue
        if not orbit.stable:
            found.unstable.append(orbit)
        elif not any(same(orbit, one, scale, max(SAME, 4 * map_.noise)) for one in found.orbits):
            return orbit
    return None


def recurrence(points: np.ndarray, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """For trajectories float64[k, m, D]: the smallest n that repeats nearly as well as the best, and how well, in units of the scale."""
    last = points[:, -1]
    candidates = []
    for n in range(1, points.shape[1] // 2 + 1):
        now = np.abs((points[:, -1] - points[:, -1 - n]) / scale).max(axis=1)
        before = np.abs((points[:, -1 - n // 2] - points[:, -1 - n - n // 2]) / scale).max(axis=1)
        candidates.append(np.maximum(now, before))
    apart = np.stack(candidates, axis=1)
    apart = np.where(np.isfinite(apart), apart, np.inf)
    best = apart.min(axis=1)
    period = 1 + np.argmax(apart <= np.maximum(4.0 * best, 1e-12)[:, None], axis=1)
    return period, np.where(np.isfinite(last).all(axis=1), apart[np.arange(len(points)), period - 1], np.inf)


def _lies_on(place: np.ndarray, orbit: Orbit, scale: np.ndarray, tolerance: float) -> bool:
    return bool(np.abs((orbit.points - place) / scale).max(axis=1).min() < tolerance)


def _on_cycles(
    map_: Map, found: Found, points: np.ndarray, who: np.ndarray, travel: Travel, rows: np.ndarray, scale: np.ndarray, owner: list,
    settled: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Which trajectories of a flow without forcing go round a limit cycle, bool[k]; new ones are looked for. Notes their owners."""
    cycles = [one for one in found.wandering if one.kind == LIMIT_CYCLE]
    alone = np.flatnonzero(~_goes_round(cycles, points))
    some = alone[np.unique(np.linspace(0, len(alone) - 1, min(TRIES, len(alone))).astype(int))] if len(alone) else alone
    some = some[travel.going[rows[some]]]
    if len(some) and isinstance(map_, Stroboscope):
        fresh = limit_cycles(map_, points[some, -1], ROUND * map_.period, scale)
        found.wandering = merge([*found.wandering, *fresh])
        cycles = [one for one in found.wandering if one.kind == LIMIT_CYCLE]
    round_it = _goes_round(cycles, points)
    for i in np.flatnonzero(round_it):
        owner[who[i]] = max(cycles, key=lambda one: float(one.share(points[[i]])[0]))
        settled[who[i]] = travel.age
    return round_it


def _goes_round(cycles: list[Wandering], points: np.ndarray) -> np.ndarray:
    """Which trajectories float64[k, m, D] keep to one of some limit cycles, bool[k]."""
    keeps = [one.share(points) >= INSIDE for one in cycles]
    return np.any(keeps, axis=0) if keeps else np.zeros(len(points), bool)


def _survey(map_: Map, travel: Travel, going: np.ndarray, scale: np.ndarray, found: Found, owner: list, settled: np.ndarray) -> None:
    """Find out what the trajectories do that never settled: watch them much longer, and call an attractor only what none of them leaves.

    A chaotic saddle holds trajectories for thousands of periods too; what is seen to leave it betrays it.
    """
    survivors = np.arange(len(going))
    trails: list[np.ndarray] = []
    leavers: list[np.ndarray] = []
    for _ in range(TRAIL // ROUND):
        points = travel.advance(ROUND)
        caught = _captured(found, points, going[survivors], travel.age - ROUND, owner, settled)
        leavers += [trail[caught] for trail in trails]
        stays = ~caught & travel.going
        travel.keep(stays)
        survivors, trails = survivors[stays], [*(trail[stays] for trail in trails), points[stays]]
        if not len(survivors):
            return
    chosen = np.unique(np.linspace(0, len(survivors) - 1, min(SURVEYED, len(survivors))).astype(int))
    points = np.concatenate(trails, axis=1)
    chosen = chosen[[mismatch(points[i, -ROUND:], scale) >= ARRIVED for i in chosen]]  # others stay on an orbit that doesn't attract
    seen = survey(map_, travel.state[chosen], points[chosen], scale)
    if seen:
        leavers.append(points[chosen][_leave(map_, travel.state[chosen], found, scale), -ROUND:])
    fresh = [one for one in seen if not any((one.share(trail) >= INSIDE).any() for trail in leavers if len(trail))]
    found.wandering = merge([*found.wandering, *fresh])
    if not found.wandering:
        return
    label = wanders_on(found, points[:, -ROUND:], scale)
    for i, one in zip(going[survivors], label, strict=True):
        if one >= 0:
            owner[i] = found.wandering[one]


def _leave(map_: Map, state: np.ndarray, found: Found, scale: np.ndarray) -> np.ndarray:
    """Which of some trajectories, watched for very long, come to an orbit after all, bool[k]."""
    travel, going = map_.launch(state, WATCHED), np.arange(len(state))
    left = np.zeros(len(state), bool)
    while len(going) and travel.age < WATCHED:
        points = travel.advance(ROUND)
        arrives = found.near.capture(points)[0] >= 0
        if travel.age % (8 * ROUND) == 0:
            arrives |= [mismatch(trail, scale) < ARRIVED for trail in points]
        left[going[arrives]] = True
        stays = ~arrives & travel.going
        travel.keep(stays)
        going = going[stays]
    return left


def wanders_on(found: Found, trails: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """For trajectories float64[k, m, D]: which attractor of those that never repeat each keeps to, -1 if none; none if it repeats."""
    shares = np.stack([one.share(trails) for one in found.wandering], axis=1)
    _, apart = recurrence(trails, scale)
    best = shares.argmax(axis=1)
    turns = np.array([one.kind == LIMIT_CYCLE for one in found.wandering])  # looks at one may well repeat
    return np.where((shares.max(axis=1) >= INSIDE) & ((apart > REPEATS) | turns[best]), best, -1)
