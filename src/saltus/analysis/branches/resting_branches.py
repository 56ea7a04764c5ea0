"""Branches of periodic orbits on which a contact is held: an impact oscillator that comes to rest
on its stop. They are followed over one period, past impacts that cross it.

The impacts before a rest are a chatter. Where one of them comes just at the whole period at which
orbits begin, the point there jumps by the impact, though nothing happens to the motion. Beyond, the
orbit is nearly the old one, begun earlier or later by as much as its contacts have moved.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from saltus.analysis.branches.arclength import Arc, correct
from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.contact_sequences import ContactSequence, sequences
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.branches.switching import Seed
from saltus.analysis.branches.tracing import Plan, Start, both_ways
from saltus.flow.request import Schedule

#: Steps beyond an impact at the whole period, in parts of the range of the parameter: the next ones
#: of a chatter may cross it at once.
BEYOND = (3e-4, 1e-4, 3e-5, 1e-3, 3e-3, 1e-2, 3e-2)
#: Periods in which an orbit that attracts is reached from the guess.
SETTLES = 2
#: Farthest that Newton's method moves from the guess there, in units of the scale.
ASTRAY = 0.1
#: Largest change of the strongest impact in such a step: of its phase [periods], and of its speed
#: as a share.
PHASE, SPEED = 0.02, 0.1
#: Impacts passed in one direction, at most.
MOST_PASSED = 40
#: Fewest points for which a piece is begun.
LEAST = 4


def resting_pieces(plan: Plan, start: Start) -> list[Branch]:
    """The branch of a start in pieces, in their order, from one impact that crosses the whole
    period to the next. It ends with ``held`` where its contacts are held no more; with ``points``
    where more impacts, or points, would follow than are asked for.
    """
    flying = dict[int, np.ndarray]()

    def flies(orbits: PeriodicOrbits, curve: Arc) -> str:
        one = sequences(orbits, curve.z[-1][None])[0]
        if one is None or not one.flies:
            return ""
        flying.setdefault(id(curve), curve.z[-1])
        return "held"

    (first,) = both_ways(plan, [start], flies)
    if first is None:
        return []
    pieces = [first]
    for last in (-1, 0) if not first.closed else ():
        for passed in range(MOST_PASSED + 1):
            left = 2 * plan.points - sum(len(one.z) for one in pieces)
            if left < LEAST or passed == MOST_PASSED:
                _cut(pieces[last], last)
                break
            some = replace(plan, points=min(left, plan.points))
            piece = _behind(some, start, pieces[last], last, flies)
            if piece is None:
                break
            pieces.insert(len(pieces) if last else 0, piece)
    pieces[0].flying = list(flying.values())
    return pieces


def _cut(piece: Branch, last: int) -> None:
    """End a piece that is lost with ``points``: no more are to be followed."""
    begin, end = ("points" if why == "lost" else why for why in piece.ends)
    piece.ends = (piece.ends[0], end) if last else (begin, piece.ends[1])


def _behind(
    plan: Plan, start: Start, piece: Branch, last: int, flies: Callable[[Any, Arc], str]
) -> Branch | None:
    """The piece behind the last point (-1) or before the first one (0) of another, in the same
    order; None if that isn't lost with contacts that are held.
    """
    orbits = piece.orbits
    if piece.ends[last] != "lost" or len(piece.z) < 2 or not isinstance(orbits, PeriodicOrbits):
        return None
    inner = piece.z[last + 1 if last == 0 else last - 1]
    z = _beyond(orbits, inner, piece.z[last], plan)
    if z is None:
        return None
    size = orbits.n * orbits.size
    ahead = np.zeros(len(z))
    ahead[-1] = np.sign(z[-1] - piece.z[last, -1])
    seed = Seed(orbits.points(z), z[size:], start.seed.scale, ahead)
    (found,) = both_ways(plan, [replace(start, seed=seed, z=z)], flies)
    if found is None:
        return None
    if last:
        return found
    piece = _reversed(found)
    plan.watch.cut[id(piece)] = plan.watch.cut.pop(id(found), found)
    return piece


def _reversed(branch: Branch) -> Branch:
    return replace(
        branch,
        z=branch.z[::-1],
        tangent=-branch.tangent[::-1],
        derivative=branch.derivative[::-1],
        length=branch.length[-1] - branch.length[::-1],
        multipliers=branch.multipliers[::-1],
        ends=branch.ends[::-1],
    )


def _beyond(
    orbits: PeriodicOrbits, inner: np.ndarray, outer: np.ndarray, plan: Plan
) -> np.ndarray | None:
    """The orbit a step beyond the last one on a branch, float64[z], by this and an inner one; None
    if none is found.
    """
    before, now = sequences(orbits, np.array([inner, outer]))
    if before is None or now is None or before.flies or now.flies:
        return None
    (phase, speed), (earlier, _) = _strongest(now), _strongest(before)
    change = outer[-1] - inner[-1]
    if change == 0.0:
        return None
    drift = _turn(phase - earlier, orbits.n) / change
    up, row = np.eye(len(outer))[-1], np.zeros(1, np.int64)
    for share in BEYOND:
        step = np.sign(change) * share * (plan.limits[1] - plan.limits[0])
        if not plan.limits[0] <= outer[-1] + step <= plan.limits[1]:
            continue
        guess = outer.copy()
        guess[: orbits.n * orbits.size] = _shifted(orbits, outer, -drift * step).ravel()
        guess[-1] += step
        for periods in (0, SETTLES):
            near = _moved(orbits, guess, periods) if periods else guess
            point = correct(orbits, near[None], up[None], row, ASTRAY)
            found = sequences(orbits, point.z)[0] if point.found[0] else None
            if found is None or found.flies:
                continue
            there, faster = _strongest(found)
            moved = _turn(there - phase - drift * step, orbits.n)
            if abs(moved) < PHASE and abs(faster - speed) < SPEED * speed:
                return np.asarray(point.z[0])
    return None


def _strongest(one: ContactSequence) -> tuple[float, float]:
    """Phase of the contact with the largest speed [periods], and that speed."""
    place = int(np.argmax(np.abs(one.velocity)))
    return float(one.phase[place]), float(abs(one.velocity[place]))


def _turn(phase: float, n: int) -> float:
    """A phase of an orbit of n periods, between -n/2 and n/2."""
    return float(phase - n * np.round(phase / n))


def _shifted(orbits: PeriodicOrbits, z: np.ndarray, by: float) -> np.ndarray:
    """The points of an orbit that is the same, but begun by so many periods later,
    float64[n, D].
    """
    whole, share = int(np.floor(by)), by % 1.0
    starts = np.roll(orbits.starts(z[None])[0], -whole, axis=0)
    run = orbits.map.run(starts, 1, Schedule(np.zeros(1, np.int64), np.array([share])))
    return np.asarray(run.samples[:, 0, : orbits.size])


def _moved(orbits: PeriodicOrbits, z: np.ndarray, periods: int) -> np.ndarray:
    """Points float64[z] so many periods later, in the same order."""
    ends, _ = orbits.map.ends(orbits.starts(z[None])[0], periods)
    later = z.copy()
    later[: orbits.n * orbits.size] = np.roll(ends[:, : orbits.size], periods, axis=0).ravel()
    return later
