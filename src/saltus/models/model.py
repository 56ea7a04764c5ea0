"""The decorator of published models: an equation with units, a source and, if the publication has
them, named cases.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from saltus.errors import ParameterError, among, shown, unknown
from saltus.system import System, system

#: Docstring section on the arguments of every model; ``{example}`` is one of its own parameters.
_CALL = """Parameters
----------
{case}**values
    Parameter values: numbers in SI, or text with units such as ``{example}``.

Returns
-------
System

Raises
------
ParameterError, UnitError
    If a name is unknown or a value is wrong.

"""


def model(
    *,
    states: Mapping[str, str],
    source: str,
    forced_at: str | None = None,
    cases: Mapping[str, Mapping[str, Any]] | None = None,
    case: str = "",
) -> Callable[[Callable[..., Any]], Callable[..., System]]:
    """Decorator that turns an equation into a model: a function that takes values by name and
    returns a System.

    The equation is that of :func:`saltus.system`; a default that is a number has the unit 1. It is
    traced when the model is first asked for. The docstring becomes the model's, with what all
    models say about their arguments put in before its Notes.

    Parameters
    ----------
    states : mapping of str to str
        States and their units.
    source : str
        The publication of the equation and its values.
    forced_at : str, optional
        The parameter that holds the forcing frequency.
    cases : mapping, optional
        Values of some parameters that have a name in the publication; the model then takes ``case``
        first. Its docstring says what they are, under Parameters.
    case : str
        The case that is taken if none is named.
    """

    def decorate(equation: Callable[..., Any]) -> Callable[..., System]:
        name, parameters = equation.__name__, inspect.signature(equation).parameters.values()
        defaults = {one.name: one.default for one in parameters if one.kind is one.KEYWORD_ONLY}
        plain = {key: "1" for key, value in defaults.items() if not isinstance(value, str)}
        text = inspect.getdoc(equation) or ""

        @functools.cache
        def traced() -> System:
            made = system(
                tuple(states),
                forced_at=forced_at,
                units={**states, **plain},
                name=name,
                source=source,
            )(equation)
            return replace(made, description=text.partition("\n")[0])

        def called(*given: Any, **values: Any) -> System:
            positional = [
                *given,
                *([values.pop("case")] if cases and not given and "case" in values else []),
            ]
            if len(positional) > bool(cases):
                raise ParameterError(
                    _no_name(name, positional[bool(cases)], list(defaults), bool(cases))
                )
            chosen = positional[0] if positional else case
            if cases and not among(chosen, cases):
                raise unknown(f"{name} has no case", chosen, cases)
            return traced().with_values(**{**(cases[chosen] if cases else {}), **values})

        named = (
            [
                inspect.Parameter(
                    "case", inspect.Parameter.POSITIONAL_OR_KEYWORD, default=case, annotation="str"
                )
            ]
            if cases
            else []
        )
        signature = inspect.Signature(
            [*named, inspect.Parameter("values", inspect.Parameter.VAR_KEYWORD, annotation="Any")]
        )
        called.__name__ = called.__qualname__ = name
        called.__module__, called.__doc__ = (
            equation.__module__,
            _documented(text, next(iter(defaults.items()))),
        )
        called.__signature__ = signature.replace(return_annotation="System")  # type: ignore[attr-defined]
        return called

    return decorate


def _no_name(name: str, given: Any, parameters: list[str], cases: bool) -> str:
    """The message for a value without a name."""
    takes = "a case and values by name" if cases else "values by name"
    known = ", ".join(parameters)
    return (
        f"{name} takes {takes}, and {shown(given)} has no name. Write "
        f"{name}({parameters[0]}=...); its parameters are {known}."
    )


def _documented(text: str, first: tuple[str, Any]) -> str:
    """A model's docstring: the section on the arguments is inserted before the Notes, after the
    model's text about its cases.
    """
    before, notes, rest = text.partition("Notes\n-----\n")
    head, parameters, own = before.partition("Parameters\n----------\n")
    example = f'{first[0]}="{first[1]}"' if isinstance(first[1], str) else f"{first[0]}={first[1]}"
    return (
        head
        + _CALL.format(case=f"{own.strip()}\n" if parameters else "", example=example)
        + notes
        + rest
    )
