"""Starts of structures whose states are coordinates of modes, by what sensors show."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from saltus.errors import ParameterError, listed, nearest, shown
from saltus.language import expression as ex
from saltus.language.evaluate import evaluate
from saltus.system import System
from saltus.system.modes import field, sides

#: Difference of what a sensor shows from what is asked that is none, in units of the largest.
MET = 1e-9


def sensed(system: System, given: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """States at which sensors of deflections and velocities show given values.

    Of all such states it is that of least energy: the deflection is that of static forces at the
    sensors, the velocity that of blows there. Without one of the kinds it is zero.

    Parameters
    ----------
    system : System
        A structure by its modes.
    given : mapping of str to float64[] or float64[n]
        What sensors show [SI].

    Returns
    -------
    dict of str to float64[] or float64[n]
        The states.

    Raises
    ------
    ParameterError
        If there is no such sensor, it shows no deflection or velocity, or the modes can't have
        such values at once.
    """
    size = sum(f"{name}_rate" in system.states for name in system.states)
    rows = {name: _row(system, name, size) for name in given}
    found = np.zeros((len(system.states), max(map(np.size, given.values()))))
    for first in (0, size):
        part = slice(first, first + size)
        mine = [name for name, row in rows.items() if row[part].any()]
        if not mine:
            continue
        matrix = np.array([rows[name][part] for name in mine])
        wanted = np.array([np.broadcast_to(given[name], found.shape[1]) for name in mine])
        found[part] = _least(matrix, np.eye(size) if first else _stiffness(system, size)) @ wanted
        if np.abs(matrix @ found[part] - wanted).max() > MET * np.abs(wanted).max():
            raise ParameterError(
                f"no motion of the {size} modes shows the start of {', '.join(mine)} at once. Give "
                f"fewer of them, or keep more modes."
            )
    scalar = all(np.ndim(one) == 0 for one in given.values())
    return {name: one[0] if scalar else one for name, one in zip(system.states, found, strict=True)}


def _row(system: System, name: str, size: int) -> np.ndarray:
    """Share of each state in a sensor: float64[states]."""
    names, outputs = system.states, system.outputs
    if name not in outputs.names:
        raise ParameterError(
            f"{system.name} has no sensor {shown(name)}, and its states are coordinates of modes, "
            f"{listed(names)}. Give the start by sensors of deflections and velocities: "
            f"sensors={{{name!r}: ...}} of sl.structure adds one. "
            f"{nearest(name, outputs.names) if len(outputs) else ''}".rstrip()
        )
    formula = outputs.formulas[outputs.names.index(name)]
    probes = np.column_stack([np.zeros(len(names)), np.eye(len(names)), np.arange(len(names))])
    (found,) = evaluate(
        [formula],
        states=dict(zip(names, probes, strict=True)),
        values=system.values,
        bits=[True] * len(system.guards) * 2,
    )
    shows = np.broadcast_to(found, probes.shape[1])
    row: np.ndarray = shows[1:-1] - shows[0]
    linear = not ex.depends_on(formula, ("time", "select")) and np.isclose(
        shows[-1], row @ probes[:, -1], rtol=1e-9, atol=1e-9 * np.abs(row).max()
    )
    if not linear or shows[0] or row[:size].any() == row[size:].any():
        raise ParameterError(
            f"{shown(name)} is neither a deflection nor a velocity, so no start can be given by it."
        )
    return row


def _stiffness(system: System, size: int) -> np.ndarray:
    """The stiffness of the modes where contacts are as they are at rest: float64[size, size]."""
    rest = np.zeros((len(system.states), 1 + size))
    rest[:size, 1:] = np.eye(size)
    rates = field(system, 0.0, rest, bits=sides(system, 0.0, rest[:, 0]))[size : 2 * size]
    return np.asarray(rates[:, :1] - rates[:, 1:])


def _least(matrix: np.ndarray, energy: np.ndarray) -> np.ndarray:
    """The solution of least energy ``x' energy x / 2`` of ``matrix @ x = b``, for any b, as a
    matrix.
    """
    from scipy.linalg import null_space

    some, free = np.linalg.pinv(matrix), null_space(matrix)
    within = np.linalg.pinv(free.T @ energy @ free)
    return np.asarray(some - free @ (within @ (free.T @ (energy @ some))))
