"""Messages about errors inside a user's function: the line, the fault, and a remedy."""

from __future__ import annotations

import inspect
import sysconfig
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from saltus.errors import TraceError, UnitError, nearest
from saltus.language.expression import OWN_FUNCTIONS
from saltus.system.formula import Equations, Formula

_HERE = str(Path(__file__).parent.parent)
_LIBRARIES = tuple(
    {sysconfig.get_path(key) for key in ("stdlib", "platstdlib", "purelib", "platlib")} - {None}
)
#: Functions that are often called with positional arguments, and how to call them.
_CALLS = {
    "freeplay": "sl.freeplay(x, stiffness=..., gap=...), or lower_gap= and upper_gap=, damping= "
    "with velocity=, preload=",
    "friction": "sl.friction(v, slip=..., stick=...)",
    "impact": "sl.impact(x < gap, v, restitution=0.8), after the rates",
    "piecewise": "sl.piecewise((value, condition), ..., otherwise=value)",
    "where": "sl.where(condition, value, otherwise)",
    "pulse": "sl.pulse(t, duration, start=..., every=..., shape=...)",
    "mod": "sl.mod(t, T)",
    "clip": "sl.clip(x, low, high)",
    "table": 'sl.table(t, points, values, kind="linear", outside="hold")',
}
_HOW_TO = (
    "Write the equation with + - * / **, comparisons inside sl.piecewise(...), and "
    "functions "
    "that can be traced. "
) + OWN_FUNCTIONS


def explained(error: Exception, function: Callable[..., Any], title: str) -> str:
    """The message for an error inside the user's function: the line, the fault, and a remedy."""
    if isinstance(function, Formula | Equations) and isinstance(error, TraceError | UnitError):
        return f"{title}: {error}"
    code = getattr(inspect.unwrap(function), "__code__", None)
    own_file = code.co_filename if code else ""
    frames = [
        frame
        for frame in traceback.extract_tb(error.__traceback__)
        if frame.filename == own_file or not frame.filename.startswith((_HERE, *_LIBRARIES))
    ]
    where = place(function)
    if frames:
        where = f"{frames[-1].filename}, line {frames[-1].lineno}"
        where += f": {frames[-1].line}" if frames[-1].line else ""
    if isinstance(error, TraceError | UnitError):
        return f"{title} ({where}): {error}"
    if isinstance(error, AttributeError) and str(error).startswith("saltus has no "):
        return f"{title} ({where}): {error}"
    if isinstance(error, NameError) and error.name:
        known = inspect.signature(function).parameters
        return (
            f"{title} ({where}): {error.name!r} is no state, no parameter, and not defined "
            f"outside either. {nearest(error.name, known)}"
        )
    for name, call in _CALLS.items():
        if isinstance(error, TypeError) and str(error).startswith(f"{name}() "):
            return f"{title} ({where}): sl.{str(error).rstrip('.')}. Write {call}."
    if isinstance(error, TypeError) and "for ^" in str(error):
        return f"{title} ({where}): a power is written x**2; ^ is something else in Python."
    return (
        f"{title} ({where}) can't be traced: {type(error).__name__}: "
        f"{str(error).rstrip('.?! ')}. {_HOW_TO}"
    )


def place(function: Callable[..., Any]) -> str:
    """File and line of a function, or the text of a formula."""
    if isinstance(function, Formula | Equations):
        return function.place
    code = getattr(inspect.unwrap(function), "__code__", None)
    return f"{code.co_filename}, line {code.co_firstlineno}" if code else "unknown place"
