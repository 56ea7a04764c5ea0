"""Structures of a study: matrices from its files, contacts and drives from its tables."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from saltus.errors import SaltusError, StudyError, nearest, shown
from saltus.study.setting import quantities
from saltus.study.tables.toml import fault
from saltus.system import (
    Base,
    Contact,
    Force,
    acceleration,
    contact_force,
    structure,
    velocity,
)
from saltus.system.structures import drives, laws
from saltus.system.structures.equations import UNITS
from saltus.system.structures.files import File

if TYPE_CHECKING:
    from saltus.study.setting.inputs import Inputs
    from saltus.study.tables.parts import Header, StudyTable
    from saltus.system import System
    from saltus.system.formula import Formulas

_PLACE = "system.structure"
#: Name of a part while its quantities are checked, before it has one.
_PART = "part"
#: A quantity: a number, alone or with a unit. Everything else is a formula.
_QUANTITY = re.compile(r"\s*[+-]?[\d.]+([eE][+-]?\d+)?\s*([A-Za-zµμΩ°%].*)?")
#: Names that the formula of a drive may hold.
_HELD = ("t", drives.FREQUENCY)


def structure_of(table: Any, inputs: Inputs, formulas: Formulas, header: Header | None) -> System:
    """The system of [system.structure].

    Raises
    ------
    StudyError
        If a file can't be read, a quantity has no unit, or a part can't be used.
    """
    given = _given(table)
    for key in ("mass", "stiffness", "damping"):
        if key in given:
            given[key] = File(given[key], inputs.read(given[key], _PLACE).data)
    units = UNITS[given.get("unit", "m")]
    length, (_, force, spring, damper, acceleration) = given.get("unit", "m"), units
    kinds: tuple[tuple[str, Any, Callable[[Any], Any]], ...] = (
        (
            "contacts",
            Contact,
            lambda one: laws.entries(_PART, one, (length, force, spring, damper)),
        ),
        ("forces", Force, lambda one: drives.entries(_PART, one, force)),
        ("base", Base, lambda one: drives.entries(_PART, one, acceleration)),
    )
    try:
        for key, kind, entries in kinds:
            place = f"{_PLACE}.{key}"
            given[key] = [
                kind(**_driven(_given(one), formulas, place)) for one in getattr(table, key)
            ]
            for one in given[key]:
                for name, value, unit in entries(one):
                    if value is not None and length:
                        key = name.removeprefix(_PART).lstrip("_") or "amplitude"
                        quantities.number(value, unit, place, key)
        if "sensors" in given:
            given["sensors"] = {name: _sensor(text) for name, text in given["sensors"].items()}
        if "frequency" in given:
            quantities.number(given["frequency"], "Hz", _PLACE, "frequency")
        title, source = (header.name, header.source) if header else ("structure", "")
        return structure(**given, name=title, source=source)
    except StudyError:
        raise
    except SaltusError as error:
        raise fault(_PLACE, error) from None


def _sensor(text: str) -> Any:
    """A sensor from its text, such as ``acceleration(w_30)`` or ``w_30 - w_12``. Raises StudyError
    if it can't be read.
    """
    kinds = {"velocity": velocity, "acceleration": acceleration, "contact_force": contact_force}
    found = re.fullmatch(r"\s*(\w+)\s*\((.*)\)\s*", text)
    kind, inner = found.groups() if found else ("", text)
    places = [one.strip() for one in inner.split(" - ")]
    if kind not in ("", *kinds) or len(places) > (1 if kind == "contact_force" else 2):
        raise StudyError(
            f"[{_PLACE}.sensors] {shown(text)} is no sensor. Write a degree of freedom, w_30, the "
            f"stretch between two, w_30 - w_12, velocity(...) or acceleration(...) of either, or "
            f"contact_force(stop)."
        )
    if kind:
        return kinds[kind](*places)
    return places[0] if len(places) == 1 else tuple(places)


def _given(table: StudyTable) -> dict[str, Any]:
    """The keys that a table has, with its tables as they are."""
    return {key: getattr(table, key) for key in table.model_fields_set}


def _driven(given: dict[str, Any], formulas: Formulas, place: str) -> dict[str, Any]:
    """The keys of a part; an amplitude that is no quantity is a formula."""
    amplitude = given.get("amplitude")
    if isinstance(amplitude, str) and not _QUANTITY.fullmatch(amplitude):
        given["amplitude"] = _function(amplitude, formulas, place)
    return given


def _function(text: str, formulas: Formulas, place: str) -> Callable[..., Any]:
    """The function of the time of a formula. Raises StudyError if it holds anything else."""
    try:
        formula = formulas.formula(text)
    except SaltusError as error:
        raise fault(place, error) from None
    if unknown := [name for name in formula.names if name not in _HELD]:
        raise StudyError(
            f"[{place}] {formula.place} holds {unknown[0]!r}, and the formula of a drive holds the "
            f"time t, frequency, terms and tables only."
            + (f" {nearest(unknown[0], formulas.tables)}" if formulas.tables else "")
        )
    if drives.FREQUENCY in formula.names:
        return lambda t, frequency: formula(
            **{name: {"t": t, drives.FREQUENCY: frequency}[name] for name in formula.names}
        )
    return lambda t: formula(**dict.fromkeys(formula.names, t))
