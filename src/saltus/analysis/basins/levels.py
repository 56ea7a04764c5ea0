"""The order in which a map on a screen is computed: coarse to fine, from its middle outwards."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

#: Cells along the longer side of the coarsest level, at least; less than twice as many, if there
#: are so many.
FIRST = 16
#: Cells of the finest level along the side of a tile: neighbours appear together.
TILE = 64


@dataclass(frozen=True)
class GridLevel:
    """The cells of a grid whose indices are multiples of a stride, and that no coarser level holds.

    Attributes
    ----------
    shape : (int, int)
        Cells of the grid along its two axes.
    stride : int
        A power of two; 1 of the finest level.
    coarsest : bool
        Whether it is the first level, which holds all multiples.
    """

    shape: tuple[int, int]
    stride: int
    coarsest: bool

    @property
    def count(self) -> int:
        """Number of its cells."""
        first, second = (-(-size // self.stride) for size in self.shape)
        if self.coarsest:
            return first * second
        return first * second - (-(-first // 2)) * (-(-second // 2))

    def tiles(self) -> Iterator[np.ndarray]:
        """Its cells of the flattened grid, int64[k], tile by tile, the nearest to the middle
        first.
        """
        side = max(TILE, self.stride)
        corners = np.stack(
            [one.ravel() for one in np.mgrid[tuple(slice(0, n, side) for n in self.shape)]], axis=1
        )
        middle = 0.5 * (np.array(self.shape) - side)
        order = np.argsort(((corners - middle) ** 2).sum(axis=1), kind="stable")
        for corner in corners[order].tolist():
            rows, columns = (
                np.arange(at, min(at + side, size), self.stride)
                for at, size in zip(corner, self.shape, strict=True)
            )
            cells = rows[:, None] * self.shape[1] + columns
            if not self.coarsest:
                odd = 2 * self.stride
                fresh = (rows[:, None] % odd != 0) | (columns % odd != 0)
                cells = cells[fresh]
            if cells.size:
                yield cells.ravel()


def levels_of(shape: tuple[int, int]) -> list[GridLevel]:
    """The levels of a grid, the coarsest first."""
    power = max((max(shape) // FIRST).bit_length() - 1, 0)
    return [GridLevel(shape, 2**n, n == power) for n in range(power, -1, -1)]


def stride_of(cells: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Stride of the level that each cell of the flattened grid belongs to, int64[k]."""
    rows, columns = np.unravel_index(cells, shape)
    both = rows | columns | levels_of(shape)[0].stride
    strides: np.ndarray = both & -both
    return strides
