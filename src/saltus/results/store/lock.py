"""Locks for one writer at a time. The operating system ends them with the process, however it ends.

A lock is for one shard k of n: the chunks k, k + n, k + 2n ... The whole store is shard 0 of 1. Two
shards exclude each other if they have a chunk in common. Each has a file of its own, and the rule
is: take your own lock, then check that no overlapping one is held. Two processes that do this at
the same moment may both be refused, never both be let in.
"""

from __future__ import annotations

import json
import math
import os
import re
import socket
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path

from saltus import fence
from saltus.results.store.durable import StoreError
from saltus.whole_files import refused_as

#: All chunks, as a shard.
WHOLE = (0, 1)
#: Time to wait for a lock [s]: longer than another process takes to check it, too short to seem
#: like a queue.
_PATIENCE = 0.5
#: Most bytes of the note that names the holder of a lock.
_NOTE = 10_000

#: Open lock files of this process. A forked child closes its copies: otherwise it would hold the
#: locks after its parent was killed.
_HANDLES: set[int] = set()


@contextmanager
def locked(folder: Path, shard: tuple[int, int]) -> Iterator[None]:
    """Hold the lock of one shard.

    Parameters
    ----------
    folder : Path
        Folder of the lock files.
    shard : tuple of int
        (k, n); :data:`WHOLE` for everything.

    Raises
    ------
    StoreError
        If another process, or another part of this one, holds a lock that overlaps: names host,
        process and time.
    """
    own = folder / "{}-of-{}".format(*shard)
    _refuse_if_held(folder, shard, others_only=False)
    with exclusive(own) as handle:
        with suppress(OSError):  # a full disk keeps nobody from holding a lock
            os.write(handle, _this_process())
        _refuse_if_held(folder, shard, others_only=True)
        yield


@contextmanager
def exclusive(file: Path, patience: float = _PATIENCE) -> Iterator[int]:
    """Hold the operating system's lock on one file, made if it doesn't exist; gives the open file.

    The file is emptied but stays: if it were removed, two processes could hold locks on two files
    of the same name.

    Raises
    ------
    StoreError
        If it is held elsewhere, and still is after ``patience`` seconds.
    """
    handle = _open(file)
    process = os.getpid()
    _HANDLES.add(handle)
    try:
        if not _wait(handle, shared=False, patience=patience):
            raise StoreError(_refusal(file))
        os.ftruncate(handle, 0)  # a killed holder left its name
        yield handle
        if os.getpid() == process:
            os.ftruncate(handle, 0)
    finally:
        # In a forked child the file is closed already, and its number may belong to another file.
        if os.getpid() == process:
            _HANDLES.discard(handle)
            os.close(handle)  # which gives the lock back


def holders(folder: Path) -> list[str]:
    """Return a text for each holder of a lock, in the order of the shards."""
    return [
        _holder(file) for _, file in sorted(_locks(folder).items()) if is_held(file, patience=0.0)
    ]


def overlap(one: tuple[int, int], other: tuple[int, int]) -> bool:
    """True if two shards have a chunk in common."""
    return (one[0] - other[0]) % math.gcd(one[1], other[1]) == 0


# -- who holds what --------------------------------------------------------------------------------
def _locks(folder: Path) -> dict[tuple[int, int], Path]:
    """The lock files of shards, held or not."""
    found = {
        file: re.fullmatch(r"(\d+)-of-(\d+)", file.name)
        for file in (folder.iterdir() if folder.is_dir() else ())
    }
    return {(int(match[1]), int(match[2])): file for file, match in found.items() if match}


def _refuse_if_held(folder: Path, shard: tuple[int, int], *, others_only: bool) -> None:
    for other, file in _locks(folder).items():
        if (
            overlap(other, shard)
            and not (others_only and other == shard)
            and is_held(file, _PATIENCE)
        ):
            raise StoreError(_refusal(file))


def is_held(file: Path, patience: float = 0.0) -> bool:
    """True if the lock on a file is held, and stays held for ``patience`` seconds."""
    handle = _open(file, os.O_RDONLY)  # so that anyone who may read the store may ask
    try:
        return not _wait(handle, shared=True, patience=patience)
    finally:
        os.close(handle)


def _refusal(file: Path) -> str:
    return (
        f"{file.parent.parent} is being written by {_holder(file)}. Wait for it, stop it, or "
        f"choose another path."
    )


def _this_process() -> bytes:
    since = datetime.now(UTC).isoformat(sep=" ", timespec="seconds")
    return json.dumps(
        {"host": socket.gethostname(), "process": os.getpid(), "since": since}
    ).encode()


def _holder(file: Path) -> str:
    """``process 4711 on node7 since 2026-01-01 12:00:00+00:00, shard 0 of 4``."""
    k, n = file.name.split("-of-") if "-of-" in file.name else ("0", "1")
    part = "" if n == "1" else f", shard {k} of {n}"
    # The note may be incomplete: the holder writes it after it takes the lock.
    with suppress(OSError, ValueError, LookupError, TypeError, RecursionError):
        who = json.loads(fence.content(file, _NOTE))
        return f"process {who['process']} on {who['host']} since {who['since']}{part}"
    return f"another process{part}"


# -- the operating system --------------------------------------------------------------------------
def _open(file: Path, flags: int = os.O_RDWR | os.O_CREAT) -> int:
    """Open a lock file. A pipe isn't waited for; a link isn't followed, since its target would be
    emptied.
    """
    advice = "Choose a folder that can be written to."
    with refused_as(StoreError, f"{file} can't be locked", advice):
        if file.is_symlink() or (file.exists() and not file.is_file()):
            raise StoreError(
                f"{file} can't be locked: it is no regular file. Remove it, then start again."
            )
        return os.open(
            file, flags | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOFOLLOW", 0), 0o666
        )


def _wait(handle: int, *, shared: bool, patience: float) -> bool:
    """Try to lock until it succeeds or ``patience`` is spent: another process's check takes a
    moment only.
    """
    end = time.monotonic() + patience
    while not _try(handle, shared=shared):
        if time.monotonic() >= end:
            return False
        time.sleep(0.02)
    return True


if sys.platform == "win32":
    import msvcrt

    def _try(handle: int, *, shared: bool) -> bool:  # noqa: ARG001
        """Try once to lock a file on Windows. It has no shared locks: checks exclude each other for
        a moment. Locked bytes can't be read, so the locked byte lies far behind the text.
        """
        os.lseek(handle, 1 << 30, os.SEEK_SET)
        try:
            msvcrt.locking(handle, msvcrt.LK_NBLCK, 1)
        except OSError:
            return False
        finally:
            os.lseek(handle, 0, os.SEEK_SET)
        return True

else:
    import fcntl

    def _try(handle: int, *, shared: bool) -> bool:
        try:
            fcntl.flock(handle, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        except OSError as error:
            raise StoreError(
                f"this file system has no locks ({error.strerror}), so two writers could not be "
                f"kept apart. Put the store on another disk."
            ) from error
        return True

    def _close_copies() -> None:
        for handle in _HANDLES:
            with suppress(OSError):
                os.close(handle)
        _HANDLES.clear()

    os.register_at_fork(after_in_child=_close_copies)
