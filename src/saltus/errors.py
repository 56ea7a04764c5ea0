"""Exceptions. Every message says what happened, where, and what to do next."""

from __future__ import annotations

import difflib
import linecache
import reprlib
import traceback
import unicodedata
from collections.abc import Iterable
from typing import Any

#: Characters of a message: some 20 lines of a terminal.
LONGEST = 2000
#: Digits up to which a whole number is written out. Python refuses to write those of 4300 or more.
_DIGITS = 60
#: Most names that a message lists.
MOST_NAMES = 24


class SaltusError(Exception):
    """Base of everything that saltus raises on purpose.

    A message is at most :data:`LONGEST` characters long: of a longer one, which repeats what
    somebody gave, the middle is left out.
    """

    def __init__(self, *args: object) -> None:
        super().__init__(*(_cut(part) if isinstance(part, str) else part for part in args))

    def _render_traceback_(self) -> list[str]:
        """What IPython shows in place of a traceback: the user's own line, and the message."""
        return [*_own_line(self), f"{type(self).__name__}: {self}"]


class TraceError(SaltusError):
    """An equation can't be traced."""


class UnitError(SaltusError, ValueError):
    """A value has the wrong unit or none that can be read."""


class ParameterError(SaltusError, ValueError):
    """A parameter, start or option is unknown or out of range."""


class StudyError(SaltusError, ValueError):
    """A study file is wrong."""


class CacheError(SaltusError, OSError):
    """The folder of generated kernels can't be used."""


class SaltusWarning(UserWarning):
    """Something that doesn't stop the work but should be known: trajectories that ended early, a
    cache that can't be used.
    """


class UnusedParameterWarning(SaltusWarning):
    """A parameter of a system stands in none of its equations."""


def _own_line(error: BaseException) -> list[str]:
    """The user's line that called this package, with its number; nothing where it isn't known."""
    found: list[str] = []
    for frame, number in traceback.walk_tb(error.__traceback__):
        package = str(frame.f_globals.get("__name__", "")).partition(".")[0]
        if package == __name__.partition(".")[0] and found:
            break
        line = linecache.getline(frame.f_code.co_filename, number, frame.f_globals).strip()
        if package not in ("IPython", "ipykernel") and line:
            found = [f"line {number}: {line}"]
    return found


def _cut(message: str) -> str:
    """A message without its middle, if it is too long: the error comes first, the advice last."""
    if len(message) <= LONGEST:
        return message
    first, last = LONGEST * 2 // 3, LONGEST // 4
    return (
        f"{message[:first]} ... ({len(message) - first - last} characters left out) ... "
        f"{message[-last:]}"
    )


class _Repr(reprlib.Repr):
    """``repr`` of anything that somebody may give: numbers and texts of NumPy as plain ones, never
    an exception, never without an end.
    """

    def __init__(self) -> None:
        super().__init__()
        self.maxdict = self.maxlist = self.maxtuple = self.maxset = self.maxfrozenset = (
            self.maxdeque
        ) = 40
        self.maxstring = self.maxother = 10_000

    def repr1(self, x: Any, level: int) -> str:
        if type(x).__module__ == "numpy" and not getattr(x, "ndim", 1) and x.dtype.kind in "fiubU":
            x = x.item()
        return super().repr1(x, level)

    def repr_int(self, x: int, _level: int) -> str:
        return (
            repr(x)
            if abs(x) < 10**_DIGITS
            else (f"a whole number of some {int(x.bit_length() * 0.30103) + 1} digits")
        )


def shown(value: object, limit: int = 80) -> str:
    """A value as a message shows it: on one line, cut if it is long."""
    try:
        text = _Repr().repr(value)
    except Exception:  # whatever an object of somebody else does when it is looked at
        text = f"<{type(value).__name__}>"
    text = text if isinstance(value, str) else " ".join(text.split())
    return text if len(text) <= limit else f"{text[: limit - 4]}...{text[-1]}"


def counted(number: int, word: str) -> str:
    """``1 branch``, ``2 branches``, ``3 equilibria``."""
    if number == 1:
        return f"1 {word}"
    if word.endswith("y"):
        return f"{number} {word[:-1]}ies"
    if word.endswith("ium"):
        return f"{number} {word[:-2]}a"
    return f"{number} {word}{'es' if word.endswith('ch') else 's'}"


def among(value: object, words: Iterable[str]) -> bool:
    """Whether a value is text, and one of some words. Lists and arrays, for which ``in`` fails or
    asks each entry, are none of them.
    """
    return isinstance(value, str) and value in words


def nearest(name: object, known: Iterable[str], cutoff: float = 0.5) -> str:
    """A sentence that offers the nearest known name, or lists them in their order, many of them
    shortened; ``cutoff`` is the likeness from which on a name is near.
    """
    known = sorted(known) if isinstance(known, set | frozenset) else list(dict.fromkeys(known))
    if not isinstance(name, str):
        return f"Known: {_listed(known)}."
    alike = unicodedata.normalize("NFKC", name)
    if alike != name and alike in known:
        return (
            f"Write {alike!r} ({alike!a}), which is how Python reads {name!r} ({name!a}) "
            f"in the "
            f"function: they only appear alike."
        )
    close = difflib.get_close_matches(name, known, n=1, cutoff=cutoff)
    return f"Did you mean {close[0]!r}?" if close else f"Known: {_listed(known)}."


def _listed(names: list[str]) -> str:
    if len(names) <= MOST_NAMES:
        return ", ".join(names)
    return f"{', '.join(names[: MOST_NAMES // 2])}, ..., {names[-1]} ({len(names)} in all)"
