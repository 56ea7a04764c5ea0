"""Outputs: functions of a motion besides its states, such as a force, an acceleration or the motion
of a base.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from saltus.contact.guards import Guard
from saltus.errors import ParameterError, UnitError, shown
from saltus.language import units_of, why_no_title
from saltus.language.expression import Expr
from saltus.system import System
from saltus.system.quantity import quantity
from saltus.units import check_declared, dimension


@dataclass(frozen=True)
class Outputs:
    """The states of a system, and functions of its motion.

    Attributes
    ----------
    names : tuple of str
        Of all of them, the states first.
    units : tuple of str
        Coherent SI unit of each, ``""`` where it isn't known.
    formulas : tuple of Expr
        Of the functions; conditions hold bits.
    guards : tuple of Guard
        The guards of these bits: those of the system, then those that only the functions need.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    formulas: tuple[Expr, ...]
    guards: tuple[Guard, ...]

    def __len__(self) -> int:
        return len(self.names)


def outputs_of(system: System, given: Mapping[str, Any] | None = None) -> Outputs:
    """The outputs of a system: its states, then the user's functions.

    Parameters
    ----------
    system : System
        The equations and values.
    given : mapping of str to callable, or to (callable, unit)
        Functions of (t, states, parameters), arguments found by name; see
        :func:`saltus.system.quantity.quantity`.

    Raises
    ------
    ParameterError, UnitError, TraceError
        If a name is taken, a unit can't be read, or a function can't be traced or doesn't repeat
        with the forcing.
    """
    if given is not None and not isinstance(given, Mapping):
        raise ParameterError(
            f'outputs must be functions by name, such as outputs={{"spring force": lambda x, k: '
            f"k*x}}, not {shown(given)}. "
            f"States are read off without being asked for."
        )
    extended, formulas, units = system, [], [system.units[name] for name in system.states]
    for name, one in (given or {}).items():
        if why_no_title(name) or name in system.states:
            why = why_no_title(name) or f"{system.name} has a state of this name"
            raise ParameterError(f"an output can't be called {shown(name)}: {why}.")
        function, unit = one if isinstance(one, tuple) and len(one) == 2 else (one, "")
        formula, guards = quantity(extended, function, f"the output {shown(name)}")
        extended = replace(extended, guards=guards)
        formulas.append(formula)
        units.append(_unit(system, formula, name, check_declared(unit, name) if unit else ""))
    return Outputs((*system.states, *(given or {})), tuple(units), tuple(formulas), extended.guards)


def _unit(system: System, formula: Expr, name: str, declared: str) -> str:
    """The unit of an output: the declared one, or that of its formula."""
    (found,) = units_of(system.states, system.units, system.field, [formula])
    if declared and found and dimension(found) != dimension(declared):
        raise UnitError(
            f"the output {shown(name)} is said to be in {declared}, but its formula is in {found}. "
            f"Correct one, or leave the unit out."
        )
    return declared or found
