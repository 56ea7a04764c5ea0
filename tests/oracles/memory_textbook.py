"""Textbook systems with a memory, each with values, a start and an exact machine.

Their ends, with twelve decimals, are ``tests/reference/memory.csv``; ``PYTHONPATH=src:tests python
-m oracles.memory_textbook`` writes it. The machines are written out here once more, state by state;
the elements of the random generator are others.
"""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import NamedTuple

from .memory_automaton import Automaton, Exit, Form, times
from .memory_systems import Case, drift

TABLE = Path(__file__).parents[1] / "reference" / "memory.csv"
PERIODS_60 = 60 * 2 * math.pi / 0.1


class Machine(NamedTuple):
    """An element written out: :class:`oracles.memory_automaton.Element`."""

    first: str
    rates: dict
    exits: dict
    forces: dict = {}  # noqa: RUF012
    holds: dict = {}  # noqa: RUF012


def _between(c: str, free: Form, carried: Form, rate: Form, ends, width: float) -> Machine:
    """A state with two ends: free between them; carried at an end while the rate pushes on.

    ``rate`` is what pushes; ``ends`` is what is compared with -width and width.
    """
    (name, own), edge = ends, {"1": -width}
    up = {name: own} if name == c else {name: own, c: -own}
    back = times(-1.0, up)
    place = times(1.0, {"1": width}) if name == c else {name: 1.0, "1": -width / own}
    under = {"1": -width} if name == c else {name: 1.0, "1": width / own}
    return Machine(
        "free",
        {"free": {c: free}, "high": {c: carried}, "low": {c: carried}},
        {
            "free": (
                Exit((up | edge, rate), "high", snap={c: place}),
                Exit((back | edge, times(-1.0, rate)), "low", snap={c: under}),
            ),
            "high": (Exit((times(-1.0, rate),), "free"),),
            "low": (Exit((rate,), "free"),),
        },
    )


def _case(name, states, rates, start, host, machine, frequency, t_end=30.0):
    source = f"def equation(t, {', '.join(states.split())}):\n    return (\n"
    source += "".join(f"        {rate},\n" for rate in rates) + "    )\n"
    return Case(name, states, source, start, t_end, Automaton(host, [machine], frequency))


def _held() -> Case:
    """x is stopped at 0 while c pushes on; y counts the time there. Closed form: x = -(t - 2)^2 / 2
    after t = 2, y = sqrt 2.
    """
    source = """def equation(t, x, c, y):
    held = x >= 0
    rate = sl.piecewise((0.0, held & (c > 0)), otherwise=c)
    return rate, -1.0, sl.piecewise((1.0, held), otherwise=0.0)
"""
    c = {"c": 1.0}
    machine = Machine(
        "free",
        {"free": {"x": c, "y": {}}, "held": {"x": {}, "y": {"1": 1.0}}},
        {
            "free": (Exit(({"x": 1.0}, c), "held", snap={"x": {}}),),
            "held": (Exit((times(-1.0, c),), "free"),),
        },
    )
    host = {"c": {"1": -1.0}}
    return Case("held", "x c y", source, (-1.0, 2.0, 0.0), 4.0, Automaton(host, [machine]))


def _play() -> Case:
    c = "sl.piecewise((v, ((x - c >= .3) & (v > 0)) | ((x - c <= -.3) & (v < 0))), otherwise=0.0)"
    rates = ("v", "-x - .1*v + 1.2*sl.cos(1.3*t) - .5*c", c)
    host = {"x": {"v": 1.0}, "v": {"x": -1.0, "v": -0.1, "cos": 1.2, "c": -0.5}}
    machine = _between("c", {}, {"v": 1.0}, {"v": 1.0}, ("x", 1.0), 0.3)
    return _case("play", "x v c", rates, (0.0, 0.0, 0.0), host, machine, 1.3)


def _prandtl() -> Case:
    limit = "((2*(x - c) >= 1) & (v > 0)) | ((2*(x - c) <= -1) & (v < 0))"
    c = f"sl.piecewise((v, {limit}), otherwise=0.0)"
    rates = ("v", "-.2*x - .05*v + 1.5*sl.sin(.9*t) - 2*(x - c)", c)
    host = {"x": {"v": 1.0}, "v": {"x": -2.2, "v": -0.05, "sin": 1.5, "c": 2.0}}
    machine = _between("c", {}, {"v": 1.0}, {"v": 1.0}, ("x", 2.0), 1.0)
    return _case("prandtl", "x v c", rates, (0.0, 0.0, 0.0), host, machine, 0.9)


def _jenkins() -> Case:
    f = "sl.piecewise((0.0, ((f >= 1) & (v > 0)) | ((f <= -1) & (v < 0))), otherwise=2*v)"
    rates = ("v", "-.2*x - .05*v + 1.5*sl.sin(.9*t) - f", f)
    host = {"x": {"v": 1.0}, "v": {"x": -0.2, "v": -0.05, "sin": 1.5, "f": -1.0}}
    machine = _between("f", {"v": 2.0}, {}, {"v": 1.0}, ("f", 1.0), 1.0)
    return _case("jenkins", "x v f", rates, (0.0, 0.0, 0.0), host, machine, 0.9)


def _ratchet() -> Case:
    rates = ("v", "-x - .1*v + 1.2*sl.cos(1.3*t) + .02*t")
    rates += ("sl.piecewise((v, (x >= c) & (v > 0)), otherwise=0.0)",)
    v: Form = {"v": 1.0}
    host = {"x": v, "v": {"x": -1.0, "v": -0.1, "cos": 1.2, "t": 0.02}}
    machine = Machine(
        "free",
        {"free": {"c": {}}, "up": {"c": v}},
        {
            "free": (Exit(({"x": 1.0, "c": -1.0}, v), "up", snap={"c": {"x": 1.0}}),),
            "up": (Exit((times(-1.0, v),), "free"),),
        },
    )
    return _case("ratchet", "x v c", rates, (0.0, 0.0, 0.0), host, machine, 1.3)


def _peak() -> Case:
    rates = ("v", "-x - .1*v + 1.2*sl.cos(1.3*t)")
    rates += ("sl.piecewise((v, (x >= c) & (v > -.1*c)), otherwise=-.1*c)",)
    v, quicker = {"v": 1.0}, {"v": 1.0, "c": 0.1}
    host = {"x": v, "v": {"x": -1.0, "v": -0.1, "cos": 1.2}}
    machine = Machine(
        "free",
        {"free": {"c": {"c": -0.1}}, "up": {"c": v}},
        {
            "free": (Exit(({"x": 1.0, "c": -1.0}, quicker), "up", snap={"c": {"x": 1.0}}),),
            "up": (Exit((times(-1.0, quicker),), "free"),),
        },
    )
    return _case("peak", "x v c", rates, (0.0, 0.0, 0.0), host, machine, 1.3)


def _integrator() -> Case:
    z = "sl.piecewise((0.0, ((z >= .5) & (x > 0)) | ((z <= -.5) & (x < 0))), otherwise=x)"
    rates = ("v", "-v - (x + z) + sl.sin(.7*t)", z)
    host = {"x": {"v": 1.0}, "v": {"v": -1.0, "x": -1.0, "z": -1.0, "sin": 1.0}}
    machine = _between("z", {"x": 1.0}, {}, {"x": 1.0}, ("z", 1.0), 0.5)
    return _case("integrator", "x v z", rates, (0.2, 0.0, 0.0), host, machine, 0.7)


def _tank() -> Case:
    net, full = ".3 + .5*sl.sin(t) - .2*h", "(h >= 1) & (.3 + .5*sl.sin(t) - .2*h > 0)"
    rates = (
        f"sl.piecewise((0.0, {full}), otherwise={net})",
        f"sl.piecewise(({net}, {full}), otherwise=0.0)",
    )
    rate: Form = {"1": 0.3, "sin": 0.5, "h": -0.2}
    machine = Machine(
        "part",
        {"part": {"h": rate, "q": {}}, "full": {"h": {}, "q": rate}},
        {
            "part": (Exit(({"h": 1.0, "1": -1.0}, rate), "full", snap={"h": {"1": 1.0}}),),
            "full": (Exit((times(-1.0, rate),), "part"),),
        },
    )
    return _case("tank", "h q", rates, (0.5, 0.0), {}, machine, 1.0)


def _clutch() -> Case:
    push = "sl.piecewise((5*(u - v), u > v), otherwise=0.0)"
    rates = ("v", f"-.3*v + {push}", f"-.2*u + 1.0*sl.cos(2*t) - {push}")
    slip: Form = {"u": 1.0, "v": -1.0}
    host = {"x": {"v": 1.0}, "v": {"v": -0.3}, "u": {"u": -0.2, "cos": 1.0}}
    machine = Machine(
        "off",
        {"off": {}, "on": {}},
        {"off": (Exit((slip,), "on"),), "on": (Exit((times(-1.0, slip),), "off"),)},
        {"on": {"v": times(5.0, slip), "u": times(-5.0, slip)}},
    )
    return _case("clutch", "x v u", rates, (0.0, 0.0, 0.0), host, machine, 2.0)


def cases() -> dict[str, Case]:
    """All of them, by name."""
    values = (0.01, 0.3, 0.1, 0.02, 0.1)
    made = [_held(), _play(), _prandtl(), _jenkins(), _ratchet(), _peak(), _integrator(), _tank()]
    named = {case.name: case for case in [*made, _clutch()]}
    for t_end, which in ((100.0, "100"), (PERIODS_60, "60_periods")):
        for jumps, form in ((False, "pieces"), (True, "jumps")):
            named[f"drift_{form}_{which}"] = drift(*values, jumps, t_end)
    return named


def touches(case: Case) -> list[float]:
    """Times at which the follower of a drifting oscillator is met and left, in turn."""
    order = case.states.split()
    start = [case.start[order.index(name)] for name in case.machine.states]
    motion = case.machine.motion(start, case.t_end)
    free = [mode == ("free",) for mode in motion.modes]
    pairs = zip(free[:-1], free[1:], motion.times, strict=True)
    return [float(t) for before, after, t in pairs if before != after]


def quantities(name: str, case: Case) -> dict[str, float]:
    """What the table holds of a case: the end, and when a follower is met and left."""
    end = dict(zip(case.states.split(), case.exact().tolist(), strict=True))
    if name == "drift_pieces_100":
        end |= {f"touch {i + 1}": t for i, t in enumerate(touches(case))}
    return end


def main():
    """Write the table; each end is found with two lengths of a step, and has the digits in which
    they agree.
    """
    with TABLE.open("w", newline="") as file:
        rows = csv.writer(file, lineterminator="\n")
        rows.writerow(("case", "t_end", "quantity", "value", "error"))
        for name, case in cases().items():
            found = quantities(name, case)
            case.machine.longest, case.machine._flows = 0.009, {}
            again = quantities(name, case)
            for what, value in found.items():
                error = max(2 * abs(again[what] - value), 1e-12)
                rows.writerow((name, repr(case.t_end), what, f"{value:.12f}", f"{error:.0e}"))


if __name__ == "__main__":
    main()
