"""Arguments of an analysis, from the table of its question: quantities in SI, formulas traced."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from saltus.study.setting import quantities
from saltus.study.tables.methods import OWN_METHOD
from saltus.study.tables.signature import verb

if TYPE_CHECKING:
    from saltus.study.setting.setting import Setting
    from saltus.study.tables.signature import Generated
    from saltus.system import System


def system_of_question(table: Generated, setting: Setting, place: str) -> System:
    """The study's system with the values of one question that hold for all its trajectories. Raises
    StudyError.
    """
    values = getattr(table, "values", {})
    start = getattr(table, "start", None)
    quantities.is_batch(start if isinstance(start, dict) else {}, values, place=place)
    return setting.system(
        {name: value for name, value in values.items() if not isinstance(value, list)},
        f"{place}.values",
    )


def arguments(table: Generated, system: System, setting: Setting, place: str) -> dict[str, Any]:
    """Arguments of the analysis, except the system and the method.

    Parameters
    ----------
    table : Generated
        As the study has it.
    system : System
        With the values of this question.
    setting : Setting
        Of the study.
    place : str
        Name of the table, for messages.

    Raises
    ------
    StudyError, UnitError, ParameterError
        If a value doesn't fit the system.
    """
    found: dict[str, Any] = {}
    for name, kind in table.kinds.items():
        value = getattr(table, name)
        if kind is not OWN_METHOD:
            written = kind.convert and name in table.model_fields_set and value is not None
            found[name] = (
                _READINGS[kind.convert](value, _At(system, setting, place, name))
                if written
                else None
                if value == {}
                else value
            )
    return found


# -- readings, by what the kind of a key names -----------------------------------------------------
@dataclass(frozen=True)
class _At:
    """Place of a key."""

    system: System
    setting: Setting
    place: str
    key: str


def _transient(value: Any, at: _At) -> float:
    """Transient: forcing periods, or a time for a system without forcing [s]."""
    forced = at.system.forced_at is not None
    found = quantities.number(value, "1" if forced else "s", at.place, at.key)
    return int(found) if forced and found == int(found) else found


def _values(value: Any, at: _At) -> dict[str, list[float]] | None:
    """Values that differ from trajectory to trajectory."""
    return (
        quantities.varied(
            at.system,
            {name: one for name, one in value.items() if isinstance(one, list)},
            f"{at.place}.{at.key}",
        )
        or None
    )


def _vary(value: Any, at: _At) -> dict[str, Any]:
    return {
        name: quantities.grid(at.system, name, one, f"{at.place}.{at.key}")
        for name, one in value.items()
    }


def _period(value: Any, at: _At) -> float | tuple[float, ...]:
    """Period: a time, or the two ends of a range of times [s]."""
    ends = value if isinstance(value, list) else [value]
    found = tuple(quantities.number(one, "s", at.place, at.key) for one in ends)
    return found if isinstance(value, list) else found[0]


_READINGS: dict[str, Callable[[Any, _At], Any]] = {
    "start": lambda value, at: quantities.starts(at.system, value, at.place),
    "box": lambda value, at: quantities.box(at.system, value, at.place),
    "time": lambda value, at: quantities.number(value, "s", at.place, at.key),
    "times": lambda value, at: [quantities.number(one, "s", at.place, at.key) for one in value],
    "transient": _transient,
    "period": _period,
    "values": _values,
    "frequency": lambda value, at: quantities.grid(
        at.system, str(at.system.forced_at), value, f"{at.place}.{at.key}"
    ),
    "vary": _vary,
    "ranges": lambda value, at: quantities.ranges(at.system, value, f"{at.place}.{at.key}"),
    "outputs": lambda value, at: at.setting.outputs(at.system, value, at.place),
    "balance": lambda value, _: verb("HarmonicBalance")(
        **value.model_dump(include=value.model_fields_set)
    ),
    "at": lambda value, at: quantities.states(at.system, value, f"{at.place}.{at.key}"),
}
