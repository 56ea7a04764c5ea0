"""CSV files in the folder of a study: printed and exact numbers. Messages never repeat their
contents.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from saltus import fence
from saltus.errors import StudyError


@dataclass(frozen=True)
class CsvRow:
    """One row of a CSV file.

    Attributes
    ----------
    place : str
        File and line, for messages.
    cells : dict of str to str
        By column.
    """

    place: str
    cells: dict[str, str]

    def text(self, column: str) -> str:
        """Text of a cell; "" if there is none."""
        return self.cells.get(column) or ""

    def number(self, column: str) -> float:
        """Finite number of a cell. Raises StudyError if the cell holds something else."""
        try:
            value = float(self.text(column))
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise StudyError(
                f"[compare] {self.place}: what stands in the column {column!r} is no finite number."
            )
        return value

    def whole(self, column: str) -> int:
        """Whole number of a cell, at least 1. Raises StudyError if the cell holds something
        else.
        """
        value = self.number(column)
        if value != int(value) or not 1 <= value <= fence.MOST_COUNT:
            raise StudyError(
                f"[compare] {self.place}: what stands in the column {column!r} is no "
                f"whole number from 1 to 2^31."
            )
        return int(value)


def rows(data: bytes, path: Path, columns: tuple[str, ...]) -> list[CsvRow]:
    """The rows of a CSV file. Lines that begin with # are comments.

    Parameters
    ----------
    data : bytes
        Content of the file.
    path : Path
        Its name, for messages.
    columns : tuple of str
        Those that it must have.

    Raises
    ------
    StudyError
        If it can't be read or lacks one of ``columns``.
    """
    try:
        lines = list(_lines(fence.text(data)))
        header, *table = [
            (number, cells) for number, line in lines for cells in csv.reader([line])
        ] or [(0, [])]
    except fence.RefusedError as refused:
        raise StudyError(f"[compare] {path} {refused}") from None
    except csv.Error as error:
        raise StudyError(f"[compare] {path} can't be read: {error}.") from None
    lacking = [column for column in columns if column not in header[1]]
    if lacking:
        raise StudyError(
            f"[compare] {path} lacks the column {lacking[0]!r}. It needs {', '.join(columns)}."
        )
    return [
        CsvRow(f"{path}, line {number}", dict(zip(header[1], cells, strict=False)))
        for number, cells in table
    ]


def _lines(text: str) -> Iterator[tuple[int, str]]:
    """Lines that aren't empty, with their numbers."""
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip() and not line.startswith("#"):
            yield number, line
