"""Check that a forced system repeats after the period of its forcing: by formula where time enters
as a phase or a clock, else by samples.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.contact.guards import Guard, is_hold
from saltus.contact.reduction import free_field
from saltus.errors import TraceError
from saltus.language.clocks import cycles_of
from saltus.language.derivatives import differentiate, time_derivative
from saltus.language.evaluate import evaluate
from saltus.language.expression import (
    TIME,
    Expr,
    constant,
    depends_on,
    div,
    relations_in,
)
from saltus.sentences import Text
from saltus.system.equations_of_motion import EquationsOfMotion
from saltus.system.modes import sides

#: Rounding allowed in the number of a clock's cycles in a period [relative].
CLOCK_MISS = 1e-9
#: Rounding allowed in the number of a phase's cycles in a period [cycles].
PHASE_MISS = 1e-9
#: Smallest difference after a period that exceeds rounding, relative to the values at one state.
DIFFERENCE = 1e-7


@dataclass(frozen=True)
class Timing:
    """The ways in which time enters an expression, independent of the values of parameters.

    Attributes
    ----------
    clocks : tuple of (Expr, bool)
        Cycles per second of switches, remainders and tables, and whether they count cycles at all;
        a level and a table that ends don't.
    phases : tuple of Expr
        Cycles per second of sines and cosines of ``rate*t + ...``, the rest of it free of time.
    complete : bool
        Whether time enters in no other way. Then an expression all of whose clocks and phases
        repeat repeats itself.
    """

    clocks: tuple[tuple[Expr, bool], ...]
    phases: tuple[Expr, ...]
    complete: bool


@functools.lru_cache(maxsize=1024)
def timing_of(entry: Expr) -> Timing:
    """Find the ways in which time enters an expression; cached."""
    clocks: dict[Expr, tuple[Expr, bool]] = {}
    phases: dict[Expr, Expr] = {}
    complete, waiting, seen = True, [entry], set()
    while waiting:
        node = waiting.pop()
        if node in seen or not depends_on(node, ("time",)):
            continue
        seen.add(node)
        below = list(node.args)
        if node.op == "time":
            complete = False
        elif node.op in ("mod", "table"):
            clocks[node], below = cycles_of(node), []
        elif node.op == "select":
            clocks |= {
                relation.gap: cycles_of(relation.gap) for relation in relations_in(node.payload)
            }
        elif node.op in ("sin", "cos") and (rate := rate_of(node.args[0])) is not None:
            phases[node], below = div(rate, 2 * math.pi), []
        waiting += below
    return Timing(tuple(clocks.values()), tuple(phases.values()), complete)


def jumps_by_time(entry: Expr) -> bool:
    """True if time enters an expression by remainders, tables or comparisons, at which it jumps."""
    return bool(timing_of(entry).clocks)


def rate_of(angle: Expr) -> Expr | None:
    """The rate of ``rate*t + (anything without time)``, if it depends on parameters only; None for
    any other angle.
    """
    if depends_on(angle, ("select", "mod", "table")):
        return None
    rate = differentiate(angle, TIME)
    return None if depends_on(rate, ("time", "state")) else rate


def check_periodic(system: EquationsOfMotion) -> None:
    """Raise a TraceError if the equations of a forced system differ after one period of the
    forcing.

    Finds the forgotten 2 pi in ``cos(frequency*t)``, ramps, and a second frequency that isn't a
    multiple of the first. Other expressions are evaluated at samples.
    """
    period = system.period()
    if period is None:
        return
    unsure = []
    for number, entry in enumerate(_entries(system)):
        timing = timing_of(entry)
        if not _clocks_repeat(timing, system.values, period):
            raise TraceError(_not_periodic(system, number, period))
        if not (timing.complete and _phases_repeat(timing, system.values, period)):
            unsure.append(number)
    if unsure:
        _check_samples(system, period, unsure)


def repeats_by_formula(system: EquationsOfMotion, values: Mapping[str, Any]) -> bool:
    """True if formulas alone show that the equations of a forced system repeat after its period,
    for each of many values float64[m] of parameters. False says nothing.
    """
    values = {**system.values, **values}
    period = system.period(values)
    timings = [timing_of(entry) for entry in _entries(system)]
    return all(
        one.complete and _clocks_repeat(one, values, period) and _phases_repeat(one, values, period)
        for one in timings
    )


def _entries(system: EquationsOfMotion) -> list[Expr]:
    """The field where no contact is held, then the gaps of the guards and the expressions of the
    laws, then the outputs.
    """
    return [*_written(system.field, system.guards), *system.outputs.formulas]


@functools.lru_cache(maxsize=256)
def _written(field: tuple[Expr, ...], guards: tuple[Guard, ...]) -> tuple[Expr, ...]:
    gaps = [constant(0.0) if is_hold(guard) else guard.gap for guard in guards]
    resets = [entry for guard in guards if guard.law for entry in guard.law.reset]
    return (*free_field(field, guards), *gaps, *resets)


def _clocks_repeat(timing: Timing, values: Mapping[str, Any], period: Any) -> bool:
    """True if every clock has a whole number of cycles in a period. Tested by formula, since
    samples miss pulses.
    """
    cycles = [
        abs(rate * period) for rate in evaluate([rate for rate, _ in timing.clocks], values=values)
    ]
    counts = [counts for _, counts in timing.clocks]
    return all(
        np.all((number == 0) | (repeats & (abs(number - np.round(number)) <= CLOCK_MISS * number)))
        for number, repeats in zip(cycles, counts, strict=True)
    )


def _phases_repeat(timing: Timing, values: Mapping[str, Any], period: Any) -> bool:
    """True if every phase has a whole number of cycles in a period."""
    cycles = [rate * period for rate in evaluate(timing.phases, values=values)]
    return all(np.all(abs(number - np.round(number)) <= PHASE_MISS) for number in cycles)


def _check_samples(system: EquationsOfMotion, period: float, unsure: list[int]) -> None:
    """Raise a TraceError if one of these entries, or its derivative with respect to t, differs
    after a period.

    They are evaluated at a handful of states, times and modes and one period later. In the
    derivatives stiff terms can't hide a weak drive.
    """
    entries = [entry for number, entry in enumerate(_entries(system)) if number in unsure]
    expressions = entries + [time_derivative(entry) for entry in entries]
    random = np.random.default_rng(20210)
    sizes = np.array([0.0, 0.0, 1e-4, 1e-2, 1.0, 1.0])[:, None]
    states = {name: sizes * random.uniform(-1, 1, sizes.shape) for name in system.states}
    bits = [random.random(sizes.shape) < 0.5 for _ in system.guards]
    for bit, at_rest in zip(bits, sides(system, 0.0, np.zeros(len(system.states))), strict=True):
        bit[0] = at_rest
    bits += [random.random(sizes.shape) < 0.5 for _ in system.outputs.guards]
    t = period * random.uniform(0, 3, (1, 8))
    now, later = (
        evaluate(expressions, t=when, states=states, values=system.values, bits=bits)
        for when in (t, t + period)
    )
    for index, (a, b) in enumerate(zip(now, later, strict=True)):
        a, b = np.broadcast_to(a, (6, 8)), np.broadcast_to(b, (6, 8))
        with np.errstate(invalid="ignore"):
            scale = np.maximum(np.abs(a), np.abs(b)).max(axis=1, keepdims=True)
            differs = np.abs(a - b) > DIFFERENCE * scale
        if differs.any():
            raise TraceError(_not_periodic(system, unsure[index % len(unsure)], period))


def _not_periodic(system: EquationsOfMotion, entry: int, period: float) -> Text:
    """The message about the entry of the field or the guard that doesn't repeat."""
    count = len(system.states)
    output = entry - len(_written(system.field, system.guards))
    what = (
        f"the output {system.outputs.names[output]!r}"
        if output >= 0
        else f"d{system.states[entry]}/dt"
        if entry < count
        else f"the boundary {system.guards[entry - count].name!r}"
        if entry < count + len(system.guards)
        else "what an impact or a jump sets"
    )
    name = system.forced_at or ""
    unit = system.units[name]
    hertz, radians = f"cos(2*pi*{name}*t)", f"cos({name}*t)"
    drive, another, other = (radians, hertz, "Hz") if unit == "rad/s" else (hertz, radians, "rad/s")
    return lambda say: (
        f"{system.name}: {what} doesn't repeat after the forcing period T = {period:.6g} s set by "
        f"{say.key(forced_at=name)} [{unit}]. "
        f"Write the drive as {drive}, or as {another} with {say.key(units={name: other})}; let "
        "every other forcing frequency be a multiple of it; or leave "
        f"{say.key('forced_at')} out for a system without a period."
    )
