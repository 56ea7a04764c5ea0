"""The copy of a study in its output folder, with the files that it names: what `resume` reads."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from saltus.errors import StudyError
from saltus.results.files import replacing

#: Name of the copy of the study, and the folder of copies of files that it names.
COPY, INPUTS = "study.toml", "inputs"


def keep_copy(folder: Path, text: str, files: Iterable[Path]) -> None:
    """Copy a study and the files that it names into its output folder; a file that can't be read is left for its reader to tell."""
    with replacing(folder / COPY) as (part,):
        part.write_text(text, encoding="utf-8")
    for file in files:
        if file.is_file() and file.parent != folder / INPUTS:
            (folder / INPUTS).mkdir(exist_ok=True)
            with replacing(folder / INPUTS / file.name) as (part,):
                part.write_bytes(file.read_bytes())


def copy_of(folder: Path) -> Path:
    """The study in an output folder. Raises StudyError if there is none."""
    if not (folder / COPY).is_file():
        raise StudyError(f"{folder} holds no {COPY}: it isn't the output folder of a study. Run the study again with --out {folder}.")
    return folder / COPY
