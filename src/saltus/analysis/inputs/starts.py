"""Convert a user's starts and values to the arrays of a request."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.analysis.inputs.axes import along, axes_of, count_along
from saltus.analysis.inputs.outputs import check_outputs
from saltus.errors import (
    MOST_IN_A_ROW,
    ParameterError,
    SaltusError,
    among,
    listed,
    must_be,
    shown,
    unknown,
)
from saltus.flow.room import check_room
from saltus.language import expression as ex
from saltus.sentences import Word
from saltus.system import System, check_values, repeats_by_formula
from saltus.system.structures.told import by_modes
from saltus.units import to_si

#: Most trajectories of a single call: the starts of more would fill the memory.
MOST_TRAJECTORIES = 100_000_000
#: Memory of a trajectory that keeps only its end [bytes].
TRAJECTORY = 200.0
#: Memory of each of its states [bytes].
TRAJECTORY_OF_A_STATE = 24.0

#: Most combinations of values whose periodicity is checked; each takes half a millisecond.
MOST_PERIOD_CHECKS = 2000


@dataclass(frozen=True)
class Ensemble:
    """Trajectories to run.

    Attributes
    ----------
    start : float64[n, D]
        States [SI].
    parameters : float64[1 or n, P]
        Values in the order of the system's.
    varied : mapping of str to float64[n]
        The parameters that differ between trajectories.
    batch : bool
        Whether the user gave many (or an array of one).
    """

    start: np.ndarray
    parameters: np.ndarray
    varied: Mapping[str, np.ndarray]
    batch: bool

    @property
    def size(self) -> int:
        """Number of trajectories."""
        return len(self.start)

    @classmethod
    def of(cls, start: np.ndarray, columns: Mapping[str, np.ndarray], batch: bool) -> Ensemble:
        """Trajectories from starts float64[n, D], with values float64[n] of all parameters."""
        varied = {name: column for name, column in columns.items() if np.ptp(column) > 0}
        return cls(start, np.stack([*columns.values()], axis=1), varied, batch)

    def rows(self, which: slice) -> Ensemble:
        """Some of the trajectories."""
        shared = len(self.parameters) == 1
        return Ensemble(
            self.start[which],
            self.parameters if shared else self.parameters[which],
            {name: column[which] for name, column in self.varied.items()},
            self.batch,
        )


def ensemble(system: System, start: Any, values: Mapping[str, Any] | None) -> Ensemble:
    """Starts and values of all trajectories, broadcast against each other.

    Parameters
    ----------
    system : System
        Names of states, parameters and their units.
    start : sequence, mapping or array
        One number (or text with a unit) per state; a mapping of state names to numbers or arrays;
        or an array (n, states). None: rest, all of them zero.
    values : mapping, optional
        Parameter values that replace the system's own: one each, or an array of n.

    Raises
    ------
    ParameterError, UnitError
        If a name is unknown, a number isn't finite, or lengths don't match.
    """
    check_system(system)
    if values is not None and not isinstance(values, Mapping):
        raise ParameterError(
            lambda say: (
                f"values must be a mapping, such as {say.key(values={'frequency': [5.0, 10.0]})}."
            )
        )
    _check_labels({**(start if isinstance(start, Mapping) else {}), **(values or {})})
    _check_count(system, trajectories(start, values))
    columns = _columns(system, np.zeros(len(system.states)) if start is None else start)
    given = {name: _values(system, name, value) for name, value in (values or {}).items()}
    empty = [name for name, value in given.items() if not np.size(value)]
    if empty:
        raise ParameterError(f"values of {empty[0]} are empty. Give at least one number.")
    deep = [name for name, value in given.items() if np.ndim(value) > 1]
    if deep:
        raise ParameterError(
            f"values of {deep[0]} must be one number or a one-dimensional array, "
            f"one for each trajectory."
        )
    count = _length({**columns, **given})
    states = np.stack(
        [np.broadcast_to(np.ravel(columns[name]), count) for name in system.states], axis=1
    ).astype(float)
    varied = {
        name: np.broadcast_to(np.ravel(value), count).astype(float)
        for name, value in given.items()
        if np.ndim(value)
    }
    shared = system.with_values(
        **{name: value for name, value in given.items() if not np.ndim(value)}
    ).values
    if varied:
        check_values(system, {**shared, **varied})
        _check_period_of_each(system, shared, varied, count)
        rows = [varied.get(name, np.full(count, value)) for name, value in shared.items()]
        return Ensemble(states, np.stack(rows, axis=1), varied, True)
    batch = any(np.ndim(one) for one in (*columns.values(), *given.values()))
    return Ensemble(states, np.array([list(shared.values())]), {}, batch)


def _length(columns: Mapping[str, Any]) -> int:
    """Number of trajectories that columns of numbers are for; 1 if all are single numbers. Raises
    ParameterError if their lengths don't match.
    """
    sizes = {name: np.size(array) for name, array in columns.items() if np.ndim(array)}
    count = max(sizes.values(), default=1)
    wrong = [f"{name} has {size}" for name, size in sizes.items() if size not in (1, count)]
    if wrong:
        raise ParameterError(
            f"starts and values must have one length: {', '.join(wrong)}, the longest has {count}."
        )
    return count


def trajectories(start: Any, values: Any) -> int:
    """Number of trajectories in given starts and values, counted before any array is made."""
    given = [*(start.values() if isinstance(start, Mapping) else ())]
    given += values.values() if isinstance(values, Mapping) else ()
    rows = 1 if isinstance(start, Mapping) or axes_of(start) != 2 else max(len(start), 1)
    return max([rows, *map(count_along, given)])


def _check_count(system: System, count: int) -> None:
    """Raise ParameterError for more trajectories than one call may hold."""
    if count > MOST_TRAJECTORIES:
        raise ParameterError(
            f"{count} trajectories in one call are too many for memory. Split them into calls of "
            f"{MOST_TRAJECTORIES} at most."
        )
    check_room(
        count * (TRAJECTORY + TRAJECTORY_OF_A_STATE * len(system.states)),
        f"{count} trajectories",
        "Split them into calls of fewer.",
    )


def _check_labels(given: Mapping[str, Any]) -> None:
    """Raise a ParameterError for columns of pandas or xarray with different labels, or labels in
    different order: columns are used row by row.
    """
    labelled = {
        name: labels for name, value in given.items() if (labels := _labels(value)) is not None
    }
    for name, labels in labelled.items():
        first = next(iter(labelled))
        if not labels.equals(labelled[first]):
            raise ParameterError(
                f"{first} and {name} have different labels in their index. Align them first, or "
                f"give plain numbers: .to_numpy()."
            )


def _labels(value: Any) -> Any:
    """The index of a Series, or of a DataArray with one dim; None for anything else."""
    if hasattr(value, "iloc"):
        return value.index
    return next(iter(value.indexes.values()), None) if hasattr(value, "indexes") else None


def check_system(system: Any) -> None:
    """Raise a ParameterError for anything that isn't a System, and for one with an output that has
    the name of another variable of results.
    """
    if isinstance(system, System):
        check_outputs(system)
        return
    name = getattr(system, "__name__", "")
    if callable(system) and str(getattr(system, "__module__", "")).startswith("saltus.models"):
        raise ParameterError(
            f"sl.models.{name} is the function that makes a System. Call it: sl.models.{name}()."
        )
    advice = (
        "Put @sl.system(states=...) above the function."
        if callable(system)
        else "Take one of sl.models, such as sl.models.delangre()."
    )
    if isinstance(system, Mapping) and "format" in system:
        advice = "Write sl.System.from_dict(...) of what System.to_dict() gave."
    raise ParameterError(f"the system must be a System, not {type(system).__name__}. {advice}")


def fill(
    system: System, columns: Mapping[str, np.ndarray], fixed: Mapping[str, float]
) -> np.ndarray:
    """States float64[k, D] from float64[k] for some of them; the others are fixed, by default at
    zero.
    """
    count = len(next(iter(columns.values())))
    return np.stack(
        [columns[n] if n in columns else np.full(count, fixed.get(n, 0.0)) for n in system.states],
        axis=1,
    ).astype(float)


def fixed_states(system: System, at: Any, moving: Iterable[str]) -> dict[str, float]:
    """Starts [SI] of the states that aren't varied in a map or a box; default zero.

    Raises
    ------
    ParameterError, UnitError
        If ``at`` isn't a mapping, names an unknown state, or one of those that move; if a name of
        those isn't a state.
    """
    if at is not None and not isinstance(at, Mapping):
        raise must_be("at", "a mapping of states to starts", at)
    given, moving = at or {}, list(moving)
    for name in (*moving, *given):
        if name not in system.states:
            raise unknown(f"{system.name} has no state", name, system.states)
    twice = [name for name in moving if name in given]
    if twice:
        raise ParameterError(
            lambda say: (
                f"{twice[0]} has a range and stands in {say.key('at')} too. Leave it out "
                "of one of them."
            )
        )
    return {
        name: to_si(given.get(name, 0.0), system.units[name], name)
        for name in system.states
        if name not in moving
    }


def _check_period_of_each(
    system: System, shared: Mapping[str, float], varied: Mapping[str, np.ndarray], count: int
) -> None:
    """Check that the time dependence repeats with the forcing period for every trajectory, not only
    for the system's own values.

    Where formulas don't tell, each different combination is checked once; only parameters in the
    explicit time dependence matter.
    """
    if system.forced_at is None or repeats_by_formula(system, {**shared, **varied}):
        return
    timed = [
        node for rate in system.field for node in ex.walk(rate) if ex.depends_on(node, ("time",))
    ]
    seen = {leaf.payload for node in timed for leaf in ex.walk(node) if leaf.op == "param"}
    columns = {name: values for name, values in varied.items() if name in seen}
    done: set[tuple[float, ...]] = set()
    for i in range(count if columns else 0):
        key = tuple(float(values[i]) for values in columns.values())
        if key in done or len(done) >= MOST_PERIOD_CHECKS:
            continue
        done.add(key)
        try:
            system.with_values(**{**shared, **dict(zip(columns, key, strict=True))})
        except SaltusError as error:
            raise ParameterError(f"trajectory {i}: ", error) from None


def _values(system: System, name: str, value: Any) -> Any:
    """One value of a parameter [SI], or many: a list or array, or a range (first, last, number)."""
    if not isinstance(value, tuple):
        return system.resolve(name, value)
    example = {"values": {name: (system.parameter_text(name), ..., 20)}}
    return along(name, value, lambda one: single(system, name, one), "values", example)


def at_values(system: System, values: Mapping[str, Any] | None) -> System:
    """The system with other values of its parameters, one each. Raises ParameterError or UnitError
    for an invalid value.
    """
    if values is None:
        return system
    if not isinstance(values, Mapping):
        raise ParameterError(
            lambda say: f"values must be a mapping, such as {say.key(values={'force': '4 N'})}."
        )
    for name, value in values.items():
        if np.ndim(system.resolve(name, value)):
            raise ParameterError(
                f"{name} = {shown(value)}, but here it has one value: a number, or text with a "
                f"unit. Call it once for each value, or vary it by sl.bifurcation_diagram(system, "
                f"{{{name!r}: (first, last, number)}}), alone or with a second parameter."
            )
    return system.with_values(**values)


def single(system: System, name: str, value: Any) -> float:
    """The value of a parameter [SI] at an end of a range, or in a list. Raises ParameterError for
    many in place of one.
    """
    number = system.resolve(name, value)
    if np.ndim(number):
        raise ParameterError(
            f"{name} = {shown(value)} must be one number, or a text with a unit: it is one end of "
            f"a range, or one of a list."
        )
    return float(number)


def range_of(system: System, name: Any, ends: Any) -> tuple[float, float]:
    """The range (low, high) of a parameter [SI]. Raises ParameterError if it has none, or it
    doesn't ascend.
    """
    if not among(name, system.values):
        raise unknown(f"{system.name} has no parameter", name, system.values)
    if not isinstance(ends, list | tuple | np.ndarray) or len(ends) != 2:
        raise ParameterError(
            f"the range of {name} must be (low, high), not {shown(ends)}: the steps between are "
            f"saltus's choice."
        )
    low, high = (single(system, name, end) for end in ends)
    if not low < high:
        first, last = map(str, ends)
        raise ParameterError(f"the range of {name} must ascend, not go from {first} to {last}.")
    return low, high


def _columns(system: System, start: Any) -> dict[str, np.ndarray]:
    """Each state's start [SI], a scalar or an array."""
    if isinstance(start, Mapping):
        if start and by_modes(system) and not any(among(name, system.states) for name in start):
            from saltus.analysis.inputs.sensed import sensed

            units = dict(zip(system.outputs.names, system.outputs.units, strict=True))
            shown_by = {name: _numbers(units.get(name, ""), name, start[name]) for name in start}
            _length(shown_by)
            return sensed(system, shown_by)
        strange = [name for name in start if name not in system.states]
        if strange and by_modes(system) and strange[0] in system.outputs.names:
            state = next(name for name in start if name in system.states)
            raise ParameterError(
                f"the start gives {strange[0]}, which a sensor shows, and {state}, the coordinate "
                f"of a mode. Give sensors alone, or coordinates of modes alone."
            )
        if strange:
            raise unknown(f"{system.name} has no state", strange[0], system.states)
        rest = system.states if by_modes(system) and not start else _made(system)
        start = {**dict.fromkeys(rest, 0.0), **start}
        missing = [name for name in system.states if name not in start]
        if missing:
            example: dict[Any, Any] = dict.fromkeys(system.states[:MOST_IN_A_ROW], 0.0)
            if len(system.states) > MOST_IN_A_ROW:
                example = {**example, Word("..."): Word("...")}
            raise ParameterError(
                lambda say: f"the start gives no {missing[0]!r}. Write {say.key(start=example)}."
            )
        return {name: _numbers(system.units[name], name, start[name]) for name in system.states}
    rows = start if isinstance(start, np.ndarray) else _as_array(start)
    if system.made and rows.shape and rows.shape[-1] == len(system.states) - system.made:
        rows = np.concatenate([rows, np.zeros((*rows.shape[:-1], system.made))], axis=-1)
    if rows.shape == () or rows.shape[-1] != len(system.states) or rows.ndim > 2:
        this = f"has shape {rows.shape}" if rows.shape else f"is {shown(start)}"
        drawn = (
            " Random starts are NumPy's here: np.random.default_rng(1).uniform(low, high, (n, "
            f"{len(system.states)}))."
            if isinstance(start, str) and start.startswith("random")
            else ""
        )
        raise ParameterError(
            f"a start of {system.name} is {len(system.states)} numbers "
            f"({listed(system.states)}), or an array of such rows; "
            f"this one {this}.{drawn}"
        )
    return {
        name: _numbers(system.units[name], name, rows[..., i])
        for i, name in enumerate(system.states)
    }


def _made(system: System) -> tuple[str, ...]:
    """The states that elements with a memory have added."""
    return system.states[len(system.states) - system.made :]


def _as_array(start: Any) -> np.ndarray:
    """Rows as an array; mixed text and numbers are kept."""
    try:
        rows = np.asarray(start)
        return rows if rows.dtype.kind in "fiu" else np.asarray(start, dtype=object)
    except (TypeError, ValueError):
        raise ParameterError("a start must be a row of numbers, or rows of one length.") from None


def _numbers(unit: str, name: str, value: Any) -> np.ndarray:
    if isinstance(value, tuple):
        example = {"start": Word(f'{{"{name}": (0.0, 1.0, 20), ...}}')}
        return along(name, value, lambda one: to_si(one, unit, name), "starts", example)
    array = np.asarray(value) if isinstance(value, np.ndarray) else _as_array(value)
    if array.size == 0:
        raise ParameterError(f"the start of {name} is empty. Give at least one number.")
    if array.dtype.kind in "OUS":
        array = np.array([to_si(item, unit, name) for item in np.ravel(array).tolist()]).reshape(
            array.shape
        )
    if array.dtype.kind not in "fiu" or array.ndim > 1:
        raise ParameterError(
            f"the start of {name} must be a number or a one-dimensional array of numbers."
        )
    if not np.isfinite(array).all():
        where = "" if array.ndim == 0 else f" (first at index {int(np.argmin(np.isfinite(array)))})"
        raise ParameterError(
            f"the start of {name} isn't finite{where}. Every start must be a number."
        )
    return array.astype(float)
