"""Progress of the questions of a study, read from its output folder."""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from saltus.errors import SaltusError, StudyError
from saltus.results.table import TextTable
from saltus.study.read import read
from saltus.study.run.copies import COPY, copy_of, inputs_of
from saltus.study.run.divided import STORES
from saltus.study.run.stored import PARTIAL

if TYPE_CHECKING:
    from saltus.results.store.store import StoreStatus

_TIME = "%Y-%m-%d %H:%M:%S UTC"


def status_tables(folder: Path) -> list[TextTable]:
    """Tables of the progress of a store, or of the maps and other questions of an output folder.

    Raises
    ------
    StudyError
        If it holds neither a study nor a store.
    """
    maps = [status_table(found)] if (found := stores(folder)) else []
    others = None if (folder / "store.json").exists() else question_table(folder)
    if not maps and others is None:
        raise StudyError(
            f"{folder} holds no store and no study. Give the output folder of a "
            f"study, such as saltus-runs/fig6b."
        )
    return maps + ([others] if others is not None else [])


@dataclass(frozen=True)
class DamagedStore:
    """Store that can't be opened, with the reason."""

    name: str
    why: str


def stores(folder: Path) -> list[StoreStatus | DamagedStore]:
    """Progress of the stores of an output folder, or of the folder if it is a store; empty if there
    are none.
    """
    from saltus.results.store.store import Store, StoreError

    found: list[StoreStatus | DamagedStore] = []
    alone = (folder / "store.json").exists()
    for path in (
        [folder]
        if alone
        else sorted(one for one in (folder / STORES).glob("[!.]*") if one.is_dir())
    ):
        try:
            found.append(Store.open(path).status())
        except StoreError as error:
            found.append(DamagedStore(path.name, str(error)))
    return found


def status_table(found: list[StoreStatus | DamagedStore]) -> TextTable:
    """A row for each store; errors of stores that can't be opened follow below."""
    columns = ("map", "chunks", "done", "damaged", "MB", "last written", "at work")
    return TextTable(
        "Maps",
        columns,
        tuple(map(_row, found)),
        tuple(one.why for one in found if isinstance(one, DamagedStore)),
    )


def _row(store: StoreStatus | DamagedStore) -> tuple[str, ...]:
    if isinstance(store, DamagedStore):
        return store.name, "damaged", "-", "-", "-", "-", "-"
    return (
        str(store.note.get("name", store.path.name)),
        f"{store.done} of {store.total}",
        f"{100 * store.done / max(store.total, 1):.0f} %",
        str(store.damaged),
        f"{store.bytes / 1e6:.1f}",
        store.last_written.strftime(_TIME) if store.last_written else "never",
        ", ".join(store.writers) or "-",
    )


def question_table(folder: Path) -> TextTable | None:
    """A row for each question whose answer is one file; None without a copy of the study."""
    if not (folder / COPY).is_file():
        return None
    notes: list[str] = []
    try:
        study, text = read(copy_of(folder))
        inputs_of(folder, text)
        rows = [
            (title, f"{stem}.nc", *_state(folder / f"{stem}.nc")) for title, stem in study.answers()
        ]
    except StudyError as error:
        rows, notes = (
            [("the study", COPY, "changed or damaged", _written(folder / COPY))],
            [str(error)],
        )
    return (
        TextTable(
            "Questions", ("question", "file", "state", "last written"), tuple(rows), tuple(notes)
        )
        if rows
        else None
    )


def _state(file: Path) -> tuple[str, str]:
    """State of an answer, and the time when it was written."""
    from saltus.results import load

    if not file.exists():
        return (
            "stopped on the way" if file.with_stem(f"{file.stem}{PARTIAL}").exists() else "not yet"
        ), "never"
    try:
        load(file)
    except SaltusError:
        return "damaged", _written(file)
    return "done", _written(file)


def _written(file: Path) -> str:
    return datetime.datetime.fromtimestamp(file.stat().st_mtime, datetime.UTC).strftime(_TIME)
