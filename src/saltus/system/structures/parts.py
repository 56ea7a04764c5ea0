"""Contacts, forces and the moving base of a structure, as data."""

from __future__ import annotations

import fnmatch
import functools
import keyword
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING, dataclass, field, fields
from typing import Any, TypeAlias, TypeVar

import numpy as np

from saltus.errors import ParameterError, among, must_be, nearest, one_of, shown
from saltus.units import to_si

#: Sides on which contact begins: above the gap, below minus the gap, or both.
SIDES = ("upper", "lower", "both")
#: Largest exponent of the depth of a contact.
MOST_POWER = 5
#: Signs at the end of a name that number degrees of freedom of one kind.
_NUMBERS = "_0123456789"
#: Names that no part can have, and what they are the names of.
RESERVED = {"t": "the time", "frequency": "the forcing frequency"}
P = TypeVar("P", "Contact", "Force", "Base")

#: Advice on arguments that a part lacks or calls otherwise.
_ELSEWHERE = {
    **dict.fromkeys(("exponent", "hertz"), "Write power=1.5."),
    **dict.fromkeys(("e", "cor", "bounce"), "Write restitution=."),
    **dict.fromkeys(("mu", "coefficient"), "Write friction=, and sliding= for the degree of "
        "freedom along which the contact slides."),
    **dict.fromkeys(("tangential", "slip", "slip_velocity"), "Write sliding=, the degree of "
        "freedom along which the contact slides."),
    "phase_deg": "Write phase=\"90 deg\".",
    "frequency": "All drives have the frequency= of sl.structure, or a multiple of it, harmonic=.",
    "scale": "Its parameter NAME_scale is 1: give another by system.with_values(...).",
    "acceleration": "Write amplitude=, a value, a record or a function of the time.",
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
    allowed = [one.name for one in fields(kind)]
    for name in given:
        if not among(name, allowed):
            advice = _ELSEWHERE.get(name) if isinstance(name, str) else None
            raise ParameterError(
                f"a {kind.__name__} has no {shown(name)}. {advice or nearest(name, allowed)}"
            )
    if places > len(allowed) or set(given) & set(allowed[:places]):
        raise ParameterError(f"write sl.{kind.__name__}({', '.join(allowed[:3])}, ...).")
    needed = [
        one.name for one in fields(kind) if one.default is MISSING or "needed" in one.metadata
    ]
    given_by_place = allowed[:places]
    if missing := [name for name in needed if name not in (*given, *given_by_place)]:
        raise ParameterError(f"a {kind.__name__} needs {', '.join(missing)}.")


@_answered
@dataclass(frozen=True)
class Contact:
    """A stop behind a gap, between a degree of freedom and the ground or between two: a spring,
    with or without a damper, or a rigid stop.

    Attributes
    ----------
    at : str
        The degree of freedom.
    stiffness : float or str, optional
        Spring rate in contact [N/m]; with a ``power`` [N/m**power]. A rigid stop has none.
    gap : float or str
        Clearance [m]: contact begins where the deflection is ``gap`` (``upper``), ``-gap``
        (``lower``), or at either (``both``). A negative gap of one side is an interference.
    to : str, optional
        The other degree of freedom: the deflection is that of ``at`` minus that of ``to``. Default:
        the ground, which moves with the base.
    side : {"upper", "lower", "both"}
        On which side there is contact.
    damping : float or str, optional
        Viscous damping in contact only [N*s/m]. Default: none.
    name : str, optional
        Its parameters are ``NAME_gap``, ``NAME_stiffness`` and so on. Default ``stop``; ``stop1``,
        ``stop2``, ... if several have none.
    restitution : float or str, optional
        Of a rigid stop: the coefficient of restitution [1], from 0 (no rebound) to 1 (no loss). It
        takes the place of ``stiffness``.
    power : float, optional
        Exponent of the depth, 1 or more: 1.5 for curved bodies (Hertz). Default: 1, a spring.
    preload : float or str, optional
        Constant force that presses the degree of freedom onto the stop, in contact or not [N]. Of
        one side only.
    friction : float or str, optional
        Coefficient of dry friction [1], times the force with which the stop is pressed; with
        ``sliding``. That of a rigid stop needs ``restitution=0``. A damped stop with friction
        doesn't pull: its contact ends where its force is zero.
    sliding : str or pair of str, optional
        The degree of freedom along which the contact slides, or two, whose difference slides.
    """

    at: str
    stiffness: float | str | None = None
    gap: float | str | None = field(default=None, metadata={"needed": True})
    to: str | None = None
    side: str = "upper"
    damping: float | str | None = None
    name: str | None = None
    restitution: float | str | None = None
    power: float | None = None
    preload: float | str | None = None
    friction: float | str | None = None
    sliding: str | tuple[str, str] | None = None


#: A value, or a function of the time: a record, a sweep, ``lambda t: ...``.
Drive: TypeAlias = float | str | Callable[..., Any]


@_answered
@dataclass(frozen=True)
class Force:
    """A force on a degree of freedom: harmonic, ``amplitude*cos(2*pi*harmonic*frequency*t +
    phase)``, or any function of the time.

    Attributes
    ----------
    at : str
        The degree of freedom.
    amplitude : float, str or callable
        Its amplitude [N]; or a function of the time that gives the force: ``sl.recorded(...)``,
        ``sl.sweep(...)``, ``lambda t: ...``, or ``lambda t, frequency: ...`` with the period of the
        forcing frequency.
    phase : float or str, optional
        Phase of a harmonic force [rad]. Default: none.
    harmonic : int
        Multiple of the forcing frequency; 0 is a constant force.
    name : str, optional
        Its parameters are ``NAME`` and ``NAME_phase``, that of a function of the time
        ``NAME_scale``, by which it is multiplied. Default ``force``; ``force1``, ... if several
        have none.
    """

    at: str
    amplitude: Drive
    phase: float | str | None = None
    harmonic: int = 1
    name: str | None = None


@_answered
@dataclass(frozen=True)
class Base:
    """The acceleration of a base that moves. Deflections are then relative to the base, and the
    force is ``-mass @ direction * acceleration``.

    Attributes
    ----------
    direction : str, sequence or mapping
        How the structure moves when the base moves by 1: names of the degrees of freedom that move
        with it, where ``"z"`` stands for z, z1, z_2, z_1_2, ... and ``"w_*"`` for all that begin
        so; or the motion of each, as a vector or by name.
    amplitude : float, str or callable
        Its acceleration [m/s^2]: the amplitude of a harmonic one, or a function of the time as of
        :class:`Force`.
    phase, harmonic
        As of :class:`Force`.
    name : str, optional
        As of :class:`Force`; default ``base``.
    """

    direction: Any
    amplitude: Drive
    phase: float | str | None = None
    harmonic: int = 1
    name: str | None = None


def parts(kind: type[P], given: Any, word: str, known: Iterable[str]) -> list[tuple[str, P]]:
    """Contacts, forces or bases with their names.

    Parameters
    ----------
    kind : type
        Contact, Force or Base.
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
    alone = isinstance(given, Contact | Force | Base | Mapping | str)
    if alone or not isinstance(given, Iterable):
        argument = {Contact: "contacts", Force: "forces"}.get(kind, "base")
        raise must_be(argument, f"a list of sl.{kind.__name__}(...)", given)
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
            raise ParameterError(
                f"{shown(name)} can't be the name of a {word}: use letters, digits and _."
            )
        if name in RESERVED:
            raise ParameterError(
                f"a {word} can't be called {name!r}, the name of {RESERVED[name]}. Give it another "
                f"name=."
            )
        if name in degrees:
            raise ParameterError(
                f"a {word} is called {name!r}, as a degree of freedom is. Give it another name=."
            )
        if names.count(name) > 1:
            raise ParameterError(f"two {word}s are called {name!r}. Give each its own name=.")
        _check(name, part, degrees)
    return list(zip(names, found, strict=True))


def _made(kind: type[P], given: Any) -> P:
    allowed = [one.name for one in fields(kind)]
    if not isinstance(given, Mapping):
        raise ParameterError(
            f"write sl.{kind.__name__}({', '.join(allowed[:3])}, ...), or a mapping of these "
            f"names, not {shown(given)}."
        )
    _check_names(kind, given)
    return kind(**given)


def _check(name: str, part: Contact | Force | Base, known: list[str]) -> None:
    """Raise a ParameterError for a part that can't be used."""
    if isinstance(part, Base):
        direction(part, known)
    else:
        _check_places(name, [part.at], known)
    if isinstance(part, Contact):
        _check_contact(name, part, known)
    elif (
        isinstance(part.harmonic, bool)
        or not isinstance(part.harmonic, int | np.integer)
        or part.harmonic < 0
    ):
        raise ParameterError(f"{name}: harmonic must be a whole number, 0 or more.")
    else:
        _check_amplitude(name, part)


def _check_amplitude(name: str, part: Force | Base) -> None:
    kind, unit = ("acceleration", "m/s^2") if isinstance(part, Base) else ("force", "N")
    amplitude: Any = part.amplitude
    if amplitude is None:
        raise ParameterError(
            f"{name}: the {kind} needs amplitude=, such as '2 {unit}', or a function of the time."
        )
    if callable(amplitude) and (part.phase is not None or part.harmonic != 1):
        raise ParameterError(
            f"{name}: phase= and harmonic= are those of a harmonic {kind}, and this is a function "
            f"of the time."
        )
    if isinstance(amplitude, list | tuple | Mapping) or np.ndim(amplitude):
        raise ParameterError(
            f"{name}: the {kind} is a value, such as '2 {unit}', or a function of the time. Of a "
            f"measured series write sl.recorded(times, values, '{unit}')."
        )


def _check_places(name: str, places: Sequence[Any], known: list[str]) -> None:
    for place in places:
        if not among(place, known):
            raise ParameterError(
                f"{name}: {shown(place)} is no degree of freedom. {named(place, known)}"
            )
    if len(places) == 2 and places[0] == places[1]:
        raise ParameterError(f"{name}: at and to are both {places[0]!r}.")


def _check_contact(name: str, part: Contact, known: list[str]) -> None:
    one_of(SIDES, f"{name}: ", side=part.side)
    if part.to is not None:
        _check_places(name, [part.at, part.to], known)
    if part.gap is None:
        raise ParameterError(f"{name}: a Contact needs gap, such as gap='1 mm'.")
    if (part.stiffness is None) == (part.restitution is None):
        raise ParameterError(
            f"{name}: a stop is a spring, by stiffness= and damping=, or rigid, by restitution=. "
            f"Give one of the two."
        )
    sprung = any(one is not None for one in (part.damping, part.power))
    if part.restitution is not None and sprung:
        raise ParameterError(
            f"{name}: damping= and power= are those of a spring, and a rigid stop has none. It "
            f"loses energy by restitution=."
        )
    if part.power is not None and not (
        isinstance(part.power, int | float) and not isinstance(part.power, bool)
        and 1 <= part.power <= MOST_POWER
    ):  # fmt: skip
        raise must_be(f"{name}: power", f"a number from 1 to {MOST_POWER}", part.power)
    if part.preload is not None and part.side == "both":
        raise ParameterError(
            f"{name}: a preload presses onto one side. Write side='upper' or side='lower'."
        )
    _check_friction(name, part, known)


def _check_friction(name: str, part: Contact, known: list[str]) -> None:
    if (part.friction is None) != (part.sliding is None):
        raise ParameterError(
            f"{name}: friction= and sliding= come together: the coefficient, and the degree of "
            f"freedom along which the contact slides, such as sliding={shown(known[-1])}."
        )
    if part.sliding is None:
        return
    pair = part.sliding if isinstance(part.sliding, tuple | list) else (part.sliding,)
    if not 1 <= len(pair) <= 2:
        raise must_be(f"{name}: sliding", "a degree of freedom, or two of them", part.sliding)
    _check_places(name, pair, known)
    if np.array_equal(np.abs(vector_of(pair, known)), np.abs(direction(part, known))):
        raise ParameterError(
            f"{name}: it slides along {shown(part.sliding)}, along which it is pressed too. Give "
            f"another sliding=."
        )
    if to_si(part.friction, "1", f"{name}_friction") < 0:
        raise must_be(f"{name}: friction", "0 or more", part.friction)
    if part.restitution is not None and to_si(part.restitution, "1", f"{name}_restitution") != 0:
        raise ParameterError(
            f"{name}: a rigid stop with friction has no rebound, restitution=0: how a blow rubs "
            f"doesn't follow from a coefficient of friction."
        )


def named(degree: Any, known: list[str]) -> str:
    """Advice on a degree of freedom that is given by its number or misspelt."""
    number = isinstance(degree, int | np.integer) and not isinstance(degree, bool)
    if number and 1 <= degree <= len(known):
        return f"They are given by name: number {degree} is {known[degree - 1]!r}, counted from 1."
    return nearest(degree, known)


def vector_of(places: Sequence[str], names: list[str]) -> np.ndarray:
    """The vector of a degree of freedom, or of the difference of two."""
    vector = np.zeros(len(names))
    for place, factor in zip(places, (1.0, -1.0), strict=False):
        vector[names.index(place)] = factor
    return vector


def direction(part: Contact | Force | Base, names: list[str]) -> np.ndarray:
    """The vector b of a part: the deflection of a contact is b.x, a force acts along b, and a base
    that moves by 1 moves the structure by b.
    """
    if isinstance(part, Base):
        return _moved(part.direction, names)
    to = part.to if isinstance(part, Contact) else None
    return vector_of([part.at] if to is None else [part.at, to], names)


def ways_of(contact: Contact, names: list[str]) -> list[np.ndarray]:
    """The directions in which a contact presses and, if it is rough, slides."""
    pair = [contact.sliding] if isinstance(contact.sliding, str) else contact.sliding
    return [direction(contact, names), *([] if pair is None else [vector_of(pair, names)])]


def _moved(given: Any, names: list[str]) -> np.ndarray:
    """The motion of each degree of freedom with the base."""
    if isinstance(given, str):
        vector = np.array([float(_matches(name, given)) for name in names])
        if not vector.any():
            stems = [name.rstrip(_NUMBERS) or name for name in names]
            raise ParameterError(
                f"base: {shown(given)} names no degree of freedom. {nearest(given, stems)} Give "
                f"names such as 'w', for w1, w_2, ..., or a vector."
            )
        return vector
    if isinstance(given, Mapping):
        for place in given:
            _check_places("base", [place], names)
        given = [given.get(name, 0.0) for name in names]
    try:
        vector = np.array(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise must_be(
            "base: direction", "names of degrees of freedom, or a vector", given
        ) from None
    if vector.shape != (len(names),) or not np.isfinite(vector).all() or not vector.any():
        raise ParameterError(
            f"base: a direction is a vector of {len(names)} finite numbers, not all zero, one each "
            f"degree of freedom; this has the shape {vector.shape}."
        )
    return vector


def _matches(name: str, pattern: str) -> bool:
    """True if a name is that of a pattern, with numbers behind it or without."""
    return fnmatch.fnmatchcase(name, pattern) or name.rstrip(_NUMBERS) == pattern
