"""Series of drives: coefficients of the powers of time, about many places at once."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping

import numpy as np

from saltus.language import expression as ex
from saltus.language.clocks import affine
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr

#: Largest exponent of a power whose series is known.
MOST_POWER = 8
#: Rates of waves are multiples of each other to so much [relative].
SAME_RATE = 1e-12


def series_of(
    node: Expr, about: np.ndarray, inside: np.ndarray, terms: int, values: Mapping[str, float]
) -> np.ndarray:
    """The series of a drive.

    Parameters
    ----------
    node : Expr
        A function of the time.
    about : float64[P]
        The places [s].
    inside : float64[P]
        Times that tell which piece of each condition, remainder and table is meant [s].
    terms : int
        Coefficients of each.
    values : mapping
        Parameters [SI].

    Returns
    -------
    float64[P, terms]
        Coefficients of powers of the time since each place.
    """
    return _all_series(node, about, inside, terms, values)[node]


def rate_at(node: Expr, place: float, terms: int, values: Mapping[str, float]) -> float | None:
    """Rate at which a drive repeats itself on the piece that holds a time [rad/s]; 0 if it is a
    polynomial there, None if it is neither.
    """
    at = np.array([place])
    series = _all_series(node, at, at, terms, values)
    kinds: dict[Expr, tuple[float, float] | None] = {}  # rate, degree
    for one in ex.walk(node, conditions=False):
        below = [kinds[arg] for arg in one.args]
        if one.op == "select":
            kinds[one] = below[0] if _holds(one, at, values)[0] else below[1]
        else:
            known = [kind for kind in below if kind is not None]
            whole = len(known) == len(below)
            kinds[one] = _kind_of(one, known, series) if whole else None
    kind = kinds[node]
    return None if kind is None or kind[1] >= terms else kind[0]


def _kind_of(
    node: Expr, below: list[tuple[float, float]], series: Mapping[Expr, np.ndarray]
) -> tuple[float, float] | None:
    """Rate and degree of one operation; None if it neither repeats itself nor is a polynomial."""
    rates, degrees = [rate for rate, _ in below if rate > 0], [degree for _, degree in below]
    rate, degree = (min(rates) if rates else 0.0), max(degrees, default=0.0)
    if any(abs(one / rate - round(one / rate)) > SAME_RATE * one / rate for one in rates):
        return None
    match node.op:
        case "time":
            return 0.0, 1.0
        case "mod":
            return None
        case "table":
            return 0.0, float(np.flatnonzero(series[node][0]).max(initial=0))
        case "mul":
            degree = sum(degrees)
        case "pow":
            degree *= power_of(node)
        case "sin" | "cos" if degree == 1 and not rates:
            return abs(float(series[node.args[0]][0, 1])), 0.0
        case "sin" | "cos" | "exp":
            degree = np.inf if degree > 0 else 0.0
        case "div":
            degree = degrees[0] if degrees[1] == 0 else np.inf
    return None if (rates and degree > 0) or degree == np.inf else (rate, degree)


def _all_series(
    node: Expr, about: np.ndarray, inside: np.ndarray, terms: int, values: Mapping[str, float]
) -> dict[Expr, np.ndarray]:
    """The series of each operation of a drive."""
    known: dict[Expr, np.ndarray] = {}
    for one in ex.walk(node, conditions=False):
        below = [known[arg] for arg in one.args]
        known[one] = _series(one, below, about, inside, terms, values)
    return known


def _series(
    node: Expr,
    below: list[np.ndarray],
    about: np.ndarray,
    inside: np.ndarray,
    terms: int,
    values: Mapping[str, float],
) -> np.ndarray:
    """The series of one operation."""
    if not ex.depends_on(node, ("time",)):
        found = np.zeros((len(about), terms))
        found[:, 0] = evaluate([node], values=values)[0]
        return found
    if node.op in ("time", "mod", "table"):
        return _clock_series(node, about, inside, terms, values)
    if node.op == "select":
        return np.array(np.where(_holds(node, inside, values)[:, None], *below))
    if node.op == "pow":
        return functools.reduce(_product, [below[0]] * power_of(node))
    return RULES[node.op](*below)


def _clock_series(
    node: Expr, about: np.ndarray, inside: np.ndarray, terms: int, values: Mapping[str, float]
) -> np.ndarray:
    """The series of the time, of a remainder, or of a table."""
    found = np.zeros((len(about), terms))
    match node.op:
        case "time":
            found[:, 0], found[:, 1] = about, 1.0
        case "mod":
            within, rate = _line_at(node, inside, values)
            length = float(evaluate([node.args[1]], values=values)[0])
            found[:, 0] = np.mod(within, length) - rate * (inside - about)
            found[:, 1] = rate
        case _:
            found[:, :4] = _table_series(node, about, inside, values)
    return found


def power_of(node: Expr) -> int:
    """The exponent of a power that is a small whole number; 0 of any other."""
    exponent = node.args[1]
    whole = exponent.op == "const" and exponent.payload in range(1, MOST_POWER + 1)
    return int(exponent.payload) if whole else 0


def _product(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The product of series."""
    found = np.zeros(one.shape)
    for k in range(one.shape[1]):
        found[:, k] = (one[:, : k + 1] * other[:, k::-1]).sum(axis=1)
    return found


def _quotient(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """The quotient of series."""
    found = np.zeros(one.shape)
    for k in range(one.shape[1]):
        rest = (found[:, :k] * other[:, k:0:-1]).sum(axis=1)
        found[:, k] = (one[:, k] - rest) / other[:, 0]
    return found


def _exponential(series: np.ndarray) -> np.ndarray:
    """The exponential of series: k e_k = sum of j a_j e_(k-j)."""
    found = np.zeros_like(series)
    found[:, 0] = np.exp(series[:, 0])
    slopes = series * np.arange(series.shape[1])
    for k in range(1, series.shape[1]):
        found[:, k] = (slopes[:, 1 : k + 1] * found[:, k - 1 :: -1][:, :k]).sum(axis=1) / k
    return found


#: How operations combine the series of their operands.
RULES: dict[str, Callable[..., np.ndarray]] = {
    "add": np.add,
    "sub": np.subtract,
    "neg": np.negative,
    "mul": _product,
    "div": _quotient,
    "exp": _exponential,
    "sin": lambda series: _exponential(1j * series).imag,
    "cos": lambda series: _exponential(1j * series).real,
}
#: Operations of the time whose series are known, but for powers.
SERIES = {"time", "mod", "table", "select", *RULES}


def _holds(node: Expr, inside: np.ndarray, values: Mapping[str, float]) -> np.ndarray:
    """True where the condition of pieces holds."""
    chosen = evaluate([ex.select(node.payload, 1.0, 0.0)], t=inside, values=values)[0]
    return np.broadcast_to(np.asarray(chosen) > 0.5, len(inside))


def _table_series(
    node: Expr, about: np.ndarray, inside: np.ndarray, values: Mapping[str, float]
) -> np.ndarray:
    """The cubics of a table: float64[P, 4]."""
    table, (at, rate) = node.payload, _line_at(node, inside, values)
    first, last = table.points[0], table.points[-1]
    turns = np.floor((at - first) / (last - first)) if table.periodic else 0.0
    piece = np.searchsorted(table.points, at - turns * (last - first), side="right") - int(
        table.periodic
    )
    pieces = table.pieces[np.clip(piece, 0, len(table.pieces) - 1)]
    start = _line_at(node, about, values)[0] - turns * (last - first) - pieces[:, 0]
    rounding = 1e-13 * (np.abs(pieces[:, 0]) + last - first)
    start = np.where(np.abs(start) <= rounding, 0.0, start)
    return np.array(shifted(pieces[:, 1:], start) * float(rate) ** np.arange(4))


def _line_at(node: Expr, time: np.ndarray, values: Mapping[str, float]) -> tuple[np.ndarray, float]:
    """The argument of a remainder or table, and its rate."""
    line = affine(node.args[0])
    assert line is not None
    rate, offset = (float(one) for one in evaluate(line, values=values))
    return rate * time + offset, rate


def shifted(terms: np.ndarray, by: np.ndarray | float) -> np.ndarray:
    """Coefficients of polynomials about another place."""
    found, count = np.array(terms), terms.shape[-1]
    for k in range(count - 1):
        for j in range(count - 2, k - 1, -1):
            found[..., j] += by * found[..., j + 1]
    return found
