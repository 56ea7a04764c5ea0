"""Changes of the contact sequence along a branch, and their causes: grazes and corners."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from saltus.analysis.branches.arclength import correct
from saltus.analysis.branches.contact_sequences import (
    ContactSequence,
    in_order,
    sequences,
    shift,
    without,
)
from saltus.analysis.branches.events import Event
from saltus.analysis.branches.grazes import ContactChange, corner, graze
from saltus.analysis.branches.grazing_orbits import sqrt_coefficient
from saltus.analysis.branches.legs import Legs
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.system.leg import has_legs

#: Halvings of an interval in which the change isn't one graze, one corner, or several grazes at
#: once.
HALVINGS = 24
#: Grazes at one interval of a branch that are told apart without halving it.
MOST_AT_ONCE = 4
#: Shortest contacts among which they are sought.
SHORTEST = 16
#: Distance from its interval at which an event may lie, in intervals.
OUTSIDE = 0.02
#: Grazes nearer than this, in units of the scale, come at once.
AT_ONCE = 1e-9


@dataclass(frozen=True)
class _Point:
    """A point of a branch and its contacts."""

    z: np.ndarray
    sequence: ContactSequence


def contact_points(
    orbits: PeriodicOrbits, row: int, z: np.ndarray, tangent: np.ndarray
) -> list[Event]:
    """All changes of the contact sequence between the points of a branch and the next ones; none
    where contacts are held, equations switch by the time, or the states are many.

    Parameters
    ----------
    orbits : PeriodicOrbits
        The equations.
    row : int
        Which of its curves.
    z, tangent : float64[p, z]
        The points, and the tangents there in units of the scale.
    """
    if not has_legs(orbits.parametric.system):
        return []
    points = _points(orbits, z)
    found = [
        (after, change)
        for after, (one, other) in enumerate(itertools.pairwise(points))
        if one is not None and other is not None
        for change in _between(orbits, row, tangent[after], one, other, 0)
    ]
    if not found:
        return []
    events = [(after, event_of(change)) for after, change in found]
    derivative = orbits.evaluate(
        np.array([event.z for _, event in events]), np.full(len(events), row)
    )[1]
    return [
        replace(event, after=after, tangent=tangent[after], derivative=matrix)
        for (after, event), matrix in zip(events, derivative, strict=True)
    ]


def event_of(change: ContactChange, begin: float = 0.0, outcome: str = "") -> Event:
    """The event on a branch that a change of contacts is, with its orbit by the points at whole
    periods after a time [periods].
    """
    legs = change.legs
    return Event(
        change.kind,
        0,
        legs.orbit(change.z[None], begin)[0],
        change.multipliers,
        guards=change.guards,
        phase=(change.phase - begin) % legs.n,
        outcome=outcome,
        sqrt_coefficient=sqrt_coefficient(change),
    )


def _points(orbits: PeriodicOrbits, z: np.ndarray) -> list[_Point | None]:
    """Orbits with their contacts; None where one of these is held."""
    return [
        None if found is None or not found.flies else _Point(one, found)
        for one, found in zip(z, sequences(orbits, z), strict=True)
    ]


def _between(
    orbits: PeriodicOrbits, row: int, tangent: np.ndarray, one: _Point, other: _Point, depth: int
) -> list[ContactChange]:
    """The events between two points of a branch."""
    first, second = one.sequence, other.sequence
    if shift(first, second, orbits.n) is not None:
        return []
    length = _ahead_of(orbits, row, tangent, one.z, other.z)
    found = _at_once(orbits, row, one, other)
    places = np.array([_ahead(orbits, row, tangent, one.z, event) for event in found])
    inside = (places >= -OUTSIDE * length) & (places <= (1 + OUTSIDE) * length)
    if found and inside.all() and np.ptp(places) <= AT_ONCE:
        return found
    if depth == HALVINGS:
        return [event for event, good in zip(found, inside, strict=True) if good]
    guess = one.z + 0.5 * length * tangent * orbits.scale[row]
    middle = correct(orbits, guess[None], tangent[None], np.array([row]), length)
    if not middle.found[0]:
        return []
    half = _points(orbits, middle.z)[0]
    if half is None:
        return []
    return [
        *_between(orbits, row, tangent, one, half, depth + 1),
        *_between(orbits, row, tangent, half, other, depth + 1),
    ]


def _ahead(
    orbits: PeriodicOrbits, row: int, tangent: np.ndarray, z: np.ndarray, event: ContactChange
) -> float:
    return _ahead_of(orbits, row, tangent, z, event.orbit)


def _ahead_of(
    orbits: PeriodicOrbits, row: int, tangent: np.ndarray, z: np.ndarray, other: np.ndarray
) -> float:
    """Distance of a point ahead of another one along a tangent, in units of the scale."""
    return float((other - z) / orbits.scale[row] @ tangent)


def _at_once(orbits: PeriodicOrbits, row: int, one: _Point, other: _Point) -> list[ContactChange]:
    """The grazes, or the corner, that alone tell two sequences apart; none if there are more."""
    scale = orbits.scale[row]
    fewer, more = sorted((one, other), key=lambda point: len(point.sequence.contacts))
    short, long = fewer.sequence, more.sequence
    if len(short.contacts) == len(long.contacts):
        for place, order in _swaps(len(short.contacts)):
            if shift(_swapped(short, order), long, orbits.n) is not None:
                event = corner(*Legs.of(orbits, short, fewer.z, scale), place)
                return [event] if event is not None else []
        return []
    for contacts in _removals(long, len(long.contacts) - len(short.contacts), orbits.n):
        fewer_contacts = without(long, [place for contact in contacts for place in contact])
        if shift(fewer_contacts, short, orbits.n) is None:
            continue
        legs, z = Legs.of(orbits, short, fewer.z, scale)
        events = [
            graze(legs, z, long.contacts[contact[0]].guard, _midst(long, contact, orbits.n))
            for contact in contacts
        ]
        return [event for event in events if event is not None] if all(events) else []
    return []


def _swaps(count: int) -> Iterator[tuple[int, list[int]]]:
    """Neighbours in a sequence, and the order of it with both exchanged."""
    for place in range(count if count > 2 else count - 1):
        order = list(range(count))
        after = (place + 1) % count
        order[place], order[after] = after, place
        yield place, order


def _swapped(one: ContactSequence, order: list[int]) -> ContactSequence:
    """The contacts in another order, at the same times."""
    new = in_order(one, order)
    return ContactSequence(new.contacts, one.phase, new.after, new.velocity, one.mode)


def _removals(one: ContactSequence, count: int, n: int) -> Iterator[tuple[tuple[int, ...], ...]]:
    """Sets of contacts, ``count`` places in all, that might be new, the shortest contacts first.

    A contact is the two places at which a guard is crossed, there and back, or the one place of an
    impact or a jump.
    """
    contacts: list[tuple[float, tuple[int, ...]]] = []
    m = len(one.contacts)
    for i, contact in enumerate(one.contacts):
        contacts.append((abs(one.velocity[i]) / max(np.abs(one.velocity).max(), 1e-300), (i,)))
        for j in range(1, m):
            back = one.contacts[(i + j) % m]
            if back.guard == contact.guard:
                if back.direction == -contact.direction:
                    lasts = (one.phase[(i + j) % m] - one.phase[i]) % n
                    contacts.append((lasts / n, (i, (i + j) % m)))
                break
    shortest = sorted(contacts)[:SHORTEST]
    for how_many in range(1, MOST_AT_ONCE + 1):
        for chosen in itertools.combinations(shortest, how_many):
            places = [place for _, contact in chosen for place in contact]
            if len(places) == count == len(set(places)):
                yield tuple(contact for _, contact in chosen)


def _midst(one: ContactSequence, contact: tuple[int, ...], n: int) -> float:
    """The time in the midst of a contact, in periods."""
    first, last = one.phase[contact[0]], one.phase[contact[-1]]
    return float((first + 0.5 * ((last - first) % n)) % n)
