"""Growth of time with the size of a model: time of the first result, and time per forcing period of
one trajectory, by Taylor series and by modes.

The model is a chain of masses whose end strikes stops on both sides, by its lowest modes, driven
below its first resonance. Every row is a process of its own with an empty cache for its equation;
CPU time counts all threads and processes.

    python benchmarks/growth.py            1 to 60 modes and 2 stops
    python benchmarks/growth.py 60 8       60 modes and 8 stops
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve()
sys.path.insert(0, str(HERE.parent.parent / "src"))
#: Modes and stops of the rows.
ROWS = ((1, 2), (5, 2), (10, 2), (20, 2), (40, 2), (60, 2))
PERIODS = {True: 400, False: 40}  # of few modes, of many


def seconds() -> float:
    """CPU time of this process and its children so far [s]."""
    return sum(os.times()[:4])


def measured(modes: int, stops: int) -> str:
    """One row of the table."""
    import saltus as sl

    n = 4 * modes
    stiffness = 1e6 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    stiffness[-1, -1] /= 2
    first = np.sqrt(np.linalg.eigvalsh(stiffness)[0]) / (2 * np.pi)
    contacts = [
        sl.Contact(f"x{n - place}", 5e5, "0.1 mm", side="both", name=f"stop_{place}")
        for place in range(stops)
    ]
    chain = sl.structure(
        np.eye(n), stiffness, modes=modes, damping_ratio="1 %", contacts=contacts,
        forces=[sl.Force(f"x{n}", "20 N")], frequency=0.95 * first,
    )  # fmt: skip
    periods, parts = PERIODS[modes <= 10], []
    for method in (sl.Taylor(), sl.Modal()):
        begun = seconds()
        sl.simulate(chain, periods=1, threads=1, progress=False, method=method)
        first_result = seconds()
        run = sl.simulate(chain, periods=periods, threads=1, progress=False, method=method)
        each = (seconds() - first_result) / periods
        assert run.status.item() == "ok", run.status.item()
        parts += [f"{first_result - begun:.1f}", f"{1e3 * each:.2g}"]
    return f"| {modes} | {stops} | {run.sizes['contact'] / periods:.1f} | {' | '.join(parts)} |"


def main(arguments: list[str]) -> None:
    """Print the table."""
    if arguments[:1] == ["--row"]:
        print(measured(int(arguments[1]), int(arguments[2])), flush=True)
        return
    rows = [(int(arguments[0]), int(arguments[1]))] if arguments else ROWS
    print("| modes | stops | contacts a period | Taylor: first result [CPU s] | a period [CPU ms] "
          "| Modal: first result | a period |")  # fmt: skip
    print("|---|---|---|---|---|---|---|", flush=True)
    with tempfile.TemporaryDirectory() as cache:
        for shown, row in ((False, (1, 1)), *((True, row) for row in rows)):
            # the first prepares the code that all equations share, and isn't shown
            subprocess.run(
                [sys.executable, str(HERE), "--row", *map(str, row)],
                env={**os.environ, "SALTUS_CACHE": cache},
                stdout=None if shown else subprocess.DEVNULL,
                check=True,
            )


if __name__ == "__main__":
    main(sys.argv[1:])
