"""A structure as its contacts and drives see it: deflections at the contacts, forces there, and the
linear structure between.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.language.expression import Expr
from saltus.system.structures import matrices
from saltus.system.structures.equations import Coordinates, Loads, traced
from saltus.system.structures.parts import ways_of
from saltus.system.system import System


@dataclass(frozen=True, eq=False)
class Interfaces:
    """Contacts and drives of a structure without rigid stops, and what is between them.

    Attributes
    ----------
    moving : Coordinates
        Of the structure.
    degrees : list of str
        Its degrees of freedom.
    loads : Loads
        Its contacts and drives.
    frequency : float, str or None
        As given.
    unit, name : str
        Of the deflections; of the structure.
    field : tuple of Expr
        The rates of the system that this describes: one with others is another system.
    """

    moving: Coordinates
    degrees: list[str]
    loads: Loads
    frequency: Any
    unit: str
    name: str
    field: tuple[Expr, ...]

    @functools.cached_property
    def _directions(self) -> list[np.ndarray]:
        """Along which contacts are pressed and slide, each once, in the degrees of freedom."""
        found: list[np.ndarray] = []
        for _, contact in self.loads.contacts:
            ways = ways_of(contact, self.degrees)
            found += [way for way in ways if _place(way, found) is None]
        return found

    @functools.cached_property
    def signals(self) -> np.ndarray:
        """Deflections at the contacts by each coordinate, float64[c, r]."""
        rows = [self.moving.along(one) for one in self._directions]
        return np.reshape(rows, (len(rows), len(self.moving.names)))

    @functools.cached_property
    def forced(self) -> np.ndarray:
        """Pushes of the rates of :attr:`system` in the coordinates: the contacts, then the drives,
        float64[c + d, r].
        """
        drives = [self.moving.load(one) for one in self.loads.along]
        return np.reshape([*self.signals, *drives], (-1, len(self.moving.names)))

    @functools.cached_property
    def dynamics(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Mass, damping and stiffness in the coordinates, float64[r, r] each."""
        moving, unit = self.moving, np.eye(len(self.moving.names))
        mass = unit if moving.inverse is None else np.linalg.inv(moving.inverse)
        damping = 0.0 * unit if moving.damping is None else matrices.dense(moving.damping)
        return mass, damping, matrices.dense(moving.stiffness)

    @functools.cached_property
    def system(self) -> System:
        """A system whose states are the deflections at the contacts and one for each drive, then
        their rates: the rates of these are the forces that act there.
        """
        names = [f"deflection_{i}" for i in range(len(self._directions))]
        names += [f"drive_{i}" for i in range(len(self.loads.along))]
        at = _AtContacts(
            names,
            [f"{one}_rate" for one in names],
            None,
            np.zeros((len(names), len(names))),
            None,
            None,
            self._directions,
            self.loads.along,
        )
        about = {"unit": self.unit, "name": self.name, "source": ""}
        return traced(at, self.degrees, self.loads, self.frequency, **about)[0]


def seen_by_contacts(
    system: System, moving: Coordinates, degrees: list[str], loads: Loads, frequency: Any, unit: str
) -> Interfaces | None:
    """The interfaces of a structure; None without contacts, or with rigid ones."""
    if not loads.contacts or any(one.restitution is not None for _, one in loads.contacts):
        return None
    return Interfaces(moving, degrees, loads, frequency, unit, system.name, system.field)


@dataclass(frozen=True)
class _AtContacts(Coordinates):
    """Coordinates that are the deflections at contacts, and one for each drive."""

    directions: list[np.ndarray]
    drives: list[np.ndarray]

    def along(self, vector: np.ndarray) -> np.ndarray:
        """See :meth:`Coordinates.along`."""
        return np.asarray(np.eye(len(self.names))[_place(vector, self.directions)])

    def load(self, vector: np.ndarray) -> np.ndarray:
        """See :meth:`Coordinates.load`."""
        place = next(i for i, one in enumerate(self.drives) if one is vector)
        return np.asarray(np.eye(len(self.names))[len(self.directions) + place])


def _place(vector: np.ndarray, known: list[np.ndarray]) -> int | None:
    """The number of a vector among others."""
    return next((i for i, one in enumerate(known) if np.array_equal(one, vector)), None)
