"""Readings for several responses at one setting: Figs. 4, 5 and 6."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.motion.settled import settled
from saltus.plot.cells import share_text
from saltus.replication.claims import Data
from saltus.results.dataset.schema import period_text

from .reading import by_peak, certainty, count, counted, listed, multipliers, names, three

#: Band around the gap in which a start is "near or within" it [m].
NEAR = 0.2e-3


def three_responses(data: Data) -> dict[str, Any]:
    """Periods and contacts of the motions of Fig. 4."""
    exact, own = (settled(data[f"fig4/{end}"]) for end in ("exact", "ode45"))
    columns = [
        one[name].values
        for one in (exact, own)
        for name in ("response_period", "contacts_per_response")
    ]
    keys = ("name", "period", "contacts", "own_period", "own_contacts")
    rows = [
        dict(zip(keys, row, strict=True))
        for row in zip(("16 Hz", "17 Hz small", "17 Hz large"), *columns, strict=True)
    ]
    return {
        "motions": rows,
        "small": rows[1],
        "n": int(rows[1]["period"]),
        "contacts": rows[1]["contacts"],
        "large": int(rows[2]["period"]),
        "mismatch": float(exact["mismatch"].max()),
    }


def step(data: Data) -> dict[str, Any]:
    """Where the step from 16 Hz to 17 Hz leads."""
    ds = data["fig4/step"]
    shares = [float((ds["basin"].values == i).mean()) for i in range(count(ds))]
    reached = {name for name, share in zip(names(ds), shares, strict=True) if share > 0}
    return {
        "states": ds.sizes["trajectory"], "shares": listed(ds, shares), "reached": sorted(reached),
        "outcomes": len(reached),
        "quiet": int(((ds["attractor_period"] == 1) & (ds["attractor_contacts"] == 0)).sum()),
        "more": len(reached) > 2,
    }  # fmt: skip


# -- Fig. 5 ----------------------------------------------------------------------------------------
def four_starts(data: Data, printed: Mapping[str, int]) -> dict[str, Any]:
    """Periods from the four starts, and from those within a nanometre: by start [mm] the period
    that the paper reads off.
    """
    exact, own = (
        settled(data[f"fig5/{end}"])["response_period"].values for end in ("exact", "ode45")
    )
    bunches = settled(data["fig5/beside"])["response_period"].values.reshape(len(printed), -1)
    rows = [
        {"x": x, "printed": n, "period": int(one), "own": int(ours), "beside": _tally(bunch),
            "decides": len(set(bunch.tolist())) == 1 or n not in bunch,
         "one": len(set(bunch.tolist())) == 1}
        for (x, n), one, ours, bunch in zip(printed.items(), exact, own, bunches, strict=True)
    ]  # fmt: skip
    return {
        "starts": rows,
        "unsure": [row for row in rows if not row["one"]],
        "near": bunches.shape[1],
    }


def _tally(periods: np.ndarray) -> str:
    values, counts = np.unique(periods, return_counts=True)
    return ", ".join(
        f"{period_text(int(n), 'unsettled')} {share_text(c / len(periods))}"
        for n, c in zip(values, counts, strict=True)
    )


def twelve(data: Data, start: int) -> dict[str, Any]:
    """The attractor that a start of Fig. 5 leads to, and the orbit of half its period that it
    doubled from, if there is one.
    """
    found, halved = data["fig5/attractors"], data["fig5/halved"]
    orbit = found.isel(attractor=int(found["basin"].values[start]))
    n, own = (
        int(orbit["attractor_period"]),
        settled(data["fig5/ode45"])["response_period"].values[start],
    )
    half = np.flatnonzero(2 * halved["attractor_period"].values == n)
    inner = halved.isel(attractor=int(half[0])) if half.size else None
    doubled: dict[str, Any] = (
        {}
        if inner is None
        else {"half": int(inner["attractor_period"]), "multiplier": _largest(inner)}
    )
    if doubled:
        doubled["size"] = abs(doubled["multiplier"])
        doubled["word"] = "unstable" if doubled["size"] > 1 else "stable"
    return {
        "n": n, "own": own, "multipliers": orbit["attractor_multiplier_real"].values.tolist(),
        "pairs": n == 24, "inner": [doubled] if doubled else [],
        "twelve": n == 12 and abs(_largest(orbit)) < 1,
        "inner_twelve": [doubled] if doubled.get("half") == 12 else [],
    }  # fmt: skip


def _largest(one: xr.Dataset) -> float:
    """The multiplier of largest magnitude, with its sign."""
    return float(one["attractor_multiplier_real"].values[np.argmax(multipliers(one))])


def regular(data: Data) -> dict[str, Any]:
    """How many of the four responses repeat, and how stable they are."""
    exact, own = (settled(data[f"fig5/{end}"]) for end in ("exact", "ode45"))
    return {
        "repeat": int((exact["response_period"] > 0).sum()),
        "own": int((own["response_period"] > 0).sum()),
        "multiplier": float(multipliers(data["fig5/attractors"]).max()),
        "mismatch": float(exact["mismatch"].max()),
    }  # fmt: skip


def responses_at(data: Data, of: str) -> dict[str, Any]:
    """The attractors of one map."""
    maps = three(data, of)
    return {**counted(maps), "names": names(maps["exact"]), "sure": certainty(maps.values())}


# -- Fig. 6 ----------------------------------------------------------------------------------------
def lower_solutions(data: Data, counted: Mapping[str, int]) -> dict[str, Any]:
    """By frequency, what maps have beside the attractor of largest peak, and how the paper counts
    it.
    """
    rows = []
    for f, printed in counted.items():
        maps = three(data, f"fig6/{f}")
        row: dict[str, Any] = {"f": f, "printed": printed}
        for end, prefix in (("exact", ""), ("on", "own_")):
            ds = maps[end]
            row |= {
                f"{prefix}count": count(ds) - 1,
                f"{prefix}are": listed(ds),
                f"{prefix}alpha": float(ds.attrs["uncertainty_exponent"]),
            }
        low = np.sort(
            np.delete(maps["exact"]["attractor_fraction"].values, by_peak(maps["exact"])[0])
        )[::-1]
        row |= {
            "shares": (low / low.sum()).tolist(),
            "error": float(maps["exact"].attrs["uncertainty_exponent_error"]),
        }
        rows.append({**row, "largest": row["shares"][0]})
    early, late = rows[:2], rows[2:]
    return {
        "maps": rows, "early": early, "early_shares": [row["largest"] for row in early],
        "late_shares": [row["largest"] for row in late],
        "early_most": max(row["largest"] for row in early),
        "late_least": min(row["largest"] for row in late),
        "sure": certainty(data[f"fig6/{f}, exact"] for f in counted),
    }  # fmt: skip


def which_frequency(data: Data, printed: int) -> dict[str, Any]:
    """Whether the map at 16 Hz or that at 16.5 Hz has the printed number of lower solutions: one of
    the two must, and one not.
    """
    low, high = data["fig6/16 Hz, exact"], data["fig6/16.5 Hz, exact"]
    here, there = count(low) - 1, count(high) - 1
    return {
        "here": here,
        "there": there,
        "decides": (here == printed) != (there == printed),
        "is": here == printed,
        "low": listed(low),
        "high": listed(high),
        "sure": certainty([low, high]),
    }


def gap(data: Data, frequencies: Sequence[str]) -> dict[str, Any]:
    """Least velocities at which starts near the gap lead to the largest solution [m/s], and the
    largest in Fig. 5.
    """
    slow = float(
        np.nanmax([np.abs(data["fig5/exact"]["v"].isel(trajectory=i)).max() for i in range(4)])
    )
    rows = []
    for f in frequencies:
        row: dict[str, Any] = {"f": f}
        for end, prefix in (("exact", ""), ("on", "own_")):
            ds = three(data, f"fig6/{f}")[end]
            inside = (ds["x"].values >= -NEAR) & (ds["x"].values <= 0.4e-3 + NEAR)
            v = np.abs(ds["v"].values)[np.nonzero(ds["basin"].values[inside] == by_peak(ds)[0])[1]]
            row[f"{prefix}least"] = float(v.min()) if v.size else None
            row[f"{prefix}told"] = f"{v.min():.2f} m/s" if v.size else "at no velocity of the map"
        rows.append(
            row
            | {
                "found": f"least {row['told']}"
                if row["least"] is not None
                else "no start of the map leads there"
            }
        )
    return {
        "maps": rows,
        "slow": slow,
        "limit": 2 * slow,
        "cells": np.diff(data["fig6/15 Hz, exact"]["v"].values[:2])[0],
    }
