"""Copy of a study in its output folder, with the files that it names, under a seal. `resume` reads
this copy.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path, PurePosixPath
from typing import Any

from saltus import fence
from saltus.errors import StudyError
from saltus.results.files.atomic import ResultFileError, replacing
from saltus.study.setting.inputs import Input, Inputs, KeptInputs
from saltus.whole_files import seal, sha256, unseal

#: Name of the copy of the study.
COPY = "study.toml"
#: Name of the seal, which holds the hashes of the copies.
SEAL = "study.seal"
#: Folder of the copies of the files that the study names.
INPUTS = "inputs"
_CHANGED = (
    "changed since it was written. Run the study that it was made from again, with --out "
    "{}: finished results are reused."
)


def keep_copy(folder: Path, text: str, files: Iterable[Input]) -> None:
    """Copy a study and the files that it names into its output folder, byte for byte; the seal
    holds their hashes.
    """
    names = _names(files := list(files))
    if files:
        if not (folder / INPUTS).resolve().is_relative_to(folder.resolve()):
            raise ResultFileError(
                f"{folder / INPUTS} is a link that leaves {folder}: nothing is "
                f"written through it. Remove it."
            )
        (folder / INPUTS).mkdir(exist_ok=True)
    for file in files:
        _write(folder / INPUTS / names[file.name], file.data)
    data = text.encode()
    hashes = {file.name: {"copy": names[file.name], "sha256": file.sha256} for file in files}
    _write(folder / SEAL, seal({"study": sha256(data), "inputs": hashes}))
    _write(folder / COPY, data)


def _write(path: Path, data: bytes) -> None:
    """Write a file unless it exists: a study that is run again leaves its copy untouched."""
    if path.is_symlink() or not path.is_file() or path.read_bytes() != data:
        with replacing(path) as (part,):
            part.write_bytes(data)


def _names(files: Iterable[Input]) -> dict[str, str]:
    """File names for the copies, different on every file system."""
    names: dict[str, str] = {}
    for file in files:
        plain = PurePosixPath(
            re.sub(r"[^\w.-]+", "-", re.split(r"[/\\]", file.name)[-1])[-80:].lstrip(".-")
            or "input"
        )
        name, number = plain.name, 1
        while name.lower() in {taken.lower() for taken in names.values()}:
            number += 1
            name = f"{plain.stem}-{number}{plain.suffix}"
        names[file.name] = name
    return names


def copy_of(folder: Path) -> Path:
    """The study in an output folder. Raises StudyError if there is none."""
    if not (folder / COPY).is_file():
        raise StudyError(
            f"{folder} holds no {COPY}: it isn't the output folder of a study. Run "
            f"the study again with --out {folder}."
        )
    return folder / COPY


def inputs_of(folder: Path, text: str) -> Inputs:
    """The copies of the files that the study in an output folder names, ``text`` being the study as
    it stands there.

    Raises
    ------
    StudyError
        If it isn't the text that was written, or the seal is damaged.
    """
    if not (folder / SEAL).exists():  # a study that somebody put there by hand
        return Inputs(folder / INPUTS)
    try:
        sealed = unseal(fence.content(folder / SEAL, fence.STUDY_BYTES))
    except fence.RefusedError as refused:
        raise StudyError(f"{folder / SEAL} {refused}") from None
    if sealed is None or not _is_seal(sealed):
        raise StudyError(f"{folder / SEAL} {_CHANGED.format(folder)}")
    if sealed["study"] != sha256(text.encode()):
        raise StudyError(f"{folder / COPY} {_CHANGED.format(folder)}")
    return KeptInputs(
        folder / INPUTS,
        {name: (one["copy"], one["sha256"]) for name, one in sealed["inputs"].items()},
    )


def _is_seal(sealed: dict[str, Any]) -> bool:
    """True if a seal has its form: hashes, and names of copies in one folder."""
    inputs = sealed.get("inputs")
    return (
        isinstance(sealed.get("study"), str)
        and isinstance(inputs, dict)
        and all(
            isinstance(one, dict)
            and isinstance(one.get("sha256"), str)
            and _is_name(one.get("copy"))
            for one in inputs.values()
        )
    )


def _is_name(copy: object) -> bool:
    return (
        isinstance(copy, str)
        and bool(re.fullmatch(r"[\w.-]{1,200}", copy))
        and copy.strip(".") != ""
    )
