"""Matrices of a structure from files: NumPy, MATLAB, Matrix Market."""

from __future__ import annotations

import contextlib
import io
import os
import zipfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from saltus import fence
from saltus.errors import ParameterError, shown

#: Names of the matrices in a file, in small letters.
KEYS = {"mass": ("m", "mass"), "stiffness": ("k", "stiffness"), "damping": ("c", "damping")}
#: Largest content of one file, unpacked [bytes].
MOST_BYTES = 8 * 10**9
#: The words of a message that says how files are written.
_HOW = (
    "Write the matrices as numpy.savez(path, M=mass, K=stiffness), a MATLAB file of M and K, or "
    "one Matrix Market file each."
)


@dataclass(frozen=True)
class File:
    """An open file of matrices.

    Attributes
    ----------
    name : str
        As the user wrote it.
    data : bytes or None
        Its content; None if it is on the disk.
    """

    name: str
    data: bytes | None = None

    @contextlib.contextmanager
    def opened(self) -> Iterator[BinaryIO]:
        """The file, open for reading. Raises RefusedError if it is no regular file."""
        if self.data is not None:
            yield io.BytesIO(self.data)
            return
        path = Path(self.name).expanduser()
        fence.regular(path)
        with open(path, "rb") as file:
            yield file


def is_file(given: Any) -> bool:
    """True for the path of a file, or a file."""
    return isinstance(given, str | os.PathLike | File)


def matrices_of(mass: Any, stiffness: Any, damping: Any) -> dict[str, Any]:
    """Mass, stiffness and damping, read where they are files; ``names`` if a file holds them.

    Parameters
    ----------
    mass, stiffness, damping : matrix, path or None
        A mass without a stiffness beside it is a file which holds all of them.

    Raises
    ------
    ParameterError
        If a file can't be read, or doesn't hold the matrices.
    """
    if is_file(mass) and stiffness is None:
        found = _all_in(_file(mass))
        if damping is not None:
            if "damping" in found:
                raise ParameterError(
                    f"{_file(mass).name} holds a damping matrix, and damping= is another. Keep one."
                )
            found["damping"] = _one_in(damping, "damping")
        return found
    if stiffness is None:
        raise ParameterError(
            "give a mass and a stiffness matrix, sl.structure(mass, stiffness, ...), or a file "
            "that holds both, sl.structure('plate.npz', ...)."
        )
    given = {"mass": mass, "stiffness": stiffness, "damping": damping}
    return {key: _one_in(one, key) for key, one in given.items()}


def _file(given: Any) -> File:
    return given if isinstance(given, File) else File(os.fspath(given))


def _one_in(given: Any, key: str) -> Any:
    """A matrix as it is, or that of a file."""
    if not is_file(given):
        return given
    file = _file(given)
    held = _held(file)
    if len(held) == 1:
        return next(iter(held.values()))
    found = _named(held, key, file)
    if found is None:
        raise ParameterError(f"{file.name} holds {_listed(held)}, and no {key} matrix. {_HOW}")
    return found


def _all_in(file: File) -> dict[str, Any]:
    """The matrices of a file that holds several."""
    held = _held(file)
    found = {key: _named(held, key, file) for key in KEYS}
    missing = [key for key in ("mass", "stiffness") if found[key] is None]
    if missing:
        alone = " A file of one matrix stands for this one: sl.structure('M.mtx', 'K.mtx')."
        raise ParameterError(
            f"{file.name} holds {_listed(held)}, and no {' and no '.join(missing)} matrix, called "
            f"{' and '.join(KEYS[one][0].upper() for one in missing)}."
            f"{alone if len(held) == 1 else ''} {_HOW}"
        )
    written = {key: one for key, one in found.items() if one is not None}
    for key, one in held.items():
        if key.lower() == "names":
            written["names"] = _texts(one)
    return written


def _named(held: Mapping[str, Any], key: str, file: File) -> Any:
    """The matrix of a file that is called by one of its names, None if there is none."""
    found = [name for name in held if name.lower() in KEYS[key]]
    if len(found) > 1:
        raise ParameterError(
            f"{file.name} holds two {key} matrices, {' and '.join(found)}. Keep one."
        )
    return held[found[0]] if found else None


def _listed(held: Mapping[str, Any]) -> str:
    names = sorted(name for name in held if name)
    return ", ".join(map(shown, names[:8])) + (", ..." if len(names) > 8 else "") or "one matrix"


def _texts(given: Any) -> list[str]:
    """Names of degrees of freedom, also from a cell array of MATLAB."""
    entries = np.asarray(given).ravel().tolist()
    return [str(np.asarray(one).ravel()[0]).strip() if np.size(one) else "" for one in entries]


# -- formats ---------------------------------------------------------------------------------------
def _held(file: File) -> dict[str, Any]:
    """The matrices of a file by their names; a matrix without a name is called ``""``."""
    parts = file.name.lower().rsplit(".", 1)
    reader = _READERS.get(parts[-1]) if len(parts) == 2 else None
    if reader is None:
        raise ParameterError(
            f"{shown(file.name)} is no matrix, and no file of matrices: these end in "
            f".{', .'.join(_READERS)}. {_HOW}"
        )
    try:
        with file.opened() as stream:
            held = reader(stream)
    except fence.RefusedError as refused:
        raise ParameterError(f"{file.name} {refused}") from None
    except MemoryError:
        raise ParameterError(f"{file.name} doesn't fit into the memory.") from None
    except Exception as error:  # readers of foreign files raise what they like
        why = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise ParameterError(f"{file.name} can't be read: {shown(why)}. {_HOW}") from None
    return held


def _npz(stream: BinaryIO) -> dict[str, Any]:
    with zipfile.ZipFile(stream) as parts:
        _check_size(sum(one.file_size for one in parts.infolist()))
    stream.seek(0)
    with np.load(stream, allow_pickle=False) as held:
        found = {name: held[name] for name in held.files}
    if {"format", "shape", "data"} <= set(found):
        from scipy.sparse import load_npz

        stream.seek(0)
        return {"": load_npz(stream)}
    return found


def _npy(stream: BinaryIO) -> dict[str, Any]:
    return {"": np.load(stream, allow_pickle=False)}


def _mat(stream: BinaryIO) -> dict[str, Any]:
    from scipy.io import loadmat, whosmat

    try:
        _check_size(
            sum(8 * int(np.prod(shape)) for _, shape, kind in whosmat(stream) if kind != "sparse")
        )
        stream.seek(0)
        found = loadmat(stream)
    except NotImplementedError:
        raise ValueError("it is of MATLAB's version 7.3: save it with '-v7'") from None
    return {name: one for name, one in found.items() if not name.startswith("__")}


def _mtx(stream: BinaryIO) -> dict[str, Any]:
    from scipy.io import mminfo, mmread

    # by its path: of an open file of more than some lines SciPy seeks before the beginning, which
    # ends the process
    source = getattr(stream, "name", stream)
    rows, columns, _, kind, *_ = mminfo(source)
    if kind == "array":
        _check_size(8 * rows * columns)
    stream.seek(0)
    return {"": mmread(source)}  # entries alone: rows take memory, and are counted before


def _check_size(size: int) -> None:
    if size > MOST_BYTES:
        raise ValueError(f"it holds {size / 1e9:.3g} GB, and at most {MOST_BYTES / 1e9:g} are read")


_READERS: dict[str, Callable[[BinaryIO], dict[str, Any]]] = {
    "npz": _npz, "npy": _npy, "mat": _mat, "mtx": _mtx,
}  # fmt: skip
