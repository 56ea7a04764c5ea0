"""Drives with breaks: square waves, saw-teeth, pulses, recorded series. The instants of their
breaks follow from their parameters by a formula, so steps end there and nothing is searched for.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np

from saltus.arguments import written
from saltus.errors import TraceError, among, nearest, shown
from saltus.language.clocks import mod
from saltus.language.compositions import where
from saltus.language.expression import Expr, Operand, as_expr
from saltus.language.functions import sin
from saltus.language.tables import Table, curve, look_up
from saltus.units import coherent_unit, to_si

#: Shapes of a pulse.
SHAPES = ("rectangle", "half_sine", "triangle")
_TURN = 2 * math.pi


def square(phase: Operand, duty: Operand = 0.5) -> Any:
    """Square wave of period 2 pi: 1 in the first part of each turn, -1 in the rest.

    Parameters
    ----------
    phase : Expr or float
        ``2*sl.pi*frequency*t``, or another ``rate*t + offset`` of numbers and parameters [rad].
    duty : Expr or float
        The part of a turn in which it is 1, from 0 to 1: a number or a parameter.

    Returns
    -------
    Expr or float
        As ``scipy.signal.square`` gives it. A float if both are plain numbers.

    Raises
    ------
    TraceError
        If the phase depends on a state, or ``duty`` is a number outside of 0 to 1.

    Examples
    --------
    >>> square(0.1), square(4.0), square(4.0, duty=0.75)
    (1.0, -1.0, 1.0)
    """
    _check_share(duty, "square", "duty")
    return where(mod(phase, _TURN) < _TURN * duty, 1.0, -1.0)


def sawtooth(phase: Operand, width: Operand = 1.0) -> Any:
    """Saw-tooth of period 2 pi: it rises from -1 to 1 in the first part of each turn and falls in
    the rest.

    Parameters
    ----------
    phase : Expr or float
        ``2*sl.pi*frequency*t``, or another ``rate*t + offset`` of numbers and parameters [rad].
    width : Expr or float
        The part of a turn in which it rises, from 0 to 1: 1 is a saw-tooth, 0.5 a triangle wave, 0
        a saw-tooth that falls. A number, or a parameter between 0 and 1.

    Returns
    -------
    Expr or float
        As ``scipy.signal.sawtooth`` gives it. A float if both are plain numbers.

    Raises
    ------
    TraceError
        If the phase depends on a state, or ``width`` is a number outside of 0 to 1.

    Examples
    --------
    >>> sawtooth(0.0), round(sawtooth(3.0), 3), sawtooth(3.0, width=0.5) > 0
    (-1.0, -0.045, True)
    """
    _check_share(width, "sawtooth", "width")
    within = mod(phase, _TURN) / _TURN
    if not isinstance(width, Expr) and width in (0, 1):
        return 2.0 * within - 1.0 if width == 1 else 1.0 - 2.0 * within
    rise, fall = 2.0 * within / width - 1.0, 1.0 - 2.0 * (within - width) / (1.0 - width)
    return where(mod(phase, _TURN) < _TURN * width, rise, fall)


@written("pulse(t, duration, start=..., every=..., shape=...)")
def pulse(
    t: Operand,
    duration: Operand,
    *,
    start: Operand = 0.0,
    every: Operand | None = None,
    shape: str = "rectangle",
) -> Any:
    """A pulse of height 1, or a train of them; 0 elsewhere.

    Parameters
    ----------
    t : Expr or float
        The time [s].
    duration : Expr or float
        Its duration [s]: a number or a parameter.
    start : Expr or float
        When it begins [s].
    every : Expr or float, optional
        Time from one pulse of a train to the next [s], at least ``duration``; pulses begin at
        ``start`` and at all whole multiples of ``every`` before and after. Default: one pulse.
    shape : {"rectangle", "half_sine", "triangle"}
        Shape of the pulse.

    Returns
    -------
    Expr or float
        A float if all are plain numbers.

    Raises
    ------
    TraceError
        If an argument depends on a state, or ``shape`` isn't known.

    Examples
    --------
    >>> pulse(0.002, 0.011, shape="half_sine")  # doctest: +ELLIPSIS
    0.54...
    >>> pulse(2.1, 0.2, every=1.0), pulse(2.3, 0.2, every=1.0)
    (1.0, 0.0)
    """
    if not among(shape, SHAPES):
        raise TraceError(
            lambda say: f"{say.sl}pulse: shape={shown(shape)}. {nearest(shape, SHAPES)}"
        )
    for given in (t, duration, start):
        as_expr(given)  # refuses anything but a number or a traced value
    if not isinstance(duration, Expr) and duration <= 0:
        raise TraceError(lambda say: f"{say.sl}pulse: duration = {duration:g} must be positive.")
    within = t - start if every is None else mod(t - start, every)
    if shape == "rectangle":
        height: Any = 1.0
    elif shape == "half_sine":
        height = sin(math.pi * within / duration)
    else:
        height = where(
            2.0 * within < duration, 2.0 * within / duration, 2.0 - 2.0 * within / duration
        )
    if every is not None:
        return where(within < duration, height, 0.0)
    return where(t < start, 0.0, where(within < duration, height, 0.0))


@dataclass(frozen=True)
class Record:
    """A recorded series, made by :func:`recorded`: in an equation, a function of the time.

    Attributes
    ----------
    table : Table
        Its curve [s, SI].
    unit : str
        Coherent SI unit of its values, ``""`` if none was given.
    """

    table: Table
    unit: str = ""

    @property
    def duration(self) -> float:
        """Time from its first to its last point [s]."""
        return float(self.table.points[-1] - self.table.points[0])

    def __call__(self, t: Any) -> Any:
        """The value [SI] at a time: ``t``, ``rate*t + offset``, a number, or an array of numbers.

        Raises
        ------
        TraceError
            If it is looked up at a state.
        """
        if isinstance(t, Expr):
            return look_up(t, self.table)
        found = self.table(t)
        return found if np.ndim(found) else float(found)


def recorded(
    times: Sequence[float] | np.ndarray,
    values: Sequence[float] | np.ndarray | None = None,
    unit: str = "",
    *,
    time_unit: str = "s",
    kind: str = "spline",
    outside: str = "hold",
    name: str = "record",
) -> Record:
    """A recorded series as a drive: ``quake = sl.recorded(times, accelerations, "g0")``, and in the
    equation ``quake(t)``.

    It is :func:`table` in time, with units: a cubic spline through the points, piece by piece a
    polynomial, whose knots are known to the integrator.

    Parameters
    ----------
    times : sequence of float
        Instants, ascending [``time_unit``].
    values : sequence of float
        Recorded values [``unit``].
    unit : str
        Unit of the values, such as ``"mm"``; they are converted to SI, and the units of the
        equation are checked with it. Default: numbers in SI of a unit that isn't checked.
    time_unit : str
        Unit of the times.
    kind, outside, name
        As of :func:`table`: ``"spline"``, ``"pchip"`` or ``"linear"``; ``"hold"``, ``"extend"`` or
        ``"periodic"``; what printed equations call it.

    Returns
    -------
    Record
        A function of the time.

    Raises
    ------
    TraceError
        As :func:`table`; for a file in place of the numbers it says how to read it.
    UnitError
        If a unit can't be read, or that of the times is none of a time.

    Examples
    --------
    >>> road = recorded([0, 10, 20, 30], [0, 1, 4, 9], "mm", time_unit="ms")
    >>> road.duration, round(road(0.015), 6)
    (0.03, 0.00225)
    """
    if values is None or isinstance(times, str | PathLike):
        file = str(times) if isinstance(times, str | PathLike) else "record.csv"
        raise TraceError(
            "sl.recorded takes times and values, as numbers, and reads no file. Read it first: "
            f"times, values = numpy.loadtxt({file!r}, delimiter=',', skiprows=1, unpack=True); "
            "then sl.recorded(times, values, 'm/s^2')."
        )
    for what, word in (("unit", unit), ("time_unit", time_unit)):
        if not isinstance(word, str):
            raise TraceError(f"sl.recorded: {what}={shown(word)}. A unit is text, such as 'mm'.")
    own = coherent_unit(f"1 {unit}", "values") if unit else ""
    points = _times(times, to_si(f"1 {time_unit}", "s", "times"))
    heights = _times(values, to_si(f"1 {unit}", own, "values") if unit else 1.0)
    return Record(curve(points, heights, kind, outside, name, own, "sl.recorded"), own)


def _times(numbers: Any, factor: float) -> Any:
    """Numbers times a factor; anything else unchanged, for :func:`curve` to refuse."""
    try:
        if np.asarray(numbers).dtype.kind in "cMm":
            return numbers
        return np.asarray(numbers, dtype=np.float64) * factor
    except (TypeError, ValueError, OverflowError):
        return numbers


def _check_share(number: Any, function: str, argument: str) -> None:
    if not isinstance(number, Expr) and not (isinstance(number, int | float) and 0 <= number <= 1):
        raise TraceError(
            lambda say: (
                f"{say.sl}{function}: {argument} is a part of a turn, from 0 to 1, not "
                f"{shown(number)}."
            )
        )
