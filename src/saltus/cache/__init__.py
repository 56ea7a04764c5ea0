"""The cache that processes share, keyed by the inputs of each entry: safe to lose, and private to
this user.

Compiled kernels, one for each (equations, templates, versions, processor); and the hash of saltus's
code, by that of its text. A kernel is code, so a folder or a file that others could have written to
is never used: kernels are then compiled for this process only, in its memory. An entry is written
under another name and renamed into place, so processes that start cold at once can't disturb each
other; its checksum is verified before anything of it is used, and a damaged one is made again.
"""

from __future__ import annotations

import os
import shutil
import warnings
from dataclasses import dataclass
from pathlib import Path

import platformdirs

from saltus.cache import entry
from saltus.errors import SaltusWarning
from saltus.whole_files import ABANDONED, is_older

#: Suffixes of the names of entries, by content.
KERNEL, HASH = ".kernel", ".hash"
_CALLED = {KERNEL: "compiled kernel", HASH: "hash of the code"}
#: Ages from which a hash of code and a kernel count as old [s]: the folder doesn't grow for ever.
_OLD = {HASH: 30 * ABANDONED, KERNEL: 90 * ABANDONED}


@dataclass(frozen=True)
class Entry:
    """One cached object: its key, its system, its size [bytes] and its file."""

    name: str
    system: str
    size_bytes: int
    path: Path


def folder() -> Path:
    """The folder of the cache: ``$SALTUS_CACHE`` with ``~`` for the home folder, else saltus's
    folder in the user's cache.
    """
    chosen = os.environ.get("SALTUS_CACHE")
    return (
        Path(os.path.expanduser(chosen))
        if chosen
        else Path(platformdirs.user_cache_dir("saltus", appauthor=False))
    )


def kernels() -> list[Entry]:
    """Every kernel, by name."""
    paths = sorted(
        path for path in folder().glob(f"*{KERNEL}") if not path.name.startswith(entry.DRAFT)
    )
    return [Entry(path.stem, entry.title_of(path), path.lstat().st_size, path) for path in paths]


def clear() -> int:
    """Delete every entry and every unfinished one; return the number of kernels."""
    found = kernels()
    for path in folder().iterdir() if folder().is_dir() else ():
        old = (path / "kernels.py").exists() and (path / "manifest.json").exists()
        if path.name.startswith(entry.DRAFT) or path.suffix in (KERNEL, HASH) or old:
            _delete(path)
    return len(found)


def _delete(path: Path) -> None:
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path, ignore_errors=True)
    else:
        entry.remove(path)


def read(key: str, kind: str = KERNEL) -> bytes | None:
    """The bytes of an entry, None if there is none that can be used; a warning says why not."""
    final = folder() / (key + kind)
    try:
        return entry.read(final) if _usable() else None
    except FileNotFoundError:
        return None
    except (entry.NotOurs, entry.Damaged) as why:
        _warn(f"saltus: the {_CALLED[kind]} {final} {why}; building it again.")
        return None


def keep(key: str, title: str, data: bytes, kind: str = KERNEL) -> None:
    """Write an entry, if possible.

    Parameters
    ----------
    key : str
        Its name.
    title : str
        Its title in `saltus cache`.
    data : bytes
        Its content.
    kind : str
        :data:`KERNEL` or :data:`HASH`.
    """
    final = folder() / (key + kind)
    if not _usable():
        return
    try:
        _sweep(final.parent)
        entry.write(final, title, data)
    except OSError as error:
        if not final.exists():  # no other process has done it
            _cannot_write(final.parent, error)


def _usable() -> bool:
    """True if the folder can be used, made if it doesn't exist; a warning says why not."""
    directory = folder()
    try:
        directory.mkdir(parents=True, exist_ok=True, mode=0o700)
        entry.check_folder(directory)
    except entry.NotOurs as why:
        _warn(
            f"saltus: the folder of compiled kernels {directory} {why}, so whoever writes there "
            f"could run code as you. It isn't used: kernels "
            "are compiled for this process only. Close it (chmod go-w), or set SALTUS_CACHE to a "
            "folder of yours."
        )
        return False
    except OSError as error:
        _cannot_write(directory, error)
        return False
    return True


def _sweep(directory: Path) -> None:
    """Delete unfinished entries of processes that were killed long ago, and old entries."""
    _sweep_older(directory, f"{entry.DRAFT}*", ABANDONED)
    for kind, age in _OLD.items():
        _sweep_older(directory, f"*{kind}", age)


def _sweep_older(directory: Path, pattern: str, age: float) -> None:
    for path in directory.glob(pattern):
        try:
            if is_older(path, age):
                _delete(path)
        except OSError:  # its process has finished it
            continue


def _cannot_write(directory: Path, error: OSError) -> None:
    _warn(
        f"saltus: {directory} can't be written ({error.strerror or error}); kernels are compiled "
        f"for this process only. "
        "Set SALTUS_CACHE to a folder of yours with free space."
    )


def _warn(text: str) -> None:
    warnings.warn(text, SaltusWarning, stacklevel=6)
