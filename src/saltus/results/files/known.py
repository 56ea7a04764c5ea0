"""Checksums of result files that need no trial: this user's saltus wrote them, or has tried them.

Each is an empty file of that name in a folder of the user's alone. The folder is safe to lose: what
it held is tried again.
"""

from __future__ import annotations

import os
import stat
from contextlib import suppress
from functools import cache
from pathlib import Path

from saltus.cache import entry
from saltus.cache import folder as cache_folder
from saltus.cache.entry import NotOurs, check_folder

#: Most checksums kept; above that the folder is emptied by the next process that writes.
MOST = 20_000
_HERE: set[str] = set()


def folder() -> Path:
    """Return the folder of the checksums: in ``$SALTUS_CACHE``, else in the user's cache folder."""
    return cache_folder() / "known-results"


def is_known(digest: str) -> bool:
    """True if this user's saltus wrote the file with this checksum, or has tried it."""
    path = folder()
    if digest in _HERE:
        return True
    try:
        check_folder(path)
        return stat.S_ISREG(os.lstat(path / digest).st_mode)
    except (OSError, NotOurs):
        return False


def note(digest: str) -> None:
    """Remember a checksum: in this process, and for others where the folder can be used."""
    _HERE.add(digest)
    path = folder()
    with suppress(OSError, NotOurs):
        path.mkdir(parents=True, exist_ok=True, mode=0o700)
        check_folder(path)
        _sweep(path)
        os.close(
            os.open(path / digest, os.O_CREAT | os.O_WRONLY | getattr(os, "O_NOFOLLOW", 0), 0o600)
        )


def count() -> int:
    """Count the checksums."""
    try:
        return len(os.listdir(folder()))
    except OSError:
        return 0


def forget() -> int:
    """Forget all checksums; return their number. Each file is tried again when it is loaded
    next.
    """
    before, path = count(), folder()
    _HERE.clear()
    with suppress(OSError, NotOurs):
        check_folder(path)
        for name in os.listdir(path):
            entry.remove(path / name)
    return before - count()


@cache
def _sweep(place: Path) -> None:
    names = os.listdir(place)
    for name in names if len(names) > MOST else ():
        entry.remove(place / name)
