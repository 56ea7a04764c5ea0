"""Pieces that hide one another: two stops whose boundaries have changed places, as with a negative
gap of a clearance.

`sl.piecewise` takes the first piece whose condition holds. Of ``(k*(x + gap), x < -gap), (k*(x -
gap), x > gap)`` at most one holds while ``gap >= 0``. Beyond that both do between the boundaries,
and the second spring would be missing there. A gap of one stop alone may have any sign: a preloaded
stop has a negative one.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from saltus.contact.guards import Guard, equation_of, is_hold
from saltus.language.canonical import Canonical
from saltus.language.evaluate import evaluate
from saltus.language.expression import (
    Bit,
    Condition,
    Expr,
    Not,
    add,
    constant,
    neg,
    state,
    substituted,
    walk,
)
from saltus.sentences import Text


def overlapping(
    field: tuple[Expr, ...],
    guards: tuple[Guard, ...],
    states: Sequence[str],
    values: Mapping[str, Any],
) -> Text | None:
    """The message about two overlapping pieces, one below a boundary and one above another; None if
    none overlap.

    Parameters
    ----------
    field, guards, states
        Of a system.
    values : mapping of str to float or array
        Values of all parameters [SI]; arrays of one length, one for each trajectory.
    """
    gaps = tuple((guard.gap, is_hold(guard)) for guard in guards)
    for first, second, width in _opposed(field, gaps, tuple(states)):
        (overlap,) = evaluate([width], values=values)
        if not np.any(overlap > 0):
            continue
        worst = int(np.argmax(np.ravel(overlap > 0)))
        names = sorted({node.payload for node in walk(width) if node.op == "param"})
        given = ", ".join(
            f"{name} = {np.ravel(values[name])[worst if np.size(values[name]) > 1 else 0]:g}"
            for name in names
        )
        entry = f" (trajectory {worst} of {np.size(overlap)})" if np.ndim(overlap) else ""
        places = " and ".join(equation_of(number, guards) for number in (first, second))
        return lambda say: (
            f"with {given}{entry} the contacts at {places} overlap, and the first "
            f"piece would hide the second. A "
            f"clearance can't be negative. Springs that touch on both sides at once are the sum of "
            f"two one-sided contacts: "
            f"{say.sl}freeplay(x, stiffness=k, lower_gap=gap) + {say.sl}freeplay(x, stiffness=k, "
            f"upper_gap=gap)."
        )
    return None


@functools.lru_cache(maxsize=256)
def _opposed(
    field: tuple[Expr, ...], gaps: tuple[tuple[Expr, bool], ...], states: tuple[str, ...]
) -> tuple[tuple[int, int, Expr], ...]:
    """Guards of a piece and of the next one, and their overlap: the sum of their gaps, where it
    depends on parameters only: states cancel in it. Hold guards are told from the others.
    """
    nowhere = {state(name): constant(0.0) for name in states}
    return tuple(
        (first, second, substituted(width, nowhere)) for first, second, width in _pairs(field, gaps)
    )


def _pairs(
    field: tuple[Expr, ...], gaps: tuple[tuple[Expr, bool], ...]
) -> Iterator[tuple[int, int, Expr]]:
    canonical, seen = Canonical(), set()
    for node in walk(*field, *(gap for gap, _ in gaps)):
        behind = node.args[1] if node.op == "select" else node
        if node.op != "select" or behind.op != "select":
            continue
        first, second = _side(node.payload), _side(behind.payload)
        if first is None or second is None or (first, second) in seen:
            continue
        (one, holds), (other, also) = gaps[first[0]], gaps[second[0]]
        if holds or also:
            continue
        seen.add((first, second))
        width = add(one if first[1] else neg(one), other if second[1] else neg(other))
        if canonical.kinds(canonical.polynomial(width)) == {"param"}:
            yield first[0], second[0], width


def _side(condition: Condition) -> tuple[int, bool] | None:
    """The guard of a condition on one side of it, and True for the positive side."""
    match condition:
        case Bit(guard):
            return guard, True
        case Not(Bit(guard)):
            return guard, False
    return None
