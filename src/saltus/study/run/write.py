"""Files of an answer: its Dataset, rows and pictures, each written complete or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from saltus.results import to_csv
from saltus.results.files.atomic import replacing
from saltus.results.files.sheets import write_table
from saltus.study.run.running import Running, StudyOutcome

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.answers.question import Question


def write(
    question: Question, ds: xr.Dataset, found: Mapping[str, xr.Dataset], at: Running
) -> StudyOutcome:
    """Write the rows and pictures of an answer; its Dataset is written already."""
    tables, files = question.rows(ds, found), [at.folder / f"{question.stem}.nc"]
    notes = [file.note for file in question.inputs]
    for table in tables[:1]:
        noted = replace(table, notes=(*table.notes, *notes))
        files.append(write_table(noted, at.folder / f"{question.stem}.csv"))
    if question.all_rows:
        files.append(to_csv(ds, at.folder / f"{question.stem}{question.all_rows}.csv"))
    if at.pictures:
        from saltus import plot

        with plot.style():
            files += [
                save_picture(figure, at.folder / f"{question.stem}{end}.png")
                for end, figure in {
                    **question.pictures(ds),
                    **question.pictures_with({**found, question.stem: ds}),
                }.items()
            ]
    return StudyOutcome(tables, files)


def save_picture(figure: Any, file: Path) -> Path:
    """Write a figure, complete or not at all, and close it."""
    import matplotlib.pyplot as plt

    from saltus.plot.picture import keep_drawable

    keep_drawable(figure)  # a title is the user's text
    with replacing(file) as (part,):
        figure.savefig(part, dpi=150, format=file.suffix[1:])
    plt.close(figure)
    return file
