"""Tables of text: a result in rows, on the screen and in a CSV file."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.units import from_si, titled

if TYPE_CHECKING:
    import xarray as xr

#: Most rows printed; the files hold all rows.
ROWS = 24


@dataclass(frozen=True)
class TextTable:
    """A table of text.

    Attributes
    ----------
    title : str
    columns : tuple of str
        Headings, with units.
    rows : tuple of tuple of str
        One text a column.
    notes : tuple of str
        Sentences that belong under the table.
    data : tuple of tuple of str
        Columns of the CSV file by heading: plain numbers in SI, the unit in the heading. Default:
        the text shown.
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()
    data: tuple[tuple[str, ...], ...] = ()


# -- tables of numbers -----------------------------------------------------------------------------
@dataclass(frozen=True)
class Column:
    """Column as it is printed, and the columns of numbers for the file.

    Attributes
    ----------
    heading : str
        Title on the screen.
    text : callable
        The text of a row on the screen, by the number of the row.
    data : mapping of str to sequence
        By heading, with the unit: numbers in SI, or words. A number that isn't there is None or
        NaN, and an empty cell.
    """

    heading: str
    text: Callable[[int], str]
    data: Mapping[str, Sequence[Any]]


def quantity(
    heading: str, values: Any, unit: str, digits: int = 4, name: str | None = None
) -> Column:
    """Numbers with a unit and a prefix: ``0.4 mm``; ``-`` where there is none.

    ``name`` is the heading in the file, if it is another.
    """
    numbers = _floats(values)

    def shown(i: int) -> str:
        return "-" if math.isnan(numbers[i]) else from_si(numbers[i], unit, digits)

    return Column(heading, shown, {titled(name or heading, unit): numbers})


def interval(
    heading: str, low: Any, high: Any, text: Callable[[float], str], unit: str = ""
) -> Column:
    """A range, shown as ``2 to 4``, or as ``4`` where both ends have the same text; ``-`` where
    there is none.
    """
    ends = _floats(low), _floats(high)

    def shown(i: int) -> str:
        found = [text(end[i]) for end in ends if math.isfinite(end[i])]
        return " to ".join(dict.fromkeys(found)) or "-"

    return Column(
        heading,
        shown,
        {
            titled(f"{heading} {side}", unit): end
            for side, end in zip(("from", "to"), ends, strict=True)
        },
    )


def number(
    heading: str, values: Any, form: str = "", unit: str = "", name: str | None = None
) -> Column:
    """Numbers in one form, the unit in the heading; ``-`` where there is none."""
    found = [None if value is None or value != value else value for value in _items(values)]

    def shown(i: int) -> str:
        return "-" if found[i] is None else format(found[i], form)

    return Column(titled(heading, unit), shown, {titled(name or heading, unit): found})


def words(heading: str, values: Any, name: str | None = None) -> Column:
    """Words, or whole numbers that serve as names."""
    found = _items(values)
    return Column(heading, lambda i: str(found[i]), {name or heading: found})


def with_error(heading: str, values: Any, errors: Any, form: str = ".4g", unit: str = "") -> Column:
    """Numbers with their standard errors, shown as ``0.5 ± 0.01``."""
    found, off = _floats(values), _floats(errors)

    def shown(i: int) -> str:
        if not math.isfinite(found[i]):
            return "-"
        return (
            f"{found[i]:{form}} ± {off[i]:.1g}" if math.isfinite(off[i]) else f"{found[i]:{form}}"
        )

    return Column(
        titled(heading, unit),
        shown,
        {titled(heading, unit): found, titled(f"{heading} error", unit): off},
    )


def table(
    title: str,
    columns: Sequence[Column],
    notes: Sequence[str] = (),
    shown: Sequence[int] | None = None,
) -> TextTable:
    """A table from its columns; ``shown`` are the numbers of the rows for the screen, by default
    the first :data:`ROWS`.
    """
    data = {heading: values for column in columns for heading, values in column.data.items()}
    rows = list(zip(*data.values(), strict=True))
    chosen = range(min(len(rows), ROWS)) if shown is None else shown
    return TextTable(
        title,
        tuple(column.heading for column in columns),
        tuple(tuple(column.text(i) for column in columns) for i in chosen),
        tuple(notes),
        (tuple(data), *(tuple(map(_cell, row)) for row in rows)),
    )


def left_out(count: int, what: str, shown: int = ROWS) -> list[str]:
    """A note on the rows that the screen doesn't show."""
    return [f"{count - shown} more {what} are in the file."] if count > shown else []


def spread(count: int) -> list[int]:
    """:data:`ROWS` row numbers in even steps, with the first and the last row."""
    return [*dict.fromkeys(i * (count - 1) // (ROWS - 1) for i in range(ROWS if count else 0))]


def _cell(value: Any) -> str:
    """Text of a value for programs, with every digit."""
    return (
        ""
        if value is None or value != value
        else repr(value)
        if isinstance(value, float)
        else str(value)
    )


def _items(values: Any) -> list[Any]:
    return values.tolist() if hasattr(values, "tolist") else list(values)


def _floats(values: Any) -> list[float]:
    return [float(value) for value in _items(values)]


# -- columns of a Dataset --------------------------------------------------------------------------
def of_trajectory(
    ds: xr.Dataset,
    variable: str = "trajectory",
    like: xr.DataArray | None = None,
    heading: str = "trajectory",
) -> list[Column]:
    """Columns for the trajectory of each row: its number, and the parameters that distinguish it;
    none if the result holds one trajectory. ``like``: see :func:`flat`.
    """
    if "trajectory" not in ds.dims:
        return []
    rows = ds[variable].values if like is None else flat(ds[variable], like)
    return [words(heading, rows, "trajectory"), *_varied(ds, rows)]


def _varied(ds: xr.Dataset, trajectories: Any) -> list[Column]:
    """A column for each parameter that differs from trajectory to trajectory, at the rows of these
    trajectories.
    """
    names = [
        name
        for name in json.loads(ds.attrs.get("varied_parameters", "[]"))
        if name in ds.coords and ds[name].dims == ("trajectory",)
    ]
    own = [ds[name].sel(trajectory=trajectories) for name in names]
    return [
        quantity(name.replace("_", " "), one.values, one.attrs.get("units", ""))
        for name, one in zip(names, own, strict=True)
    ]


def flat(values: xr.DataArray, like: xr.DataArray) -> np.ndarray:
    """Values as a column: one for each element of ``like``, trajectory by trajectory."""
    dims = sorted(like.dims, key=lambda dim: dim != "trajectory")
    return np.ravel(values.broadcast_like(like).transpose(*dims).values)
