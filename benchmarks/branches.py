"""Cost of the whole frequency response of a rig: all attractors, the branches that they lie on,
stable and unstable, isolas, every bifurcation; from nothing.

The rig of de Langre et al., case b at 4 N, from 2 to 30 Hz. No rival does the same work: AUTO-07p
followed this rig's main branch with smoothed contact, 473 points in 1.4 s, and its folds lie at
12.31 and 17.83 Hz (its own output, tolerances 1e-7); the difference from ours is the error that
smoothing makes. The first call compiles, so it is made twice.

    python benchmarks/branches.py
"""

from __future__ import annotations

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # its threads spin, and count as ours

import sys
import time
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np

import saltus as sl
from saltus.cli.doctor import processor

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.rivals import rig

#: Folds of the main branch by AUTO-07p with smoothed contact [Hz].
SMOOTHED = (12.31, 17.83)
RIG = sl.models.delangre("b", force="4 N")
BOX = {"x": ("-5 mm", "5 mm"), "v": ("-0.5 m/s", "0.5 m/s")}


def timed(job: Any) -> tuple[Any, float, float]:
    """The result of a job, and its seconds of wall and of CPU time."""
    wall, cpu = time.perf_counter(), time.process_time()
    found = job()
    return found, time.perf_counter() - wall, time.process_time() - cpu


def whole() -> Any:
    """Compute everything over the frequency."""
    return sl.frequency_response(
        RIG, ("2 Hz", "30 Hz", 29), "random 12", box=BOX, unstable=True, progress=False
    )


def main_branch() -> Any:
    """Compute the main branch alone, from one start."""
    return sl.branches(
        RIG, {"frequency": ("8 Hz", "22 Hz")}, ("5 mm", 0), at=1, longest=1, progress=False
    )


def main() -> None:
    """Print the table."""
    print(f"{processor()}, {os.cpu_count()} cores")
    print(f"| {'':<28} | wall s | CPU s | orbits | ms an orbit | branches | closed | events |")
    for name, job, cores in (
        ("main branch, one core", main_branch, rig.one_core()),
        ("the whole, 2 to 30 Hz", whole, nullcontext()),
    ):
        with cores:
            job()
            found, wall, cpu = timed(job)
        points = found.sizes["point"]
        print(
            f"| {name:<28} | {wall:6.2f} | {cpu:5.2f} | {points:6d} | {1e3 * cpu / points:11.2f} "
            f"| {found.sizes['branch']:8d} | {int(found.branch_closed.sum()):6d} "
            f"| {found.sizes['event']:6d} |"
        )
    folds = found.event_frequency.values[found.event_kind.values == "fold"]
    for smoothed in SMOOTHED:
        ours = float(folds[np.argmin(np.abs(folds - smoothed))])
        print(f"fold at {ours:.10f} Hz; smoothed contact {smoothed} Hz: {smoothed - ours:+.4f} Hz")
    print(f"changes of stability unexplained: {found.attrs['unexplained_changes']}")


if __name__ == "__main__":
    main()
