"""How judges read Datasets: attractors in words, counts, shares, and the places along a frequency or a stiffness that claims speak of."""

from __future__ import annotations

import json
from collections.abc import Iterable

import numpy as np
import xarray as xr

from saltus.plot.maps import share_text
from saltus.replication.verdict import Check
from saltus.results.dataset.schema import kind_text

#: Ends of the names of the jobs of one setting: exact, and the paper's two ways.
EXACT, ON, OFF = "exact", "ode45 located", "ode45 not located"
SECTION_4 = "Section 4: ode45 with RelTol = AbsTol = 1e-12, located"
SECTION_5 = "Section 5: ode45 with RelTol = 1e-4, AbsTol = 1e-7"


def check(text: str, passed: object) -> Check:
    """A check from anything that is true, false or None."""
    return Check(text, None if passed is None else bool(passed))


def number(value: float) -> str:
    """A stiffness as the paper writes it: ``2.55e4``."""
    if not np.isfinite(value):
        return "nowhere"
    mantissa, exponent = f"{value:.2e}".split("e")
    return f"{float(mantissa):g}e{int(exponent)}"


def place_of(setting: str) -> str:
    """The setting of a map in words: ``25.5 kN/m``."""
    return setting.replace(" per ", "/")


def below(what: str, value: float, limit: float) -> Check:
    """The check that a number is below a limit; undecided where the number isn't known."""
    if not np.isfinite(value):
        return Check(f"{what} below {limit:g} (not measurable on this grid)", None)
    return Check(f"{what} below {limit:g} ({value:.2f})", value < limit)


def exponent_text(value: float) -> str:
    """An uncertainty exponent, or that there is none."""
    return f"{value:.2f}" if np.isfinite(value) else "not measurable"


def names(ds: xr.Dataset) -> list[str]:
    """The attractors in words, by their ids: ``T``, ``3T``, ``chaotic``."""
    kinds, periods = ds["attractor_type"].values.tolist(), ds["attractor_period"].values.tolist()
    return [kind_text(str(kind), int(n)) for kind, n in zip(kinds, periods, strict=True)]


def listed(ds: xr.Dataset) -> str:
    """The attractors with their shares of the starts: ``T 40 %, 3T 3.1 %``."""
    if "attractor_fraction" not in ds:
        return ", ".join(names(ds)) or "none"
    return ", ".join(f"{name} {share_text(float(share))}" for name, share in zip(names(ds), ds["attractor_fraction"].values, strict=True))


def count(ds: xr.Dataset) -> int:
    """How many attractors a Dataset has."""
    return int(ds.sizes["attractor"])


def by_peak(ds: xr.Dataset) -> list[int]:
    """Ids of the attractors, the largest first."""
    return np.argsort(-ds["attractor_peak"].values, kind="stable").tolist()


def micrometres(value: float) -> str:
    """A length as text."""
    return f"{1e6 * value:.3g} µm"


def certainty(maps: Iterable[xr.Dataset]) -> str:
    """What counts of attractors in maps are worth."""
    maps = list(maps)
    starts = [one["basin"].size for one in maps]
    seen = max(float(one.attrs["smallest_basin_seen"]) for one in maps)
    flips = [float(one.attrs["flip_rate"]) for one in maps if np.isfinite(one.attrs.get("flip_rate", np.nan))]
    told = f"{min(starts)} starts a map; a basin of less than {100 * seen:.2g} % of them may have been missed"
    return told + (f"; {share_text(max(flips))} of the starts at most lead elsewhere when recomputed more exactly" if flips else "")


def parameter(ds: xr.Dataset, name: str) -> float:
    """The value of a parameter of a Dataset [SI]."""
    return float(json.loads(ds.attrs["parameters"])[name])


def where(ds: xr.Dataset, axis: str, low: float, high: float) -> np.ndarray:
    """Which responses lie between two values of the parameter, bool[response]."""
    at = ds[f"response_{axis}"].values
    return (at >= low) & (at <= high)


def band(values: np.ndarray) -> str:
    """First and last of some frequencies as text."""
    if not values.size:
        return "nowhere"
    return f"{values.min():g} to {values.max():g} Hz" if np.ptp(values) > 0 else f"{values[0]:g} Hz"
