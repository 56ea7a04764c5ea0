"""Readings for section 3 and the frequency responses of section 4: Figs. 2 and 3, Table 2."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.replication import folder_of
from saltus.replication.claims import Data
from saltus.results.dataset.schema import period_text
from saltus.results.files.measured import read_measured
from saltus.study.answers.compare import residuals

from .printed import contacts
from .reading import between, either

#: Rounding of frequencies of a grid [Hz].
TICK = 1e-6


def printed_times(data: Data) -> dict[str, Any]:
    """Our ode45 against the printed digits."""
    own, exact = (data[f"fig2/{end}"]["contact_time"].values for end in ("ode45", "exact"))
    rows = [
        {"letter": letter, "miss": abs(own[number] - time), "off": abs(exact[number] - time)}
        for letter, number, time in contacts()
    ]
    return {
        "contacts": rows,
        "worst": max(row["miss"] for row in rows),
        "off": max(row["off"] for row in rows),
    }


def located(data: Data) -> dict[str, Any]:
    """How far from the boundary located contacts lie [m]."""
    rest = residuals(data["fig2/ode45"])
    return {"count": rest.size, "residual": rest.max()}


def contact_times(data: Data, units: float) -> dict[str, Any]:
    """Errors of the located times [s], and what their residuals suggest; ``units`` of machine
    precision are allowed a second.
    """
    run, exact = data["fig2/ode45"], data["fig2/exact"]
    shared = min(run.sizes["contact"], exact.sizes["contact"])
    error = np.abs(run["contact_time"].values[:shared] - exact["contact_time"].values[:shared])
    limit, suggested = (
        units * np.finfo(float).eps,
        residuals(run) / np.abs(run["contact_velocity"].values),
    )
    return {
        "first": error[0], "worst": error.max(), "limit": limit,
        "seconds": float(run["contact_time"].max()), "median": np.median(error),
        "right": bool((error <= limit * np.maximum(run["contact_time"].values[:shared],
            1e-3)).all()), "suggested": np.median(suggested),
        "far": 1000.0 * np.median(suggested), "claimed": float(exact["contact_time_error"].max()),
    }  # fmt: skip


# -- Fig. 3 ----------------------------------------------------------------------------------------
def _branch(ds: xr.Dataset, multiple: int, low: float, high: float) -> np.ndarray:
    """Frequencies between two at which a response has a multiple of a period, ascending."""
    period = ds["response_period"].values
    return np.unique(
        ds["response_frequency"].values[
            between(ds, low, high) & (period > 0) & (period % multiple == 0)
        ]
    )


def _isolated(ds: xr.Dataset, frequencies: np.ndarray) -> tuple[bool, float]:
    """Whether, wherever a 3T response exists, a T response does too whose rms is at least a fifth
    smaller; and the smallest ratio.
    """
    ratios = []
    for f in frequencies:
        here = np.abs(ds["response_frequency"].values - f) < 1e-9
        period, rms = ds["response_period"].values[here], ds["response_rms"].values[here]
        if not (period == 1).any():
            return False, np.nan
        ratios.append(rms[(period > 0) & (period % 3 == 0)].min() / rms[period == 1].min())
    return bool(ratios) and min(ratios) > 1.2, float(min(ratios, default=np.nan))


def isolated_branch(data: Data, cases: Sequence[str]) -> dict[str, Any]:
    """The isolated branch of the symmetric cases, by rising force."""
    rows = []
    for case in cases:
        ds = data[f"fig3/{case}, exact"]
        peak = float(ds["response_frequency"].values[np.argmax(ds["response_rms"].values)])
        branch = _branch(ds, 3, peak + 0.01, 30.0)
        apart, ratio = _isolated(ds, branch)
        own = [f"{f:g} Hz" for f in _branch(data[f"fig3/{case}, ode45"], 3, peak + 0.01, 30.0)]
        rows.append({
            "case": case, "peak": peak, "band": _band(branch), "frequencies_3T": branch.size,
            "apart": apart, "ratio": ratio,
            "width": float(np.ptp(branch)) if branch.size else 0.0,
            "own": either(own, "none of the "
                "frequencies asked"),
        })  # fmt: skip
    return {
        "cases": rows,
        "narrow": rows[0]["width"],
        "wide": rows[1]["width"],
        "frequencies": ds.sizes["frequency"],
        "starts": ds.sizes["start"],
    }


def _band(values: np.ndarray) -> str:
    """First and last of some frequencies as text."""
    if not values.size:
        return "nowhere"
    return f"{values.min():g} to {values.max():g} Hz" if np.ptp(values) > 0 else f"{values[0]:g} Hz"


def measured_points(data: Data, case: str) -> dict[str, Any]:
    """Measured points near 18 Hz on the isolated branch, if somebody has read them
    off the figure.
    """
    ds = data[f"fig3/{case}, exact"]
    here = (
        between(ds, 17.5, 18.5)
        & (ds["response_period"].values % 3 == 0)
        & (ds["response_period"].values > 0)
    )
    rms = ds["response_rms"].values[here]
    branch = (
        f"3T with rms {1e3 * rms.min():.3f} to {1e3 * rms.max():.3f} mm at 17.5 to 18.5 Hz"
        if rms.size
        else "No 3T response at 18 Hz"
    )
    path = folder_of("saunders2021") / f"measured_{case}.csv"
    if not path.exists():
        return {"branch": branch, "given": False, "points": None}
    points = read_measured(path, "frequency", "Hz", "m")
    size = points["amplitude"].values[np.abs(points["frequency"].values - 18.0) <= 0.5]
    on_branch = int(((size > 0.9 * rms.min()) & (size < 1.1 * rms.max())).sum()) if rms.size else 0
    return {"branch": branch, "given": True, "near": size.size, "points": on_branch}


def responses_between(
    data: Data, cases: Sequence[str], low: float, high: float, least: int
) -> dict[str, Any]:
    """In each case the periods of the responses between two frequencies [Hz], from ``least``
    forcing periods on.
    """
    rows = []
    for case in cases:
        row: dict[str, Any] = {"case": case}
        for end, prefix in (("exact", ""), ("ode45", "own_")):
            ds = data[f"fig3/{case}, {end}"]
            here = between(ds, low, high)
            periods = np.unique(ds["response_period"].values[here])
            row[f"{prefix}chaotic"] = int((ds["response_type"].values[here] == "chaotic").sum())
            row[f"{prefix}periods"] = _periods(periods[periods >= least])
            row |= {
                f"{prefix}long": int((periods >= 2).sum()),
                f"{prefix}longer": int((periods >= 3).sum()),
            }
        rows.append(row)
    return {"cases": rows, "grid": _grid(data)}


def thirds(data: Data, cases: Sequence[str]) -> dict[str, Any]:
    """Cases with a third-order subharmonic near 15 Hz, and with what period doublings
    make of it.
    """

    def found(end: str, *periods: int) -> list[str]:
        sets = {case: data[f"fig3/{case}, {end}"] for case in cases}
        near = {case: between(ds, 14.0 - TICK, 16.0 + TICK) for case, ds in sets.items()}
        return [
            case
            for case, ds in sets.items()
            if (near[case] & np.isin(ds["response_period"].values, periods)).any()
        ]

    there, doubled = found("exact", 3), found("exact", 6, 12, 24)
    texts = {"there": there, "doubled": doubled, "own": found("ode45", 3)}
    return {
        **{name: either(one, "no case") for name, one in texts.items()},
        "thirds": len(there), "either": len({*there, *doubled}), "grid": _grid(data),
    }  # fmt: skip


def _periods(values: np.ndarray) -> str:
    """Periods in words, the first eight: ``T, 2T, 3T``."""
    some = [period_text(int(n)) for n in values if n > 0]
    return ", ".join(some[:8]) + (f" and {len(some) - 8} more" if len(some) > 8 else "") or "none"


def _grid(data: Data) -> str:
    ds = data["fig3/b4, exact"]
    return (
        f"{ds.sizes['frequency']} frequencies and {ds.sizes['start']} starts a case, exact; "
        f"{data['fig3/b4, ode45'].sizes['frequency']} by ode45. "
        "The paper doesn't give its starts, so a response with a small basin may be missed, by "
        "both."
    )
