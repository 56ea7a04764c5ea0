"""Derivatives of periodic orbits of random systems beside differences of orbits that are closed
anew at other values.
"""

from __future__ import annotations

import json
import warnings
from functools import partial

import numpy as np

import saltus as sl

from .derivative_systems import Case
from .differences import Column, shifts

READ = {
    "derivative": "value", "contact_time_derivative": "contact_time",
    "maximum_derivative": "maximum", "minimum_derivative": "minimum",
    "end_derivative": "end", "period_derivative": "period", "multiplier_derivative": "multiplier",
}  # fmt: skip
#: Orbits of a system whose derivatives are judged, and distance of a multiplier from 1 at which an
#: orbit is nearly at a fold.
ORBITS, FOLD = 2, 1e-4


def closed(that: Case, method: sl.Method, seed: int = 1):
    """Periodic orbits of a case, a Dataset."""
    system, rng = that.system(), np.random.default_rng(seed)
    size = len(system.states)
    start = np.pad(np.array(that.start), (0, size - len(that.start)))
    starts = start * rng.uniform(-1.0, 1.0, (12, size))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return sl.periodic_orbits(system, starts, periods=2, method=method)


def columns(that: Case, method: sl.Method, seed: int = 1) -> list[Column] | str:
    """All derivatives of some orbits of a case, or why there are none."""
    system = that.system()
    if system.forced_at is None:
        return "unforced"
    found = closed(that, method, seed)
    to = [name for name in that.to if not name.endswith("(0)")]
    if not found.sizes["orbit"]:
        return "no orbit"
    return [
        column
        for one in range(min(ORBITS, found.sizes["orbit"]))
        for column in _of_orbit(system, found.isel(orbit=one), to, method)
    ]


#: Statuses of motions that came to the end of their period.
ENDED = ("ok", "graze_unresolved")


def _of_orbit(system, orbit, to, method):
    fly = partial(_sensitivity, to=to, method=method)
    try:
        (one,) = fly(system, orbit, None)
        times = np.linspace(0.21, 0.97, 4) * one["period"]
        (one,) = fly(system, orbit, times)
    except sl.errors.ParameterError:  # it ends before its period does, or doesn't close
        return [Column("lost", name, *np.empty((3, 0))) for name in to]
    if one["status"] not in ENDED:
        return [Column(one["status"], name, *np.empty((3, 0))) for name in to]
    answer = []
    for number, name in enumerate(to):
        base = json.loads(orbit.attrs["parameters"])[name]
        moved, unit = shifts(base)
        try:
            runs = [fly(system, _moved(orbit, {name: base + s}), times)[0] for s in moved]
        except sl.errors.ParameterError:
            answer.append(Column("lost", name, *np.empty((3, 0))))
            continue
        if stopped := [run["status"] for run in runs if run["status"] not in ENDED]:
            answer.append(Column(stopped[0], name, *np.empty((3, 0))))
            continue
        if any(run["contacts"] != one["contacts"] for run in runs):
            answer.append(Column("other contacts", name, *np.empty((3, 0))))
            continue
        if np.abs(one["multiplier"] - 1.0).min(initial=1.0) < FOLD:
            answer.append(Column("fold", name, *np.empty((3, 0))))
            continue
        for kind, read in READ.items():
            late = kind == "end_derivative" and name == system.forced_at
            if kind not in one or late:
                continue
            rows = [_nearest(run[read], one[read]) for run in runs]
            left_out = one["ends of chatter"] if kind.startswith("contact") else False
            own = one[kind][..., number]
            parts = [("", np.real)] if kind != "multiplier_derivative" else PARTS
            answer += [
                Column.of(kind + word, name, part(own), part(np.array(rows)), unit, left_out)
                for word, part in parts
            ]
    return answer


PARTS = ((" real", np.real), (" imag", np.imag))


def _nearest(values, own):
    """Multipliers in the order of others."""
    if not np.iscomplexobj(values):
        return values
    return values[np.abs(values[None] - own[:, None]).argmin(axis=1)]


def _moved(orbit, values):
    """An orbit with other values of parameters, near which sensitivity closes it anew."""
    known = json.loads(orbit.attrs["parameters"]) | values
    return orbit.assign_attrs(parameters=json.dumps(known))


def _sensitivity(system, orbit, times, *, to, method):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = sl.sensitivity(system, orbit, to=to, at=times, method=method)
    names = (*system.states, *system.outputs.names)
    kinds, at = found.contact_kind.values, found.contact_time.values
    read = {name: found[name].values for pair in READ.items() for name in pair if name in found}
    behind = np.append(False, (kinds[:-1] == "impact") & (np.diff(at) > 0))[: len(kinds)]
    real, imag = (found[f"multiplier_{part}"].values for part in ("real", "imag"))
    by = [found[f"multiplier_{part}_derivative"].values for part in ("real", "imag")]
    return [
        read
        | {
            "status": str(found.status.item()),
            "end": np.array([found[f"end_{name}"].item() for name in names]),
            "contacts": [*found.contact_guard.values, *kinds],
            "ends of chatter": (kinds == "hold") & behind,
            "multiplier": real + 1j * imag,
            "multiplier_derivative": by[0] + 1j * by[1],
        }
    ]
