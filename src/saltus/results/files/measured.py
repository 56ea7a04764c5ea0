"""Measured points and histories from a file: columns, each with its unit in the header."""

from __future__ import annotations

import csv
import math
import os
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import xarray as xr

from saltus.errors import UnitError, shown
from saltus.fence import TABLE_BYTES, RefusedError, content
from saltus.fence import text as text_of
from saltus.results.files.atomic import ResultFileError, path_of
from saltus.units import coherent_unit, to_si

#: ``frequency [Hz]``
_HEADER = re.compile(r"\s*(?P<name>.*?)\s*\[(?P<unit>[^]]*)\]\s*")


def read_measured(
    path: str | os.PathLike[str], axis: str, axis_unit: str, amplitude_unit: str
) -> xr.Dataset:
    """Read measured points, in SI.

    Parameters
    ----------
    path : str or path
        A CSV file with a column of ``axis`` and one called ``amplitude``, in any order, units in
        the header: ``frequency [Hz], amplitude [mm]``. Other columns are passed over, lines that
        begin with # are comments.
    axis : str
        Quantity over which the points are measured, such as ``frequency``.
    axis_unit, amplitude_unit : str
        SI units; those of the file are converted.

    Returns
    -------
    Dataset
        Dim ``point``: ``axis`` and ``amplitude``.

    Raises
    ------
    ResultFileError
        If the file can't be read, lacks a column or a unit, or holds something that isn't a number.
    """
    path = path_of(path)
    try:
        data = content(path, TABLE_BYTES)
    except RefusedError as refused:
        raise ResultFileError(f"{path} {refused}") from None
    return measured_points(data, path, axis, axis_unit, amplitude_unit)


def measured_points(
    data: bytes, path: Path, axis: str, axis_unit: str, amplitude_unit: str
) -> xr.Dataset:
    """Measured points from the bytes of a file, in SI. ``path`` is for messages, which repeat
    nothing of the file.
    """
    units = {axis: axis_unit, "amplitude": amplitude_unit}
    rows = _rows(data, path)
    header = next(rows, None)
    if header is None:
        raise ResultFileError(
            f"{path} is empty. Its first line names the columns: {_wanted(units)}."
        )
    place = {name: _column(path, header[1], name, unit, units) for name, unit in units.items()}
    points = np.array(
        [[_number(path, line, row, *place[name]) for name in units] for line, row in rows]
    ).reshape(-1, 2)
    return xr.Dataset(
        {
            name: ("point", points[:, i], {"units": unit})
            for i, (name, unit) in enumerate(units.items())
        }
    )


def read_series(
    source: str | os.PathLike[str] | bytes, units: Mapping[str, str], missing: bool = False
) -> dict[str, np.ndarray]:
    """Read columns of a file by their names, in SI.

    Parameters
    ----------
    source : str or path, or bytes
        A CSV file, or its content: ``t [s], x [mm]``. Lines that begin with # are comments.
    units : mapping of str to str
        Columns that are taken, and their SI units. Others are passed over.
    missing : bool
        Whether an empty cell is a sample that is missing, NaN.

    Returns
    -------
    dict of str to float64[n]
        The columns that it has.

    Raises
    ------
    ResultFileError
        If the file can't be read, a unit is missing or wrong, or a cell isn't a number.
    """
    path = Path("the file") if isinstance(source, bytes) else path_of(source)
    try:
        data = source if isinstance(source, bytes) else content(path, TABLE_BYTES)
    except RefusedError as refused:
        raise ResultFileError(f"{path} {refused}") from None
    rows = _rows(data, path)
    header = next(rows, (0, []))[1]
    names = [match["name"] if (match := _HEADER.fullmatch(one)) else one.strip() for one in header]
    places = {
        name: _column(path, header, name, units[name], {name: units[name]})
        for name in names
        if name in units
    }
    cells = list(rows)
    return {
        name: np.array(
            [
                math.nan
                if missing and not "".join(row[place[0] : place[0] + 1]).strip()
                else _number(path, line, row, *place)
                for line, row in cells
            ],
            float,
        )
        for name, place in places.items()
    }


def columns(data: bytes, path: Path) -> np.ndarray:
    """The first two columns of a CSV file, float64[2, n], in SI by the units in their headings;
    ``path`` is for messages.

    Raises
    ------
    ResultFileError
        If it has fewer, or holds something that isn't a number, or a unit that can't be read.
    """
    rows = _rows(data, path)
    header = next(rows, (0, []))[1]
    if len(header) < 2:
        raise ResultFileError(
            f"{path} has no two columns. Its first line names them, with their "
            f"units: time [s], force [N]."
        )
    factors = []
    for text in header[:2]:
        match = _HEADER.fullmatch(text)
        unit = match["unit"].strip() if match else ""
        try:
            factors.append(
                to_si(f"1 {unit}", coherent_unit(f"1 {unit}", "a heading"), "a heading")
                if unit not in ("", "1", "-")
                else 1.0
            )
        except UnitError as error:
            raise ResultFileError(f"{path}: {error}") from None
    if _is_number(header[0]):
        raise ResultFileError(
            f"{path} begins with numbers. Its first line names the columns, with "
            f"their units: time [s], force [N]."
        )
    found = [
        [_number(path, line, row, i, ("first", "second")[i], "", "") for i in (0, 1)]
        for line, row in rows
    ]
    values: np.ndarray = np.array(found, float).reshape(-1, 2).T * np.array(factors)[:, None]
    return values


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _wanted(units: dict[str, str]) -> str:
    return ", ".join(f"{name} [{'mm' if unit == 'm' else unit}]" for name, unit in units.items())


def _rows(data: bytes, path: Path) -> Iterator[tuple[int, list[str]]]:
    """Number and cells of each line that isn't empty or a comment."""
    try:
        for line, cells in enumerate(csv.reader(text_of(data).splitlines(keepends=True)), 1):
            if any(cell.strip() for cell in cells) and not cells[0].lstrip().startswith("#"):
                yield line, cells
    except RefusedError as refused:
        raise ResultFileError(f"{path} {refused}") from None
    except csv.Error as error:
        raise ResultFileError(f"{path} can't be read: {error}.") from None


def _column(
    path: Path, header: list[str], name: str, unit: str, units: dict[str, str]
) -> tuple[int, str, str, str]:
    """Locate a column: its index, its name, the unit in the file, and the unit wanted."""
    found: dict[str, tuple[int, str]] = {}
    for i, text in enumerate(header):
        match = _HEADER.fullmatch(text)
        found[match["name"] if match else text.strip()] = (
            i,
            match["unit"].strip() if match else "",
        )
    if name not in found:
        raise ResultFileError(
            f"{path} has no column {shown(name)}. The first line must be like {_wanted(units)}."
        )
    index, given = found[name]
    if not given and unit not in ("", "1"):
        raise ResultFileError(
            f"{path}: the column {name!r} has no unit. Write it in the header: {_wanted(units)}."
        )
    return index, name, given, unit


def _number(
    path: Path, line: int, row: list[str], index: int, name: str, given: str, unit: str
) -> float:
    try:
        value = float(row[index].strip() if index < len(row) else "")
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise ResultFileError(
            f"{path}, line {line}: what stands in the column {name!r} is no finite number. "
            "Correct the line, or take it out."
        )
    if not given:
        return value
    try:
        return to_si(f"{value!r} {given}", unit, name)
    except UnitError:
        wanted = "mm" if unit == "m" else unit
        raise ResultFileError(
            f"{path}: the column {name!r} has the wrong unit in its header. "
            f"Write {name} [{wanted}]."
        ) from None
