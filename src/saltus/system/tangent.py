"""The tangent system: a system together with the derivative of its state with respect to the state at the start.

Between contacts the derivative Y obeys the variational equations dY/dt = J(t, y) Y in the frozen mode. At a contact where the force jumps, Y
jumps too, by the saltation matrix (codegen/saltation.py). Leine & Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems
(2004), section 7.
"""

from __future__ import annotations

import functools
from dataclasses import replace

from saltus.system import expression as ex
from saltus.system.expression import Expr
from saltus.system.system import System


def derivative_name(state: str, start: str) -> str:
    """Name of the state that holds d(state)/d(start of another state)."""
    return f"d{state}/d{start}(0)"


@functools.lru_cache(maxsize=64)
def tangent_system(system: System) -> System:
    """The system with D states extended to D + D*D: the states, then the rows of Y one after the other.

    Parameter values, guards and forcing are those of the system. Y is dimensionless up to the ratio of the units of its row and column.
    """
    size = len(system.states)
    rows = [[ex.state(derivative_name(a, b)) for b in system.states] for a in system.states]
    rates = [
        _sum([ex.mul(system.jacobian[i][k], rows[k][j]) for k in range(size) if not _is_zero(system.jacobian[i][k])])
        for i in range(size)
        for j in range(size)
    ]
    names = tuple(derivative_name(a, b) for a in system.states for b in system.states)
    return replace(
        system,
        states=(*system.states, *names),
        field=(*system.field, *rates),
        units={**system.units, **dict.fromkeys(names, "")},
    )


def _is_zero(node: Expr) -> bool:
    return node.op == "const" and node.payload == 0


def _sum(terms: list[Expr]) -> Expr:
    total = ex.constant(0.0)
    for term in terms:
        total = ex.add(total, term)
    return total
