"""Texts for study files: values as TOML, and sentences on Python arguments turned into sentences on
keys.
"""

from __future__ import annotations

import json
import re
from typing import Any

from saltus.errors import SaltusError, StudyError
from saltus.sentences import SHOWN, Given, Word

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
#: Tables by the function of the analyses that answers them.
TABLES: dict[str, str] = {}


def toml(value: Any) -> str:
    """Value as TOML on one line. A tuple (first, last, count) of Python becomes a range, any other
    tuple an array.
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
    """Value for a message: as TOML, cut if it is long."""
    whole = toml(value)
    return whole if len(whole) <= SHOWN else f"{whole[:SHOWN]}…"


class _FileDialect:
    """Dialect for readers who write study files: arguments are keys, functions are tables."""

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
    """Error of a table of a study, made from that of an argument: it names the table."""
    return error if isinstance(error, StudyError) else StudyError(f"[{place}] ", error.said(FILE))
