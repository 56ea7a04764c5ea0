"""What the analyses say of Python arguments, said of a study file: ``t_end="2 s"`` is ``t_end = "2
s"`` there, a tuple is an array.
"""

from __future__ import annotations

import ast
import json
import re
from inspect import signature
from typing import Any

from saltus.contact import freeplay, hunt_crossley
from saltus.errors import StudyError
from saltus.language import piecewise

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
#: Texts in quotes, which repeat what somebody wrote; calls and arguments of Python.
_QUOTED = r"(?<!\w)(?:'[^'\n]*'|\"[^\"\n]*\")(?!\w)"
_METHOD = r"\bsl\.(?P<method>Taylor|RK4|ODE\d+s?)\((?P<options>[^()]*)\)"
_SYSTEM = r"@?\bsl\.system(?:\(\.\.\., (?P<inside>[^()]*)\))?"
_CALL = r"\bsl\.(?P<call>\w+)(?:\(\.\.\.\))?"
_KEY = r"(?<![\w.])(?P<key>[A-Za-z_]\w*)=(?!=)"
_PYTHON = re.compile("|".join((_QUOTED, _METHOD, _SYSTEM, _CALL, _KEY)))
_NUMBER = re.compile(r"[+-]?\d+(?:\.\d+)?(?:e[+-]?\d+)?\b|True\b|False\b")
_CLOSING = {"(": ")", "[": "]", "{": "}"}
#: Arguments that formulas give by name too, as Python does: ``piecewise(..., otherwise=0)``.
_OF_FORMULAS = {
    *(name for one in (freeplay, hunt_crossley, piecewise) for name in signature(one).parameters)
}
_QUESTIONS = (
    "simulate", "poincare", "spectrum", "lyapunov", "frequency_response", "bifurcation_diagram",
    "equilibria", "periodic_orbits", "branches", "bifurcation_curve", "backbone", "basins",
    "compare",
)  # fmt: skip
_TABLES = {name: f"[{name}]" for name in _QUESTIONS} | {
    "impact_statistics": "[impacts]",
    "energy_balance": "[energy]",
}


def fault(place: str, error: Exception) -> StudyError:
    """The error of a table of a study, from the error of its arguments."""
    message = in_toml(str(error))
    return StudyError(message if message.startswith("[") else f"[{place}] {message}")


def toml(value: Any) -> str:
    """A value as TOML would write it on one line; a tuple (first, last, count) of Python is a
    range, any other an array.
    """
    match value:
        case dict():
            return (
                "{ "
                + ", ".join(
                    f"{key if _BARE_KEY.fullmatch(key) else toml(key)} = {toml(item)}"
                    for key, item in value.items()
                )
                + " }"
            )
        case tuple((_, _, int(_)) | (_, _, int(_), str(_))):
            return toml(dict(zip(("first", "last", "count", "scale"), value, strict=False)))
        case list() | tuple():
            return "[" + ", ".join(map(toml, value)) + "]"
        case bool() | str():
            return json.dumps(value, ensure_ascii=False)
        case _:
            return str(value)


def in_toml(message: str) -> str:
    """A message on arguments of a Python function as one on keys of a study; quotations don't
    change.
    """
    parts, at = [], 0
    while (found := _PYTHON.search(message, at)) is not None:
        parts.append(message[at : found.start()])
        text, at = _said(found, message)
        parts.append(text)
    return "".join(parts) + message[at:]


def _said(found: re.Match[str], message: str) -> tuple[str, int]:
    """A piece of Python as a study writes it, and where it ends."""
    end = found.end()
    if name := found["method"]:
        options = in_toml(found["options"].removeprefix("..., ").removesuffix("...")).strip(" ,")
        return f'name = "{name}"' + (f", {options}" if options else ""), end
    if found["inside"]:
        return f"[system] {in_toml(found['inside'])}", end
    if name := found["call"]:
        return _TABLES.get(name, name), end
    if found[0].endswith("sl.system"):
        return "[system]", end
    if (key := found["key"]) is None or key in _OF_FORMULAS:
        return found[0], end
    literal = _literal(message, end)
    if literal is None:
        return (key if message[end : end + 1] in ("", *" ,.;:)") else found[0]), end
    value, end = literal
    return f"{key} = {toml(value)}", end


def _literal(text: str, start: int) -> tuple[Any, int] | None:
    """The value that Python's text holds from a place on, and where it ends; None if
    there is none.
    """
    if number := _NUMBER.match(text, start):
        end = number.end()
    elif text[start : start + 1] in ("'", '"'):
        end = text.find(text[start], start + 1) + 1
    else:
        end = _closed(text, start)
    try:
        return (ast.literal_eval(text[start:end]), end) if end else None
    except (ValueError, SyntaxError):
        return None


def _closed(text: str, start: int) -> int:
    """Where the bracket that opens at a place closes; 0 if none does."""
    waiting: list[str] = []
    for place, letter in enumerate(text[start:], start):
        if letter in _CLOSING:
            waiting.append(_CLOSING[letter])
        elif waiting and letter == waiting[-1]:
            waiting.pop()
        if not waiting:
            return place + 1 if place > start else 0
    return 0
