"""The folder of generated kernels: one file per (equations, templates, versions, processor); safe to lose, and this user's alone.

An entry holds code, so a folder or a file that others could have written to is never used: kernels are then compiled for this process
only, and kept in its memory. An entry is written beside the others and renamed into place, so processes that start cold at once can't
disturb each other; its checksum is verified before anything of it is used, and a damaged one is built again.
"""

from __future__ import annotations

import atexit
import os
import shutil
import sys
import threading
import time
import warnings
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import platformdirs

from saltus.codegen import entry, machine
from saltus.codegen.announce import announce
from saltus.errors import SaltusWarning
from saltus.interrupt import check_stop

#: Age from which an unfinished entry belongs to a process that was killed [s].
_ABANDONED = 86_400.0
#: One thread at a time sees to an entry: a module stands in sys.modules before it is complete.
_LOCKS: defaultdict[str, threading.Lock] = defaultdict(threading.Lock)
atexit.register(machine.end_all)


@dataclass(frozen=True)
class Entry:
    """One cached module: its key, the system it was made for, its size [bytes] and its file."""

    name: str
    system: str
    size_bytes: int
    path: Path


def folder() -> Path:
    """Where generated kernels are kept: ``$SALTUS_CACHE``, else the user's cache folder."""
    chosen = os.environ.get("SALTUS_CACHE")
    return Path(chosen) if chosen else Path(platformdirs.user_cache_dir("saltus", appauthor=False))


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


def load(key: str, source: str, title: str, what: str | None = None, seconds: float = 20.0) -> ModuleType:
    """The module with this source, from the cache or compiled now.

    Parameters
    ----------
    key : str
        Name of the entry: a hash of everything that its machine code depends on, the source included.
    source : str
        Text of the module. Its one function for Python is decorated with ``kept(signature, **options of numba.njit)``.
    title : str
        What `saltus cache` shows for it.
    what : str, optional
        What is said to be compiled, if it must be; default the title.
    seconds : float
        How long that takes on a quiet machine [s], for people who wait.

    Raises
    ------
    CacheError
        If the process that compiles is killed.
    Interrupted
        If the work that this thread does a part of was asked to stop.
    """
    name = f"saltus_kernels_{key}"
    with _held(_LOCKS[key]):
        if name in sys.modules:
            return sys.modules[name]
        usable = _usable()
        final = folder() / (key + entry.SUFFIX)
        found = _from_cache(name, final) if usable else None
        return found or _build(name, final if usable else None, source, title, what or title, seconds)


@contextmanager
def _held(lock: threading.Lock) -> Iterator[None]:
    """Hold a lock; who is asked to stop while it waits for one stops."""
    while not lock.acquire(timeout=machine.LOOK):
        check_stop()
    try:
        yield
    finally:
        lock.release()


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


def _from_cache(name: str, final: Path) -> ModuleType | None:
    """The module, if its entry can be used; a warning says why not."""
    try:
        return machine.rebuilt(name, entry.read(final))
    except FileNotFoundError:
        return None
    except (entry.NotOurs, entry.Damaged) as why:
        _warn(f"saltus: the compiled kernel {final} {why}; building it again.")
    except Exception as error:  # whatever makes Numba raise: the entry is ours, so build it again
        _warn(f"saltus: the compiled kernel {final} could not be loaded ({error!r}); building it again.")
    return None


def _build(name: str, final: Path | None, source: str, title: str, what: str, seconds: float) -> ModuleType:
    """Compile, and publish where that can be done. If no other process can compile, this one does, and tells what is wrong."""
    announce(what, seconds)
    data = machine.compiled_elsewhere(name, source, title)
    module = None if data is None else machine.rebuilt(name, data)
    if module is None:
        module, data = machine.compiled(name, source)
    if data is not None and final is not None:
        try:
            _sweep(final.parent)
            entry.write(final, title, data)
        except OSError as error:
            if not final.exists():  # no other process has done it
                _cannot_write(final.parent, error)
    return module


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
