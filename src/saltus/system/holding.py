"""Contacts that can be held: hold guards behind all others, and the reduced equations where they
say so.

A contact that is held keeps a function w of state and time at zero: the closing velocity of a stop
at which the motion rests, the function of a surface onto which both sides push. Its force enters
the field along a direction D, as lambda D; lambda follows from dw/dt = 0. Several contacts that
are held at once are eliminated one after the other: what is left of the field and of the other
directions no longer changes the w of those before. Leine & Nijmeijer, Dynamics and Bifurcations of
Non-Smooth Mechanical Systems (2004), sections 3, 5; Filippov, Differential Equations with
Discontinuous Righthand Sides (1988), section 4.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.system import expression as ex
from saltus.system.derivatives import differentiate
from saltus.system.evaluate import evaluate
from saltus.system.expression import Bit, Expr
from saltus.system.guards import Guard, Law, bits_in
from saltus.system.singular import assuming

_ZERO, _ONE = ex.constant(0.0), ex.constant(1.0)
#: Places on a boundary at which a force is looked at from both sides, and the relative difference
#: that is rounding.
PLACES, SAME = 5, 1e-9
#: Stands for the sign of a two-valued force while its middle and its direction are worked out; no
#: parameter has this name.
_SIGN = ex.parameter("sign of a surface")


@dataclass(frozen=True)
class Contact:
    """A contact that can be held.

    Attributes
    ----------
    guard : int
        Number of its own guard.
    w : Expr
        What is zero while it is held.
    law : Law
        What is known of it already: kind, side, reset, limit, restitution.
    direction : tuple of Expr
        What a unit of its force adds to the field.
    """

    guard: int
    w: Expr
    law: Law
    direction: tuple[Expr, ...]


def with_holding(
    states: Sequence[str],
    field: Sequence[Expr],
    guards: Sequence[Guard],
    contacts: Sequence[Contact],
) -> tuple[tuple[Expr, ...], tuple[Guard, ...]]:
    """The reduced field and all guards, those of the contacts with their laws, and a hold guard for
    each contact behind them.
    """
    made = _Reduction(tuple(map(ex.state, states)), tuple(field), len(guards), contacts)
    laws = {contact.guard: made.law(j) for j, contact in enumerate(contacts)}
    own = [
        replace(guard, law=laws[number]) if number in laws else guard
        for number, guard in enumerate(guards)
    ]
    return made.field(), (*own, *(made.hold_guard(j, guards) for j in range(len(contacts))))


class _Reduction:
    """Eliminates the forces of contacts from a field."""

    def __init__(
        self,
        states: tuple[Expr, ...],
        field: tuple[Expr, ...],
        first: int,
        contacts: Sequence[Contact],
    ) -> None:
        self.states, self.first, self.contacts = states, first, list(contacts)
        self.rows = [tuple(differentiate(c.w, one) for one in states) for c in contacts]
        self.drifts = [differentiate(c.w, ex.TIME) for c in contacts]
        self.free = field
        for j, contact in enumerate(self.contacts):
            if contact.law.kind == "surface":
                middle = middle_and_direction(self.free, contact.guard)[0]
                self.free = self._where_held(j, middle, self.free)
        self._pivots = self._chosen()

    # -- what is asked for -------------------------------------------------------------------------
    def field(self) -> tuple[Expr, ...]:
        """The field: where a contact is held, the reduced one, of which w stays zero to the last
        bit if that can be had.
        """
        rates = list(self._eliminated(None)[0])
        for j, pivot in self._pivots.items():
            rest = self.drifts[j]
            for i, weight in enumerate(self.rows[j]):
                if i != pivot:
                    rest = ex.add(rest, ex.mul(weight, rates[i]))
            held = _quotient(ex.neg(rest), self.rows[j][pivot])
            free = assuming(rates[pivot], self.first + j, False)
            rates[pivot] = ex.select(self._held(j), held, free)
        return tuple(rates)

    def law(self, j: int) -> Law:
        """The law of a contact, complete."""
        drive, pivot, direction = self._own(j)
        contact = self.contacts[j]
        return replace(
            contact.law,
            partner=self.first + j,
            constraint=contact.w,
            normal=self.rows[j],
            direction=direction,
            drive=drive,
            pivot=pivot,
            settled=self._settled(j),
        )

    def hold_guard(self, j: int, guards: Sequence[Guard]) -> Guard:
        """The guard that says whether a contact is held; positive as long as it can be."""
        drive, pivot, _ = self._own(j)
        contact, owner = self.contacts[j], guards[self.contacts[j].guard].name
        law = Law("hold", partner=contact.guard)
        if contact.law.kind == "impact":
            return Guard(f"{owner} at rest", drive, law=law)
        limit = _ONE if contact.law.limit is None else contact.law.limit
        limit = ex.mul(limit, pivot)
        gap = ex.sub(ex.mul(limit, limit), ex.mul(drive, drive))
        return Guard(f"{owner} held", gap, law=law)

    # -- elimination -------------------------------------------------------------------------------
    def _own(self, j: int) -> tuple[Expr, Expr, tuple[Expr, ...]]:
        """Rate of w without the contact's own force, what a unit of that changes of it, and of the
        field; all others that are held eliminated.
        """
        rates, directions = self._eliminated(j)
        if self.contacts[j].law.kind == "surface":
            held = self.first + j
            rates = tuple(assuming(rate, held, True) for rate in rates)
        drive = ex.add(_dot(self.rows[j], rates), self.drifts[j])
        return drive, _dot(self.rows[j], directions[j]), directions[j]

    def _eliminated(self, without: int | None) -> tuple[tuple[Expr, ...], list[tuple[Expr, ...]]]:
        """Field and directions, with the forces of all contacts that are held but one."""
        rates, directions = self.free, [contact.direction for contact in self.contacts]
        for j, row in enumerate(self.rows):
            if j == without:
                continue
            own = directions[j]
            pivot = _dot(row, own)
            force = _quotient(ex.neg(ex.add(_dot(row, rates), self.drifts[j])), pivot)
            rates = self._where_held(j, _moved(rates, own, force), rates)
            for other, direction in enumerate(directions):
                along = _dot(row, direction) if other != j else _ZERO
                if not _is(along, 0.0):
                    share = _quotient(ex.neg(along), pivot)
                    moved = _moved(direction, own, share)
                    directions[other] = self._where_held(j, moved, direction)
        return rates, directions

    def _held(self, j: int) -> Bit:
        return Bit(self.first + j)

    def _where_held(self, j: int, held: Sequence[Expr], free: Sequence[Expr]) -> tuple[Expr, ...]:
        return tuple(ex.select(self._held(j), a, b) for a, b in zip(held, free, strict=True))

    # -- pivots ------------------------------------------------------------------------------------
    def _chosen(self) -> dict[int, int]:
        """For each contact a state that its w is a plain multiple of, and that its force moves: the
        one that no other contact has, if there is a choice.
        """
        chosen: dict[int, int] = {}
        for j, (row, contact) in enumerate(zip(self.rows, self.contacts, strict=True)):
            fit = [
                i
                for i, weight in enumerate(row)
                if not _is(weight, 0.0)
                and not ex.varies(weight)
                and not _is(contact.direction[i], 0.0)
                and i not in chosen.values()
            ]
            if fit:
                others = [k for k in range(len(self.rows)) if k != j]
                chosen[j] = min(
                    fit, key=lambda i: sum(not _is(self.rows[k][i], 0.0) for k in others)
                )
        return chosen

    def _settled(self, j: int) -> tuple[Expr, ...]:
        """The state with w = 0, changed in the pivot only."""
        settled = list(self.states)
        if j in self._pivots:
            i = self._pivots[j]
            rest = ex.substituted(self.contacts[j].w, self.states[i], _ZERO)
            settled[i] = _quotient(ex.neg(rest), self.rows[j][i])
        return tuple(settled)


# -- surfaces --------------------------------------------------------------------------------------
def surfaces(
    states: Sequence[str],
    field: Sequence[Expr],
    guards: Sequence[Guard],
    limits: Mapping[int, Expr],
) -> list[Contact]:
    """The guards whose own side changes the rate of their gap: both sides may push onto them.

    ``limits`` holds static over kinetic force of those that have one.
    """
    found = []
    for number, guard in enumerate(guards):
        row = [differentiate(guard.gap, ex.state(name)) for name in states]
        rate = _dot(row, field)
        if number not in bits_in([rate]) or not _jumps(rate, number, guard.gap, states, guards):
            continue
        limit = limits.get(number, _ONE)
        law = Law("surface", limit=limit, zeros=2 if _is(limit, 1.0) else 1)
        direction = middle_and_direction(field, number)[1]
        found.append(Contact(number, guard.gap, law, direction))
    return found


def _jumps(
    rate: Expr, number: int, gap: Expr, states: Sequence[str], guards: Sequence[Guard]
) -> bool:
    """Whether an expression differs on the two sides of a boundary, at places on it: of a law that
    begins with zero there it doesn't.
    """
    random = np.random.default_rng(2)
    gaps = [guard.gap for guard in guards]
    leaves = {node for node in ex.walk(rate, *gaps) if node.op == "param"}
    known: dict[str, Any] = {
        "t": random.uniform(0.5, 2.0, PLACES),
        "values": {node.payload: random.uniform(0.5, 2.0) for node in leaves},
    }
    bits: list[Any] = []
    at = {name: random.uniform(-2.0, 2.0, PLACES) for name in states}
    slopes = [differentiate(gap, ex.state(name)) for name in states]
    for _ in range(3):  # onto the boundary, along the gradient
        bits = []
        for one in gaps:
            bits.append(evaluate([one], states=at, bits=bits, **known)[0] > 0)
        distance, *normal = evaluate([gap, *slopes], states=at, bits=bits, **known)
        square = sum(np.square(n) for n in normal)
        at = {
            name: place - distance * n / square
            for (name, place), n in zip(at.items(), normal, strict=True)
        }
    sides = [assuming(rate, number, value) for value in (True, False)]
    above, below = evaluate(sides, states=at, bits=bits, **known)
    with np.errstate(invalid="ignore"):
        return bool(np.any(np.abs(above - below) > SAME * (np.abs(above) + np.abs(below))))


def middle_and_direction(
    field: Sequence[Expr], guard: int
) -> tuple[tuple[Expr, ...], tuple[Expr, ...]]:
    """Mean of the field on both sides of a guard, and half their difference.

    A force that stands between the two as a sign is taken out as one, so that the mean holds
    nothing of it.
    """
    middle, direction = [], []
    for entry in field:
        signed = _signed(entry, guard)
        slope = differentiate(signed, _SIGN)
        if ex.depends_on(slope, ("param",)) and any(n is _SIGN for n in ex.walk(slope)):
            above, below = (assuming(entry, guard, value) for value in (True, False))
            middle.append(ex.mul(ex.add(above, below), 0.5))
            direction.append(ex.mul(ex.sub(above, below), 0.5))
        else:
            middle.append(ex.substituted(signed, _SIGN, _ZERO))
            direction.append(slope)
    return tuple(middle), tuple(direction)


def _signed(root: Expr, guard: int) -> Expr:
    """The expression with (a + b)/2 + sign (a - b)/2 in place of what is a on one side of a guard
    and b on the other.
    """
    memo: dict[Expr, Expr] = {}
    for node in ex.walk(root):
        new = ex.rebuild(node, tuple(memo[child] for child in node.args), node.payload)
        if new.op == "select" and guard in bits_in([ex.select(new.payload, 1.0, 0.0)]):
            above, below = (assuming(new, guard, value) for value in (True, False))
            mean = ex.mul(ex.add(above, below), 0.5)
            new = ex.add(mean, ex.mul(_SIGN, ex.mul(ex.sub(above, below), 0.5)))
        memo[node] = new
    return memo[root]


# -- arithmetic that leaves nothing to be rounded where it needn't be ------------------------------
def _is(node: Expr, value: float) -> bool:
    return node.op == "const" and node.payload == value


def _dot(a: Sequence[Expr], b: Sequence[Expr]) -> Expr:
    total = _ZERO
    for one, other in zip(a, b, strict=True):
        total = ex.add(total, _product(one, other))
    return total


def _product(a: Expr, b: Expr) -> Expr:
    for one, other in ((a, b), (b, a)):
        if _is(one, -1.0):
            return ex.neg(other)
    return ex.mul(a, b)


def _quotient(a: Expr, b: Expr) -> Expr:
    return ex.neg(a) if _is(b, -1.0) else ex.div(a, b)


def _moved(vector: Sequence[Expr], along: Sequence[Expr], by: Expr) -> tuple[Expr, ...]:
    return tuple(ex.add(a, _product(b, by)) for a, b in zip(vector, along, strict=True))
