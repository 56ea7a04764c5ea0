"""Readings for basins with and without event location: Figs. 8, 11 and 13, and what all maps
together say.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.basins.compare import compare
from saltus.plot.cells import share_text
from saltus.replication.claims import Data
from saltus.results.dataset.schema import period_text

from .reading import (
    by_peak,
    certainty,
    count,
    counted,
    listed,
    names,
    parameter,
    place_of,
    three,
    unmatched,
)

#: Peaks within this share of the largest look alike.
LEVEL = 0.02


def attractors(data: Data, of: str) -> dict[str, Any]:
    """The attractors of three maps, and the share of the largest one."""
    maps = three(data, of)
    found = counted(maps)
    return {
        **found,
        "own": [found["on"], found["off"]],
        "share": float(maps["exact"]["attractor_fraction"][by_peak(maps["exact"])[0]]),
        "sure": certainty(maps.values()),
    }


def third(data: Data, of: str) -> dict[str, Any]:
    """The third attractor after the grazing: how many starts of the maps, and around its exact
    basin, lead to it by each method.
    """
    maps, rare = three(data, of), {end: data[f"fig8/rare, {end}"] for end in ("exact", "on", "off")}
    exact, found = maps["exact"], counted(maps)
    starts, around = exact["basin"].size, rare["exact"]["basin"].size
    row: dict[str, Any] = {}
    if found["exact"] == 3:
        peak = float(exact["attractor_peak"][int(np.argmin(exact["attractor_fraction"].values))])
        row = {
            "peak": peak,
            **{end: _hits(ds, peak) + _hits(maps[end], peak) for end, ds in rare.items()},
        }
        row |= {"count": found["exact"]}
    return {
        **found, "cells": starts, "near_third": around, "starts": starts + around,
        "hits": [row] if row else [], "missing": [] if row else [{}],
        "enough": found["exact"] >= 3, "coarse": found["exact"] < 3,
        "sure": certainty(maps.values()),
    }  # fmt: skip


def _hits(ds: xr.Dataset, peak: float) -> int:
    """Starts that lead to an attractor of this peak [m], to a hundredth."""
    same = np.flatnonzero(np.abs(ds["attractor_peak"].values - peak) < 0.01 * peak)
    return int(np.isin(ds["basin"].values, same).sum())


def few(data: Data, of: str) -> dict[str, Any]:
    """The smallest basin."""
    maps = three(data, of)
    exact = maps["exact"]
    rare = exact["basin"].values == int(np.argmin(exact["attractor_fraction"].values))
    share, low, high = (
        100 * float(exact[f"attractor_fraction{end}"].min()) for end in ("", "_low", "_high")
    )
    own = (
        share_text(float(maps["on"]["attractor_fraction"].min()))
        if count(maps["on"]) == 3
        else "none on this grid"
    )
    return {
        "own": own,
        "cells": int(rare.sum()),
        "starts": rare.size,
        "share": share,
        "low": low,
        "high": high,
        "third": count(exact) == 3,
    }


def dominance(data: Data, before: str, after: str) -> dict[str, Any]:
    """Shares of the two largest basins after the grazing, and the largest peak on
    both sides [m].
    """
    maps = [data[f"{of}, exact"] for of in (before, after)]
    small, large = np.sort(maps[1]["attractor_fraction"].values)[-2:].tolist()
    top = [float(ds["attractor_peak"].max()) for ds in maps]
    return {
        "own": listed(data[f"{after}, ode45 located"]), "exact": listed(maps[1]), "large": large,
        "small": small, "ratio": large / small,
        "peak_before": top[0], "peak_after": top[1], "growth": top[1] / top[0],
        "sure": certainty(maps),
    }  # fmt: skip


def coarser(data: Data, settings: Sequence[str]) -> dict[str, Any]:
    """Uncertainty exponents with standard errors, and agreement with the exact map, at each
    setting.
    """
    rows = []
    for setting in settings:
        maps = three(data, f"fig8/{setting}")
        row: dict[str, Any] = {"place": place_of(setting)}
        for end, ds in maps.items():
            row |= {
                end: float(ds.attrs["uncertainty_exponent"]),
                f"{end}_error": float(ds.attrs["uncertainty_exponent_error"]),
            }
        agree = {end: compare(maps["exact"], maps[end]).attrs for end in ("on", "off")}
        apart = row["on"] - row["off"]
        beyond = abs(apart) > 2 * np.hypot(row["on_error"], row["off_error"])
        rows.append(row | {
            "on_agrees": agree["on"]["agreement"], "off_agrees": agree["off"]["agreement"],
            "low": agree["on"]["agreement_low"],
            "high": agree["off"]["agreement_high"], "finer": apart > 0 if beyond else None,
        })  # fmt: skip
    return {"settings": rows, "sure": certainty([data[f"fig8/{settings[0]}, exact"]])}


def margins(data: Data, settings: Mapping[str, str], near: float) -> dict[str, Any]:
    """How far from a graze each attractor passes [m], and how many pass closer than a share of the
    gap.
    """
    found: dict[str, Any] = {"near": near, "settings": []}
    for name, setting in settings.items():
        ds = data[f"fig8/{setting}, exact"]
        values = ds["attractor_margin"].values
        found["settings"].append({"place": place_of(setting), "margins": values.tolist()})
        found[name] = int((values < near * parameter(ds, "upper_gap")).sum())
    return found


def counts(data: Data, figure: str, settings: Sequence[str]) -> dict[str, Any]:
    """The attractors of three maps at each setting; of the last setting, what its smallest basin
    holds.
    """
    maps = {setting: three(data, f"{figure}/{setting}") for setting in settings}
    last, first = maps[settings[-1]]["exact"], maps[settings[0]]["exact"]
    return {
        "settings": [{"place": place_of(setting), **counted(one)} for setting, one in maps.items()],
        "second": count(last) > 1,
        "seen": float(last["attractor_fraction"].min()) * last["basin"].size,
        "starts": last["basin"].size,
        "alike": _same_peaks(first),
        "sure": certainty([ds for one in maps.values() for ds in one.values()]),
    }  # fmt: skip


def _same_peaks(ds: xr.Dataset) -> str:
    """The two attractors whose peaks are nearest each other, in a sentence."""
    order = by_peak(ds)
    gaps = (
        np.abs(np.diff(ds["attractor_peak"].values[order]))
        / ds["attractor_peak"].values[order[:-1]]
    )
    if not gaps.size or gaps.min() > 0.01:
        return ""
    i = int(np.argmin(gaps))
    return (
        f"Peaks of {names(ds)[order[i]]} and {names(ds)[order[i + 1]]} differ by "
        f"{100 * gaps[i]:.1g} %: the paper's colours can't tell them apart."
    )


def highest(data: Data, settings: Sequence[str]) -> dict[str, Any]:
    """Which attractors have nearly the highest peak, and the share of the starts that leads to
    them.
    """
    rows = []
    for setting in settings:
        row: dict[str, Any] = {"place": place_of(setting)}
        for end, prefix in (("exact", ""), ("on", "own_")):
            ds = three(data, f"fig13/{setting}")[end]
            level = ds["attractor_peak"].values > (1 - LEVEL) * ds["attractor_peak"].values.max()
            row |= {
                f"{prefix}are": np.array(names(ds))[level].tolist(),
                f"{prefix}share": float(ds["attractor_fraction"].values[level].sum()),
                f"{prefix}count": int(level.sum()),
            }
        rows.append(row)
    return {
        "settings": rows,
        "sure": certainty([data[f"fig13/{setting}, exact"] for setting in settings]),
    }


def same_on_both_sides(
    data: Data, settings: Sequence[str], ends: Sequence[float]
) -> dict[str, Any]:
    """Exact attractors at one stiffness that the other lacks, and what the single start leads to
    between two stiffnesses [N/m].
    """
    exact, own = (
        [data[f"fig13/{setting}, {end}"] for setting in settings]
        for end in ("exact", "ode45 located")
    )
    both = compare(*exact)
    paired = (both["match_a"].values >= 0) & (both["match_b"].values >= 0)
    alone = [
        name
        for ds, side in zip(exact, "ab", strict=True)
        for i, name in enumerate(names(ds))
        if i not in both[f"match_{side}"].values[paired]
    ]
    single = data["fig7/f, exact"]
    here = (single["contact_stiffness"].values > ends[0]) & (
        single["contact_stiffness"].values < ends[1]
    )
    periods = [period_text(int(n), "unsettled") for n in single["period"].values[here, 0]]
    return {
        "own": "; ".join(map(listed, own)), "exact": "; ".join(map(listed, exact)), "alone": alone,
        "periods": list(dict.fromkeys(periods)),
        "several": len(set(periods)) if periods else None, "sure": certainty(exact),
    }  # fmt: skip


def granular(data: Data, settings: Sequence[str]) -> dict[str, Any]:
    """Uncertainty exponents of the maps, and how many starts lead elsewhere when they are
    recomputed.
    """
    maps = [three(data, f"fig13/{setting}") for setting in settings]
    rows = [
        {
            "place": place_of(setting),
            "alpha": float(one["exact"].attrs["uncertainty_exponent"]),
            "own": float(one["on"].attrs["uncertainty_exponent"]),
        }
        for setting, one in zip(settings, maps, strict=True)
    ]
    exact = [one["exact"] for one in maps]
    return {
        "settings": rows,
        "flips": max(float(ds.attrs["flip_rate"]) for ds in exact),
        "sure": certainty(exact),
    }


def all_maps(
    data: Data, settings: Mapping[str, Sequence[str]], sure: Sequence[str]
) -> dict[str, Any]:
    """Over all maps: attractors that only one way of integrating has, and how many starts lead to
    the same one.
    """
    found: dict[str, list[Any]] = {"maps": [], "invented": [], "lost": [], "absent": []}
    for figure, some in settings.items():
        for setting in some:
            maps, place = (
                three(data, f"{figure}/{setting}"),
                (f"Fig. {figure[3:]}, {place_of(setting)}"),
            )
            for what, (one, other, side) in {
                "invented": ("exact", "off", "b"),
                "lost": ("on", "off", "a"),
                "absent": ("exact", "on", "a"),
            }.items():
                found[what] += [
                    f"{name} in {place}" for name in unmatched(maps[one], maps[other], side)
                ]
            pairs = {"same": ("on", "off"), "on": ("exact", "on"), "off": ("exact", "off")}
            found["maps"].append(
                {
                    "place": place,
                    **{
                        name: float(compare(maps[a], maps[b]).attrs["agreement"])
                        for name, (a, b) in pairs.items()
                    },
                }
            )
    return {
        **{name: "; ".join(found[name]) or "none" for name in ("invented", "lost", "absent")},
        "maps": found["maps"],
        "inventions": len(found["invented"]), "losses": len(found["lost"]),
        "most": max(1.0 - row["same"] for row in found["maps"]),
        "sure": certainty([ds for figure in sure for setting in settings[figure] for ds in three(data, f"{figure}/{setting}").values()]),
    }  # fmt: skip
