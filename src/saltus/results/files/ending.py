"""Ending of a result file: a checksum of all bytes before it, checked before any parser sees the
file.

netCDF-4 and netCDF-3 both say where their data end, and readers stop there: what follows is ours. A
damaged HDF5 file can keep the HDF5 library busy for ever, so a checksum inside comes too late. It
says that a file is whole, not who wrote it: what this user's saltus didn't write here is tried in a
process of its own first (see :mod:`saltus.results.files.known`).
"""

from __future__ import annotations

import hashlib
import os
import re
import subprocess
import sys
import threading
from pathlib import Path

from saltus.errors import shown
from saltus.results.files.atomic import ResultFileError

_ENDING = re.compile(rb"\nsaltus-sha256:([0-9a-f]{64})\n")
_LENGTH = 80
#: Time limit for reading an empty file without an ending [s].
PATIENCE = 60.0
#: Slowest rate of reading [byte/s]; a larger file gets more time.
SLOWEST = 1e7
#: Time after which a line tells the user to wait [s].
SILENT = 2.0
#: Memory limit for reading, in sizes of the file.
TIMES = 8
#: Least memory limit for reading [byte].
LEAST = 4 << 30
#: Program that tries the libraries below xarray: xarray takes longer to load than most files.
_TRIAL = """
import contextlib, sys
with contextlib.suppress(ImportError, ValueError, OSError):
    import resource
    resource.setrlimit(resource.RLIMIT_AS, (int(sys.argv[3]), int(sys.argv[3])))
if sys.argv[2] == "h5netcdf":
    import h5netcdf, h5py
    with h5py.File(sys.argv[1]) as file:
        for name in file:
            one = file[name] if isinstance(file.get(name, getlink=True), h5py.HardLink) else None
            if not isinstance(one, h5py.Dataset) or one.external or one.is_virtual:
                raise ValueError("it holds folders, or leads to other files, which no result does")
    file = h5netcdf.File(sys.argv[1], "r", decode_vlen_strings=True)
else:
    import scipy.io
    file = scipy.io.netcdf_file(sys.argv[1], mmap=False)
for one in file.variables.values():
    one[...], dict(getattr(one, "attrs", {}))
dict(getattr(file, "attrs", {}))
"""


def with_ending(content: bytes | memoryview) -> bytes:
    """Append the ending to the bytes of a file."""
    return (
        bytes(content) + b"\nsaltus-sha256:" + hashlib.sha256(content).hexdigest().encode() + b"\n"
    )


def checksum_in(ended: bytes) -> str:
    """Checksum in the ending that :func:`with_ending` appended."""
    return ended[-65:-1].decode()


def checksum(path: Path) -> str | None:
    """Checksum at the end of a file, after a check of the bytes before it; None if there is no
    checksum.

    Raises
    ------
    ResultFileError
        If it is that of other bytes.
    """
    with path.open("rb") as file:
        left = max(os.fstat(file.fileno()).st_size - _LENGTH, 0)
        file.seek(left)
        ending = _ENDING.fullmatch(file.read())
        if ending is None:
            return None
        digest = hashlib.sha256()
        file.seek(0)
        while left:
            part = file.read(min(left, 1 << 20))
            if not part:
                break
            digest.update(part)
            left -= len(part)
    if digest.hexdigest().encode() != ending[1]:
        raise ResultFileError(
            f"{path} is damaged: the checksum at its end doesn't match. Restore "
            f"it from a copy or compute it again."
        )
    return ending[1].decode()


def try_elsewhere(path: Path, engine: str) -> None:
    """Read a file of unknown origin in a subprocess with a time and memory limit.

    Raises
    ------
    ResultFileError
        If that fails, comes to no end, or the file leads to others.
    """
    size = path.stat().st_size
    patience = PATIENCE + size / SLOWEST
    command = [
        sys.executable,
        "-P",
        "-c",
        _TRIAL,
        str(path.resolve()),
        engine,
        str(max(TIMES * size, LEAST)),
    ]
    known = os.pathsep.join(place for place in sys.path if place)
    line = f"saltus tries {path} in another process first: at most {patience:.0f} s"
    word = threading.Timer(SILENT, print, (line,), {"file": sys.stderr, "flush": True})
    word.daemon = True
    word.start()
    try:
        done = subprocess.run(
            command,
            capture_output=True,
            timeout=patience,
            check=False,
            env={**os.environ, "PYTHONPATH": known},
            stdin=subprocess.DEVNULL,
        )
    except subprocess.TimeoutExpired:
        raise ResultFileError(
            f"{path} is damaged: reading it came to no end within {patience:.0f} s. Restore it "
            f"from a copy or compute it again."
        ) from None
    except OSError as error:
        raise ResultFileError(
            f"{path} can't be tried: {error.strerror or error}. Compute it again."
        ) from error
    finally:
        word.cancel()
    if done.returncode:
        why = (done.stderr.decode(errors="replace").strip().splitlines() or ["the reader crashed"])[
            -1
        ]
        raise ResultFileError(
            f"{path} is damaged: {shown(why, 200)}. Restore it from a copy or compute it again."
        )
