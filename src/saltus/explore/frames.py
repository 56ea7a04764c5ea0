"""Frames: an answer's head and its arrays as bytes, and back."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np

#: Answer to a question: a head that JSON can hold, and arrays by name.
Answer: TypeAlias = tuple[Mapping[str, Any], Mapping[str, np.ndarray]]
#: A function that takes an answer.
Emit: TypeAlias = Callable[[Mapping[str, Any], Mapping[str, np.ndarray]], None]
#: Types of arrays that a page can view in place, little endian.
TYPES = ("f4", "f8", "u1", "i1", "u2", "u4", "i4")
#: Heads and arrays begin at multiples of this [bytes].
_STEP = 8
_MAP = b'{"kind": "map-'


def packed(head: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> bytes:
    """An answer as one frame.

    The frame is ``uint32 length | head | arrays``, little endian. The head is JSON, padded with
    blanks; ``arrays`` in it lists the name, type, length and place of each array, the place in
    bytes from the end of the head. Numbers of the head that aren't finite become null.

    Parameters
    ----------
    head : mapping
        What JSON can hold; arrays and numbers of NumPy too.
    arrays : mapping of str to array
        Of the types :data:`TYPES`.
    """
    places, parts, at = [], [], 0
    for name, given in arrays.items():
        array = np.ascontiguousarray(given)
        kind = array.dtype.newbyteorder("<").str[1:]
        if kind not in TYPES:
            raise TypeError(f"{name}: a frame holds no array of {array.dtype}")
        data = array.astype(array.dtype.newbyteorder("<"), copy=False).tobytes()
        places.append([name, kind, array.size, at])
        parts.append(data + bytes(-len(data) % _STEP))
        at += len(parts[-1])
    text = json.dumps(plain({**head, "arrays": places}), allow_nan=False).encode()
    text += b" " * (-(len(text) + 4) % _STEP)
    return b"".join([struct.pack("<I", len(text)), text, *parts])


def of_map(frame: bytes | bytearray | memoryview) -> bool:
    """True for a frame of a map: its head begins with its kind."""
    return bytes(frame[4 : 4 + len(_MAP)]) == _MAP


def unpacked(frame: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The head and the arrays of a frame; the arrays are views of it."""
    (length,) = struct.unpack_from("<I", frame)
    head = json.loads(frame[4 : 4 + length])
    return head, {
        name: np.frombuffer(frame, np.dtype(f"<{kind}"), count, 4 + length + at)
        for name, kind, count, at in head.pop("arrays")
    }


def plain(value: Any) -> Any:
    """A value as JSON can hold it: numbers and arrays of NumPy as those of Python, None for numbers
    that aren't finite.
    """
    match value:
        case Mapping():
            return {str(name): plain(one) for name, one in value.items()}
        case str() | bool() | None:
            return value
        case np.ndarray() | np.generic():
            return plain(value.tolist())
        case list() | tuple():
            return [plain(one) for one in value]
        case float():
            return value if math.isfinite(value) else None
        case _:
            return value
