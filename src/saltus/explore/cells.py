"""Cells of maps in some two bytes each, and back."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

#: Columns of the strips in which cells are counted.
STRIP = 64


def packed_cells(
    cells: np.ndarray, label: np.ndarray, age: np.ndarray, columns: int
) -> dict[str, np.ndarray]:
    """Cells of a map in some two bytes each: ``look`` uint8[k], a row of the tables ``label`` and
    ``age``, and ``step`` uint8, how far the cells lie apart. They are counted in strips of
    :data:`STRIP` columns, row by row of a strip, where neighbours settle together; a step of 255 is
    added to the next one.

    Parameters
    ----------
    cells : int64[k]
        Of the flattened grid.
    label, age : int8[k], uint8[k]
        Of these.
    columns : int
        Of the grid.
    """
    row, column = np.divmod(cells, columns)
    order = np.lexsort((column, row, column // STRIP))
    rows = 1 + int(row.max(initial=0))
    place = (column // STRIP * rows + row) * STRIP + column % STRIP
    step = np.diff(place[order], prepend=0)
    far = step // 255
    ends = np.cumsum(far + 1)
    steps = np.full(int(ends[-1]) if len(ends) else 0, 255, "u1")
    steps[ends - 1] = step % 255
    both = np.stack([label.view("u1"), age], axis=1).view("u2").ravel()[order]
    table, look = np.unique(both, return_inverse=True)
    kinds = table[:, None].view("u1").reshape(-1, 2)
    small = "u1" if len(table) <= 256 else "u2"
    return {
        "step": steps, "rows": np.array([rows], "u4"), "look": look.astype(small),
        "label": kinds[:, 0].view("i1"), "age": kinds[:, 1],
    }  # fmt: skip


def unpacked_cells(arrays: Mapping[str, np.ndarray], columns: int) -> dict[str, np.ndarray]:
    """The cells, labels and ages of :func:`packed_cells`, as the page reads them."""
    step = arrays["step"].astype(np.int64)
    strip, place = np.divmod(np.cumsum(step)[step < 255], int(arrays["rows"][0]) * STRIP)
    row, column = np.divmod(place, STRIP)
    look = arrays["look"]
    return {
        "cell": row * columns + strip * STRIP + column,
        "label": arrays["label"][look], "age": arrays["age"][look],
    }  # fmt: skip
