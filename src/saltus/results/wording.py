"""Words that every text on a result shares: the lines of `describe`, the tables of studies, the
headers of files.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import xarray as xr

from saltus.results.dataset.schema import kind_text


def unit_of(values: xr.DataArray) -> str:
    """The unit of a variable, ``""`` where it isn't known."""
    return str(values.attrs.get("units", ""))


def kind_texts(ds: xr.Dataset, prefix: str) -> list[str]:
    """A word for each motion of a table, such as ``3T``: those of ``attractor_type`` and
    ``attractor_period`` for the prefix ``attractor_``.
    """
    kinds, periods = (ds[f"{prefix}{what}"].values.tolist() for what in ("type", "period"))
    return [kind_text(str(kind), int(n)) for kind, n in zip(kinds, periods, strict=True)]


def tally(words: np.ndarray | Sequence[str]) -> dict[str, int]:
    """How often each word stands there, in the order of the alphabet."""
    found, counts = np.unique(np.atleast_1d(words).astype(str), return_counts=True)
    return dict(zip(found.tolist(), counts.tolist(), strict=True))


def ended_early(ds: xr.Dataset) -> dict[str, int]:
    """How many trajectories ended early, by how they did."""
    return {word: count for word, count in tally(ds["status"].values).items() if word != "ok"}
