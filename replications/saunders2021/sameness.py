"""When two ways of integrating gave the same steady response, by one rule for both of the paper's
ways.

The rms decides, as in the paper's own figures: ode45 smears an orbit, so that its period may be
misread, while its rms is hardly changed. Two chaotic motions count as the same.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.intervals import wilson

#: Largest relative difference of the rms of responses that count as the same.
SAME = 0.05
#: Codes: the same response, another one, ode45's never settles (or the exact one doesn't).
SAME_ONE, OTHER, UNSETTLED = 1, 0, -1
#: Half-width of the window over the stiffness in which shares are taken [decades].
WINDOW = 0.2


def classes(ds: xr.Dataset, method: int) -> np.ndarray:
    """For a Dataset of ``compare_methods``: what a method gave at each value and start beside the
    reference, int64[values, starts].
    """
    rms, exact = ds["rms"].values[method], ds["rms"].values[0]
    with np.errstate(invalid="ignore"):
        alike = np.abs(rms - exact) <= SAME * exact
    alike |= (ds["type"].values[method] == "chaotic") & (ds["type"].values[0] == "chaotic")
    return np.where(
        np.isfinite(rms) & np.isfinite(exact), np.where(alike, SAME_ONE, OTHER), UNSETTLED
    )


def share_other(ds: xr.Dataset, method: int) -> float:
    """Share of all values and starts at which a method doesn't give the reference's response."""
    return float((classes(ds, method) != SAME_ONE).mean())


def running_share(
    stiffness: np.ndarray, wrong: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Share of ``wrong`` bool[n] in a window along log10(stiffness): the stiffness, the share, the
    ends of its 95 % interval.
    """
    at = np.log10(stiffness)
    places = np.linspace(at[0], at[-1], 241)
    counts = np.array(
        [
            (int(wrong[near].sum()), int(near.sum()))
            for near in (np.abs(at - place) <= WINDOW for place in places)
        ]
    )
    ends = np.array([wilson(k, n) for k, n in counts.tolist()], float)
    return 10.0**places, counts[:, 0] / np.maximum(counts[:, 1], 1), ends[:, 0], ends[:, 1]


def running_median(stiffness: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Median of finite values float64[n] in the same window."""
    at = np.log10(stiffness)
    places = np.linspace(at[0], at[-1], 241)
    medians = []
    for place in places:
        inside = values[(np.abs(at - place) <= WINDOW) & np.isfinite(values)]
        medians.append(float(np.median(inside)) if inside.size else np.nan)
    return 10.0**places, np.array(medians)
