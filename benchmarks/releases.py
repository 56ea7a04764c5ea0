"""What saltus weighed and took at each release: a row a release and machine, in
benchmarks/releases.csv.

CPU times on one thread, each the least of some repeats: others on the machine can only add to them.
The rig is case b4 of de Langre et al.; its period is that of a trajectory among 2048, its map has
100 x 100 starts at 15 Hz, its diagram 40 frequencies from 13 to 17 Hz.

    python benchmarks/releases.py            print the table
    python benchmarks/releases.py --measure  measure this version here first: some two minutes
"""

from __future__ import annotations

import argparse
import csv
import datetime
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

import saltus as sl

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks import basins, compile, flow, size, startup
from benchmarks.record import machine

FILE = Path(__file__).with_name("releases.csv")
Row = Mapping[str, str]


def start_up(repeats: int = 5) -> float:
    """A process that imports saltus and ends [s]."""
    startup.fresh("import saltus")  # fills the caches of files
    return min(startup.fresh("import saltus")[0] for _ in range(repeats))


def new_equation() -> float:
    """From the definition of the rig to its first state in a fresh process [s]."""
    with tempfile.TemporaryDirectory() as folder:
        cache = Path(folder) / "kernels"
        compile.measured("saltus", "rig", cache, compile.is_shared)
        times = [compile.measured("saltus", "rig", cache) for _ in range(3)]
    return min(cpu for cpu, _ in filter(None, times))


def period(count: int = 2048) -> float:
    """A forcing period of one of many trajectories [µs]."""
    x, v = np.random.default_rng(15).uniform((-4e-3, -0.5), (4e-3, 0.5), (count, 2)).T
    return flow.ours(sl.Taylor(), x, v)[0]


def basin_map(cells: int = 100) -> float:
    """A map [s]."""
    basins.ours(4, 1)  # compiles
    return basins.ours(cells, 1, repeats=2)[0].cpu


def diagram(count: int = 40) -> float:
    """A diagram over frequency, its branches followed [s]."""
    rig = sl.models.delangre("b", force="4 N")

    def over(values: int) -> object:
        return sl.frequency_response(rig, ("13 Hz", "17 Hz", values), threads=1, progress=False)

    over(2)  # compiles
    return basins.timed(lambda: over(count), 2)[0].cpu


#: What is measured, by the heading of its column, and how it is written.
MEASURED: dict[str, tuple[Callable[[], float], str]] = {
    "lines of code": (lambda: size.counted(size.SOURCE)["all"][2], ".0f"),
    "tokens": (lambda: size.counted(size.SOURCE)["all"][3], ".0f"),
    "import [s]": (start_up, ".2f"),
    "new equation [s]": (new_equation, ".2f"),
    "period [us]": (period, ".3f"),
    "map [s]": (basin_map, ".2f"),
    "diagram [s]": (diagram, ".2f"),
}


def measured() -> Row:
    """The row of this version on this machine."""
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    return {
        "version": sl.__version__,
        "date": today,
        "machine": machine(),
        **{name: format(measure(), form) for name, (measure, form) in MEASURED.items()},
    }


def kept(file: Path) -> list[Row]:
    """The rows of a table; none if there is no file yet."""
    if not file.exists():
        return []
    with file.open(newline="", encoding="utf-8") as lines:
        return list(csv.DictReader(lines))


def keep(row: Row, file: Path) -> None:
    """Append a row to a table; the one of the same version and machine makes room for it."""
    same = [row[name] for name in ("version", "machine")]
    others = [one for one in kept(file) if [one["version"], one["machine"]] != same]
    with file.open("w", newline="", encoding="utf-8") as lines:
        writer = csv.DictWriter(lines, row, restval="", lineterminator="\n")
        writer.writeheader()
        writer.writerows([*others, row])


def as_text(rows: list[Row]) -> str:
    """A table for the terminal."""
    if not rows:
        return "no release was measured yet: --measure"
    table = [list(rows[-1]), *([row.get(name) or "" for name in rows[-1]] for row in rows)]
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return "\n".join(
        "  ".join(text.ljust(width) for text, width in zip(line, widths, strict=True)).rstrip()
        for line in table
    )


def main() -> None:
    """Measure where that is asked for, and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--measure", action="store_true", help="measure this version here first")
    if parser.parse_args().measure:
        keep(measured(), FILE)
    print(as_text(kept(FILE)))


if __name__ == "__main__":
    main()
