"""The folder of generated kernels: one file per (equations, templates, versions, processor); safe to lose, and this user's alone.

An entry holds code, so a folder or a file that others could have written to is never used: kernels are then compiled for this process
only, and kept in its memory. An entry is written beside the others and renamed into place, so processes that start cold at once can't
disturb each other; its checksum is verified before anything of it is used, and a damaged one is built again.
"""

from __future__ import annotations

import shutil
import time
import warnings
from dataclasses import dataclass
from pathlib import Path

from saltus.cache_folder import cache_folder
from saltus.codegen import entry
from saltus.errors import SaltusWarning

#: Age from which an unfinished entry belongs to a process that was killed [s].
_ABANDONED = 86_400.0


@dataclass(frozen=True)
class Entry:
    """One cached object: its key, what it was made for, its size [bytes] and its file."""

    name: str
    system: str
    size_bytes: int
    path: Path


def folder() -> Path:
    """Where generated kernels are kept: ``$SALTUS_CACHE``, else the user's cache folder."""
    return cache_folder()


def entries() -> list[Entry]:
    """Every entry, by name."""
    paths = sorted(folder().glob(f"*{entry.SUFFIX}"))
    return [Entry(path.stem, entry.title_of(path), path.lstat().st_size, path) for path in paths if not path.name.startswith(entry.DRAFT)]


def clear() -> int:
    """Delete every entry and every unfinished one; returns how many entries there were."""
    found = entries()
    for one in found:
        entry.remove(one.path)
    if folder().is_dir():
        for path in folder().iterdir():
            if path.name.startswith(entry.DRAFT) or ((path / "kernels.py").exists() and (path / "manifest.json").exists()):
                _delete(path)
    return len(found)


def _delete(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        entry.remove(path)


def read(key: str) -> bytes | None:
    """The object of an entry, None if there is none that can be used; a warning says why not."""
    final = folder() / (key + entry.SUFFIX)
    try:
        return entry.read(final) if _usable() else None
    except FileNotFoundError:
        return None
    except (entry.NotOurs, entry.Damaged) as why:
        _warn(f"saltus: the compiled kernel {final} {why}; building it again.")
        return None


def keep(key: str, title: str, data: bytes) -> None:
    """Write an entry, where that can be done.

    Parameters
    ----------
    key : str
        Its name.
    title : str
        What `saltus cache` shows for it.
    data : bytes
        Object code.
    """
    final = folder() / (key + entry.SUFFIX)
    if not _usable():
        return
    try:
        _sweep(final.parent)
        entry.write(final, title, data)
    except OSError as error:
        if not final.exists():  # no other process has done it
            _cannot_write(final.parent, error)


def _usable() -> bool:
    """Whether the folder can be used, made if it isn't there; a warning says why not."""
    place = folder()
    try:
        place.mkdir(parents=True, exist_ok=True, mode=0o700)
        entry.check_folder(place)
    except entry.NotOurs as why:
        _warn(
            f"saltus: the folder of compiled kernels {place} {why}, so whoever writes there could run code as you. It isn't used: kernels "
            "are compiled for this process only. Close it (chmod go-w), or set SALTUS_CACHE to a folder of yours."
        )
        return False
    except OSError as error:
        _cannot_write(place, error)
        return False
    return True


def _sweep(place: Path) -> None:
    """Delete what processes left unfinished that were killed long ago."""
    for path in place.glob(f"{entry.DRAFT}*"):
        try:
            if time.time() - path.lstat().st_mtime > _ABANDONED:
                _delete(path)
        except OSError:  # its process has finished it
            continue


def _cannot_write(place: Path, error: OSError) -> None:
    _warn(
        f"saltus: {place} can't be written ({error.strerror or error}); kernels are compiled for this process only. "
        "Set SALTUS_CACHE to a folder of yours with free space."
    )


def _warn(text: str) -> None:
    warnings.warn(text, SaltusWarning, stacklevel=6)
