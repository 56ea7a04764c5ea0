"""Random systems for derivatives with respect to parameters and starts: bodies in a row between
contacts of one to three kinds, an equation as text, or a structure; a start; what to derive by.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from random import Random

import saltus as sl

#: Contacts of an equation; those of a structure are among its own words.
KINDS = (
    "soft", "damped", "pressed", "both", "impact", "impact", "clay", "wall", "pair", "clay pair",
    "friction", "static", "belt", "slider", "play", "rough", "kick",
)  # fmt: skip
RUBBING = ("friction", "static", "belt", "slider", "play")
DRIVES = ("cos", "cos", "cos", "two", "record", "square")


@dataclass(frozen=True)
class Case:
    """A system, its start, and the parameters and starts with respect to which it is derived.

    Attributes
    ----------
    name : str
        What it is made of.
    source : str
        Text that makes ``system``.
    start : tuple of float
    t_end : float
    to : tuple of str
    """

    name: str
    source: str
    start: tuple[float, ...]
    t_end: float
    to: tuple[str, ...]

    def system(self) -> sl.System:
        """The system of saltus."""
        names = {"sl": sl}
        exec(self.source, names)
        return names["system"]

    def reproduction(self, method: str) -> str:
        """A program that repeats it."""
        return (
            f"import saltus as sl\n{self.source}\nfound = sl.sensitivity(system, {self.start}, "
            f"t_end={self.t_end}, to={list(self.to)}, samples=5, method=sl.{method}())\n"
        )


def random_case(rng: Random, settles: bool = False) -> Case:
    """An equation of one to three bodies, or a structure of one to four modes; if it `settles`, it
    is forced and each of its bodies or modes is damped.
    """
    return (_structure if rng.random() < 0.3 else _equation)(rng, settles)


def _number(rng, low, high):
    return float(f"{rng.uniform(low, high):.3g}")


class _Equation:
    """The parts of an equation as they are drawn."""

    def __init__(self, rng, bodies):
        self.rng, self.bodies = rng, bodies
        self.masses = [_number(rng, 0.6, 1.6) for _ in range(bodies)]
        self.values: dict[str, float] = {}
        self.forces: list[list[str]] = [[] for _ in range(bodies)]
        self.laws: list[str] = []
        self.outputs: list[str] = []
        self.gaps: list[tuple[int, int, float]] = []  # body, side, place

    def new(self, word, low, high):
        """Name of a new parameter."""
        count = sum(name.rstrip("0123456789") == word for name in self.values)
        name = f"{word}{count + 1}"
        self.values[name] = _number(self.rng, low, high)
        return name

    def body(self):
        return self.rng.randrange(self.bodies)

    def add(self, kind):
        """Add a contact; returns its name, or nothing if it takes more bodies."""
        if kind in ("pair", "clay pair", "rough") and self.bodies == 1:
            return ""
        i = self.rng.randrange(
            self.bodies - 1 if kind in ("pair", "clay pair", "rough") else self.bodies
        )
        make = {
            "soft": self._soft, "damped": self._soft, "pressed": self._soft, "impact": self._rigid,
            "clay": self._rigid, "wall": self._wall, "pair": self._pair, "clay pair": self._pair,
            "friction": self._friction, "static": self._friction, "belt": self._friction,
            "rough": self._rough,
        }.get(kind, self._more)  # fmt: skip
        make(kind, i, f"x{i}", f"v{i}")
        return kind

    def _side(self, x, v):
        """A gap on either side: its parameter, +1 or -1, the way towards it and the velocity."""
        gap = self.new("gap", 0.0 if self.rng.random() < 0.2 else 0.02, 0.3)
        return (gap, 1, x, v) if self.rng.random() < 0.5 else (gap, -1, f"(-{x})", f"-{v}")

    def _soft(self, kind, i, x, v):
        gap, side, toward, closing = self._side(x, v)
        force = f"{self.new('stop', 60, 900)}*({toward} - {gap})"
        if kind == "damped":
            force += f" + {self.new('oil', 0.5, 8)}*({closing})"
        if kind == "pressed":
            force += f" + {self.new('press', 0.2, 2)}"
        force = f"sl.where({toward} > {gap}, {force}, 0)"
        self.outputs.append(force)
        self.forces[i].append(f"{'-' if side > 0 else '+'} {force}")

    def _rigid(self, kind, i, x, v):
        gap, side, toward, closing = self._side(x, v)
        e = 0.0 if kind == "clay" else self.new("e", 0.3, 1.0)
        self.laws.append(f"sl.impact({toward} < {gap}, {closing}, restitution={e})")
        self.gaps.append((i, side, self.values[gap]))

    def _wall(self, kind, i, x, v):
        """A wall that moves."""
        gap, side, toward, closing = self._side(x, v)
        size, e = self.new("shake", 0.005, 0.02), self.rng.choice((0.0, 0.5, 0.8))
        self.laws.append(
            f"sl.impact({toward} < {gap} + {size}*sl.cos(2*sl.pi*f*t), {closing} "
            f"+ 2*sl.pi*f*{size}*sl.sin(2*sl.pi*f*t), restitution={e})"
        )
        self.gaps.append((i, side, self.values[gap] - self.values[size]))

    def _shared(self, i):
        return f"inertia={{'v{i}': {self.masses[i]}, 'v{i + 1}': {self.masses[i + 1]}}}"

    def _pair(self, kind, i, x, v):
        gap = self.new("gap", 0.02, 0.3)
        e = 0.0 if kind == "clay pair" else self.new("e", 0.3, 1.0)
        self.laws.append(
            f"sl.impact({x} < x{i + 1} + {gap}, {v} - v{i + 1}, restitution={e}, {self._shared(i)})"
        )
        self.gaps.append((i, 2, self.values[gap]))

    def _rough(self, kind, i, x, v):
        gap, mu = self.new("gap", 0.02, 0.3), self.new("mu", 0.1, 0.6)
        self.laws.append(
            f"sl.impact({x} < {gap}, {v}, restitution=0, friction={mu}, slip_velocity=v{i + 1}, "
            f"{self._shared(i)})"
        )
        self.gaps.append((i, 1, self.values[gap]))

    def _friction(self, kind, i, x, v):
        slip = self.new("slip", 0.3, 2)
        more = f", stick={slip}*{_number(self.rng, 1.05, 1.6)}" if kind == "static" else ""
        past = f" - {self.new('belt', 0.1, 0.5)}" if kind == "belt" else ""
        self.forces[i].append(f"- sl.friction({v}{past}, slip={slip}{more})")

    def _more(self, kind, i, x, v):
        if kind == "kick":
            level, part = self.new("level", 0.05, 0.4), self.new("kick", 0.2, 1.0)
            self.laws.append(f"sl.jump({x} > {level}, {v}={v} - {part})")
            return
        stiffness = self.new("spring", 20, 400)
        if kind == "slider":
            force = f"sl.slider({x}, stiffness={stiffness}, limit={self.new('limit', 0.5, 2)})"
        else:
            gap = self.new("gap", 0.01, 0.1)
            play = f"{stiffness}*sl.play({x}, gap={gap})"
            free = f"sl.freeplay({x}, stiffness={stiffness}, gap={gap})"
            force = play if kind == "play" else free
        self.forces[i].append(f"- {force}")


def _drive(rng, made, settles):
    """Add a drive; returns its name and lines before the equation."""
    moves = settles or any("f*t" in law for law in made.laws)
    kind, i = rng.choice(DRIVES[:4] if moves else DRIVES), made.body()
    pull = made.new("pull", 2, 12)
    text, before = "sl.cos(2*sl.pi*f*t)", ""
    if kind == "two":
        phase = made.new("phase", 0, 3)
        text = f"(sl.cos(2*sl.pi*f*t) + 0.6*sl.sin(6*sl.pi*f*t + {phase}))"
    elif kind == "record":
        points = [_number(rng, -1, 1) for _ in range(9)]
        shape = rng.choice(("spline", "linear", "pchip"))
        before = (
            f"drive = sl.recorded({[round(0.15 * k, 2) for k in range(9)]}, {points}, "
            f"kind={shape!r})\n"
        )
        text = "drive(t)"
    elif kind == "square":
        text = "sl.square(2*sl.pi*f*t)"
    made.forces[i].append(f"+ {pull}*{text}")
    return kind, before


def _equation(rng, settles):
    bodies = rng.choice((1, 1, 1, 2, 2, 3))
    made = _Equation(rng, bodies)
    made.values["f"] = _number(rng, 0.7, 2.5)
    kinds = rng.sample(KINDS, rng.choice((1, 1, 2, 2, 3)))
    if "rough" in kinds:  # nothing else may switch where it slides
        kinds = [kind for kind in kinds if kind not in RUBBING]
    names = [made.add(kind) for kind in kinds]
    drive, before = _drive(rng, made, settles)
    if rng.random() < 0.3:
        made.forces[made.body()].append(f"+ {made.new('load', -3, 3)}")
    for i in range(bodies):
        spring = made.new("k", 10, 90)
        if i == 0:
            made.forces[0].append(f"- {spring}*x0")
        else:
            made.forces[i].append(f"- {spring}*(x{i} - x{i - 1})")
            made.forces[i - 1].append(f"+ {spring}*(x{i} - x{i - 1})")
        if settles or rng.random() < 0.6:
            low, high = (0.5, 3) if settles else (0.05, 1)
            made.forces[i].append(f"- {made.new('d', low, high)}*v{i}")
    states = [f"x{i}" for i in range(bodies)] + [f"v{i}" for i in range(bodies)]
    forced = drive != "record"
    if not forced:
        made.values.pop("f")
    rates = [f"v{i}" for i in range(bodies)]
    rates += [f"({' '.join(one)})/{m}" for one, m in zip(made.forces, made.masses, strict=True)]
    given = ", ".join(f"{name}={value}" for name, value in made.values.items())
    read = {"energy": "v0*v0 + k1*x0*x0", "power": made.forces[0][-1] + "*v0"}
    if made.outputs:
        read["stop"] = made.outputs[0]
    source = (
        f"{before}def equation(t, {', '.join(states)}, *, {given}):\n    return "
        + ",\\\n        ".join([*rates, *made.laws])
        + f"\nsystem = sl.system(states={' '.join(states)!r}"
        + (", forced_at='f'" if forced else "")
        + ")(equation)\n"
        + f"system = system.with_outputs({{{_functions(read, (*states, *made.values, 't'))}}})\n"
    )
    start = _start(rng, made)
    to = _chosen(rng, list(made.values), states)
    name = "+".join(filter(None, names)) + f", {drive}, {bodies}"
    return Case(name, source, start, _number(rng, 0.8, 2.0), to)


def _functions(read, known):
    """Outputs by name, as text: functions of what they need."""
    used = {key: [name for name in known if re.search(rf"\b{name}\b", read[key])] for key in read}
    return ", ".join(f"{key!r}: lambda {', '.join(used[key])}: {read[key]}" for key in read)


def _start(rng, made):
    x = [_number(rng, -0.2, 0.2) for _ in range(made.bodies)]
    for i, side, gap in made.gaps:
        if side == 2:
            x[i + 1] = max(x[i + 1], x[i] - 0.9 * gap)
    for i, side, gap in made.gaps:
        if side != 2 and side * x[i] > 0.9 * gap:
            x[i] = round(side * min(0.9 * gap, gap - 0.002), 4)
    if rng.random() < 0.2:
        x = [0.0 for _ in x]
    v = [0.0 if rng.random() < 0.2 else _number(rng, -2, 2) for _ in x]
    return (*x, *v)


def _chosen(rng, names, states):
    """Up to five parameters and starts."""
    count = min(len(names), rng.choice((2, 3, 4)))
    chosen = rng.sample(names, count)
    return (*chosen, f"{rng.choice(states)}(0)")


def _structure(rng, settles):
    n = rng.choice((2, 3, 4))
    modes = rng.choice((n, n, n - 1, 1)) if rng.random() < 0.5 else n
    springs = [_number(rng, 40, 400) for _ in range(n + 1)]
    rows = [[0.0] * n for _ in range(n)]
    for i in range(n):
        rows[i][i] = springs[i] + springs[i + 1]
        if i:
            rows[i][i - 1] = rows[i - 1][i] = -springs[i]
    contacts, names, values, soft = [], [], [], []
    for number in range(rng.choice((1, 1, 2, 3))):
        kind = rng.choice(("soft", "damped", "rigid", "rigid", "clay", "pressed"))
        at, to, name = rng.randrange(n), None, f"c{number}"
        side = rng.choice(("upper", "lower", "both"))
        if n > 1 and rng.random() < 0.25:
            to = (at + 1) % n
        gap = _number(rng, 0.01, 0.15)
        words = [f"'x{at + 1}'", f"gap={gap}", f"name={name!r}"]
        own = ["gap"]
        if kind in ("rigid", "clay"):
            e = 0.0 if kind == "clay" else _number(rng, 0.3, 1.0)
            words.append(f"restitution={e}")
            own += ["restitution"] if e else []
        else:
            words.append(f"stiffness={_number(rng, 200, 5000)}")
            own.append("stiffness")
            soft.append(number)
        if kind == "damped":
            words.append(f"damping={_number(rng, 0.5, 8)}")
            own.append("damping")
        if kind == "pressed":
            words.append(f"preload={_number(rng, 0.2, 3)}")
            side = rng.choice(("upper", "lower"))
            own.append("preload")
        words.append(f"side={side!r}")
        if to is not None:
            words.append(f"to='x{to + 1}'")
        contacts.append(f"sl.Contact({', '.join(words)})")
        values += [f"{name}_{word}" for word in own]
        names.append(kind)
    values += ["force", "frequency"]
    source = (
        f"system = sl.structure({[[float(i == k) for k in range(n)] for i in range(n)]}, {rows},\n"
        f"    contacts=[{', '.join(contacts)}],\n"
        f"    forces=[sl.Force('x{rng.randrange(n) + 1}', {_number(rng, 3, 20)})],\n"
        f"    frequency={_number(rng, 0.8, 3)}, "
        f"damping_ratio={rng.choice((0.04, 0.1) if settles else (0.0, 0.02, 0.05))}, "
        f"modes={modes},\n"
        f"    sensors={{'tip': 'x{n}', 'acceleration': sl.acceleration('x1')"
        + "".join(f", 'force {k}': sl.contact_force('c{k}')" for k in soft)
        + "})\n"
    )
    start = tuple([0.0] * modes + [_number(rng, -0.5, 0.5) for _ in range(modes)])
    states = [f"q{i + 1}" for i in range(modes)]
    to = _chosen(rng, values, states)
    name = "structure " + "+".join(names) + f", {modes} of {n}"
    return Case(name, source, start, _number(rng, 0.8, 2.0), to)
