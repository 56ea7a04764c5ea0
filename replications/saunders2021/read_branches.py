"""Readings of branches: whether a branch is isolated, and where a response ends or begins.
Figs. 3, 7, 8 and 12.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from saltus.replication.claims import Data


def _events(ds: xr.Dataset, branch: int, kind: str = "") -> tuple[np.ndarray, np.ndarray]:
    """Values of the parameter at the events of a branch and their kinds, by their values."""
    mine = ds["event_branch"].values == branch
    kinds = ds["event_kind"].values.astype(str)
    if kind:
        mine &= kinds == kind
    values = ds[f"event_{ds.attrs['parameter']}"].values[mine]
    order = np.argsort(values)
    return values[order], kinds[mine][order]


def _values(ds: xr.Dataset, branch: int) -> np.ndarray:
    """Values of the parameter at the points of a branch."""
    mine = ds["point_branch"].values == branch
    return np.asarray(ds[f"point_{ds.attrs['parameter']}"].values[mine])


def _stable(ds: xr.Dataset, branch: int) -> np.ndarray:
    return np.asarray(ds["point_stable"].values[ds["point_branch"].values == branch] == 1)


def isola(data: Data, of: str, period: int) -> dict[str, Any]:
    """The closed branches of orbits of some periods, and where the first one ends."""
    ds = data[of]
    mine = np.flatnonzero(ds["branch_periods"].values == period)
    closed = mine[ds["branch_closed"].values[mine] == 1]
    found = {"branches": len(mine), "closed": len(closed)}
    if not len(closed):
        return found | {"low": np.nan, "high": np.nan}
    folds, _ = _events(ds, int(closed[0]), "fold")
    return found | {"low": float(folds.min()), "high": float(folds.max())}


def jump(data: Data, of: str, period: int) -> dict[str, Any]:
    """The fold in which the branch of the smallest stable responses of some periods at the lowest
    stiffness ends.
    """
    ds = data[of]
    value = ds[f"point_{ds.attrs['parameter']}"].values
    here = (value == value.min()) & (ds["point_stable"].values == 1)
    here &= ds["branch_periods"].values[ds["point_branch"].values] == period
    if not here.any():
        return {"fold": np.nan}
    least = np.flatnonzero(here)[np.argmin(ds["point_rms"].values[here])]
    folds, _ = _events(ds, int(ds["point_branch"].values[least]), "fold")
    return {"fold": float(folds[0]) if len(folds) else np.nan}


def birth(data: Data, of: str, value: float) -> dict[str, Any]:
    """The closed branch of the third attractor at a stiffness, what its upper end is, the graze
    next to it, and the folds of the branch of the two others.
    """
    ds = data[of]
    closed = [
        int(b) for b in np.flatnonzero(ds["branch_closed"].values == 1)
        if _values(ds, int(b)).min() < value < _values(ds, int(b)).max()
    ]  # fmt: skip
    if not closed:
        return {"closed": 0, "by_graze": False, "low": np.nan, "high": np.nan, "graze": np.nan,
                "share": np.nan, "folds": []}  # fmt: skip
    events, kinds = _events(ds, closed[0])
    folds, grazes = events[kinds == "fold"], events[kinds == "graze"]
    others = [b for b in range(ds.sizes["branch"]) if b != closed[0]]
    return {
        "closed": len(closed),
        "by_graze": bool(kinds[-1] == "graze"),
        "low": float(folds.min()),
        "high": float(folds.max()),
        "graze": float(grazes.max()) if len(grazes) else np.nan,
        "share": float(folds.max() / value - 1.0),
        "folds": [float(one) for b in others for one in _events(ds, b, "fold")[0]],
    }


def doubling(data: Data, of: str, low: float, high: float) -> dict[str, Any]:
    """The period doubling of the T branch between two stiffnesses, and the branch that it makes."""
    ds = data[of]
    single = np.flatnonzero(ds["branch_periods"].values == 1)
    double = np.flatnonzero(ds["branch_periods"].values == 2)
    events = [_events(ds, int(b), "period_doubling")[0] for b in single]
    at = np.concatenate(events) if events else np.zeros(0)
    at = at[(at > low) & (at < high)]
    if len(at) != 1 or not len(single):
        return {"count": len(at), "at": np.nan, "unstable": False, "begins": False}
    values, stable = _values(ds, int(single[0])), _stable(ds, int(single[0]))
    ends = [
        (end, _values(ds, int(b))[place], _stable(ds, int(b))[place])
        for b in double
        for place, end in ((0, str(ds["branch_begin"].values[b])), (-1, str(ds["branch_end"].values[b])))
    ]  # fmt: skip
    begins = any(
        end in ("period_doubling", "branch") and abs(where / at[0] - 1) < 1e-3 and kept
        for end, where, kept in ends
    )
    return {
        "count": 1,
        "at": float(at[0]),
        "unstable": bool(stable[values < at[0]].all() and not stable[values > at[0]].any()),
        "begins": begins,
    }
