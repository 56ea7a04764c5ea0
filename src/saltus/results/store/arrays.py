"""Arrays of any shape as bytes that name their shapes and types. The same arrays give the same
bytes on every machine and version.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping

import numpy as np

from saltus.errors import ParameterError

#: Kinds of numbers and texts that are kept.
_KINDS = "biufcU"


def packed(arrays: Mapping[str, np.ndarray]) -> bytes:
    """A line that says what there is, then the arrays in the order of their names, little-endian.

    Raises
    ------
    ParameterError
        If an array holds neither plain numbers nor texts.
    """
    head, parts = {}, []
    for name, array in sorted(arrays.items()):
        kept = np.ascontiguousarray(array)
        if kept.dtype.kind not in _KINDS:
            raise ParameterError(f"array {name!r} of {kept.dtype} can't be stored.")
        kept = kept.astype(kept.dtype.newbyteorder("<"))
        head[name] = [kept.dtype.str, list(np.shape(array))]
        parts.append(kept.tobytes())
    return json.dumps(head, separators=(",", ":")).encode() + b"\n" + b"".join(parts)


def unpacked(data: bytes) -> dict[str, np.ndarray] | None:
    """The arrays from :func:`packed`'s result; None for other bytes."""
    line, _, content = data.partition(b"\n")
    arrays, begin = {}, 0
    try:
        for name, (kind, shape) in json.loads(line).items():
            dtype, count = np.dtype(kind), math.prod(shape)
            if dtype.kind not in _KINDS or count < 0:
                return None
            size = count * dtype.itemsize
            if len(content) < begin + size:
                return None
            stored = np.frombuffer(content[begin : begin + size], dtype)
            arrays[str(name)] = stored.astype(dtype.newbyteorder("=")).reshape(shape)
            begin += size
    except (ValueError, TypeError, AttributeError, KeyError):
        return None
    return arrays if begin == len(content) else None
