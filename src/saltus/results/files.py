"""Files that are there in full or not at all."""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from saltus.errors import SaltusError


class ResultFileError(SaltusError, OSError):
    """The file of a result can't be written or read."""


@contextmanager
def replacing(*paths: Path) -> Iterator[list[Path]]:
    """Temporary files beside ``paths``, which take their places together when the block ends.

    They are flushed to the disk first. If the block, the flush or the change of places fails, the temporary files are removed and what
    stood under the names before stays.

    Parameters
    ----------
    paths : Path
        Files to write. The last one takes its place last: it tells that the others are complete.

    Yields
    ------
    list of Path
        Where to write instead.

    Raises
    ------
    ResultFileError
        If the disk is full, the folder is missing or may not be written to.
    """
    paths = tuple(path.resolve() for path in paths)  # through a link, so that the link stays
    if not paths[-1].parent.is_dir():
        raise ResultFileError(f"{paths[-1]} can't be written: there is no folder {paths[-1].parent}. Make it first.")
    temporary = [path.with_name(f".{path.name}.{uuid.uuid4().hex[:8]}.part") for path in paths]
    try:
        yield temporary
        for part in temporary:
            _flush(part)
        for part, path in zip(temporary, paths, strict=True):
            os.replace(part, path)
        _flush(paths[-1].parent)
    except OSError as error:
        raise ResultFileError(
            f"{paths[-1]} can't be written: {error.strerror or error}. Nothing was left behind. Free some space or choose another folder."
        ) from error
    finally:
        for part in temporary:
            part.unlink(missing_ok=True)


def usable_folder(path: Path) -> Path:
    """A folder that can be written to, made if it isn't there: asked before long work, not after it.

    Raises
    ------
    ResultFileError
        If it can't be made or written to.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        probe = path / f".{uuid.uuid4().hex[:8]}.part"
        probe.touch()
        probe.unlink()
    except OSError as error:
        raise ResultFileError(
            f"{path} can't hold results: {error.strerror or error}. Nothing was computed; choose another folder."
        ) from error
    return path


def _flush(path: Path) -> None:
    """Have what was written to a file, or the names in a folder, reach the disk."""
    if path.is_dir() and os.name == "nt":  # Windows can't open a folder
        return
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
