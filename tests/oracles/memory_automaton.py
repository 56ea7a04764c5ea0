"""Exact motions of piecewise-linear systems with a memory: one linear flow a mode, modes and exits
written by hand.

Each element (a play, a slider, a relay, ...) is a small state machine of its textbook: what flows
in each of its modes, and which conditions end the mode. A system is a few elements on a common
host; its mode is the tuple of theirs. In one mode the state, extended by ``1``, time and the
harmonic drive, obeys ``z' = M z``, so that ``z(t + s)`` is a polynomial of degree :data:`DEGREE` in
``s`` to rounding once ``|M| s <= 1``. Exits are roots of such polynomials, every one bracketed
before it is polished.

**Forms.** A linear form is a dictionary of coefficients. Its names are states, ``"1"``, ``"t"``,
``"cos"`` and ``"sin"`` (of the drive), ``"d:x"`` (the rate of the state x in the mode at hand) and
``"f:x"`` (that rate before an element holds x at rest).

**What is small.** States and times are of order one: what is zero is judged beside 1, or beside the
state where that is larger.

**What lies on a boundary.** An exit asks for forms that are all positive. Where one is zero, as the
gap of a carried element is, its first derivative that isn't zero decides.
"""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple, Protocol

import numpy as np

DEGREE = 24
_CLOCKS = ("1", "t", "cos", "sin")
_NODES = np.linspace(0.0, 1.0, 9)
_POWERS = _NODES ** np.arange(DEGREE + 1)[:, None]
_SLOPES = np.vstack([np.zeros(9), np.arange(1, DEGREE + 1)[:, None] * _POWERS[:-1]])
_ZERO = 1e-10  # a form this small beside its terms is zero: roots are far better than that
_NOISE = 1e-13  # and beside this, it is rounding
_NEAR = 1e-9  # a state this near to the place of a boundary lies on it

Form = dict[str, float]


class Exit(NamedTuple):
    """End of a mode.

    Attributes
    ----------
    forms : tuple of Form
        The mode ends once all are positive.
    target : str
        The next mode of the element.
    set : dict of str to Form
        States that jump, with their new values.
    snap : dict of str to Form
        States that lie on a boundary if they are next to it, with its place.
    """

    forms: tuple[Form, ...]
    target: str
    set: dict[str, Form] = {}  # noqa: RUF012
    snap: dict[str, Form] = {}  # noqa: RUF012


class Element(Protocol):
    """A state machine on a host.

    Attributes
    ----------
    first : str
        The mode to begin with, before exits that hold at the start are taken.
    rates : dict of str to dict of str to Form
        Rates of the element's own states, for each mode.
    forces : dict of str to dict of str to Form
        What each mode adds to the rates of states of the host.
    holds : dict of str to dict of str to Form
        Rates of the host that a mode overrules.
    exits : dict of str to tuple of Exit
        What ends each mode.
    """

    first: str
    rates: dict[str, dict[str, Form]]
    forces: dict[str, dict[str, Form]]
    holds: dict[str, dict[str, Form]]
    exits: dict[str, tuple[Exit, ...]]


class Motion(NamedTuple):
    """What became of a start.

    Attributes
    ----------
    end : float array (states,)
        State at the end.
    times : list of float
        Times at which modes changed.
    modes : list of tuple of str
        The modes, one more than times.
    """

    end: np.ndarray
    times: list[float]
    modes: list[tuple[str, ...]]


class NoModeError(ArithmeticError):
    """No mode agrees with the state: the machine goes round and round at one instant."""


def add(*forms: Form) -> Form:
    """Sum of forms."""
    total: Form = {}
    for form in forms:
        for name, value in form.items():
            total[name] = total.get(name, 0.0) + value
    return total


def times(factor: float, form: Form) -> Form:
    """A multiple of a form."""
    return {name: factor * value for name, value in form.items()}


def minus(form: Form, other: Form) -> Form:
    """Difference of two forms."""
    return add(form, times(-1.0, other))


class _Flow(NamedTuple):
    """The linear flow of one mode: M, the length of a step, M^k step^k / k!, rows of the exits."""

    matrix: np.ndarray
    step: float
    series: np.ndarray
    exits: list[tuple[int, Exit, slice]]
    rows: np.ndarray


class Automaton:
    """A host and its elements.

    Parameters
    ----------
    host : dict of str to Form
        Rates of the host's states without the elements.
    elements : sequence of Element
    frequency : float
        Of the drive [rad/s].
    longest : float
        Longest step; shorter by itself where the flow is quick.
    """

    def __init__(self, host, elements, frequency=1.0, longest=0.25):
        self.host, self.elements = host, tuple(elements)
        self.frequency, self.longest = frequency, longest
        own = [name for e in self.elements for name in e.rates[e.first]]
        self.states = (*host, *dict.fromkeys(own))
        self.names = (*self.states, *_CLOCKS)
        self.place = {name: i for i, name in enumerate(self.names)}
        self._flows: dict[tuple[str, ...], _Flow] = {}

    def motion(self, start, t_end: float, t_start: float = 0.0) -> Motion:
        """Follow one start.

        Parameters
        ----------
        start : sequence of float (states,)
            In the order of ``states``: the host's, then the elements'.
        t_end, t_start : float
            Times [s].

        Raises
        ------
        NoModeError
            If more than 40 modes follow each other at one instant.
        """
        z = np.array([*start, 1.0, 0.0, 0.0, 0.0])
        self._set_clocks(z, t_start)
        t, mode = t_start, tuple(e.first for e in self.elements)
        found, modes, still = [], [], 0
        mode = self._settle(mode, z)
        modes.append(mode)
        while t < t_end:
            flow = self._flow(mode)
            step = min(flow.step, t_end - t)
            series = (flow.series * (step / flow.step) ** np.arange(DEGREE + 1)[:, None, None]) @ z
            left = _first_exit(flow, series, z) if flow.exits else None
            share = 1.0 if left is None else left[0]
            z = share ** np.arange(DEGREE + 1) @ series
            t = t + share * step if left or t + step < t_end else t_end
            self._set_clocks(z, t)
            still = still + 1 if share < _NOISE else 0
            if still > 40:
                raise NoModeError(
                    f"modes {modes[-4:]} for ever at t = {t}, state {z[:-4].tolist()}"
                )
            if left is not None:
                mode = self._settle(self._leave(mode, left[1], left[2], z), z)
                found.append(t)
                modes.append(mode)
        return Motion(z[: len(self.states)], found, modes)

    def _set_clocks(self, z, t):
        z[-4:] = 1.0, t, math.cos(self.frequency * t), math.sin(self.frequency * t)

    def _leave(self, mode, number, exit_, z):
        """Take an exit: states jump, then those known better are put in place."""
        old, rows = z.copy(), self._rows(mode)[0]
        for name, form in exit_.set.items():
            z[self.place[name]] = self._row(form, rows) @ old
        for name, form in exit_.snap.items():
            at, new = self.place[name], self._row(form, rows) @ old
            if abs(new - z[at]) < _NEAR * (1.0 + abs(new)):
                z[at] = new
        return (*mode[:number], exit_.target, *mode[number + 1 :])

    def _settle(self, mode, z):
        """Take exits that hold at once, until none does."""
        for _ in range(40):
            flow = self._flow(mode)
            for number, exit_, rows in flow.exits:
                if all(_sign(row, flow.matrix, z) > 0 for row in flow.rows[rows]):
                    mode = self._leave(mode, number, exit_, z)
                    break
            else:
                return mode
        raise NoModeError(f"more than 40 modes at t = {z[-3]}, state {z[:-4].tolist()}")

    def _rows(self, mode):
        """Rates of all states in one mode, as rows; and the names that forms may use beside."""
        rows: dict[str, np.ndarray] = {}
        parts = list(zip(self.elements, mode, strict=True))
        for name, form in self.host.items():
            added = [e.forces.get(m, {}).get(name, {}) for e, m in parts]
            rows[f"f:{name}"] = self._row(add(form, *added), rows)
            held = [e.holds[m][name] for e, m in parts if name in e.holds.get(m, {})]
            rows[f"d:{name}"] = self._row(held[0], rows) if held else rows[f"f:{name}"]
        for element, m in parts:
            for name, form in element.rates[m].items():
                rows[f"d:{name}"] = self._row(form, rows)
        return rows, [rows[f"d:{name}"] for name in self.states]

    def _row(self, form, rows):
        row = np.zeros(len(self.names))
        for name, value in form.items():
            if name in self.place:
                row[self.place[name]] += value
            else:
                row += value * rows[name]
        return row

    def _flow(self, mode):
        if mode not in self._flows:
            self._flows[mode] = self._make(mode)
        return self._flows[mode]

    def _make(self, mode):
        rows, rates = self._rows(mode)
        matrix = np.zeros((len(self.names),) * 2)
        matrix[: len(rates)] = rates
        w, (one, t, cos, sin) = self.frequency, (self.place[name] for name in _CLOCKS)
        matrix[t, one], matrix[cos, sin], matrix[sin, cos] = 1.0, -w, w
        quick = np.linalg.norm(np.delete(matrix, [one, t], axis=1)[: len(rates)], 2)
        step = min(self.longest, 1.0 / max(quick, w))
        series = [np.eye(len(self.names))]
        for k in range(1, DEGREE + 1):
            series.append(series[-1] @ matrix * (step / k))
        exits, lines = [], []
        for number, (element, m) in enumerate(zip(self.elements, mode, strict=True)):
            for exit_ in element.exits[m]:
                at = len(lines)
                lines += [self._row(form, rows) for form in exit_.forms]
                exits.append((number, exit_, slice(at, len(lines))))
        return _Flow(matrix, step, np.array(series), exits, np.array(lines))


def _sign(row, matrix, z):
    """Sign of the first derivative of a form that isn't zero, the form itself first."""
    size, usual = np.abs(row), np.maximum(np.abs(z), 1.0)
    for _ in range(8):
        value, scale = row @ z, size @ usual
        if abs(value) > _ZERO * scale:
            return math.copysign(1.0, value)
        row, size = row @ matrix, size @ np.abs(matrix)
    return 0.0


def _first_exit(flow, series, z):
    """(share of the step, element, exit) of the first exit in this step, or None."""
    lines = flow.rows @ series.T
    values, slopes = lines @ _POWERS, lines @ _SLOPES
    noise = _NOISE * (np.abs(flow.rows) @ np.maximum(np.abs(z), 1.0))
    first = None
    for number, exit_, rows in flow.exits:
        share = _first_positive(lines[rows], values[rows], slopes[rows], noise[rows])
        if share is not None and (first is None or share < first[0]):
            first = share, number, exit_
    return first


def _first_positive(lines, values, slopes, noise):
    """Where all polynomials of an exit have become positive, or None."""
    above = values > noise[:, None]
    turning = (slopes[:, :-1] > 0.0) & (slopes[:, 1:] < 0.0)
    if not (above[:, :-1] | above[:, 1:] | turning).all(axis=0).any():
        return None
    cuts = {0.0, 1.0}
    for line, value, slope in zip(lines, values, slopes, strict=True):
        cuts.update(_roots(line, value, slope))
    ordered = sorted(cuts)
    for left, right in itertools.pairwise(ordered):
        middle = np.polynomial.polynomial.polyval(0.5 * (left + right), lines.T)
        if (middle > noise).all():
            return left
    return None


def _roots(line, value, slope):
    """All roots of a polynomial on [0, 1], its extremes located where two might hide."""
    rate, turns = line[1:] * np.arange(1, DEGREE + 1), (slope[:-1] < 0.0) != (slope[1:] < 0.0)
    points = [_root(rate, _NODES[j], _NODES[j + 1]) for j in np.flatnonzero(turns)]
    points = sorted([*_NODES, *points])
    at = np.polynomial.polynomial.polyval(np.array(points), line)
    return [
        _root(line, points[j], points[j + 1])
        for j in np.flatnonzero((at[:-1] <= 0.0) != (at[1:] <= 0.0))
    ]


def _root(line, left, right):
    """Root of a polynomial between two points of different sign: Newton's method, kept inside by
    bisection.
    """
    coefficients = line.tolist()
    below = _horner(coefficients, left)[0] <= 0.0
    x = 0.5 * (left + right)
    for _ in range(100):
        value, rate = _horner(coefficients, x)
        if (value <= 0.0) == below:
            left = x
        else:
            right = x
        step = x - value / rate if rate else math.inf
        new = step if left < step < right else 0.5 * (left + right)
        if abs(new - x) < 1e-16 or right - left < 1e-16:
            return new
        x = new
    return x


def _horner(coefficients, x):
    value = rate = 0.0
    for c in reversed(coefficients):
        rate = rate * x + value
        value = value * x + c
    return value, rate
