"""Motions by the modal flow and by Taylor's method, and how far their contacts are the same."""

from __future__ import annotations

import numpy as np

import saltus as sl

FOLLOWS = {"progress": False, "time_errors": "local"}


def runs(system, start, **kw):
    """The motion by the modal flow and by Taylor's method."""
    assert isinstance(sl.Modal().serving(system), sl.Modal)
    methods = sl.Modal(), sl.Taylor()
    return [sl.simulate(system, start, method=method, **FOLLOWS, **kw) for method in methods]


def same_rows(one, other, period, tolerance=1e-12):
    """Number of the first contacts that are the same rows, times to a tolerance that grows by a
    third at each.
    """
    count = min(one.sizes["contact"], other.sizes["contact"])
    same = np.ones(count, bool)
    for name in ("kind", "guard", "direction", "mode_before", "mode_after"):
        pair = (run[f"contact_{name}"].values[:count] for run in (one, other))
        same &= np.equal(*pair)
    apart = np.abs(one.contact_time.values[:count] - other.contact_time.values[:count]) / period
    wrong = np.flatnonzero(~same | (apart > tolerance * 1.3 ** np.arange(count)))
    return int(wrong[0]) if len(wrong) else count


def times(run, kind):
    return run["contact_time"].values[run["contact_kind"].values == kind]
