"""Contacts and forces of a structure, as data."""

from __future__ import annotations

import functools
import keyword
from collections.abc import Iterable, Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Any, TypeVar

import numpy as np

from saltus.errors import ParameterError, among, must_be, nearest, one_of, shown

#: Where a contact begins: above its gap, below minus its gap, or at both.
SIDES = ("upper", "lower", "both")
P = TypeVar("P", "Contact", "Force")


#: How to write what is no part of a structure.
BY_HAND = (
    "Write the equations of the modes with @sl.system: sl.structure_modes(mass, stiffness, "
    "modes) gives their frequencies and shapes."
)
#: What people ask of a contact or a force that has no such argument, and what to do.
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
    """A part whose wrong arguments are answered in words."""
    made = kind.__init__

    @functools.wraps(made)
    def called(self: Any, *args: Any, **given: Any) -> None:
        _check_names(kind, given, len(args))
        made(self, *args, **given)

    kind.__init__ = called  # type: ignore[method-assign]
    return kind


def _check_names(kind: type[Any], given: Mapping[Any, Any], places: int = 0) -> None:
    """Raise a ParameterError for arguments that a part hasn't, or that it needs."""
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
        How they are called by default.
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
    found = [one if isinstance(one, kind) else _made(kind, one) for one in given]
    unnamed = [one for one in found if one.name is None]
    numbers = iter(range(1, len(unnamed) + 1))
    names = [
        (word if len(unnamed) == 1 else f"{word}{next(numbers)}") if one.name is None else one.name
        for one in found
    ]
    for name, one in zip(names, found, strict=True):
        if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
            raise ParameterError(f"{shown(name)} can't be the name of a {word}: use letters, "
                                 f"digits and _.")  # fmt: skip
        if name in degrees:
            raise ParameterError(
                f"a {word} is called {name!r}, as a degree of freedom is. Give it another name=."
            )
        if names.count(name) > 1:
            raise ParameterError(f"two {word}s are called {name!r}. Give each its own name=.")
        _check(name, one, degrees)
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


def _check(name: str, one: Contact | Force, known: list[str]) -> None:
    """Raise a ParameterError for a part that names no degree of freedom, or something else."""
    places = [one.at] + ([one.to] if isinstance(one, Contact) and one.to is not None else [])
    for place in places:
        if not among(place, known):
            raise ParameterError(
                f"{name}: {shown(place)} is no degree of freedom. {_named(place, known)}"
            )
    if len(places) == 2 and places[0] == places[1]:
        raise ParameterError(f"{name}: at and to are both {places[0]!r}.")
    if isinstance(one, Force) and callable(one.amplitude):
        raise ParameterError(
            f"{name}: a structure takes harmonic forces, amplitude*cos(2*pi*frequency*t), and no "
            f"record or function of the time. {BY_HAND}"
        )
    if isinstance(one, Contact):
        one_of(SIDES, f"{name}: ", side=one.side)
    if isinstance(one, Force) and (
        isinstance(one.harmonic, bool)
        or not isinstance(one.harmonic, int | np.integer)
        or one.harmonic < 0
    ):
        raise ParameterError(f"{name}: harmonic must be a whole number, 0 or more.")


def _named(place: Any, known: list[str]) -> str:
    """What to write for a degree of freedom, given by its number or misspelt."""
    number = isinstance(place, int | np.integer) and not isinstance(place, bool)
    if number and 1 <= place <= len(known):
        return f"They are given by name: number {place} is {known[place - 1]!r}, counted from 1."
    return nearest(place, known)


def direction(one: Contact | Force, names: list[str]) -> np.ndarray:
    """The vector b of a part: its deflection is b.x, its force acts along b."""
    vector = np.zeros(len(names))
    vector[names.index(one.at)] = 1.0
    if isinstance(one, Contact) and one.to is not None:
        vector[names.index(one.to)] = -1.0
    return vector
