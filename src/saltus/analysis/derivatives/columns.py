"""Derivatives that are asked for: with respect to what, and of outputs where they turn."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.analysis.inputs.starts import Ensemble
from saltus.errors import ParameterError, among, must_be, unknown
from saltus.flow.methods import Method
from saltus.system import System
from saltus.system.quantity import with_turning_surfaces


@dataclass(frozen=True)
class Columns:
    """The columns of derivatives that were asked for.

    Attributes
    ----------
    names : tuple of str
        As the user gave them: parameters, and starts as ``x(0)``.
    parameters : tuple of str
        The parameters among them.
    places : list of int
        Where each stands among the columns of the flow: starts, then parameters.
    """

    names: tuple[str, ...]
    parameters: tuple[str, ...]
    places: list[int]

    @classmethod
    def of(cls, system: System, to: Any) -> Columns:
        """The columns of a user's ``to``."""
        given = [to] if isinstance(to, str) else to
        if (
            not isinstance(given, Sequence)
            or not given
            or not all(isinstance(name, str) for name in given)
        ):
            raise must_be("to", 'parameters, such as ["gap"], or starts, such as "x(0)"', to)
        starts = [f"{name}(0)" for name in system.states]
        for name in given:
            if not among(name, (*system.values, *starts)):
                raise unknown(
                    f"{system.name} has no parameter or start", name, (*system.values, *starts)
                )
        if len(set(given)) != len(given):
            raise ParameterError("to names something twice. Name each parameter once.")
        parameters = tuple(name for name in given if name not in starts)
        columns = (*starts, *parameters)
        return cls(tuple(given), parameters, [columns.index(name) for name in given])

    def units(self, system: System) -> list[str]:
        """Unit of each."""
        return [system.units.get(name.removesuffix("(0)"), "") for name in self.names]

    def values(self, system: System, group: Ensemble) -> np.ndarray:
        """Value of each, float64[n, C]."""
        rows = np.broadcast_to(group.parameters, (group.size, group.parameters.shape[1]))
        known = dict(zip(system.values, rows.T, strict=True))
        known |= {f"{name}(0)": group.start[:, i] for i, name in enumerate(system.states)}
        return np.stack([known[name] for name in self.names], axis=1)


@dataclass(frozen=True)
class Turning:
    """A system with surfaces on which outputs turn.

    Attributes
    ----------
    system : System
        The surfaces are guards of it behind those of the system.
    of : mapping of int to int
        The output of each of these guards.
    known : list of int
        The outputs that turn there only.
    """

    system: System
    of: Mapping[int, int]
    known: list[int]


@functools.lru_cache(maxsize=64)
def turning_surfaces(system: System, method: Method) -> Turning:
    """The system with surfaces on which its outputs turn; of a structure by its modes not the
    modes. A surface for which another flow would have to stand in is left out. Cached: those of
    copies with other values are copies of one another, and nothing is compiled again.
    """
    if system.origin is not system:
        turning = turning_surfaces(system.origin, method)
        return replace(turning, system=turning.system.with_values(**system.values))
    served = method.serving(system.origin)
    names = (*system.states, *system.outputs.names)
    wanted = names[len(system.states) :] if system.outputs.first else names
    found, of, known = with_turning_surfaces(
        system, wanted, lambda more: method.serving(more.origin) == served
    )
    return Turning(
        found,
        {guard: names.index(name) for guard, name in of.items()},
        [names.index(name) for name in known],
    )
