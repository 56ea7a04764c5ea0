"""Sensors of a structure: deflections, velocities and accelerations of its degrees of freedom, and
forces of its contacts.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.errors import ParameterError, among, must_be, nearest, shown
from saltus.language.expression import TIME, Expr, add, as_expr, constant, parameter, state
from saltus.language.names import why_no_output
from saltus.system.checks import MOST_GUARDS
from saltus.system.outputs import check_name, with_formula, with_more
from saltus.system.read_off import joined
from saltus.system.structures import drives, laws
from saltus.system.structures.equations import UNITS, Coordinates, Loads, sum_of, way_of
from saltus.system.structures.parts import Base, Force, direction, named, vector_of
from saltus.system.system import System

ZERO = constant(0.0)
#: A sensor as study files write it.
_CALL = re.compile(r"\s*(velocity|acceleration|contact_force)\(\s*(\w+)\s*\)\s*")


@dataclass(frozen=True)
class Sensor:
    """A quantity that is measured on a structure. It is made by :func:`acceleration`,
    :func:`velocity` and :func:`contact_force`.

    Attributes
    ----------
    kind : str
        ``deflection``, ``velocity``, ``acceleration`` or ``contact force``.
    at : str
        A degree of freedom; of a force the name of a contact, or its degree of freedom.
    to : str or None
        The other degree of freedom of a stretch.
    """

    kind: str
    at: str
    to: str | None = None

    def __post_init__(self) -> None:
        for key, name in (("at", self.at), ("to", self.to)):
            if not isinstance(name, str) and (key == "at" or name is not None):
                raise must_be(key, "a name, such as 'x3'", name)


def velocity(at: str, to: str | None = None) -> Sensor:
    """A sensor of the velocity of a degree of freedom of a structure.

    Parameters
    ----------
    at : str
        Its name. Where the base moves, the velocity is relative to the base.
    to : str, optional
        Another one: the velocity is that of ``at`` minus that of ``to``.

    Returns
    -------
    Sensor
        For ``sensors=`` of :func:`saltus.structure`. Its unit is that of the degrees of freedom per
        second.

    Raises
    ------
    ParameterError
        If a name isn't text.

    Examples
    --------
    >>> import numpy as np, saltus as sl
    >>> pair = sl.structure(
    ...     np.eye(2), 1e3 * np.array([[2, -1], [-1, 1]]), modes=2,
    ...     sensors={"tip speed": sl.velocity("x2")},
    ... )
    >>> pair.outputs.names, pair.outputs.units
    (('tip speed',), ('m/s',))
    """
    return Sensor("velocity", at, to)


def acceleration(at: str, to: str | None = None) -> Sensor:
    """A sensor of the acceleration of a degree of freedom of a structure: the row of its equations
    of motion, forces of contacts included. Blows on rigid stops have none.

    Parameters
    ----------
    at : str
        Its name. Where the base moves, the acceleration is absolute: that of the base is added.
    to : str, optional
        Another one: the acceleration is that of ``at`` minus that of ``to``.

    Returns
    -------
    Sensor
        For ``sensors=`` of :func:`saltus.structure`. Its unit is that of the degrees of freedom per
        square second.

    Raises
    ------
    ParameterError
        If a name isn't text.

    Examples
    --------
    >>> import numpy as np, saltus as sl
    >>> pair = sl.structure(
    ...     np.eye(2), 1e3 * np.array([[2, -1], [-1, 1]]), modes=2,
    ...     sensors={"tip acceleration": sl.acceleration("x2")},
    ... )
    >>> pair.outputs.names, pair.outputs.units
    (('tip acceleration',), ('m/s^2',))
    """
    return Sensor("acceleration", at, to)


def contact_force(at: str) -> Sensor:
    """A sensor of the force of a contact of a structure: of its spring and damper, positive against
    a positive deflection, without preload.

    Parameters
    ----------
    at : str
        The name of the contact; or its degree of freedom, for the sum of all contacts there.

    Returns
    -------
    Sensor
        For ``sensors=`` of :func:`saltus.structure`. A force [N], of a structure in angles a torque
        [N*m].

    Raises
    ------
    ParameterError
        If a name isn't text.

    Examples
    --------
    >>> import numpy as np, saltus as sl
    >>> pair = sl.structure(
    ...     np.eye(2), 1e3 * np.array([[2, -1], [-1, 1]]), modes=2,
    ...     contacts=[sl.Contact("x2", stiffness="50 kN/m", gap="1 mm")],
    ...     sensors={"stop force": sl.contact_force("x2")},
    ... )
    >>> pair.outputs.names, pair.outputs.units
    (('stop force',), ('N',))
    """
    return Sensor("contact force", at)


def with_sensors(
    made: System, sensors: Any, moving: Coordinates, degrees: list[str], loads: Loads, unit: str
) -> System:
    """The structure with sensors as its outputs; in front of the coordinates of modes.

    Parameters
    ----------
    made : System
        The structure.
    sensors : mapping of str to str, (str, str), Sensor, or what :meth:`System.with_outputs` takes
        A degree of freedom stands for its deflection, a pair for a stretch. None: :func:`_usual`
        ones in front of the coordinates of modes, else none.
    moving, degrees, loads, unit
        What it is made of: coordinates, names of degrees of freedom, contacts and drives, and the
        unit of the degrees of freedom.

    Raises
    ------
    ParameterError
        If there is no such degree of freedom or contact, or no mode moves it.
    """
    if sensors is None:
        sensors = _usual(made, moving, degrees, loads) if moving.transform is not None else {}
    if not isinstance(sensors, Mapping):
        raise must_be("sensors", 'a mapping, such as {"tip": "x3"}', sensors)
    plan = _Sensors(made, moving, degrees, loads)
    found = replace(made.outputs, first=bool(sensors) and moving.transform is not None)
    for name, given in sensors.items():
        if callable(given) or (isinstance(given, tuple) and given and callable(given[0])):
            found = with_more(replace(made, outputs=found), {name: given})
            continue
        one = _sensor(name, given)
        check_name(made, name, found.names)
        own, rest = plan.formula(name, one)
        formula, guards = joined(rest, made, found)
        found = with_formula(made, found, name, add(own, formula), guards, _unit(one, unit))
    return replace(made, outputs=found)


def _usual(
    made: System, moving: Coordinates, degrees: list[str], loads: Loads
) -> dict[str, Sensor]:
    """Sensors of a structure by its modes for which none are given: deflection, velocity and force
    at each contact.

    Without contacts it is the deflection and velocity at each force, without forces those of the
    degree of freedom that its first mode moves most. They take half of the room for outputs at
    most.
    """
    found: dict[str, Sensor] = {}
    for label, one in loads.contacts:
        found |= _motion(f"at {label}", one.at, one.to)
        if one.restitution is None:
            found[f"force at {label}"] = contact_force(label)
    for label, drive in loads.drives if not found else ():
        if isinstance(drive, Force) and moving.along(vector_of([drive.at], degrees)).any():
            found |= _motion(f"at {label}", drive.at)
    if not found and moving.transform is not None:
        most = degrees[int(np.abs(moving.transform[:, 0]).argmax())]
        found = _motion("of mode 1" if why_no_output(most) else f"of {most}", most)
    return dict(list(found.items())[: (MOST_GUARDS - len(made.guards)) // 2])


def _motion(where: str, at: str, to: str | None = None) -> dict[str, Sensor]:
    """Sensors of the deflection and the velocity at a place, by their names."""
    return {
        f"deflection {where}": Sensor("deflection", at, to),
        f"velocity {where}": velocity(at, to),
    }


def _sensor(name: Any, given: Any) -> Sensor:
    if isinstance(given, Sensor):
        return given
    if isinstance(given, str):
        return Sensor("deflection", given)
    if isinstance(given, tuple | list) and len(given) == 2:
        return Sensor("deflection", *given)
    raise ParameterError(
        f"the sensor {shown(name)} must be a degree of freedom, sl.velocity(...), "
        f"sl.acceleration(...), sl.contact_force(...) or a function of the states, not "
        f"{shown(given)}."
    )


def _unit(one: Sensor, unit: str) -> str:
    speed, force, _, _, acceleration = UNITS[unit]
    return {"velocity": speed, "acceleration": acceleration, "contact force": force}.get(
        one.kind, unit
    )


@dataclass(frozen=True)
class _Sensors:
    """The parts of a structure that the formulas of sensors need."""

    made: System
    moving: Coordinates
    degrees: list[str]
    loads: Loads

    def formula(self, name: str, one: Sensor) -> tuple[Expr, Expr]:
        """The formula of a sensor as a sum: a part of the equations, whose conditions hold bits,
        and the rest, with comparisons.
        """
        z, w = (list(map(state, names)) for names in (self.moving.names, self.moving.rates))
        if one.kind == "contact force":
            return ZERO, self._force(name, one.at, z, w)
        vector = self._vector(name, one)
        along = self.moving.along(vector)
        if not along.any():
            raise ParameterError(f"no mode that is kept moves {name}. Keep more by modes=.")
        if one.kind == "acceleration":
            rates = self.made.field[len(z) : 2 * len(z)]
            return as_expr(sum_of(along, rates)), as_expr(self._base(vector))
        return ZERO, as_expr(sum_of(along, z if one.kind == "deflection" else w))

    def _vector(self, name: str, one: Sensor) -> np.ndarray:
        """The direction of a degree of freedom or a stretch."""
        places = [one.at] if one.to is None else [one.at, one.to]
        for place in places:
            if not among(place, self.degrees):
                written = _CALL.fullmatch(place) if isinstance(place, str) else None
                advice = f"Write sl.{written[1]}({written[2]!r})." if written else ""
                raise ParameterError(
                    f"the sensor {shown(name)}: {shown(place)} is no degree of freedom. "
                    f"{advice or named(place, self.degrees)}"
                )
        if one.at == one.to:
            raise ParameterError(
                f"the sensor {shown(name)} is the difference of {shown(one.at)} and itself. Give "
                f"two degrees of freedom, or one."
            )
        return vector_of(places, self.degrees)

    def _base(self, vector: np.ndarray) -> Any:
        """The acceleration of the base along a direction."""
        total: Any = 0.0
        for label, drive in self.loads.drives:
            if not isinstance(drive, Base):
                continue
            if share := float(vector @ direction(drive, self.degrees)):
                total = total + share * drives.value(TIME, label, drive, self._values)
        return total

    def _force(self, name: str, at: Any, z: list[Expr], w: list[Expr]) -> Expr:
        """The force of the contacts of a name, or at a degree of freedom."""
        contacts = dict(self.loads.contacts)
        mine = (
            [at]
            if among(at, contacts)
            else [label for label, one in contacts.items() if one.at == at]
        )
        if not mine:
            known = list(dict.fromkeys([*contacts, *(one.at for one in contacts.values())]))
            raise ParameterError(
                f"the sensor {shown(name)}: there is no contact at {shown(at)}. "
                f"{nearest(at, known) if known else 'This structure has none: give contacts=.'}"
            )
        total: Any = 0.0
        for label in mine:
            way = way_of(self.moving, self.degrees, label, contacts[label])
            pushed, _ = laws.forces(label, contacts[label], way.moving(z, w), self._values)
            if pushed is None:
                raise ParameterError(
                    f"the sensor {shown(name)}: {label} is a rigid stop, whose blows are impulses. "
                    f"sl.impact_statistics gives them."
                )
            total = total + pushed
        return as_expr(total)

    @property
    def _values(self) -> dict[str, Any]:
        return {name: parameter(name) for name in self.made.values}
