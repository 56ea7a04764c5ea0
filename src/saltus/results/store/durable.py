"""Reading and writing of the files of a store. Errors of the disk become StoreErrors."""

from __future__ import annotations

import errno
import os
from pathlib import Path

from saltus import fence, whole_files
from saltus.errors import SaltusError


class StoreError(SaltusError, OSError):
    """A store can't be made, resumed, locked, written or read."""


def write_whole(path: Path, data: bytes, drafts: Path, name: str) -> None:
    """Write a file that appears under its name complete or not at all, even if the process is
    killed or the disk fails.

    The bytes are on the disk before the name appears, and the name is before this returns. A disk
    that fills up leaves all as it was.

    Parameters
    ----------
    path : Path
        The file.
    data : bytes
        Its content.
    drafts : Path
        Folder on the same disk for the draft; what a killed process leaves behind lies there.
    name : str
        Beginning of the draft's name. No other process may be writing under the same one.

    Raises
    ------
    StoreError
        If the disk is full, the folder is missing or may not be written to.
    """
    advice = (
        "Nothing half-written was left behind, and what was done stays done: make room or mend the "
        "disk, then start again."
    )
    with whole_files.refused_as(StoreError, f"{path} can't be written", advice):
        whole_files.put(path, data, drafts / f"{name}.part")


def read(path: Path, most: int = fence.STORED_BYTES) -> bytes | None:
    """Return the bytes of a file; None if it isn't there, isn't a file of at most ``most`` bytes,
    or the disk can't read it any more.
    """
    try:
        return fence.content(path, most)
    except fence.RefusedError as refused:
        if refused.errno in (None, errno.ENOENT, errno.ENOTDIR, errno.EIO):
            return None
        raise StoreError(
            f"{path} {refused} Mend its permissions or the disk, or remove it."
        ) from refused


def size(path: Path) -> int | None:
    """Size of a file; None if there is none."""
    try:
        return path.stat().st_size if path.is_file() else None
    except FileNotFoundError:  # a draft that has just taken its place
        return None


def tail(path: Path, count: int) -> bytes:
    """The last bytes of a regular file; fewer if it is shorter, or gone."""
    try:
        with path.open("rb") as file:
            file.seek(-min(count, path.stat().st_size), os.SEEK_END)
            return file.read(count)
    except OSError:
        return b""
