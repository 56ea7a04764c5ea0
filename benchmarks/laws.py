"""Cost of a forcing period with laws of contact - impacts, sticking - beside rivals, same work,
same run.

The impact oscillator x'' + 0.1 x' + x = cos t, x <= 1, e = 0.8 (Dankowicz & Schilder, Recipes for
Continuation, section 15.2), and a block with dry friction that stops twice a period. CPU time of
one pinned core, the smallest of seven rounds in which the programs alternate (SciPy: one). SciPy
and heyoka take a few starts: their cost per trajectory is the same. The difference is that of the
states after ten periods.

    python benchmarks/laws.py
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import saltus as sl
from saltus.cli.doctor import processor

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from benchmarks.rivals import rig  # noqa: E402

STARTS, FEW, PERIODS, COMPARED, ROUNDS = 2048, 8, 100, 10, 7


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def oscillator(t: Any, x: Any, v: Any, *, gap=1.0, restitution=0.8, damping=0.1, w=1.0) -> Any:
    """Impacts of a driven oscillator against a rigid stop."""
    push = sl.cos(w * t) - damping * v - x
    return v, push, sl.impact(x < gap, v, restitution=restitution)


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def block(t: Any, x: Any, v: Any, *, slip=0.5, w=0.5) -> Any:
    """Den Hartog's block on a spring, driven, with dry friction."""
    return v, sl.cos(w * t) - x - sl.friction(v, slip=slip)


def ours(system: sl.System, starts: np.ndarray, periods: int) -> Any:
    """Points of the last period from some starts."""
    start = {"x": starts[:, 0], "v": starts[:, 1]}
    return sl.stroboscope(system, start, periods, keep=1, threads=1, progress=False)


def rivals(name: str) -> Iterator[tuple[str, Callable[..., tuple[float, np.ndarray]]]]:
    """Each installed rival that knows a problem: its name, and the function that solves it."""
    for rival in ("heyoka", "scipy"):
        try:
            module = __import__(f"benchmarks.rivals.{rival}_laws", fromlist=[name])
        except ImportError:
            print(f"{rival} isn't installed; left out", file=sys.stderr)
            continue
        if hasattr(module, name):
            yield rival, getattr(module, name)


def main() -> None:
    """Print the table."""
    rig.pin()
    rng = np.random.default_rng(15)
    print(f"{processor()}, one core; {STARTS} starts, {PERIODS} periods; rivals {FEW} starts")
    print(f"| {'':<34} | us/period  | times     | events/period | difference |")
    print(f"|{'-' * 36}|-----------:|----------:|--------------:|-----------:|")
    for title, system, name, given in (
        ("impact oscillator", oscillator, "impact_oscillator", (1.0, 1.0, 0.8)),
        ("dry friction, two stops a period", block, "dry_friction", (0.5, 0.5)),
    ):
        starts = rng.uniform(-1.0, 1.0, (STARTS, 2))
        few = starts[:FEW]
        rig.warm(system, sl.Taylor())
        events = float(ours(system, starts, PERIODS).events.sum()) / (STARTS * PERIODS)
        end = ours(system, few, COMPARED)
        exact = np.stack([end.x.values[:, -1], end.v.values[:, -1]], axis=1)
        found = dict(rivals(name))
        times: dict[str, list[float]] = {rival: [] for rival in ("saltus", *found)}
        for turn in range(ROUNDS):
            work = partial(ours, system, starts, PERIODS)
            times["saltus"].append(rig.cpu_seconds(work, 1) / (STARTS * PERIODS) * 1e6)
            for rival, solve in found.items():
                if turn == 0 or rival != "scipy":
                    times[rival].append(solve(few, PERIODS, *given)[0])
        us = min(times["saltus"])
        print(f"| {title:<34} | {us:10.3f} | {1.0:9.1f} | {events:13.2f} | {'':<10} |")
        for rival, solve in found.items():
            theirs = min(times[rival])
            apart = np.abs(solve(few, COMPARED, *given)[1] - exact).max()
            print(
                f"| {f'  {rival}, by hand':<34} | {theirs:10.3f} | {theirs / us:9.1f} | {'':>13} | "
                f"{apart:10.1e} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
