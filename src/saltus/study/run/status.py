"""How far the questions of a study are, read off its output folder."""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from saltus.errors import SaltusError, StudyError
from saltus.results.table import TextTable
from saltus.study.read import read
from saltus.study.run.copies import COPY, copy_of, inputs_of
from saltus.study.run.maps import STORES
from saltus.study.run.stored import PARTIAL

if TYPE_CHECKING:
    from saltus.results.store.store import StoreStatus

_TIME = "%Y-%m-%d %H:%M:%S UTC"


def status_tables(folder: Path) -> list[TextTable]:
    """How far the maps and the other questions of an output folder are, or a store.

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
    """A store that can't be opened, and why."""

    name: str
    why: str


def stores(folder: Path) -> list[StoreStatus | DamagedStore]:
    """How far the stores of an output folder are, or a store itself; empty if there are none."""
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
    """A row for each store; errors of those that can't be opened follow below."""
    columns = ("map", "chunks", "done", "damaged", "MB", "last written", "at work")
    return TextTable(
        "Maps",
        columns,
        tuple(map(_row, found)),
        tuple(one.why for one in found if isinstance(one, DamagedStore)),
    )


def _row(one: StoreStatus | DamagedStore) -> tuple[str, ...]:
    if isinstance(one, DamagedStore):
        return one.name, "damaged", "-", "-", "-", "-", "-"
    return (
        str(one.note.get("name", one.path.name)), f"{one.done} of {one.total}",
        f"{100 * one.done / max(one.total, 1):.0f} %",
        str(one.damaged), f"{one.bytes / 1e6:.1f}",
        one.last_written.strftime(_TIME) if one.last_written else "never",
        ", ".join(one.writers) or "-",
    )  # fmt: skip


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
    """Whether an answer is there, and since when."""
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
