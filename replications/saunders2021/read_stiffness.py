"""Readings for section 5: how the responses change with the contact stiffness, and where event
location matters. Fig. 7.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.plot.cells import share_text
from saltus.replication.claims import Data, power
from saltus.results.dataset.schema import period_text

from .reading import count, parameter, three
from .sameness import SAME, SAME_ONE, classes, share_other

#: Soft contact ends, hard contact begins [N/m]: the decades in which the paper sees the responses
#: converge.
SOFT, HARD = 1e4, 1e8
PANELS = {"d": "5 Hz", "e": "17 Hz", "f": "23 Hz"}
#: Places of the paper's two ways in what compare_methods returns.
ON, OFF = 1, 2


# -- frequency responses ---------------------------------------------------------------------------
def _peak(ds: xr.Dataset) -> tuple[float, float]:
    """Frequency [Hz] of the largest steady rms, and this rms [m]."""
    at = int(np.argmax(ds["response_rms"].values))
    return float(ds["response_frequency"].values[at]), float(ds["response_rms"].values[at])


def peaks(data: Data, panels: Mapping[str, Mapping[str, Any]], within: float) -> dict[str, Any]:
    """Resonance peaks of some panels beside where the paper has them [Hz]; a step of the frequency
    is no miss.
    """
    step = float(np.diff(data["fig7/a, exact"]["frequency"].values[:2])[0])
    rows = [
        {**one, **{end: _peak(ds)[0] for end, ds in three(data, f"fig7/{panel}").items()}}
        for panel, one in panels.items()
    ]
    return {
        "panels": [row | {"miss": abs(row["exact"] - row["peak"])} for row in rows],
        "own": [row["on"] for row in rows],
        "exact": [row["exact"] for row in rows],
        "reach": within + step / 2,
        "step": step,
    }


def prominence(data: Data) -> dict[str, Any]:
    """Largest rms over the median of all."""
    ratio = {name: _peak(data[f"fig7/{name}"])[1] / float(np.median(data[f"fig7/{name}"]["response_rms"].values))
             for name in ("a, exact", "c, exact", "c, ode45 located")}  # fmt: skip
    return dict(zip(("soft", "hard", "own"), ratio.values(), strict=True)) | {
        "frequencies": data["fig7/c, exact"].sizes["frequency"]
    }


def dots(data: Data, low: float, high: float) -> dict[str, Any]:
    """Where at 14 kN/m on and off show different dots, between two frequencies [Hz] and outside."""
    ds = data["fig7/a, compared"]
    inside = (ds["frequency"].values >= low) & (ds["frequency"].values <= high)
    apart = curves_differ(ds["rms"].values[ON], ds["rms"].values[OFF])
    return {
        "inside": float(apart[inside].mean()),
        "outside": float(apart[~inside].mean()),
        "on": share_other(ds, ON),
        "off": share_other(ds, OFF),
        "frequencies": inside.size,
        "starts": ds.sizes["start"],
        "same": SAME,
    }


def curves_differ(on: np.ndarray, off: np.ndarray) -> np.ndarray:
    """Frequencies at which some rms of one, float64[frequencies, starts], has no partner in the
    other: what an eye sees, bool[frequencies].
    """
    gap = np.abs(on[:, :, None] - off[:, None, :]) / np.maximum(on[:, :, None], off[:, None, :])
    gap = np.where(np.isfinite(gap), gap, np.inf)
    lonely = [
        (gap.min(axis=axis) > SAME) & np.isfinite(values) for axis, values in ((2, on), (1, off))
    ]
    return np.asarray(lonely[0].any(axis=1) | lonely[1].any(axis=1))


# -- bifurcation diagrams --------------------------------------------------------------------------
def _rows(data: Data, panel: str) -> dict[str, tuple[np.ndarray, ...]]:
    """Stiffness, type, period and rms at each value for the single start, in three ways."""
    return {
        end: (
            ds["contact_stiffness"].values,
            *(ds[name].values[:, 0] for name in ("type", "period", "rms")),
        )
        for end, ds in three(data, f"fig7/{panel}").items()
    }


def onset(stiffness: np.ndarray, kind: np.ndarray) -> float:
    """Stiffness from which on chaos persists: 95 % of all harder values are chaotic. NaN if there
    is none a decade below the hardest.
    """
    chaotic = kind == "chaotic"
    share = np.cumsum(chaotic[::-1])[::-1] / np.arange(len(chaotic), 0, -1)
    good = np.flatnonzero((share >= 0.95) & chaotic)
    return float(stiffness[good[0]]) if good.size and stiffness[good[0]] <= HARD else np.nan


def chaos_beyond(data: Data, panel: str, limit: float, share: float) -> dict[str, Any]:
    """What lies beyond a stiffness [N/m], and whether this share of it is chaotic."""
    texts, onsets, shares, rough = {}, {}, {}, {}
    for end, (stiffness, kind, period, _) in _rows(data, panel).items():
        hard = stiffness > limit
        of = {
            word: float((kind[hard] == word).mean())
            for word in ("chaotic", "quasi_periodic", "unconverged")
        }
        onsets[end], shares[end], rough[end] = (
            onset(stiffness, kind),
            of["chaotic"],
            float(np.isin(kind[hard], tuple(of)).mean()),
        )
        otherwise = [period_text(int(n)) for n in np.unique(period[hard & (period > 0)])[:6]]
        lost = [
            f"; {share_text(of[code])} {word}"
            for code, word in (
                ("quasi_periodic", "quasi-periodic"),
                ("unconverged", "never settle"),
            )
            if of[code]
        ]
        persistent = (
            f"persistent from {power(onsets[end])} N/m"
            if np.isfinite(onsets[end])
            else "never persistent"
        )
        texts[end] = f"{share_text(of['chaotic'])} chaotic beyond {power(limit)} N/m, {persistent}"
        texts[end] += (f"; otherwise {', '.join(otherwise)}" if otherwise else "") + "".join(lost)
    missing, persists = shares["exact"] < share, bool(np.isfinite(onsets["exact"]))
    return {
        **texts, "limit": limit, "chaotic": shares["exact"], "persists": persists, "rough": rough,
        "missing": missing,
        "onset": f"from {power(onsets['exact'])} N/m on" if persists else "it never does",
        "values": len(stiffness),
        "smeared": missing and max(rough["on"], rough["off"]) > rough["exact"] + 0.1,
    }  # fmt: skip


def grazing(
    data: Data, settings: Sequence[str], near: float, at: Sequence[float]
) -> dict[str, Any]:
    """Attractors before and after the grazing, and the contacts a period of the single start at two
    stiffnesses [N/m].
    """
    before, after = (data[f"fig8/{setting}, exact"] for setting in settings)
    diagram = data["fig7/d, exact"]["contacts_per_period"]
    own = [count(data[f"fig8/{setting}, ode45 located"]) for setting in settings]
    least = [float(ds["attractor_margin"].min()) for ds in (before, after)]
    contacts = [float(diagram.sel(contact_stiffness=one, method="nearest")[0]) for one in at]
    return {
        "before": count(before),
        "after": count(after),
        "own_before": own[0],
        "own_after": own[1],
        "least_before": least[0],
        "least_after": least[1],
        "most": max(least),
        "limit": near * parameter(before, "upper_gap"),
        "low": contacts[0],
        "high": contacts[1],
        "near": near,
    }


def doubling(data: Data, panel: str) -> dict[str, Any]:
    """Where T becomes 2T [N/m]: between the last T and the first 2T."""
    found = {}
    for end, (stiffness, _, period, _) in _rows(data, panel).items():
        two = int(np.argmax(period == 2))
        one = np.flatnonzero(period[:two] == 1)
        found[end] = float(np.sqrt(stiffness[one[-1]] * stiffness[two])) if one.size else np.nan
    return found


def jump(data: Data, panel: str, low: float, high: float) -> dict[str, Any]:
    """The largest step up of the rms between two stiffnesses [N/m]: where, and by which factor."""
    found: dict[str, float] = {}
    for end, (stiffness, _, _, rms) in _rows(data, panel).items():
        near = (stiffness > low) & (stiffness < high)
        ratio = rms[near][1:] / rms[near][:-1]
        at = int(np.nanargmax(ratio))
        found |= {end: float(stiffness[near][at + 1]), f"{end}_factor": float(ratio[at])}
    return found


def drop(data: Data, panel: str, rms: float) -> dict[str, Any]:
    """The last stiffness at which the rms is larger than some [m], from where on the final response
    stays, and what this is.
    """
    found: dict[str, Any] = {}
    for end, (stiffness, _, period, sizes) in _rows(data, panel).items():
        final, other = period[-1], np.flatnonzero(period != period[-1])
        high = np.flatnonzero((sizes > rms) & (stiffness > 1e6))
        found |= {
            end: float(stiffness[high[-1]]) if high.size else np.nan,
            f"{end}_final": period_text(int(final), "aperiodic one"),
            f"{end}_sets_in": float(stiffness[other[-1] + 1]) if other.size and final > 0 else np.nan,
        }  # fmt: skip
    return found | {"range": (found["exact"], 1e8)}


def complex_region(data: Data, panel: str, low: float, high: float) -> dict[str, Any]:
    """Chaos, different periods and what never settles between two stiffnesses [N/m]."""
    rows = {}
    for end, (stiffness, kind, period, _) in _rows(data, panel).items():
        inside = (stiffness > low) & (stiffness < high)
        rows[end] = {
            "chaotic": int((kind[inside] == "chaotic").sum()),
            "periods": int(np.unique(period[inside & (period > 0)]).size),
            "lost": float((kind[inside] == "unconverged").mean()),
            "values": int(inside.sum()),
        }
    return {
        **rows["exact"],
        "ways": [{**rows["on"], "way": "located"}, {**rows["off"], "way": "not located"}],
    }


# -- the central question --------------------------------------------------------------------------
def three_parts(data: Data) -> dict[str, Any]:
    """By soft, intermediate and hard contact at each frequency: share of other responses; median
    error of one period.
    """
    rows = []
    for panel, frequency in PANELS.items():
        ds = data[f"fig7/{panel}, compared"]
        stiffness = ds["contact_stiffness"].values
        parts = [
            (stiffness >= low) & (stiffness < high)
            for low, high in ((0.0, SOFT), (SOFT, HARD), (HARD, np.inf))
        ]
        row: dict[str, Any] = {"frequency": frequency}
        for end, way in (("on", ON), ("off", OFF)):
            wrong, error = classes(ds, way) != SAME_ONE, ds["step_error_rms"].values[way]
            row[f"{end}_shares"] = [float(wrong[part].mean()) for part in parts]
            row[f"{end}_errors"] = [float(np.nanmedian(error[part])) for part in parts]
        rows.append(
            row
            | {
                f"{what}_most": _largest_between(row[f"off_{what}"])
                for what in ("shares", "errors")
            }
        )
    return {"frequencies": rows, "values": data["fig7/d, compared"].sizes["contact_stiffness"]}


def _largest_between(values: list[float]) -> bool | None:
    """Whether the middle one of three numbers is the largest; undecided within a tenth of it."""
    rest = max(values[0], values[2])
    return None if abs(values[1] - rest) <= 0.1 * values[1] else values[1] > rest


def location(data: Data, fewer: float) -> dict[str, Any]:
    """Share of other responses, and median error of one period, over all stiffnesses and
    frequencies; at tighter tolerances too.
    """
    on, off = (
        float(np.mean([share_other(data[f"fig7/{panel}, compared"], way) for panel in PANELS]))
        for way in (ON, OFF)
    )
    _, on_error, off_error = _all_errors(data, "compared")
    tight_on, tight_off = _all_errors(data, "tighter")
    return {
        "on": on, "off": off, "limit": fewer * off, "on_error": on_error, "off_error": off_error,
        "tight_on": tight_on, "tight_off": tight_off,
        "by_tolerance": off_error / tight_off, "by_location": off_error / on_error,
        "pairs": 3 * data["fig7/d, compared"].sizes["contact_stiffness"],
    }  # fmt: skip


def _all_errors(data: Data, job: str) -> list[float]:
    """Median error of one period of each method of a job, over all stiffnesses and frequencies."""
    errors = np.concatenate(
        [data[f"fig7/{panel}, {job}"]["step_error_rms"].values for panel in PANELS], axis=1
    )
    return [float(np.nanmedian(one)) for one in errors]


def on_and_off(data: Data, low: float, high: float) -> dict[str, Any]:
    """At 5 Hz, how often on and off give another rms than each other, or only one settles: between
    two stiffnesses [N/m] and elsewhere.
    """
    ds = data["fig7/d, compared"]
    on, off = (ds["rms"].values[way][:, 0] for way in (ON, OFF))
    with np.errstate(invalid="ignore"):
        alike = np.abs(on - off) <= SAME * np.maximum(on, off)
    chaotic = (ds["type"].values[ON][:, 0] == "chaotic") & (
        ds["type"].values[OFF][:, 0] == "chaotic"
    )
    apart = ~(alike | chaotic | (np.isnan(on) & np.isnan(off)))
    stiffness = ds["contact_stiffness"].values
    near = (stiffness > low) & (stiffness < high)
    far = stiffness[apart & ~near]
    most = (
        [{"low": float(np.quantile(far, 0.1)), "high": float(np.quantile(far, 0.9))}]
        if far.size
        else []
    )
    return {
        "near": float(apart[near].mean()),
        "elsewhere": float(apart[~near].mean()),
        "most": most,
        "values": stiffness.size,
        "same": SAME,
    }
