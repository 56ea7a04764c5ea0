"""Contacts that are held: hold guards, and the field reduced by the elimination of contact forces.

A contact j that can be held has a constraint w_j (closing velocity, or a surface's function) and a
direction D_j: what a unit of its own force adds to the field. While it is held that force keeps
w_j at zero::

    F <- F - D_j * (n_j . F + dw_j/dt) / (n_j . D_j)          n_j = gradient of w_j

One contact after the other is eliminated, so several contacts that are coupled solve their linear
system by pivots. See docs/decisions/0040.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from saltus.contact.guards import Guard, bits_in, is_hold
from saltus.language import expression as ex
from saltus.language.canonical import Canonical
from saltus.language.derivatives import gradient, time_derivative
from saltus.language.expression import Bit, Expr
from saltus.language.known_sides import all_assuming, assuming
from saltus.language.sums import dot, ratio, total

_ZERO, _ONE = ex.constant(0.0), ex.constant(1.0)
#: Most contacts in one rate for which its terms are written twice, held and free: each more contact
#: doubles them.
_MOST_KNOWN = 4


@dataclass(frozen=True, eq=False)
class Held:
    """A contact that can be held.

    Attributes
    ----------
    owner, hold : int
        Numbers of its guard and of its hold guard.
    constraint : Expr
        w, zero while it is held.
    normal : tuple of Expr
        Gradient of w with respect to the states.
    drift : Expr
        Partial derivative of w with respect to t.
    direction : tuple of Expr
        Change of the field by a unit of its force.
    strength : Expr
        Of a surface: the two-valued force, in that unit.
    pivot : int or None
        The state whose rate follows from the constraint, exactly.
    """

    owner: int
    hold: int
    constraint: Expr
    normal: tuple[Expr, ...]
    drift: Expr
    direction: tuple[Expr, ...]
    strength: Expr = _ONE
    pivot: int | None = None


def held_contact(
    owner: int,
    hold: int,
    constraint: Expr,
    direction: Sequence[Expr],
    strength: Expr,
    states: Sequence[str],
) -> Held:
    """A contact that can be held; its pivot is chosen later."""
    return Held(
        owner,
        hold,
        constraint,
        gradient(constraint, states),
        time_derivative(constraint),
        tuple(direction),
        strength,
    )


def unit_force(direction: Sequence[Expr]) -> tuple[tuple[Expr, ...], Expr]:
    """A direction as another one of parameters alone, and the strength by which that is multiplied:
    a friction may vanish, and what it would hold is still known. As it is, with strength 1, where
    there is none.
    """
    canonical = Canonical()
    strength = next((one for one in direction if one is not _ZERO), _ONE)
    if not ex.varies(strength):
        return tuple(direction), _ONE
    units = [one if one is _ZERO else canonical.share(one, strength) for one in direction]
    known = tuple(unit for unit in units if unit is not None)
    return (known, strength) if len(known) == len(units) else (tuple(direction), _ONE)


def with_pivots(contacts: Sequence[Held]) -> list[Held]:
    """The contacts with their pivots. A pivot is a state in which the constraint is linear, which
    the contact's force changes, and which is no other contact's pivot. If the force changes just
    one state, that is the pivot: of several contacts that change only the same state, one can be
    held at a time.
    """
    chosen: dict[int, int] = {}
    candidates = {number: _linear_states(one) for number, one in enumerate(contacts)}
    for number, states in candidates.items():
        moved = [i for i, by in enumerate(contacts[number].direction) if by is not _ZERO]
        if len(moved) == 1 and moved[0] in states:
            chosen[number] = moved[0]
    waiting = [number for number in candidates if number not in chosen]
    for number in sorted(waiting, key=lambda number: len(candidates[number])):
        free = [i for i in candidates[number] if i not in chosen.values()]
        if free or candidates[number]:
            chosen[number] = (free or candidates[number])[0]
    return [replace(one, pivot=chosen.get(number)) for number, one in enumerate(contacts)]


def _linear_states(contact: Held) -> list[int]:
    """The states in which a constraint is linear, those that its force changes first."""
    linear = [
        i for i, slope in enumerate(contact.normal) if slope is not _ZERO and not ex.varies(slope)
    ]
    return sorted(
        linear, key=lambda i: (contact.direction[i] is _ZERO, contact.normal[i].op != "const")
    )


class Elimination:
    """A field with the forces of held contacts eliminated.

    Parameters
    ----------
    field : sequence of Expr
        The field without contact forces; the two-valued signs of held surfaces are at their middle.
    contacts : sequence of Held
        In the order of elimination, with their pivots.
    """

    def __init__(self, field: Sequence[Expr], contacts: Sequence[Held]) -> None:
        self._field, self._contacts = tuple(field), tuple(contacts)
        self._canonical = Canonical()
        holds = {one.hold for one in contacts}
        self._known = all(len(holds & bits_in([entry])) <= _MOST_KNOWN for entry in field)

    def reduced(self) -> tuple[Expr, ...]:
        """The field, reduced where hold guards say so."""
        field, _ = self._without(None)
        for one in self._in_order():
            field = self._put(one, field, one.drift, field)
        return field

    def own(self, contact: Held) -> tuple[Expr, Expr, tuple[Expr, ...]]:
        """(N, P, D) of a contact, with all other held contacts eliminated: the rate of its
        constraint without its own force, the change of that rate by its force, and the change of
        the field by a unit of force.
        """
        field, directions = self._without(contact)
        field = all_assuming(field, [contact.hold], True)
        direction = all_assuming(directions[contact.hold], [contact.hold], True)
        drive = ex.add(dot(contact.normal, field), contact.drift)
        strength = assuming(contact.strength, contact.hold, True)
        return drive, ex.mul(strength, dot(contact.normal, direction)), direction

    def _without(
        self, left_out: Held | None
    ) -> tuple[tuple[Expr, ...], dict[int, tuple[Expr, ...]]]:
        """Field and directions after the elimination of all contacts but one."""
        field = self._field
        directions = {contact.hold: contact.direction for contact in self._contacts}
        for number, contact in enumerate(self._contacts):
            if contact is left_out:
                continue
            across = dot(contact.normal, directions[contact.hold])
            if _is_nothing(across):
                continue  # its force changes nothing once those before are held: it can't be
            later = [other for other in self._contacts[number + 1 :] if other is not left_out]
            later += [left_out] if left_out else []
            direction = directions[contact.hold]
            rate = ex.add(dot(contact.normal, field), contact.drift)
            field = self._take(contact, field, direction, ratio(rate, across), contact.drift)
            for other in later:
                along = dot(contact.normal, directions[other.hold])
                while_free = dot(contact.normal, other.direction)  # short, and mostly enough
                if any(map(self._canonical.polynomial, (while_free, along))):
                    directions[other.hold] = self._take(
                        contact, directions[other.hold], direction, ratio(along, across), _ZERO
                    )
        return field, directions

    def _take(
        self,
        contact: Held,
        entries: tuple[Expr, ...],
        direction: Sequence[Expr],
        share: Expr,
        drift: Expr,
    ) -> tuple[Expr, ...]:
        """Entries minus a share of a contact's direction, where the contact is held."""
        new = tuple(
            self._held(contact, ex.sub(entry, ex.mul(by, share)), entry)
            if by is not _ZERO and i != contact.pivot
            else entry
            for i, (entry, by) in enumerate(zip(entries, direction, strict=True))
        )
        return self._put(contact, new, drift, entries) if contact.pivot is not None else new

    def _put(
        self, contact: Held, entries: tuple[Expr, ...], drift: Expr, free: tuple[Expr, ...]
    ) -> tuple[Expr, ...]:
        """Entries with the pivot's one taken from the constraint, exactly, where the contact is
        held.
        """
        if contact.pivot is None:
            return entries
        i = contact.pivot
        others = [
            ex.mul(slope, entry)
            for k, (slope, entry) in enumerate(zip(contact.normal, entries, strict=True))
            if k != i and slope is not _ZERO and entry is not _ZERO
        ]
        exact = ratio(ex.neg(total([drift, *others])), contact.normal[i])
        return (*entries[:i], self._held(contact, exact, free[i]), *entries[i + 1 :])

    def _held(self, contact: Held, value: Expr, otherwise: Expr) -> Expr:
        """``value`` where the contact is held, else ``otherwise``."""
        if self._known:
            value, otherwise = (
                assuming(root, contact.hold, side)
                for root, side in ((value, True), (otherwise, False))
            )
        return ex.select(Bit(contact.hold), value, otherwise)

    def _in_order(self) -> list[Held]:
        """The contacts with pivots, each after those whose pivots its own rate follows from;
        contacts in a circle keep their order.
        """
        waiting = [one for one in self._contacts if one.pivot is not None]
        order: list[Held] = []
        while waiting:
            ready = [
                one
                for one in waiting
                if not any(
                    other.pivot != one.pivot and one.normal[other.pivot or 0] is not _ZERO
                    for other in waiting
                    if other is not one
                )
            ]
            if not ready:
                break
            order += ready
            waiting = [one for one in waiting if one not in ready]
        return order


def _is_nothing(node: Expr) -> bool:
    return node.op == "const" and node.payload == 0


def hold_gap(kind: str, drive: Expr, pivot: Expr, limit: Expr | None) -> Expr:
    """Margin of a held contact to its release: positive while it stays held."""
    if kind == "impact":
        return drive
    most = pivot if limit is None or limit is _ONE else ex.mul(limit, pivot)
    return ex.sub(ex.mul(most, most), ex.mul(drive, drive))


def free_field(field: Sequence[Expr], guards: Sequence[Guard]) -> tuple[Expr, ...]:
    """The field as it was written, with no contact held."""
    holds = [number for number, guard in enumerate(guards) if is_hold(guard)]
    return all_assuming(field, holds, False)
