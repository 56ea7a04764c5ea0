"""Checks on parameter values: what a number may be, and whether a forced system really repeats after one period."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.errors import ParameterError, TraceError
from saltus.system.clocks import cycles_of
from saltus.system.derivatives import time_derivative
from saltus.system.evaluate import evaluate, sides
from saltus.system.expression import Expr, depends_on, relations_in, walk
from saltus.units import to_si

if TYPE_CHECKING:
    from saltus.system.system import System


def check_range(name: str, value: Any, forced_at: str | None) -> None:
    """Raise a ParameterError unless a value, or each of an array, is finite and in the range that the parameter's name implies."""
    numbers = np.asarray(value, dtype=np.float64)

    def refuse(bad: np.ndarray, what: str) -> None:
        if bad.any():
            where = "" if numbers.ndim == 0 else f" (entry {int(np.flatnonzero(bad.ravel())[0])} of {numbers.size})"
            raise ParameterError(f"{name} = {numbers[bad].ravel()[0]:g}{where} {what}")

    refuse(~np.isfinite(numbers), "is not a finite number.")
    if "mass" in name:
        refuse(numbers <= 0, "must be positive: the equation divides by the mass.")
    if name == forced_at:
        refuse(numbers <= 0, "must be positive: it is the forcing frequency. Set the force to zero for free vibration.")


def resolve(name: str, value: Any, unit: str, forced_at: str | None) -> Any:
    """A value of a parameter, text or number or a list of either, as float or float64 array in SI, checked."""
    if isinstance(value, np.ndarray) and value.ndim and value.dtype.kind in "fiu":
        result: Any = value.astype(np.float64)
    elif isinstance(value, list | tuple) or getattr(value, "ndim", 0) != 0:
        result = np.array([to_si(item, unit, name) for item in value], dtype=np.float64)
    else:
        result = to_si(value, unit, name)
    check_range(name, result, forced_at)
    return result


def resolve_one(name: str, value: Any, unit: str, forced_at: str | None) -> float:
    """As :func:`resolve`, for the single value that a system holds."""
    result = resolve(name, value, unit, forced_at)
    if not isinstance(result, float):
        raise ParameterError(f"{name} got {result.size} values, but a system holds one. Give many by values= of the analysis.")
    return result


def point(system: System, t: Any, y: Any) -> tuple[np.ndarray, np.ndarray]:
    """Times and states [SI] as arrays of numbers that fit together; the states come first.

    Raises
    ------
    ParameterError
        If they are something else.
    """
    known = ", ".join(system.states)
    try:
        time, states = (np.asarray(given, dtype=np.float64) for given in (t, y))
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"t must be a time [s] and y the states {known} [SI], as numbers or arrays of them.") from None
    if states.ndim == 0 or len(states) != len(system.states):
        count = len(states) if states.ndim else "no row"
        raise ParameterError(f"{system.name} has the states {known}, but y holds {count} of them. Give one entry or row for each.")
    try:
        np.broadcast_shapes(time.shape, states.shape[1:])
    except ValueError:
        raise ParameterError(
            f"t of the shape {time.shape} and y of the shape {states.shape} don't fit: t is one time, or one for each column of y."
        ) from None
    return time, states


def check_periodic(system: System) -> None:
    """Raise a TraceError if the equations of a forced system differ after one period of the forcing.

    They, and their derivatives with respect to t (in which stiff terms can't hide a weak drive), are evaluated at a handful of states,
    times and modes and one period later. Finds the forgotten 2 pi in ``cos(frequency*t)``, ramps, and a second frequency that isn't a
    multiple of the first.
    """
    period = system.period()
    entries = [*system.field, *(guard.gap for guard in system.guards)]
    if period is None or not any(depends_on(entry, ("time",)) for entry in entries):
        return
    for number, entry in enumerate(entries):
        if not _clocks_repeat(entry, system, period):
            raise TraceError(_not_periodic(system, number, period))
    expressions = entries + [time_derivative(entry) for entry in entries]
    random = np.random.default_rng(20210)
    sizes = np.array([0.0, 0.0, 1e-4, 1e-2, 1.0, 1.0])[:, None]
    states = {name: sizes * random.uniform(-1, 1, sizes.shape) for name in system.states}
    bits = [random.random(sizes.shape) < 0.5 for _ in system.guards]
    for bit, at_rest in zip(bits, sides(system, 0.0, np.zeros(len(system.states))), strict=True):
        bit[0] = at_rest
    t = period * random.uniform(0, 3, (1, 8))
    now, later = (evaluate(expressions, t=when, states=states, values=system.values, bits=bits) for when in (t, t + period))
    for number, (a, b) in enumerate(zip(now, later, strict=True)):
        a, b = np.broadcast_to(a, (6, 8)), np.broadcast_to(b, (6, 8))
        with np.errstate(invalid="ignore"):
            scale = np.maximum(np.abs(a), np.abs(b)).max(axis=1, keepdims=True)
            differs = np.abs(a - b) > 1e-7 * scale
        if differs.any():
            raise TraceError(_not_periodic(system, number % len(entries), period))


def _clocks_repeat(entry: Expr, system: System, period: float) -> bool:
    """Whether all that time alone decides below an expression has a whole number of cycles in a period: by formula, samples miss pulses."""
    for node in walk(entry, conditions=False):
        gaps = [relation.gap for relation in relations_in(node.payload)] if node.op == "select" else []
        for clock in [*gaps, *([node] if node.op in ("mod", "table") else [])]:
            rate, repeats = cycles_of(clock)
            (value,) = evaluate([rate], values=system.values)
            cycles = abs(value * period)
            if cycles and not (repeats and abs(cycles - np.round(cycles)) <= 1e-9 * cycles):
                return False
    return True


def _not_periodic(system: System, entry: int, period: float) -> str:
    """The message about the entry of the field or the guard that doesn't repeat."""
    count = len(system.states)
    what = f"d{system.states[entry]}/dt" if entry < count else f"the boundary {system.guards[entry - count].name!r}"
    unit = system.units[system.forced_at or ""]
    drive = "cos(2*pi*frequency*t)" if unit == "Hz" else "cos(omega*t)"
    return (
        f"{system.name}: {what} doesn't repeat after the forcing period T = {period:.6g} s set by forced_at={system.forced_at!r} [{unit}]. "
        f"Write the drive as {drive}, with the unit declared in units=; let every other forcing frequency be a multiple of it; or say "
        f"forced_at=None for a system without a period."
    )
