"""Contacts and forces of a structure, as data."""

from __future__ import annotations

import functools
import keyword
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any, TypeVar

import numpy as np

from saltus.errors import ParameterError, among, must_be, nearest, one_of, shown

#: Sides on which contact begins: above the gap, below minus the gap, or both.
SIDES = ("upper", "lower", "both")
P = TypeVar("P", "Contact", "Force")


#: Advice on parts that can't be given as data.
BY_HAND = (
    "Write the equations of the modes with @sl.system: sl.structure_modes(mass, stiffness, "
    "modes) gives their frequencies and shapes."
)
#: Advice on arguments that a contact or a force lacks.
_ELSEWHERE = {
    "restitution": "A contact is a spring, and loses energy by damping=. " + BY_HAND.replace(
        "Write", "For a rigid stop, sl.impact, write"),
    "friction": "A contact pushes along its degree of freedom only. " + BY_HAND.replace(
        "Write", "For sl.friction write"),
    **dict.fromkeys(("power", "exponent"), "Its spring is linear. " + BY_HAND.replace(
        "Write", "For sl.hertz write")),
    "preload": "Its force begins at zero. A preload is a constant force, "
        "sl.Force(at, amplitude, harmonic=0), or a negative gap=.",
    "phase_deg": "Write phase=\"90 deg\".",
    "frequency": "All forces have the frequency= of sl.structure, or a multiple of it, harmonic=.",
    "direction": "Give one sl.Force for each degree of freedom.",
    "node": "Write at=, the name of a degree of freedom.",
    "dof": "Write at=, the name of a degree of freedom.",
    "k": "Write stiffness=.", "c": "Write damping=.", "clearance": "Write gap=.",
}  # fmt: skip


def _answered(kind: type[P]) -> type[P]:
    """Answer wrong arguments of a part in words."""
    made = kind.__init__

    @functools.wraps(made)
    def called(self: Any, *args: Any, **given: Any) -> None:
        _check_names(kind, given, len(args))
        made(self, *args, **given)

    kind.__init__ = called  # type: ignore[method-assign]
    return kind


def _check_names(kind: type[Any], given: Mapping[Any, Any], places: int = 0) -> None:
    """Raise a ParameterError for unknown or missing arguments of a part."""
    allowed = [field.name for field in fields(kind)]
    for name in given:
        if not among(name, allowed):
            advice = _ELSEWHERE.get(name) if isinstance(name, str) else None
            raise ParameterError(
                f"a {kind.__name__} has no {shown(name)}. {advice or nearest(name, allowed)}"
            )
    if places > len(allowed) or set(given) & set(allowed[:places]):
        raise ParameterError(f"write sl.{kind.__name__}({', '.join(allowed[:3])}, ...).")
    needed = [field.name for field in fields(kind) if field.default is MISSING]
    if missing := [name for name in needed[places:] if name not in given]:
        raise ParameterError(f"a {kind.__name__} needs {', '.join(missing)}.")


@_answered
@dataclass(frozen=True)
class Contact:
    """A spring behind a gap, with or without a damper, between a degree of freedom and the ground
    or between two.

    Attributes
    ----------
    at : str
        The degree of freedom.
    stiffness : float or str
        Spring rate in contact [N/m].
    gap : float or str
        Clearance [m]: contact begins where the deflection is ``gap`` (``upper``), ``-gap``
        (``lower``), or at either (``both``).
    to : str, optional
        The other degree of freedom: the deflection is that of ``at`` minus that of ``to``. Default:
        the ground.
    side : {"upper", "lower", "both"}
        On which side there is contact.
    damping : float or str, optional
        Viscous damping in contact only [N*s/m]. Default: none.
    name : str, optional
        Its parameters are ``NAME_gap``, ``NAME_stiffness`` and ``NAME_damping``. Default ``stop``;
        ``stop1``, ``stop2``, ... if several have none.
    """

    at: str
    stiffness: float | str
    gap: float | str
    to: str | None = None
    side: str = "upper"
    damping: float | str | None = None
    name: str | None = None


@_answered
@dataclass(frozen=True)
class Force:
    """A harmonic force ``amplitude*cos(2*pi*harmonic*frequency*t + phase)`` on a degree of freedom.

    Attributes
    ----------
    at : str
        The degree of freedom.
    amplitude : float or str
        Its amplitude [N].
    phase : float or str, optional
        Its phase [rad]. Default: none.
    harmonic : int
        Multiple of the forcing frequency; 0 is a constant force.
    name : str, optional
        Its parameters are ``NAME`` and ``NAME_phase``. Default ``force``; ``force1``, ... if
        several have none.
    """

    at: str
    amplitude: float | str
    phase: float | str | None = None
    harmonic: int = 1
    name: str | None = None


def parts(kind: type[P], given: Any, word: str, known: Iterable[str]) -> list[tuple[str, P]]:
    """Contacts or forces with their names.

    Parameters
    ----------
    kind : type
        Contact or Force.
    given : sequence
        Of them, or of mappings of their arguments.
    word : str
        Their default name.
    known : iterable of str
        Names of the degrees of freedom.

    Raises
    ------
    ParameterError
        If one of them can't be used.
    """
    if isinstance(given, Contact | Force | Mapping) or not isinstance(given, Iterable):
        raise must_be(f"{word}s", "a list of them", given)
    degrees = list(known)
    found = [part if isinstance(part, kind) else _made(kind, part) for part in given]
    unnamed = [part for part in found if part.name is None]
    numbers = iter(range(1, len(unnamed) + 1))
    names = [
        (word if len(unnamed) == 1 else f"{word}{next(numbers)}")
        if part.name is None
        else part.name
        for part in found
    ]
    for name, part in zip(names, found, strict=True):
        if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
            raise ParameterError(f"{shown(name)} can't be the name of a {word}: use letters, "
                                 f"digits and _.")  # fmt: skip
        if name in degrees:
            raise ParameterError(
                f"a {word} is called {name!r}, as a degree of freedom is. Give it another name=."
            )
        if names.count(name) > 1:
            raise ParameterError(f"two {word}s are called {name!r}. Give each its own name=.")
        _check(name, part, degrees)
    return list(zip(names, found, strict=True))


def _made(kind: type[P], given: Any) -> P:
    allowed = [field.name for field in fields(kind)]
    if not isinstance(given, Mapping):
        raise ParameterError(
            f"write sl.{kind.__name__}({', '.join(allowed[:3])}, ...), or a mapping of these "
            f"names, not {shown(given)}."
        )
    _check_names(kind, given)
    return kind(**given)


def _check(name: str, part: Contact | Force, known: list[str]) -> None:
    """Raise a ParameterError for a part without a valid degree of freedom."""
    places = [part.at] + ([part.to] if isinstance(part, Contact) and part.to is not None else [])
    for place in places:
        if not among(place, known):
            raise ParameterError(
                f"{name}: {shown(place)} is no degree of freedom. {_named(place, known)}"
            )
    if len(places) == 2 and places[0] == places[1]:
        raise ParameterError(f"{name}: at and to are both {places[0]!r}.")
    if isinstance(part, Force) and callable(part.amplitude):
        raise ParameterError(
            f"{name}: a structure takes harmonic forces, amplitude*cos(2*pi*frequency*t), and no "
            f"record or function of the time. {BY_HAND}"
        )
    if isinstance(part, Contact):
        one_of(SIDES, f"{name}: ", side=part.side)
    if isinstance(part, Force) and (
        isinstance(part.harmonic, bool)
        or not isinstance(part.harmonic, int | np.integer)
        or part.harmonic < 0
    ):
        raise ParameterError(f"{name}: harmonic must be a whole number, 0 or more.")


def _named(degree: Any, known: list[str]) -> str:
    """Advice on a degree of freedom that is given by its number or misspelt."""
    number = isinstance(degree, int | np.integer) and not isinstance(degree, bool)
    if number and 1 <= degree <= len(known):
        return f"They are given by name: number {degree} is {known[degree - 1]!r}, counted from 1."
    return nearest(degree, known)


def direction(part: Contact | Force, names: list[str]) -> np.ndarray:
    """The vector b of a part: its deflection is b.x, its force acts along b."""
    vector = np.zeros(len(names))
    vector[names.index(part.at)] = 1.0
    if isinstance(part, Contact) and part.to is not None:
        vector[names.index(part.to)] = -1.0
    return vector
