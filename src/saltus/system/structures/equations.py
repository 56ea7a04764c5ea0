"""The equations of a structure, from its matrices, contacts and forces."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.contact.forces import freeplay
from saltus.errors import ParameterError
from saltus.language.expression import Expr, Relation, as_expr
from saltus.language.functions import cos, pi
from saltus.system.structures import matrices
from saltus.system.structures.parts import Contact, Force, direction
from saltus.system.system import System
from saltus.system.trace import system

#: An entry of the mode shapes below this share of the largest is rounding: the mode doesn't move
#: that degree of freedom.
NOTHING = 1e-13
#: Unit of a deflection: those of its rate, a force, a stiffness and a damper.
UNITS = {
    "m": ("m/s", "N", "N/m", "N*s/m"),
    "rad": ("rad/s", "N*m", "N*m/rad", "N*m*s/rad"),
    "": ("", "", "", ""),
}
#: Of coordinates of modes of unit modal mass, and of their rates.
MODAL = ("kg^0.5*m", "kg^0.5*m/s")


@dataclass(frozen=True)
class Coordinates:
    """k coordinates z in which a structure moves: ``z'' = inverse (load - stiffness z - damping
    z')``, and a deflection b.x is ``(b @ transform).z``. None is the unit matrix.
    """

    names: list[str]
    rates: list[str]
    inverse: np.ndarray | None
    stiffness: Any
    damping: Any
    transform: np.ndarray | None

    def along(self, vector: np.ndarray) -> np.ndarray:
        """A direction of the degrees of freedom in these coordinates."""
        if self.transform is None:
            return vector
        found = vector @ self.transform
        return np.where(np.abs(found) <= NOTHING * np.abs(self.transform).max(), 0.0, found)


def traced(
    moving: Coordinates,
    degrees: list[str],
    contacts: list[tuple[str, Contact]],
    forces: list[tuple[str, Force]],
    frequency: Any,
    *,
    unit: str,
    name: str,
    source: str,
) -> tuple[System, dict[str, Relation]]:
    """The system, and the boundary of each contact by its name."""
    forced = any(drive.harmonic for _, drive in forces)
    if forced and frequency is None:
        raise ParameterError("the forces oscillate: give frequency=, such as frequency='15 Hz'.")
    for label, contact in contacts:
        if not moving.along(direction(contact, degrees)).any():
            raise ParameterError(f"no mode that is kept moves {label}. Keep more by modes=.")
    defaults, units = _parameters(contacts, forces, unit)
    if forced:
        defaults["frequency"] = frequency
    own = (unit, UNITS[unit][0]) if moving.transform is None or not unit else MODAL
    units |= dict.fromkeys(moving.names, own[0]) | dict.fromkeys(moving.rates, own[1])
    sides: dict[str, Relation] = {}
    k = len(moving.names)

    def rates(t: Any, *states: Any, **values: Any) -> tuple[Any, ...]:
        z, w = states[:k], states[k:]
        load: list[Any] = [0.0] * k
        for label, drive in forces:
            _add(load, moving.along(direction(drive, degrees)), _force(t, label, drive, values))
        for label, contact in contacts:
            along = moving.along(direction(contact, degrees))
            pushed = _contact(label, contact, _sum(along, z), _sum(along, w), values, sides)
            _add(load, -along, pushed)
        for matrix, of in ((moving.stiffness, z), (moving.damping, w)):
            if matrix is not None:
                rows = matrices.dense(matrix)
                load = [one - _sum(row, of) for one, row in zip(load, rows, strict=True)]
        if moving.inverse is not None:
            load = [_sum(row, load) for row in moving.inverse]
        return (*w, *load)

    rates.__signature__ = _signature((*moving.names, *moving.rates), defaults)  # type: ignore[attr-defined]
    made: Callable[..., System] = system(
        (*moving.names, *moving.rates),
        forced_at="frequency" if forced else None,
        units=units,
        name=name,
        source=source,
        check_units=False,  # numbers of the matrices carry units of their own
    )
    return made(rates), sides


def _parameters(
    contacts: list[tuple[str, Contact]], forces: list[tuple[str, Force]], unit: str
) -> tuple[dict[str, Any], dict[str, str]]:
    """Values and units of the parameters of contacts and forces."""
    _, force, spring, damper = UNITS[unit]
    entries = []
    for label, contact in contacts:
        entries += [
            (f"{label}_gap", contact.gap, unit),
            (f"{label}_stiffness", contact.stiffness, spring),
            (f"{label}_damping", contact.damping, damper),
        ]
    for label, drive in forces:
        entries += [(label, drive.amplitude, force), (f"{label}_phase", drive.phase, "rad")]
    given = [entry for entry in entries if entry[1] is not None]
    keys = [key for key, _, _ in given]
    twice = [key for key in keys if keys.count(key) > 1]
    if twice:
        raise ParameterError(
            f"two parameters would be called {twice[0]!r}. Give the contacts and forces other "
            f"names by name=."
        )
    return {key: value for key, value, _ in given}, {key: of for key, _, of in given if of}


def _signature(states: tuple[str, ...], defaults: dict[str, Any]) -> inspect.Signature:
    kinds = inspect.Parameter
    return inspect.Signature(
        [kinds(one, kinds.POSITIONAL_OR_KEYWORD) for one in ("t", *states)]
        + [kinds(key, kinds.KEYWORD_ONLY, default=value) for key, value in defaults.items()]
    )


def _sum(coefficients: Any, values: Sequence[Any]) -> Any:
    """The sum of products without zeros, positive ones first."""
    places = np.flatnonzero(coefficients).tolist()
    total: Any = 0.0
    for i in sorted(places, key=lambda i: coefficients[i] < 0):
        term = abs(float(coefficients[i])) * values[i]
        total = total + term if coefficients[i] > 0 else total - term
    return total


def _add(load: list[Any], along: np.ndarray, force: Any) -> None:
    """Add a force along a direction to the loads."""
    for i in np.flatnonzero(along).tolist():
        part = abs(float(along[i])) * force
        load[i] = load[i] + part if along[i] > 0 else load[i] - part


def _force(t: Any, label: str, drive: Force, values: dict[str, Any]) -> Any:
    phase: Any = values[f"{label}_phase"] if drive.phase is not None else 0.0
    angle = 2 * pi * drive.harmonic * values["frequency"] * t + phase if drive.harmonic else phase
    return values[label] * cos(angle)


def _contact(
    label: str,
    contact: Contact,
    deflection: Expr,
    rate: Expr,
    values: dict[str, Any],
    sides: dict[str, Relation],
) -> Any:
    """The force of a contact on its degree of freedom, against the deflection."""
    gap = values[f"{label}_gap"]
    names = ("upper", "lower") if contact.side == "both" else (contact.side,)
    for side in names:
        relation = deflection > gap if side == "upper" else deflection < -gap
        sides[f"{label} {side}" if len(names) > 1 else label] = relation
    damped = contact.damping is not None
    return as_expr(
        freeplay(
            deflection,
            stiffness=values[f"{label}_stiffness"],
            damping=values[f"{label}_damping"] if damped else 0.0,
            velocity=rate if damped else None,
            **{f"{side}_gap": gap for side in names},
        )
    )
