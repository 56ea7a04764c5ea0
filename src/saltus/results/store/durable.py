"""Files that reach the disk complete or not at all, and JSON that knows when it was damaged. The
ground under a store; files of single results are files/atomic.py's.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from saltus import fence
from saltus.errors import ParameterError, SaltusError


class StoreError(SaltusError, OSError):
    """A store can't be made, resumed, locked, written or read."""


def write_whole(path: Path, data: bytes, drafts: Path, name: str) -> None:
    """Write a file that appears under its name complete or not at all, whatever befalls the process
    or the disk.

    The bytes are on the disk before the name appears, and the name is before this returns. A disk
    that fills up leaves all as it was.

    Parameters
    ----------
    path : Path
        The file.
    data : bytes
        What is in it.
    drafts : Path
        Folder on the same disk for the draft; what a killed process leaves behind lies there.
    name : str
        Beginning of the draft's name. No other process may be writing under the same one.

    Raises
    ------
    StoreError
        If the disk is full, the folder is missing or may not be written to.
    """
    draft = drafts / f"{name}.part"
    try:
        write(draft, data)
        os.replace(draft, path)
        flush_names(path.parent)
    except OSError as error:
        raise StoreError(
            f"{path} can't be written: {error.strerror or error}. Nothing half-written was left "
            f"behind, and what was done stays done: "
            "make room or mend the disk, then start again."
        ) from error
    finally:
        with suppress(OSError):  # swept away at the next start
            draft.unlink(missing_ok=True)


def write(path: Path, data: bytes) -> None:
    """Write a file and wait until its bytes are on the disk."""
    with path.open("wb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def flush_names(folder: Path) -> None:
    """Wait until the names in a folder are on the disk."""
    if os.name == "nt":  # Windows can't open a folder
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def read(path: Path, most: int = fence.STORED_BYTES) -> bytes | None:
    """What is in a file; None if it isn't there, isn't one of at most ``most`` bytes, or the disk
    can't read it any more.
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


def sha256(data: bytes) -> str:
    """SHA-256 in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def seal(values: Mapping[str, Any]) -> bytes:
    """JSON text with a checksum of itself; the same values give the same bytes, whatever their
    order.
    """
    return _text({**values, "checksum": sha256(_text(values))})


def unseal(data: bytes) -> dict[str, Any] | None:
    """What :func:`seal` was given; None if one bit of it is not what it was."""
    try:
        values = json.loads(data)
        return (
            values
            if seal({name: value for name, value in values.items() if name != "checksum"}) == data
            else None
        )
    except (ValueError, AttributeError, RecursionError):
        return None


def _text(values: Mapping[str, Any]) -> bytes:
    try:
        return json.dumps(values, indent=1, sort_keys=True).encode() + b"\n"
    except TypeError as error:
        raise ParameterError(
            f"only plain values can be stored: None, booleans, numbers, text, lists, dicts with "
            f"text keys ({error})."
        ) from None
