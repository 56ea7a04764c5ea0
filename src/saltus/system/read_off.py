"""A user's function of time, states and parameters, traced for a system: an output, a surface, a
power.

It is traced as an equation is. Comparisons in it that mean a guard of the system read that guard's
side; others become guards of their own, behind those of the system. The sign of friction that
sticks is the one that holds it.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from typing import Any

from saltus.contact.boundaries import join_guards
from saltus.contact.guards import Guard, bits_in
from saltus.contact.singular import lifted
from saltus.contact.surfaces import with_held_signs
from saltus.errors import MOST_IN_A_ROW, TraceError, nearest, shown
from saltus.language.expression import TIME, Expr, as_expr, parameter, state
from saltus.system.equations_of_motion import EquationsOfMotion
from saltus.system.explained import explained, place
from saltus.system.named_outputs import NamedOutputs

#: A function of (t, states, parameters), each argument by its name.
Quantity = Callable[..., Any]


def quantity(
    system: EquationsOfMotion,
    function: Quantity,
    what: str = "a quantity",
    outputs: NamedOutputs | None = None,
) -> tuple[Expr, tuple[Guard, ...]]:
    """Trace a function of time, states and parameters of a system.

    Parameters
    ----------
    system : System
        Whose states and parameters the arguments are.
    function : callable
        Its arguments are found by name: ``t`` (the time), states, parameters, as many as it needs,
        in any order, and the outputs that the system has; ``*q`` takes the states ``q1``, ``q2``,
        ..., or all states where none is called so; ``**rest`` takes all other parameters. So the
        signature of the equation itself will do. Default values aren't used. It returns one number.
    what : str
        Words for the function in messages: ``"the surface"``.
    outputs : NamedOutputs, optional
        Outputs behind whose guards those of the function stand; default those of the system, where
        the function asks for one that has boundaries of its own.

    Returns
    -------
    Expr, tuple of Guard
        The expression, with bits in its conditions; the guards that these number: those of the
        system, then new ones.

    Raises
    ------
    TraceError
        If an argument is neither time, state nor parameter, or the function can't be traced.
    """
    returned = called(system, function, what, outputs)
    title = f"{what} of {system.name}"
    try:
        expression = as_expr(returned)
    except Exception as error:
        raise TraceError(*explained(error, function, title)) from error
    try:
        return joined(expression, system, outputs)
    except TraceError as error:
        raise TraceError(f"{title} ({place(function)}): ", error) from error


def joined(
    expression: Expr, system: EquationsOfMotion, outputs: NamedOutputs | None = None
) -> tuple[Expr, tuple[Guard, ...]]:
    """An expression that joins a system, with bits in its conditions, and the guards that these
    number: those of the system, then new ones. Raises TraceError as :func:`join_guards` does.
    """
    known = system.guards
    if outputs is not None or bits_in([expression]) - set(range(len(known))):
        known = (system.outputs if outputs is None else outputs).behind(known)[1]
    (root,), guards = join_guards([expression], known)
    (root,) = lifted([root], guards)
    return with_held_signs(root, guards, system.states), guards


def called(
    system: EquationsOfMotion,
    function: Quantity,
    what: str,
    outputs: NamedOutputs | None = None,
) -> Any:
    """The result of a user's function of time, states and parameters for symbols. Raises as
    :func:`quantity` does.
    """
    if not callable(function) or isinstance(function, EquationsOfMotion):
        names = ", ".join(("t", *_own_states(system)[:MOST_IN_A_ROW]))
        raise TraceError(
            f"{what} must be a function such as `lambda {names}: ...`, not {shown(function)}. "
            f"Parameters are further arguments, by name."
        )
    title = f"{what} of {system.name}"
    positional, named = _arguments(system, function, title, outputs or system.outputs)
    try:
        returned = function(*positional, **named)
        if returned is None:
            raise TraceError("it returns nothing. End it with: return ...")
    except Exception as error:
        if isinstance(error, ValueError) and (row := _row(function, _own_states(system))):
            raise TraceError(f"{title} ({place(function)}): {error}. {row}") from error
        raise TraceError(*explained(error, function, title)) from error
    return returned


def _row(function: Quantity, states: Sequence[str]) -> str:
    """A sentence on the values that ``*q`` takes, for a row of another length."""
    for argument in inspect.signature(function).parameters.values():
        if argument.kind == argument.VAR_POSITIONAL:
            taken = _numbered(argument.name, states) or states
            return (
                f"*{argument.name} stands for {len(taken)} values, {taken[0]} to {taken[-1]}: a "
                f"row has a number for each."
            )
    return ""


def _own_states(system: EquationsOfMotion) -> tuple[str, ...]:
    """The states that a user knows: those of a tangent aren't named in functions."""
    return (system.tangent_of or system).states


def _numbered(name: str, states: Sequence[str]) -> list[str]:
    """The states called as ``*name``: of ``q`` q1, q2, ..., of ``q_rate`` q1_rate, q2_rate, ..."""
    stem, line, end = name.partition("_")
    return [
        one
        for one in states
        if one.startswith(stem)
        and one.endswith(line + end)
        and one[len(stem) : len(one) - len(line + end)].isdecimal()
    ]


def _arguments(
    system: EquationsOfMotion, function: Quantity, title: str, outputs: NamedOutputs
) -> tuple[list[Expr], dict[str, Expr]]:
    """Symbols for the arguments of a function, by name."""
    states = _own_states(system)
    known = {
        "t": TIME,
        **dict(zip(outputs.names, outputs.behind(system.guards)[0], strict=True)),
        **{name: parameter(name) for name in system.values},
        **{name: state(name) for name in states},
    }
    try:
        arguments = list(inspect.signature(function).parameters.values())
    except ValueError:  # of a class or function of C
        raise TraceError(
            f"{title}: Python doesn't know the arguments of {function!r:.80}. Write a "
            f"function of names, such as x."
        ) from None
    plain = [a.name for a in arguments if a.kind in (a.POSITIONAL_ONLY, a.POSITIONAL_OR_KEYWORD)]
    if tuple(plain[1:]) == states:
        known[plain[0]] = TIME  # written as an equation: its first argument is the time
    positional: list[Expr] = []
    named: dict[str, Expr] = {}
    for argument in arguments:
        if argument.kind == argument.VAR_KEYWORD:
            rest = set(system.values) - {a.name for a in arguments}
            named.update((name, known[name]) for name in system.values if name in rest)
        elif argument.kind == argument.VAR_POSITIONAL:
            positional += [state(name) for name in _numbered(argument.name, states) or states]
        elif argument.name not in known:
            raise TraceError(
                f"{title} ({place(function)}) asks for {argument.name!r}, which is neither t nor a "
                f"state or parameter of {system.name}. "
                f"{nearest(argument.name, known)} Constants of its own belong in its body."
            )
        elif argument.kind == argument.KEYWORD_ONLY:
            named[argument.name] = known[argument.name]
        else:
            positional.append(known[argument.name])
    return positional, named
