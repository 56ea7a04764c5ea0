"""Ends of branches of orbits with one contact sequence, and their continuation with another one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from saltus.analysis.branches.arclength import correct, tangents
from saltus.analysis.branches.contact_sequences import (
    ContactSequence,
    SequenceContact,
    shift,
    without,
)
from saltus.analysis.branches.grazes import ContactChange, corner, graze
from saltus.analysis.branches.legs import Legs
from saltus.kernels import status as st

#: Halvings of the last interval of a branch to see why it ends.
HALVINGS = 40
#: Distance from that interval at which the reason may lie, in intervals.
OUTSIDE = 0.05
#: Distances beyond an event at which the free flow is asked for the new contacts, in units of the
#: scale.
BEYOND = (1e-3, 1e-4, 1e-5, 1e-6)
#: Contacts of the free flow and of a virtual orbit that are the same differ less, in periods.
SAME_TIME = 1e-6
_ROW = np.zeros(1, np.int64)


@dataclass(frozen=True)
class Passage:
    """The change at which a branch of orbits with one contact sequence ends, and goes on with
    another.

    Attributes
    ----------
    change : ContactChange
        It.
    z : float64[z]
        The orbit in the unknowns of the branch that ends.
    onto : Legs or None
        The equations of the orbits beyond; None if they aren't known.
    start, along : float64[z]
        In them: the orbit at the event, and the way to go, in units of the scale.
    """

    change: ContactChange
    z: np.ndarray
    onto: Legs | None
    start: np.ndarray
    along: np.ndarray

    def into(self, legs: Legs, tangent: np.ndarray) -> np.ndarray:
        """The way in which the branch that ends reaches the event, on the side of another."""
        way = legs.tangent(self.z)
        return way if way @ tangent > 0 else -way


def end_of(legs: Legs, z: np.ndarray, beyond: np.ndarray, tangent: np.ndarray) -> Passage | None:
    """Locate the end of a branch between an orbit of the free flow and a virtual one; None if it
    isn't found.

    Parameters
    ----------
    legs : Legs
        The equations.
    z, beyond : float64[z]
        The two orbits.
    tangent : float64[z]
        At the first of them, towards the second, in units of the scale.
    """
    scale = legs.scale[0]
    for _ in range(HALVINGS):
        length = (beyond - z) / scale @ tangent
        end = _reason(legs, z, beyond, tangent)
        if end is not None:
            ahead = (end.z - z) / scale @ tangent
            if -OUTSIDE * length <= ahead <= (1 + OUTSIDE) * length:
                return end
        guess = z + 0.5 * length * tangent * scale
        middle = correct(legs, guess[None], tangent[None], _ROW, length)
        if not middle.found[0]:
            return None
        if legs.admissible(middle.z)[0]:
            z, tangent = middle.z[0], tangents(middle.derivative, tangent[None])[0]
        else:
            beyond = middle.z[0]
    return None


def _reason(legs: Legs, z: np.ndarray, beyond: np.ndarray, tangent: np.ndarray) -> Passage | None:
    """The event that makes an orbit virtual, if it is a single one."""
    speeds = legs.speeds(beyond[None])[0] if legs.contacts else np.ones(1)
    impacts = [int(i) for i in np.flatnonzero(speeds <= 0) if legs.jumps_at(int(i))]
    if impacts:
        return _impact_vanishes(legs, z, impacts[0]) if len(impacts) == 1 else None
    shrunk = np.flatnonzero(legs.spans(legs.nodes(beyond[None])[0])[0] <= 0)
    if len(shrunk):
        return _leg_vanishes(legs, z, int(shrunk[0]), tangent) if len(shrunk) == 1 else None
    extra = _first_extra(legs, beyond)
    return None if extra is None else _appears(legs, z, beyond, extra, tangent)


# -- contacts that vanish --------------------------------------------------------------------------
def _impact_vanishes(legs: Legs, z: np.ndarray, place: int) -> Passage | None:
    """An impact without speed: beyond, the orbit touches the stop no more."""
    event = _without(legs, z, (place,))
    if event is None:
        return None
    contact = legs.contacts[place]
    start, _ = with_impact(event, contact, legs, place, float(legs.nodes(z[None])[0][0, place]))
    along = event.legs.tangent(event.z)
    away = _touching(event) @ along
    side = -contact.direction  # of the gap where the stop isn't met
    return Passage(event, start, event.legs, event.z, along if away * side > 0 else -along)


def _without(legs: Legs, z: np.ndarray, places: tuple[int, ...]) -> ContactChange | None:
    """The graze at which some contacts of an orbit vanish."""
    phase = legs.nodes(z[None])[0][0]
    fewer = without(legs.sequence_at(z), places)
    shorter, near = Legs.of(legs.orbits, fewer, legs.orbit(z[None])[0], legs.free_scale)
    last = phase[places[-1]] + (legs.n if places[-1] < places[0] else 0.0)
    return graze(shorter, near, legs.contacts[places[0]].guard, 0.5 * (phase[places[0]] + last))


def _touching(event: ContactChange) -> np.ndarray:
    """Derivative of the gap that grazes with respect to the orbit, in units of the scale."""
    return np.asarray(event.slope * event.legs.scale[0])


def with_impact(
    event: ContactChange,
    contact: SequenceContact,
    like: Legs | None = None,
    number: int = 0,
    near: float = 0.0,
) -> tuple[np.ndarray, Legs]:
    """The orbit of a graze with the impact without speed among its contacts, float64[z], and its
    equations: those of another orbit if they are given, in which the impact has this number and
    comes near this phase.
    """
    legs, z = event.legs, event.z
    phase, before, others = legs.nodes(z[None])
    place = event.place
    when = phase[0, place] + (event.phase - phase[0, place]) % legs.n
    nodes = np.concatenate([phase[0][:, None], before[0]], axis=1)
    if not legs.contacts:
        nodes = nodes[:0]
    new = np.append(when, event.state)
    where = place + 1 if legs.contacts else 0
    nodes = np.insert(nodes, where, new, axis=0)
    contacts = (*legs.contacts[:where], contact, *legs.contacts[where:])
    if like is None:
        sequence = ContactSequence(
            contacts, nodes[:, 0], nodes[:, 1:], np.zeros(len(nodes)), contact.after
        )
        each = np.append(1.0, legs.free_scale[: legs.size])
        unit = legs.free_scale[legs.n * legs.size :]
        like = Legs(legs.orbits, sequence, np.append(np.tile(each, len(nodes)), unit)[None])
    else:  # in the order in which its contacts are numbered, which may all be alike
        order = (where - number) % len(contacts)
        nodes[:order, 0] += legs.n
        nodes = np.roll(nodes, -order, axis=0)
        nodes[:, 0] += legs.n * np.round((near - nodes[number, 0]) / legs.n)
    return np.append(nodes.ravel(), others[0]), like


def _leg_vanishes(legs: Legs, z: np.ndarray, place: int, tangent: np.ndarray) -> Passage | None:
    """Two contacts at once: a guard that is left as it is met, or two guards."""
    after = (place + 1) % legs.count
    first, second = legs.contacts[place], legs.contacts[after]
    if first.guard == second.guard:
        event = _without(legs, z, (place, after))
        if event is None:
            return None
        onto, start = event.legs, event.z
        away, side = _touching(event) @ onto.tangent(start), -first.direction
        along = onto.tangent(start) * (1.0 if away * side > 0 else -1.0)
        # in its own unknowns at z: where the leg vanishes, these equations are singular
        return Passage(event, z, onto, start, along)
    event = corner(legs, z, place)
    return None if event is None else _by_free_flow(event, event.z, tangent)


# -- contacts that appear --------------------------------------------------------------------------
def _first_extra(legs: Legs, z: np.ndarray) -> tuple[SequenceContact, float] | None:
    """The first contact that the free flow meets beside those of a virtual orbit, and when."""
    free, begin = legs.free_flow(z[None])[0], legs.begin(z[None])[0]
    if free is None:
        return None
    known = legs.nodes(z[None])[0][0] if legs.contacts else np.zeros(0)
    phase = np.sort((known - begin) % legs.n) + begin
    for i, contact in enumerate(free.contacts):
        if i == len(phase) or free.phase[i] < phase[i] - SAME_TIME:
            return contact, float(free.phase[i])
    return None


def _appears(
    legs: Legs,
    z: np.ndarray,
    beyond: np.ndarray,
    extra: tuple[SequenceContact, float],
    tangent: np.ndarray,
) -> Passage | None:
    """A boundary that is met beyond an orbit that touches it."""
    contact, phase = extra
    event = graze(legs, beyond, contact.guard, phase) or graze(legs, z, contact.guard, phase)
    if event is None:
        return None
    if contact.kind != st.IMPACT:
        return _by_free_flow(event, event.z, tangent)
    start, onto = with_impact(event, contact)
    along = onto.tangent(start)
    place = event.place + 1 if legs.contacts else 0
    step = 1e-6 * along * onto.scale[0]
    faster = onto.speeds(np.array([start + step, start - step]))[:, place]
    return Passage(event, event.z, onto, start, along if faster[0] > faster[1] else -along)


def _by_free_flow(event: ContactChange, z: np.ndarray, tangent: np.ndarray) -> Passage:
    """The end of a branch beyond which the free flow finds the contacts of its orbits."""
    legs = event.legs
    for beyond in BEYOND:
        virtual = z + beyond * tangent * legs.scale[0]
        free, begin = legs.free_flow(virtual[None])[0], legs.begin(virtual[None])
        orbit = legs.orbit(virtual[None], begin)
        if free is None or shift(legs.sequence_at(virtual), free, legs.n) is not None:
            continue
        onto, near = Legs.of(legs.orbits, free, orbit[0], legs.free_scale)
        along = onto.tangent(near)
        step = 1e-6 * along * onto.scale[0]
        ahead = (onto.orbit((near + step)[None], begin) - onto.orbit(near[None], begin))[0]
        old = legs.orbit((virtual + 1e-6 * tangent * legs.scale[0])[None], begin)[0] - orbit[0]
        sign = 1.0 if (ahead / legs.free_scale) @ (old / legs.free_scale) > 0 else -1.0
        onto.accepted(near[None], _ROW)
        point = correct(onto, near[None], sign * along[None], _ROW, 10 * beyond)
        if point.found[0] and onto.admissible(point.z)[0]:
            return Passage(event, z, onto, point.z[0], sign * along)
    return Passage(event, z, None, z, tangent)
