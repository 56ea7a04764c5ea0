"""Time of the frequency response of a structure with stops: a cantilever beam of some modes, from
rest at each frequency, and all frequencies at once.

Usage: ``python benchmarks/responses.py [MODES STOPS FREQUENCIES]``; by default 5 2 41.
"""

from __future__ import annotations

import runpy
import sys
import time
from collections import defaultdict
from pathlib import Path

import numpy as np

import saltus as sl

EXAMPLE = Path(__file__).resolve().parent.parent / "examples" / "beam" / "beam.py"
#: Nodes at which the stops are, the tip first; range of frequencies [Hz].
NODES, BAND = (20, 10, 15, 5, 18, 12, 8, 17), (5.0, 85.0)


def beam(modes: int, stops: int) -> sl.System:
    """The beam of the examples with stops on both sides, driven hard."""
    example = runpy.run_path(str(EXAMPLE))
    return sl.structure(
        *example["matrices"](), damping_ratio=0.01, modes=modes, names=example["NAMES"],
        name="beam", frequency="11 Hz", forces=[sl.Force("x20", "2 N")],
        contacts=[
            sl.Contact(f"x{node}", stiffness="20 kN/m", gap="1 mm", side="both", name=f"s{node}")
            for node in NODES[:stops]
        ],
    )  # fmt: skip


def kind(ds: object) -> str:
    """1T, nT, or the kind of a motion that doesn't repeat."""
    word, period = ds.type.item(), int(ds.period.item())
    return word if word != "periodic" else "1T" if period == 1 else "nT"


def main(modes: int = 5, stops: int = 2, count: int = 41) -> None:
    """Print times."""
    system, took = beam(modes, stops), defaultdict(list)
    frequencies = np.linspace(*BAND, count)
    sl.frequency_response(system, [400.0], threads=1)  # compiles
    for frequency in frequencies.tolist():
        begun = time.perf_counter()
        ds = sl.frequency_response(system, [frequency], threads=1)
        took[kind(ds)].append(time.perf_counter() - begun)
        print(f"{frequency:7.2f} Hz  {kind(ds):15} {took[kind(ds)][-1]:8.2f} s", flush=True)
    print(f"\n{modes} modes, {stops} stops:  number   median [s]   longest [s]")
    for word, times in sorted(took.items()):
        print(f"{word:20} {len(times):10} {np.median(times):12.2f} {max(times):13.2f}")
    begun = time.perf_counter()
    sl.frequency_response(system, frequencies)
    print(f"all at once, on all processors: {time.perf_counter() - begun:.1f} s")


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:4]))
