"""What a forcing period costs where contacts have laws - impacts, sticking - beside rivals, same
work, same run.

The impact oscillator x'' + 0.1 x' + x = cos t, x <= 1, e = 0.8 (Dankowicz & Schilder, Recipes for
Continuation, section 15.2), and a block with dry friction that stops twice a period. CPU time of
one pinned core, smallest of three repeats. SciPy and heyoka take a few starts: their cost per
trajectory is the same. The difference is that of the states after ten periods.

    python benchmarks/laws.py
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

import saltus as sl
from saltus.cli.doctor import processor

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from benchmarks.rivals import rig  # noqa: E402

STARTS, FEW, PERIODS, COMPARED = 2048, 8, 100, 10


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def oscillator(t: Any, x: Any, v: Any, *, gap=1.0, restitution=0.8, damping=0.1, w=1.0) -> Any:
    """Impacts of a driven oscillator against a rigid stop."""
    push = sl.cos(w * t) - damping * v - x
    return v, push, sl.impact(x < gap, v, restitution=restitution)


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def block(t: Any, x: Any, v: Any, *, slip=0.5, w=0.5) -> Any:
    """Den Hartog's block on a spring, driven, with dry friction."""
    return v, sl.cos(w * t) - x - sl.friction(v, slip=slip)


def ours(system: sl.System, starts: np.ndarray) -> tuple[float, float]:
    """Microseconds a period, events a period."""
    start = {"x": starts[:, 0], "v": starts[:, 1]}

    def job() -> Any:
        return sl.stroboscope(system, start, PERIODS, keep=1, threads=1, progress=False)

    events = float(job().events.sum()) / (len(starts) * PERIODS)
    return rig.cpu_seconds(job) / (len(starts) * PERIODS) * 1e6, events


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
        us, events = ours(system, starts)
        print(f"| {title:<34} | {us:10.3f} | {1.0:9.1f} | {events:13.2f} | {'':<10} |")
        few = starts[:FEW]
        end = sl.stroboscope(
            system, {"x": few[:, 0], "v": few[:, 1]}, COMPARED, keep=1, threads=1, progress=False
        )
        exact = np.stack([end.x.values[:, -1], end.v.values[:, -1]], axis=1)
        for rival in ("heyoka", "scipy"):
            try:
                module = __import__(f"benchmarks.rivals.{rival}_laws", fromlist=[name])
            except ImportError:
                print(f"{rival} isn't installed; left out", file=sys.stderr)
                continue
            if not hasattr(module, name):
                continue
            theirs = min(getattr(module, name)(few, PERIODS, *given)[0] for _ in range(2))
            apart = np.abs(getattr(module, name)(few, COMPARED, *given)[1] - exact).max()
            print(
                f"| {f'  {rival}, by hand':<34} | {theirs:10.3f} | {theirs / us:9.1f} | {'':>13} | "
                f"{apart:10.1e} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
