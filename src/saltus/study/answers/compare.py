"""Comparison of contact times with printed ones, with exact ones, and with a second method."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from saltus.errors import StudyError
from saltus.results.table import Column, TextTable, table, words
from saltus.study.answers.printed import CsvRow, rows

if TYPE_CHECKING:
    import xarray as xr


#: Columns that the files must have.
COLUMNS = ("event_number", "time_s")
#: The column that they may have.
RESIDUAL = "position_minus_boundary_m"


def contact_table(
    title: str,
    run: xr.Dataset,
    printed: Sequence[CsvRow],
    exact: Mapping[int, float],
    reference: xr.Dataset | None,
) -> TextTable:
    """A row for each contact that was printed.

    Parameters
    ----------
    title : str
        Goes above the table.
    run : Dataset
        Result of ``simulate`` for one start.
    printed : sequence of Row
        The printed contacts.
    exact : mapping of int to float
        Exact contact times [s] by number of the contact; empty if there are none.
    reference : Dataset or None
        The same run by the second method.

    Returns
    -------
    TextTable
        Marker, number of the contact, our time [s], the printed time [s], difference [s], residual
        |x - boundary| [m], printed residual [m], exact time [s], difference of the second method
        [s], steps of the legs since the row before.

    Raises
    ------
    StudyError
        If a row isn't one of numbers, or names a contact that the run doesn't have.
    """
    numbers = [row.whole("event_number") for row in printed]
    ours, theirs = [_time(run, row) for row in printed], [row.number("time_s") for row in printed]
    known = [exact.get(n) for n in numbers]
    second = [
        None if reference is None or time is None else _time(reference, row) - time
        for row, time in zip(printed, known, strict=True)
    ]
    printed_residuals = [
        abs(row.number(RESIDUAL)) if row.text(RESIDUAL) else None for row in printed
    ]
    legs = [
        " ".join(map(str, _legs(run)[before:n]))
        for before, n in zip([0, *numbers], numbers, strict=False)
    ]
    method, other = (
        run.attrs["method"],
        reference.attrs["method"] if reference is not None else "reference",
    )
    columns = [
        words("", [row.text("marker") for row in printed], "marker"),
        words("contact", numbers),
        _column(f"{method} [s]", ours, _seconds),
        _column("printed [s]", theirs, _seconds),
        _column(
            "difference",
            [a - b for a, b in zip(ours, theirs, strict=True)],
            _small,
            "difference [s]",
        ),
        _column("|x - j| [m]", residuals(run)[np.array(numbers, dtype=int) - 1].tolist(), _small),
        _column("printed [m]", printed_residuals, _small),
        _column("exact [s]", known, _seconds),
        _column(f"{other} - exact", second, _small, f"{other} - exact [s]"),
        words("steps", legs),
    ]
    return table(title, columns, _notes(run, exact, reference), range(len(printed)))


def _column(
    heading: str,
    values: Sequence[float | None],
    form: Callable[[float], str],
    name: str | None = None,
) -> Column:
    """Column of numbers, some of which may be missing."""
    return Column(
        heading,
        lambda i: "" if (value := values[i]) is None else form(value),
        {name or heading: values},
    )


def printed_rows(data: bytes, path: Path) -> list[CsvRow]:
    """Rows of a printed table. Every number is checked now, before anything is computed. Raises
    StudyError.
    """
    found = rows(data, path, COLUMNS)
    for row in found:
        row.whole("event_number"), row.number("time_s")
        if row.text(RESIDUAL):
            row.number(RESIDUAL)
    return found


def exact_times(data: bytes, path: Path) -> dict[int, float]:
    """Exact contact times [s] by number of the contact, from a CSV file with the columns
    event_number and time_s.
    """
    return {row.whole("event_number"): row.number("time_s") for row in rows(data, path, COLUMNS)}


def largest_difference(run: xr.Dataset, exact: Mapping[int, float]) -> tuple[float, int]:
    """Largest difference [s] of contact times from exact ones, and how many contacts both have."""
    times = run["contact_time"].values
    differences = [
        abs(times[number - 1] - time) for number, time in exact.items() if number <= times.size
    ]
    return max(differences, default=np.nan), len(differences)


def _notes(
    run: xr.Dataset, exact: Mapping[int, float], reference: xr.Dataset | None
) -> tuple[str, ...]:
    notes = [
        "j: the boundary that is met. steps: of each leg, the leg being the motion from one "
        "contact to the next."
    ]
    for one in (run, reference):
        if one is not None and exact:
            worst, count = largest_difference(one, exact)
            notes.append(
                f"{one.attrs['method']}: {count} of {len(exact)} exact contact times "
                f"compared; largest difference {worst:.2e} s."
            )
    return tuple(notes)


def _time(run: xr.Dataset, row: CsvRow) -> float:
    """Time of the contact that a row names."""
    number = row.whole("event_number")
    if not 1 <= number <= run.sizes["contact"]:
        raise StudyError(
            f"[compare] {row.place} names contact {number}, but {run.attrs['method']} "
            f"had {run.sizes['contact']}. Run longer."
        )
    return float(run["contact_time"][number - 1])


def residuals(run: xr.Dataset) -> np.ndarray:
    """|state - boundary| at every contact whose guard is on one state; NaN elsewhere."""
    residual = np.full(run.sizes["contact"], np.nan)
    for guard, state, boundary in zip(
        run["guard"].values, run["guard_state"].values, run["guard_boundary"].values, strict=True
    ):
        here = run["contact_guard"].values == guard
        if state:
            residual[here] = np.abs(run[f"contact_{state}"].values[here] - boundary)
    return residual


def _legs(run: xr.Dataset) -> np.ndarray:
    """Accepted steps on the segment before each contact."""
    return np.diff(run["contact_steps"].values, prepend=0)


def _seconds(value: float) -> str:
    return f"{value:.16f}"


def _small(value: float) -> str:
    return f"{value:.1e}" if abs(value) < 1e-18 or abs(value) > 1e-15 else f"{value:.2e}"
