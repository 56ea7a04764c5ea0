"""``store.json``: the content of a store and its origin. Its hash is in every record, so that each
chunk names its store.
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from saltus.results.store.chunks import TRAILER, Chunks, is_whole
from saltus.results.store.durable import StoreError, read, write_whole
from saltus.results.store.lock import exclusive
from saltus.whole_files import seal, sha256, unseal

#: Number of the layout of the files. A store with another layout is refused, not guessed at.
FORMAT = 3
#: Name of the file.
HEAD = "store.json"
#: Folder of the chunks.
CHUNKS = "chunks"
#: Most cells of a map: a damaged head with more would fill memory with the list of chunks.
MOST_CELLS = 10**9
_TYPES = {
    "bool",
    "float32",
    "float64",
    "complex64",
    "complex128",
    *(f"{kind}{bits}" for kind in ("int", "uint") for bits in (8, 16, 32, 64)),
}


def head_of(identity: Mapping[str, str], note: Mapping[str, Any], chunks: Chunks) -> dict[str, Any]:
    """Return the content of ``store.json``."""
    return {
        "format": FORMAT,
        "identity": dict(identity),
        "note": dict(note),
        "shape": list(chunks.shape),
        "chunk": chunks.chunk,
        "arrays": None
        if chunks.arrays is None
        else {name: dtype.name for name, dtype in chunks.arrays.items()},
    }


def fingerprint(head: Mapping[str, Any]) -> str:
    """SHA-256 of a head without its note, which is for people. Stores with equal fingerprints may
    exchange chunks.
    """
    return sha256(
        seal({name: head[name] for name in ("format", "identity", "shape", "chunk", "arrays")})
    )


def read_head(path: Path) -> dict[str, Any]:
    """The head of the store in a folder.

    Raises
    ------
    StoreError
        If there is none, it is damaged, or of another layout.
    """
    data = read(path / HEAD)
    if data is None:
        what = (
            "there is no store"
            if not path.exists()
            else ("this is not a store of saltus, and it was left alone")
        )
        raise StoreError(f"{path}: {what}. Choose another path.")
    head = _opened(data)
    if head is None:
        raise StoreError(
            f"{path / HEAD} is damaged. Go on with the study that made it: the file "
            f"is written again, and all chunks stay."
        )
    if head["format"] != FORMAT:
        age = "a later" if head["format"] > FORMAT else "an earlier"
        layout = f"layout {head['format']}, known: {FORMAT}"
        raise StoreError(
            f"{path} was made by {age} saltus ({layout}). Use that one, or choose another path."
        )
    return head


def _opened(data: bytes | None) -> dict[str, Any] | None:
    """Return the content of a head; None if it is damaged, or isn't the content of a head. The
    content of another layout isn't checked.
    """
    head = unseal(data)
    if head is None or not isinstance(head.get("format"), int):
        return None
    return head if head["format"] != FORMAT or _says_what_a_head_says(head) else None


def _says_what_a_head_says(head: Mapping[str, Any]) -> bool:
    shape, chunk, arrays = head.get("shape"), head.get("chunk"), head.get("arrays")
    if not (
        _texts(head.get("identity"))
        and isinstance(head.get("note"), dict)
        and isinstance(shape, list)
    ):
        return False
    if not (
        shape and all(isinstance(one, int) and 0 < one <= MOST_CELLS for one in (*shape, chunk))
    ):
        return False
    return math.prod(shape) <= MOST_CELLS and (
        arrays is None or (_texts(arrays) and set(arrays.values()) <= _TYPES)
    )


def _texts(values: Any) -> bool:
    return isinstance(values, dict) and all(isinstance(value, str) for value in values.values())


def mend_head(path: Path, head: Mapping[str, Any]) -> None:
    """Write ``store.json`` again if it is damaged, gone or another store's, and the chunks next to
    it were made under ``head``.

    Raises
    ------
    StoreError
        If it is damaged and the chunks were made from something else.
    """
    there = _opened(read(path / HEAD))
    if there is not None and (
        there.get("format") != FORMAT or fingerprint(there) == fingerprint(head)
    ):
        return
    if there is not None and (_made_under(path, there) or not _made_under(path, head)):
        return  # an intact head that differs: the caller compares the two and says how
    if there is None and _made_under(path, head) is None and not (path / HEAD).exists():
        return  # an empty folder, or something else: not ours to write to
    if _made_under(path, head) is False:
        raise StoreError(
            f"{path / HEAD} is damaged, and the chunks beside it were made from something else "
            f"than what is asked for here. Nothing was "
            "changed. Go on with the study that made them, which writes the file again, or choose "
            "another path."
        )
    with exclusive(path / "locks" / "head", patience=10.0):
        write_whole(path / HEAD, seal(head), path / "parts", "head")


def _made_under(path: Path, head: Mapping[str, Any]) -> bool | None:
    """True if an intact chunk or artifact in a folder was made under this head, False if all of
    them were made under another; None if none is intact.
    """
    chunks = Chunks.checked(tuple(head["shape"]), head["chunk"], head["arrays"])
    wanted, strangers = fingerprint(head), False
    for file in numbered(path).values() if (path / CHUNKS).is_dir() else ():
        data = read(file) or b""
        if is_whole(data):
            if int(file.stem) < chunks.count and chunks.fits(
                int(file.stem), data[-TRAILER:], wanted
            ):
                return True
            strangers = True
    for file in sorted((path / "artifacts").glob("*.json")):
        record = unseal(read(file))
        if record is not None and "store" in record:
            if record["store"] == wanted:
                return True
            strangers = True
    return False if strangers else None


def numbered(path: Path) -> dict[int, Path]:
    """The files of chunks in a store's folder, by number, in rising order."""
    names = [name for name in os.listdir(path / CHUNKS) if re.fullmatch(r"\d+\.chunk", name)]
    return {
        number: path / CHUNKS / f"{number}.chunk"
        for number in sorted(int(name[:-6]) for name in names)
    }
