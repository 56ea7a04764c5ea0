"""Checks of a system: allowed values of parameters, and the number of boundaries."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from saltus.contact.declared import outside, pushes_on
from saltus.contact.dry_friction import drives, sticks_less
from saltus.contact.guards import Law
from saltus.contact.overlaps import overlapping
from saltus.errors import ParameterError, TraceError, listed
from saltus.language.evaluate import evaluate
from saltus.language.expression import varies
from saltus.system.equations_of_motion import EquationsOfMotion
from saltus.units import to_si

#: Most boundaries of a system: each is a bit of the mode, and a double holds 53 bits.
MOST_GUARDS = 52


def check_guards(system: str, count: int) -> None:
    """Raise a TraceError if a system has more boundaries than its mode has bits."""
    if count > MOST_GUARDS:
        raise TraceError(
            f"{system} has {count} boundaries, and at most {MOST_GUARDS} can be followed at once, "
            f"those of a section or of turning points "
            "and each knot of a table in a state among them. Take fewer stops, or coarser tables."
        )


def check_values(system: EquationsOfMotion, values: Mapping[str, Any]) -> None:
    """Raise a ParameterError if pieces overlap with some values of the parameters, a restitution is
    outside [0, 1], a coefficient of friction or a force of friction is negative, or friction holds
    less at rest than in motion.

    Parameters
    ----------
    system : System
        Its equations.
    values : mapping of str to float or array
        Values of all parameters [SI]; arrays of one length, one for each trajectory.
    """
    why = overlapping(system.field, system.guards, system.states, values)
    if why is not None:
        raise ParameterError(f"{system.name}: ", why)
    for guard in system.guards:
        law = guard.law or Law("jump")
        for part, low, high, told in (
            (law.restitution, 0.0, 1.0, outside),
            (law.friction, 0.0, np.inf, pushes_on),
            *((level, 0.0, np.inf, drives) for level in law.levels),
            (law.limit, 1.0, np.finfo(float).max, sticks_less),
        ):
            if part is None or part.op == "const" or varies(part):
                continue
            found = np.ravel(evaluate([part], values=values)[0])
            wrong = ~((found >= low) & (found <= high))
            if wrong.any():
                raise ParameterError(
                    f"{system.name}, contact {guard.name!r}: {told(float(found[wrong][0]))}"
                )


def check_range(name: str, value: Any, forced_at: str | None) -> None:
    """Raise a ParameterError unless a value, or each of an array, is finite and in the range that
    the parameter's name implies.
    """
    numbers = np.asarray(value, dtype=np.float64)

    def refuse(bad: np.ndarray, what: str) -> None:
        if bad.any():
            where = (
                ""
                if numbers.ndim == 0
                else (f" (entry {int(np.flatnonzero(bad.ravel())[0])} of {numbers.size})")
            )
            raise ParameterError(f"{name} = {numbers[bad].ravel()[0]:g}{where} {what}")

    refuse(~np.isfinite(numbers), "is not a finite number.")
    if "mass" in name:
        refuse(numbers <= 0, "must be positive: the equation divides by the mass.")
    if name == forced_at:
        refuse(
            numbers <= 0,
            "must be positive: it is the forcing frequency. Set the force to zero "
            "for free vibration.",
        )


def resolve(name: str, value: Any, unit: str, forced_at: str | None) -> Any:
    """A value of a parameter, text or number or a list of either, as float or float64 array in SI,
    checked.
    """
    if isinstance(value, np.ndarray) and value.ndim and value.dtype.kind in "fiu":
        result: Any = value.astype(np.float64)
    elif isinstance(value, list | tuple) or getattr(value, "ndim", 0) != 0:
        result = np.array([to_si(item, unit, name) for item in value], dtype=np.float64)
    else:
        result = to_si(value, unit, name)
    check_range(name, result, forced_at)
    return result


def resolve_one(name: str, value: Any, unit: str, forced_at: str | None) -> float:
    """Resolve the single value that a system holds, as :func:`resolve` does."""
    result = resolve(name, value, unit, forced_at)
    if not isinstance(result, float):
        raise ParameterError(
            lambda say: (
                f"{name} got {result.size} values, but a system holds one. Give many by "
                f"{say.key('values')} of the analysis."
            )
        )
    return result


def point(system: EquationsOfMotion, t: Any, y: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times and states [SI] as arrays of numbers with matching shapes; the states come first.

    Raises
    ------
    ParameterError
        If they are something else.
    """
    known = listed(system.states)
    try:
        time, states = (np.asarray(given, dtype=np.float64) for given in (t, y))
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(
            f"t must be a time [s] and y the states {known} [SI], as numbers or arrays of them."
        ) from None
    if states.ndim == 0 or len(states) != len(system.states):
        count = len(states) if states.ndim else "no row"
        raise ParameterError(
            f"{system.name} has the states {known}, but y holds {count} of them. "
            f"Give one entry or row for each."
        )
    try:
        np.broadcast_shapes(time.shape, states.shape[1:])
    except ValueError:
        raise ParameterError(
            f"t of the shape {time.shape} and y of the shape {states.shape} don't fit: t is one "
            f"time, or one for each column of y."
        ) from None
    return time, states
