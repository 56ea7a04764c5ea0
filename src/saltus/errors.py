"""Exceptions. Every message says what happened, where, and what to do next."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class SaltusError(Exception):
    """Base of everything that saltus raises on purpose."""


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
    """Something that doesn't stop the work but should be known: trajectories that ended early, a cache that can't be used."""


class UnusedParameterWarning(SaltusWarning):
    """A parameter of a system stands in none of its equations."""


def shown(value: object, limit: int = 80) -> str:
    """A value as a message shows it: at most so many characters of it."""
    text = repr(value)
    return text if len(text) <= limit else f"{text[: limit - 4]}...{text[-1]}"


def among(value: object, words: Iterable[str]) -> bool:
    """Whether a value is text, and one of some words. Lists and arrays, for which ``in`` fails or asks each entry, are none of them."""
    return isinstance(value, str) and value in words


def nearest(name: object, known: Iterable[str]) -> str:
    """A sentence that offers the nearest known name, or lists all of them."""
    known = list(known)
    close = difflib.get_close_matches(name, known, n=1, cutoff=0.5) if isinstance(name, str) else []
    return f"Did you mean {close[0]!r}?" if close else f"Known: {', '.join(sorted(known))}."
