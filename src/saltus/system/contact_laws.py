"""The laws of contact of an equation, from what it returns and from its two-valued forces, as
guards that know what happens at them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from saltus.errors import TraceError, nearest, shown
from saltus.system import expression as ex
from saltus.system.derivatives import differentiate
from saltus.system.evaluate import evaluate
from saltus.system.expression import Expr, Not
from saltus.system.guards import Guard, Law, find_guards, relations
from saltus.system.holding import Contact, surfaces, with_holding
from saltus.system.laws import Impact, Jump
from saltus.system.singular import check_finite, check_gaps, lifted

#: Places at which a closing velocity is held against the rate of its gap, and by how much they may
#: differ.
PLACES, DIFFERENCE = 7, 1e-9


def with_laws(
    states: Sequence[str], rates: Sequence[Expr], laws: Sequence[Impact | Jump]
) -> tuple[tuple[Expr, ...], tuple[Guard, ...]]:
    """The field and the guards of an equation, with the laws of its contacts.

    Raises
    ------
    TraceError
        If a comparison can't be a boundary, or a law doesn't fit the equation.
    """
    limited = [one for one in relations(list(rates)) if one.limit is not None]
    parts = _parts(states, laws)
    asked = [ex.select(one, 1.0, 0.0) for one in (*limited, *(_relation(law) for law in laws))]
    limits = [one.limit for one in limited if one.limit is not None]
    roots, guards = find_guards([*rates, *limits, *asked, *(e for part in parts for e in part)])
    roots = lifted(roots, guards)
    found = iter(roots)
    field = tuple(next(found) for _ in rates)
    values = [next(found) for _ in limits]
    meant = [_bit(next(found)) for _ in asked]
    traced = [tuple(next(found) for _ in part) for part in parts]
    check_finite(field, guards, states)
    check_gaps(guards)
    by_guard = {number: value for (number, _), value in zip(meant, values, strict=False)}
    contacts = surfaces(states, field, guards, by_guard)
    own = list(guards)
    for law, (number, side), part in zip(laws, meant[len(limits) :], traced, strict=True):
        if own[number].law or any(contact.guard == number for contact in contacts):
            raise TraceError(
                f"the boundary {own[number].name!r} has two laws of contact. Keep one of them."
            )
        if isinstance(law, Jump):
            reset = dict(zip(law.values, part, strict=True))
            after = tuple(reset.get(name, ex.state(name)) for name in states)
            own[number] = replace(own[number], law=Law("jump", side=-side, reset=after))
        else:
            _check_velocity(states, field, own, number, side, part[0])
            contacts.append(_stop(states, number, side, part))
            own[number] = replace(own[number], law=Law("impact"))  # until all are known
    if not contacts:
        return field, tuple(own)
    contacts.sort(key=lambda contact: contact.guard)
    return with_holding(states, field, own, contacts)


def _relation(law: Impact | Jump) -> ex.Relation:
    return law.allowed if isinstance(law, Impact) else law.condition


def _parts(states: Sequence[str], laws: Sequence[Impact | Jump]) -> list[tuple[Expr, ...]]:
    """The expressions of each law: those that a jump assigns; of an impact the velocity, the
    restitution, and the impulse on each state.
    """
    parts: list[tuple[Expr, ...]] = []
    for law in laws:
        if isinstance(law, Jump):
            for name in law.values:
                if name not in states:
                    raise TraceError(
                        f"sl.jump names {shown(name)}, which is no state. {nearest(name, states)}"
                    )
            parts.append(tuple(law.values.values()))
        else:
            parts.append((law.velocity, law.restitution, *_impulse(states, law)))
    return parts


def _impulse(states: Sequence[str], law: Impact) -> tuple[Expr, ...]:
    """What a unit of the impulse adds to each state, up to a common factor."""
    row = [differentiate(law.velocity, ex.state(name)) for name in states]
    moved = [i for i, entry in enumerate(row) if not (entry.op == "const" and entry.payload == 0)]
    if not moved:
        raise TraceError("the velocity of an impact depends on no state: nothing can rebound.")
    masses: dict[str, Any] = {}
    if isinstance(law.inertia, Mapping):
        masses = dict(law.inertia)
    elif isinstance(law.inertia, Sequence):
        if len(law.inertia) != len(moved):
            raise TraceError(
                f"sl.impact got {len(law.inertia)} masses in inertia=, but its velocity is that of "
                f"{', '.join(states[i] for i in moved)}: one mass for each, in this order."
            )
        masses = {states[i]: mass for i, mass in zip(moved, law.inertia, strict=True)}
    elif law.inertia is None and len(moved) > 1:
        raise TraceError(
            f"the velocity of an impact depends on {', '.join(states[i] for i in moved)}: say how "
            f"the impulse is shared, by the mass of each, inertia=(m1, m2) or "
            f"inertia={{{states[moved[0]]!r}: m1, ...}}."
        )
    for name in masses:
        if name not in states:
            raise TraceError(
                f"inertia= names {shown(name)}, which is no state. {nearest(name, states)}"
            )
    return tuple(
        ex.constant(0.0)
        if (masses and name not in masses) or (not masses and i not in moved)
        else ex.div(row[i], ex.as_expr(masses.get(name, 1.0)))
        for i, name in enumerate(states)
    )


def _bit(mark: Expr) -> tuple[int, int]:
    """The guard that a comparison means, and the sign of its gap where the comparison holds."""
    if mark.op != "select":
        raise TraceError("a law of contact compares what depends on no state.")
    condition = mark.payload
    negative = isinstance(condition, Not)
    return (condition.inner if negative else condition).guard, -1 if negative else 1


def _stop(states: Sequence[str], number: int, side: int, part: tuple[Expr, ...]) -> Contact:
    """The contact of an impact."""
    w, restitution, *impulse = part
    symbols = [ex.state(name) for name in states]
    row = [differentiate(w, one) for one in symbols]
    pushed = [i for i, entry in enumerate(impulse) if not _is_zero(entry)]
    after = list(symbols)
    rebound = ex.neg(ex.mul(restitution, w))
    if len(pushed) == 1 and not ex.varies(row[pushed[0]]):
        (i,) = pushed  # w = row*state + rest, to the last bit
        rest = ex.substituted(w, symbols[i], ex.constant(0.0))
        after[i] = _over(ex.sub(rebound, rest), row[i])
    else:
        share = ex.constant(0.0)
        for weight, entry in zip(row, impulse, strict=True):
            share = ex.add(share, ex.mul(weight, entry))
        change = ex.div(ex.sub(rebound, w), share)
        after = [
            ex.add(one, ex.mul(entry, change)) for one, entry in zip(symbols, impulse, strict=True)
        ]
    made = Law("impact", side=side, reset=tuple(after), restitution=restitution, zeros=3)
    return Contact(number, w, made, tuple(ex.neg(entry) for entry in impulse))


def _is_zero(node: Expr) -> bool:
    return node.op == "const" and node.payload == 0


def _over(a: Expr, b: Expr) -> Expr:
    return ex.neg(a) if b.op == "const" and b.payload == -1.0 else ex.div(a, b)


def _check_velocity(
    states: Sequence[str],
    field: Sequence[Expr],
    guards: Sequence[Guard],
    number: int,
    side: int,
    velocity: Expr,
) -> None:
    """Raise a TraceError unless a closing velocity is minus the rate of the gap that is allowed."""
    gap = guards[number].gap
    rate = differentiate(gap, ex.TIME)
    for name, entry in zip(states, field, strict=True):
        rate = ex.add(rate, ex.mul(differentiate(gap, ex.state(name)), entry))
    random = np.random.default_rng(1)
    names = {node.payload for node in ex.walk(rate, velocity) if node.op == "param"}
    found, given = evaluate(
        [ex.mul(rate, -float(side)), velocity],
        t=random.uniform(0.5, 2.0, PLACES),
        states={name: random.uniform(-2.0, 2.0, PLACES) for name in states},
        values={name: random.uniform(0.5, 2.0) for name in names},
        bits=list(random.random((len(guards), PLACES)) < 0.5),
    )
    with np.errstate(all="ignore"):
        wrong = np.abs(found - given) > DIFFERENCE * (1.0 + np.abs(found) + np.abs(given))
    if np.any(wrong):
        raise TraceError(
            f"the velocity of the impact at {guards[number].name!r} isn't the closing velocity of "
            f"its gap. Write {ex.mul(rate, -float(side))!r}."
        )
