"""CSV files that stand beside a study: numbers that somebody printed, and exact ones."""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path

from saltus.errors import StudyError


def rows(path: Path, columns: tuple[str, ...]) -> list[dict[str, str]]:
    """The rows of a CSV file by column name. Lines that begin with # are comments.

    Raises
    ------
    StudyError
        If the file can't be read or lacks one of ``columns``.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            reader = csv.DictReader(_without_comments(file))
            found = list(reader)
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = getattr(error, "strerror", None) or error
        raise StudyError(f"[compare] {path} can't be read: {reason}. It must stand beside the study.") from None
    lacking = [column for column in columns if column not in (reader.fieldnames or ())]
    if lacking:
        raise StudyError(f"[compare] {path} lacks the column {lacking[0]!r}. It needs {', '.join(columns)}.")
    return found


def cell(row: dict[str, str], column: str, path: Path) -> float:
    """One number of a row. Raises StudyError if it isn't one."""
    try:
        return float(row[column])
    except (TypeError, ValueError):
        raise StudyError(f"[compare] {path} holds {row[column]!r} in column {column!r}, which is no number.") from None


def _without_comments(lines: Iterator[str]) -> Iterator[str]:
    return (line for line in lines if line.strip() and not line.startswith("#"))
