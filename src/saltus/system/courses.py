"""Drives that are polynomials of the time between breaks - records, square waves, saw-teeth,
pulses, ramps - or as good as that: swept sines, half sines, sines of sines.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from saltus.errors import ParameterError
from saltus.language import expression as ex
from saltus.language.clocks import Level, Pulse, Wave, affine, cycles_of, switch_of
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr
from saltus.system.course_series import SERIES, power_of, rate_at, series_of, shifted

#: Coefficients of a piece: of cubics, and of what isn't a polynomial.
TERMS, SMOOTH_TERMS = 4, 16
#: The last two terms of a piece that isn't a polynomial, in units of its largest, at most. What is
#: left out is 1/600 of them for a sine: less than rounding.
LAST_TERMS = 2.0**-45
#: Most pieces of one drive, of 136 bytes each: a sweep has some 8 a turn.
MOST_PIECES = 2**21
#: Pieces whose series are made at once.
AT_ONCE = 2**14
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
    terms : float64[P, terms]
        Coefficients of powers of the time since then [1, 1/s, ...]: TERMS or SMOOTH_TERMS.
    cycle : float
        Time after which it repeats [s]; 0: it doesn't. Instants are those of one cycle then.
    tail : int
        The first piece that repeats; those before hold once.
    earliest : float
        Time from which on it is known [s].
    """

    begins: np.ndarray
    terms: np.ndarray
    cycle: float
    tail: int = 0
    earliest: float = -np.inf

    def at(self, time: np.ndarray) -> np.ndarray:
        """The drive and its derivatives: float64[terms, ...]."""
        if self.cycle:
            tail = self.begins[self.tail]
            wrapped = tail + np.mod(time - tail, self.cycle)
            time = np.where((time >= tail) | (self.tail == 0), wrapped, time)
        piece = np.maximum(np.searchsorted(self.begins, time, side="right") - 1, 0)
        terms, since = np.moveaxis(self.terms[piece], -1, 0), time - self.begins[piece]
        found = []
        for _ in range(self.terms.shape[1]):
            value = 0.0 * since
            for one in terms[::-1]:
                value = value * since + one
            found.append(value)
            terms = terms[1:] * np.arange(1, len(terms)).reshape(-1, *[1] * since.ndim)
        return np.array(found)

    @property
    def speeds(self) -> np.ndarray:
        """Largest derivatives, in units of the largest value: float64[terms]. A value that jumps
        changes over the shortest piece.
        """
        begins, count = self.begins, self.terms.shape[1]
        begins = np.append(begins, begins[self.tail] + self.cycle) if self.cycle else begins
        lengths = np.diff(begins)
        powers = lengths[:, None] ** np.arange(count)
        ends = (self.terms[: len(lengths)] * powers).sum(axis=1)
        factorials = np.cumprod(np.maximum(np.arange(count), 1.0))
        derivatives = np.abs(self.terms * factorials).max(axis=0)
        largest = max(derivatives[0], np.abs(ends).max(initial=0.0))
        if largest == 0.0:
            return np.array(np.sign(derivatives))
        found = derivatives / largest
        next_values = np.append(self.terms[1:, 0], self.terms[self.tail, 0])[: len(ends)]
        jumps = np.abs(ends - next_values) > SAME_VALUE * largest
        inner = lengths if self.cycle else lengths[1:]
        if jumps.any() and len(inner):
            found[1] = max(found[1], 1 / inner.min())
        return np.array(found)


def terms_of(node: Expr) -> int:
    """Coefficients that the pieces of a drive need."""
    return TERMS if _degree(node) < TERMS else SMOOTH_TERMS


def reason_against(node: Expr, values: Mapping[str, float]) -> str | None:
    """The reason why a function of time isn't served; None if it is."""
    for one in ex.walk(node, conditions=False):
        known = one.op in SERIES or (one.op == "pow" and power_of(one) > 0)
        if not known and ex.depends_on(one, ("time",)):
            return f"a drive of it is a function of time with {one.op} in it"
    clocks = _clocks(node)
    cycles = {cycles_of(clock) for clock in clocks}
    repeats = any(again for _, again in cycles)
    if repeats and (len(cycles) > 1 or _is_bare(node)):
        return "a drive of it has clocks that don't repeat together"
    if repeats or _degree(node) < TERMS or _last_rate(node, values) is not None:
        return None
    return "a drive of it doesn't end in a polynomial of time or in what repeats"


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
            case "sin" | "cos" | "exp":
                degree[node] = np.inf if below[0] > 0 else 0
            case "pow":
                degree[node] = below[0] * power_of(node) if below[0] > 0 else 0
            case _:
                degree[node] = max(below, default=0)
    return degree[root]


def _last_rate(node: Expr, values: Mapping[str, float]) -> float | None:
    """What :func:`rate_at` says of the time behind all breaks."""
    breaks = _all_breaks(node, values)
    place = 2 * np.abs(breaks).max(initial=0.5) + 1.0
    with np.errstate(all="ignore"):
        return rate_at(node, float(place), SMOOTH_TERMS, values)


def _all_breaks(node: Expr, values: Mapping[str, float]) -> np.ndarray:
    """Breaks of all clocks, of one cycle if they repeat [s]."""
    breaks = np.concatenate([[], *(_breaks(clock, values) for clock in _clocks(node))])
    return np.array(breaks[np.isfinite(breaks)])


def course_of(node: Expr, values: Mapping[str, float], terms: int = TERMS) -> Course:
    """A drive as polynomials of so many terms, for parameter values. Raises ParameterError if they
    are too many, or the drive doesn't end in a polynomial or in what repeats.
    """
    clocks, smooth = _clocks(node), terms_of(node) > TERMS
    cycle = 0.0
    if clocks and cycles_of(clocks[0])[1]:
        rate = abs(float(evaluate([cycles_of(clocks[0])[0]], values=values)[0]))
        cycle = 1 / rate if rate > 0 else 0.0
    breaks = _all_breaks(node, values)
    if cycle:
        breaks = np.sort(np.mod(breaks, cycle))
        begins = breaks[np.diff(breaks, prepend=-np.inf) > SAME_BREAK * cycle]
        if len(begins) > 1 and begins[0] + cycle - begins[-1] <= SAME_BREAK * cycle:
            begins = begins[:-1]
        begins = begins if len(begins) else np.zeros(1)
        ends = np.append(begins[1:], begins[0] + cycle)
        if smooth:
            return Course(*_refined(node, begins, ends, terms, values), cycle)
        middles = begins + (ends - begins) / 2
        return Course(begins, series_of(node, begins, middles, terms, values), cycle)
    breaks = np.unique(breaks)
    if smooth:
        return _smooth_course(node, breaks, terms, values)
    if not len(breaks):
        zero = np.zeros(1)
        return Course(zero, series_of(node, zero, zero, terms, values), 0.0)
    begins = np.concatenate([breaks[:1], breaks])
    away = max(breaks[-1] - breaks[0], abs(breaks[0]), 1.0)
    middles = np.concatenate(
        [breaks[:1] - away, breaks + np.diff(breaks, append=breaks[-1] + 2 * away) / 2]
    )
    found = series_of(node, begins, middles, terms, values)
    begins[0] -= away  # polynomials don't mind from where they count
    found[0] = shifted(found[0], -away)
    return Course(begins, found, 0.0)


def _smooth_course(
    node: Expr, breaks: np.ndarray, terms: int, values: Mapping[str, float]
) -> Course:
    """A drive that isn't a polynomial everywhere, from time 0 on: between its breaks, and behind
    them for one turn.
    """
    rate = _last_rate(node, values)
    if rate is None:
        raise ParameterError(
            "a drive doesn't end in a polynomial of time, nor in what repeats, at these values: "
            "ask for method=sl.Taylor()."
        )
    ahead = breaks[breaks > 0]
    begins = np.append(0.0, ahead)
    begin, found = _refined(node, begins[:-1], begins[1:], terms, values)
    cycle, last = 2 * np.pi / rate if rate > 0 else 0.0, begins[-1:]
    if cycle:
        more = _refined(node, last, last + cycle, terms, values)
    else:
        more = last, series_of(node, last, last + 1.0, terms, values)
    begin, found = (np.concatenate([one, two]) for one, two in zip((begin, found), more))  # noqa: B905
    return Course(begin, found, cycle, len(begin) - len(more[0]), 0.0)


def _refined(
    node: Expr, lows: np.ndarray, highs: np.ndarray, terms: int, values: Mapping[str, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Pieces between some times, so short that their series end below rounding: begins [s] and
    coefficients.
    """
    begins, found = [np.zeros(0)], [np.zeros((0, terms))]
    while len(lows):
        left = []
        for k in range(0, len(lows), AT_ONCE):
            low, high = lows[k : k + AT_ONCE], highs[k : k + AT_ONCE]
            middle, half = (low + high) / 2, (high - low) / 2
            with np.errstate(all="ignore"):
                series = series_of(node, middle, middle, terms, values)
                sizes = np.abs(series) * half[:, None] ** np.arange(terms)
                good = sizes[:, -2:].max(axis=1) <= LAST_TERMS * sizes.max(axis=1)
            good |= half <= SAME_BREAK * np.abs(middle)
            begins.append(low[good])
            found.append(shifted(series[good], -half[good]))
            left.append(np.stack([low, middle, high])[:, ~good])
        low, middle, high = np.concatenate(left, axis=1)
        lows, highs = np.append(low, middle), np.append(middle, high)
        if sum(map(len, begins)) + len(lows) > MOST_PIECES:
            raise ParameterError(
                f"a drive turns too often for sl.Modal, which keeps {MOST_PIECES} pieces of it: "
                "ask for method=sl.Taylor(), or for a shorter sweep."
            )
    begin, coefficients = np.concatenate(begins), np.concatenate(found)
    order = np.argsort(begin, kind="stable")
    return begin[order], coefficients[order]


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
