"""Files that are complete or absent, and JSON that shows damage, for the cache, stores, results and
the copies of studies.

A file is written under another name, its draft, and renamed into place. What is to outlast the
machine's power as well reaches the disk before it has its name, and the name before the call
returns.
"""

from __future__ import annotations

import hashlib
import json
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from saltus.errors import ParameterError, SaltusError

#: Age [s] from which on nobody is writing a draft any more.
ABANDONED = 86_400.0


# -- writing ---------------------------------------------------------------------------------------
def put(path: Path, data: bytes, draft: Path, *, lasting: bool = True, mode: int = 0o666) -> None:
    """Write a file that appears under its name complete or not at all.

    Parameters
    ----------
    path : Path
        The file.
    data : bytes
        Its content.
    draft : Path
        Path that is written first, on the same disk; no other process writes there.
    lasting : bool
        Whether it must be on the disk when this returns. What can be made again needn't.
    mode : int
        Its permissions, less those that the process never gives.

    Raises
    ------
    OSError
        If it can't be written. What stood under the name before stays, and no draft.
    """
    with drafted([path], [draft], lasting=lasting):
        write(draft, data, lasting=lasting, mode=mode)


@contextmanager
def drafted(
    paths: Sequence[Path], drafts: Sequence[Path], *, lasting: bool = True
) -> Iterator[None]:
    """Write drafts within the block. At its end they take the names of ``paths`` in this order, so
    the last file shows that the others are complete.

    Where ``lasting``, each draft must be on the disk by then. If anything fails, what stood under
    the names before stays, and no draft.
    """
    try:
        yield
        for draft, path in zip(drafts, paths, strict=True):
            os.replace(draft, path)
        if lasting:
            flush(paths[-1].parent)
    finally:
        for draft in drafts:
            with suppress(OSError):  # of a killed process it stays, and is swept away later
                draft.unlink(missing_ok=True)


@contextmanager
def refused_as(error: type[OSError], what: str, advice: str) -> Iterator[None]:
    """Raise errors of the disk within the block as ``error``, such as "PATH can't be written: no
    space left on device. Free some space."
    """
    try:
        yield
    except SaltusError:
        raise
    except OSError as refused:
        reason = refused.strerror or refused
        raise error(f"{what}: {reason}. {advice}") from refused


def write(path: Path, data: bytes, *, lasting: bool = True, mode: int = 0o666) -> None:
    """Write a file, and wait until its bytes are on the disk unless it needn't survive a crash."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | getattr(os, "O_BINARY", 0)
    with os.fdopen(os.open(path, flags, mode), "wb") as file:
        file.write(data)
        file.flush()
        if lasting:
            os.fsync(file.fileno())


def flush(path: Path) -> None:
    """Wait until the content of a file, or the names in a folder, are on the disk."""
    if path.is_dir() and os.name == "nt":  # Windows can't open a folder
        return
    handle = os.open(path, os.O_RDONLY if path.is_dir() else os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def is_older(path: Path, age: float = ABANDONED) -> bool:
    """True if a file was last written longer than ``age`` ago [s]; False if it is gone."""
    try:
        return time.time() - path.lstat().st_mtime > age
    except FileNotFoundError:  # a draft that has just taken its name
        return False


# -- seals -----------------------------------------------------------------------------------------
def sha256(data: bytes) -> str:
    """SHA-256 in hexadecimal."""
    return hashlib.sha256(data).hexdigest()


def seal(values: Mapping[str, Any]) -> bytes:
    """JSON text with a checksum of itself. Equal values give equal bytes, in any order."""
    return _text({**values, "checksum": sha256(_text(values))})


def unseal(data: bytes | None, **identity: object) -> dict[str, Any] | None:
    """Return what :func:`seal` was given. None if there is no data, a bit of it differs, or it
    doesn't hold the values of ``identity``, so that it belongs elsewhere.
    """
    try:
        values = json.loads(data or b"")
        whole = seal({name: value for name, value in values.items() if name != "checksum"}) == data
    except (ValueError, AttributeError, RecursionError):
        return None
    return values if whole and identity.items() <= values.items() else None


def _text(values: Mapping[str, Any]) -> bytes:
    try:
        return json.dumps(values, indent=1, sort_keys=True).encode() + b"\n"
    except TypeError as error:
        raise ParameterError(
            f"only plain values can be stored: None, booleans, numbers, text, lists, dicts with "
            f"text keys ({error})."
        ) from None
