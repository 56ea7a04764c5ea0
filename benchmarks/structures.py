"""Structures of many modes with stops: saltus beside heyoka and SciPy, same work, same run.

A cantilever of 30 beam elements (more for more than 60 modes) by its lowest modes, forced at its
tip at 1.1 of its first natural frequency, with soft stops on both sides of up to ten nodes. One
trajectory from rest; CPU time of one pinned core, a process for each cell. The programs follow the
same motion, which is chaotic: numbers of contacts in forty periods are given side by side. saltus
takes 200 samples a period and makes a Dataset of them; heyoka takes none, as saltus does in the
column "without samples". From the column "again" on saltus runs the code for this equation that it
compiles in the background beside the first seconds of work. heyoka has a callback in Python at each
contact, and its compact mode compiles in less time. SciPy takes two periods. A cell that isn't done
after LIMIT seconds says so. Then many trajectories from different starts, by one call. Then
frequency responses from rest, over a range of frequencies or at one at which the motion never
repeats, with what they found.

    python benchmarks/structures.py               the tables
    python benchmarks/structures.py 60 8          one row: 60 modes, 8 stops
    python benchmarks/structures.py responses     the last table
"""

from __future__ import annotations

import itertools
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))
sys.path.insert(0, str(HERE.parent / "src"))

import saltus as sl  # noqa: E402

GAP, STIFFNESS, FORCE, RATIO = 1e-3, 5e4, 2.0, 0.01
#: Nodes with stops, in the order in which they are taken.
NODES = (30, 15, 20, 25, 10, 28, 22, 18, 13, 7)
#: Modes and stops of each row.
ROWS = ((5, 1), (10, 1), (20, 1), (20, 2), (40, 1), (60, 1), (60, 2), (60, 8), (128, 10))
#: Modes, stops and trajectories of each batch.
BATCHES = ((20, 2, 256),)
#: Modes, stops, and frequencies of each response: first and last in units of the first natural
#: frequency, and how many.
RESPONSES = ((10, 2, (0.5, 12.0, 41)), (40, 1, (0.5, 12.0, 41)), (10, 8, (1.1, 1.1, 1)))
#: CPU time that a program has for its cells, compiling included [s], and how many they are.
LIMIT = 300
CELLS = {"saltus": 5, "heyoka": 2, "compact": 2, "scipy": 1}
PERIODS = 40
#: Periods that SciPy takes: each costs the same, and 40 of them minutes.
FEW_PERIODS = 2
#: CPU time after which saltus surely compiles its steady code [s]: 2 s of it in the kernel.
WORKED = 6.0
#: CPU time that a short work is repeated for [s]: under LIMIT the clock of a process counts in
#: steps of 4 ms.
REPEATED = 0.5


def elements_for(modes: int) -> int:
    """Elements of a beam that has so many modes: all nodes stay where they are."""
    return 30 * -(-modes // 60)


def beam(elements: int) -> tuple[np.ndarray, np.ndarray]:
    """Mass and stiffness of a cantilever of steel, 1 m by 20 mm by 5 mm: Euler-Bernoulli."""
    length, area, inertia = 1.0 / elements, 1e-4, 0.02 * 0.005**3 / 12
    a, m = 2.1e11 * inertia / length**3, 7850.0 * area * length / 420
    b = length
    stiff = a * np.array(
        [[12, 6 * b, -12, 6 * b], [6 * b, 4 * b * b, -6 * b, 2 * b * b],
         [-12, -6 * b, 12, -6 * b], [6 * b, 2 * b * b, -6 * b, 4 * b * b]]
    )  # fmt: skip
    heavy = m * np.array(
        [[156, 22 * b, 54, -13 * b], [22 * b, 4 * b * b, 13 * b, -3 * b * b],
         [54, 13 * b, 156, -22 * b], [-13 * b, -3 * b * b, -22 * b, 4 * b * b]]
    )  # fmt: skip
    mass, stiffness = np.zeros((2, 2 * elements + 2, 2 * elements + 2))
    for e in range(elements):
        own = slice(2 * e, 2 * e + 4)
        mass[own, own] += heavy
        stiffness[own, own] += stiff
    return mass[2:, 2:], stiffness[2:, 2:]


def structure(modes: int, stops: int, **more: Any) -> sl.System:
    """The beam with stops, and what else :func:`saltus.structure` takes: no sensors, unless they
    are given, since nobody else here has any.
    """
    mass, stiffness = beam(elements_for(modes))
    fine = len(mass) // 60
    names = [f"{kind}{(i // 2 + 1) / fine:g}" for i, kind in enumerate("wr" * (len(mass) // 2))]
    first = sl.structure_modes(mass, stiffness, 1).frequency.values[0]
    contacts = [
        sl.Contact(f"w{node}", STIFFNESS, GAP, side="both", name=f"stop_{node}")
        for node in NODES[:stops]
    ]
    return sl.structure(
        mass, stiffness, names=names, modes=modes, damping_ratio=RATIO, contacts=contacts,
        forces=[sl.Force("w30", FORCE)], frequency=1.1 * first, **{"sensors": {}, **more},
    )  # fmt: skip


def matrices(modes: int, stops: int) -> tuple[np.ndarray, ...]:
    """Squares, damping, shapes at the stops and loads of the modes."""
    mass, stiffness = beam(elements_for(modes))
    found = sl.structure_modes(mass, stiffness, modes)
    shapes = found.shape.transpose("mode", "degree").values
    omega = 2 * np.pi * found.frequency.values
    fine = len(mass) // 60
    at = np.array([2 * fine * node - 2 for node in NODES[:stops]])
    return omega**2, 2 * RATIO * omega, shapes[:, at].T, FORCE * shapes[:, 60 * fine - 2]


def seconds(work: Callable[[], object], least: float = 0.0) -> float:
    """CPU time of a call [s]: the mean of as many as take ``least`` seconds."""
    begun, calls = time.process_time(), 0
    while not calls or time.process_time() - begun < least:
        work()
        calls += 1
    return (time.process_time() - begun) / calls


def settle(work: Callable[[], object]) -> None:
    """Work until the steady code has been compiled and taken up."""
    seconds(work, WORKED)
    for thread in threading.enumerate():
        if thread.name.startswith("kernels: "):
            thread.join()


def by_saltus(modes: int, stops: int) -> tuple[str, int]:
    """First result, time of a period with contact states that are new, with known ones, and without
    samples, memory, as cells; contacts.
    """
    runs: list = []

    def first() -> None:
        system = structure(modes, stops)
        runs.append(system)
        sl.simulate(system, periods=1, progress=False, threads=1, time_errors="local")

    beginning = seconds(first)
    kw = {"progress": False, "threads": 1, "time_errors": "local"}
    each = seconds(lambda: runs.append(sl.simulate(runs[0], periods=PERIODS, **kw)))
    settle(lambda: sl.simulate(runs[0], periods=PERIODS, **kw))
    again = seconds(lambda: sl.simulate(runs[0], periods=PERIODS, **kw), REPEATED)
    rest, kw = np.zeros(2 * modes), {"keep": 1, "progress": False, "threads": 1}
    alone = seconds(lambda: sl.stroboscope(runs[0], rest, 10 * PERIODS, **kw), REPEATED) / 10
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    periods = (f"{1e3 * each / PERIODS:.2f}" for each in (each, again, alone))
    return f"{beginning:.2f} | {' | '.join(periods)} | {memory:.0f}", int(runs[1].sizes["contact"])


def by_batch(modes: int, stops: int, count: int) -> str:
    """Time of a period of each of many trajectories, and of the first one alone, as cells [ms]."""
    system, kw = structure(modes, stops), {"keep": 1, "progress": False, "threads": 1}
    starts = np.random.default_rng(1).normal(0, 1e-4, (count, 2 * modes))
    settle(lambda: sl.stroboscope(system, starts[0], PERIODS, **kw))
    cells = []
    for some in (starts, starts[0]):
        each = seconds(lambda: sl.stroboscope(system, some, PERIODS, **kw), REPEATED)  # noqa: B023
        cells.append(f"{1e3 * each / PERIODS / (some.size / (2 * modes)):.3f}")
    return " | ".join(cells)


def by_heyoka(modes: int, stops: int, compact: bool) -> tuple[str, int]:
    """Time of compiling and of a period, as cells; contacts."""
    from benchmarks.rivals.heyoka_structures import Trajectory

    omega2, damping, shapes, push = matrices(modes, stops)
    rate, made = 2 * np.pi * float(structure(1, 0).values["frequency"]), []
    compiled = seconds(
        lambda: made.append(
            Trajectory(omega2, damping, shapes, push, GAP, STIFFNESS, rate, compact)
        )
    )
    runs = itertools.count(1)
    each = seconds(lambda: made[0].run(next(runs) * PERIODS * 2 * np.pi / rate), REPEATED)
    contacts = round(made[0].contacts / (next(runs) - 1))
    return f"{compiled:.1f} | {1e3 * each / PERIODS:.2f}", contacts


def by_scipy(modes: int, stops: int) -> tuple[str, int]:
    """Time of a period, as a cell: DOP853 at rtol = 1e-10, contacts not located or counted."""
    omega2, damping, shapes, push = matrices(modes, stops)
    rate = 2 * np.pi * float(structure(1, 0).values["frequency"])

    def rates(t: float, y: np.ndarray) -> np.ndarray:
        q, v = y[:modes], y[modes:]
        d = shapes @ q
        force = STIFFNESS * (np.maximum(d - GAP, 0.0) + np.minimum(d + GAP, 0.0))
        return np.append(v, push * np.cos(rate * t) - omega2 * q - damping * v - shapes.T @ force)

    end = FEW_PERIODS * 2 * np.pi / rate
    each = seconds(
        lambda: solve_ivp(rates, (0, end), np.zeros(2 * modes), "DOP853", rtol=1e-10, atol=1e-14)
    )
    return f"{1e3 * each / FEW_PERIODS:.1f}", 0


def measured(program: str, modes: int, stops: int) -> tuple[str, str]:
    """Cells and contacts of a program, found by a process of its own."""
    command = [sys.executable, __file__, program, str(modes), str(stops)]
    try:
        done = subprocess.run(command, stdout=subprocess.PIPE, text=True, check=True)
    except subprocess.CalledProcessError as failure:
        why = f"> {LIMIT} s" if failure.returncode == -signal.SIGXCPU else "failed"
        return " | ".join([why, *["-"] * (CELLS[program] - 1)]), "-"
    cells, contacts = done.stdout.strip().splitlines()[-1].split(";")
    return cells, contacts


def by_response(modes: int, stops: int, band: tuple[float, float, int]) -> str:
    """Time of a frequency response and of each frequency, and what it found, as cells."""
    system, made = structure(modes, stops), []
    first = float(structure(1, 0).values["frequency"]) / 1.1
    frequencies = first * np.linspace(*band)
    kw = {"progress": False, "threads": 1}
    sl.frequency_response(system, [20.0 * first], **kw)  # compiles
    each = seconds(lambda: made.append(sl.frequency_response(system, frequencies, **kw)))
    kinds, counts = np.unique(made[0].type.values, return_counts=True)
    found = ", ".join(f"{count} {kind}" for kind, count in zip(kinds, counts, strict=True))
    events = made[0].sizes.get("event", 0)
    return f"{each:.1f} | {each / len(frequencies):.2f} | {found} | {events}"


def row(modes: int, stops: int) -> str:
    """One row of the table."""
    found = {program: measured(program, modes, stops) for program in CELLS}
    contacts = f"{found['saltus'][1]} / {found['compact'][1]}"
    return f"| {modes} | {stops} | {contacts} | {' | '.join(one for one, _ in found.values())} |"


def one_cell(program: str, modes: int, stops: int) -> None:
    """Print what :func:`measured` reads, within LIMIT."""
    resource.setrlimit(resource.RLIMIT_CPU, (LIMIT, LIMIT + 10))
    match program:
        case "saltus":
            cells, contacts = by_saltus(modes, stops)
        case "scipy":
            cells, contacts = by_scipy(modes, stops)
        case _:
            cells, contacts = by_heyoka(modes, stops, program == "compact")
    print(cells, contacts, sep=";")


def responses() -> None:
    """Print the table of frequency responses."""
    print("| modes | stops | f/f1 | CPU [s] | of each frequency [s] | motions | events |\n" +
          "|" + "---|" * 7, flush=True)  # fmt: skip
    for modes, stops, band in RESPONSES:
        cells = by_response(modes, stops, band)
        print(f"| {modes} | {stops} | {band[0]:g} to {band[1]:g} | {cells} |", flush=True)


def main(arguments: list[str]) -> None:
    """Print the tables."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    if arguments and arguments[0] in CELLS:
        return one_cell(arguments[0], *map(int, arguments[1:]))
    if arguments == ["responses"]:
        return responses()
    if arguments and not (len(arguments) == 2 and all(one.isdigit() for one in arguments)):
        sys.exit(__doc__)
    rows = [(int(arguments[0]), int(arguments[1]))] if arguments else ROWS
    print("| modes | stops | contacts saltus / heyoka | saltus: first result [s] | a period [ms] | "
          "again [ms] | without samples [ms] | memory [MB] | heyoka: compile [s] | a period [ms] | "
          "compact: compile [s] | a period [ms] | SciPy: a period [ms] |")  # fmt: skip
    print("|" + "---|" * 13, flush=True)
    for modes, stops in rows:
        print(row(modes, stops), flush=True)
    if not arguments:
        print("\n| modes | stops | trajectories | a period of each [ms] | "
              "one alone [ms] |\n" + "|" + "---|" * 5, flush=True)  # fmt: skip
        for batch in BATCHES:
            print(f"| {' | '.join(map(str, batch))} | {by_batch(*batch)} |", flush=True)
        print()
        responses()
    return None


if __name__ == "__main__":
    main(sys.argv[1:])
