"""A run whose contacts are known in closed form: x = A sin(2 pi t), v = dx/dt, a
guard at x = 1 mm.
"""

from __future__ import annotations

import math
import sys

import numpy as np
import pytest

import made_results
from made_results import Contacts
from saltus.results import Guards, attributes

GAP = 1e-3
UNITS = {"x": "m", "v": "m/s", "gap": "m", "frequency": "Hz"}
PROVENANCE = attributes(
    system="sine", equations=["x' = v", "v' = -(2*pi)**2*x"],
    parameters={"gap": GAP, "frequency": 1.0}, units=UNITS, method="closed form",
    method_options={"tolerance": 1e-16, "order": None}, fingerprint="ab" * 8,
    source="Müller & Söhne, §3",
)  # fmt: skip


def sine_run(
    amplitudes=(2e-3,),
    periods=3,
    samples=16,
    batch=False,
    frequencies=None,
    guards=("gap",),
    **changes,
):
    """Contacts of A sin(2 pi f t) with the gap in (0, periods]: two a period if A > gap.
    ``guards=()`` leaves guards and contacts out.
    """
    n = len(amplitudes)
    f = np.ones(n) if frequencies is None else np.asarray(frequencies, dtype=float)
    phase = np.arange(periods * samples + 1) / samples
    a = np.asarray(amplitudes)[:, None]
    x, v = a * np.sin(2 * np.pi * phase), a * 2 * np.pi * f[:, None] * np.cos(2 * np.pi * phase)
    rows = [
        (k, (i + where) / f[k], 1 - 2 * j, v_hit)
        for k, top in enumerate(amplitudes)
        if top > GAP and guards
        for i in range(periods)
        for j, where in enumerate(
            (math.asin(GAP / top) / (2 * np.pi), 0.5 - math.asin(GAP / top) / (2 * np.pi))
        )
        for v_hit in [(1 - 2 * j) * 2 * np.pi * f[k] * math.sqrt(top**2 - GAP**2)]
    ]
    table = np.array(rows).reshape(-1, 4)
    up = table[:, 2] > 0
    contacts = Contacts(
        trajectory=table[:, 0], time=table[:, 1], time_error=np.full(len(rows), 1e-16),
        guard=np.zeros(len(rows)), direction=table[:, 2],
        velocity=table[:, 3], kind=["crossing"] * len(rows),
        states=np.stack([np.full(len(rows), GAP), table[:, 3]], axis=1),
        mode_before=~up, mode_after=up, steps=np.arange(len(up)),
    )  # fmt: skip
    count = np.bincount(table[:, 0].astype(int), minlength=n)
    arguments = {
        "states": ("x", "v"), "units": UNITS,
        "time": phase if frequencies is None else phase / f[:, None], "period": phase,
        "forcing_period": 1.0 if frequencies is None else 1 / f, "values": {"x": x, "v": v},
        "mode": x > GAP, "contacts": contacts,
        "guards": Guards(guards, ("x",) * len(guards), np.full(len(guards), GAP)),
        "status": ["ok"] * n,
        "counters": {"events": count, "steps": count + 7},
        "minima": {"smallest_contact_speed": np.full(n, 0.5)}, "end_time": periods / f,
        "end": {"x": x[:, -1], "v": v[:, -1]}, "attrs": PROVENANCE, "batch": batch,
        "varied": None if frequencies is None else {"frequency": f},
    }  # fmt: skip
    return made_results.trajectory(**{**arguments, **changes})


def sine_points(**changes):
    """Two starts at four whole periods."""
    values = np.arange(8.0).reshape(2, 4)
    arguments = {
        "states": ("x", "v"), "units": UNITS, "period": np.arange(10**6, 10**6 + 4),
        "values": {"x": values, "v": -values},
        "status": ["ok", "resting"],
        "guards": Guards(("gap",), ("x",), np.array([GAP])), "forcing_period": 1.0,
        "attrs": PROVENANCE,
    }  # fmt: skip
    return made_results.stroboscope(**{**arguments, **changes})


@pytest.fixture
def untried(monkeypatch):
    """A file without a checksum is read at once. That it is tried in a process of its own first is
    seen in faults/test_result_files.py.
    """
    monkeypatch.setattr(sys.modules["saltus.results.files.load"], "try_elsewhere", lambda *_: None)


@pytest.fixture
def run():
    return sine_run()


@pytest.fixture
def batch():
    return sine_run((2e-3, 0.5e-3, 3e-3), batch=True)
