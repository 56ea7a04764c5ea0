"""Cost of a start: from the shell to the first trajectory, and of one more in a warm process.

Case b4 of the deLangre rig at 15 Hz from rest. Every row of the first table is a fresh process that
does what its name says and ends; its machine code lies on disk, as after any earlier run, and so
does the byte code of Python. The last row alone finds neither machine code nor Matplotlib's list of
fonts, as the first command on a machine. The libraries alone stand first: what is above them is
saltus. The second table is one call among many in a process: a click. CPU time counts all threads,
and is disturbed less than wall time by others on the machine. Medians.

    python benchmarks/startup.py                 both tables
    python benchmarks/startup.py --repeats 20    more processes
    python benchmarks/startup.py --write FOLDER  keep the tables for the documentation
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

import saltus as sl
from saltus.cli.doctor import processor
from saltus.flow import engine

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.record import Column, Record, Table, options_of

#: The demo with its picture, written to the working folder.
DEMO = (
    'import sys; sys.argv = ["saltus", "demo", "--out", "."]; from saltus.cli import main; main()'
)
BARE = 'import os; os.environ |= dict.fromkeys(("SALTUS_CACHE", "MPLCONFIGDIR"), os.getcwd()); '
MODEL = 'import saltus as sl; rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")'
#: Programs of the fresh processes.
PROGRAMS = {
    "python, nothing imported": "pass",
    "import numpy": "import numpy",
    "import xarray (which imports pandas)": "import xarray",
    "import saltus": "import saltus",
    "import saltus, a system": MODEL,
    "import saltus, a system, 20 periods of it": MODEL + "; sl.simulate(rig, start=(0.0, 0.0), "
    "periods=20, progress=False)",
    "saltus demo, to its picture": DEMO,
    "the same, first on a machine": BARE + DEMO,
}
PERIODS = (20, 100)
CALLS = 40
#: Columns kept for the documentation.
PROCESS_COLUMNS = (Column("process"), Column("CPU time [s]", ".2f"), Column("wall time [s]", ".2f"))
CALL_COLUMNS = (
    Column("call"), Column("CPU time [ms]", ".2f"), Column("of it the engine [ms]", ".2f"),
    Column("wall time [ms]", ".2f"),
)  # fmt: skip


def fresh(program: str) -> tuple[float, float]:
    """CPU time and wall time of a process in an empty folder, from its start to its end, other
    processes that it starts included [s].
    """
    environment = {
        name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"
    }
    before, begun = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(
            [sys.executable, "-c", program],
            env=environment,
            check=True,
            cwd=folder,
            stdout=subprocess.DEVNULL,
        )
        wall, after = time.perf_counter() - begun, resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall


def processes(repeats: int) -> list[tuple[str, float, float]]:
    """(name, CPU time [s], wall time [s]) of every program. They alternate, so that all see the
    same machine.
    """
    for program in PROGRAMS.values():
        fresh(program)  # compiles missing code, and fills the caches of files
    taken = {name: [] for name in PROGRAMS}
    for _ in range(repeats):
        for name, program in PROGRAMS.items():
            taken[name].append(fresh(program))
    return [
        (name, median(cpu for cpu, _ in times), median(wall for _, wall in times))
        for name, times in taken.items()
    ]


def calls(count: int) -> list[tuple[str, float, float, float]]:
    """(name, CPU time, CPU time in the engine, wall time [ms]) of a call with one start, once
    everything is warm.
    """
    rig, plain, inside = sl.models.delangre("b", force="4 N", frequency="15 Hz"), engine.run, [0.0]

    def timed(*args: object, **kwargs: object) -> object:
        begun = time.process_time()
        try:
            return plain(*args, **kwargs)  # type: ignore[arg-type]
        finally:
            inside[0] += time.process_time() - begun

    rows = []
    engine.run = timed  # type: ignore[assignment]
    try:
        for time_errors in ("measured", "local"):
            for periods in PERIODS:
                taken = []
                for _ in range(count + 3):
                    inside[0], cpu, wall = 0.0, time.process_time(), time.perf_counter()
                    sl.simulate(
                        rig,
                        start=(0.0, 0.0),
                        periods=periods,
                        time_errors=time_errors,
                        progress=False,
                    )
                    taken.append((time.process_time() - cpu, inside[0], time.perf_counter() - wall))
                medians = (1e3 * median(part) for part in zip(*taken[3:], strict=True))
                rows.append((f'{periods} periods, time_errors="{time_errors}"', *medians))
    finally:
        engine.run = plain
    return rows


def table(repeats: int, folder: Path | None = None) -> None:
    """Print both tables, and write them to a folder if one is given."""
    record = Record(
        "startup",
        f"Case b4 of the rig of de Langre et al. at 15 Hz, one start, 200 samples a period; "
        f"medians of {repeats} fresh processes and of "
        f"{CALLS} calls; machine code on disk.",
    )
    print(f"{processor()}; {repeats} processes each")
    record.tables.append(Table("From the shell", PROCESS_COLUMNS, processes(repeats)))
    record.tables.append(Table("One more call", CALL_COLUMNS, calls(CALLS)))
    for one in record.tables:
        print(f"\n{one.title}: {', '.join(column.heading for column in one.columns)}")
        for name, *numbers in one.rows:
            print(f"| {name:<42} | " + " | ".join(f"{number:7.2f}" for number in numbers) + " |")
    if folder is not None:
        print(f"kept in {record.write(folder)}")


if __name__ == "__main__":
    chosen = options_of("startup", __doc__, 9, "fresh processes of each kind").parse_args()
    table(chosen.repeats, chosen.write)
