"""Elements with a memory: each as its textbook's state machine, and as a user would write it.

A part is made of linear forms (see :mod:`oracles.memory_automaton`) and of text. The two are
written side by side by hand; nothing translates one into the other. A random generator chooses
among the spellings of the text, never the machine.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from random import Random
from typing import NamedTuple

from .memory_automaton import Exit, Form, add, minus, times

ONE: Form = {"1": 1.0}


class Port(NamedTuple):
    """A displacement (or any signal) and its rate, as forms and as text.

    A rate that is written as pieces can't be compared with 0 in an equation of saltus (it says so);
    the conditions under which it rises and falls then stand in ``rises`` and ``falls``; "": never.
    """

    x: Form
    v: Form
    x_text: str
    v_text: str
    rises: str | None = None
    falls: str | None = None

    def pieces(self, rng: Random, value: str, high: str, low: str) -> list:
        """Rows of ``chosen``: a value where x rises at a high end, or falls at a low one."""
        if self.rises is None:
            up, down = positive(rng, self.v_text), negative(rng, self.v_text)
            return [(value, (high, up)), (value, (low, down))]
        ends = ((high, self.rises), (low, self.falls))
        return [(value, (end, f"({moves})")) for end, moves in ends if moves and end]


@dataclass
class Part:
    """An element: the machine (:class:`oracles.memory_automaton.Element`), its text, its start.

    Attributes
    ----------
    states : dict of str to float
        The element's own states, with the start of each.
    texts : dict of str to str
        Their rates as text.
    pushes : list of str
        Text of what is added to the rate of the host's state that it pushes.
    laws : list of str
        Text of jumps.
    port : Port or None
        What a further element may be attached to.
    watched : str or None
        The state that a jump watches: it begins below the level.
    """

    name: str
    first: str
    rates: dict
    exits: dict
    forces: dict = field(default_factory=dict)
    holds: dict = field(default_factory=dict)
    states: dict[str, float] = field(default_factory=dict)
    texts: dict[str, str] = field(default_factory=dict)
    pushes: list[str] = field(default_factory=list)
    laws: list[str] = field(default_factory=list)
    port: Port | None = None
    watched: str | None = None


def text(form: Form, names: dict[str, str] | None = None) -> str:
    """A form in the language of equations."""
    names = {"1": "1"} | (names or {})
    parts = [f"{v!r}*{names.get(n, n)}" if n != "1" else repr(v) for n, v in form.items() if v]
    return " + ".join(parts) or "0.0"


def reaches(rng: Random, left: str, right: str) -> str:
    """Text of ``left >= right``; both sides belong to it or not, which is the same motion."""
    return rng.choice(
        (
            f"({left} >= {right})",
            f"({left} > {right})",
            f"({right} <= {left})",
            f"({left} - ({right}) >= 0)",
            f"(~({left} < {right}))",
        )
    )


def positive(rng: Random, what: str) -> str:
    """Text of ``what > 0``."""
    return rng.choice((f"({what} > 0)", f"({what} >= 0)", f"(0 < {what})", f"(~({what} <= 0))"))


def negative(rng: Random, what: str) -> str:
    """Text of ``what < 0``."""
    return rng.choice((f"({what} < 0)", f"({what} <= 0)", f"(0 > {what})", f"(~({what} >= 0))"))


def chosen(
    rng: Random, rows: list[tuple[str, tuple[str, ...]]], otherwise: str, disjoint=True
) -> str:
    """Text of a value for each of some conditions, each of several parts; in one of the
    ways in which it may be written.
    """
    joined = [(value, " & ".join(parts)) for value, parts in rows]
    same = len({value for value, _ in rows}) == 1
    way = rng.choice(("rows", "nested", "joined", "negated", "sum"))
    if way == "joined" and same:
        condition = " | ".join(f"({c})" for _, c in joined)
        return f"sl.piecewise(({rows[0][0]}, {condition}), otherwise={otherwise})"
    if way == "negated" and same:
        apart = " & ".join("(" + " | ".join(f"~{p}" for p in parts) + ")" for _, parts in rows)
        return f"sl.piecewise(({otherwise}, {apart}), otherwise={rows[0][0]})"
    if way == "nested" and disjoint:
        inner = [
            (f"sl.piecewise(({value}, {' & '.join(parts[1:])}), otherwise={otherwise})", parts[0])
            if len(parts) > 1
            else (value, parts[0])
            for value, parts in rows
        ]
        return f"sl.piecewise({', '.join(f'({v}, {c})' for v, c in inner)}, otherwise={otherwise})"
    if way == "sum" and otherwise == "0.0" and disjoint:
        return " + ".join(f"sl.piecewise(({v}, {c}), otherwise=0.0)" for v, c in joined)
    return f"sl.piecewise({', '.join(f'({v}, {c})' for v, c in joined)}, otherwise={otherwise})"


def _number(rng, low, high):
    return round(rng.uniform(low, high), 3)


def _spring(k, port, c, pushed):
    """A spring between a port and a state: its push, as forces and text."""
    return {pushed: times(-k, minus(port.x, {c: 1.0}))}, f"- {k}*({port.x_text} - {c})"


def _carried(c, port, rows):
    """Port of a state that is carried by another port, where the two rows say; None if it can't."""
    if len(rows) != 2:
        return None
    rises, falls = (" & ".join(parts) for _, parts in rows)
    return Port({c: 1.0}, {f"d:{c}": 1.0}, c, f"d{c}", rises, falls)


def play(rng: Random, c: str, port: Port, pushed: str | None) -> Part:
    """Play operator: c rests within a gap about x, and is carried at its ends (Krasnosel'skii &
    Pokrovskii 1989); with a spring to its host, a Prandtl (Jenkins) slider.
    """
    gap, k = _number(rng, 0.1, 0.6), _number(rng, 0.1, 2.0)
    off = minus(port.x, {c: 1.0})
    up = Exit((add(off, {"1": -gap}), port.v), "up", snap={c: add(port.x, {"1": -gap})})
    down = Exit(
        (add(times(-1, off), {"1": -gap}), times(-1, port.v)),
        "down",
        snap={c: add(port.x, {"1": gap})},
    )
    x, v = port.x_text, port.v_text
    if rng.random() < 0.25 and pushed:  # limits in terms of the force
        high = reaches(rng, f"{k}*({x} - {c})", repr(round(k * gap, 9)))
        low = reaches(rng, f"-{k}*({x} - {c})", repr(round(k * gap, 9)))
        gap_now = round(k * gap, 9) / k
        up = Exit((add(off, {"1": -gap_now}), port.v), "up", snap={c: add(port.x, {"1": -gap_now})})
        down = Exit(
            (add(times(-1, off), {"1": -gap_now}), times(-1, port.v)),
            "down",
            snap={c: add(port.x, {"1": gap_now})},
        )
    else:
        high = reaches(rng, f"{x} - {c}", repr(gap))
        low = rng.choice((reaches(rng, f"{c} - {x}", repr(gap)), f"({x} - {c} <= {-gap})"))
    rows = port.pieces(rng, v, high, low)
    rate = chosen(rng, rows, "0.0")
    if port.rises is None and rng.random() < 0.15:
        rate = f"sl.piecewise((sl.max({v}, 0), {high}), (sl.min({v}, 0), {low}), otherwise=0.0)"
    force, push = _spring(k, port, c, pushed)
    carried = {c: port.v}
    return Part(
        "play",
        "free",
        {"free": {c: {}}, "up": carried, "down": carried},
        {
            "free": (up, down),
            "up": (Exit((times(-1, port.v),), "free"),),
            "down": (Exit((port.v,), "free"),),
        },
        dict.fromkeys(("free", "up", "down"), force) if pushed else {},
        states={c: rng.choice((0.0, _number(rng, -gap, gap)))},
        texts={c: rate},
        pushes=[push] if pushed else [],
        port=_carried(c, port, rows),
    )


def jenkins(rng: Random, f: str, port: Port, pushed: str) -> Part:
    """Jenkins element with its force as the state: f' = k v unless at the limit and pushed on."""
    k, limit = _number(rng, 0.3, 3.0), _number(rng, 0.2, 1.2)
    v = port.v_text
    if port.rises is None and rng.random() < 0.3:
        rows = [
            (f"sl.min({k}*{v}, 0)", (reaches(rng, f, repr(limit)),)),
            (f"sl.max({k}*{v}, 0)", (reaches(rng, f"-{f}", repr(limit)),)),
        ]
        rate = chosen(rng, rows, f"{k}*{v}")
    else:
        high, low = reaches(rng, f, repr(limit)), reaches(rng, repr(-limit), f)
        rate = chosen(rng, port.pieces(rng, "0.0", high, low), f"{k}*{v}")
    return Part(
        "jenkins",
        "stick",
        {"stick": {f: times(k, port.v)}, "high": {f: {}}, "low": {f: {}}},
        {
            "stick": (
                Exit(({f: 1.0, "1": -limit}, port.v), "high", snap={f: {"1": limit}}),
                Exit(({f: -1.0, "1": -limit}, times(-1, port.v)), "low", snap={f: {"1": -limit}}),
            ),
            "high": (Exit((times(-1, port.v),), "stick"),),
            "low": (Exit((port.v,), "stick"),),
        },
        {mode: {pushed: {f: -1.0}} for mode in ("stick", "high", "low")},
        states={f: rng.choice((0.0, limit, _number(rng, -limit, limit)))},
        texts={f: rate},
        pushes=[f"- {f}"],
    )


def ratchet(rng: Random, c: str, port: Port, pushed: str | None) -> Part:
    """Ratchet: c goes up with x and never down. A gate that must be open, or that ties c to x, may
    be joined to its condition.
    """
    k, x, v = _number(rng, 0.0, 0.8), port.x_text, port.v_text
    gate, way = _number(rng, -0.5, 0.5), rng.choice(("", "", "and", "or"))
    open_, open_text = {"cos": 1.0, "1": -gate}, f"(sl.cos(w*t) > {gate})"
    off, back = minus(port.x, {c: 1.0}), Exit((times(-1, port.v),), "free")
    rows, rates = port.pieces(rng, v, reaches(rng, x, c), ""), {"free": {c: {}}, "up": {c: port.v}}
    rows = [row for row in rows if row[1][0]]
    place = {c: port.x}
    exits = {"free": (Exit((off, port.v), "up", snap=place),), "up": (back,)}
    if way == "and":
        rows = [(v, (*rows[0][1], open_text))]
        exits = {
            "free": (Exit((off, port.v, open_), "up", snap=place),),
            "up": (back, Exit((times(-1, open_),), "free")),
        }
    if way == "or":
        rows = [*rows, (v, (open_text,))]
        tie = Exit((open_,), "tied")
        rates["tied"] = {c: port.v}
        exits = {
            "free": (*exits["free"], tie),
            "up": (back, tie),
            "tied": (Exit((times(-1, open_),), "free"),),
        }
    rate = chosen(rng, rows, "0.0", disjoint=way != "or")
    force, push = _spring(k, port, c, pushed)
    return Part(
        f"ratchet {way}".strip(),
        "free",
        rates,
        exits,
        dict.fromkeys(rates, force) if pushed else {},
        states={c: rng.choice((0.0, _number(rng, -0.3, 0.5)))},
        texts={c: rate},
        pushes=[push] if pushed else [],
        port=_carried(c, port, [*rows, ("", ())]) if not way else None,
    )


def peak(rng: Random, c: str, port: Port, pushed: str | None) -> Part:
    """Peak detector with a leak: c rides on x where x would leave it below, and decays
    elsewhere.
    """
    leak, k = _number(rng, 0.05, 0.4), _number(rng, 0.0, 0.5)
    x, v = port.x_text, port.v_text
    quicker = add(port.v, {c: leak})
    condition = (
        reaches(rng, x, c),
        rng.choice((f"({v} > -{leak}*{c})", positive(rng, f"{v} + {leak}*{c}"))),
    )
    forces = {pushed: {c: -k}} if pushed else {}
    return Part(
        "peak detector",
        "free",
        {"free": {c: {c: -leak}}, "up": {c: port.v}},
        {
            "free": (Exit((minus(port.x, {c: 1.0}), quicker), "up", snap={c: port.x}),),
            "up": (Exit((times(-1, quicker),), "free"),),
        },
        {"free": forces, "up": forces} if pushed else {},
        states={c: rng.choice((0.0, _number(rng, -0.2, 0.6)))},
        texts={c: chosen(rng, [(v, condition)], f"-{leak}*{c}")},
        pushes=[f"- {k}*{c}"] if pushed else [],
    )


def integrator(rng: Random, z: str, port: Port, pushed: str | None) -> Part:
    """Integrator that stops at its limits (anti wind-up): z' = e unless at a limit and pushed
    on.
    """
    limit, gain, k = _number(rng, 0.1, 0.7), _number(rng, 0.3, 1.5), _number(rng, 0.2, 1.0)
    e, error = f"{gain}*({port.x_text})", times(gain, port.x)
    high = (reaches(rng, z, repr(limit)), positive(rng, port.x_text))
    low = (reaches(rng, f"-{z}", repr(limit)), negative(rng, port.x_text))
    forces = {pushed: {z: -k}} if pushed else {}
    rates = {"free": {z: error}, "high": {z: {}}, "low": {z: {}}}
    states = {z: rng.choice((0.0, limit, _number(rng, -limit, limit)))}
    texts = {z: chosen(rng, [("0.0", high), ("0.0", low)], e)}
    if rng.random() < 0.3:  # the time at the upper limit is counted
        q = f"{z}t"
        states[q], texts[q] = 0.0, f"sl.piecewise((1.0, {z} >= {limit}), otherwise=0.0)"
        for mode, rate in rates.items():
            rate[q] = ONE if mode == "high" else {}
    return Part(
        "integrator",
        "free",
        rates,
        {
            "free": (
                Exit(({z: 1.0, "1": -limit}, error), "high", snap={z: {"1": limit}}),
                Exit(({z: -1.0, "1": -limit}, times(-1, error)), "low", snap={z: {"1": -limit}}),
            ),
            "high": (Exit((times(-1, error),), "free"),),
            "low": (Exit((error,), "free"),),
        },
        dict.fromkeys(("free", "high", "low"), forces),
        states=states,
        texts=texts,
        pushes=[f"- {k}*{z}"] if pushed else [],
    )


def tank(rng: Random, h: str, port: Port, pushed: str | None) -> Part:
    """Tank with an overflow: h <= 1; what flows over may be counted in a state of its own."""
    mean, gain, leak = _number(rng, 0.1, 0.5), _number(rng, 0.3, 1.0), _number(rng, 0.05, 0.4)
    net = add({"1": mean, h: -leak}, times(gain, port.x))
    rate = f"{mean} + {gain}*({port.x_text}) - {leak}*{h}"
    k, q, counted = _number(rng, 0.0, 0.6), f"{h}o", rng.random() < 0.5
    full = (reaches(rng, h, "1"), positive(rng, rate))
    rates = {"part": {h: net}, "full": {h: {}}}
    states, texts = {h: rng.choice((0.5, 1.0))}, {h: chosen(rng, [("0.0", full)], rate)}
    if counted:
        rates = {"part": {h: net, q: {}}, "full": {h: {}, q: net}}
        states[q], texts[q] = 0.0, chosen(rng, [(rate, full)], "0.0")
    forces = {pushed: {h: -k}} if pushed else {}
    return Part(
        "tank",
        "part",
        rates,
        {
            "part": (Exit(({h: 1.0, "1": -1.0}, net), "full", snap={h: ONE}),),
            "full": (Exit((times(-1, net),), "part"),),
        },
        {"part": forces, "full": forces},
        states=states,
        texts=texts,
        pushes=[f"- {k}*{h}"] if pushed else [],
    )


def latch(rng: Random, m: str, port: Port, pushed: str | None) -> Part:
    """Relay with hysteresis as a hybrid automaton: on above a, off below b < a."""
    a, force = _number(rng, 0.05, 0.5), _number(rng, 0.1, 0.8)
    b = round(a - rng.uniform(0.1, 0.6), 3)
    forces = {pushed: {m: -force}} if pushed else {}
    return Part(
        "latch",
        "off",
        {"off": {m: {}}, "on": {m: {}}},
        {
            "off": (Exit((add(port.x, {"1": -a}),), "on", set={m: ONE}),),
            "on": (Exit((add(times(-1, port.x), {"1": b}),), "off", set={m: {}}),),
        },
        {"off": forces, "on": forces},
        states={m: 0.0},
        texts={m: "0.0"},
        pushes=[f"- {force}*{m}"] if pushed else [],
        watched=next(iter(port.x)),
        laws=[f"sl.jump({port.x_text} > {a}, {m}=1)", f"sl.jump({port.x_text} < {b}, {m}=0)"],
    )


def relay(rng: Random, m: str, port: Port, pushed: str | None) -> Part:
    """Relay with hysteresis whose memory relaxes to 1 or 0: on above a, and above b < a while m is
    beyond one half.
    """
    a, force, r = _number(rng, 0.05, 0.5), _number(rng, 0.1, 0.8), _number(rng, 2.0, 8.0)
    b, x = round(a - rng.uniform(0.1, 0.6), 3), port.x_text
    rising = {m: {"1": r, m: -r}}
    above_a, above_b = add(port.x, {"1": -a}), add(port.x, {"1": -b})
    half = {m: 1.0, "1": -0.5}
    under = times(-1, half)
    forces = {pushed: {m: -force}} if pushed else {}
    on = f"({x} > {a}) | (({m} > 0.5) & ({x} > {b}))"
    rate = rng.choice(
        (
            f"sl.piecewise(({r}*(1 - {m}), {on}), otherwise=-{r}*{m})",
            f"sl.piecewise((-{r}*{m}, ~({on})), otherwise={r}*(1 - {m}))",
            f"{r}*(sl.piecewise((1.0, {x} > {a}), "
            f"(sl.piecewise((1.0, {m} > 0.5), otherwise=0.0), {x} > {b}), otherwise=0.0) - {m})",
        )
    )
    return Part(
        "relay",
        "off",
        {"on": rising, "off": {m: {m: -r}}},
        {
            "off": (Exit((above_a,), "on"), Exit((above_b, half), "on")),
            "on": (Exit((times(-1, above_b),), "off"), Exit((times(-1, above_a), under), "off")),
        },
        {"on": forces, "off": forces},
        states={m: rng.choice((0.0, 1.0))},
        texts={m: rate},
        pushes=[f"- {force}*{m}"] if pushed else [],
    )


def stop(rng: Random, _: str, port: Port, pushed: str) -> Part:
    """Soft stop: a spring beyond a gap."""
    k, gap, x = _number(rng, 1.0, 30.0), _number(rng, 0.1, 0.8), port.x_text
    depth = add(port.x, {"1": -gap})
    return Part(
        "stop",
        "off",
        {"off": {}, "on": {}},
        {"off": (Exit((depth,), "on"),), "on": (Exit((times(-1, depth),), "off"),)},
        {"on": {pushed: times(-k, depth)}},
        pushes=[f"- sl.piecewise(({k}*({x} - {gap}), {x} > {gap}), otherwise=0.0)"],
    )


def clutch(rng: Random, _: str, port: Port, pushed: str) -> Part:
    """One-way clutch to a drum of constant speed: a damper where the port is quicker."""
    k, speed, v = _number(rng, 0.2, 5.0), _number(rng, -0.3, 0.3), port.v_text
    slip = add(port.v, {"1": -speed})
    return Part(
        "clutch",
        "off",
        {"off": {}, "on": {}},
        {"off": (Exit((slip,), "on"),), "on": (Exit((times(-1, slip),), "off"),)},
        {"on": {pushed: times(-k, slip)}},
        pushes=[f"- sl.piecewise(({k}*({v} - {speed}), {v} > {speed}), otherwise=0.0)"],
    )


def friction(rng: Random, _: str, port: Port, pushed: str) -> Part:
    """Dry friction on a belt: slips either way, sticks while the other forces stay below mu."""
    mu, belt, v = _number(rng, 0.05, 0.7), rng.choice((0.0, _number(rng, -0.3, 0.3))), port.v_text
    slip = add(port.v, {"1": -belt})
    rest, place = {f"f:{pushed}": 1.0}, {pushed: {"1": belt}}
    leave = (
        Exit((add(rest, {"1": -mu}),), "ahead"),
        Exit((add(times(-1, rest), {"1": -mu}),), "behind"),
    )
    force = rng.choice(
        (
            f"sl.piecewise(({mu}, {v} > {belt}), otherwise=-{mu})",
            f"sl.friction({v} - {belt}, slip={mu})",
        )
    )
    return Part(
        "friction",
        "stick",
        {"stick": {}, "ahead": {}, "behind": {}},
        {
            "stick": (
                Exit((slip,), "ahead"),
                Exit((times(-1, slip),), "behind"),
                *leave,
            ),
            "ahead": (Exit((times(-1, slip),), "stick", snap=place),),
            "behind": (Exit((slip,), "stick", snap=place),),
        },
        {"ahead": {pushed: {"1": -mu}}, "behind": {pushed: {"1": mu}}},
        {"stick": {pushed: {}}},
        pushes=[f"- {force}"],
    )


MEMORIES = (play, play, jenkins, ratchet, peak, integrator, tank, latch, relay)
RIDERS = (play, jenkins, ratchet, integrator, tank, latch, relay)
OTHERS = (stop, clutch, friction)
