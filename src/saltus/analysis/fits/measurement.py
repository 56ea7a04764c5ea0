"""Measurements of states and outputs, over the time or the frequency: checked and in SI."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.inputs.outputs import outputs_of
from saltus.errors import ParameterError, UnitError, counted, listed, nearest, shown
from saltus.results.files.measured import read_series
from saltus.system import System
from saltus.units import to_si

#: Names of the time, in the order in which they are looked for.
TIMES = ("t", "time")


@dataclass(frozen=True)
class Measurement:
    """Measured values of K states and outputs at M places: times, or values of a parameter.

    Attributes
    ----------
    along : str
        ``time``, or the parameter.
    at : float64[M]
        The places, ascending [SI].
    outputs : tuple of str
    columns : int64[K]
        Their places among the states and outputs of the system.
    units : tuple of str
    values : float64[M, K]
        [SI]; NaN where a sample is missing.
    """

    along: str
    at: np.ndarray
    outputs: tuple[str, ...]
    columns: np.ndarray
    units: tuple[str, ...]
    values: np.ndarray

    def beginning(self, count: int) -> Measurement:
        """Its first samples."""
        return replace(self, at=self.at[:count], values=self.values[:count])

    @property
    def there(self) -> np.ndarray:
        """True where a sample isn't missing, bool[M, K]."""
        return np.asarray(np.isfinite(self.values))

    @property
    def size(self) -> np.ndarray:
        """Standard deviation of the values of each output, float64[K]."""
        return np.asarray(np.nanstd(self.values, axis=0))


def measurement(system: System, given: Any, missing: bool) -> Measurement:
    """The measurement of a user: a history, or sizes of responses over the forcing frequency.

    Parameters
    ----------
    system : System
        Names and units of states and outputs.
    given : Dataset, mapping, path or bytes
        By names: ``t`` or ``time`` [s], or the frequency; and states or outputs. Of a Dataset and
        of a file others are passed over. Numbers are in SI; a Dataset tells units by its
        attributes, a file by its heading, a mapping by ``(values, "mm")``.
    missing : bool
        Whether NaN is a sample that is missing.

    Raises
    ------
    ParameterError, UnitError, ResultFileError
        If it can't be read, or nothing can be fitted to it.
    """
    outputs = outputs_of(system)
    units = dict(zip(outputs.names, outputs.units, strict=True))
    places = dict.fromkeys(TIMES, "s")
    if system.forced_at is not None:
        places[system.forced_at] = system.units[system.forced_at]
    columns = _columns(given, {**places, **units}, missing)
    word = next((name for name in places if name in columns), "")
    names = tuple(name for name in outputs.names if name in columns)
    if not word or not names:
        file = isinstance(given, str | os.PathLike | bytes)
        raise ParameterError(
            f"the measurement has no {'times' if not word else 'state or output'}. It needs t [s]"
            + (f", or {system.forced_at} of responses," if system.forced_at else "")
            + f" and some of {listed(outputs.names)}, under these names."
            + file * " The first line of a file is t [s], x [mm]: commas between columns."
        )
    values = _together(columns, word, names)
    _check_places(columns[word], word, ascending=word in TIMES)
    _check_values(names, values, missing)
    return Measurement(
        "time" if word in TIMES else word,
        columns[word],
        names,
        np.array([outputs.names.index(name) for name in names]),
        tuple(units[name] for name in names),
        values,
    )


# -- reading ---------------------------------------------------------------------------------------
def _columns(given: Any, units: Mapping[str, str], missing: bool) -> dict[str, np.ndarray]:
    """Columns by name [SI]."""
    if isinstance(given, str | os.PathLike | bytes):
        return read_series(given, units, missing)
    if isinstance(given, xr.Dataset):
        if "trajectory" in given.dims:
            raise ParameterError(
                "the measurement holds several trajectories. Select one: "
                "measured.sel(trajectory=0)."
            )
        found = [name for name in units if name in given.variables and given[name].ndim == 1]
        return {
            name: _in_si(name, given[name].values, given[name].attrs.get("units", ""), units[name])
            for name in found
        }
    if not isinstance(given, Mapping):
        raise ParameterError(
            f"measured must be a Dataset, a mapping of arrays or the path of a CSV file, not "
            f"{shown(given)}."
        )
    strange = [name for name in given if name not in units]
    if strange:
        raise ParameterError(
            f"measured holds {shown(strange[0])}, which is neither the time t nor a state or "
            f"output. {nearest(strange[0], units)}"
        )
    return {name: _column(name, one, units[name]) for name, one in given.items()}


def _column(name: str, given: Any, unit: str) -> np.ndarray:
    """A column of a mapping: numbers, or numbers and their unit."""
    if isinstance(given, tuple) and len(given) == 2 and isinstance(given[1], str):
        return _in_si(name, given[0], given[1], unit)
    return _in_si(name, given, getattr(given, "attrs", {}).get("units", ""), unit)


def _in_si(name: str, values: Any, given: str, unit: str) -> np.ndarray:
    """Numbers in a row, in SI; those without a unit are."""
    try:
        array = np.asarray(values, float)
    except (TypeError, ValueError, OverflowError):
        raise ParameterError(f"what was measured of {name} must be numbers in a row.") from None
    if array.ndim != 1:
        raise ParameterError(
            f"what was measured of {name} must be numbers in a row, not of shape {array.shape}."
        )
    if given in ("", unit):
        return array
    try:
        return np.asarray(array * to_si(f"1 {given}", unit, name))
    except UnitError as error:
        raise UnitError(f"the measured {name} is in {shown(given)}: {error}") from None


def _together(columns: Mapping[str, np.ndarray], word: str, names: tuple[str, ...]) -> np.ndarray:
    """The columns side by side."""
    sizes = {name: len(columns[name]) for name in (word, *names)}
    if len(set(sizes.values())) > 1:
        each = ", ".join(f"{name} has {size}" for name, size in sizes.items())
        raise ParameterError(f"what was measured must have one length: {each}.")
    return np.stack([columns[name] for name in names], axis=1)


# -- checks ----------------------------------------------------------------------------------------
def _check_places(time: np.ndarray, name: str, ascending: bool) -> None:
    word = "the times" if ascending else f"the values of {name}"
    if not len(time):
        raise ParameterError("the measurement holds no samples.")
    if not np.isfinite(time).all():
        raise ParameterError(
            f"{word} of the measurement aren't all finite numbers (first at index "
            f"{int(np.argmin(np.isfinite(time)))}). Leave these samples out."
        )
    back = np.flatnonzero(np.diff(time) <= 0)
    if ascending and len(back):
        i = int(back[0])
        raise ParameterError(
            f"{word} of the measurement don't ascend: {time[i + 1]:.9g} follows {time[i]:.9g} at "
            f"index {i + 1}. Sort the samples, and give each time once."
        )


def _check_values(names: tuple[str, ...], values: np.ndarray, missing: bool) -> None:
    for name, column in zip(names, values.T, strict=True):
        bad = ~np.isfinite(column)
        if bad.any() and (not missing or np.isinf(column).any()):
            raise _not_finite(name, bad)
        if bad.all() or not np.nanmax(column) > np.nanmin(column):
            raise ParameterError(
                f"the measured {name} {'has no samples' if bad.all() else 'is constant'}: there is "
                "no motion to fit. Leave it out."
            )


def _not_finite(name: str, bad: np.ndarray) -> ParameterError:
    return ParameterError(
        lambda say: (
            f"the measured {name} isn't finite at {counted(int(bad.sum()), 'sample')} "
            f"(first at index {int(bad.argmax())}). Leave them out, or say that NaN is a sample "
            f"that is missing: {say.key(missing=True)}."
        )
    )


def per_output(
    given: Any, measured: Measurement, name: str, read: Callable[[Any, str, str], float]
) -> np.ndarray | None:
    """A positive number for each measured output, from one for the only output or a mapping.

    Raises
    ------
    ParameterError, UnitError
        If one is missing, isn't positive, or is of an output that wasn't measured.
    """
    if given is None:
        return None
    if not isinstance(given, Mapping):
        given = dict.fromkeys(measured.outputs[:1], given)
    strange = [one for one in given if one not in measured.outputs]
    if strange:
        raise ParameterError(
            f"{name} of {shown(strange[0])}, which wasn't measured. "
            f"{nearest(strange[0], measured.outputs)}"
        )
    lacking = [one for one in measured.outputs if one not in given]
    if lacking:
        raise ParameterError(f"{name} lacks {listed(lacking)}. Give one for each measured output.")
    found = np.array(
        [
            read(given[one], unit, f"{name} of {one}")
            for one, unit in zip(measured.outputs, measured.units, strict=True)
        ]
    )
    wrong = np.flatnonzero(~(found > 0))
    if len(wrong):
        one = measured.outputs[wrong[0]]
        raise ParameterError(
            f"{name} of {one} must be positive, not {shown(given[one])}."
            + (" Leave it out to have it estimated." if name == "noise" else "")
        )
    return found
