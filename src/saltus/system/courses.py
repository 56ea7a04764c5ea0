"""Drives that are polynomials of the time between breaks: records, square waves, saw-teeth, pulses,
ramps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from saltus.language import expression as ex
from saltus.language.clocks import Level, Pulse, Wave, affine, cycles_of, switch_of
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr

#: Coefficients of a piece.
TERMS = 4
#: Breaks of one cycle closer than this part of it are one.
SAME_BREAK = 1e-14
#: Difference of two values at a break that is none, in units of the largest value.
SAME_VALUE = 1e-9


@dataclass(frozen=True)
class Course:
    """A drive for one set of parameter values.

    Attributes
    ----------
    begins : float64[P]
        Instants at which its pieces begin, ascending [s]; the first one holds before its begin
        too, but for a drive that repeats.
    terms : float64[P, TERMS]
        Coefficients of powers of the time since then [1, 1/s, ...].
    cycle : float
        Time after which it repeats [s]; 0: it doesn't. Instants are those of one cycle then.
    """

    begins: np.ndarray
    terms: np.ndarray
    cycle: float

    def at(self, time: np.ndarray) -> np.ndarray:
        """The drive and its derivatives: float64[TERMS, ...]."""
        if self.cycle:
            time = self.begins[0] + np.mod(time - self.begins[0], self.cycle)
        piece = np.maximum(np.searchsorted(self.begins, time, side="right") - 1, 0)
        terms, since = np.moveaxis(self.terms[piece], -1, 0), time - self.begins[piece]
        found = []
        for _ in range(TERMS):
            value = 0.0 * since
            for one in terms[::-1]:
                value = value * since + one
            found.append(value)
            terms = terms[1:] * np.arange(1, len(terms)).reshape(-1, *[1] * since.ndim)
        return np.array(found)

    @property
    def speeds(self) -> np.ndarray:
        """Largest derivatives, in units of the largest value: float64[TERMS]. A value that jumps
        changes over the shortest piece.
        """
        begins = np.append(self.begins, self.begins[0] + self.cycle) if self.cycle else self.begins
        lengths = np.diff(begins)
        powers = lengths[:, None] ** np.arange(TERMS)
        ends = (self.terms[: len(lengths)] * powers).sum(axis=1)
        derivatives = np.abs(self.terms * np.cumprod([1, 1, 2, 3])).max(axis=0)
        largest = max(derivatives[0], np.abs(ends).max(initial=0.0))
        if largest == 0.0:
            return np.array(np.sign(derivatives))
        found = derivatives / largest
        jumps = np.abs(ends - np.roll(self.terms[:, 0], -1)[: len(ends)]) > SAME_VALUE * largest
        inner = lengths if self.cycle else lengths[1:]
        if jumps.any() and len(inner):
            found[1] = max(found[1], 1 / inner.min())
        return np.array(found)


def reason_against(node: Expr) -> str | None:
    """The reason why a function of time isn't a polynomial between breaks; None if it is one."""
    for one in ex.walk(node, conditions=False):
        if one.op not in (
            "const", "param", "time", "add", "sub", "neg", "mul", "div", "mod", "table", "select",
        ) and ex.depends_on(one, ("time",)):  # fmt: skip
            return "a drive of it is neither harmonic nor a polynomial of time between breaks"
    clocks = _clocks(node)
    cycles = {cycles_of(clock) for clock in clocks}
    if any(repeats for _, repeats in cycles) and (len(cycles) > 1 or _is_bare(node)):
        return "a drive of it has clocks that don't repeat together"
    return None if _degree(node) < TERMS else "a drive of it is a polynomial of time beyond cubics"


def _is_bare(root: Expr) -> bool:
    """True if time enters by itself, beside clocks."""
    bare: dict[Expr, bool] = {}
    for node in ex.walk(root, conditions=False):
        below = node.op not in ("mod", "table") and any(bare[one] for one in node.args)
        bare[node] = node.op == "time" or below
    return bare[root]


def _clocks(node: Expr) -> list[Expr]:
    """Gaps of switches, remainders and tables in a function of time."""
    found: dict[Expr, None] = {}
    for one in ex.walk(node, conditions=False):
        if one.op == "select":
            found |= dict.fromkeys(relation.gap for relation in ex.relations_in(one.payload))
        elif one.op in ("mod", "table"):
            found[one] = None
    return list(found)


def _degree(root: Expr) -> float:
    """Degree in time, at most."""
    degree: dict[Expr, float] = {}
    for node in ex.walk(root, conditions=False):
        below = [degree[one] for one in node.args]
        match node.op:
            case "time" | "mod":
                degree[node] = 1
            case "table":
                degree[node] = node.payload.degree
            case "mul":
                degree[node] = sum(below)
            case "div":
                degree[node] = below[0] if below[1] == 0 else np.inf
            case _:
                degree[node] = max(below, default=0)
    return degree[root]


def course_of(node: Expr, values: Mapping[str, float]) -> Course:
    """A drive as polynomials, for parameter values."""
    clocks = _clocks(node)
    cycle = 0.0
    if clocks and cycles_of(clocks[0])[1]:
        rate = abs(float(evaluate([cycles_of(clocks[0])[0]], values=values)[0]))
        cycle = 1 / rate if rate > 0 else 0.0
    breaks = np.concatenate([[], *(_breaks(clock, values) for clock in clocks)])
    breaks = breaks[np.isfinite(breaks)]
    if cycle:
        breaks = np.sort(np.mod(breaks, cycle))
        begins = breaks[np.diff(breaks, prepend=-np.inf) > SAME_BREAK * cycle]
        if len(begins) > 1 and begins[0] + cycle - begins[-1] <= SAME_BREAK * cycle:
            begins = begins[:-1]
        begins = begins if len(begins) else np.zeros(1)
        middles = begins + np.diff(begins, append=begins[0] + cycle) / 2
        return Course(begins, _terms(node, begins, middles, values), cycle)
    breaks = np.unique(breaks)
    if not len(breaks):
        zero = np.zeros(1)
        return Course(zero, _terms(node, zero, zero, values), 0.0)
    begins = np.concatenate([breaks[:1], breaks])
    away = max(breaks[-1] - breaks[0], abs(breaks[0]), 1.0)
    middles = np.concatenate(
        [breaks[:1] - away, breaks + np.diff(breaks, append=breaks[-1] + 2 * away) / 2]
    )
    terms = _terms(node, begins, middles, values)
    begins[0] -= away  # polynomials don't mind from where they count
    terms[0] = _shifted(terms[0], -away)
    return Course(begins, terms, 0.0)


def _breaks(clock: Expr, values: Mapping[str, float]) -> np.ndarray:
    """Breaks of a clock; of one cycle if it repeats [s]."""

    def number(*parts: Expr) -> list[float]:
        return [float(one) for one in evaluate(parts, values=values)]

    with np.errstate(all="ignore"):
        if clock.op == "mod":
            line = affine(clock.args[0])
            assert line is not None
            rate, offset = number(*line)
            return np.array([-offset]) / rate
        if clock.op == "table":
            line = affine(clock.args[0])
            assert line is not None
            rate, offset = number(*line)
            return np.array((clock.payload.points - offset) / rate)
        match switch_of(clock):
            case Level(rate_, offset_):
                rate, offset = number(rate_, offset_)
                return np.array([-offset]) / rate
            case Wave(rate_, offset_, factor, shift):
                rate, offset, factor_, shift_ = number(rate_, offset_, factor, shift)
                angle = np.arcsin(-shift_ / np.array(factor_))
                return (np.array([angle, np.pi - angle]) - offset) / rate
            case Pulse(rate_, offset_, length, factor, shift):
                rate, offset, length_, factor_, shift_ = number(
                    rate_, offset_, length, factor, shift
                )
                level = -shift_ / np.array(factor_)
                inside = 0 < level / length_ < 1
                return (np.array([0.0, level if inside else 0.0]) - offset) / rate
    raise TypeError(clock)


def _terms(
    node: Expr, begins: np.ndarray, middles: np.ndarray, values: Mapping[str, float]
) -> np.ndarray:
    """Coefficients of all pieces about their begins: float64[P, TERMS]."""
    known: dict[Expr, np.ndarray] = {}
    for one in ex.walk(node, conditions=False):
        known[one] = _terms_of(one, [known[below] for below in one.args], begins, middles, values)
    return known[node]


def _terms_of(
    node: Expr,
    below: list[np.ndarray],
    begins: np.ndarray,
    middles: np.ndarray,
    values: Mapping[str, float],
) -> np.ndarray:
    """The same for one operation."""
    found = np.zeros((len(begins), TERMS))
    match node.op:
        case "add":
            found = below[0] + below[1]
        case "sub":
            found = below[0] - below[1]
        case "neg":
            found = -below[0]
        case "div":
            found = below[0] / below[1][:, :1]
        case "mul":
            for k in range(TERMS):
                found[:, k] = (below[0][:, : k + 1] * below[1][:, k::-1]).sum(axis=1)
        case "time":
            found[:, 0], found[:, 1] = begins, 1.0
        case "select":
            chosen = ex.select(node.payload, 1.0, 0.0)
            holds = evaluate([chosen], t=middles, values=values)[0]
            found = np.where(np.broadcast_to(holds, len(begins))[:, None] > 0.5, *below)
        case "mod":
            within, rate = _line_at(node, middles, values)
            length = float(evaluate([node.args[1]], values=values)[0])
            found[:, 0] = np.mod(within, length) - rate * (middles - begins)
            found[:, 1] = rate
        case "table":
            table, (at, rate) = node.payload, _line_at(node, middles, values)
            first, last = table.points[0], table.points[-1]
            turns = np.floor((at - first) / (last - first)) if table.periodic else 0.0
            piece = np.searchsorted(table.points, at - turns * (last - first), side="right") - int(
                table.periodic
            )
            pieces = table.pieces[np.clip(piece, 0, len(table.pieces) - 1)]
            start = _line_at(node, begins, values)[0] - turns * (last - first) - pieces[:, 0]
            rounding = 1e-13 * (np.abs(pieces[:, 0]) + last - first)
            start = np.where(np.abs(start) <= rounding, 0.0, start)
            found = _shifted(pieces[:, 1:], start) * float(rate) ** np.arange(TERMS)
        case _:
            found[:, 0] = evaluate([node], values=values)[0]
    return found


def _line_at(node: Expr, time: np.ndarray, values: Mapping[str, float]) -> tuple[np.ndarray, float]:
    """The argument of a remainder or table, and its rate."""
    line = affine(node.args[0])
    assert line is not None
    rate, offset = (float(one) for one in evaluate(line, values=values))
    return rate * time + offset, rate


def _shifted(terms: np.ndarray, by: np.ndarray | float) -> np.ndarray:
    """Coefficients of polynomials about another place."""
    found = np.array(terms)
    for k in range(TERMS - 1):
        for j in range(TERMS - 2, k - 1, -1):
            found[..., j] += by * found[..., j + 1]
    return found
