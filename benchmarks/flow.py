"""Cost and error of one forcing period of one trajectory: saltus beside its rivals, same work, same
run.

Case b4 of the deLangre rig at 15 Hz, starts x in [-5, 5] mm, v in [-1, 1] m/s, contacts located.
CPU time of one pinned core, the smallest of three repeats, over 100 periods from 2048 starts
(SciPy: a few starts, its cost per trajectory is the same). Errors are of |x| after 5 periods from
the 64 grid starts of tests/reference/rig_b4_15hz_5periods.csv, known to 30 digits.

    python benchmarks/flow.py                 the table of the README
    python benchmarks/flow.py --orders        cost and error by order and tolerance of the series
    python benchmarks/flow.py --memory        memory of a stroboscope run from 1e6 starts
    python benchmarks/flow.py --write FOLDER  keep the tables for the documentation
"""

from __future__ import annotations

import argparse
import csv
import resource
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import saltus as sl
from saltus.cli.doctor import processor
from saltus.codegen.module import lane_width

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from benchmarks.record import Column, Record, Table  # noqa: E402
from benchmarks.rivals import rig  # noqa: E402

PERIODS = 100
#: Columns kept for the documentation.
COLUMNS = (
    Column("program"), Column("median error after 5 periods [m]", ".1e"),
    Column("largest error [m]", ".1e"),
    Column("CPU time of a forcing period [µs]", ".3g"), Column("times saltus", ".3g"),
    Column("contacts a period", ".3f"),
)  # fmt: skip


def reference() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Grid starts (x, v) [m, m/s] and x [m] after 5 periods, exact."""
    with open(HERE.parent / "tests/reference/rig_b4_15hz_5periods.csv") as file:
        rows = [row for row in csv.DictReader(file) if row["start"] == "grid"]
    return tuple(
        np.array([float(row[name]) for row in rows]) for name in ("x0_m", "v0_m_per_s", "x_end_m")
    )  # type: ignore[return-value]


def ours(
    method: sl.Taylor | sl.ODE45, x: np.ndarray, v: np.ndarray
) -> tuple[float, np.ndarray, float]:
    """Microseconds per period and trajectory, errors [m] after 5 periods, contacts per period."""
    system = sl.models.delangre("b", force="4 N", frequency="15 Hz")

    def job() -> object:
        return sl.stroboscope(
            system, {"x": x, "v": v}, PERIODS, keep=1, method=method, threads=1, progress=False
        )

    rig.warm(system, method)
    events = float(job().events.sum()) / (len(x) * PERIODS)  # type: ignore[attr-defined]
    seconds = rig.cpu_seconds(job)
    x0, v0, exact = reference()
    end = sl.stroboscope(system, {"x": x0, "v": v0}, 5, keep=1, method=method, threads=1).x.values[
        :, -1
    ]
    return seconds / (len(x) * PERIODS) * 1e6, np.abs(end - exact), events


def line(name: str, us: float, errors: np.ndarray, contacts: float, fastest: float) -> str:
    """One row of the table."""
    return (
        f"| {name:<42} | {np.median(errors):9.1e} | {errors.max():9.1e} | {us:10.3f} | "
        f"{us / fastest:9.1f} | {contacts:8.3f} |"
    )


def rows(count: int, left_out: list[str]) -> Iterator[tuple[str, float, np.ndarray, float]]:
    """(name, microseconds per period, errors, contacts per period) of every program; missing ones
    are noted in ``left_out``.
    """
    x, v = rig.starts(count)
    for method in (
        sl.Taylor(tolerance=2.0**-46),
        sl.Taylor(),
        sl.ODE45(1e-4, 1e-7),
        sl.ODE45(1e-4, 1e-7, events="ignore"),
    ):
        title = f"saltus {method.name} " + (
            f"2^{np.log2(method.tolerance):.0f}"
            if isinstance(method, sl.Taylor)
            else f"(1e-4, 1e-7) {method.events}"
        )
        yield (title, *ours(method, x, v))
    x0, v0, exact = reference()
    try:
        from benchmarks.rivals import heyoka_flow
    except ImportError:
        left_out.append("heyoka isn't installed (pip install 'saltus[reference]')")
        print(f"{left_out[-1]}; left out", file=sys.stderr)
    else:
        timed = heyoka_flow.measure(x, v, periods=PERIODS, tolerance=1e-12)
        exactness = heyoka_flow.measure(x0, v0, periods=5, tolerance=1e-12)
        yield (
            "heyoka batch of 8, 1e-12",
            timed.us_per_period,
            np.abs(exactness.end[:, 0] - exact),
            timed.contacts_per_period,
        )
    from benchmarks.rivals import scipy_flow

    few = scipy_flow.measure(x0[:4], v0[:4], periods=5, rtol=1e-12, atol=1e-12, repeats=1)
    yield (
        "scipy DOP853, 1e-12 (4 starts, 5 periods)",
        few.us_per_period,
        np.abs(few.end[:, 0] - exact[:4]),
        few.contacts_per_period,
    )


def table(count: int, folder: Path | None = None) -> None:
    """Print every row, and write them to a folder if one is given."""
    record = Record(
        "flow",
        f"Case b4 of the rig of de Langre et al. at 15 Hz, contacts located; {count} starts, "
        f"{PERIODS} periods (SciPy: 4 starts, "
        "5 periods); CPU time of one pinned core, smallest of three repeats; errors at 64 starts "
        "known to 30 digits.",
    )
    print(f"{processor()}, one core; {count} starts, {PERIODS} periods; {lane_width()} lanes")
    print(f"| {'':<42} | median m  | largest m | us/period  | times     | contacts |")
    print(f"|{'-' * 44}|----------:|----------:|-----------:|----------:|---------:|")
    fastest, kept = None, []
    for name, us, errors, contacts in rows(count, record.left_out):
        fastest = fastest or us
        print(line(name, us, errors, contacts, fastest), flush=True)
        kept.append(
            (name, float(np.median(errors)), float(errors.max()), us, us / fastest, contacts)
        )
    if folder is not None:
        record.tables.append(Table("One trajectory, one forcing period", COLUMNS, kept))
        print(f"kept in {record.write(folder)}")


def orders(count: int) -> None:
    """Print cost and error by order and tolerance."""
    x, v = rig.starts(count)
    for order in (14, 16, 18, 20, 22, 24):
        for exponent in (-44, -46, -48, -52):
            us, errors, _ = ours(sl.Taylor(order, tolerance=2.0**exponent), x, v)
            print(
                f"order {order:2d}  2^{exponent}  {us:6.3f} us  median {np.median(errors):.1e} m  "
                f"largest {errors.max():.1e} m",
                flush=True,
            )


def memory() -> None:
    """Print the memory of a stroboscope run from a million starts."""
    x, v = rig.starts(1_000_000)
    system = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    sl.stroboscope(system, (0.0, 0.0), 1)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    sl.stroboscope(system, {"x": x, "v": v}, 10, keep=1)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print(
        f"1e6 starts, 10 periods: {peak / 2**20:.2f} GB at the peak, of which "
        f"{before / 2**20:.2f} GB Python and libraries"
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--starts", type=int, default=2048, help="number of starts (a multiple of 8)"
    )
    parser.add_argument(
        "--orders", action="store_true", help="cost and error by order and tolerance"
    )
    parser.add_argument("--memory", action="store_true", help="memory of a run from 1e6 starts")
    parser.add_argument(
        "--write", type=Path, metavar="FOLDER", help="keep the table there as flow.json"
    )
    chosen = parser.parse_args()
    if chosen.memory:
        memory()
    else:
        rig.pin()
        orders(chosen.starts) if chosen.orders else table(chosen.starts, chosen.write)
