"""What all pictures of this paper share: a colour for each way of integrating, which is the same
everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr

from saltus.analysis.closed.motions import phase_distances
from saltus.plot.style import OKABE_ITO


@dataclass(frozen=True)
class Look:
    """How one way of integrating is drawn: name in legends, end of the names of its jobs, colour,
    width and dashes of its lines.
    """

    label: str
    end: str
    color: str
    width: float
    dashes: tuple[float, ...] | str


#: As in the paper, blue is with event location and red without; exact results lie under both,
#: wider.
EXACT = Look("exact", "exact", "#9A9A9A", 3.2, "-")
ON = Look("ode45, located", "ode45 located", OKABE_ITO["blue"], 1.3, "-")
OFF = Look("ode45, not located", "ode45 not located", OKABE_ITO["vermillion"], 1.1, (0, (3.0, 2.0)))  # type: ignore[arg-type]
LOOKS = (EXACT, ON, OFF)


def periods_of(run: xr.Dataset, trajectory: int) -> tuple[xr.Dataset, np.ndarray]:
    """One trajectory of a batch, and its samples in forcing periods since the first
    that was kept.
    """
    one = run.isel(trajectory=trajectory) if "trajectory" in run.dims else run
    return one, np.asarray(one["period"].values, float)


def strobe(run: xr.Dataset, trajectory: int) -> np.ndarray:
    """States at the whole periods of one trajectory, float64[n, 2]."""
    one, period = periods_of(run, trajectory)
    whole = np.abs(period - np.round(period)) < 1e-6
    return np.stack([one[name].values[whole] for name in ("x", "v")], axis=-1)


def lag(reference: np.ndarray, points: np.ndarray, n: int) -> int:
    """By how many periods ``points`` must be rolled back to lie best on an nT orbit
    ``reference``.
    """
    scale = np.maximum(np.ptp(reference, axis=0), 1e-3 * np.abs(reference).max(axis=0))
    return int(phase_distances(reference[:n], points[:n], scale).argmin())
