"""CSV files: columns under a header, and comment lines above it."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from saltus.fence import csv_cell
from saltus.results.files.atomic import replacing
from saltus.results.table import TextTable
from saltus.results.wording import header


def write_table(table: TextTable, path: Path) -> Path:
    """Write a table as CSV, its title and notes as comment lines above it."""
    notes = (" ".join(note.split()) for note in (table.title, *table.notes))
    with replacing(path) as (part,):
        write_rows(part, notes, table.data or (table.columns, *table.rows))
    return path


def write_rows(path: Path, notes: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
    """Write comment lines, and rows of which the first is the header."""
    with path.open("w", newline="", encoding="utf-8") as file:
        file.writelines(f"# {note}\n" for note in notes)
        csv.writer(file, lineterminator="\n").writerows(map(csv_cell, row) for row in rows)


def notes_of(ds: xr.Dataset) -> Iterator[str]:
    """Provenance, guards and scalars as lines ``name: value``; no line holds a line break."""
    scalars = {
        header(ds, str(name)): ds[name].item() for name in ds.variables if ds[name].dims == ()
    }
    for name, value in {**ds.attrs, **scalars}.items():
        several_lines = isinstance(value, str) and "\n" in value
        yield f"{name}: {json.dumps(value, ensure_ascii=False) if several_lines else value}"
    yield from (f"guard {line}" for line in _guards(ds))


def _guards(ds: xr.Dataset) -> Iterator[str]:
    """A line for each guard, such as ``upper_gap: x = 0.0004 m``."""
    for i, name in enumerate(ds["guard"].values.tolist() if "guard" in ds else []):
        guard = ds.isel(guard=i)
        state, unit = guard["guard_state"].item(), guard["guard_units"].item()
        place = " ".join(map(str, np.atleast_1d(guard["guard_boundary"].values).tolist()))
        yield f"{name}: {state} = {place} {unit}".rstrip() if state else name
