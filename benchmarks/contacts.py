"""Cost of a forcing period if several contacts share a system: saltus beside heyoka, same work,
same run.

Masses in a row with stops, and the chain of two masses with two clearances: from random starts,
every contact located. CPU time of one pinned core, medians over the repeats, the programs
alternating. The difference is that of the states after two periods, relative to the largest: both
programs follow the same motion.

    python benchmarks/contacts.py                 the table
    python benchmarks/contacts.py --repeats 15    more repeats
    python benchmarks/contacts.py --write FOLDER  keep the tables for the documentation
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

import saltus as sl
from saltus.cli.doctor import processor
from saltus.codegen.module import lane_width
from saltus.flow import engine

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from benchmarks.compile import row_of_masses  # noqa: E402
from benchmarks.record import Column, Record, Table, options_of  # noqa: E402
from benchmarks.rivals import rig  # noqa: E402

STARTS, PERIODS = 512, 10
#: Title, masses and stops of each row of masses; the chain comes first.
ROWS = ((1, 2), (2, 2), (2, 4), (4, 4), (4, 8))
COLUMNS = (
    Column("system"), Column("boundaries", ".0f"), Column("contacts a period", ".2f"),
    Column("saltus, CPU time of a forcing period [µs]", ".3g"),
    Column("heyoka [µs]", ".3g"), Column("times saltus", ".2f"), Column("largest difference after "
        "two periods", ".1e"),
)  # fmt: skip


def problems() -> list[tuple[str, sl.System, Any, np.ndarray]]:
    """(title, system, function that returns heyoka's problem, range of the starts) of each row."""
    chain = sl.models.chain()
    rows: list[tuple[str, sl.System, Any, np.ndarray]] = [
        (
            "two masses, two clearances",
            chain,
            lambda rival: rival.chain(dict(chain.values)),
            np.full(4, 1e-3),
        )
    ]
    for masses, stops in ROWS:
        title = f"{masses} mass{'es' if masses > 1 else ''} in a row, {stops} stops"
        scale = np.repeat([0.15, 1.0], masses)
        rows.append(
            (
                title,
                row_of_masses(masses, stops),
                lambda rival, size=(masses, stops): rival.row_of_masses(*size),
                scale,
            )
        )
    return rows


def ours(system: sl.System, start: np.ndarray, periods: int) -> engine.Outcome:
    """A run of all starts by the default method."""
    values = np.array([list(system.values.values())])
    request = engine.Request.periods(start, values, system.period(), periods)
    return engine.run(system, sl.Taylor(), request, threads=1)


def line(row: tuple[str | float | None, ...]) -> str:
    """A row of the table, as text."""
    cells = [
        f"{cell:{column.form}}" if column.form and cell is not None else str(cell)
        for cell, column in zip(row, COLUMNS, strict=True)
    ]
    return f"| {cells[0]:<28} | " + " | ".join(f"{cell:>8}" for cell in cells[1:]) + " |"


def main() -> None:
    """Print every row, and write the table if a folder is given."""
    options = options_of("contacts", __doc__, 9, "runs of each program").parse_args()
    rig.pin()
    try:
        from benchmarks.rivals import heyoka_stops as rival
    except ImportError:
        rival = None  # type: ignore[assignment]
    record = Record(
        "contacts",
        f"{STARTS} random starts, {PERIODS} periods; CPU time of one "
        f"pinned core, medians of {options.repeats}.",
    )
    if rival is None:
        record.left_out.append("heyoka isn't installed (pip install 'saltus[reference]')")
        print(f"{record.left_out[-1]}; left out", file=sys.stderr)
    print(f"{processor()}, one core; {STARTS} starts, {PERIODS} periods; {lane_width()} lanes")
    print(
        "| system                       | bounds   | contacts | saltus us| heyoka us| times    | "
        "differ   |"
    )
    kept: list[tuple[str | float | None, ...]] = []
    for title, system, problem, scale in problems():
        start = np.random.default_rng(5).uniform(-1.0, 1.0, (STARTS, len(system.states))) * scale
        rig.warm(system, sl.Taylor())
        jobs: list[Callable[[], object]] = [lambda s=system, at=start: ours(s, at, PERIODS)]
        difference = None
        if rival is not None:
            flow, period = rival.Flow(problem(rival), 1e-12), system.period()
            jobs.append(lambda flow=flow, at=start, end=PERIODS * period: flow.run(at, end))
            two, theirs = ours(system, start, 2).state, flow.run(start, 2 * period)
            difference = float(np.max(np.abs(two - theirs) / np.max(np.abs(theirs), axis=0)))
        contacts = float(ours(system, start, PERIODS).counters[:, engine.st.EVENTS].sum()) / (
            STARTS * PERIODS
        )
        us = [
            median(seconds) / (STARTS * PERIODS) * 1e6
            for seconds in rig.alternating(jobs, options.repeats)
        ]
        theirs_us = us[1] if rival is not None else None
        kept.append(
            (
                title,
                float(len(system.guards)),
                contacts,
                us[0],
                theirs_us,
                theirs_us and theirs_us / us[0],
                difference,
            )
        )
        print(line(kept[-1]), flush=True)
    if options.write is not None:
        record.tables.append(
            Table("One trajectory, one forcing period, several contacts", COLUMNS, kept)
        )
        print(f"kept in {record.write(options.write)}")


if __name__ == "__main__":
    main()
