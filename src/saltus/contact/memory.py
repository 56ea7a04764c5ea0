"""Contacts with a memory: play, Jenkins and Iwan elements. Each adds a state of its own.

All of them rest on one element, the *stop operator*: p follows the input x, and stays at its limit
while x pushes on::

    dp/dt = 0 where p >= limit and dx/dt > 0, or p <= -limit and dx/dt < 0, else dx/dt

A play is x - p, the force of a Jenkins element k*p. Visintin, Differential Models of Hysteresis
(1994), chapter III; Iwan, J. Appl. Mech. 33 (1966) 893-900. The rate of x is known when the whole
equation is: so the state is made while the equation is called, and its rate added behind it.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from contextlib import AbstractContextManager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

from saltus.contact.declared import gathered
from saltus.errors import TraceError, shown
from saltus.language import expression as ex
from saltus.language.canonical import ONE, Canonical
from saltus.language.derivatives import gradient, time_derivative
from saltus.language.expression import Condition, Expr, Operand, as_expr
from saltus.language.functions import piecewise
from saltus.language.names import why_no_name


@dataclass(frozen=True, eq=False)
class Element:
    """A stop operator: its state, its input and its limit."""

    name: str
    x: Expr
    limit: Expr


_MADE: ContextVar[list[Element] | None] = ContextVar("elements", default=None)


def elements() -> AbstractContextManager[list[Element]]:
    """Collect the elements that are made inside."""
    return gathered(_MADE)


def play(x: Operand, *, gap: Operand, name: str | None = None) -> Any:
    """A play, or backlash: the position of a part that x carries along through a clearance on both
    sides.

    The value rests while x moves inside the clearance, and goes with x where that pushes on.

    Parameters
    ----------
    x : Expr
        Place of the driving part, a function of the time and the states whose rate doesn't jump but
        by other elements.
    gap : Expr or float
        Clearance on either side [as x], > 0.
    name : str, optional
        Name of the state that the element brings, x minus the value: ``play``, ``play_2``, ... It
        joins the states of the system behind the equation's own. A start that doesn't give it is
        zero: the driving part begins in the middle of the clearance.

    Returns
    -------
    Expr
        Place of the driven part [as x].

    Raises
    ------
    TraceError
        If the gap is a number that isn't positive; outside an equation.

    References
    ----------
    Visintin, Differential Models of Hysteresis (1994), section III.2.

    Examples
    --------
    >>> import saltus as sl
    >>> @sl.system(states="x")
    ... def carried(t, x):
    ...     return 1.0 + 0.0 * sl.play(x, gap=0.25)
    >>> run = sl.simulate(carried, (0.0,), t_end=1.0)
    >>> float(run.end_x - run.end_play)
    0.75
    """
    x = as_expr(x)
    return ex.sub(x, _stop("play", x, as_expr(gap), name, "gap"))


def slider(x: Operand, *, stiffness: Operand, limit: Operand, name: str | None = None) -> Any:
    """The force of a Jenkins element: a spring and a dry slider in series.

    Parameters
    ----------
    x : Expr
        Relative displacement of its ends [m, or rad], as :func:`play` takes it.
    stiffness : Expr or float
        Of the spring [N/m, or N*m/rad], > 0.
    limit : Expr or float
        Force at which it slides [N, or N*m], > 0.
    name : str, optional
        Name of the state that it brings, the deflection of its spring: ``slider``, ``slider_2``,
        ... A start that doesn't give it is zero: unloaded.

    Returns
    -------
    Expr
        The force, with the sign of a displacement from where it is unloaded: it stands with a minus
        in the equation of motion.

    Raises
    ------
    TraceError
        If a number isn't positive; outside an equation.

    References
    ----------
    Jenkins, Steel 14 (1922); Iwan, J. Appl. Mech. 33 (1966) 893-900.

    Examples
    --------
    >>> import saltus as sl
    >>> @sl.system(states="x v")
    ... def joint(t, x, v):
    ...     return v, 1.5 * sl.cos(0.9 * t) - 0.2 * x - sl.slider(x, stiffness=2.0, limit=1.0)
    >>> run = sl.simulate(joint, (0.0, 0.0), t_end=2.0)
    >>> bool(abs(run.end_slider) <= 0.5)
    True
    """
    k, most = as_expr(stiffness), as_expr(limit)
    _check_positive("slider", "stiffness", k)
    _check_positive("slider", "limit", most)
    return ex.mul(k, _stop("slider", as_expr(x), ex.div(most, k), name, "limit"))


def iwan(
    x: Operand,
    *,
    stiffnesses: Sequence[Operand],
    limits: Sequence[Operand],
    name: str | None = None,
) -> Any:
    """The force of an Iwan (Masing) model: Jenkins elements in parallel.

    Parameters
    ----------
    x : Expr
        Relative displacement of its ends, as :func:`play` takes it.
    stiffnesses, limits : sequence of Expr or float
        Of each element, as :func:`slider` takes them.
    name : str, optional
        Prefix of the names of the states: ``iwan``; each has its number behind it.

    Returns
    -------
    Expr
        The sum of their forces.

    Raises
    ------
    TraceError
        If the sequences are empty or of different lengths; as :func:`slider`.

    References
    ----------
    Iwan, J. Appl. Mech. 33 (1966) 893-900; Segalman, J. Appl. Mech. 72 (2005) 752-760.

    Examples
    --------
    >>> import saltus as sl
    >>> @sl.system(states="x force")
    ... def pulled(t, x, force):
    ...     return 1.0, sl.iwan(x, stiffnesses=[2.0, 1.0], limits=[1.0, 0.75])
    >>> run = sl.simulate(pulled, (0.0, 0.0), t_end=1.0)
    >>> float(run.end_iwan_1), float(run.end_iwan_2)
    (0.5, 0.75)
    """
    for what, given in (("stiffnesses", stiffnesses), ("limits", limits)):
        if isinstance(given, str) or not hasattr(given, "__len__"):
            raise TraceError(f"sl.iwan: {what} is a list, one for each element, not {given!r}.")
    if not len(stiffnesses) or len(stiffnesses) != len(limits):
        raise TraceError(
            f"sl.iwan has {len(stiffnesses)} stiffnesses and {len(limits)} limits. Give one of "
            "each for every element."
        )
    force: Expr = ex.constant(0.0)
    for number, (k, limit) in enumerate(zip(stiffnesses, limits, strict=True), 1):
        own = f"{name or 'iwan'}_{number}" if name or not _taken(f"iwan_{number}") else None
        force = ex.add(force, slider(x, stiffness=k, limit=limit, name=own))
    return force


def _taken(name: str) -> bool:
    return any(one.name == name for one in _MADE.get() or ())


def _check_positive(law: str, what: str, value: Expr) -> None:
    """Raise a TraceError for a number that isn't positive."""
    if value.op == "const" and not value.payload > 0:
        raise TraceError(lambda say: f"{say.sl}{law}: {what} = {value.payload:g} must be positive.")


def _stop(law: str, x: Expr, limit: Expr, name: str | None, what: str) -> Expr:
    """A new stop operator; its state."""
    made = _MADE.get()
    if made is None:
        raise TraceError(
            lambda say: (
                f"{say.sl}{law} brings a state of its own, which only an equation of motion can "
                f"have: write it inside the function under {say.system()}."
            )
        )
    _check_positive(law, what, limit)
    if ex.depends_on(x, ("table",)):
        raise TraceError(
            lambda say: (
                f"{say.sl}{law}: a record or table drives it, and where that turns isn't known "
                "beforehand. Let it drive a mass, and give the element the place of the mass."
            )
        )
    if name is None:
        numbered = (law if i == 1 else f"{law}_{i}" for i in itertools.count(1))
        name = next(one for one in numbered if not _taken(one))
    elif why_no_name(name) is not None:
        raise TraceError(lambda say: f"{say.sl}{law}: {shown(name)} can't be the name of a state.")
    elif _taken(name):
        raise TraceError(
            lambda say: (
                f"{say.sl}{law}: two elements are called {shown(name)}. Give each its own name=."
            )
        )
    made.append(Element(name, x, limit))
    return ex.state(name)


def rates_of(
    made: Sequence[Element], states: Sequence[str], rates: Sequence[Expr]
) -> dict[str, Expr]:
    """The rate of each element's state, from the rates of the equation's own states."""
    known = dict(zip(states, rates, strict=True))
    all_states = [*states, *(element.name for element in made)]
    for element in made:
        total = time_derivative(element.x)
        for name, slope in zip(all_states, gradient(element.x, all_states), strict=True):
            if slope.op == "const" and slope.payload == 0:
                continue
            if name not in known:
                raise TraceError(f"the element {element.name!r} moves what moves it.")
            total = ex.add(total, ex.mul(slope, known[name]))
        p, limit = ex.state(element.name), element.limit
        pushes = _either(
            _both(p >= limit, _is_positive(total)), _both(p <= -limit, _is_positive(ex.neg(total)))
        )
        known[element.name] = piecewise((0.0, pushes), otherwise=total)
    return {element.name: known[element.name] for element in made}


def _both(a: Condition, b: Condition | bool) -> Condition | bool:
    return (a if b else False) if isinstance(b, bool) else a & b


def _either(a: Condition | bool, b: Condition | bool) -> Condition | bool:
    if isinstance(a, bool):
        return a or b
    return (b or a) if isinstance(b, bool) else a | b


def _is_positive(rate: Expr) -> Condition | bool:
    """The condition that a rate is positive; for a rate with pieces, piece by piece."""
    for node in ex.walk(rate):
        if node.op == "select":
            yes, no = (_is_positive(ex.substituted(rate, {node: one})) for one in node.args)
            holds: Condition = node.payload
            return _either(_both(holds, yes), _both(~holds, no))
    polynomial = Canonical().polynomial(rate)
    if polynomial.keys() <= {ONE}:
        return polynomial.get(ONE, 0.0) > 0
    return rate > 0
