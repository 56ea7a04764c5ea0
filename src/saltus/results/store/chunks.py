"""The grid of a map, cut into chunks, and a chunk's bytes as zarr keeps them. Nothing here touches the disk.

zarr encodes and decodes in memory; the store writes what comes out, since zarr's own store for folders doesn't wait for the disk. The bytes
are little-endian numbers and a CRC-32C, not compressed: the same numbers give the same bytes on every machine and version.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import zarr
from zarr.buffer import cpu
from zarr.codecs import Crc32cCodec
from zarr.storage import MemoryStore

from saltus.errors import ParameterError


@dataclass(frozen=True)
class Chunks:
    """How a map is cut.

    Attributes
    ----------
    shape : tuple of int
        Size of the grid along each of its dims; cells are counted in C order.
    chunk : int
        Cells in one chunk, the last one excepted.
    arrays : dict of str to dtype
        What is kept of each cell, by name.
    """

    shape: tuple[int, ...]
    chunk: int
    arrays: dict[str, np.dtype]

    @classmethod
    def checked(cls, shape: tuple[int, ...], chunk: int, arrays: Mapping[str, Any]) -> Chunks:
        """The same from what a caller passed.

        Raises
        ------
        ParameterError
            If a size isn't positive, a name can't be a folder's, or a dtype isn't a plain number.
        """
        shape = tuple(int(size) for size in shape)
        if not shape or min(shape) < 1 or chunk < 1:
            raise ParameterError(f"a grid of shape {shape} can't be cut into chunks of {chunk} cells. Give sizes of at least 1.")
        types = {name: np.dtype(dtype).newbyteorder("=") for name, dtype in sorted(arrays.items())}
        for name, dtype in types.items():
            if not name.isidentifier() or dtype.kind not in "biufc":
                raise ParameterError(f"array {name!r} of {dtype} can't be stored: names are words, values plain numbers.")
        if not types:
            raise ParameterError("a store needs at least one array.")
        return cls(shape, min(int(chunk), math.prod(shape)), types)

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
            raise ParameterError(f"there is no chunk {index}: they are numbered from 0 to {self.count - 1}.")
        return slice(index * self.chunk, min((index + 1) * self.chunk, self.cells))

    def as_text(self) -> dict[str, str]:
        """The same in words: what must agree when a store is resumed."""
        return {
            "shape": " x ".join(map(str, self.shape)),
            "chunk": str(self.chunk),
            "arrays": ", ".join(f"{name} {dtype.name}" for name, dtype in self.arrays.items()),
        }


class Codec:
    """Values of a chunk to bytes and back, and the metadata that lets any reader of zarr 3 do the same.

    Parameters
    ----------
    chunks : Chunks
    attributes : mapping
        Of the group: plain values.
    """

    def __init__(self, chunks: Chunks, attributes: Mapping[str, Any]) -> None:
        self._chunks = chunks
        self._memory: dict[str, Any] = {}
        group = zarr.create_group(MemoryStore(self._memory), zarr_format=3, attributes=dict(sorted(attributes.items())))
        self._arrays = {
            name: group.create_array(
                name, shape=(chunks.cells,), chunks=(chunks.chunk,), dtype=dtype, fill_value=_no_value(dtype), filters=None,
                compressors=[Crc32cCodec()], dimension_names=("cell",),
                config={"write_empty_chunks": True},  # a chunk of fill values is a result like any other
            )
            for name, dtype in chunks.arrays.items()
        }  # fmt: skip
        #: Files that make a folder a zarr group, by their path in it.
        self.metadata = {path: buffer.to_bytes() for path, buffer in sorted(self._memory.items())}

    def encode(self, index: int, name: str, values: np.ndarray) -> bytes:
        """Bytes of one array of a chunk.

        Raises
        ------
        ParameterError
            If there are too few or too many values, or their dtype would lose digits.
        """
        extent, dtype = self._chunks.extent(index), self._chunks.arrays[name]
        values = np.asarray(values)
        if values.shape != (extent.stop - extent.start,) or not np.can_cast(values.dtype, dtype, "safe"):
            raise ParameterError(
                f"chunk {index} of {name!r} has {extent.stop - extent.start} values of {dtype}, not {values.shape} of {values.dtype}."
            )
        self._arrays[name][extent] = values.astype(dtype)
        return self._memory.pop(self.key(index, name)).to_bytes()

    def decode(self, index: int, name: str, data: bytes) -> np.ndarray:
        """Values of one array of a chunk."""
        key = self.key(index, name)
        self._memory[key] = cpu.Buffer.from_bytes(data)
        try:
            return np.asarray(self._arrays[name][self._chunks.extent(index)])
        finally:
            self._memory.pop(key, None)

    def largest(self, name: str) -> int:
        """Most bytes of one array of a chunk: its values, and the checksum after them."""
        return self._chunks.chunk * self._chunks.arrays[name].itemsize + 4

    @staticmethod
    def key(index: int, name: str) -> str:
        """Path of a chunk's file in the group."""
        return f"{name}/c/{index}"


def _no_value(dtype: np.dtype) -> Any:
    """What a reader that doesn't ask for the done-map sees where nothing is computed: a value that stands out."""
    if dtype.kind in "fc":
        return np.nan
    if dtype.kind == "b":
        return False
    return np.iinfo(dtype).min if dtype.kind == "i" else np.iinfo(dtype).max
