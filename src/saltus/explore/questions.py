"""Questions that a page may ask, read from JSON and checked: kinds of values here, their ranges
where they are answered.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, field, fields
from functools import cache
from typing import Annotated, Any, ClassVar, TypeAlias, get_type_hints

from saltus.errors import ParameterError, SaltusError, among, listed, nearest, shown

#: A number [SI], or text with a unit.
Number: TypeAlias = float | str
Start: TypeAlias = Mapping[str, Number] | list[Number]
#: Longest question [bytes].
LONGEST = 64 * 1024
#: Largest number of a question: JavaScript counts no further.
MOST_ID = 2**53 - 1
#: Least and most starts along an axis of a map.
SIZES = (16, 4000)
#: Most periods of a motion, most of its samples in a period.
MOST_PERIODS, MOST_SAMPLES = 100_000, 10_000
#: Most names in one field, and characters of a text.
_MOST, _CHARACTERS = 400, 400


class QuestionError(ParameterError):
    """A question can't be answered; ``field`` is the one that is wrong, None if none alone is;
    ``ask`` and ``id`` are those of the question, as far as they are known.
    """

    def __init__(self, why: object, field: str | None = None) -> None:
        super().__init__(str(why))
        self.field = field
        self.ask: str | None = None
        self.id: int | None = None


@contextmanager
def about(name: str) -> Iterator[None]:
    """Within, errors of saltus are those of this field of the question."""
    try:
        yield
    except QuestionError:
        raise
    except SaltusError as error:
        raise QuestionError(_without_code(str(error)), name) from error


def _without_code(text: str) -> str:
    """A message without the sentences that are for whoever writes Python."""
    sentences = re.split(r"(?<=[.!?]) (?=[A-Z])", text)
    return " ".join(one for one in sentences if not re.search(r"\bsl\.|=\{", one)) or text


# -- values of fields ------------------------------------------------------------------------------
def _wrong(what: str, given: Any, name: str) -> QuestionError:
    group, _, own = name.partition(".")
    called = own if group in ("values", "start", "source", "at") and own else name
    return QuestionError(f"{called} must be {what}, not {shown(given)}.", name)


def _number(given: Any, name: str) -> Number:
    if isinstance(given, str) and 0 < len(given) <= _CHARACTERS:
        return given
    if isinstance(given, bool) or not isinstance(given, int | float):
        raise _wrong("a number or text with a unit", given, name)
    try:
        found = float(given)
    except OverflowError:
        found = math.inf
    if not math.isfinite(found):
        raise _wrong("a finite number", given, name)
    return found


def _text(given: Any, name: str) -> str:
    if not isinstance(given, str) or len(given) > _CHARACTERS:
        raise _wrong(f"text of at most {_CHARACTERS} characters", given, name)
    return given


def _flag(given: Any, name: str) -> bool:
    if not isinstance(given, bool):
        raise _wrong("true or false", given, name)
    return given


def _whole(least: int, most: int) -> Callable[[Any, str], int]:
    def read(given: Any, name: str) -> int:
        if isinstance(given, bool) or not isinstance(given, int) or not least <= given <= most:
            raise _wrong(f"a whole number from {least} to {most}", given, name)
        return given

    return read


def _one_of(*words: str) -> Callable[[Any, str], str]:
    def read(given: Any, name: str) -> str:
        if not among(given, words):
            raise QuestionError(f"{name} {shown(given)} isn't known. {nearest(given, words)}", name)
        return str(given)

    return read


def _mapping(given: Any, name: str) -> Mapping[str, Any]:
    if not isinstance(given, dict) or len(given) > _MOST:
        raise _wrong(f"an object of at most {_MOST} names", given, name)
    return given


def _numbers(given: Any, name: str) -> Mapping[str, Number]:
    return {key: _number(one, f"{name}.{key}") for key, one in _mapping(given, name).items()}


def _start(given: Any, name: str) -> Start:
    if isinstance(given, list) and len(given) <= _MOST:
        return [_number(one, f"{name}.{i}") for i, one in enumerate(given)]
    return _numbers(given, name)


def _pair(given: Any, name: str) -> tuple[Number, Number]:
    if not isinstance(given, list) or len(given) != 2:
        raise _wrong("two numbers, [low, high]", given, name)
    return _number(given[0], f"{name}.0"), _number(given[1], f"{name}.1")


def _axes(given: Any, name: str) -> Mapping[str, tuple[Number, Number]]:
    if len(_mapping(given, name)) != 2:
        raise _wrong('two states with their ranges, {"x": [-1, 1], "v": [-1, 1]}', given, name)
    return {key: _pair(one, f"{name}.{key}") for key, one in given.items()}


def _size(given: Any, name: str) -> tuple[int, int]:
    if not isinstance(given, list) or len(given) != 2:
        raise _wrong("two whole numbers", given, name)
    read = _whole(*SIZES)
    return read(given[0], f"{name}.0"), read(given[1], f"{name}.1")


def _names(given: Any, name: str) -> tuple[str, ...]:
    if not isinstance(given, list) or len(given) > _MOST:
        raise _wrong(f"a list of at most {_MOST} names", given, name)
    return tuple(_text(one, f"{name}.{i}") for i, one in enumerate(given))


def _point(given: Any, name: str) -> list[float]:
    if not isinstance(given, list) or not 0 < len(given) <= _MOST:
        raise _wrong("a state: a list of numbers", given, name)
    return [float(_number(one, f"{name}.{i}")) for i, one in enumerate(given)]


#: Numbers by name.
Numbers: TypeAlias = Annotated[Mapping[str, Number], _numbers]


# -- the questions ---------------------------------------------------------------------------------
@dataclass(frozen=True, kw_only=True)
class PageQuestion:
    """A question of a page. Numbers are SI or text with a unit; names are those of the system."""

    ask: ClassVar[str] = ""
    id: Annotated[int, _whole(0, MOST_ID)]


@dataclass(frozen=True, kw_only=True)
class Hello(PageQuestion):
    """The first one of a page: its token, its version of the frames, the desk that it knew."""

    ask = "hello"
    token: Annotated[str, _text]
    wire: Annotated[int, _whole(0, 2**31)]
    desk: Annotated[str, _text] = ""


@dataclass(frozen=True, kw_only=True)
class About(PageQuestion):
    """The system: its states, parameters, guards, and what to show first."""

    ask = "about"


@dataclass(frozen=True, kw_only=True)
class Open(PageQuestion):
    """Another of saltus's models, where no system was named."""

    ask = "open"
    model: Annotated[str, _text]


@dataclass(frozen=True, kw_only=True)
class MotionQuestion(PageQuestion):
    """The motion from a start; ``against`` a second method."""

    ask = "motion"
    start: Annotated[Start, _start]
    values: Numbers = field(default_factory=dict)
    periods: Annotated[int, _whole(1, MOST_PERIODS)] = 60
    t_end: Annotated[Number | None, _number] = None
    method: Annotated[str | None, _text] = None
    samples: Annotated[int | None, _whole(2, MOST_SAMPLES)] = None
    errors: Annotated[str, _one_of("local", "measured")] = "measured"
    against: Annotated[str | None, _text] = None
    quantities: Annotated[tuple[str, ...] | None, _names] = None


@dataclass(frozen=True, kw_only=True)
class Settle(PageQuestion):
    """Question for the attractor of a start."""

    ask = "settle"
    start: Annotated[Start, _start]
    values: Numbers = field(default_factory=dict)
    method: Annotated[str | None, _text] = None


@dataclass(frozen=True, kw_only=True)
class Track(PageQuestion):
    """An orbit known at the values ``source``, at other values: by its key, or a point on it."""

    ask = "track"
    values: Numbers = field(default_factory=dict)
    source: Annotated[Mapping[str, Number], _numbers]
    key: Annotated[int | None, _whole(0, 127)] = None
    point: Annotated[list[float] | None, _point] = None
    period: Annotated[int, _whole(1, 64)] = 1


@dataclass(frozen=True, kw_only=True)
class MapQuestion(PageQuestion):
    """The attractor that each start of a grid leads to."""

    ask = "map"
    axes: Annotated[Mapping[str, tuple[Number, Number]], _axes]
    size: Annotated[tuple[int, int], _size]
    values: Numbers = field(default_factory=dict)
    at: Numbers = field(default_factory=dict)
    method: Annotated[str | None, _text] = None
    coarse: Annotated[bool, _flag] = False
    periods: Annotated[int, _whole(1, MOST_PERIODS)] = 2000


@dataclass(frozen=True, kw_only=True)
class AgreementQuestion(MapQuestion):
    """Question for the starts of a grid that two methods lead to the same attractor."""

    ask = "agreement"
    against: Annotated[str, _text]


@dataclass(frozen=True, kw_only=True)
class ResponsesQuestion(PageQuestion):
    """Orbits over a parameter, stable or not."""

    ask = "responses"
    parameter: Annotated[str, _text]
    range: Annotated[tuple[Number, Number], _pair]
    values: Numbers = field(default_factory=dict)
    quantity: Annotated[str | None, _text] = None


@dataclass(frozen=True, kw_only=True)
class OrbitQuestion(PageQuestion):
    """One orbit: an attractor by its key, or a point or an event of responses."""

    ask = "orbit"
    values: Numbers = field(default_factory=dict)
    attractor: Annotated[int | None, _whole(0, 127)] = None
    responses: Annotated[int | None, _whole(0, 2**31)] = None
    point: Annotated[int | None, _whole(0, 2**31)] = None
    event: Annotated[int | None, _whole(0, 2**31)] = None


@dataclass(frozen=True, kw_only=True)
class Save(PageQuestion):
    """A file of what is seen."""

    ask = "save"
    what: Annotated[str, _one_of("study", "script", "picture", "data")]
    format: Annotated[str, _one_of("toml", "py", "png", "svg", "pdf", "nc", "csv", "mat")]
    view: Annotated[Mapping[str, Any], _mapping]
    parts: Annotated[tuple[str, ...], _names] = ()
    name: Annotated[str, _text] = ""


@dataclass(frozen=True, kw_only=True)
class StopWork(PageQuestion):
    """Request to end what is under way, or that of one kind."""

    ask = "stop"
    of: Annotated[str | None, _text] = None


@dataclass(frozen=True, kw_only=True)
class Seen(PageQuestion):
    """Receipt of a piece of a map."""

    ask = "seen"


@dataclass(frozen=True, kw_only=True)
class Show(PageQuestion):
    """Notice of what the page shows now."""

    ask = "show"
    view: Annotated[Mapping[str, Any], _mapping]


@dataclass(frozen=True, kw_only=True)
class Pause(PageQuestion):
    """Notice that nobody looks, so that maps wait."""

    ask = "pause"
    on: Annotated[bool, _flag]


QUESTIONS: Mapping[str, type[PageQuestion]] = {
    one.ask: one
    for one in (
        Hello, About, Open, MotionQuestion, Settle, Track, MapQuestion, AgreementQuestion,
        ResponsesQuestion, OrbitQuestion, Save, StopWork, Seen, Show, Pause,
    )
}  # fmt: skip


def read(text: str) -> PageQuestion:
    """The question in a text of a page.

    Raises
    ------
    QuestionError
        If it isn't JSON, isn't a question, or a field is missing, unknown or of another kind.
    """
    if len(text) > LONGEST:
        raise QuestionError(f"a question may have {LONGEST} characters, not {len(text)}.")
    try:
        data = json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError):
        raise QuestionError("a question must be JSON.") from None
    if not isinstance(data, dict) or not isinstance(data.get("ask"), str):
        raise QuestionError('a question must be an object with "ask" and "id".')
    ask, number = data.pop("ask"), data.get("id")
    try:
        return question_of(ask, data)
    except QuestionError as error:
        error.ask = ask if among(ask, QUESTIONS) else None
        error.id = number if type(number) is int and 0 <= number <= MOST_ID else None
        raise


def question_of(ask: str, data: Mapping[str, Any]) -> PageQuestion:
    """The question of a kind from its fields. Raises QuestionError as :func:`read` does."""
    if not among(ask, QUESTIONS):
        raise QuestionError(f"there is no question {shown(ask)}. {nearest(ask, QUESTIONS)}", "ask")
    kind = QUESTIONS[ask]
    known = _readers(ask)
    for name in data:
        if name not in known:
            raise QuestionError(f"{ask} has no field {shown(name)}. {nearest(name, known)}", name)
    needed = {
        one.name
        for one in fields(kind)
        if one.default is MISSING and one.default_factory is MISSING
    }
    given = {}
    for name, reads in known.items():
        if name in needed and name not in data:
            raise QuestionError(f"{ask} needs {name}. Its fields: {listed(known)}.", name)
        if name in needed or data.get(name) is not None:
            given[name] = reads(data[name], name)
    return kind(**given)


@cache
def _readers(ask: str) -> dict[str, Callable[[Any, str], Any]]:
    """Functions that read each field of a kind of question."""
    hints = get_type_hints(QUESTIONS[ask], include_extras=True)
    return {one.name: hints[one.name].__metadata__[0] for one in fields(QUESTIONS[ask])}


def _refuse(constant: str) -> None:
    raise ValueError(constant)
