"""The forces of contacts that stand in the equations."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from saltus.contact.reduction import free_field
from saltus.language import units_of
from saltus.language.expression import Expr, mul, walk
from saltus.language.known_sides import assuming
from saltus.system.system import System


def forces_in_equations(system: System, sides: np.ndarray) -> dict[int, Expr]:
    """Contact forces that stand in the equations, by the number of the guard.

    The force of a guard is the one piecewise term that depends on its side and is zero while
    nothing that it depends on touches, as :func:`saltus.freeplay` and :func:`saltus.hertz` give it,
    with the factors before it: as many as make newtons of it, or, where units aren't known, all
    that multiply it. A guard with several such terms, or with none, has no entry.

    Parameters
    ----------
    system : System
        The equations.
    sides : int8[guard]
        Sign of each gap in contact.
    """
    field, found = free_field(system.field, system.guards), {}
    for number, guard in enumerate(system.guards):
        terms = {} if guard.law else dict.fromkeys(_terms(field, number))
        if len(terms) == 1 and _is_zero_apart(term := next(iter(terms)), sides):
            found[number] = _with_factors(system, field, term)
    return found


def _with_factors(system: System, field: tuple[Expr, ...], term: Expr) -> Expr:
    """A term of the equations as a force: with the factors before it."""
    above: dict[Expr, list[Expr]] = {}
    for node in walk(*field):
        for child in set(node.args):
            above.setdefault(child, []).append(node)
    chain = [term]
    while len(parents := above.get(chain[-1], [])) == 1 and parents[0].op in ("mul", "div"):
        chain.append(parents[0])
    # k/m*depth is written as often as k*depth/m
    whole = [
        mul(factor.args[0], inner)
        for node in chain[1:]
        if node.op == "mul"
        for factor, inner in (node.args, node.args[::-1])
        if factor.op == "div"
    ]
    units = units_of(system.states, system.units, field, [*chain, *whole])
    if "N" in units:
        return [*chain, *whole][units.index("N")]
    if _spring_unit(system, term):
        return term  # of a structure: the factors are its mode shapes
    products = next((i for i, node in enumerate(chain) if node.op == "div"), len(chain))
    return chain[products - 1]


def _terms(roots: tuple[Expr, ...], guard: int) -> list[Expr]:
    """The outermost piecewise terms that depend on the side of a guard."""
    found, seen, waiting = [], set[Expr](), list(roots)
    while waiting:
        node = waiting.pop()
        if node in seen or not node.bits >> guard & 1:
            continue
        seen.add(node)
        if node.op == "select":
            found.append(node)
        else:
            waiting += node.args
    return found


def side_that_pushes(system: System, guard: int) -> int:
    """Sign of the gap on which the one term of the equations that depends on a guard's side alone
    isn't zero; 0 if there is no such term, or it is on both.
    """
    terms = dict.fromkeys(_terms(free_field(system.field, system.guards), guard))
    if len(terms) != 1 or (term := next(iter(terms))).bits != 1 << guard:
        return 0
    below, above = (_is_zero(assuming(term, guard, side)) for side in (False, True))
    return int(below) - int(above)


def _is_zero(term: Expr) -> bool:
    return term.op == "const" and term.payload == 0.0


def _is_zero_apart(term: Expr, sides: np.ndarray) -> bool:
    """True if a term is zero while none of its guards is in contact."""
    for guard in range(term.bits.bit_length()):
        if term.bits >> guard & 1:
            term = assuming(term, guard, bool(sides[guard] < 0))
    return _is_zero(term)


def force_unit(system: System, formulas: Mapping[int, Expr]) -> str:
    """The unit that all these forces share, ``""`` if it isn't known."""
    rates = free_field(system.field, system.guards)
    known = units_of(system.states, system.units, rates, list(formulas.values()))
    # depths of structures are sums of modes, whose units aren't known
    units = {
        unit or _spring_unit(system, one)
        for unit, one in zip(known, formulas.values(), strict=True)
    }
    return units.pop() if len(units) == 1 else ""


def _spring_unit(system: System, term: Expr) -> str:
    """N or N*m if every piece of a force is zero, or a sum with a stiffness [N/m or N/m^p, N*m/rad]
    times something; ``""`` for any other.
    """
    if term.op == "select":
        found = {_spring_unit(system, piece) for piece in term.args if not _is_zero(piece)}
        return found.pop() if len(found) == 1 else ""
    if term.op in ("add", "sub", "neg"):
        return next(filter(None, (_spring_unit(system, part) for part in term.args)), "")
    factors = term.args if term.op == "mul" else ()
    stiffnesses = [system.units[one.payload] for one in factors if one.op == "param"]
    for start, unit in (("N/m", "N"), ("N*m/rad", "N*m")):
        if any(own == start or own.startswith(f"{start}^") for own in stiffnesses):
            return unit
    return ""
