"""Grid of a map, divided into chunks, and the bytes of a chunk, which name their place. store.py
writes them, whole_files.py makes them durable; nothing here touches the disk.

A chunk is one file: its arrays in the order of their names, as little-endian numbers (behind a line
that names their shapes where chunks differ in size: arrays.py); then its
number and the hash of its store; then the SHA-256 of all that. In another place, or another store,
it doesn't fit, and no bit of it can change unseen. The same numbers give the same bytes on every
machine and version.
"""

from __future__ import annotations

import hashlib
import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.errors import ParameterError
from saltus.results.store.arrays import packed, unpacked

#: Number of the chunk, and hash of the store's head.
_PLACE = struct.Struct("<q32s")
#: Bytes behind the numbers: the place, and the checksum.
TRAILER = _PLACE.size + hashlib.sha256().digest_size


@dataclass(frozen=True)
class Chunks:
    """Division of a map into chunks.

    Attributes
    ----------
    shape : tuple of int
        Size of the grid along each of its dims; cells are counted in C order.
    chunk : int
        Cells in one chunk, the last one excepted.
    arrays : dict of str to dtype, or None
        Values kept of each cell, by name; None if each chunk has arrays of its own shapes.
    """

    shape: tuple[int, ...]
    chunk: int
    arrays: dict[str, np.dtype] | None

    @classmethod
    def checked(
        cls, shape: tuple[int, ...], chunk: int, arrays: Mapping[str, Any] | None
    ) -> Chunks:
        """Chunks from the arguments of a caller.

        Raises
        ------
        ParameterError
            If a size isn't positive, a name can't be a folder's, or a dtype isn't a plain number.
        """
        shape = tuple(int(size) for size in shape)
        if not shape or min(shape) < 1 or chunk < 1:
            raise ParameterError(
                f"a grid of shape {shape} can't be cut into chunks of {chunk} "
                f"cells. Give sizes of at least 1."
            )
        chunk = min(int(chunk), math.prod(shape))
        if arrays is None:
            return cls(shape, chunk, None)
        types = {name: np.dtype(dtype).newbyteorder("=") for name, dtype in sorted(arrays.items())}
        for name, dtype in types.items():
            if not name.isidentifier() or dtype.kind not in "biufc":
                raise ParameterError(
                    f"array {name!r} of {dtype} can't be stored: names are words, "
                    f"values plain numbers."
                )
        if not types:
            raise ParameterError("a store needs at least one array.")
        return cls(shape, chunk, types)

    @property
    def cells(self) -> int:
        """Cells of the grid."""
        return math.prod(self.shape)

    @property
    def count(self) -> int:
        """Number of chunks."""
        return -(-self.cells // self.chunk)

    def extent(self, index: int) -> slice:
        """Cells of a chunk, in the flattened grid.

        Raises
        ------
        ParameterError
            If there is no such chunk.
        """
        if not 0 <= index < self.count:
            raise ParameterError(
                f"there is no chunk {index}: they are numbered from 0 to {self.count - 1}."
            )
        return slice(index * self.chunk, min((index + 1) * self.chunk, self.cells))

    def as_text(self) -> dict[str, str]:
        """Texts that must agree when a store is resumed."""
        return {
            "shape": " x ".join(map(str, self.shape)),
            "chunk": str(self.chunk),
            "arrays": "of any shape"
            if self.arrays is None
            else ", ".join(f"{name} {dtype.name}" for name, dtype in self.arrays.items()),
        }

    def size(self, index: int) -> int | None:
        """Bytes of the file of a chunk; None if chunks differ in size."""
        extent = self.extent(index)
        if self.arrays is None:
            return None
        cells: int = extent.stop - extent.start
        return cells * sum(dtype.itemsize for dtype in self.arrays.values()) + TRAILER

    def encode(self, index: int, values: Mapping[str, np.ndarray], store: str) -> bytes:
        """Bytes of the file of a chunk.

        Parameters
        ----------
        index : int
            Number of the chunk.
        values : mapping of str to ndarray (cells,)
            Every array; where chunks differ in size arrays of any shape.
        store : str
            Hash of the store's head, 64 hexadecimal digits.

        Raises
        ------
        ParameterError
            If an array is missing or unknown, there are too few or too many values, or their dtype
            would lose digits.
        """
        parts = [packed(values)] if self.arrays is None else self._parts(index, values)
        content = b"".join([*parts, _place(index, store)])
        return content + hashlib.sha256(content).digest()

    def _parts(self, index: int, values: Mapping[str, np.ndarray]) -> list[bytes]:
        assert self.arrays is not None
        if set(values) != set(self.arrays):
            raise ParameterError(
                f"chunk {index} has the arrays {sorted(values)}, the store keeps "
                f"{sorted(self.arrays)}."
            )
        extent = self.extent(index)
        parts = []
        for name, dtype in self.arrays.items():
            array = np.asarray(values[name])
            if array.shape != (extent.stop - extent.start,) or not np.can_cast(
                array.dtype, dtype, "safe"
            ):
                raise ParameterError(
                    f"chunk {index} of {name!r} has {extent.stop - extent.start} values of "
                    f"{dtype}, not {array.shape} of {array.dtype}."
                )
            parts.append(array.astype(dtype.newbyteorder("<")).tobytes())
        return parts

    def decode(self, index: int, data: bytes, store: str) -> dict[str, np.ndarray] | None:
        """Values of a chunk, by array; None if the file isn't this chunk of this
        store, bit by bit.
        """
        if (
            self.size(index) not in (None, len(data))
            or not self.fits(index, data[-TRAILER:], store)
            or not is_whole(data)
        ):
            return None
        if self.arrays is None:
            return unpacked(data[:-TRAILER])
        extent, values, begin = self.extent(index), {}, 0
        for name, dtype in self.arrays.items():
            stored = np.frombuffer(data, dtype.newbyteorder("<"), extent.stop - extent.start, begin)
            values[name], begin = stored.astype(dtype), begin + stored.nbytes
        return values

    @staticmethod
    def fits(index: int, trailer: bytes, store: str) -> bool:
        """True if the last bytes of a file name this chunk of this store."""
        return trailer[: _PLACE.size] == _place(index, store)


def _place(index: int, store: str) -> bytes:
    return _PLACE.pack(index, bytes.fromhex(store))


def is_whole(data: bytes) -> bool:
    """True if the bytes of a file match the checksum at their end."""
    end = max(0, len(data) - hashlib.sha256().digest_size)
    return len(data) >= TRAILER and hashlib.sha256(memoryview(data)[:end]).digest() == data[end:]
