"""Writing of result files. Errors of the disk become ResultFileErrors."""

from __future__ import annotations

import os
import re
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from saltus.errors import ParameterError, SaltusError, shown
from saltus.whole_files import drafted, flush, is_older, refused_as

#: Names of drafts.
_DRAFT = re.compile(r"\.(.+\.)?[0-9a-f]{8}\.part")


class ResultFileError(SaltusError, OSError):
    """The file of a result can't be written or read."""


def path_of(given: object) -> Path:
    """Return what a caller gave as the path of a file. Raises ParameterError if it is no path."""
    if not isinstance(given, str | os.PathLike) or "\0" in os.fspath(given):
        raise ParameterError(
            f"{shown(given)} isn't the path of a file. Write it as text, such as 'run.nc'."
        )
    return Path(given)


@contextmanager
def replacing(*paths: Path) -> Iterator[list[Path]]:
    """Temporary files beside ``paths``, which take their places together when the block ends.

    They are flushed to the disk first. If the block, the flush or the change of places fails, the
    temporary files are removed and what stood under the names before stays.

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
        If the disk is full, the folder is missing or may not be written to, or a path is a link to
        a file in another folder.
    """
    paths = tuple(_target(path) for path in paths)
    temporary = [path.with_name(f".{path.name}.{uuid.uuid4().hex[:8]}.part") for path in paths]
    advice = "Nothing was left behind. Free some space or choose another folder."
    with (
        refused_as(ResultFileError, f"{paths[-1]} can't be written", advice),
        drafted(paths, temporary),
    ):
        yield temporary
        for part in temporary:
            flush(part)


def _target(path: Path) -> Path:
    """Return the file that a path leads to. A link is followed and stays; a link out of its folder
    is refused, since it might lead to anything.
    """
    what = f"{shown(str(path))} can't be written"
    with refused_as(ResultFileError, what, "Choose another name."):
        target = path.resolve()
        if path.is_symlink() and not target.is_relative_to(path.parent.resolve()):
            raise ResultFileError(
                f"{path} is a link to {target}, in another folder: nothing is written through it. "
                f"Remove it, or name the file."
            )
        if not target.parent.is_dir():
            raise ResultFileError(
                f"{path} can't be written: there is no folder {path.parent}. Make it first."
            )
    return target


def remove_old_drafts(folder: Path) -> None:
    """Remove the drafts of killed processes from a folder: those older than a day."""
    for draft in folder.glob(".*.part"):
        with suppress(OSError):  # it isn't ours to remove, or has just taken its place
            if _DRAFT.fullmatch(draft.name) and draft.is_file() and is_older(draft):
                draft.unlink()


@contextmanager
def no_folder_left(path: Path) -> Iterator[None]:
    """Remove the folders that are made inside the block if an error leaves them empty."""
    missing = [one for one in (path, *path.parents) if not one.exists()]
    try:
        yield
    except Exception:
        with suppress(OSError):  # one that holds something stays, and those around it
            for one in missing:
                one.rmdir()
        raise


def usable_folder(path: Path) -> Path:
    """Check that a folder can be written to, and make it if it doesn't exist. Call this before long
    work.

    Raises
    ------
    ResultFileError
        If it can't be made or written to.
    """
    advice = "Nothing was computed; choose another folder."
    with refused_as(ResultFileError, f"{path} can't hold results", advice):
        path.mkdir(parents=True, exist_ok=True)
        remove_old_drafts(path)
        probe = path / f".{uuid.uuid4().hex[:8]}.part"
        probe.touch()
        probe.unlink()
    return path
