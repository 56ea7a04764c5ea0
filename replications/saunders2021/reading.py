"""How claims read Datasets: attractors in words, counts, shares, and places along a frequency or a
stiffness.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.basins.compare import compare
from saltus.plot.cells import share_text
from saltus.replication.claims import Data
from saltus.results.dataset.schema import kind_text, period_text

#: What claims call the three ways of integrating: the ends of the names of their jobs.
ENDS = {"exact": "exact", "on": "ode45 located", "off": "ode45 not located"}


def three(data: Data, of: str) -> dict[str, xr.Dataset]:
    """The Datasets of one setting, exact and by the paper's two ways, as far as they
    are asked for.
    """
    return {end: data[f"{of}, {job}"] for end, job in ENDS.items() if f"{of}, {job}" in data}


def place_of(setting: str) -> str:
    """The setting of a map in words: ``25.5 kN/m``."""
    return setting.replace(" per ", "/")


def names(ds: xr.Dataset) -> list[str]:
    """The attractors in words, by their ids: ``T``, ``3T``, ``chaotic``."""
    kinds, periods = ds["attractor_type"].values.tolist(), ds["attractor_period"].values.tolist()
    return [kind_text(str(kind), int(n)) for kind, n in zip(kinds, periods, strict=True)]


def listed(ds: xr.Dataset, shares: Iterable[float] | None = None) -> str:
    """The attractors with their shares of the starts: ``T 40 %, 3T 3.1 %``."""
    shares = ds["attractor_fraction"].values if shares is None else shares
    return ", ".join(
        f"{name} {share_text(float(share))}" for name, share in zip(names(ds), shares, strict=True)
    )


def count(ds: xr.Dataset) -> int:
    """How many attractors a Dataset has."""
    return int(ds.sizes["attractor"])


def counted(maps: Mapping[str, xr.Dataset]) -> dict[str, Any]:
    """Attractors of three maps: how many (``exact``, ``on``, ``off``), and listed (``exact_are``,
    ...).
    """
    return {end: count(ds) for end, ds in maps.items()} | {
        f"{end}_are": listed(ds) for end, ds in maps.items()
    }


def by_peak(ds: xr.Dataset) -> list[int]:
    """Ids of the attractors, the largest first."""
    order: list[int] = np.argsort(-ds["attractor_peak"].values, kind="stable").tolist()
    return order


def multipliers(ds: xr.Dataset) -> np.ndarray:
    """Magnitudes of the multipliers, float64[attractor, multiplier]."""
    magnitudes: np.ndarray = np.hypot(
        ds["attractor_multiplier_real"].values, ds["attractor_multiplier_imag"].values
    )
    return magnitudes


def certainty(maps: Iterable[xr.Dataset]) -> str:
    """What counts of attractors in maps are worth."""
    maps = list(maps)
    starts = [one["basin"].size for one in maps]
    seen = max(float(one.attrs["smallest_basin_seen"]) for one in maps)
    flips = [
        float(one.attrs["flip_rate"])
        for one in maps
        if np.isfinite(one.attrs.get("flip_rate", np.nan))
    ]
    told = (
        f"{min(starts)} starts a map; a basin of less than {100 * seen:.2g} % of them may have "
        f"been missed"
    )
    return told + (
        f"; {share_text(max(flips))} of the starts at most lead elsewhere when "
        f"recomputed more exactly"
        if flips
        else ""
    )


def parameter(ds: xr.Dataset, name: str) -> float:
    """The value of a parameter of a Dataset [SI]."""
    return float(json.loads(ds.attrs["parameters"])[name])


def unmatched(a: xr.Dataset, b: xr.Dataset, side: str) -> list[str]:
    """Attractors of one of two maps, ``a`` or ``b``, that the other doesn't have."""
    both = compare(a, b)
    rows = (both["match_a"].values >= 0) != (both["match_b"].values >= 0)
    mine = rows & (both[f"match_{side}"].values >= 0)
    return [period_text(int(n), "an aperiodic one") for n in both["match_period"].values[mine]]


def between(ds: xr.Dataset, low: float, high: float) -> np.ndarray:
    """Which responses lie between two frequencies [Hz], bool[response]."""
    at = ds["response_frequency"].values
    return np.asarray((at >= low) & (at <= high))


def either(texts: Iterable[str], otherwise: str) -> str:
    """Texts joined by commas, or another one if there are none."""
    return ", ".join(texts) or otherwise
