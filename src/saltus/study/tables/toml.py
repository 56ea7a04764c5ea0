"""What a study file writes: values as TOML, and what the analyses say of Python arguments said of
its keys.
"""

from __future__ import annotations

import json
import re
from typing import Any

from saltus.errors import SaltusError, StudyError
from saltus.fence import SHOWN
from saltus.sentences import Given, Word

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
#: Tables by the function of the analyses that answers them.
TABLES: dict[str, str] = {}


def toml(value: Any) -> str:
    """A value as TOML would write it on one line; a tuple (first, last, count) of Python is a
    range, any other an array.
    """
    match value:
        case Word():
            return value
        case Given(what):
            return cut(what)
        case dict():
            pairs = (
                f"{name if _BARE_KEY.fullmatch(name) else toml(name)} = {toml(item)}"
                for name, item in value.items()
            )
            return f"{{ {', '.join(pairs)} }}"
        case tuple((_, _, int(_)) | (_, _, int(_), str(_))):
            return toml(dict(zip(("first", "last", "count", "scale"), value, strict=False)))
        case list() | tuple():
            return "[" + ", ".join(map(toml, value)) + "]"
        case bool() | str():
            return json.dumps(value, ensure_ascii=False)
        case _:
            return "..." if value is ... else str(value)


def cut(value: Any) -> str:
    """A value as a message repeats it: as TOML would write it, cut if it is long."""
    whole = toml(value)
    return whole if len(whole) <= SHOWN else f"{whole[:SHOWN]}…"


class _FileDialect:
    """Those who write study files: arguments are keys, functions are tables."""

    sl = ""

    def key(self, name: str = "", /, **given: Any) -> str:
        return name or ", ".join(f"{n} = {toml(v)}" for n, v in given.items() if v is not ...)

    def verb(self, name: str, arguments: str = "") -> str:  # noqa: ARG002
        return f"[{TABLES[name]}]" if name in TABLES else f"sl.{name} in Python"

    def method(self, name: str, **options: Any) -> str:
        return self.key(**({"name": name} | options))

    def system(self, **options: Any) -> str:
        return f"[system] {self.key(**options)}".rstrip()

    def either(self, python: str, file: str) -> str:  # noqa: ARG002
        return file


FILE = _FileDialect()


def fault(place: str, error: SaltusError) -> StudyError:
    """The error of a table of a study, from that of its arguments: with its place, if it doesn't
    name it.
    """
    return error if isinstance(error, StudyError) else StudyError(f"[{place}] ", error.said(FILE))
