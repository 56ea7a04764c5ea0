"""Words that all texts on a result share: the lines of `describe`, the tables of studies, the
headers of files.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from saltus.results.dataset.schema import kind_text
from saltus.units import titled

#: Most things that an account lists, a line each; the others are counted.
LINES = 12


def unit_of(values: xr.DataArray) -> str:
    """The unit of a variable, ``""`` where it isn't known."""
    return str(values.attrs.get("units", ""))


def sized(value: xr.DataArray, form: str = ".4g") -> str:
    """A number and its unit: ``0.4 m``."""
    return f"{float(value):{form}} {unit_of(value)}".rstrip()


def header(ds: xr.Dataset, name: str) -> str:
    """Heading of a variable as a column: ``x [m]``."""
    return titled(name, unit_of(ds[name]))


def plain(name: str) -> str:
    """A name without underscores, as in a sentence: ``contact stiffness``."""
    return name.replace("_", " ")


def kind_texts(ds: xr.Dataset, prefix: str) -> list[str]:
    """A word for each motion of a table, such as ``3T``: those of ``attractor_type`` and
    ``attractor_period`` for the prefix ``attractor_``.
    """
    kinds, periods = (ds[f"{prefix}{what}"].values.tolist() for what in ("type", "period"))
    return [kind_text(str(kind), int(n)) for kind, n in zip(kinds, periods, strict=True)]


def tally(words: np.ndarray | Sequence[str]) -> dict[str, int]:
    """Count each word, in alphabetical order."""
    found, counts = np.unique(np.atleast_1d(words).astype(str), return_counts=True)
    return dict(zip(found.tolist(), counts.tolist(), strict=True))


def ended_early(ds: xr.Dataset) -> dict[str, int]:
    """Count the trajectories that ended early, by their status."""
    return {word: count for word, count in tally(ds["status"].values).items() if word != "ok"}


def failed(ds: xr.Dataset) -> list[str]:
    """A note on each way in which trajectories ended early."""
    return [f"{count} of the motions: {word}." for word, count in ended_early(ds).items()]


def meanings(variable: xr.DataArray) -> Mapping[int, str]:
    """Code to word, from the attributes of the variable."""
    words = variable.attrs["flag_meanings"].split()
    return dict(zip(np.asarray(variable.attrs["flag_values"]).tolist(), words, strict=True))


def more(count: int) -> list[str]:
    """Line on the number of things that have no line themselves."""
    return [f"  and {count - LINES} more"] if count > LINES else []


def span(ds: xr.Dataset, names: tuple[str, ...], what: str) -> str:
    """Line on the number of values along each coordinate, and their range."""
    parts = []
    for name in names:
        values, unit = ds[name].values, unit_of(ds[name])
        parts.append(
            f"{name} from {values.min():g} to {values.max():g} {unit}".rstrip()
            if values.size
            else f"{name} empty"
        )
    return (
        f"extent   {' x '.join(str(ds.sizes[name]) for name in names)} {what}, {', '.join(parts)}"
    )
