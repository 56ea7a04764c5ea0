"""How far the questions of a study are, read off its output folder."""

from __future__ import annotations

import datetime
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from saltus.errors import SaltusError, StudyError
from saltus.study.copies import COPY, copy_of
from saltus.study.kept import PARTIAL
from saltus.study.maps import STORES
from saltus.study.table import TextTable

if TYPE_CHECKING:
    from saltus.results.store import StoreStatus

_TIME = "%Y-%m-%d %H:%M:%S UTC"


def status_tables(folder: Path) -> list[TextTable]:
    """How far the maps and the other questions of an output folder are, or a store.

    Raises
    ------
    StudyError
        If it holds neither a study nor a store.
    """
    maps = [status_table(found)] if (found := stores(folder)) else []
    others = [] if (folder / "store.json").exists() else question_rows(folder)
    if not maps and not others:
        raise StudyError(f"{folder} holds no store and no study. Give the output folder of a study, such as saltus-runs/fig6b.")
    return maps + ([TextTable("Questions", ("question", "file", "state", "last written"), tuple(others))] if others else [])


@dataclass(frozen=True)
class DamagedStore:
    """A store that can't be opened, and why."""

    name: str
    why: str


def stores(folder: Path) -> list[StoreStatus | DamagedStore]:
    """How far the stores of an output folder are, or a store itself; empty if there are none."""
    from saltus.results.store import Store, StoreError

    found: list[StoreStatus | DamagedStore] = []
    alone = (folder / "store.json").exists()
    for path in [folder] if alone else sorted(done.parent for done in (folder / STORES).glob("*/done") if done.parent.name[0] != "."):
        try:
            found.append(Store.open(path).status())
        except StoreError as error:
            found.append(DamagedStore(path.name, str(error)))
    return found


def status_table(found: list[StoreStatus | DamagedStore]) -> TextTable:
    """A row for each store; what is wrong with one that can't be opened stands below."""
    columns = ("map", "chunks", "done", "damaged", "MB", "last written", "at work")
    return TextTable("Maps", columns, tuple(map(_row, found)), tuple(one.why for one in found if isinstance(one, DamagedStore)))


def _row(one: StoreStatus | DamagedStore) -> tuple[str, ...]:
    if isinstance(one, DamagedStore):
        return one.name, "damaged", "-", "-", "-", "-", "-"
    return (
        str(one.note.get("name", one.path.name)), f"{one.done} of {one.total}", f"{100 * one.done / max(one.total, 1):.0f} %",
        str(one.damaged), f"{one.bytes / 1e6:.1f}", one.last_written.strftime(_TIME) if one.last_written else "never",
        ", ".join(one.writers) or "-",
    )  # fmt: skip


def question_rows(folder: Path) -> list[tuple[str, ...]]:
    """A row for each question whose answer is one file; none without a copy of the study."""
    from saltus.study.read import read

    if not (folder / COPY).is_file():
        return []
    return [(title, f"{stem}.nc", *_state(folder / f"{stem}.nc")) for title, stem in read(copy_of(folder))[0].answers()]


def _state(file: Path) -> tuple[str, str]:
    """Whether an answer is there, and since when."""
    from saltus.results import load

    if not file.exists():
        return ("stopped on the way" if file.with_stem(f"{file.stem}{PARTIAL}").exists() else "not yet"), "never"
    written = datetime.datetime.fromtimestamp(file.stat().st_mtime, datetime.UTC).strftime(_TIME)
    try:
        load(file)
    except SaltusError:
        return "damaged", written
    return "done", written
