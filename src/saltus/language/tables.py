"""Tables: measured points as part of an equation - a recorded drive in time, a measured stiffness
curve in a state.

A table is piecewise polynomials. In time its pieces change at instants that follow by a formula,
and the numbers are data to the compiled kernel: a hundred thousand points compile as quickly as
three. In a state every knot is a boundary of the motion.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from saltus.arguments import has_mask, written
from saltus.errors import TraceError, among, nearest, shown
from saltus.language import expression as ex
from saltus.language.clocks import affine
from saltus.language.expression import Expr, Operand
from saltus.language.functions import piecewise
from saltus.units import check_declared

KINDS = ("linear", "pchip", "spline")
OUTSIDE = ("hold", "extend", "periodic")
#: Most knots of a table in a state: each adds a boundary and code.
MOST_KNOTS = 32


class Table:
    """Piecewise polynomials of degree 3 at most. Two tables with the same numbers are equal.

    Attributes
    ----------
    name : str
        Name in printed equations.
    points : float64[n]
        Knots, ascending.
    pieces : float64[m, 5]
        Reference point r and coefficients c of each piece, sum(c_k (x - r)**k). Periodic: between
        knots, m = n - 1. Else also before the first and after the last, m = n + 1.
    periodic : bool
        Whether it repeats after points[-1] - points[0].
    unit : str
        Coherent SI unit of its values, ``""`` if it isn't known.
    """

    def __init__(
        self,
        points: np.ndarray,
        pieces: np.ndarray,
        periodic: bool,
        name: str = "table",
        unit: str = "",
    ):
        self.points, self.pieces, self.periodic, self.name = points, pieces, bool(periodic), name
        self.unit = unit
        words = f"{name} {unit}" if unit else name
        digest = hashlib.sha256(
            self.points.tobytes() + self.pieces.tobytes() + bytes([self.periodic]) + words.encode()
        )
        self.fingerprint = digest.hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Table) and self.fingerprint == other.fingerprint

    def __hash__(self) -> int:
        return hash(self.fingerprint)

    def __repr__(self) -> str:
        return f"<table {self.name!r} of {len(self.points)} points>"

    @functools.cached_property
    def degree(self) -> int:
        """Highest power that any piece has."""
        return max((k for k in range(4) if self.pieces[:, 1 + k].any()), default=0)

    def __call__(self, x: Any) -> Any:
        """Values at x, an array of any shape."""
        try:
            x = np.asarray(x, dtype=np.float64)
        except (TypeError, ValueError):
            raise TraceError(
                lambda say: (
                    f"{say.sl}table: it is looked up at {shown(x)}, which is no number. Write "
                    f"{say.sl}table(x, points, values)."
                )
            ) from None
        first, last = self.points[0], self.points[-1]
        if self.periodic:
            x = first + np.mod(x - first, last - first)
            piece = np.clip(
                np.searchsorted(self.points, x, side="right") - 1, 0, len(self.pieces) - 1
            )
        else:
            piece = np.searchsorted(self.points, x, side="right")
        r, c0, c1, c2, c3 = np.moveaxis(self.pieces[piece], -1, 0)
        s = x - r
        return (c0 + s * (c1 + s * (c2 + s * c3)))[()]

    @functools.cache  # noqa: B019  (a table lives as long as its equation)
    def derivative(self) -> Table:
        """The table of its derivative."""
        pieces = np.column_stack(
            [self.pieces[:, 0], self.pieces[:, 2:] * [1.0, 2.0, 3.0], np.zeros(len(self.pieces))]
        )
        return Table(self.points, pieces, self.periodic, f"{self.name}_rate")

    def to_data(self) -> dict[str, Any]:
        """The table as JSON-able data, to the last bit."""
        return {
            "name": self.name,
            "periodic": self.periodic,
            "points": self.points.tolist(),
            "pieces": self.pieces.tolist(),
            **({"unit": self.unit} if self.unit else {}),
        }

    @classmethod
    def from_data(cls, data: Mapping[str, Any]) -> Table:
        """A table from :meth:`to_data`. Raises ValueError if the numbers don't fit together."""
        points, pieces = (np.array(data[key], dtype=np.float64) for key in ("points", "pieces"))
        periodic, name = data["periodic"], data["name"]
        count = len(points) - 1 if periodic is True else len(points) + 1
        fits = (
            points.ndim == 1
            and len(points) > 1
            and pieces.shape == (count, 5)
            and isinstance(periodic, bool)
        )
        sound = (
            fits
            and np.isfinite(points).all()
            and np.isfinite(pieces).all()
            and (np.diff(points) > 0).all()
        )
        if not (sound and isinstance(name, str) and name.isidentifier()):
            raise ValueError("the numbers of a table don't fit together")
        unit = data.get("unit", "")
        return cls(points, pieces, periodic, name, check_declared(unit, name) if unit else "")


@written('table(t, points, values, kind="linear", outside="hold")')
def table(
    x: Operand,
    points: Sequence[float],
    values: Sequence[float],
    kind: str = "linear",
    *,
    outside: str = "hold",
    name: str = "table",
) -> Any:
    """The value at ``x`` of a curve through given points: a recorded drive ``sl.table(t, ...)``, a
    measured law ``sl.table(x, ...)``.

    Parameters
    ----------
    x : Expr or float
        Argument of the curve. ``t``, or ``rate*t + offset`` with numbers and parameters: a drive of
        any number of points. Or anything that depends on states: a law of 32 points at most, with a
        boundary at each knot.
    points : sequence of float
        Arguments of the given values, ascending [unit of x].
    values : sequence of float
        Its values there [SI]. An amplitude stays a parameter: ``amplitude*sl.table(...)``.
    kind : str
        ``"linear"``: straight between the points. ``"pchip"``: cubics that keep the shape, no
        overshoot (Fritsch & Carlson 1980), with a continuous slope. ``"spline"``: cubic spline,
        not-a-knot at its ends, or periodic; with a continuous curvature.
    outside : str
        ``"hold"``: the first value before the points and the last one after them. ``"extend"``: the
        polynomials at the ends go on. ``"periodic"``: the curve repeats after ``points[-1] -
        points[0]``; first and last value must be equal. In time only.
    name : str
        Its name in printed equations.

    Returns
    -------
    Expr or float
        A float if ``x`` is a plain number.

    Raises
    ------
    TraceError
        If the points aren't ascending, numbers are missing or not finite, or a table in a state has
        too many knots.

    Examples
    --------
    >>> table(1.5, [0.0, 1.0, 2.0], [0.0, 10.0, 40.0])
    25.0
    """
    return look_up(x, curve(points, values, kind, outside, name))


def look_up(x: Operand, data: Table) -> Any:
    """The value of a table at ``x``, as :func:`table` gives it. Raises TraceError if ``x`` can't be
    an argument.
    """
    if not isinstance(x, Expr):
        return float(data(x))
    if ex.depends_on(x, ("state",)):
        return ex.with_own_unit(lambda: _of_state(x, data))
    with ex.observed(None):
        line = affine(x)
    if line is None or not ex.depends_on(x, ("time",)):
        raise TraceError(
            lambda say: (
                f"{say.sl}table in {x!r}: write a state, or rate*t + offset with numbers and "
                "parameters for the rest."
            )
        )
    return Expr("table", (x,), data)


def curve(
    points: Any,
    values: Any,
    kind: str,
    outside: str,
    name: str,
    unit: str = "",
    title: str = "sl.table",
) -> Table:
    """The table of :func:`table`, checked; ``title`` begins the messages. Raises TraceError as it
    does.
    """
    for what, word, known in (("kind", kind, KINDS), ("outside", outside, OUTSIDE)):
        if not among(word, known):
            raise TraceError(f"{title}: {what}={shown(word)}. {nearest(word, known)}")
    if not (isinstance(name, str) and name.isidentifier()):
        raise TraceError(f"{title}: name={shown(name)} is no name. Use letters, digits and _.")
    if has_mask([points, values]):
        raise TraceError(
            f"{title}: points or values are masked, and masks aren't supported. Leave "
            "them out of both."
        )
    try:
        if any(np.asarray(data).dtype.kind in "cMm" for data in (points, values)):
            raise TypeError("complex numbers, dates")
        x, y = (np.array(data, dtype=np.float64) for data in (points, values))
    except (TypeError, ValueError, OverflowError):
        raise TraceError(
            f"{title}: points and values must be real numbers [SI], as two lists or arrays."
        ) from None
    if x.ndim != 1 or x.shape != y.shape or len(x) < 2:
        raise TraceError(
            f"{title}: points and values must be lists of one length, at least 2; "
            f"theirs are {x.shape} and {y.shape}."
        )
    for what, numbers in (("points", x), ("values", y)):
        if not np.isfinite(numbers).all():
            raise TraceError(
                f"{title}: {what}[{int(np.flatnonzero(~np.isfinite(numbers))[0])}] "
                f"is not a finite number."
            )
    if not (np.diff(x) > 0).all():
        i = int(np.flatnonzero(np.diff(x) <= 0)[0]) + 1
        raise TraceError(
            f"{title}: points must ascend, but points[{i}] = {x[i]:g} follows "
            f"{x[i - 1]:g}. {_ascending(x, y, i)}"
        )
    if outside == "periodic" and y[0] != y[-1]:
        raise TraceError(
            f"{title}: outside='periodic' needs the same first and last value, not "
            f"{y[0]:g} and {y[-1]:g}."
        )
    return Table(x, _pieces(x, y, kind, outside), outside == "periodic", name, unit)


def _ascending(x: np.ndarray, y: np.ndarray, i: int) -> str:
    """Advice about point number i, which isn't greater than the one before it."""
    if (np.diff(x) < 0).any():
        return "Sort them."
    if y[i] == y[i - 1]:
        return "Drop one of the two."
    return (
        f"A step, from {y[i - 1]:g} to {y[i]:g}, is made of two curves: of a time, before = "
        f"sl.recorded(...) of the points up to number {i - 1} and after = sl.recorded(...) of "
        f"those from number {i} on, and in the equation sl.where(t < {float(x[i])!r}, before(t), "
        f"after(t))."
    )


def _pieces(x: np.ndarray, y: np.ndarray, kind: str, outside: str) -> np.ndarray:
    """Reference points and coefficients of all pieces."""
    inner = np.column_stack([x[:-1], _coefficients(x, y, kind, outside == "periodic")])
    if outside == "periodic":
        return inner
    if outside == "extend":
        return np.concatenate([inner[:1], inner, inner[-1:]])
    ends = np.zeros((2, 5))
    ends[:, 0], ends[:, 1] = x[[0, -1]], y[[0, -1]]
    return np.concatenate([ends[:1], inner, ends[1:]])


def _coefficients(x: np.ndarray, y: np.ndarray, kind: str, periodic: bool) -> np.ndarray:
    """Coefficients of (x - x_i)**k, k = 0 to 3, between the points."""
    if kind == "linear" or len(x) == 2:
        return np.column_stack([y[:-1], np.diff(y) / np.diff(x), np.zeros((len(x) - 1, 2))])
    from scipy.interpolate import CubicSpline, PchipInterpolator

    if kind == "pchip":
        curve: Any = PchipInterpolator(x, y)
    else:
        curve = CubicSpline(x, y, bc_type="periodic" if periodic else "not-a-knot")
    coefficients = curve.c[::-1].T
    return np.column_stack([coefficients, np.zeros((len(x) - 1, 4 - coefficients.shape[1]))])


def _of_state(x: Expr, data: Table) -> Any:
    """A table in a state, as pieces with a boundary at every knot where the polynomial changes."""
    if data.periodic:
        raise TraceError(
            lambda say: (
                f"{say.sl}table: outside='periodic' is for tables in time. Of a state it would "
                "have no end of boundaries."
            )
        )
    differs = [
        i for i in range(len(data.points)) if not np.array_equal(data.pieces[i], data.pieces[i + 1])
    ]
    if len(differs) > MOST_KNOTS:
        raise TraceError(
            lambda say: (
                f"{say.sl}table in a state has {len(differs)} knots, each a boundary of the "
                f"motion: {MOST_KNOTS} at most. Take fewer points with kind='spline' or 'pchip', "
                "or fit a formula. A table in time may have any number."
            )
        )
    last = data.pieces[-1]

    def pick(column: Callable[[np.ndarray], float]) -> Any:
        pieces = [(column(data.pieces[i]), x < float(data.points[i])) for i in differs]
        return piecewise(*pieces, otherwise=column(last))

    s = x - pick(lambda piece: piece[0])
    total: Any = pick(lambda piece: piece[1 + data.degree])
    for k in range(data.degree - 1, -1, -1):
        total = total * s + pick(lambda piece, k=k: piece[1 + k])  # type: ignore[misc]
    return total
