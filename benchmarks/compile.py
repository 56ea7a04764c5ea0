"""Cost of a new equation: from its definition to the first state, in a fresh process, beside
heyoka.

Every row is a process of its own. It imports its program, then the clock runs: the equation is
written down, compiled and taken through one forcing period. What saltus prepares once on a machine,
for all equations, lies on disk; that cost stands in a table of its own. Nothing of the equation
does. heyoka's tangents have no jumps at contacts, saltus's have. CPU time counts all threads and
processes; medians.

    python benchmarks/compile.py                 both tables
    python benchmarks/compile.py --repeats 9     more processes
    python benchmarks/compile.py --write FOLDER  keep the tables for the documentation
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median

HERE = Path(__file__).resolve()
sys.path.insert(0, str(HERE.parent.parent))

#: Title and states of each row, by its name.
ROWS = {
    "rig": ("rig, two stops", 2), "gear_pair": ("gear pair", 2), "wing": ("wing with freeplay", 4),
    "chain": ("two masses, two clearances", 4),
    "masses_4": ("4 masses, 2 stops", 8), "masses_8": ("8 masses, 2 stops", 16),
    "masses_16": ("16 masses, 2 stops", 32),
    "rig_tangent": ("rig and its tangent", 6), "chain_tangent": ("two masses and their "
        "tangent", 20),
    "masses_4_tangent": ("4 masses and their tangent", 72), "masses_8_tangent": ("8 masses and "
        "their tangent", 272),
    "rig_ode45": ("rig, ode45", 2), "chain_ode45": ("two masses, ode45", 4),
}  # fmt: skip


def row_of_masses(masses: int, stops: int):
    """Masses in a row between springs: stops at one side, from the first mass on, then at the
    other.
    """
    import saltus as sl

    @sl.system(
        states=" ".join([f"x{i}" for i in range(masses)] + [f"v{i}" for i in range(masses)]),
        forced_at="f",
    )
    def masses_in_a_row(t, *y, k=50.0, c=0.1, stiffness=500.0, gap=0.1, f=1.0, force=2.0):
        x, v = y[:masses], y[masses:]
        rates = []
        for i in range(masses):
            left, right = (x[i - 1] if i else 0.0), (x[i + 1] if i + 1 < masses else 0.0)
            stop = (
                sl.piecewise((stiffness * (x[i] - gap), x[i] > gap), otherwise=0)
                if i < stops
                else 0
            )
            other = (
                sl.piecewise((stiffness * (x[i] + gap), x[i] < -gap), otherwise=0)
                if i + masses < stops
                else 0
            )
            drive = force * sl.cos(2 * sl.pi * f * t) if i == 0 else 0
            rates.append(-k * (x[i] - left) - k * (x[i] - right) - c * v[i] - stop - other + drive)
        return (*v, *rates)

    return masses_in_a_row


def ours(name: str) -> Callable[[], object]:
    """Take an equation from its definition to its first state, by saltus."""
    import numpy as np

    import saltus as sl
    from saltus.flow import engine
    from saltus.system.tangent import tangent_system

    sl.ODE45, sl.Taylor  # noqa: B018  (names load when they are touched)
    models = {
        "rig": sl.models.delangre,
        "gear_pair": sl.models.gear_pair,
        "wing": sl.models.aeroelastic,
        "chain": sl.models.chain,
    }
    base = name.removesuffix("_tangent").removesuffix("_ode45")

    def job() -> object:
        system = (
            models[base]()
            if base in models
            else row_of_masses(int(base.removeprefix("masses_")), 2)
        )
        system = tangent_system(system) if name.endswith("_tangent") else system
        method = sl.ODE45(1e-4, 1e-7) if name.endswith("_ode45") else sl.Taylor()
        start, values = (
            np.full((1, len(system.states)), 1e-3),
            np.array([list(system.values.values())]),
        )
        request = engine.Request.periods(start, values, system.period() or 1.0, 1)
        return engine.run(system, method, request, threads=1)

    return job


def heyokas(name: str) -> Callable[[], object] | None:
    """The same by heyoka, if the equation is easily written for it."""
    from benchmarks.rivals import heyoka_compile

    tangent, base = name.endswith("_tangent"), name.removesuffix("_tangent")
    if base == "rig" and not tangent:
        import numpy as np
        from benchmarks.rivals import heyoka_flow

        start = np.full(heyoka_compile.LANES, 1e-3)
        return lambda: heyoka_flow.Flow(heyoka_compile.LANES, 2.0**-52).run(start, start, 1)
    if base.startswith("masses_"):
        return lambda: heyoka_compile.first_state(
            *heyoka_compile.row_of_masses(int(base.removeprefix("masses_")), 2), tangent
        )
    return None


def cpu() -> float:
    """CPU time of this process and of its finished children [s]."""
    return sum(
        u.ru_utime + u.ru_stime
        for u in map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    )


def one(program: str, name: str) -> None:
    """Run the process of a row; it prints [CPU, wall] in seconds, or null."""
    job = (ours if program == "saltus" else heyokas)(name)
    if job is None:
        print("null")
        return
    before, begun = cpu(), time.perf_counter()
    job()
    print(json.dumps([cpu() - before, time.perf_counter() - begun]))


def measured(
    program: str, name: str, cache: Path, kept: Callable[[Path], bool] = lambda _: False
) -> tuple[float, float] | None:
    """(CPU, wall) of one fresh process; its additions to the cache are deleted again, except those
    to be kept.
    """
    cache.mkdir(mode=0o700, exist_ok=True)
    shared = {path.name for path in cache.iterdir()}
    empty = tempfile.mkdtemp(dir=cache.parent)  # heyoka keeps what it compiled, too
    environment = {**os.environ, "SALTUS_CACHE": str(cache), "HOME": empty, "XDG_CACHE_HOME": empty}
    command = [sys.executable, str(HERE), "--one", program, name]
    said = subprocess.run(
        command,
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        check=True,
    ).stdout
    for path in cache.iterdir():
        if path.name not in shared and not kept(path):
            path.unlink()
    numbers = json.loads(said.splitlines()[-1])
    return None if numbers is None else (numbers[0], numbers[1])


def prepared(cache: Path) -> list[tuple[str, float, float]]:
    """The work done once on a machine, by the method: (name, CPU, wall) beyond the time of the
    equation itself.
    """
    rows = []
    for title, name in (("Taylor", "rig"), ("ode45", "rig_ode45")):
        first, again = measured("saltus", name, cache, is_shared), measured("saltus", name, cache)
        assert first is not None
        assert again is not None
        rows.append(
            (
                f"{title} flow for this processor",
                max(first[0] - again[0], 0.0),
                max(first[1] - again[1], 0.0),
            )
        )
    return rows


def is_shared(path: Path) -> bool:
    """True if an entry of the cache serves all equations."""
    head = path.read_bytes()[:400]
    return b'"title": "taylor_' in head or b'"title": "pair, generic' in head


def table(repeats: int, folder: Path | None) -> None:
    """Print both tables, and write them to a folder if one is given."""
    from benchmarks.record import Column, Record, Table

    from saltus.cli.doctor import processor

    columns = (
        Column("equation"), Column("states"), Column("saltus, CPU [s]", ".2f"),
        Column("saltus, wall [s]", ".2f"),
        Column("heyoka, CPU [s]", ".2f"), Column("heyoka, wall [s]", ".2f"),
    )  # fmt: skip
    rivals = importlib.util.find_spec("heyoka") is not None
    record = Record(
        "compile",
        f"From the definition of an equation to its first state in a fresh "
        f"process, medians of {repeats}.",
    )
    if not rivals:
        record.left_out.append("heyoka isn't installed (pip install 'saltus[reference]')")
    print(f"{processor()}; {repeats} processes each")
    home = Path(tempfile.mkdtemp())
    try:
        cache = home / "kernels"
        once = prepared(cache)
        for name, cpu_time, wall in once:
            print(f"| once: {name:<36} | {cpu_time:6.2f} | {wall:6.2f} |")
        rows = []
        for name, (title, states) in ROWS.items():
            found = {
                program: [measured(program, name, cache) for _ in range(repeats)]
                for program in ("saltus", *(["heyoka"] * rivals))
            }
            numbers = [
                None if not times or times[0] is None else median(t[i] for t in times)  # type: ignore[index]
                for times in (found["saltus"], found.get("heyoka", [])) for i in (0, 1)
            ]  # fmt: skip
            rows.append((title, str(states), *numbers))
            print(
                f"| {title:<34} | {states:3} | "
                + " | ".join("      " if n is None else f"{n:6.2f}" for n in numbers)
                + " |",
                flush=True,
            )
    finally:
        shutil.rmtree(home, ignore_errors=True)
    record.tables.append(Table("A new equation", columns, rows))
    record.tables.append(
        Table(
            "Once on a machine",
            (Column("what"), Column("CPU [s]", ".1f"), Column("wall [s]", ".1f")),
            once,
        )
    )
    if folder is not None:
        print(f"kept in {record.write(folder)}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=3, help="fresh processes of each kind")
    parser.add_argument(
        "--write", type=Path, metavar="FOLDER", help="keep the tables there as compile.json"
    )
    parser.add_argument("--one", nargs=2, metavar=("PROGRAM", "NAME"), help=argparse.SUPPRESS)
    chosen = parser.parse_args()
    if chosen.one:
        one(*chosen.one)
    else:
        table(chosen.repeats, chosen.write)
