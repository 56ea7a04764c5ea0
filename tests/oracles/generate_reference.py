"""Write the 40-digit reference data of the deLangre rig: ``python -m
tests.oracles.generate_reference`` (about 5 minutes, one core).

Every number handed to the integrator is the double that a user would type, so that a solver in
double precision starts from the same one.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np
from mpmath import mp, mpf

from . import high_precision

REFERENCE = Path(__file__).parents[1] / "reference"
SEED = 20210
RIG = {"mass": 3.0, "damping_ratio": 0.03, "natural_frequency": 5.0, "cubic": 7e8}
B4 = {
    **RIG,
    "contact_stiffness": 1.4e4,
    "lower_gap": 0.0,
    "upper_gap": 0.4e-3,
    "force": 4.0,
    "frequency": 15.0,
}
PERIODS = 5
NUDGE = mpf(10) ** -20
RESULT = (
    "contacts",
    "margin_m",
    "x_end_m",
    "v_end_m_per_s",
    "dxend_dx0",
    "dxend_dv0_s",
    "contact_times_s",
)


def solve(parameters: dict, x: float, v: float) -> list:
    """The :data:`RESULT` columns of one start: end state to 30 digits, its sensitivity by a 1e-20
    nudge, contact times to 22 digits.
    """
    end = high_precision.simulate(parameters, x, v, PERIODS)
    with mp.workdps(50):
        along_x = (high_precision.simulate(parameters, x + NUDGE, v, PERIODS).x - end.x) / NUDGE
        along_v = (high_precision.simulate(parameters, x, v + NUDGE, PERIODS).x - end.x) / NUDGE
        times = " ".join(mp.nstr(t, 22) for t in end.times)
        return [
            len(end.times),
            mp.nstr(end.margin, 6),
            mp.nstr(end.x, 30),
            mp.nstr(end.v, 30),
            mp.nstr(along_x, 6),
            mp.nstr(along_v, 6),
            times,
        ]


def starts() -> list[tuple[str, float, float]]:
    """Starts in case b4: an 8 x 8 grid of cell centres and 64 random ones in [-5, 5] mm x [-1, 1]
    m/s, and the paper's at rest.
    """
    grid = [
        ("grid", (-4.375 + 1.25 * i) * 1e-3, -0.875 + 0.25 * j) for i in range(8) for j in range(8)
    ]
    rng = np.random.default_rng(SEED)
    random = [
        ("random", float(x), float(v)) for x, v in rng.uniform((-5e-3, -1.0), (5e-3, 1.0), (64, 2))
    ]
    paper = [("at_rest", x, 0.0) for x in (0.0, 0.2e-3, 0.32e-3, 0.4e-3, 1e-3, 2e-3)]
    return grid + random + paper


def random_rigs(count: int = 96) -> list[tuple[dict, float, float]]:
    """Random rigs with cubic term: damping, stiffness, gaps, force, frequency and start."""
    rng = np.random.default_rng(SEED + 1)
    rigs = []
    for _ in range(count):
        parameters = {
            "mass": 3.0,
            "damping_ratio": float(10 ** rng.uniform(-3, -0.7)),
            "natural_frequency": 5.0,
            "cubic": float(10 ** rng.uniform(6, 9.5)),
            "contact_stiffness": float(10 ** rng.uniform(3, 6.5)),
            "lower_gap": float(rng.choice([0.0, rng.uniform(0, 1e-3)])),
            "upper_gap": float(rng.uniform(5e-5, 1e-3)),
            "force": float(rng.uniform(0.5, 8)),
            "frequency": float(rng.uniform(3, 30)),
        }
        rigs.append((parameters, float(rng.uniform(-5e-3, 5e-3)), float(rng.uniform(-1, 1))))
    return rigs


def write(name: str, header: list[str], rows) -> None:
    """Write one csv file below tests/reference, row by row."""
    with (REFERENCE / name).open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for row in rows:
            writer.writerow(row)
            file.flush()


def main(which: list[str]) -> None:
    """Write the files named, or both."""
    if not which or "b4" in which:
        rows = ([kind, repr(x), repr(v), *solve(B4, x, v)] for kind, x, v in starts())
        write("rig_b4_15hz_5periods.csv", ["start", "x0_m", "v0_m_per_s", *RESULT], rows)
    if not which or "random" in which:
        rigs = random_rigs()
        rows = ([*map(repr, p.values()), repr(x), repr(v), *solve(p, x, v)] for p, x, v in rigs)
        write("rig_random_5periods.csv", [*rigs[0][0], "x0_m", "v0_m_per_s", *RESULT], rows)


if __name__ == "__main__":
    main(sys.argv[1:])
