"""The self-check: versions and processor of this installation, and two cases with closed forms."""

from __future__ import annotations

import math
import os
import platform
from dataclasses import dataclass
from typing import TYPE_CHECKING

from saltus.results.table import TextTable

if TYPE_CHECKING:
    from saltus.flow.methods import Method
    from saltus.system import System

#: Contact times [s] of x'' = -2 from x = 0, v = 2 with 0.999: twice in one step, at 1 -+
#: sqrt(0.001).
PARABOLA_TIMES = (1 - math.sqrt(0.001), 1 + math.sqrt(0.001))
#: Largest error [s] of those times that passes: so shallow a contact magnifies the rounding of x by
#: 1/|v| = 16.
PARABOLA_TOLERANCE = 1e-14
#: Largest error of an undamped oscillator of unit amplitude after 10 cycles that passes.
OSCILLATOR_TOLERANCE = 1e-13


@dataclass(frozen=True)
class Comparison:
    """One comparison with a closed form: its name, the largest error found, and the largest that
    passes.
    """

    name: str
    error: float
    tolerance: float

    @property
    def passed(self) -> bool:
        """True if the error is small enough; False for NaN."""
        return self.error <= self.tolerance


def machine() -> TextTable:
    """Versions, processor, lanes, threads and cache of this installation."""
    from saltus import cache
    from saltus.codegen.module import lane_width
    from saltus.results.provenance import versions

    entries = cache.kernels()
    rows = [
        *versions().items(),
        ("processor", f"{processor()}, {os.cpu_count()} threads, {_usable()} usable"),
        ("lanes", f"{lane_width()} trajectories in one step"),
        (
            "cache",
            f"{cache.folder()}: {len(entries)} entries, "
            f"{sum(entry.size_bytes for entry in entries) / 1e6:.1f} MB",
        ),
    ]
    return TextTable("saltus here", ("", ""), tuple(rows))


def checks() -> list[Comparison]:
    """Run the self-check: contacts and states against closed forms, by Taylor and by ODE45."""
    from saltus.flow import ODE45, Taylor

    return [
        Comparison(
            "two contacts in one step, times, Taylor", _parabola(Taylor()), PARABOLA_TOLERANCE
        ),
        Comparison("oscillator, 10 cycles, Taylor", _oscillator(Taylor()), OSCILLATOR_TOLERANCE),
        Comparison(
            "oscillator, 10 cycles, ODE45 at 1e-9", _oscillator(ODE45(rtol=1e-9, atol=1e-12)), 1e-6
        ),
    ]


def check_table(found: list[Comparison]) -> TextTable:
    """The self-check as a table."""
    rows = tuple(
        (
            check.name,
            f"{check.error:.1e}",
            f"{check.tolerance:.0e}",
            "passed" if check.passed else "FAILED",
        )
        for check in found
    )
    return TextTable("self-check against closed forms", ("case", "error", "allowed", ""), rows)


def _parabola(method: Method) -> float:
    """Largest error of the contact times [s]; infinite unless there are two."""
    from saltus.analysis.motion.simulate import simulate

    run = simulate(
        _probe(acceleration=-2.0, boundary=0.999),
        start={"x": 0.0, "v": 2.0},
        t_end=2.0,
        method=method,
        samples=1,
    )
    times = run["contact_time"].values
    if len(times) != len(PARABOLA_TIMES):
        return math.inf
    return max(abs(float(time) - exact) for time, exact in zip(times, PARABOLA_TIMES, strict=True))


def _oscillator(method: Method) -> float:
    """Largest error of x and v of x'' = -x after 10 cycles, from x = 1, v = 0."""
    from saltus.analysis.motion.simulate import simulate

    run = simulate(
        _probe(stiffness=1.0, boundary=2.0),
        start={"x": 1.0, "v": 0.0},
        t_end=20 * math.pi,
        method=method,
        samples=1,
    )
    return max(abs(float(run["end_x"]) - 1.0), abs(float(run["end_v"])))


def _probe(**values: float) -> System:
    """A system that is a parabola or an oscillator by its values, so that one compilation serves
    both.
    """
    from saltus.language import piecewise
    from saltus.system import system

    @system(states="x v", forced_at=None)
    def probe(t, x, v, *, acceleration=0.0, stiffness=0.0, boundary=1.0, contact=0.0):
        return v, acceleration - stiffness * x - piecewise(
            (contact * (x - boundary), x > boundary), otherwise=0
        )

    return probe.with_values(**values)


def processor() -> str:
    """Name of the processor."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [
                line.split(":", 1)[1].strip() for line in file if line.startswith("model name")
            ]
    except OSError:
        names = []
    return names[0] if names else platform.processor() or platform.machine()


def _usable() -> int:
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity else os.cpu_count() or 1
