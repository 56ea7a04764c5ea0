"""The tangent system: a system together with the derivative of its state with respect to the state
at the start.

Between contacts the derivative Y obeys the variational equations dY/dt = J(t, y) Y in the frozen
mode. At a contact where the force jumps, Y jumps too, by the saltation matrix
(codegen/saltation.py). Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical
Systems (2004), section 7.
"""

from __future__ import annotations

import functools
from dataclasses import replace

from saltus.language.expression import Expr, mul, state
from saltus.language.sums import total
from saltus.system.system import System


def first_column(system: System) -> range:
    """Indices of the states that hold the first column of Y; those of column j are j further on.
    Empty for a system without a tangent.

    All columns obey the same equations: they differ in which of its columns stands for Y, in
    nothing else.
    """
    size = len(system.tangent_of.states) if system.tangent_of else 0
    return range(size, size + size * size, size) if size else range(0)


def derivative_name(row: str, column: str) -> str:
    """Name of the state that holds d(row)/d(column at the start)."""
    return f"d{row}/d{column}(0)"


@functools.lru_cache(maxsize=256)
def tangent_system(system: System) -> System:
    """The system with D states extended to D + D*D: the states, then the rows of Y in turn; cached.

    Parameter values, guards and forcing are those of the system. Y starts as the identity; its
    units are those of its row over those of its column. Those of copies with other values are
    copies of one another too: nothing is compiled again.
    """
    if system.origin is not system:
        return tangent_system(system.origin).with_values(**system.values)
    names, rates, units = _extension(system.states, system.jacobian, tuple(system.units.items()))
    return replace(
        system,
        states=(*system.states, *names),
        field=(*system.field, *rates),
        units=dict(units),
        tangent_of=system,
    )


@functools.lru_cache(maxsize=256)
def tangent_states(
    system: System, names: tuple[str, ...] = (), directions: int | None = None
) -> System:
    """The tangent system with the equations of the D states only, for a flow that needs no others;
    cached. The derivatives with respect to some parameters are further columns of Y: zero at the
    start. Y times a number of directions has a column for each of these.
    """
    if system.origin is not system:
        return tangent_states(system.origin, names, directions).with_values(**system.values)
    along = system.states if directions is None else tuple(map(str, range(directions)))
    columns = (*(f"{name}(0)" for name in along), *names)
    more = tuple(f"d{row}/d{column}" for row in system.states for column in columns)
    return replace(
        system,
        states=(*system.states, *more),
        units={**system.units, **dict.fromkeys(more, "")},
        tangent_of=system,
        tangent_by=names,
    )


@functools.lru_cache(maxsize=256)
def _extension(
    states: tuple[str, ...],
    jacobian: tuple[tuple[Expr, ...], ...],
    units: tuple[tuple[str, str], ...],
) -> tuple[tuple[str, ...], tuple[Expr, ...], tuple[tuple[str, str], ...]]:
    """Names and rates of the entries of Y, and all units."""
    rows = [[state(derivative_name(a, b)) for b in states] for a in states]
    size = range(len(states))
    rates = tuple(
        total([mul(jacobian[i][k], rows[k][j]) for k in size if not _is_zero(jacobian[i][k])])
        for i in size
        for j in size
    )
    names = tuple(derivative_name(a, b) for a in states for b in states)
    return names, rates, (*units, *((name, "") for name in names))


def _is_zero(node: Expr) -> bool:
    return node.op == "const" and node.payload == 0
