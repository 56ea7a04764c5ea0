"""Tracing: the user's function is called with symbols, and its operations are recorded. It is
called twice, because an equation gives the same both times.

Whatever goes wrong inside the function becomes a TraceError that names its file and line and says
what to write instead.
"""

from __future__ import annotations

import functools
import inspect
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import zip_longest
from typing import Any, ParamSpec, TypeVar

import numpy as np

from saltus.announce import working
from saltus.contact.contacts import find_contacts
from saltus.contact.declared import Declared, check_law, declarations
from saltus.contact.guards import expressions_of
from saltus.contact.memory import Element, elements, rates_of
from saltus.errors import (
    ParameterError,
    TraceError,
    UnitError,
    UnusedParameterWarning,
    nearest,
    shown,
)
from saltus.language.dimensions import DimensionCheck
from saltus.language.expression import TIME, Expr, as_expr, observed, parameter, state, walk
from saltus.language.names import why_no_name, why_no_text, why_no_title, why_not_together
from saltus.sentences import Given
from saltus.system import checks
from saltus.system.explained import explained, place
from saltus.system.formula import Equations, Formula
from saltus.system.guard_names import with_guard_names
from saltus.system.system import System
from saltus.units import check_declared, coherent_unit

P = ParamSpec("P")
R = TypeVar("R")


def _known_words(function: Callable[P, R]) -> Callable[P, R]:
    """Answer unknown arguments of :func:`system` by the known ones."""
    known = inspect.signature(function).parameters
    elsewhere = dict.fromkeys(("forcing", "forced", "drive", "frequency", "period"), "forced_at")
    values = ("params", "parameters", "pars", "args", "values", "constants", "p")

    @functools.wraps(function)
    def called(*args: P.args, **kwargs: P.kwargs) -> R:
        for word in kwargs:
            if word not in known:
                there = elsewhere.get(word)
                advice = (
                    (
                        f"Write {there}=, the name of the parameter with the forcing frequency: "
                        f'{there}="frequency".'
                    )
                    if there
                    else (
                        "Parameters stand after a * in the function, with their values: "
                        'def rig(t, x, v, *, mass="3 kg"): ...'
                        if word in values
                        else ""
                    )
                )
                raise TraceError(
                    f"sl.system has no argument {word!r}. {advice or nearest(word, known)}"
                )
        return function(*args, **kwargs)

    return called


@_known_words
def system(
    states: str | Sequence[str] = "",
    *,
    forced_at: str | None = None,
    units: Mapping[str, str] | None = None,
    guards: Mapping[str, Callable[..., Any]] | None = None,
    name: str | None = None,
    source: str = "",
    check_units: bool = True,
    outputs: Mapping[str, Any] | None = None,
) -> Callable[[Callable[..., Any]], System]:
    """Decorator that turns an equation of motion into a :class:`System`.

    The function takes the time, the states, and after a ``*`` the parameters with their default
    values; it returns the time derivative of each state. Where the states are many, ``*y`` after
    the time takes them all, in their order. The function is called with symbols, not with numbers,
    and twice, to see that it gives the same. Comparisons inside :func:`piecewise` become the
    contacts.

    Parameters
    ----------
    states : str or sequence of str
        Names of the states: ``"x v"``.
    forced_at : str, optional
        The parameter that holds the forcing frequency. It is in Hz (T = 1/f) unless its default,
        such as ``"94.2 rad/s"``, or ``units`` says ``rad/s``. The equations must repeat after T.
        Leave out for a system without a period.
    units : mapping of str to str, optional
        Coherent SI unit of states and parameters: ``{"x": "m", "mass": "kg", "damping_ratio":
        "1"}``. The unit of a parameter whose default is text (``mass="3 kg"``) is known already.
    guards : mapping of str to callable, optional
        Names for guards, each with its comparison, as a function of states and parameters by name:
        ``{"teeth": lambda x1, x2, gap: x2 - x1 > gap}``. A guard without one is named after the
        parameter that sets it, or by its equation.
    name : str, optional
        Name of the system; default: that of the function.
    source : str, optional
        Publication of the equations.
    check_units : bool, optional
        Whether to check known units: terms of a sum or comparison have one unit, and each rate has
        that of its state per second. False for equations whose numbers have units of their own.
    outputs : mapping of str to callable, or to (callable, unit), optional
        Named functions of the motion, such as a sensor or a force, which every result holds besides
        the states: ``{"spring force": (lambda x, k: k * x, "N")}``; as of
        :meth:`saltus.System.with_outputs`.

    Returns
    -------
    decorator
        Gives a System in place of the function. The function's docstring becomes its description.

    Raises
    ------
    TraceError
        If the function can't be traced; the message names file and line.
    ParameterError, UnitError
        If a default value is out of range or a unit is wrong, or terms of different units are
        added.

    Examples
    --------
    >>> from saltus.language import cos, pi, piecewise
    >>> @system(states="x v", forced_at="frequency", units={"x": "m", "v": "m/s"})
    ... def rig(
    ...     t, x, v, *, mass="3 kg", stiffness="14 kN/m", gap="0.4 mm", force="4 N",
    ...     frequency="15 Hz",
    ... ):
    ...     contact = piecewise((stiffness * (x - gap), x > gap), otherwise=0)
    ...     return v, (force * cos(2 * pi * frequency * t) - contact) / mass
    >>> rig.guards[0].name, rig.values["gap"], rig.units["stiffness"]
    ('gap', 0.0004, 'N/m')
    """
    if callable(states):
        raise TraceError(
            'write @sl.system(states="x v"), with the names of the states, not bare @sl.system.'
        )
    if not isinstance(states, str | list | tuple):
        raise TraceError(f'states must be names, such as states="x v", not {shown(states)}.')
    names = tuple(states.replace(",", " ").split()) if isinstance(states, str) else tuple(states)

    _check_arguments(units, guards, forced_at, name, check_units)

    def decorate(function: Callable[..., Any]) -> System:
        if not callable(function):
            raise TraceError(
                f"@sl.system stands above a function, def rig(t, {', '.join(map(str, names))}, *, "
                f"...), not {shown(function)}."
            )
        title, description = (
            name or getattr(function, "__name__", "system").strip("<>"),
            inspect.getdoc(function) or "",
        )
        for what, text, why in (
            ("name", title, why_no_title),
            ("source", source, why_no_text),
            ("docstring", description, why_no_text),
        ):
            if why(text) is not None:
                raise TraceError(f"the {what} of a system can't be {shown(text)}: {why(text)}.")
        defaults = _parameters(function, names, title)
        known_units = _units(names, defaults, forced_at, dict(units or {}), title)
        if forced_at is not None and known_units[forced_at] not in ("Hz", "rad/s"):
            raise UnitError(
                f"{title}: forced_at={shown(forced_at)} is in {known_units[forced_at]!r}, but a "
                f"forcing frequency is in 'Hz' or 'rad/s'."
            )
        values = {
            key: checks.resolve_one(key, value, known_units[key], forced_at)
            for key, value in defaults.items()
        }
        with working(lambda: f"tracing {title}"):
            dimensions = DimensionCheck(names, known_units) if check_units else None
            field, found, remembered = _traced(
                function, names, tuple(defaults), title, dimensions, known_units
            )
            _warn_of_unused(field, found, defaults, forced_at, title)
            made = System(
                name=title,
                states=(*names, *remembered),
                field=field,
                guards=found,
                values=values,
                units={**known_units, **remembered},
                forced_at=forced_at,
                source=source,
                description=description,
                made=len(remembered),
            )
            made = with_guard_names(made, guards) if guards else made
            return made.with_outputs(outputs) if outputs is not None else made

    return decorate


def _check_arguments(units: Any, guards: Any, forced_at: Any, name: Any, check_units: Any) -> None:
    """Raise a TraceError for an argument of :func:`system` of a wrong kind."""
    if units is not None and not isinstance(units, Mapping):
        raise TraceError(
            f'units must be a mapping of names to units, such as units={{"x": "m"}}, '
            f"not {shown(units)}."
        )
    if guards is not None and not isinstance(guards, Mapping):
        raise TraceError(
            f'guards must be a mapping of names to comparisons, such as guards={{"stop": lambda x, '
            f"gap: x > gap}}, not {shown(guards)}."
        )
    if forced_at is not None and not isinstance(forced_at, str):
        raise TraceError(
            f"forced_at must be the name of a parameter, such as "
            f'forced_at="frequency", not {shown(forced_at)}.'
        )
    if not isinstance(check_units, bool | np.bool_):
        raise TraceError(f"check_units must be True or False, not {shown(check_units)}.")
    if name is not None and not isinstance(name, str):
        raise TraceError(f"the name of a system can't be {shown(name)}: {why_no_title(name)}.")


# -- the signature ---------------------------------------------------------------------------------
def _parameters(
    function: Callable[..., Any], states: tuple[str, ...], title: str
) -> dict[str, Any]:
    """Names and defaults of the parameters; checks the signature."""
    _check_states(states, title)
    wanted = f"def {title}(t, {', '.join(states)}, *, ...)"
    positional: list[inspect.Parameter] = []
    parameters: dict[str, Any] = {}
    together = False
    try:
        signature = inspect.signature(function)
    except ValueError:  # of a class or function of C
        raise TraceError(
            f"{title}: Python doesn't know the arguments of {shown(function)}. Write "
            f"a function, {wanted}."
        ) from None
    for argument in signature.parameters.values():
        if argument.kind == argument.VAR_POSITIONAL and len(positional) == 1:
            together = True
        elif argument.kind in (argument.VAR_POSITIONAL, argument.VAR_KEYWORD):
            raise TraceError(
                f"{title}: name every parameter; *{argument.name} can't be traced. Write {wanted}."
            )
        elif argument.kind != argument.KEYWORD_ONLY:
            positional.append(argument)
        elif argument.default is argument.empty:
            raise TraceError(
                f"{title}: parameter {argument.name!r} has no default. Give it a value: "
                f"{argument.name}=1.0, or text with a unit."
            )
        elif (why := why_no_name(argument.name)) is not None:
            raise TraceError(f"{title}: {argument.name!r} can't be the name of a parameter: {why}.")
        else:
            parameters[argument.name] = argument.default
    names = [argument.name for argument in positional]
    if names[1:] == list(states) or together:
        return parameters
    if names[: len(states)] == list(states):
        raise TraceError(
            f"{title}: the time is the first argument, before the states. Write {wanted}."
        )
    if names[1 : len(states) + 1] == list(states):
        raise TraceError(
            f"{title}: put a * between the states and the parameters, so that "
            f"parameters are given by name. Write {wanted}."
        )
    vector = len(names) == 2 and len(states) > 1
    raise TraceError(
        f"{title}: states={' '.join(states)!r}, but the function takes "
        f"({', '.join(names)}). Write {wanted}"
        f"{f', or def {title}(t, *{names[1]}, ...) for all states in a row' if vector else ''}."
    )


def _check_states(states: tuple[str, ...], title: str) -> None:
    if not states:
        raise TraceError(f'{title}: states="" names no state. Write states="x v".')
    for name in states:
        if (why := why_no_name(name)) is not None:
            raise TraceError(f"{title}: {name!r} can't be the name of a state: {why}.")
    if (why := why_not_together(states)) is not None:
        raise TraceError(f"{title}: states={' '.join(states)!r}: {why}.")


def _units(
    states: tuple[str, ...],
    defaults: Mapping[str, Any],
    forced_at: str | None,
    declared: dict[str, str],
    title: str,
) -> dict[str, str]:
    """Unit of every state and parameter."""
    for name in declared:
        if name not in states and name not in defaults:
            raise ParameterError(
                f"{title}: ",
                lambda say: say.key("units"),
                f" names {shown(name)}, which is neither a state nor a parameter. "
                f"{nearest(name, (*states, *defaults))}",
            )
    if forced_at is not None and forced_at not in defaults:
        raise ParameterError(
            lambda say: (
                f"{title}: {say.key(forced_at=Given(forced_at))} is no parameter. "
                f"{nearest(forced_at, defaults)}"
            )
        )
    units = {}
    for name in (*states, *defaults):
        if name in declared:
            units[name] = check_declared(declared[name], name)
        elif name == forced_at:
            units[name] = "rad/s" if _is_angular(defaults[name], name) else "Hz"
        else:
            default = defaults.get(name)
            units[name] = coherent_unit(default, name) if isinstance(default, str) else ""
    return units


def _is_angular(default: Any, name: str) -> bool:
    """True if a forcing frequency is written in radians, as ``"94.2 rad/s"``; turns and rpm are
    counted in Hz.
    """
    return isinstance(default, str) and "rad" in default and coherent_unit(default, name) == "rad/s"


# -- the call --------------------------------------------------------------------------------------
def _traced(
    function: Callable[..., Any],
    states: tuple[str, ...],
    parameters: tuple[str, ...],
    title: str,
    dimensions: DimensionCheck | None,
    units: Mapping[str, str],
) -> tuple[Any, Any, dict[str, str]]:
    """Field and guards; states added by elements with a memory, with their units."""
    try:
        with observed(dimensions), declarations() as made, elements() as remembered:
            derivatives, laws = _called(function, states, parameters)
        _check_returned(made, laws)
        _check_elements(remembered, (*states, *parameters))
        if not isinstance(function, Formula | Equations):
            with observed(None), declarations(), elements():
                _check_same((derivatives, laws), _called(function, states, parameters))
        if dimensions is not None:
            dimensions.check_rates(derivatives)
            for law in laws:
                check_law(law, dimensions)
        derivatives += rates_of(remembered, states, derivatives).values()
    except Exception as error:
        kind = UnitError if isinstance(error, UnitError) else TraceError
        raise kind(*explained(error, function, title)) from error
    own = {one.name: _unit_of(one.x, states, units, dimensions) for one in remembered}
    try:
        return *find_contacts(derivatives, laws, (*states, *own), {**units, **own}), own
    except TraceError as error:
        raise TraceError(f"{title} ({place(function)}): ", error) from error


def _unit_of(
    x: Expr, states: Sequence[str], units: Mapping[str, str], dimensions: DimensionCheck | None
) -> str:
    """Unit of the input of an element; of a system without units that of all its states."""
    if x.op == "state" and x.payload in units:
        return units[x.payload]
    plain = "1" if all(units[name] == "1" for name in states) else ""
    return (dimensions.declared(x) if dimensions is not None else "") or plain


def _check_elements(made: Sequence[Element], known: Sequence[str]) -> None:
    """Raise a TraceError for the state of an element that has the name of another state, or of a
    parameter.
    """
    for one in made:
        if one.name in known:
            raise TraceError(
                f"an element with a memory would bring a state {one.name!r}, and there is one of "
                f"this name, or a parameter. Give the element another: name='...'."
            )


def _called(
    function: Callable[..., Any], states: tuple[str, ...], parameters: tuple[str, ...]
) -> tuple[list[Expr], list[Declared]]:
    """The result of the function called with symbols."""
    returned = function(TIME, *map(state, states), **{name: parameter(name) for name in parameters})
    return _as_derivatives(returned, states)


def _check_same(
    first: tuple[list[Expr], list[Declared]], second: tuple[list[Expr], list[Declared]]
) -> None:
    """Raise a TraceError unless two calls gave the same equation."""
    first_nodes, second_nodes = (
        [
            (node.op, None if node.op == "select" else node.payload)
            for node in walk(*rates, *(root for law in laws for root in law.roots()))
        ]
        for rates, laws in (first, second)
    )
    for a, b in zip_longest(first_nodes, second_nodes):
        if a == b:
            continue
        plain = a is not None and b is not None and a[0] == b[0] == "const"
        what = f": it holds {a[1]:.6g}, then {b[1]:.6g}" if plain else ""
        raise TraceError(
            f"the function gives another equation each time it is called{what}. Random numbers, "
            f"the clock and counters would be frozen at one value. Of noise draw the numbers once, "
            f"outside: noise = sl.recorded(times, values), and in the equation noise(t)."
        )


def _warn_of_unused(
    field: Any, guards: Any, parameters: Iterable[str], forced_at: str | None, title: str
) -> None:
    """Warn of parameters on which nothing depends: a name forgotten in the equation."""
    used = {
        node.payload for node in walk(*field, *expressions_of(guards)) if node.op == "param"
    } | {forced_at}
    if unused := [name for name in parameters if name not in used]:
        one = len(unused) == 1
        warnings.warn(
            f"{title}: {', '.join(unused)} {'is' if one else 'are'} declared but the equations "
            f"don't use {'it' if one else 'them'}: "
            f"another value changes nothing. Use {'it' if one else 'them'}, or leave "
            f"{'it' if one else 'them'} out.",
            UnusedParameterWarning,
            stacklevel=3,
        )


def _as_derivatives(returned: Any, states: tuple[str, ...]) -> tuple[list[Expr], list[Declared]]:
    """The function's result as one expression per state, and the laws behind them."""
    if returned is None:
        raise TraceError(
            "it returns nothing. End it with: return " + ", ".join(f"d{name}/dt" for name in states)
        )
    if isinstance(returned, Expr | int | float | Declared):
        returned = (returned,)
    if isinstance(returned, Mapping):
        raise TraceError(
            "it returns a mapping. Return the time derivatives in the order of the states: return "
            + ", ".join(f"d{name}/dt" for name in states)
        )
    try:
        returned = list(returned)
        last = max(
            (i for i, one in enumerate(returned) if not isinstance(one, Declared)), default=-1
        )
        for one in returned[:last]:
            if isinstance(one, Declared):
                raise TraceError(
                    f"it returns {one!r} before a rate. Laws of contacts follow the rates of all "
                    f"states: return "
                    f"{', '.join(f'd{name}/dt' for name in states)}, {one.name}(...)."
                )
        derivatives = [as_expr(value) for value in returned[: last + 1]]
    except TypeError:
        raise TraceError(
            f"it returns {shown(returned)} in place of the time derivatives of {', '.join(states)}."
        ) from None
    if len(derivatives) != len(states):
        raise TraceError(
            f"it returns {len(derivatives)} value{'s' * (len(derivatives) != 1)}, but there are "
            f"{len(states)} states "
            f"({', '.join(states)}): one time derivative for each, in this order."
        )
    return derivatives, returned[last + 1 :]


def _check_returned(made: Sequence[Declared], laws: Sequence[Declared]) -> None:
    """Raise a TraceError for a law that was written but isn't returned."""
    for law in made:
        if not any(law is one for one in laws):
            raise TraceError(
                f"{law!r} isn't returned, so it would do nothing. Return it after the rates: "
                f"return v, force/mass, {law.name}(...)."
            )
