"""Numbers for the comparison of processors: final states, contacts, orbits, bifurcations, an
exponent.

    python benchmarks/digits.py > here.json        compute them
    python benchmarks/digits.py A.json B.json ...  say which differ from those of A, and by how much

``.ci/processors`` does both, for processors that qemu emulates. The table is Markdown.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import saltus as sl
from saltus.cli.doctor import processor
from saltus.codegen.machine import target

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")
TAYLOR, ODE45 = sl.Taylor(), sl.ODE45(rtol=1e-4, atol=1e-7)
#: Motions: a published system, the method, the states that don't start at zero, and the length.
MOTIONS: dict[str, tuple[Any, Any, dict[str, float], dict[str, float]]] = {
    "rig, Taylor": (RIG, TAYLOR, {"x": 1e-3}, {"periods": 60}),
    "rig, ODE45": (RIG, ODE45, {"x": 1e-3}, {"periods": 5}),
    "two masses, four stops": (sl.models.chain(), TAYLOR, {}, {"periods": 20}),
    "two masses, four stops, by modes": (sl.models.chain(), sl.Modal(), {}, {"periods": 20}),
    "gear pair": (sl.models.gear_pair(), TAYLOR, {}, {"periods": 20}),
    "Hertz stop": (sl.models.hertz_stop(), TAYLOR, {}, {"periods": 20}),
    "impacts": (sl.models.impact_oscillator(), TAYLOR, {}, {"periods": 20}),
    "impacts by modes": (sl.models.impact_oscillator(), sl.Modal(), {}, {"periods": 20}),
    "rotor that rubs": (sl.models.jeffcott_rotor(), TAYLOR, {}, {"periods": 20}),
    "dry friction": (sl.models.den_hartog(), TAYLOR, {}, {"periods": 20}),
    "double scroll": (sl.models.double_scroll(), TAYLOR, {"x": 0.1}, {"t_end": 10}),
}


class Digit(NamedTuple):
    """A number with its name."""

    name: str
    value: float


def digits() -> Iterator[Digit]:
    """Compute all numbers."""
    for name, (system, method, moved, length) in MOTIONS.items():
        start = dict.fromkeys(system.states, 0.0) | moved
        run = sl.simulate(system, start, method=method, progress=False, **length)
        for state in system.states[:2]:
            yield Digit(f"{name}: {state} at the end", float(run[f"end_{state}"]))
        yield Digit(f"{name}: contacts", float(run.sizes["contact"]))
        yield Digit(f"{name}: time of the last contact", float(run["contact_time"][-1]))
    found = sl.attractors(RIG, {"x": [0.2e-3, 0.4e-3, 1e-3], "v": 0.0}, progress=False)
    for one, period in enumerate(found["attractor_period"].values.tolist()):
        for part in ("peak", "margin"):
            yield Digit(f"rig, {period}T: {part}", float(found[f"attractor_{part}"][one]))
        real = float(found["attractor_multiplier_real"][one, 0])
        yield Digit(f"rig, {period}T: real part of the first multiplier", real)
    branch = sl.branches(
        RIG, {"frequency": ("16 Hz", "20 Hz")}, ("5 mm", 0), at=1, longest=1, progress=False
    )
    for kind, place in zip(
        branch["event_kind"].values, branch["event_frequency"].values, strict=True
    ):
        yield Digit(f"rig: {kind} [Hz]", float(place))
    spectrum = sl.lyapunov(RIG, (1e-3, 0.0), periods=200, progress=False)
    yield Digit("rig: largest exponent", float(spectrum["lyapunov_exponent"][0, 0]))


def ulps(one: float, other: float) -> float:
    """Distance of two numbers in units of the last place of the first."""
    return abs(one - other) / math.ulp(one)


def table(files: list[Path]) -> str:
    """Compare the numbers of files with those of the first, as Markdown."""
    read = [json.loads(file.read_text(encoding="utf-8")) for file in files]
    first, others = read[0], read[1:]
    heads = ["number", files[0].stem, *(f"{file.stem}: difference (ulp)" for file in files[1:])]
    lines = [f"| {' | '.join(heads)} |", "|---|" + "---:|" * len(files)]
    for name, value in first["digits"].items():
        cells = []
        for other in others:
            there = other["digits"][name]
            cells.append(
                "0" if there == value else f"{there - value:.1e} ({ulps(value, there):.3g})"
            )
        lines.append(f"| {name} | {value:.17g} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main(files: list[Path]) -> None:
    """Compute the numbers, or compare those of files."""
    if files:
        print(table(files))
        return
    made_for = target()
    made = {
        "processor": processor(), "compiled for": f"{made_for.triple} {made_for.processor}",
        "digits": {digit.name: digit.value for digit in digits()},
    }  # fmt: skip
    print(json.dumps(made, indent=1))


if __name__ == "__main__":
    main([Path(name) for name in sys.argv[1:]])
