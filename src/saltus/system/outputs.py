"""Named outputs of a system: sensors, forces, accelerations, whatever a user reads off a motion."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from saltus.contact.guards import Guard
from saltus.errors import ParameterError, UnitError, shown
from saltus.language.dimensions import units_of
from saltus.language.expression import Expr, state, walk
from saltus.language.names import why_no_output, why_no_title, why_not_together
from saltus.system.checks import MOST_GUARDS
from saltus.system.equations_of_motion import EquationsOfMotion
from saltus.system.named_outputs import NamedOutputs
from saltus.system.read_off import quantity
from saltus.units import check_declared, dimension

#: Unit of the coordinates of modes of unit modal mass. Their shapes are numbers that hide one.
MODAL_UNIT = "kg^0.5*m"


def with_more(system: EquationsOfMotion, given: Any, variables: bool = True) -> NamedOutputs:
    """The outputs of a system, and more behind them.

    Parameters
    ----------
    system : System
        The equations and values.
    given : mapping of str to callable, or to (callable, unit)
        Functions of (t, states, parameters), arguments found by name; see
        :func:`saltus.system.read_off.quantity`. One may use those before it.
    variables : bool
        True if the names become those of variables of results.

    Raises
    ------
    ParameterError, UnitError, TraceError
        If a name is taken or can't be one, a unit can't be read, a function can't be traced, or
        there are too many.
    """
    if not isinstance(given, Mapping):
        raise ParameterError(
            f'outputs must be functions by name, such as outputs={{"spring force": lambda x, k: '
            f"k*x}}, not {shown(given)}. "
            f"States are read off without being asked for."
        )
    found = system.outputs
    for name, one in given.items():
        check_name(system, name, found.names, variables)
        function, unit = one if isinstance(one, tuple) and len(one) == 2 else (one, "")
        formula, guards = quantity(system, function, f"the output {shown(name)}", found)
        declared = check_declared(unit, name) if unit else ""
        found = with_formula(system, found, name, formula, guards, declared)
    return found


def with_formula(
    system: EquationsOfMotion,
    found: NamedOutputs,
    name: str,
    formula: Expr,
    guards: tuple[Guard, ...],
    unit: str,
) -> NamedOutputs:
    """The outputs and one more: a formula with the guards that its bits number, and its declared
    unit. The guards are those of the system, of the outputs before it, then its own. Raises
    UnitError if the formula is in another one.
    """
    after = len(system.guards)
    known, _ = found.behind(system.guards)
    return NamedOutputs(
        (*found.names, name),
        (*found.units, _unit(system, formula, name, unit)),
        (*known, formula),
        guards[after:],
        after,
        found.first,
    )


def check_name(
    system: EquationsOfMotion, name: Any, others: tuple[str, ...], variables: bool = True
) -> None:
    """Raise a ParameterError for a name that an output can't have, or for one output too many."""
    why = why_no_output(name) if variables else why_no_title(name)
    if not why and name in system.states:
        why = f"{system.name} has a state of this name"
    elif not why and variables and (name in system.values or name == "t"):
        why = f"{system.name} has a parameter of this name" if name != "t" else "it is the time"
    elif not why and name in others:
        why = f"{system.name} has an output of this name"
    elif not why and variables:
        why = why_not_together((*system.states, *others, name))
    if why:
        raise ParameterError(f"an output can't be called {shown(name)}: {why}.")
    if len(others) + len(system.guards) >= MOST_GUARDS:
        raise ParameterError(
            f"{system.name} can have {MOST_GUARDS - len(system.guards)} outputs, not more: its "
            f"boundaries and its outputs are {MOST_GUARDS} at most."
        )


def _unit(system: EquationsOfMotion, formula: Expr, name: str, declared: str) -> str:
    """The unit of an output: the declared one, or that of its formula."""
    if any(system.units[str(one)].startswith(MODAL_UNIT) for one in _states_in(formula, system)):
        return declared
    (found,) = units_of(system.states, system.units, system.field, [formula])
    if declared and found and dimension(found) != dimension(declared):
        raise UnitError(
            f"the output {shown(name)} is said to be in {declared}, but its formula is in {found}. "
            f"Correct one, or leave the unit out."
        )
    return declared or found


def _states_in(formula: Expr, system: EquationsOfMotion) -> set[Any]:
    """Names of the states that a formula holds."""
    nodes = set(walk(formula))
    return {name for name in system.states if state(name) in nodes}
