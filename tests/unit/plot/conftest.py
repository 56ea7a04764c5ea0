"""A real run to draw: the de Langre rig, case b with 4 N at 15 Hz, integrated by SciPy leg by leg,
every contact an event.
"""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pytest
from scipy.integrate import solve_ivp

mpl.use("Agg")
import matplotlib.pyplot as plt

import made_results
from made_results import Contacts
from saltus.results import Guards, attributes

STARTS = (1.0e-3, 0.2e-3, 0.4e-3, 2.0e-3)
GAPS = (0.0, 0.4e-3)
PARAMETERS = {
    "mass": 3.0,
    "damping_ratio": 0.03,
    "natural_frequency": 5.0,
    "cubic": 7e8,
    "contact_stiffness": 1.4e4,
    "lower_gap": GAPS[0],
    "upper_gap": GAPS[1],
    "force": 4.0,
    "frequency": 15.0,
}
UNITS = {
    "x": "m",
    "v": "m/s",
    "mass": "kg",
    "damping_ratio": "1",
    "natural_frequency": "Hz",
    "cubic": "N/m^3",
    "contact_stiffness": "N/m",
    "lower_gap": "m",
    "upper_gap": "m",
    "force": "N",
    "frequency": "Hz",
}
PERIOD = 1 / PARAMETERS["frequency"]


def _field(mode: int):
    w, wn, p = 2 * np.pi * 15.0, 2 * np.pi * 5.0, 4.0
    drive = p * (1 - 18 / w**2)
    stiffness, offset = {0: (1.4e4, GAPS[0]), 1: (0.0, 0.0), 3: (1.4e4, GAPS[1])}[mode]

    def field(t, y):
        contact = stiffness * (y[0] - offset)
        return y[1], (drive * np.cos(w * t) - contact) / 3.0 - 2 * 0.03 * wn * y[1] - wn**2 * y[
            0
        ] - 7e8 / 3.0 * y[0] ** 3

    return field


def _exits(mode: int):
    """The guards that can be left through in a mode: (guard, direction)."""
    return [(i, -1 if mode >> i & 1 else 1) for i in range(2) if mode ^ (1 << i) in (0, 1, 3)]


def _event(guard: int, direction: int):
    def gap(t, y):
        return y[0] - GAPS[guard]

    gap.terminal, gap.direction = True, direction
    return gap


def integrate(x0: float, periods: int, samples: int):
    """Samples, modes and contact rows (time, guard, direction, x, v, before, after) of one start at
    rest.
    """
    end, t, y = periods * PERIOD, 0.0, np.array([x0, 0.0])
    grid = np.arange(periods * samples + 1) * (PERIOD / samples)
    out, modes, rows = np.empty((grid.size, 2)), np.empty(grid.size, dtype=np.int64), []
    # a start on a boundary moves up: the drive is positive at t = 0
    mode = sum(1 << i for i, gap in enumerate(GAPS) if x0 >= gap)
    while t < end:
        exits = _exits(mode)
        leg = solve_ivp(
            _field(mode),
            (t, end),
            y,
            "DOP853",
            events=[_event(*one) for one in exits],
            rtol=1e-10,
            atol=1e-13,
            max_step=PERIOD / 40,
            dense_output=True,
        )
        inside = (grid >= t) & (grid <= leg.t[-1])
        out[inside], modes[inside] = leg.sol(grid[inside]).T, mode
        t, y = leg.t[-1], leg.y[:, -1]
        if leg.status == 1:
            guard, direction = next(
                one for one, hits in zip(exits, leg.t_events, strict=True) if hits.size
            )
            y[0] = GAPS[guard]
            rows.append((t, guard, direction, *y, mode, mode ^ (1 << guard)))
            mode ^= 1 << guard
    return grid, out, modes, np.array(rows).reshape(-1, 7)


def rig_run(starts=STARTS[:1], periods=40, samples=100, batch=False, kinds=None, status="ok"):
    """The Dataset that ``simulate`` would return; ``kinds`` renames the kind of the
    first contacts.
    """
    runs = [integrate(x0, periods, samples) for x0 in starts]
    rows = np.concatenate([run[3] for run in runs])
    kind = np.full(len(rows), "crossing", dtype="<U16")
    if kinds:
        kind[: len(kinds)] = kinds
    one = np.zeros(len(starts), dtype=np.int64)
    contacts = Contacts(
        trajectory=np.repeat(np.arange(len(starts)), [len(run[3]) for run in runs]),
        time=rows[:, 0], time_error=np.full(len(rows), 1e-12),
        guard=rows[:, 1], direction=rows[:, 2], velocity=rows[:, 4], kind=kind, states=rows[:, 3:5],
        mode_before=rows[:, 5],
        mode_after=rows[:, 6],
        steps=np.arange(len(rows)),
    )  # fmt: skip
    return made_results.trajectory(
        states=("x", "v"), units=UNITS, time=runs[0][0],
        period=np.arange(periods * samples + 1) / samples, forcing_period=PERIOD,
        values={name: np.stack([run[1][:, i] for run in runs]) for i, name in enumerate("xv")},
        mode=np.stack([run[2] for run in runs]),
        contacts=contacts, guards=Guards(("lower_gap", "upper_gap"), ("x", "x"), np.array(GAPS)),
        status=[status] * len(starts),
        counters={"events": [len(run[3]) for run in runs], "grazes": one, "steps": one + 1000},
        minima={"smallest_contact_speed": one + 0.01, "smallest_gap_margin": one + 1e-5},
        end_time=[periods * PERIOD] * len(starts),
        end={name: [run[1][-1, i] for run in runs] for i, name in enumerate("xv")},
        attrs=PROVENANCE, batch=batch,
    )  # fmt: skip


PROVENANCE = attributes(
    system="deLangre b", equations=["dx/dt = v", "dv/dt = ..."], parameters=PARAMETERS, units=UNITS,
    method="DOP853",
    method_options={"rtol": 1e-10, "atol": 1e-13}, fingerprint="0" * 16,
)  # fmt: skip


@pytest.fixture(scope="session")
def run():
    """One trajectory, 40 periods."""
    return rig_run()


@pytest.fixture(scope="session")
def batch():
    """Four trajectories, 20 periods."""
    return rig_run(STARTS, periods=20, batch=True)


@pytest.fixture(scope="session")
def points(batch):
    """The batch at whole periods, as ``stroboscope`` would return it."""
    whole = batch.isel(time=slice(None, None, 100))
    return made_results.stroboscope(
        states=("x", "v"), units=UNITS, period=np.arange(21),
        values={name: whole[name].values for name in "xv"}, status=["ok"] * 4,
        guards=Guards(("lower_gap", "upper_gap"), ("x", "x"), np.array(GAPS)),
        forcing_period=PERIOD, attrs=PROVENANCE,
    )  # fmt: skip


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    plt.close("all")
