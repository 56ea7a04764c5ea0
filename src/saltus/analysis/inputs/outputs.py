"""Outputs: functions of a motion besides its states, such as a force, an acceleration or the motion
of a base.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.contact.guards import Guard
from saltus.errors import ParameterError, shown
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr
from saltus.language.rows import products, split_rows
from saltus.results.dataset.build import last_axis_first
from saltus.results.dataset.schema import reserved_names
from saltus.system import System
from saltus.system.outputs import with_more


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
    own_guards : int
        Number of the guards of the system.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    formulas: tuple[Expr, ...]
    guards: tuple[Guard, ...]
    own_guards: int = 0

    def __len__(self) -> int:
        return len(self.names)

    def values(
        self, t: Any, states: np.ndarray, parameters: Mapping[str, Any], mode: np.ndarray
    ) -> np.ndarray:
        """All of them where the motion is known.

        Parameters
        ----------
        t : float or array, shape (...)
            Time [s].
        states : float64[..., D]
            The states there; NaN where they aren't known.
        parameters : mapping of str to float or array, shape (...)
            Values of all parameters [SI].
        mode : int64[...]
            Sides of the guards of the system: bit i is set where gap i is positive.

        Returns
        -------
        float64[..., K]
            The states come first. A function is NaN where a state is.
        """
        if not self.formulas:
            return states
        names = self.names[: states.shape[-1]]
        more = self.guards[self.own_guards :]
        asked, sums, rows = split_rows((*(guard.gap for guard in more), *self.formulas), names)
        known = dict(zip(names, last_axis_first(states), strict=True))
        known |= dict(zip(sums, products(states, rows), strict=True))
        bits: list[Any] = [(np.asarray(mode) >> i) & 1 == 1 for i in range(self.own_guards)]
        about: dict[str, Any] = {"t": t, "states": known, "values": parameters}
        for gap in asked[: len(more)]:
            bits.append(evaluate([gap], **about, bits=bits)[0] > 0)
        there = np.isfinite(states).all(axis=-1)
        found = evaluate(asked[len(more) :], **about, bits=bits)
        columns = [np.where(there, one, np.nan) for one in found]
        return np.concatenate([states, np.stack(columns, axis=-1)], axis=-1)


def check_outputs(system: System) -> None:
    """Raise a ParameterError for an output that has the name of another variable of results."""
    for name in system.outputs.names:
        if name in reserved_names():
            raise ParameterError(
                f"the output {shown(name)} has the name of something else in results. Give it "
                f"another one."
            )


def states_alone(system: System) -> Outputs:
    """The states of a system as outputs, and no functions."""
    units = tuple(system.units[name] for name in system.states)
    return Outputs(system.states, units, (), system.guards, len(system.guards))


def outputs_of(system: System, given: Mapping[str, Any] | None = None) -> Outputs:
    """The outputs of a system: its states, those that it has by name, then the user's functions.

    Parameters
    ----------
    system : System
        The equations and values.
    given : mapping of str to callable, or to (callable, unit)
        Functions of (t, states, parameters), arguments found by name; see
        :func:`saltus.system.read_off.quantity`.

    Raises
    ------
    ParameterError, UnitError, TraceError
        If a name is taken, a unit can't be read, or a function can't be traced or doesn't repeat
        with the forcing.
    """
    found = system.outputs if given is None else with_more(system, given, variables=False)
    formulas, guards = found.behind(system.guards)
    units = (*(system.units[name] for name in system.states), *found.units)
    return Outputs((*system.states, *found.names), units, formulas, guards, len(system.guards))
