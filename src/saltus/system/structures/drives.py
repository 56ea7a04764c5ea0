"""Forces and accelerations of a structure at a time, from their data."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Any

from saltus.errors import ParameterError, UnitError, shown
from saltus.language.expression import TIME, Expr, parameter
from saltus.language.functions import cos, pi
from saltus.system.structures.parts import Base, Force
from saltus.units import dimension

#: Name of the parameter that is the forcing frequency.
FREQUENCY = "frequency"


def entries(label: str, drive: Force | Base, unit: str) -> list[tuple[str, Any, str]]:
    """Name, value and unit of each parameter of a drive; ``unit`` is that of its values.

    Raises
    ------
    UnitError
        If a record or a sweep has another unit.
    """
    if not callable(drive.amplitude):
        return [(label, drive.amplitude, unit), (f"{label}_phase", drive.phase, "rad")]
    own = getattr(drive.amplitude, "unit", "")
    if own and unit and dimension(own) != dimension(unit):
        raise UnitError(
            f"{label}: its values are in {own}, and {_what(drive)} is in {unit}. Give a record of "
            f"{_what(drive)}."
        )
    return [(f"{label}_scale", 1.0, "1")]


def _what(drive: Force | Base) -> str:
    return "an acceleration" if isinstance(drive, Base) else "a force"


def forcing(drives: Sequence[tuple[str, Force | Base]], frequency: Any) -> tuple[bool, bool]:
    """Two truths: the drives need a frequency, and all of them have its period.

    Raises
    ------
    ParameterError
        If they need one and there is none, or a function of the time takes other arguments.
    """
    functions = [(label, one) for label, one in drives if callable(one.amplitude)]
    repeats = [_takes_frequency(label, one) for label, one in functions]
    for label, one in functions:
        _check_gives(label, one)
    harmonic = any(one.harmonic for _, one in drives if not callable(one.amplitude))
    needs = harmonic or any(repeats)
    if needs and frequency is None:
        raise ParameterError("the forces oscillate: give frequency=, such as frequency='15 Hz'.")
    return needs, needs and all(repeats)


def _takes_frequency(label: str, drive: Force | Base) -> bool:
    """True for a function of the time and the frequency, False for one of the time alone."""
    function: Any = drive.amplitude
    try:
        arguments = [
            one.name
            for one in inspect.signature(function).parameters.values()
            if one.default is one.empty
        ]
    except (TypeError, ValueError):  # of a class or function of C
        arguments = []
    if len(arguments) == 1 or arguments[1:] == [FREQUENCY]:
        return len(arguments) == 2
    raise ParameterError(
        f"{label}: {_what(drive)} is a function of the time, lambda t: ..., or of the time and the "
        f"forcing frequency, lambda t, frequency: ..., not {shown(function)}."
    )


def _check_gives(label: str, drive: Force | Base) -> None:
    """Raise a ParameterError for a function of the time that gives no number."""
    try:
        found = value(TIME, label, drive, {f"{label}_scale": None, FREQUENCY: parameter(FREQUENCY)})
    except Exception:  # explained where it is traced, with the line of the function
        return
    if isinstance(found, bool) or not isinstance(found, Expr | int | float):
        raise ParameterError(
            f"{label}: the function of the time gives {shown(found)}, which isn't {_what(drive)}."
        )


def value(t: Any, label: str, drive: Force | Base, values: dict[str, Any]) -> Any:
    """The force or acceleration at a time; of a function without its factor where that is None."""
    if callable(drive.amplitude):
        given = (t, values[FREQUENCY]) if _takes_frequency(label, drive) else (t,)
        scale = values[f"{label}_scale"]
        found = drive.amplitude(*given)
        return found if scale is None else scale * found
    phase: Any = values[f"{label}_phase"] if drive.phase is not None else 0.0
    turns = drive.harmonic * values[FREQUENCY] * t if drive.harmonic else None
    return values[label] * cos(phase if turns is None else 2 * pi * turns + phase)
