"""Sentences that hold code: put into words when they are shown, for readers who write Python or
study files.
"""

from __future__ import annotations

import json
import reprlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, TypeAlias

#: Digits up to which a whole number is written out. Python refuses to write those of 4300 or more.
_DIGITS = 60
#: Characters of a value that a message repeats.
SHOWN = 80


class Dialect(Protocol):
    """Style in which a sentence addresses its reader: Python or a study file.

    Attributes
    ----------
    sl : str
        Prefix of a function of an equation.
    """

    sl: str

    def key(self, name: str = "", /, **given: Any) -> str:
        """An argument, ``key("t_end")``, or one with its value, ``key(t_end="10 s")``."""

    def verb(self, name: str, arguments: str = "") -> str:
        """A function of the analyses, with its arguments if they matter."""

    def method(self, name: str, **options: Any) -> str:
        """Name a method of integration, with those of its options that matter."""

    def system(self, **options: Any) -> str:
        """Name the call or table that makes a system, with those of its options that matter."""

    def either(self, python: str, file: str) -> str:
        """Choose the sentence for Python, or the one for a file."""


#: A sentence, or a part of one: text; what makes it for a dialect; an error, which says its own.
Text: TypeAlias = "str | Callable[[Dialect], str] | Exception"


def said(text: Text, dialect: Dialect) -> str:
    """A sentence in words."""
    if isinstance(text, Exception):
        return "".join(said(part, dialect) for part in getattr(text, "parts", [str(text)]))
    return text(dialect) if callable(text) else text


class Word(str):
    """A word that stands for a value, without quotes: ``low``."""

    __slots__ = ()


@dataclass(frozen=True)
class Given:
    """A value from the user, which may be anything."""

    value: Any


class _PythonDialect:
    """Dialect for readers who write Python."""

    sl = "sl."

    def key(self, name: str = "", /, **given: Any) -> str:
        return f"{name}=" if name else ", ".join(f"{n}={python(v)}" for n, v in given.items())

    def verb(self, name: str, arguments: str = "") -> str:
        return f"sl.{name}({arguments})" if arguments else f"sl.{name}"

    def method(self, name: str, **options: Any) -> str:
        return f"sl.{name}({'..., ' if options else ''}{self.key(**options)})"

    def system(self, **options: Any) -> str:
        return f"sl.system(..., {self.key(**options)})" if options else "@sl.system"

    def either(self, python: str, file: str) -> str:  # noqa: ARG002
        return python


PYTHON = _PythonDialect()


def python(value: Any) -> str:
    """A value as Python writes it, texts in double quotes."""
    match value:
        case Word():
            return value
        case Given(what):
            return shown(what)
        case str():
            return json.dumps(value, ensure_ascii=False)
        case Mapping():
            pairs = (f"{python(name)}: {python(one)}" for name, one in value.items())
            return f"{{{', '.join(pairs)}}}"
        case tuple() | list():
            inside = ", ".join(map(python, value))
            return f"[{inside}]" if isinstance(value, list) else f"({inside})"
        case _:
            return "..." if value is ... else repr(value)


class _Repr(reprlib.Repr):
    """``repr`` of any value from the user: NumPy's numbers and texts look plain, no exception is
    raised, and the length is limited.
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


def shown(value: object, limit: int = SHOWN) -> str:
    """Value for a message: on one line, cut if it is long."""
    try:
        text = _Repr().repr(value)
    except Exception:  # whatever an object of somebody else does when it is looked at
        text = f"<{type(value).__name__}>"
    text = text if isinstance(value, str) else " ".join(text.split())
    return text if len(text) <= limit else f"{text[: limit - 4]}...{text[-1]}"
