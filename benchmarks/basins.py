"""Cost of a map of basins, and trust in its labels: saltus beside its rivals, same cells, same run.

Case b4 of the deLangre rig at 15 Hz, starts x in [-5, 5] mm, v in [-1, 1] m/s. Everything is
compiled before the clock starts. Rivals are on one pinned core; too slow for every cell, they label
a random subset, and their time is scaled to the whole map. Finding the attractors is part of our
time (about two seconds, however large the map: small maps say little); rivals are handed the orbits
to compare with. Cells that start on a boundary (of maps with an odd number of cells) are left out
of the subset: heyoka hangs there. Ratios are of CPU time, which other users of the machine disturb
less.

A rival can't be held to labels that rounding decides: this system stays on a chaotic saddle for
hundreds of periods from many a start. So saltus and heyoka are also compared with themselves at
another tolerance (the floor), and with each other where neither changes its mind.

    python benchmarks/basins.py                 200 x 200 cells
    python benchmarks/basins.py --cells 60      smaller (or larger)
    python benchmarks/basins.py --alone         saltus only
    python benchmarks/basins.py --write FOLDER  keep the tables for the documentation
"""

from __future__ import annotations

import itertools
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr

import saltus as sl
from saltus.cli.doctor import processor
from saltus.codegen.module import lane_width

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from benchmarks.record import Column, Record, Table, options_of
from benchmarks.rivals import rig

#: Periods that rivals let a trajectory settle, and those they compare: all but about 5 of 2000
#: cells follow an orbit then.
PERIODS, KEEP = 600, 48
#: Periods between two tests of the loop that stops early: the whole map takes 26 s with 12, 30 s
#: with 24, 35 s with 48. With 3, also 26 s, one in 60 of the cells that settle in 50 to 100 periods
#: counts as settled while it only passes an orbit.
LOOK = 12
#: heyoka's tolerances: that of benchmarks/flow.py, and its own default.
TOLERANCE, OTHER_TOLERANCE = 1e-12, 2.0**-52
#: Borders of the groups of cells by periods to settle, in the second table.
SETTLING = (0, 50, 100, 150, 200, 300, 10_000)
#: Columns kept for the documentation.
COLUMNS = (
    Column("program"), Column("CPU time of the map [s]", ".1f"), Column("wall time [s]", ".1f"),
    Column("CPU, times saltus", ".3g"),
    Column("same label as saltus", ".1%"), Column("cells timed", "d"),
)  # fmt: skip
FLOOR_COLUMNS = (Column("programs"), Column("same label", ".1%"), Column("cells", "d"))


@dataclass(frozen=True)
class Seconds:
    """CPU time and wall time of a job [s]."""

    cpu: float
    wall: float

    def scaled(self, factor: float) -> Seconds:
        """The times multiplied by a factor."""
        return Seconds(self.cpu * factor, self.wall * factor)


@dataclass(frozen=True)
class Rival:
    """The time of a rival for the whole map (scaled), and its labels int64[k] of the cells of the
    subset.
    """

    name: str
    seconds: Seconds
    labels: np.ndarray
    cells: int


@dataclass(frozen=True)
class Subset:
    """Random cells of a map: their indices in the flattened map, their starts [m], [m/s], and our
    labels and periods to settle.
    """

    cells: np.ndarray
    x: np.ndarray
    v: np.ndarray
    labels: np.ndarray
    settling: np.ndarray

    def first(self, count: int) -> Subset:
        """The first cells of the subset, as random as all."""
        return Subset(
            *(getattr(self, name)[:count] for name in ("cells", "x", "v", "labels", "settling"))
        )


# -- clock -----------------------------------------------------------------------------------------
def timed(job: Callable[[], object], repeats: int = 1) -> tuple[Seconds, object]:
    """Smallest times of a job over some repeats, and its result."""
    taken = []
    for _ in range(repeats):
        cpu, wall = time.process_time(), time.perf_counter()
        result = job()
        taken.append((time.process_time() - cpu, time.perf_counter() - wall))
    return Seconds(*np.min(taken, axis=0).tolist()), result


# -- ours ------------------------------------------------------------------------------------------
def ours(
    cells: int, threads: int, *, method: sl.Taylor | None = None, repeats: int = 1
) -> tuple[Seconds, xr.Dataset]:
    """Times and map of saltus."""
    system = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    axes = {"x": ("-5 mm", "5 mm", cells), "v": ("-1 m/s", "1 m/s", cells)}
    return timed(
        lambda: sl.basins(system, **axes, method=method, threads=threads, progress=False), repeats
    )  # type: ignore[return-value]


def orbits_of(ds: xr.Dataset) -> list[np.ndarray]:
    """Stroboscopic points of the attractors [m], [m/s], float64[n, 2] each; one that never repeats
    has a point at infinity.
    """
    points = np.stack([ds.attractor_x.values, ds.attractor_v.values], axis=-1)
    return [
        row[:n] if n else np.full((1, 2), np.inf)
        for row, n in zip(points, ds.attractor_period.values, strict=True)
    ]


def subset_of(ds: xr.Dataset, count: int, seed: int = 15) -> Subset:
    """Random cells, none of which starts on a boundary."""
    x, v = (grid.ravel() for grid in np.meshgrid(ds.x.values, ds.v.values, indexing="ij"))
    allowed = np.flatnonzero((x != -rig.LOWER_GAP) & (x != rig.UPPER_GAP))
    cells = np.random.default_rng(seed).permutation(allowed)[:count]
    return Subset(
        cells,
        x[cells],
        v[cells],
        ds.basin.values.ravel()[cells],
        ds.periods_to_settle.values.ravel()[cells],
    )


# -- rivals ----------------------------------------------------------------------------------------
def absent(left_out: list[str], what: str) -> None:
    """Print, and note, that a rival isn't installed."""
    left_out.append(what)
    print(f"{what}; left out", file=sys.stderr)


def heyoka(
    subset: Subset, orbits: Sequence[np.ndarray], whole: int, left_out: list[str]
) -> Iterator[Rival]:
    """heyoka at two tolerances, and with a loop that stops early; nothing if it isn't installed."""
    try:
        from benchmarks.rivals import heyoka_basins
    except ImportError:
        absent(left_out, "heyoka isn't installed (pip install 'saltus[reference]')")
        return
    plain, early = heyoka_basins.labels, heyoka_basins.labels_early
    for name, tolerance, labels, periods in (
        (f"heyoka, {PERIODS + KEEP} periods", TOLERANCE, plain, (PERIODS, KEEP)),
        (f"heyoka, {PERIODS + KEEP} periods, 2^-52", OTHER_TOLERANCE, plain, (PERIODS, KEEP)),
        (f"heyoka, looks every {LOOK} periods", TOLERANCE, early, (PERIODS + KEEP, LOOK)),
    ):
        job = partial(labels, heyoka_basins.flow(tolerance), subset.x, subset.v, orbits, *periods)
        seconds, found = timed(job)
        yield Rival(name, seconds.scaled(whole / subset.cells.size), found, subset.cells.size)  # type: ignore[arg-type]


def pynamicalsys(
    subset: Subset, orbits: Sequence[np.ndarray], whole: int, left_out: list[str]
) -> Iterator[Rival]:
    """pynamicalsys; nothing if it isn't installed."""
    try:
        from benchmarks.rivals import pynamicalsys_basins
    except ImportError:
        absent(left_out, "pynamicalsys isn't installed (pip install pynamicalsys)")
        return
    program = pynamicalsys_basins.Rig()
    seconds, clusters = timed(lambda: program.clusters(subset.x, subset.v, PERIODS + KEEP))
    labels = program.named(clusters, subset.x, subset.v, orbits, PERIODS + KEEP)  # type: ignore[arg-type]
    name = f"pynamicalsys, RK4 T/{pynamicalsys_basins.STEPS}, no events"
    yield Rival(name, seconds.scaled(whole / subset.cells.size), labels, subset.cells.size)


# -- print -----------------------------------------------------------------------------------------
def equal(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """True where two programs name the same attractor."""
    return (a == b) & (a >= 0)


def percent(hits: np.ndarray) -> str:
    """Share of hits among the cells, and their number."""
    return f"{100 * hits.mean():.1f} % of {hits.size}" if hits.size else "no cells"


def line(name: str, seconds: Seconds, unit: Seconds, same: str, cells: str) -> str:
    """One row of the first table."""
    return (
        f"| {name:<36} | {seconds.cpu:9.1f} | {seconds.wall:9.1f} | "
        f"{seconds.cpu / unit.cpu:8.1f} | {same:>17} | {cells:<14} |"
    )


def heading(cells: int) -> None:
    """Print what is computed, and the head of the first table."""
    print(
        f"{processor()}; {cells} x {cells} cells; {lane_width()} lanes; times [s] are those of "
        f"the whole map"
    )
    print(f"| {'':<36} | CPU       | wall      | CPU, rel.| same label        | timed on       |")
    print(f"|{'-' * 38}|----------:|----------:|---------:|------------------:|----------------|")


def by_settling(subset: Subset, pairs: dict[str, np.ndarray]) -> Table:
    """Print the share of equal labels by our periods to settle: differences are decided after many
    periods on a chaotic saddle.
    """
    print("\nsame label [%] by how many periods a cell takes to settle:")
    print(
        f"| {'periods':<42} |"
        + "".join(
            f" {f'< {high}' if high < SETTLING[-1] else 'more':>6} |" for high in SETTLING[1:]
        )
    )
    print(f"|{'-' * 44}|" + "-------:|" * (len(SETTLING) - 1))
    shares = {name: _shares(subset.settling[: same.size], same) for name, same in pairs.items()}
    for name, row in shares.items():
        print(
            f"| {name:<42} |"
            + "".join(f" {'' if share is None else f'{100 * share:.1f}':>6} |" for share in row)
        )
    counts = np.histogram(subset.settling, SETTLING)[0]
    print(f"| {'cells':<42} |" + "".join(f" {count:6d} |" for count in counts))
    columns = [
        Column("periods to settle"),
        *(Column(f"< {high}" if high < SETTLING[-1] else "more", ".0%") for high in SETTLING[1:]),
    ]
    return Table(
        "Same label, by how long a cell takes to settle",
        columns,
        [(name, *row) for name, row in shares.items()],
    )


def _shares(settling: np.ndarray, same: np.ndarray) -> list[float | None]:
    """Share of equal labels in each group of cells by their periods to settle; None for an empty
    one.
    """
    groups = [
        same[(settling >= low) & (settling < high)] for low, high in itertools.pairwise(SETTLING)
    ]
    return [float(group.mean()) if group.size else None for group in groups]


def reasons(subset: Subset, other: np.ndarray, first: Rival, second: Rival) -> np.ndarray:
    """Print the reasons of the cells that saltus and heyoka label differently; return True where
    they agree among the steady ones.
    """
    same, lost = equal(subset.labels, first.labels), first.labels < 0
    our_own, their_own = equal(subset.labels, other), equal(first.labels, second.labels)
    differs = subset.settling[~same]
    print(f"\n{(~same).sum()} of {same.size} cells have another label in heyoka. Of these")
    print(
        f"  {(~same & lost).sum():5d}  aren't on any orbit after heyoka's {PERIODS + KEEP} periods"
    )
    print(
        f"  {(~same & ~lost & ~our_own).sum():5d}  change their label in saltus too, at "
        f"tolerance 2^-52"
    )
    print(
        f"  {(~same & ~lost & our_own & ~their_own).sum():5d}  change it in heyoka, at tolerance "
        f"2^-52"
    )
    print(
        f"  {(~same & ~lost & our_own & their_own).sum():5d}  change it in neither: each may "
        f"have met one attractor twice by chance"
    )
    if differs.size:
        print(
            f"Periods to settle where labels differ: {differs.min()} at least, median "
            f"{np.median(differs):.0f}; elsewhere median"
            f" {np.median(subset.settling[same]):.0f}"
        )
    print(
        f"Cells that change in neither: saltus and heyoka name the same attractor on "
        f"{percent(same[our_own & their_own])}"
    )
    return same[our_own & their_own]


def rows(
    make: Callable[..., Iterator[Rival]],
    subset: Subset,
    ds: xr.Dataset,
    unit: Seconds,
    left_out: list[str],
) -> list[Rival]:
    """Run and print one program's rows; none if it isn't installed."""
    rivals = []
    for rival in make(subset, orbits_of(ds), ds.basin.size, left_out):
        rivals.append(rival)
        same = equal(subset.labels, rival.labels)
        print(
            line(rival.name, rival.seconds, unit, percent(same), f"{rival.cells}, scaled"),
            flush=True,
        )
    return rivals


def kept_row(
    name: str, seconds: Seconds, unit: Seconds, same: float | None, cells: int
) -> tuple[str | float | None, ...]:
    """One row of the kept table."""
    return name, seconds.cpu, seconds.wall, seconds.cpu / unit.cpu, same, cells


def beside(
    ds: xr.Dataset, unit: Seconds, subset: Subset, few: int, left_out: list[str]
) -> tuple[list[tuple], list[Table]]:
    """Print the rivals' rows, the floors, and the reasons of different labels; return those rows,
    and the other tables to be kept.
    """
    with rig.one_core():
        taylor = rows(heyoka, subset, ds, unit, left_out)
        rivals = taylor + rows(pynamicalsys, subset.first(few), ds, unit, left_out)
        _, again = ours(len(ds.x), 1, method=sl.Taylor(tolerance=OTHER_TOLERANCE))
    other = sl.compare(ds, again)["basin_b"].values.ravel()
    floor = equal(ds.basin.values.ravel(), other)
    pairs = {"saltus, saltus at 2^-52": floor[subset.cells]}
    print("\nThe floor: programs beside themselves at tolerance 2^-52 name the same attractor on")
    print(f"  saltus {percent(floor)} (all cells), {percent(floor[subset.cells])} (the subset)")
    steady = {}
    if taylor:
        pairs["heyoka, heyoka at 2^-52"] = equal(taylor[0].labels, taylor[1].labels)
        print(f"  heyoka {percent(pairs['heyoka, heyoka at 2^-52'])}")
        steady = {
            "saltus, heyoka, where neither changes at 2^-52": reasons(
                subset, other[subset.cells], *taylor[:2]
            )
        }
    agreeing = {rival.name: equal(subset.labels[: rival.cells], rival.labels) for rival in rivals}
    kept = [
        kept_row(rival.name, rival.seconds, unit, float(agreeing[rival.name].mean()), rival.cells)
        for rival in rivals
    ]
    floors = [
        (name, float(same.mean()), int(same.size))
        for name, same in (pairs | steady).items()
        if same.size
    ]
    settling = by_settling(
        subset, pairs | {f"saltus, {name}": same for name, same in agreeing.items()}
    )
    return kept, [
        Table("The floor: programs beside themselves at another tolerance", FLOOR_COLUMNS, floors),
        settling,
    ]


def main(argv: Sequence[str] | None = None) -> None:
    """The command line."""
    parser = options_of("basins", __doc__, 3, "runs of ours, of which the fastest counts")
    parser.add_argument("--cells", type=int, default=200, help="cells along each axis")
    parser.add_argument("--subset", type=int, default=2000, help="cells that heyoka labels")
    parser.add_argument("--few", type=int, default=400, help="cells that pynamicalsys labels")
    parser.add_argument("--alone", action="store_true", help="saltus only")
    chosen = parser.parse_args(argv)
    ours(6, 1)  # compiles
    heading(chosen.cells)
    with rig.one_core():
        unit, ds = ours(chosen.cells, 1, repeats=chosen.repeats)
    print(line("saltus, 1 thread", unit, unit, "", "all cells"), flush=True)
    seconds, _ = ours(chosen.cells, 2, repeats=chosen.repeats)
    print(line("saltus, 2 threads", seconds, unit, "", "all cells"), flush=True)
    record = Record(
        "basins",
        f"Basins of case b4 of the rig of de Langre et al. at 15 Hz, {chosen.cells} x "
        f"{chosen.cells} cells; rivals on one pinned core, "
        "timed on a random subset and scaled to the whole map. Finding the attractors is part of "
        "saltus's time; rivals are given the "
        "orbits to compare with.",
    )
    kept = [
        kept_row(f"saltus, {n} thread{'s' * (n > 1)}", time_, unit, None, ds.basin.size)
        for n, time_ in ((1, unit), (2, seconds))
    ]
    tables: list[Table] = []
    if not chosen.alone:
        theirs, tables = beside(ds, unit, subset_of(ds, chosen.subset), chosen.few, record.left_out)
        kept += theirs
    if chosen.write is not None:
        record.tables += [Table("A map of basins", COLUMNS, kept), *tables]
        print(f"kept in {record.write(chosen.write)}")


if __name__ == "__main__":
    main()
