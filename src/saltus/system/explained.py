"""Messages about errors inside a user's function: the line, the fault, and a remedy."""

from __future__ import annotations

import inspect
import sys
import sysconfig
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

from saltus.errors import TraceError, UnitError, nearest
from saltus.language.expression import OWN_FUNCTIONS
from saltus.sentences import Text
from saltus.system.formula import Equations, Formula

_HERE = str(Path(__file__).parent.parent)
_LIBRARIES = tuple(
    {sysconfig.get_path(key) for key in ("stdlib", "platstdlib", "purelib", "platlib")} - {None}
)
_HOW_TO = (
    "Write the equation with + - * / **, comparisons inside sl.piecewise(...), and "
    "functions "
    "that can be traced. "
) + OWN_FUNCTIONS


def explained(error: Exception, function: Callable[..., Any], title: str) -> tuple[Text, ...]:
    """The message for an error inside the user's function: the line, the fault, and a remedy."""
    if isinstance(function, Formula | Equations) and isinstance(error, TraceError | UnitError):
        return f"{title}: ", error
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
    where = f"{title} ({where})"
    missing = isinstance(error, AttributeError) and error.obj is sys.modules["saltus"]
    if isinstance(error, TraceError | UnitError) or missing:
        return f"{where}: ", error
    if isinstance(error, NameError) and error.name:
        known = inspect.signature(function).parameters
        return (
            f"{where}: {error.name!r} is no state, no parameter, and not defined outside either. "
            f"{nearest(error.name, known)}",
        )
    what = str(error).rstrip(".?! ")
    return (f"{where} can't be traced: {type(error).__name__}: {what}. {_HOW_TO}",)


def place(function: Callable[..., Any]) -> str:
    """File and line of a function, or the text of a formula."""
    if isinstance(function, Formula | Equations):
        return function.place
    code = getattr(inspect.unwrap(function), "__code__", None)
    return f"{code.co_filename}, line {code.co_firstlineno}" if code else "unknown place"
