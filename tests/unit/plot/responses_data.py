"""Small sets of responses as the analyses would return them: closed forms, nothing integrated."""

from __future__ import annotations

import numpy as np

import made_results
from made_results import Events, Responses, Starts
from saltus.results import AttractorTable, Guards, attributes

UNITS = {
    "x": "m",
    "v": "m/s",
    "frequency": "Hz",
    "contact_stiffness": "N/m",
    "gap": "m",
    "growth": "1",
}
PROVENANCE = attributes(
    system="made up", equations=["x' = v"], parameters={"gap": 4e-4}, units=UNITS,
    method="closed form", method_options={},
    fingerprint="0" * 16,
)  # fmt: skip
GAPS = Guards(("lower_gap", "upper_gap"), ("x", "x"), np.array([-2e-4, 4e-4]))


def responses(values, rows, axis="frequency", sample="", **more):
    """A Dataset from rows (place, branch, kind, period, rms, points): what is at a value is led to
    by one start each.
    """
    m = len(rows)
    place, branch, kind, period, rms, points = (
        (list(column) for column in zip(*rows, strict=True)) if rows else ([],) * 6
    )
    starts = max((place.count(i) for i in range(len(values))), default=1)
    response_of = np.full((len(values), starts), -2)
    for i in range(len(values)):
        here = [k for k in range(m) if place[k] == i]
        response_of[i, : len(here)] = here
    states = [np.stack([np.asarray(one), np.zeros(len(one))], axis=-1) for one in points]
    table = AttractorTable(
        kind=kind, period=np.array(period, dtype=int), contacts=np.ones(m), itinerary=[""] * m,
        peak=1.5 * np.array(rms, dtype=float),
        rms=np.array(rms, dtype=float), margin=np.full(m, 1e-5),
        multipliers=np.full((m, 2), 0.5 + 0j), exponent=np.full(m, -1.0),
        exponent_error=np.zeros(m), points=states,
    )  # fmt: skip
    arguments = {
        "states": ("x", "v"), "units": UNITS, "axes": {axis: np.asarray(values, dtype=float)},
        "sample": sample, "guards": GAPS,
        "starts": Starts({"x": np.linspace(0.0, 1e-3, starts), "v": np.zeros(starts)}),
        "response_of": response_of,
        "responses": Responses(table, np.array(place, dtype=int)[:, None],
            np.array(branch, dtype=int), states if sample else None),
        "gap_unit": "m", "attrs": PROVENANCE,
    }  # fmt: skip
    return made_results.responses(**{**arguments, **more})


def resonance(count=141, shift=0.0):
    """A resonance that bends over: two T branches between the folds, a 3T branch of its own, chaos
    in a band.
    """
    f = np.linspace(2.0, 30.0, count)
    low = 4e-4 / np.hypot(1 - (f / (14 + shift)) ** 2, 0.12)
    rows = []
    for i, value in enumerate(f):
        if 24 < value < 26:
            rows.append((i, 100 + i, "chaotic", 0, 3e-4 + 5e-5 * np.sin(40 * value), [1e-4, 2e-4]))
            continue
        rows.append((i, 0, "periodic", 1, min(low[i], 1.2e-3), [1e-4]))
        if 15 < value < 19:
            rows.append((i, 1, "periodic", 1, 1.6e-3 + 2e-4 * (value - 15), [1e-3]))
        if 19 <= value < 22.5:
            rows.append((i, 2, "periodic", 3, 1.1e-3 + 1e-4 * np.sin(value), [1e-4, 2e-4, 3e-4]))
        if 26 <= value < 26.6:
            rows.append((i, 3, "periodic", 24, 8e-4, [1e-4] * 24))
    events = Events(
        {"frequency": np.array([15.0, 19.0, 22.5, 24.0])},
        ["fold", "fold", "graze", "period_doubling"],
        np.array([1, 1, 2, 0]),
    )
    return responses(f, rows, events=events)


def cascade(count=400, keep=120, low=2.9, high=4.0, axis="contact_stiffness", noise=0.0):
    """The logistic map as a bifurcation diagram over a logarithmic axis: its period doublings at 3,
    1 + sqrt(6), ... are known.
    """
    growth = np.linspace(low, high, count)
    values = 10.0 ** np.linspace(3, 9, count)
    x = np.full(count, 0.4) + noise
    for _ in range(3000):
        x = growth * x * (1 - x)
    kept = np.empty((keep, count))
    for k in range(keep):
        kept[k] = x = growth * x * (1 - x)
    rows, branch = [], 0
    for i in range(count):
        n = next((n for n in range(1, 25) if np.allclose(kept[n:, i], kept[:-n, i], atol=1e-6)), 0)
        if (rows and rows[-1][3] != n) or not n:
            branch += 1
        rows.append(
            (
                i,
                branch,
                "periodic" if n else "chaotic",
                n,
                1e-3,
                1e-3 * (kept[: n or keep, i] - 0.3),
            )
        )
    known = np.interp([3.0, 1 + np.sqrt(6)], growth, np.log10(values))
    events = Events({axis: 10.0**known}, ["period_doubling"] * 2, np.array([0, 1]))
    return responses(values, rows, axis=axis, sample="turning_points", events=events)


def kinds_map(n1=40, n2=30, log=True):
    """A map over two parameters: 1T to 9T in stripes, chaos, one that escapes."""
    f, k = (
        np.linspace(5.0, 20.0, n1),
        np.geomspace(1e3, 1e6, n2) if log else np.linspace(1e3, 1e6, n2),
    )
    i, j = (grid.ravel() for grid in np.meshgrid(np.arange(n1), np.arange(n2), indexing="ij"))
    period = (i + 2 * j) // 8 % 11
    period[period == 10] = 27
    m = period.size
    table = AttractorTable(
        kind=np.where(period > 0, "periodic", "chaotic").tolist(), period=period,
        contacts=np.ones(m), itinerary=[""] * m, peak=np.ones(m),
        rms=np.ones(m), margin=np.ones(m), multipliers=np.ones((m, 2)), exponent=np.ones(m),
        exponent_error=np.ones(m),
        points=[np.zeros((1, 2))] * m,
    )  # fmt: skip
    response_of = np.arange(m).reshape(n1, n2, 1)
    response_of[:3, :3] = -1
    response_of[-3:, :3] = -2
    return made_results.responses(
        states=("x", "v"), units=UNITS, axes={"frequency": f, "contact_stiffness": k},
        starts=Starts({"x": [3.2e-4], "v": [0.0]}),
        response_of=response_of,
        responses=Responses(table, np.stack([i, j], axis=-1), np.arange(m)), gap_unit="m",
        attrs=PROVENANCE,
    )  # fmt: skip
