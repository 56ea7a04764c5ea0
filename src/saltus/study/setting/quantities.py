"""Quantities of a study, from text with units to SI: every quantity with a dimension must show its
unit.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from saltus.errors import ParameterError, StudyError, UnitError, listed, nearest
from saltus.study.tables.toml import fault
from saltus.system.structures.told import by_modes
from saltus.units import to_si

if TYPE_CHECKING:
    from saltus.study.tables.parts import Quantity, Range, Start, Starts
    from saltus.system import System


def number(value: Quantity, unit: str, place: str, key: str) -> float:
    """One quantity in SI.

    Parameters
    ----------
    value : float or str
        As written in the study.
    unit : str
        Coherent SI unit of the quantity; ``"1"`` for a plain number, ``""`` if not known.
    place, key : str
        Table and key, for the message.

    Raises
    ------
    StudyError
        If a quantity with a dimension is a bare number, or its unit is the wrong one.
    """
    if not isinstance(value, str) and unit not in ("", "1"):
        raise StudyError(
            f"[{place}] {key} = {value:g} has no unit. Write it with one, for example "
            f'{key} = "{value:g} {unit}".'
        )
    try:
        return to_si(value, unit, key)
    except (ParameterError, UnitError) as error:
        raise fault(place, error) from None


def parameters(
    system: System, values: Mapping[str, Quantity], place: str = "system"
) -> dict[str, float]:
    """Parameter values in SI. Raises StudyError for a name that the system doesn't have, or for a
    missing unit.
    """
    return {
        name: number(value, _unit(system, name, system.values, place), place, name)
        for name, value in values.items()
    }


def states(system: System, table: Mapping[str, Quantity], place: str) -> dict[str, float]:
    """Values of some states in SI. Raises StudyError for an unknown state or a missing unit."""
    return {
        name: number(value, _unit(system, name, _shown(system), place), place, name)
        for name, value in table.items()
    }


def levels(system: System, table: Mapping[str, Quantity], place: str) -> dict[str, float]:
    """Values of some states or outputs in SI. Raises StudyError for an unknown one or a missing
    unit.
    """
    outputs = dict(zip(system.outputs.names, system.outputs.units, strict=True))
    known = (*system.states, *outputs)
    return {
        name: number(
            value,
            outputs[name] if name in outputs else _unit(system, name, known, place),
            place,
            name,
        )
        for name, value in table.items()
    }


def start(
    system: System, table: Mapping[str, Start], place: str = "simulate"
) -> dict[str, float | list[float]]:
    """Start in SI: a number for each state, or for some sensors of a structure by its modes, whose
    rest is an empty table; or a list for a batch.

    Raises
    ------
    StudyError
        If a state is missing or unknown, lists differ in length, or a unit is missing.
    """
    known, units = system.states, dict(system.units)
    if table and by_modes(system) and not any(name in known for name in table):
        known = system.outputs.names
        units = dict(zip(known, system.outputs.units, strict=True))
    elif by_modes(system) and not table:
        return {}
    elif missing := [state for state in known if state not in table]:
        raise StudyError(
            f"[{place}] start lacks {listed(missing)}. {system.name} has the states "
            f"{listed(known)}."
        )
    is_batch(table, place=place)
    place = f"{place}.start"
    for name in table:
        _unit(system, name, known, place)
    return {name: _numbers(value, units[name], place, name) for name, value in table.items()}


def starts(
    system: System, given: Starts | None, place: str
) -> dict[str, float | list[float]] | str | None:
    """Starts of an analysis that follows many: states in SI, or text such as ``"sweep_up"``, which
    the analysis reads.
    """
    return given if given is None or isinstance(given, str) else start(system, given, place)


def box(
    system: System, given: Mapping[str, list[Quantity]] | None, place: str
) -> dict[str, list[float]] | None:
    """Ranges of states in SI, or of what sensors of a structure by its modes show."""
    if given is None:
        return None
    place, known = f"{place}.box", system.states
    if by_modes(system) and not any(name in known for name in given):
        known = system.outputs.names
    return {
        name: [number(end, _unit(system, name, known, place), place, name) for end in ends]
        for name, ends in given.items()
    }


def ranges(
    system: System, given: Mapping[str, list[Quantity]], place: str
) -> dict[str, tuple[float, float]]:
    """Ranges of parameters in SI."""
    found = {}
    for name, (low, high) in given.items():
        unit = _unit(system, name, system.values, place)
        found[name] = (number(low, unit, place, name), number(high, unit, place, name))
    return found


def grid(system: System, name: str, given: Range, place: str) -> tuple[Any, ...] | list[float]:
    """Values of a parameter in SI: (first, last, count, scale), or a list of the
    values themselves.
    """
    return _values(given, _unit(system, name, system.values, place), name, place)


def axes(
    system: System, table: Mapping[str, Range], place: str
) -> dict[str, tuple[Any, ...] | list[float]]:
    """Starts along some states in SI: (first, last, count, scale), or a list of the starts
    themselves.
    """
    known = _shown(system)
    return {
        name: _values(given, _unit(system, name, known, place), name, place)
        for name, given in table.items()
    }


def _shown(system: System) -> tuple[str, ...]:
    """Names that a map may be drawn over: states, and sensors of a structure by its modes."""
    return (*system.states, *(system.outputs.names if by_modes(system) else ()))


def _values(given: Range, unit: str, name: str, place: str) -> tuple[Any, ...] | list[float]:
    if given.values is not None:
        return [number(value, unit, place, name) for value in given.values]
    assert given.first is not None
    assert given.last is not None
    return (
        number(given.first, unit, place, f"{name}.first"),
        number(given.last, unit, place, f"{name}.last"),
        given.count,
        given.scale,
    )


def varied(
    system: System, table: Mapping[str, list[Quantity]], place: str = "simulate.values"
) -> dict[str, list[float]]:
    """Values that differ from trajectory to trajectory, in SI: a list for each parameter."""
    return {
        name: [
            number(value, _unit(system, name, system.values, place), place, name) for value in row
        ]
        for name, row in table.items()
    }


def is_batch(*tables: Mapping[str, Start], place: str = "simulate") -> bool:
    """True if there are lists among the values. Raises StudyError if two lists differ in length, or
    one is empty.
    """
    lengths = {
        name: len(value)
        for part in tables
        for name, value in part.items()
        if isinstance(value, list)
    }
    if len(set(lengths.values())) > 1 or 0 in lengths.values():
        sizes = ", ".join(f"{name} has {length}" for name, length in lengths.items())
        raise StudyError(f"[{place}] lists must have the same length, at least 1: {sizes}.")
    return bool(lengths)


def _numbers(value: Start, unit: str, place: str, key: str) -> float | list[float]:
    if isinstance(value, list):
        return [number(one, unit, place, key) for one in value]
    return number(value, unit, place, key)


def _unit(
    system: System, name: str, known: Mapping[str, float] | tuple[str, ...], place: str
) -> str:
    if name not in known:
        raise StudyError(f"[{place}] {name!r} is unknown to {system.name}. {nearest(name, known)}")
    outputs = dict(zip(system.outputs.names, system.outputs.units, strict=True))
    return system.units.get(name, outputs.get(name, ""))
