"""The equations of a structure, from its matrices, contacts and forces."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.contact.declared import Impact
from saltus.errors import ParameterError, shown
from saltus.language.expression import Relation
from saltus.language.names import why_no_name
from saltus.system.structures import drives, laws, matrices
from saltus.system.structures.drives import FREQUENCY
from saltus.system.structures.parts import Base, Contact, Force, direction, vector_of
from saltus.system.system import System
from saltus.system.trace import system

#: An entry of the mode shapes below this share of the largest is rounding: the mode doesn't move
#: that degree of freedom.
NOTHING = 1e-13
#: A modal force below this share of the largest is rounding of a sum over all degrees of freedom.
ROUNDING = 1e-12
#: Unit of a deflection: those of its rate, a force, a stiffness, a damper and an acceleration.
UNITS = {
    "m": ("m/s", "N", "N/m", "N*s/m", "m/s^2"),
    "rad": ("rad/s", "N*m", "N*m/rad", "N*m*s/rad", "rad/s^2"),
    "": ("", "", "", "", ""),
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

    def compliance(self, along: np.ndarray) -> float:
        """1/mass of the structure along a direction of its coordinates [1/kg]."""
        return float(along @ (along if self.inverse is None else self.inverse @ along))

    def load(self, vector: np.ndarray) -> np.ndarray:
        """A force on the degrees of freedom in these coordinates."""
        if self.transform is None:
            return vector
        found = vector @ self.transform
        return np.where(np.abs(found) <= ROUNDING * np.abs(found).max(), 0.0, found)


@dataclass(frozen=True)
class Loads:
    """Contacts and drives of a structure, each with its name.

    Attributes
    ----------
    contacts : list of (str, Contact)
    drives : list of (str, Force or Base)
    along : list of float64[n]
        The force of each drive on the degrees of freedom, for a value of 1.
    """

    contacts: list[tuple[str, Contact]]
    drives: list[tuple[str, Force | Base]]
    along: list[np.ndarray]


def traced(
    moving: Coordinates,
    degrees: list[str],
    loads: Loads,
    frequency: Any,
    *,
    unit: str,
    name: str,
    source: str,
) -> tuple[System, dict[str, Relation]]:
    """The system, and the boundary of each contact by its name."""
    needs, repeats = drives.forcing(loads.drives, frequency)
    ways = [way_of(moving, degrees, label, contact) for label, contact in loads.contacts]
    along = [moving.load(one) for one in loads.along]
    defaults, units = _parameters(loads, unit)
    if needs:
        defaults[FREQUENCY] = frequency
        units[FREQUENCY] = "Hz"  # the drives turn 2 pi times as quickly, however it is written
    own = (unit, UNITS[unit][0]) if moving.transform is None or not unit else MODAL
    units |= dict.fromkeys(moving.names, own[0]) | dict.fromkeys(moving.rates, own[1])
    sides: dict[str, Relation] = {}
    k = len(moving.names)

    def rates(t: Any, *states: Any, **values: Any) -> tuple[Any, ...]:
        z, w = states[:k], states[k:]
        load: list[Any] = [0.0] * k
        stops: list[Impact] = []
        for (label, drive), place in zip(loads.drives, along, strict=True):
            _add(load, place, drives.value(t, label, drive, values))
        for (label, contact), way in zip(loads.contacts, ways, strict=True):
            at = way.moving(z, w)
            sides.update(laws.boundaries(label, contact, at, values))
            if contact.restitution is not None:
                stops += laws.impacts(label, contact, at, values, way.inertia)
            _press(load, label, contact, way, at, values)
        for matrix, of in ((moving.stiffness, z), (moving.damping, w)):
            if matrix is not None:
                rows = matrices.dense(matrix)
                load = [one - sum_of(row, of) for one, row in zip(load, rows, strict=True)]
        if moving.inverse is not None:
            load = [sum_of(row, load) for row in moving.inverse]
        return (*w, *load, *stops)

    _check_names((*moving.names, *moving.rates), defaults)
    rates.__signature__ = _signature((*moving.names, *moving.rates), defaults)  # type: ignore[attr-defined]
    made: Callable[..., System] = system(
        (*moving.names, *moving.rates),
        forced_at=FREQUENCY if repeats else None,
        units=units,
        name=name,
        source=source,
        check_units=False,  # numbers of the matrices carry units of their own
    )
    return made(rates), sides


def _press(
    load: list[Any], label: str, contact: Contact, way: Way, at: laws.Moving, values: dict[str, Any]
) -> None:
    """Add the forces of a contact to the loads: preload, spring and damper, friction."""
    if contact.preload is not None:
        towards = way.pushed if contact.side == "upper" else -way.pushed
        _add(load, towards, values[f"{label}_preload"])
    pushed, rubbed = laws.forces(label, contact, at, values)
    if pushed is not None:
        _add(load, -way.pushed, pushed)
    if rubbed is not None:
        _add(load, -way.rubbed, rubbed)


@dataclass(frozen=True)
class Way:
    """The motion of a contact in the coordinates of the structure: its deflection is
    ``pushed.z``, its slip ``rubbed.z'``; ``inertia`` is that of the rates which a rigid stop
    changes.
    """

    pushed: np.ndarray
    rubbed: np.ndarray
    inertia: dict[str, float]

    def moving(self, z: Sequence[Any], w: Sequence[Any]) -> laws.Moving:
        """The motion at the contact."""
        slip = sum_of(self.rubbed, w) if self.rubbed.any() else None
        return laws.Moving(sum_of(self.pushed, z), sum_of(self.pushed, w), slip)


def way_of(moving: Coordinates, degrees: list[str], label: str, contact: Contact) -> Way:
    """The way of a contact. Raises ParameterError if the structure can't move so."""
    pushed = moving.along(direction(contact, degrees))
    rubbed = np.zeros(len(pushed))
    if contact.sliding is not None:
        pair = [contact.sliding] if isinstance(contact.sliding, str) else contact.sliding
        rubbed = moving.along(vector_of(pair, degrees))
    if not pushed.any() or (contact.sliding is not None and not rubbed.any()):
        raise ParameterError(f"no mode that is kept moves {label}. Keep more by modes=.")
    inertia = {}
    if contact.restitution is not None:
        if rubbed.any() and np.linalg.matrix_rank([pushed, rubbed]) < 2:
            raise ParameterError(
                f"{label}: the modes that are kept can't slide where they rest on this rigid stop. "
                f"Keep more by modes=."
            )
        masses = _masses(moving, label)
        moved = np.flatnonzero((pushed != 0) | (rubbed != 0)).tolist()
        inertia = {moving.rates[i]: float(masses[i]) for i in moved}
    return Way(pushed, rubbed, inertia)


def _masses(moving: Coordinates, label: str) -> np.ndarray:
    """The mass of each coordinate. Raises ParameterError if a blow on one would move others."""
    if moving.inverse is None:
        return np.ones(len(moving.names))
    diagonal = np.diag(moving.inverse)
    if np.count_nonzero(moving.inverse) > len(diagonal):
        raise ParameterError(
            f"{label}: a blow on a rigid stop moves all degrees of freedom that the mass matrix "
            f"joins. Give modes=, such as modes={len(diagonal)}, which loses nothing: among modes "
            f"the mass is diagonal."
        )
    return np.asarray(1.0 / diagonal)


def _parameters(loads: Loads, unit: str) -> tuple[dict[str, Any], dict[str, str]]:
    """Values and units of the parameters of contacts and drives."""
    _, force, spring, damper, acceleration = UNITS[unit]
    entries = []
    for label, contact in loads.contacts:
        entries += laws.entries(label, contact, (unit, force, spring, damper))
    for label, drive in loads.drives:
        entries += drives.entries(label, drive, acceleration if isinstance(drive, Base) else force)
    given = [entry for entry in entries if entry[1] is not None]
    keys = [key for key, _, _ in given]
    twice = [key for key in keys if keys.count(key) > 1]
    if twice:
        raise ParameterError(
            f"two parameters would be called {twice[0]!r}. Give the contacts and forces other "
            f"names by name=."
        )
    return {key: value for key, value, _ in given}, {key: of for key, _, of in given if of}


def _check_names(states: tuple[str, ...], parameters: Mapping[str, Any]) -> None:
    """Raise a ParameterError where the names of degrees of freedom can't be those of states."""
    for name in states:
        if (why := why_no_name(name)) is not None:
            raise ParameterError(
                f"names: {shown(name)} can't be the name of a state: {why}. With modes= the states "
                f"are coordinates of modes, and it can."
            )
    twice = [name for name in (*states, *parameters) if [*states, *parameters].count(name) > 1]
    if twice:
        raise ParameterError(
            f"names: {shown(twice[0])} would be a degree of freedom and another rate or parameter. "
            f"Rename it."
        )


def _signature(states: tuple[str, ...], defaults: dict[str, Any]) -> inspect.Signature:
    kinds = inspect.Parameter
    return inspect.Signature(
        [kinds(one, kinds.POSITIONAL_OR_KEYWORD) for one in ("t", *states)]
        + [kinds(key, kinds.KEYWORD_ONLY, default=value) for key, value in defaults.items()]
    )


def sum_of(coefficients: Any, values: Sequence[Any]) -> Any:
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
