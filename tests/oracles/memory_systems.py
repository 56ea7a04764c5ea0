"""Random systems with a memory: a host, one to three elements, an equation as text, a start.

``random_case`` draws systems that an exact mode-by-mode machine judges as well as RK4;
``random_conditions`` draws equations with joined and nested conditions, whose surfaces may hold the
motion and cease to be surfaces: RK4 alone judges them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from random import Random

import numpy as np

import saltus as sl

from . import memory_elements as elements
from .memory_automaton import Automaton, Exit, Form, add, times
from .memory_elements import Part, Port, text


@dataclass(frozen=True)
class Case:
    """A system, its start and its exact machine (None if there is none).

    Attributes
    ----------
    name : str
        What it is made of.
    states : str
        As ``sl.system`` takes them.
    source : str
        The function ``equation`` in the language of equations.
    start : tuple of float
        In the order of ``states``.
    t_end : float
    machine : Automaton or None
        Its states are those of the system, in the machine's own order.
    """

    name: str
    states: str
    source: str
    start: tuple[float, ...]
    t_end: float
    machine: Automaton | None = None

    def system(self) -> sl.System:
        """The system of saltus."""
        names = {"sl": sl}
        exec(self.source, names)
        return sl.system(states=self.states, name="equation")(names["equation"])

    def exact(self, shift=0.0) -> np.ndarray:
        """End of the exact motion, in the order of ``states``."""
        machine, order = self.machine, self.states.split()
        start = dict(zip(order, np.add(self.start, shift), strict=True))
        end = machine.motion([start[name] for name in machine.states], self.t_end).end
        return np.array([end[machine.states.index(name)] for name in order])

    def reproduction(self) -> str:
        """A program that repeats it."""
        return (
            f"import saltus as sl\n\n@sl.system(states={self.states!r})\n{self.source}\n"
            f"run = sl.simulate(equation, {self.start!r}, t_end={self.t_end!r})\n"
        )


def _number(rng, low, high):
    return round(rng.uniform(low, high), 3)


@dataclass
class _Host:
    name: str
    rates: dict[str, Form]
    texts: dict[str, str]
    ports: list[Port]
    pushed: str | None
    frequency: float
    lines: list[str]


_DRIVE = {"sin": "sl.sin(w*t)", "cos": "sl.cos(w*t)"}


def _oscillator(rng):
    w, ramp = _number(rng, 0.4, 2.5), _number(rng, -0.02, 0.03) * (rng.random() < 0.2)
    rate = {
        "x": -rng.choice((0.0, 0.2, 1.0, _number(rng, 0.1, 4.0))),
        "v": -_number(rng, 0.02, 0.3),
    }
    rate |= {rng.choice(("cos", "sin")): _number(rng, 0.5, 2.0), "t": ramp}
    rate["1"] = _number(rng, -0.3, 0.3) * (rng.random() < 0.5)
    port = Port({"x": 1.0}, {"v": 1.0}, "x", "v")
    return _Host(
        "oscillator",
        {"x": {"v": 1.0}, "v": rate},
        {"x": "v", "v": text(rate, _DRIVE)},
        [port],
        "v",
        w,
        [],
    )


def _first_order(rng):
    w = _number(rng, 0.4, 2.5)
    rate = {"x": -_number(rng, 0.1, 1.5), rng.choice(("cos", "sin")): _number(rng, 0.5, 2.0)}
    rate["1"] = _number(rng, -0.3, 0.3)
    port = Port({"x": 1.0}, {"d:x": 1.0}, "x", "r")
    return _Host("first order", {"x": rate}, {"x": text(rate, _DRIVE)}, [port], "x", w, [])


def _by_speed(rng):
    """An oscillator whose elements follow its speed: their rates hold its acceleration."""
    host = _oscillator(rng)
    port = Port({"v": 1.0}, {"d:v": 1.0}, "v", "r")
    return replace(host, name="speed of an oscillator", ports=[port])


def _prescribed(rng):
    w, a, b = _number(rng, 0.4, 2.5), _number(rng, 0.5, 1.5), _number(rng, -0.2, 0.2)
    x, v = {"sin": a, "1": b}, {"cos": a * w}
    port = Port(x, v, "x", "v")
    lines = [f"x = {text(x, _DRIVE)}", f"v = {text(v, _DRIVE)}"]
    return _Host("prescribed", {}, {}, [port], None, w, lines)


def _two_masses(rng):
    w, k = _number(rng, 0.4, 2.5), _number(rng, 0.2, 2.0)
    first = {"x": -k - _number(rng, 0.3, 2.0), "y": k, "v": -_number(rng, 0.02, 0.2)}
    first["cos"] = _number(rng, 0.5, 2.0)
    second = {"x": k, "y": -k - _number(rng, 0.3, 2.0), "u": -_number(rng, 0.02, 0.2)}
    rates = {"x": {"v": 1.0}, "y": {"u": 1.0}, "v": first, "u": second}
    texts = {"x": "v", "y": "u", "v": text(first, _DRIVE), "u": text(second, _DRIVE)}
    return _Host("two masses", rates, texts, [Port({"x": 1.0}, {"v": 1.0}, "x", "v")], "v", w, [])


def _kind(rng, host, room):
    """An element that the host can bear, or None."""
    others = {"v": elements.OTHERS, "x": (elements.stop,), None: ()}[host.pushed]
    if host.name.startswith("speed"):
        others = (elements.stop,)
    kinds = elements.MEMORIES if room and (not others or rng.random() < 0.75) else others
    kind = rng.choice(kinds) if kinds else None
    return elements.play if kind is elements.jenkins and not host.pushed else kind


def _parts(rng: Random, host: _Host) -> list[Part]:
    """One to three elements, four states at most; an element may ride on another one."""
    room, parts, ports = 4 - len(host.rates), [], list(host.ports)
    for c in "cdef"[: rng.choice((1, 1, 2, 2, 3))]:
        kind, port = _kind(rng, host, room), host.ports[0]
        if kind in elements.RIDERS:
            port = rng.choice(ports)
        if kind is elements.latch and host.name == "prescribed" and port is ports[0]:
            continue  # decided by the time alone: refused in words
        if kind is None or (kind is elements.friction and "friction" in (p.name for p in parts)):
            continue
        must = kind in (elements.jenkins, *elements.OTHERS)
        part = kind(rng, c, port, host.pushed if must or rng.random() < 0.8 else None)
        if len(part.states) > room:
            continue
        room -= len(part.states)
        parts.append(part)
        if part.port:
            ports.append(part.port)
    return parts


def random_case(rng: Random) -> Case:
    """A random system with an exact machine."""
    kind = rng.random()
    if kind < 0.06:
        return random_drift(rng, jumps=kind < 0.03)
    if kind < 0.1:
        return random_held(rng)
    host = rng.choice((_oscillator,) * 3 + (_first_order, _prescribed, _two_masses, _by_speed))(rng)
    parts = _parts(rng, host)
    while not parts:
        parts = _parts(rng, host)
    machine = Automaton(host.rates, parts, host.frequency)
    rates = dict(host.texts)
    for part in parts:
        if part.pushes:
            rates[host.pushed] += " " + " ".join(part.pushes)
    start = {name: rng.choice((0.0, _number(rng, -0.8, 0.8))) for name in rates}
    for part in parts:
        start |= part.states
        if part.watched:  # what a jump has missed isn't said by an equation
            start[part.watched] = min(start[part.watched], 0.0)
    return Case(
        f"{host.name}: {', '.join(part.name for part in parts)}",
        " ".join(start),
        _source(host, rates, parts),
        tuple(start.values()),
        float(rng.choice((10, 20, 30))),
        machine,
    )


def _source(host, rates, parts):
    """The equation as text."""
    lines = [f"w = {host.frequency}", *host.lines]
    if host.ports[0].v_text == "r":
        lines.append(f"r = {rates[host.pushed]}")
        rates = rates | {host.pushed: "r"}
    own = {name: line for part in parts for name, line in part.texts.items()}
    lines += [f"d{name} = {line}" for name, line in own.items()]
    returned = [*rates.values(), *(f"d{name}" for name in own)]
    returned += [law for part in parts for law in part.laws]
    body = "".join(f"    {line}\n" for line in lines)
    ends = "".join(f"        {line},\n" for line in returned)
    return f"def equation(t, {', '.join((*rates, *own))}):\n{body}    return (\n{ends}    )\n"


def random_held(rng: Random) -> Case:
    """x is held at a stop while c pushes on; y counts the time at the stop, as a state of its own.
    c turns by itself, and x may leave in any order of its derivatives.
    """
    w, amplitude, leak = _number(rng, 0.4, 2.5), _number(rng, 0.5, 2.0), _number(rng, 0.0, 0.5)
    stop, mean = _number(rng, -0.2, 0.5), _number(rng, -0.2, 0.2)
    rate: Form = {"cos": amplitude, "c": -leak, "1": mean}
    held = f"{rng.choice(('x >= ', 'x > '))}{stop}"
    push = rng.choice((f"({held}) & (c > 0)", f"(c > 0) & ({held})", f"~((x < {stop}) | (c <= 0))"))
    source = f"""def equation(t, x, c, y):
    w = {w}
    rate = sl.piecewise((0.0, {push}), otherwise=c)
    return rate, {text(rate, _DRIVE)}, sl.piecewise((1.0, x >= {stop}), otherwise=0.0)
"""
    c, place = {"c": 1.0}, {"x": {"1": stop}}
    contact = Part(
        "held",
        "free",
        {"free": {"x": c, "y": {}}, "held": {"x": {}, "y": {"1": 1.0}}},
        {
            "free": (Exit(({"x": 1.0, "1": -stop}, c), "held", snap=place),),
            "held": (Exit((times(-1, c),), "free"),),
        },
    )
    start = (_number(rng, -1.0, -0.3), _number(rng, -0.5, 1.0), 0.0)
    return Case("held", "x c y", source, start, 20.0, Automaton({"c": rate}, [contact], w))


def random_drift(rng: Random, jumps: bool) -> Case:
    """The drifting oscillator in bounded coordinates p = x - v, q = z - v: a mass pushes a massless
    slider with spring and dashpot over a gap; the slider sticks up to a force of 1 and drifts
    beyond (Pavlovskaia, Wiercigroch & Grebogi, Phys. Rev. E 64 (2001) 056224).
    """
    xi, a, b = _number(rng, 0.01, 0.2), _number(rng, 0.1, 0.6), _number(rng, 0.05, 0.3)
    g, w = _number(rng, 0.0, 0.2), _number(rng, 0.1, 1.5)
    return drift(xi, a, b, g, w, jumps, 20.0)


def drift(xi, a, b, g, w, jumps, t_end, start=(0.0, 0.0, 0.0, 0.0)) -> Case:
    """The drifting oscillator with given values; as pieces, or as a hybrid automaton with a state m
    that is 1 in contact.
    """
    touch = "m > 0.5" if jumps else "p - q >= g"
    states = "p y q v m" if jumps else "p y q v"
    laws = ", 0.0, sl.jump(p - q > g, m=1), sl.jump(F < 0, m=0)" if jumps else ""
    values = f"xi={xi}, a={a}, b={b}, g={g}, w={w}"
    source = f"""def equation(t, {", ".join(states.split())}, *, {values}):
    F = 2*xi*y + q
    touch = {touch}
    force = sl.piecewise((1.0, touch & (F > 1)), (F, touch & (F > 0)), otherwise=0)
    vr = sl.piecewise((y + (q - 1)/(2*xi), touch & (F > 1)), otherwise=0)
    zr = sl.piecewise((y, touch & (F > 0)), otherwise=-q/(2*xi))
    return y - vr, a*sl.cos(w*t) + b - force, zr - vr, vr{laws}
"""
    drive, push = {"cos": a, "1": b}, {"y": 2 * xi, "q": 1.0}
    slide = {"y": 1.0, "q": 1 / (2 * xi), "1": -1 / (2 * xi)}
    relaxed = {"q": -1 / (2 * xi)}
    set_, off = {"q": {"p": 1.0, "1": -g}}, {"m": {}} if jumps else {}
    m, on = ({"m": {}}, {"m": {"1": 1.0}}) if jumps else ({}, {})
    host = {"p": {"y": 1.0}, "y": drive, "q": {}, "v": {}} | m
    over = add(push, {"1": -1.0})
    gap = {"p": 1.0, "q": -1.0, "1": -g}
    contact = Part(
        "follower",
        "free",
        {"free": {}, "stick": {}, "drift": {}},
        {
            "free": (Exit((gap, push), "stick", set=on, snap=set_),),
            "stick": (Exit((over,), "drift"), Exit((times(-1, push),), "free", set=off)),
            "drift": (Exit((times(-1, over),), "stick"),),
        },
        holds={
            "free": {"q": relaxed},
            "stick": {"y": add(drive, times(-1, push)), "q": {"y": 1.0}},
            "drift": {
                "p": add({"y": 1.0}, times(-1, slide)),
                "y": add(drive, {"1": -1.0}),
                "q": add({"y": 1.0}, times(-1, slide)),
                "v": slide,
            },
        },
    )
    start = (*start, 0.0) if jumps else tuple(start)
    name = "drifting oscillator, " + ("jumps" if jumps else "pieces")
    return Case(name, states, source, start, t_end, Automaton(host, [contact], w))


def random_conditions(rng: Random) -> Case:
    """A random piecewise-linear equation with joined and nested conditions on three states."""
    f = _pieces(rng, 0)
    g = _pieces(rng, 0) if rng.random() < 0.6 else "0.0"
    w = _number(rng, 0.5, 2.0)
    source = (
        f"def equation(t, x, v, c):\n    push = {f}\n    feed = {g}\n"
        f"    return v, -x - 0.2*v + 1.3*sl.cos({w}*t) + push, -0.5*c + feed\n"
    )
    start = tuple(_number(rng, -1, 1) for _ in range(3))
    return Case("conditions", "x v c", source, start, 12.0)


def _linear(rng):
    a, b, c, d = (_number(rng, -1, 1) for _ in range(4))
    return f"{a}*x + {b}*v + {c}*c + {d}"


def _comparison(rng):
    level = _number(rng, -1, 1)
    return rng.choice(
        (
            f"(x > {level})",
            f"(v > {level})",
            f"(c < {level})",
            f"(x - c > {_number(rng, -0.5, 0.5)})",
            f"(x + {_number(rng, 0.2, 1)}*v > {level})",
        )
    )


def _condition(rng, depth=0):
    kind = rng.randrange(4 if depth < 1 else 1)
    if kind == 0:
        return _comparison(rng)
    a, b = _condition(rng, depth + 1), _condition(rng, depth + 1)
    return (f"({a} & {b})", f"({a} | {b})", f"(~{a})")[kind - 1]


def _pieces(rng, depth):
    if depth > 1 or (depth and rng.random() < 1 / 3):
        return _linear(rng)
    rows = [
        f"({_pieces(rng, depth + 1)}, {_condition(rng)})"
        for _ in range(1 if depth else rng.choice((1, 2)))
    ]
    return f"sl.piecewise({', '.join(rows)}, otherwise={_pieces(rng, depth + 1)})"
