"""Checks of the types of arguments of public functions, from their annotations: made once, where
the function is entered.

Only the kinds are asked here, of arguments whose annotation consists of plain ones: ``int``,
``float``, ``bool``, ``str``, a ``Mapping`` and ``None``. What a number or a text may say is the
function's own matter.
"""

from __future__ import annotations

import functools
import inspect
import math
import numbers
import re
from collections.abc import Callable, Mapping
from decimal import Decimal
from typing import Any, ParamSpec, TypeVar

import numpy as np

from saltus.errors import ParameterError, TraceError, nearest, shown

P = ParamSpec("P")
R = TypeVar("R")


def _is_number(value: Any) -> bool:
    """True for a real number of Python or NumPy, an array without axes, or a Quantity of pint."""
    if hasattr(value, "magnitude") and hasattr(value, "units"):
        return True
    # NumPy's spans of time count as whole numbers
    kind = getattr(getattr(value, "dtype", None), "kind", "f")
    plain = isinstance(value, numbers.Real | Decimal) or getattr(value, "shape", None) == ()
    return plain and kind in "fiu" and not isinstance(value, bool)


def _is_whole(value: Any) -> bool:
    if not isinstance(value, int | float | np.integer | np.floating) or isinstance(
        value, bool | np.timedelta64
    ):
        return False
    return isinstance(value, int) or (math.isfinite(value) and value == int(value))


#: Test and name of each kind, by its annotation; of the names the first that fits what else may
#: stand there.
_KINDS: Mapping[str, tuple[Callable[[Any], bool], str]] = {
    "int": (_is_whole, "a whole number"),
    "float": (_is_number, "a number"),
    "bool": (
        lambda value: (
            isinstance(value, bool | np.bool_) or (isinstance(value, int) and value in (0, 1))
        ),
        "True or False",
    ),
    "str": (lambda value: isinstance(value, str), "a text"),
    "Mapping": (lambda value: isinstance(value, Mapping), "a mapping such as {'name': ...}"),
    "None": (lambda value: value is None, "None"),
}


def has_mask(value: Any, depth: int = 3) -> bool:
    """True if numbers in an array, or in arrays in lists and mappings, are masked. Read as plain
    numbers they would have arbitrary values.
    """
    if isinstance(value, np.ma.MaskedArray):
        return bool(np.ma.is_masked(value))
    inside = (
        value.values()
        if isinstance(value, Mapping)
        else value
        if isinstance(value, list | tuple)
        else ()
    )
    return depth > 0 and any(has_mask(one, depth - 1) for one in inside)


#: Examples of mappings that stand for one argument.
_EXAMPLES = {
    "units": "{'x': 'mm'}",
    "vary": "{'force': ('1 N', '9 N')}",
    "values": "{'force': '4 N'}",
    "box": "{'x': ('-5 mm', '5 mm')}",
}


class Kinds:
    """Kinds of a function's arguments, for those that are checked here.

    It does of whole numbers, which have a least one, and of a text whose default is a text: that is
    one of a few words.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._of: dict[str, list[str]] = {}
        for name, parameter in inspect.signature(function).parameters.items():
            kinds = [
                re.sub(r"\[[^|]*\]$", "", kind) for kind in str(parameter.annotation).split(" | ")
            ]
            checks_itself = set(kinds) <= {"int", "None"} or (
                kinds == ["str"] and isinstance(parameter.default, str)
            )
            if (
                parameter.kind not in (parameter.VAR_POSITIONAL, parameter.VAR_KEYWORD)
                and not checks_itself
                and set(kinds) <= set(_KINDS)
            ):
                self._of[name] = kinds

    def check(self, caller: str, given: Mapping[str, Any]) -> None:
        """Raise ParameterError for the first argument that is of another kind, or has masked
        numbers.
        """
        for name, value in given.items():
            if has_mask(value):
                raise ParameterError(
                    f"{caller}: {name} has masked numbers, and masks aren't supported. Leave them "
                    f"out: array.compressed()."
                )
            kinds = self._of.get(name)
            if kinds and not any(_KINDS[kind][0](value) for kind in kinds):
                words = [_KINDS[kind][1] for kind in kinds if kind != "None"]
                if name in _EXAMPLES:
                    words = [word.replace("{'name': ...}", _EXAMPLES[name]) for word in words]
                if words[-1] == "a text" and len(words) > 1:
                    words[-1] = "a text with its unit"
                default = " Leave it out for the default." if "None" in kinds else ""
                raise ParameterError(
                    f"{caller}: {name} must be {' or '.join(words)}, not {shown(value)}.{default}"
                )


class CallError(TraceError, TypeError):
    """A function of equations was called with wrong arguments."""


def written(call: str) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Wrap a function of equations: a call with wrong arguments raises an error that shows the
    right call.
    """

    def made(function: Callable[P, R]) -> Callable[P, R]:
        @functools.wraps(function)
        def called(*args: P.args, **kwargs: P.kwargs) -> R:
            try:
                return function(*args, **kwargs)
            except TypeError as error:
                if error.__traceback__ is None or error.__traceback__.tb_next is not None:
                    raise  # inside the function
                why = f"{error}".rstrip(".")
                raise CallError(lambda say: f"{say.sl}{why}. Write {say.sl}{call}.") from None

        return called

    return made


#: Words that belong to the axes of a picture, not to the picture.
_OF_AXES = dict.fromkeys(
    ("xlim", "ylim", "title", "xlabel", "ylabel", "grid", "xscale", "yscale", "log", "logx",
        "logy", "figsize", "color", "c", "lw", "linewidth", "marker", "label", "show", "save",
        "filename", "fontsize"),
    "A picture gives its matplotlib axes: axes.set_xlim(...), axes.set_title(...), "
    "axes.figure.savefig(path); it takes others by ax=.",
)  # fmt: skip


def checked(function: Callable[P, R], elsewhere: Mapping[str, str] | None = None) -> Callable[P, R]:
    """Wrap a function: it checks the kinds of its arguments. For an unknown argument the error has
    the sentence of ``elsewhere``, or the nearest known name. Verbs check that themselves.
    """
    signature, kinds = inspect.signature(function), Kinds(function)
    known = signature.parameters
    caller = (
        f"{function.__module__.split('.')[1]}.{function.__qualname__}"
        if ".plot." in function.__module__
        else function.__qualname__
    )
    open_ = any(parameter.kind == parameter.VAR_KEYWORD for parameter in known.values())

    @functools.wraps(function)
    def called(*args: P.args, **kwargs: P.kwargs) -> R:
        for word in kwargs:
            if word not in known and not open_:
                own = elsewhere or (_OF_AXES if caller.startswith("plot.") else {})
                advice = own.get(word) or nearest(word, known)
                raise ParameterError(f"{caller} has no argument {shown(word)}. {advice}")
        try:
            given = signature.bind(*args, **kwargs).arguments
        except TypeError as error:
            raise ParameterError(f"{caller}: {error}.") from None
        kinds.check(caller, given)
        return function(*args, **kwargs)

    return called
