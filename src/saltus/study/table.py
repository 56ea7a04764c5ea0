"""Plain tables: what a study has to say, before anything decides how it looks."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

from saltus.fence import csv_cell

#: Rows printed at most; the files hold them all.
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
    """

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    notes: tuple[str, ...] = ()

    def write_csv(self, path: Path) -> Path:
        """Write the table as CSV, the notes as comment lines above it."""
        from saltus.results.files import replacing

        with replacing(path) as (part,), part.open("w", newline="", encoding="utf-8") as file:
            file.writelines(f"# {' '.join(note.split())}\n" for note in (self.title, *self.notes))
            csv.writer(file).writerows([map(csv_cell, row) for row in (self.columns, *self.rows)])
        return path
