"""Tables made from the functions that answer them: name, default and meaning of a key come from the
function only.
"""

from __future__ import annotations

import importlib
import inspect
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, ClassVar, Literal

from pydantic import Field, create_model, model_validator

import saltus
from saltus.fence import MOST_COUNT
from saltus.study.tables.parts import Named, Quantity, StudyTable
from saltus.study.tables.toml import TABLES, toml

#: Arguments that a question leaves to the study: the system, and how it is run.
_OF_THE_STUDY = ("system", "run", "threads", "progress")
_ENTRY = re.compile(r"^(\S[^\n]*)\n((?:    [^\n]*\n?)+)", re.MULTILINE)
_AS_FOR = re.compile(r"As for :func:`saltus\.(\w+)`")
_ROLE = re.compile(r":\w+:`(?:saltus\.)?([^`]*)`|``([^`]*)``")
_SENTENCE = re.compile(r"(.*?\.)(?:\s|$)")


@dataclass(frozen=True)
class WrittenAs:
    """Form in which a study file writes a parameter of a function.

    Attributes
    ----------
    holds : type
        Type in the file; by default that of the function's annotation.
    examples : tuple
        The first one stands in messages.
    description : str
        For what a file writes in another way than Python; by default the first sentence of the
        function's docstring.
    default : object
        In place of the function's.
    limits : mapping
        ``ge=`` and others.
    convert : str
        Name of the conversion in :mod:`saltus.study.setting.arguments` that makes the function's
        argument of it; by default there is none.
    """

    holds: Any = None
    examples: tuple[Any, ...] = ()
    description: str = ""
    default: Any = inspect.Parameter.empty
    limits: Mapping[str, Any] = field(default_factory=dict)
    convert: str = ""


class Generated(StudyTable):
    """A table whose keys are parameters of a function."""

    #: Its name in the file, and the function that answers it.
    place: ClassVar[str] = ""
    function: ClassVar[str] = ""
    #: Kinds of the keys that are arguments of the function.
    kinds: ClassVar[dict[str, WrittenAs]] = {}


class Asked(Generated, Named):
    """Such a table that may be asked for several times."""


class OfLength(Generated):
    """A table that says how long to go on; given times are enough."""

    @model_validator(mode="after")
    def _one_length(self) -> OfLength:
        lengths = [getattr(self, name, None) is not None for name in ("periods", "t_end")]
        if sum(lengths) != 1 and (any(lengths) or getattr(self, "at", None) is None):
            raise ValueError(
                "give the length once: periods = 60, or, of a system without forcing, "
                't_end = "20 s"'
            )
        return self


def verb(name: str) -> Callable[..., Any]:
    """Look up a public function of the analyses."""
    function: Callable[..., Any] = getattr(importlib.import_module(saltus._HOMES[name]), name)
    return function


def table(
    place: str,
    verbs: Sequence[str],
    kinds: Mapping[str, WrittenAs],
    *,
    base: type[StudyTable] | tuple[type[StudyTable], ...] = Asked,
    without: Sequence[str] = (),
    called: str = "",
    **own: Any,
) -> Any:
    """The table of a study file that calls verbs.

    Parameters
    ----------
    place : str
        Its name in the file.
    verbs : sequence of str
        Functions of the analyses whose parameters are keys, the first one giving the table its
        summary.
    kinds : mapping of str to Kind
        Forms of parameters that aren't plain numbers, words and choices.
    base, without, called
        Classes below it; parameters that it leaves out; what one without a name is called.
    **own : (type, Field)
        Keys that no parameter stands for.
    """
    found: dict[str, tuple[Any, WrittenAs]] = {}
    TABLES[verbs[0]] = place
    for function in map(verb, verbs):
        for parameter in inspect.signature(function).parameters.values():
            name = parameter.name
            if (
                name not in (*_OF_THE_STUDY, *without, *found, *own)
                and parameter.kind != parameter.VAR_KEYWORD
            ):
                found[name] = _key(function, parameter, kinds.get(name, WrittenAs()))
    summary = (inspect.getdoc(verb(verbs[0])) or "").split("\n\n")[0]
    several = (
        f" Several: [[{place}]], each with a name."
        if issubclass(base if isinstance(base, type) else base[-1], Named)
        else ""
    )
    fields: dict[str, Any] = {name: key for name, (key, _) in found.items()} | own
    title = place.title().replace("_", "").replace(".", "")
    text = f"[{place}]: {_plain(summary)}{several}"
    made = create_model(title, __base__=base, __module__=__name__, __doc__=text, **fields)
    for name, value in {
        "place": place,
        "function": verbs[0],
        "kinds": {name: kind for name, (_, kind) in found.items()},
        "called": called,
    }.items():
        setattr(made, name, value)
    return made


def options(method: type, examples: Mapping[str, Any]) -> Any:
    """The table of the options of a method."""
    parameters = inspect.signature(method).parameters.values()
    keys: dict[str, Any] = {
        one.name: _key(method, one, WrittenAs(examples=(examples.get(one.name, one.default),)))[0]
        for one in parameters
    }
    summary = _plain((inspect.getdoc(method) or "").split("\n\n")[0])
    name: Any = method.__name__
    text = f"[method] name = {toml(name)}: {summary}"
    fields = {"name": (Literal[name], ...)} | keys
    return create_model(name, __base__=StudyTable, __module__=__name__, __doc__=text, **fields)


# -- one key ---------------------------------------------------------------------------------------
def _key(
    function: Callable[..., Any], parameter: inspect.Parameter, kind: WrittenAs
) -> tuple[Any, WrittenAs]:
    """Type and Field of a key, and how it is written."""
    written, description = documented(function)[parameter.name]
    kind = WrittenAs() if written.startswith("{") else kind  # its choices say all
    holds, examples, limits = (
        kind.holds or _holds(parameter, written),
        kind.examples,
        dict(kind.limits),
    )
    if holds in (int, float) and not limits:
        limits = {"ge": 1, "le": MOST_COUNT} if holds is int else {"gt": 0}
    choices = getattr(holds, "__args__", ())
    examples = examples or choices[1:] or ((not parameter.default,) if holds is bool else ())
    default = kind.default if kind.default is not parameter.empty else parameter.default
    optional = holds if default is not None else holds | None
    text = kind.description or _plain(description)
    given = (
        {"default_factory": dict}
        if default == {}
        else {"default": ... if default is parameter.empty else default}
    )
    made = Field(**given, description=text, examples=list(examples), **limits)
    return (optional, made), kind


def _holds(parameter: inspect.Parameter, written: str) -> Any:
    """Type of a key, from the choices in the docstring, or from the annotation."""
    if choices := re.match(r"\{(.*)\}", written):
        return Literal[tuple(_choice(one) for one in choices[1].split(", "))]
    plain = {"bool": bool, "int": int, "float": float, "float | str": Quantity, "str": str}
    annotation = str(parameter.annotation).removesuffix(" | None")
    if annotation not in plain:
        raise TypeError(f"{parameter}: no kind says how it is written in a study file")
    return plain[annotation]


def _choice(text: str) -> Any:
    """Choice in a docstring: a word in quotes, or a whole number."""
    return text.strip('"') if text.startswith('"') else int(text)


@cache
def documented(function: Callable[..., Any]) -> dict[str, tuple[str, str]]:
    """Type and meaning of each parameter, from the docstring. "As for" another function stands for
    the parameters of that function.
    """
    text = inspect.getdoc(function) or ""
    title = "Parameters" if "Parameters\n---" in text else "Attributes"
    part = text.partition(f"{title}\n----------\n")[2].split("\n\n")[0]
    found: dict[str, tuple[str, str]] = {}
    for heading, body in _ENTRY.findall(part + "\n"):
        names, _, written = heading.partition(" : ")
        other = _AS_FOR.match(body.strip())
        for name in names.replace("*", "").split(", "):
            there = (
                documented(verb(other[1])).get(name)
                if other and other[1] != getattr(function, "__name__", "")
                else None
            )
            found[name] = there or (written, " ".join(body.split()))
    return found


def _plain(text: str) -> str:
    """First sentence of a docstring, in the words of a study file."""
    sentence = _SENTENCE.match(text)
    return _ROLE.sub(
        lambda role: role[1] or role[2], (sentence[1] if sentence else text).replace("\n", " ")
    )
