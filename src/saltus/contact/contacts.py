"""Convert the laws that an equation declares, and its two-valued forces, to laws of guards."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from saltus.contact.boundaries import find_guards, relations
from saltus.contact.declared import FACING, FRICTION, SLIP, Declared, Impact, Jump, weight
from saltus.contact.guards import Guard, Law, bits_in, equation_of, is_hold
from saltus.contact.reduction import (
    Elimination,
    Held,
    held_contact,
    hold_gap,
    unit_force,
    with_pivots,
)
from saltus.contact.singular import check_finite, check_gaps, lifted
from saltus.contact.surfaces import (
    OnSurface,
    averaged,
    has_clock,
    held_at,
    is_surface,
    level,
    split,
)
from saltus.errors import TraceError, nearest, shown
from saltus.language import expression as ex
from saltus.language.canonical import Canonical, proportion
from saltus.language.derivatives import gradient, time_derivative
from saltus.language.evaluate import evaluate
from saltus.language.expression import Bit, Expr, Friction, Not, Operand
from saltus.language.known_sides import all_assuming, assuming
from saltus.language.roots import with_root, zero_where_idle
from saltus.language.sums import dot, ratio

_ZERO, _ONE = ex.constant(0.0), ex.constant(1.0)
#: Samples at which a velocity is compared with the rate of its gap.
_PLACES = 16
#: Relative difference of the two that rounding explains.
_ROUNDING = 1e-9

Field = tuple[Expr, ...]


#: A pivot with friction below this share of the one without counts as zero: the force that holds
#: the contact grows without bound.
_NO_PIVOT = ex.constant(2.0**-40)


@dataclass(frozen=True, eq=False)
class _Met:
    """A declared law, with its comparison and parts written with bits."""

    law: Declared
    number: int
    positive: bool
    parts: dict[str, Expr]


@dataclass(frozen=True, eq=False)
class _Rubbing:
    """The friction of a contact at rest.

    Attributes
    ----------
    contact, guard : int
        Number of the contact's guard; of the guard whose gap is the velocity of sliding.
    coefficient : Expr
        Friction over the force that presses the contact.
    sign : Expr
        Of the velocity of sliding: 1 or -1, by its guard.
    direction : tuple of Expr
        Change of the field by a unit of force against a positive velocity.
    along : int
        Sign of the gap where that velocity is positive.
    """

    contact: int
    guard: int
    coefficient: Expr
    sign: Expr
    direction: Field
    along: int


def find_contacts(
    rates: Sequence[Expr],
    declared: Sequence[Declared],
    states: Sequence[str],
    units: Mapping[str, str],
) -> tuple[Field, tuple[Guard, ...]]:
    """Field and guards of traced rates and the laws that follow them. Hold guards come after all
    others. Units are those of states and parameters that have one.

    Raises
    ------
    TraceError
        If a guard can't be followed, or a law doesn't fit its contact.
    """
    frictions = {one: None for one in relations(tuple(rates)) if isinstance(one, Friction)}
    roots = list(rates)
    for law in declared:
        roots += law.roots()
    for friction in frictions:
        limit = _ONE if friction.limit is None else friction.limit
        roots += [ex.select(friction, 1.0, 0.0), limit, *friction.levels]
    found, guards = find_guards(roots, units)
    rest = iter(found[len(rates) :])
    met = [_met(law, next(rest), [next(rest) for _ in law.parts]) for law in declared]
    limits, levels = dict[int, Expr](), dict[int, Field]()
    for friction in frictions:
        comparison, limit = next(rest), next(rest)
        forces = tuple(next(rest) for _ in friction.levels)
        for number in bits_in([comparison]):
            levels[number] = (*levels.get(number, ()), *forces)
            if friction.limit is not None:
                _add_limit(limits, number, limit, guards)
    field = lifted(zero_where_idle(found[: len(rates)]), guards)
    check_finite(field, guards, states)
    check_gaps(guards)
    return with_laws(field, guards, states, met, limits, levels)


def _met(law: Declared, comparison: Expr, parts: Sequence[Expr]) -> _Met:
    """The declared law with the guard of its comparison, checked."""
    found = comparison.payload if comparison.op == "select" else None
    bit = found.inner if isinstance(found, Not) else found
    if not isinstance(bit, Bit):
        raise TraceError(
            f"{law!r}: the comparison is decided by the time alone, and no motion meets it. A "
            f"force or a law of the time is written into the rates."
        )
    for name, part in zip(law.parts, parts, strict=True):
        if has_clock(part):
            raise TraceError(
                f"{law!r}: {name} = {part!r} holds a clock (sl.mod, sl.table, or a comparison of "
                f"time), which a law of contact can't. Write it with functions such as sl.cos."
            )
    return _Met(law, bit.guard, bit is found, dict(zip(law.parts, parts, strict=True)))


def _add_limit(limits: dict[int, Expr], number: int, limit: Expr, guards: Sequence[Guard]) -> None:
    """Add the ratio of static to kinetic force, by the number of the guard."""
    if limits.setdefault(number, limit) is not limit:
        raise TraceError(
            f"two friction laws with different limits act where "
            f"{equation_of(number, guards)}. Write one, with the sum of their forces."
        )


def with_laws(
    field: Field,
    guards: tuple[Guard, ...],
    states: Sequence[str],
    met: Sequence[_Met] = (),
    limits: Mapping[int, Expr] | None = None,
    levels: Mapping[int, Field] | None = None,
) -> tuple[Field, tuple[Guard, ...]]:
    """The field, reduced where contacts are held, and the guards with their laws; hold guards come
    after the others. Without laws both are returned as they were.

    Raises
    ------
    TraceError
        If a law doesn't fit its contact.
    """
    limits, levels = limits or {}, levels or {}
    laws: dict[int, Law] = {}
    for declared in met:
        if declared.number in laws:
            place = equation_of(declared.number, guards)
            raise TraceError(f"two laws stand for the contact at {place}. Keep one.")
        laws[declared.number] = (
            _impact(declared, field, guards, states)
            if isinstance(declared.law, Impact)
            else _jump(declared, states)
        )
    rubbing = [contact for contact in (_rubbing(each, states) for each in met) if contact]
    _check_rubbing(rubbing, laws, field, guards)
    laws |= {
        number: Law("surface", constraint=guards[number].gap, levels=levels.get(number, ()))
        for number in range(len(guards))
        if number in {contact.guard for contact in rubbing}
        or (number not in laws and is_surface(number, field, guards, states))
    }
    if not laws:
        return field, guards
    held, field = _held_contacts(field, guards, states, laws, rubbing)
    forces = _Forces(field, held, rubbing)
    owners, holds = list(guards), []
    for number, law in laws.items():
        owners[number] = replace(guards[number], law=law)
    for contact in held:
        law = _completed(
            laws[contact.owner], contact, forces, limits.get(contact.owner, _ONE), states
        )
        owners[contact.owner] = replace(owners[contact.owner], law=law)
        assert law.drive is not None
        assert law.pivot is not None
        gap = hold_gap(law.kind, law.drive, law.pivot, law.limit)
        if law.remaining is not None:
            gap = ex.mul(gap, ex.sub(law.remaining, _NO_PIVOT))
        holds.append(
            Guard(hold_name(owners[contact.owner]), gap, law=Law("hold", partner=contact.owner))
        )
    return forces.elimination.reduced(), (*owners, *holds)


def hold_name(owner: Guard) -> str:
    """Name of the hold guard of a guard."""
    assert owner.law is not None
    return f"{owner.name} {'at rest' if owner.law.kind == 'impact' else 'held'}"


def renamed(guards: Sequence[Guard], names: Mapping[int, str]) -> tuple[Guard, ...]:
    """Rename some guards; hold guards follow the names of their owners."""
    new = [
        replace(guard, name=names.get(number, guard.name)) for number, guard in enumerate(guards)
    ]
    return tuple(
        replace(guard, name=hold_name(new[guard.law.partner]))
        if guard.law is not None and is_hold(guard) and guard.law.partner in names
        else guard
        for guard in new
    )


def _held_contacts(
    field: Field,
    guards: Sequence[Guard],
    states: Sequence[str],
    laws: Mapping[int, Law],
    rubbing: Sequence[_Rubbing],
) -> tuple[list[Held], Field]:
    """The contacts that can be held, and the field with the middle of each held surface."""
    of_contacts = {one.guard: one for one in rubbing}
    surfaces = sorted(number for number, law in laws.items() if law.kind == "surface")
    order = sorted(number for number, law in laws.items() if law.kind != "jump")
    holds = {number: len(guards) + index for index, number in enumerate(order)}
    directions = {number: law.direction for number, law in laws.items() if law.kind == "impact"}
    for one in rubbing:
        directions[one.guard] = _scaled(-one.along, one.direction)
        slides = _scaled(ex.neg(ex.mul(one.coefficient, one.sign)), one.direction)
        directions[one.contact] = tuple(
            ex.add(by, ex.select(Bit(holds[one.guard]), _ZERO, more)) if more is not _ZERO else by
            for by, more in zip(directions[one.contact], slides, strict=True)
        )
    strengths = dict.fromkeys(order, _ONE)
    alone = {number: _moved_alone(number, field) for number in surfaces}
    for number in surfaces:
        if number in of_contacts:
            continue
        on_surface = OnSurface(guards[number].gap, states)
        apart = {
            holds[other]
            for other, i in alone.items()
            if other < number and i is not None and i == alone[number]
        }
        free = tuple(_known(entry, apart, False) for entry in field)
        surface = split(number, free, on_surface)
        for other, direction in directions.items():
            if holds[other] not in apart:
                *means, strengths[other] = (
                    averaged(entry, number, holds[number], on_surface)
                    for entry in (*direction, strengths[other])
                )
                directions[other] = tuple(means)
        directions[number], strengths[number] = unit_force(surface.halves)
        new = held_at(free, surface, holds[number])
        field = tuple(
            ex.select(Bit(holds[number]), assuming(now, holds[number], True), before)
            if apart and i == alone[number]
            else now
            for i, (now, before) in enumerate(zip(new, field, strict=True))
        )
    held = []
    for number in order:
        constraint = laws[number].constraint
        assert constraint is not None
        own = directions[number], strengths[number]
        held.append(held_contact(number, holds[number], constraint, *own, states))
    return with_pivots(held), field


def _moved_alone(number: int, field: Field) -> int | None:
    """The state whose rate a surface decides, if it is just one. Of several surfaces that decide
    only the same rate, one can be held at a time, so no term for two of them is written.
    """
    moved = [i for i, entry in enumerate(field) if number in bits_in([entry])]
    return moved[0] if len(moved) == 1 else None


def _known(entry: Expr, bits: Iterable[int], value: bool) -> Expr:
    """The expression with some bits known."""
    for bit in bits:
        entry = assuming(entry, bit, value)
    return entry


def _scaled(factor: Operand, direction: Sequence[Expr]) -> Field:
    return tuple(one if one is _ZERO else ex.mul(factor, one) for one in direction)


class _Forces:
    """The force that holds each contact, with all other held contacts eliminated.

    Parameters
    ----------
    field : tuple of Expr
        As :class:`Elimination` takes it.
    held : sequence of Held
        The contacts that can be held.
    rubbing : sequence of _Rubbing
        The friction of some.
    """

    def __init__(
        self,
        field: Field,
        held: Sequence[Held],
        rubbing: Sequence[_Rubbing],
    ) -> None:
        self.elimination = Elimination(field, held)
        self._held = {one.owner: one for one in held}
        self._by_contact = {one.contact: one for one in rubbing}
        self._by_guard = {one.guard: one for one in rubbing}
        smooth = [self._without_friction(one) for one in held]
        self._smooth = Elimination(field, smooth) if rubbing else self.elimination
        self._smoothly = dict(zip(self._held, smooth, strict=True))

    def _without_friction(self, held: Held) -> Held:
        rubbing = self._by_contact.get(held.owner)
        if rubbing is None:
            return held
        sticks = self._held[rubbing.guard].hold
        return replace(held, direction=all_assuming(held.direction, [sticks], True))

    def without_friction(self, held: Held) -> Expr:
        """The pivot of a contact without its friction."""
        _, pivot, _ = self._smooth.own(self._smoothly[held.owner])
        return pivot

    def own(self, held: Held) -> tuple[Expr, Expr, Field, int]:
        """Drive, pivot and direction of a contact as :class:`Law` has them, and the force that
        supports it. The force of friction is in units of its limit.
        """
        drive, pivot, direction = self.elimination.own(held)
        if held.owner not in self._by_guard:
            return drive, pivot, direction, -1
        rubbing = self._by_guard[held.owner]
        contact = self._held[rubbing.contact]
        pressed, by, _ = self.elimination.own(contact)
        force = ex.neg(ex.div(assuming(pressed, held.hold, True), assuming(by, held.hold, True)))
        limit = ex.mul(rubbing.coefficient, assuming(force, contact.hold, True))
        most = ex.select(Bit(contact.hold), ex.mul(limit, pivot), _ZERO)
        return drive, most, direction, contact.hold


def _completed(law: Law, held: Held, forces: _Forces, limit: Expr, states: Sequence[str]) -> Law:
    """The law of a contact, completed with the expressions that holding it needs."""
    drive, pivot, direction, support = forces.own(held)
    surface = law.kind == "surface"
    rough = law.friction is not None
    return replace(
        law,
        partner=held.hold,
        settled=_settled(held, states) if surface else law.settled,
        direction=direction,
        normal=held.normal,
        drive=drive,
        pivot=pivot,
        limit=limit if surface else None,
        remaining=ex.div(pivot, forces.without_friction(held)) if rough else None,
        zeros=(2 if limit is _ONE else 1) if surface else 3,
        support=support,
    )


def _settled(held: Held, states: Sequence[str]) -> Field:
    """The state moved onto a surface: its pivot from the constraint, or else a step along the
    normal.
    """
    settled = [ex.state(name) for name in states]
    if held.pivot is not None:
        i = held.pivot
        settled[i] = level(held.constraint, states[i], held.normal[i])
        return tuple(settled)
    share = ex.div(held.constraint, dot(held.normal, held.normal))
    return tuple(
        ex.sub(state, ex.mul(slope, share)) if slope is not _ZERO else state
        for state, slope in zip(settled, held.normal, strict=True)
    )


# -- impacts ---------------------------------------------------------------------------------------
def _shares(
    met: _Met, velocity: Expr, moved: Sequence[str], states: Sequence[str], said: tuple[str, str]
) -> list[Expr]:
    """Change of each state by a unit impulse along a velocity: the slope over the mass, zero for
    states that it doesn't move. Raises TraceError where the velocity isn't linear in them.
    """
    normal = gradient(velocity, states)
    for name in moved:
        slope = set(ex.walk(normal[states.index(name)]))
        if any(ex.state(other) in slope for other in moved):
            raise TraceError(
                f"{met.law!r}: {said[0]} isn't linear in {name}. The {said[1]} is a sum of "
                f"velocities times functions of positions and time."
            )
    return [
        ex.div(slope, met.parts[weight(name)]) if name in moved else _ZERO
        for name, slope in zip(states, normal, strict=True)
    ]


def _impact(met: _Met, field: Field, guards: Sequence[Guard], states: Sequence[str]) -> Law:
    """Newton's law of impact."""
    assert isinstance(met.law, Impact)
    w, restitution = met.parts["velocity"], met.parts["restitution"]
    guard = guards[met.number]
    _check_velocity(met, guard, field, states)
    said = f"the velocity {w!r}", "closing velocity"
    impulse = _shares(met, w, met.law.moved, states, said)
    side = 1 if met.positive else -1
    return Law(
        "impact",
        side=side,
        reset=_struck(w, impulse, restitution, met.law.moved, states),
        settled=_struck(w, impulse, _ZERO, met.law.moved, states),
        constraint=w,
        direction=tuple(ex.neg(one) for one in impulse),
        restitution=restitution,
        friction=met.parts.get(FRICTION),
        mass=ratio(_ONE, dot(gradient(w, states), impulse)),
    )


def _struck(
    w: Expr, impulse: Sequence[Expr], restitution: Expr, moved: Sequence[str], states: Sequence[str]
) -> Field:
    """The state after an impact: an impulse changes w to -restitution*w."""
    after = [ex.state(name) for name in states]
    normal = gradient(w, states)
    if len(moved) == 1:
        i = states.index(moved[0])
        wall = level(w, moved[0], normal[i])
        if wall is _ZERO:
            after[i] = ex.mul(ex.neg(restitution), after[i])
            return tuple(after)
        after[i] = ex.sub(wall, ex.mul(restitution, ex.sub(after[i], wall)))
        return tuple(after)
    share = ex.div(ex.mul(ex.add(1.0, restitution), w), dot(normal, impulse))
    for name in moved:
        i = states.index(name)
        after[i] = ex.sub(after[i], ex.mul(impulse[i], share))
    return tuple(after)


def _check_velocity(met: _Met, guard: Guard, field: Field, states: Sequence[str]) -> None:
    """Raise a TraceError unless the closing velocity is minus the rate of the gap, times a positive
    number.
    """
    w = met.parts["velocity"]
    if has_clock(guard.gap):
        raise TraceError(
            f"{met.law!r}: the place of the stop holds a clock (sl.mod, sl.table, or a comparison "
            f"of time), so it may jump. Write a stop that moves with functions such as sl.cos."
        )
    gap = with_root(guard.gap)
    rate = ex.add(dot(gradient(gap, states), field), time_derivative(gap))
    closing = ex.neg(rate) if met.positive else rate
    canonical = Canonical()
    sign = proportion(canonical.polynomial(w), canonical.polynomial(closing))
    if sign > 0 or (sign == 0 and _equal(w, closing)):
        return
    raise TraceError(
        f"{met.law!r}: the velocity at which this contact closes is {closing!r}, but {w!r} was "
        f"given. Give minus the rate of what is positive on the allowed side."
    )


def _equal(a: Expr, b: Expr) -> bool:
    """True if two expressions have equal values at samples."""
    random = np.random.default_rng(11)
    leaves = {(node.op, node.payload) for node in ex.walk(a, b) if node.op in ("state", "param")}
    states, values = (
        {
            name: random.uniform(low, 1.5, _PLACES)
            for op, name in sorted(leaves, key=str)
            if op == kind
        }
        for kind, low in (("state", -1.5), ("param", 0.5))
    )
    bits = [random.random(_PLACES) < 0.5 for _ in range(1 + max(bits_in([a, b]), default=-1))]
    t = random.uniform(0.0, 1.5, _PLACES)
    first, second = evaluate([a, b], t=t, states=states, values=values, bits=bits)
    size = np.maximum(np.abs(first), np.abs(second))
    known = np.isfinite(size)
    with np.errstate(invalid="ignore"):
        apart = np.abs(first - second) > _ROUNDING * size
    return bool(np.any(known) and not np.any(apart & known))


# -- friction of contacts --------------------------------------------------------------------------
def _rubbing(met: _Met, states: Sequence[str]) -> _Rubbing | None:
    """The friction of a declared impact, if it has any."""
    if not (isinstance(met.law, Impact) and met.law.rubs):
        return None
    slip, sign = met.parts[SLIP], met.parts[FACING]
    found = sign.payload if sign.op == "select" else None
    bit = found.inner if isinstance(found, Not) else found
    if not isinstance(bit, Bit):
        raise TraceError(
            f"{met.law!r}: slip_velocity = {slip!r} is decided by the time alone. Give the "
            f"velocity at which the contact slides."
        )
    said = f"slip_velocity = {slip!r}", "velocity of sliding"
    direction = tuple(_shares(met, slip, met.law.rubbed, states, said))
    along = 1 if bit is found else -1
    return _Rubbing(met.number, bit.guard, met.parts[FRICTION], sign, direction, along)


def _check_rubbing(
    rubbing: Sequence[_Rubbing], laws: Mapping[int, Law], field: Field, guards: Sequence[Guard]
) -> None:
    """Raise a TraceError if another guard acts at the velocity at which a contact's sliding
    reverses.
    """
    owned = set(laws) | bits_in(field)
    for contact in rubbing:
        if contact.guard in owned:
            raise TraceError(
                f"the friction of a contact changes its direction where "
                f"{equation_of(contact.guard, guards)}, and another force or law does too. Leave "
                f"friction= and slip_velocity= out, or the other."
            )
        owned.add(contact.guard)


# -- jumps -----------------------------------------------------------------------------------------
def _jump(met: _Met, states: Sequence[str]) -> Law:
    """A jump of the state, from the side on which the comparison doesn't hold."""
    assert isinstance(met.law, Jump)
    for name in met.parts:
        if name not in states:
            raise TraceError(
                f"{met.law!r} sets {shown(name)}, which is no state. {nearest(name, states)}"
            )
    return Law(
        "jump",
        side=-1 if met.positive else 1,
        reset=tuple(met.parts.get(name, ex.state(name)) for name in states),
    )
