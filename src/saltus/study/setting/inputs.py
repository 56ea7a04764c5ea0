"""Files that a study names: found in the allowed folders, read once, stored with the answers."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from saltus import fence
from saltus.errors import StudyError, shown
from saltus.whole_files import sha256


@dataclass(frozen=True)
class Input:
    """File that a study names.

    Attributes
    ----------
    name : str
        As the study writes it.
    path : Path
        Path from which it was read; for messages.
    data : bytes
        Its content.
    """

    name: str
    path: Path
    data: bytes

    @property
    def sha256(self) -> str:
        """Hash of its contents."""
        return sha256(self.data)

    @property
    def note(self) -> str:
        """Line on the file, for the notes of an answer."""
        return f"{self.name}: SHA-256 {self.sha256}"


class Inputs:
    """Files that a study names. They are searched for in the study's folder, and in those that the
    user allows.

    Parameters
    ----------
    folder : Path
        Of the study.
    allowed : sequence of Path
        More folders, given on the command line.
    """

    _advice = "It must lie in the study's folder."

    def __init__(self, folder: Path, allowed: Sequence[Path] = ()) -> None:
        self._folders = [place.resolve() for place in (folder, *allowed)]
        self._taken: dict[str, Input] = {}

    @property
    def taken(self) -> list[Input]:
        """Files that were read, in the order in which the study names them."""
        return list(self._taken.values())

    def read(self, name: str, place: str) -> Input:
        """Read a file by the name that the study uses in the table ``place``.

        Raises
        ------
        StudyError
            If it lies elsewhere, isn't there, or is no regular file of at most 10 MB. Messages
            don't repeat its contents.
        """
        if name not in self._taken:
            path = self._find(name, place)
            try:
                self._taken[name] = self._checked(
                    Input(name, path, fence.content(path, fence.TABLE_BYTES))
                )
            except fence.RefusedError as refused:
                raise StudyError(f"[{place}] {path} {refused} {self._advice}") from None
        return self._taken[name]

    def _find(self, name: str, place: str) -> Path:
        """Path of the file. Its text is checked first: a query for a network path connects to the
        network.
        """
        if "\0" in name:
            raise StudyError(
                f"[{place}] a file name holds a NUL character. Write the name of a file."
            )
        inside = [
            path
            for folder in self._folders
            if (path := Path(os.path.normpath(folder / name))).is_relative_to(folder)
        ]
        real = [
            path
            for path in inside
            if any(path.resolve().is_relative_to(folder) for folder in self._folders)
        ]
        if not real:
            raise StudyError(
                f"[{place}] {shown(name)} lies outside the study's folder "
                f"{self._folders[0]}, and a study reads nothing there. "
                "Put the file there; or, if you trust the study, allow the folder: --inputs FOLDER."
            )
        return next((path for path in real if path.exists()), real[0])

    def _checked(self, found: Input) -> Input:
        return found


class KeptInputs(Inputs):
    """Copies of files in an output folder, by the names that the study uses.

    Parameters
    ----------
    folder : Path
        Of the copies.
    copies : mapping of str to (str, str)
        Name of the copy and SHA-256 of each file, by its name in the study.
    """

    _advice = "Run the study again, which copies it anew: saltus run STUDY.toml."

    def __init__(self, folder: Path, copies: Mapping[str, tuple[str, str]]) -> None:
        super().__init__(folder)
        self._copies = dict(copies)

    def _find(self, name: str, place: str) -> Path:
        if name not in self._copies:
            raise StudyError(
                f"[{place}] {self._folders[0]} has no copy of {shown(name)}. {self._advice}"
            )
        return self._folders[0] / self._copies[name][0]

    def _checked(self, found: Input) -> Input:
        if found.sha256 != self._copies[found.name][1]:
            raise StudyError(f"{found.path} changed since it was written. {self._advice}")
        return found
