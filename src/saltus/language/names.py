"""Allowed names of systems, states and parameters."""

from __future__ import annotations

import keyword
import unicodedata
from collections.abc import Sequence
from typing import Any

from saltus.fence import has_control

#: Longest name of a system [characters].
LONGEST = 200
#: Prefixes of a state's name in a result, and the words for each.
_PLACES = {"end_": "the end", "contact_": "a contact"}
#: Names with another meaning in equations or in the generated code.
RESERVED = frozenset(
    {"t", "np", "numpy", "math", "numba", "njit", "saltus", "kept", "kernel", "inner", "entry"}
)


def why_no_name(name: Any) -> str | None:
    """The reason why this can't be the name of a state or parameter, as the end of a sentence; None
    if it can.
    """
    if not isinstance(name, str) or not name.isidentifier():
        return "use letters, digits and _"
    if keyword.iskeyword(name):
        return "Python uses this word"
    if name.startswith("__") or name in RESERVED:
        return "this name means something else"
    return f"at most {LONGEST} letters" if len(name) > LONGEST else None


def why_not_together(states: Sequence[str]) -> str | None:
    """The reason why these can't be the states of one system, as the end of a sentence; None if
    they can.

    Results call a state x at the end of a trajectory ``end_x``, and at a contact ``contact_x``.
    """
    if len(set(states)) < len(states):
        return "a name stands twice"
    for name in states:
        for place, words in _PLACES.items():
            state = name.removeprefix(place)
            if state != name and state in states:
                return f"results call {state} at {words} {name!r}; rename it"
    return None


def why_no_title(title: Any) -> str | None:
    """The reason why this can't be the name of a system, as the end of a sentence; None if it
    can.
    """
    if not isinstance(title, str) or not title.strip():
        return "it must be text"
    if _controls(title):
        return "it must be one line of text without control characters"
    return f"at most {LONGEST} letters" if len(title) > LONGEST else None


def why_no_output(name: Any) -> str | None:
    """The reason why this can't be the name of an output, as the end of a sentence; None if it can.

    It is that of a variable of results, in files too: netCDF takes no other signs.
    """
    why = why_no_title(name)
    if why is None and (set("/'") & set(name) or name != name.strip()):
        return "use no / and no ' in it, and no space at its ends"
    if why is None and not (name[0].isalnum() or name[0] == "_"):
        return "it must begin with a letter or a digit"
    return why


def why_no_text(text: Any) -> str | None:
    """The reason why this can't be a description or a source, as the end of a sentence; None if it
    can.
    """
    if not isinstance(text, str):
        return "it must be text"
    return "it holds control characters" if _controls(text) - {"\n", "\t"} else None


def _controls(text: str) -> set[str]:
    """Characters that a terminal or a parser may obey: control characters, line ends, halves of
    surrogate pairs, marks of text direction.
    """
    return {
        letter
        for letter in set(text)
        if unicodedata.category(letter) in ("Cc", "Cs", "Zl", "Zp") or has_control(letter)
    }
