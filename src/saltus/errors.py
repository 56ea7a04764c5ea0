"""Exceptions. Every message states the fault, its place, and what to do next."""

from __future__ import annotations

import difflib
import linecache
import re
import traceback
import unicodedata
from collections.abc import Iterable

from saltus.sentences import PYTHON, Dialect, Given, Text, said
from saltus.sentences import shown as shown

#: Characters of a message: some 20 lines of a terminal.
LONGEST = 2000
#: Most names that a message lists.
MOST_NAMES = 24
#: Most names with successive numbers that it lists one by one.
MOST_IN_A_ROW = 6


class SaltusError(Exception):
    """Base of all exceptions that saltus raises on purpose.

    A message is at most :data:`LONGEST` characters long: of a longer one, which repeats what
    somebody gave, the middle is left out.

    Parameters
    ----------
    *parts : str, callable or Exception
        The sentence. What holds code, which Python writes in another way than a study file, is
        made of how those write to whom it is shown: ``lambda say: f"Give {say.key('t_end')}."``.
        ``str(error)`` is for those who write Python.
    """

    def __init__(self, *parts: Text) -> None:
        self.parts = parts
        super().__init__(self.said(PYTHON))

    def __reduce__(self) -> tuple[type[SaltusError], tuple[str]]:
        return type(self), (str(self),)  # what makes a sentence has no name to be found by

    def said(self, dialect: Dialect) -> str:
        """The message for those who write so."""
        return _cut(said(self, dialect))

    def _render_traceback_(self) -> list[str]:
        """Lines that IPython shows in place of a traceback: the user's line, and the message."""
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
    """A problem that doesn't stop the work: trajectories that ended early, a cache that can't be
    used.
    """


class UnusedParameterWarning(SaltusWarning):
    """A parameter of a system stands in none of its equations."""


def _own_line(error: BaseException) -> list[str]:
    """The user's line that called this package, with its number; empty if it isn't known."""
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


def counted(number: int, word: str) -> str:
    """``1 branch``, ``2 branches``, ``3 equilibria``."""
    if number == 1:
        return f"1 {word}"
    if word.endswith("y"):
        return f"{number} {word[:-1]}ies"
    if word.endswith("ium"):
        return f"{number} {word[:-2]}a"
    return f"{number} {word}{'es' if word.endswith('ch') else 's'}"


def must_be(name: str, what: Text, given: object, *more: Text) -> ParameterError:
    """Error for an argument of another kind: ``every must be a positive time, not -1.``"""
    return ParameterError(f"{name} must be ", what, f", not {shown(given)}.", *more)


def unknown(what: str, name: object, known: Iterable[str], *more: Text) -> ParameterError:
    """Error for an unknown name: ``rig has no state 'y'. Did you mean 'x'?``"""
    return ParameterError(f"{what} {shown(name)}. {nearest(name, known)}", *more)


def one_of(words: Iterable[str], before: str = "", **given: object) -> None:
    """Raise ParameterError unless an argument is one of some words: ``one_of(WINDOWS,
    window=window)``. The message begins with ``before``.
    """
    ((name, value),) = given.items()
    if not among(value, words):
        raise ParameterError(
            before,
            lambda say: f"{say.key(**{name: Given(value)})} isn't known. {nearest(value, words)}",
        )


def among(value: object, words: Iterable[str]) -> bool:
    """True if a value is text and one of some words. Lists and arrays are never one: ``in`` fails
    for them, or compares each entry.
    """
    return isinstance(value, str) and value in words


def closest(name: object, known: Iterable[str], cutoff: float = 0.5) -> str | None:
    """Return the nearest known name, if one is near; ``cutoff`` is the least likeness."""
    if not isinstance(name, str):
        return None
    return next(iter(difflib.get_close_matches(name, list(known), n=1, cutoff=cutoff)), None)


def nearest(
    name: object, known: Iterable[str], cutoff: float = 0.5, otherwise: str | None = None
) -> str:
    """Sentence that offers the :func:`closest` known name. If none is near it is ``otherwise``, by
    default a list of all names in order, shortened if there are many.
    """
    known = sorted(known) if isinstance(known, set | frozenset) else list(dict.fromkeys(known))
    if isinstance(name, str):
        alike = unicodedata.normalize("NFKC", name)
        if alike != name and alike in known:
            return (
                f"Write {alike!r} ({alike!a}), which is how Python reads {name!r} ({name!a}) in "
                f"the function: they only appear alike."
            )
    if close := closest(name, known, cutoff):
        return f"Did you mean {close!r}?"
    return f"Known: {listed(known)}." if otherwise is None else otherwise


def listed(names: Iterable[str]) -> str:
    """Names in a row, those that are numbered one after the other by the first and the last: ``x,
    q1 ... q40``. Shortened if there are many.
    """
    rows: list[list[str]] = []
    for name in names:
        if rows and name == _after(rows[-1][-1]):
            rows[-1].append(name)
        else:
            rows.append([name])
    words = [
        word
        for row in rows
        for word in ([f"{row[0]} ... {row[-1]}"] if len(row) > MOST_IN_A_ROW else row)
    ]
    if len(words) <= MOST_NAMES:
        return ", ".join(words)
    count = sum(map(len, rows))
    return f"{', '.join(words[: MOST_NAMES // 2])}, ..., {words[-1]} ({count} in all)"


def _after(name: str) -> str | None:
    """The name with the next number: ``q10_rate`` after ``q9_rate``; None if it has no number."""
    found = re.fullmatch(r"(\D*)(\d{1,9})(\D*)", name)
    return f"{found[1]}{int(found[2]) + 1}{found[3]}" if found else None
