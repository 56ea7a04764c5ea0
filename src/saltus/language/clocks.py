"""Conditions and remainders that depend on time and parameters only. Their instants are solved for,
never searched.

A comparison of time only is a *switch*: it flips at *breaks*, which follow from the parameters by a
formula. No motion has to reach a boundary, so it is no guard, and nothing is recorded as a contact.
Steps end at breaks exactly.
"""

from __future__ import annotations

import math
import operator
import weakref
from dataclasses import dataclass
from typing import Any

from saltus.arguments import written
from saltus.errors import TraceError, shown
from saltus.language import expression as ex
from saltus.language.derivatives import differentiate
from saltus.language.expression import And, Condition, Expr, Not, Operand, Or, Relation
from saltus.language.functions import of_numbers

_SYMBOL = ex.parameter("\0wave")
_RELATIONS: weakref.WeakValueDictionary[Expr, Relation] = weakref.WeakValueDictionary()
#: Most cases that a comparison with pieces splits into.
_MOST_CASES = 64


@dataclass(frozen=True)
class Level:
    """``rate*t + offset > 0``: one break."""

    rate: Expr
    offset: Expr


@dataclass(frozen=True)
class Wave:
    """``factor*sin(rate*t + offset) + shift > 0`` (a cosine is a sine a quarter turn on): two
    breaks in each turn, or none.
    """

    rate: Expr
    offset: Expr
    factor: Expr
    shift: Expr


@dataclass(frozen=True)
class Pulse:
    """``factor*mod(rate*t + offset, cycle) + shift > 0``: two breaks in each cycle, or none."""

    rate: Expr
    offset: Expr
    cycle: Expr
    factor: Expr
    shift: Expr


def affine(node: Expr) -> tuple[Expr, Expr] | None:
    """(rate, offset) of parameters only if ``node`` is ``rate*t + offset``; else None."""
    if ex.depends_on(node, ("state", "select", "mod", "table")):
        return None
    rate = differentiate(node, ex.TIME)
    offset = _at_zero(node, ex.TIME)
    return None if offset is None or ex.depends_on(rate, ("time",)) else (rate, offset)


def _at_zero(node: Expr, leaf: Expr) -> Expr | None:
    """The value where a leaf is zero, None if there is none."""
    try:
        return ex.substituted(node, {leaf: ex.constant(0.0)})
    except TraceError:  # a pole
        return None


def switch_of(gap: Expr) -> Level | Wave | Pulse | None:
    """The switch that decides ``gap > 0``, with its breaks by a formula; None if there is none. The
    gap holds no conditions.
    """
    if line := affine(gap):
        return Level(*line)
    inner = {
        node
        for node in ex.walk(gap)
        if node.op in ("sin", "cos", "mod") and ex.depends_on(node, ("time",))
    }
    if len(inner) != 1:
        return None
    (wave,) = inner
    line, outer = affine(wave.args[0]), ex.substituted(gap, {wave: _SYMBOL})
    factor, shift = differentiate(outer, _SYMBOL), _at_zero(outer, _SYMBOL)
    if line is None or shift is None or ex.depends_on(shift, ("time", "state")):
        return None
    if ex.depends_on(factor, ("time", "state")) or _SYMBOL in set(ex.walk(factor)):
        return None
    if wave.op == "mod":
        return Pulse(*line, wave.args[1], factor, shift)
    return Wave(
        line[0], ex.add(line[1], math.pi / 2) if wave.op == "cos" else line[1], factor, shift
    )


def cycles_of(node: Expr) -> tuple[Expr, bool]:
    """The rate of a switch (its gap), a remainder or a table, and True if it counts cycles: a level
    and a table that ends don't repeat.
    """
    if node.op in ("mod", "table"):
        line = affine(node.args[0])
        assert line is not None, "a system holds remainders and tables of rate*t + offset only"
        if node.op == "mod":
            return ex.div(line[0], node.args[1]), True
        points, repeats = node.payload.points, node.payload.periodic
        return (ex.div(line[0], float(points[-1] - points[0])) if repeats else line[0]), repeats
    match switch_of(node):
        case Level(rate, _):
            return rate, False
        case Wave(rate, _, _, _):
            return ex.div(rate, 2 * math.pi), True
        case Pulse(rate, _, cycle, _, _):
            return ex.div(rate, cycle), True
    raise TypeError(node)


def switch(gap: Expr) -> Condition | bool:
    """The condition ``gap > 0`` of a gap that depends on time and parameters only. Pieces inside
    the gap become cases of the condition.

    Raises
    ------
    TraceError
        If its breaks can't be solved for.
    """
    return _cases(gap, gap, [_MOST_CASES])


def _cases(gap: Expr, original: Expr, left: list[int]) -> Condition | bool:
    """Join (this piece and its comparison) by or; ``left`` counts the comparisons that may still
    come.
    """
    piece = next((node for node in ex.walk(gap) if node.op == "select"), None)
    if piece is None:
        if gap.op == "const" and gap.payload:
            holds: bool = gap.payload > 0
            return holds
        left[0] -= 1
        if left[0] < 0 or switch_of(gap) is None:
            raise TraceError(_unsolvable(original))
        return _RELATIONS.setdefault(gap, Relation(gap))
    if_so, if_not = (
        _cases(ex.substituted(gap, {piece: value}), original, left) for value in piece.args
    )
    return _either(_both(piece.payload, if_so), _both(Not(piece.payload), if_not))


def _both(a: Condition, b: Condition | bool) -> Condition | bool:
    return (a if b else False) if isinstance(b, bool) else And(a, b)


def _either(a: Condition | bool, b: Condition | bool) -> Condition | bool:
    if isinstance(a, bool):
        return True if a else b
    if isinstance(b, bool):
        return True if b else a
    return Or(a, b)


def _unsolvable(gap: Expr) -> str:
    return (
        f"the comparison {gap!r} > 0 depends on time only, and its times can't be solved for in "
        f"advance. What can: a*t + b > 0, "
        f"a*sl.sin(w*t + b) + c > 0, a*sl.mod(t, T) + b > 0, joined by & | ~, with numbers or "
        f"parameters for the rest. "
        f"Anything else is data: sl.table(t, points, values)."
    )


def of_time_only(gap: Expr) -> bool:
    """True if a gap depends on time, and on no state. Pieces in it that time decides are time
    too.
    """
    return ex.depends_on(gap, ("time",)) and not ex.depends_on(gap, ("state",))


@ex.answers("__mod__")
@written("mod(t, T)")
def mod(a: Operand, cycle: Operand) -> Any:
    """The remainder of ``a`` by ``cycle``, in [0, cycle): time within the present cycle, for drives
    that repeat.

    Parameters
    ----------
    a : Expr or float
        Time, or ``rate*t + offset`` with a rate and an offset of numbers and parameters. It is back
        at zero at each whole multiple of the cycle; these times follow by a formula, and steps end
        there.
    cycle : Expr or float
        Its length: a number or a parameter, not zero.

    Returns
    -------
    Expr or float
        A float if both are plain numbers.

    Raises
    ------
    TraceError
        If ``a`` depends on a state: such a remainder has no end of boundaries.

    Examples
    --------
    >>> mod(7.5, 2.0)
    1.5
    """
    if not isinstance(a, Expr) and not isinstance(cycle, Expr):
        return of_numbers("mod", operator.mod, a, cycle)
    value, length = ex.as_expr(a), ex.as_expr(cycle)
    if ex.varies(length):
        raise TraceError(
            lambda say: (
                f"the cycle of {say.sl}mod must be a number or a parameter, not {shown(length)}."
            )
        )
    if length.op == "const" and length.payload == 0:
        raise TraceError(lambda say: f"the cycle of {say.sl}mod is zero.")
    with ex.observed(None):
        line = affine(value)
    if line is None or not ex.depends_on(value, ("time",)):
        raise TraceError(
            lambda say: (
                f"{say.sl}mod of {value!r}: a remainder is for rate*t + offset with numbers and "
                "parameters. Of a state it has no end of boundaries; write a law that repeats in "
                f"x with {say.sl}sin and {say.sl}cos."
            )
        )
    return Expr("mod", (value, length))
