"""What a bifurcation diagram shows of each response: where it turns, where it is at whole periods, or where it meets a boundary."""

from __future__ import annotations

import numpy as np

from saltus.analysis.grid import Grid
from saltus.analysis.responses import Found, own_times, spans_of
from saltus.analysis.steady import EQUILIBRIUM
from saltus.errors import ParameterError, nearest
from saltus.flow.engine import Outcome, Schedule
from saltus.flow.family import Family
from saltus.flow.methods import ODE45, Method
from saltus.kernels import status as st
from saltus.system.evaluate import evaluate
from saltus.system.quantity import turning_surface
from saltus.system.system import System

#: What may be shown.
SAMPLES = ("turning_points", "stroboscope", "contacts")
#: Samples of a period between which turning points are interpolated, where contacts aren't located.
BETWEEN = 400
#: Responses sampled at a time.
PIECE = 256


def check_sample(sample: str, method: Method) -> str:
    """The sample, if it is known and the method can tell it. Raises ParameterError."""
    if sample not in SAMPLES:
        raise ParameterError(f"sample={sample!r} isn't known. {nearest(str(sample), SAMPLES)}")
    if sample == "contacts" and not method.records_contacts:
        raise ParameterError(f'{method.name} with events="ignore" locates no contacts. Take sample="turning_points".')
    return sample


def check_unforced_sample(sample: str, system: System) -> None:
    """Raises ParameterError if a system without forcing can't show it."""
    if sample == "stroboscope" and system.forced_at is None:
        raise ParameterError(f'{system.name} has no forcing period: it has no stroboscope. Take sample="turning_points" or "contacts".')


def sampled(sample: str, grid: Grid, method: Method, found: Found, threads: int | None = None) -> list[np.ndarray]:
    """The sampled states of each response, float64[n, D], over one period of a response, or many of one that never repeats.

    Turning points are crossings of the surface on which the first state's rate is zero, located by the Taylor flow as contacts are; those
    of ode45, whose steps an extra event would change, are interpolated between its samples by cubics.
    """
    spans = spans_of(found)
    if sample == "stroboscope":
        return [found.points(i)[:span] for i, span in enumerate(spans)]
    turning = sample == "turning_points"
    located = not isinstance(method, ODE45)
    system = turning_surface(grid.system, grid.system.states[0]) if turning and located else grid.system
    start, result = found.start(aside=True), [np.zeros((0, len(system.states)))] * len(found)
    everything = Family(system, method, grid.rows[found.place], own_times(found, grid), threads)
    moves = found.kind != EQUILIBRIUM
    for rest in np.flatnonzero(~moves):
        result[rest] = found.points(int(rest))[:1]
    for span in np.unique(spans[moves]):
        rows = np.flatnonzero(moves & (spans == span))
        for first in range(0, len(rows), PIECE):
            some = rows[first : first + PIECE]
            family = everything.rows(some)
            parts = (
                _interpolated(family, start[some], int(span)) if turning and not located
                else _crossings(family.run(start[some], int(span), record=0), len(some), len(system.guards) - 1 if turning else None)
            )  # fmt: skip
            for row, part in zip(some, parts, strict=True):
                result[row] = part
    return result


def _crossings(outcome: Outcome, count: int, guard: int | None) -> list[np.ndarray]:
    """States at the crossings of one guard, or of all, of each trajectory."""
    table = outcome.record_integers
    chosen = (table[:, st.REC_KIND] == st.CROSSING) & ((table[:, st.REC_GUARD] == guard) if guard is not None else True)
    states = outcome.record_floats[chosen, st.RECORD_FLOATS : -1]
    return np.split(states, np.searchsorted(table[chosen, st.REC_TRAJECTORY], np.arange(1, count)))


def _interpolated(family: Family, start: np.ndarray, span: int) -> list[np.ndarray]:
    """States where the first one turns, from the cubics through neighbouring samples and their rates."""
    index = np.arange(span * BETWEEN + 1)
    states = family.run(start, span, Schedule(index // BETWEEN, (index % BETWEEN) / BETWEEN)).samples
    step = family.period / BETWEEN
    rates = _rates(family.system, family, states, index) * step[:, None, None]
    result = []
    for values, slopes in zip(states, rates, strict=True):
        before = np.flatnonzero((slopes[:-1, 0] * slopes[1:, 0] < 0) | ((slopes[1:, 0] == 0) & (slopes[:-1, 0] != 0)))
        a, b, da, db = values[before], values[before + 1], slopes[before], slopes[before + 1]
        at = _turn(a[:, 0], b[:, 0], da[:, 0], db[:, 0])[:, None]
        result.append(a + at * (da + at * ((3 * (b - a) - 2 * da - db) + at * (2 * (a - b) + da + db))))
    return result


def _turn(a: np.ndarray, b: np.ndarray, da: np.ndarray, db: np.ndarray) -> np.ndarray:
    """Where in [0, 1] cubics with these values and slopes at the ends, slopes of different sign, turn."""
    square, linear = 3 * (2 * (a - b) + da + db), 2 * (3 * (b - a) - 2 * da - db)
    root = np.sqrt(np.maximum(linear**2 - 4 * square * da, 0.0))
    half = -0.5 * (linear + np.where(linear >= 0, root, -root))
    with np.errstate(all="ignore"):
        roots = np.stack([half / square, da / half, da / (da - db)])
    inside = np.isfinite(roots) & (roots >= 0) & (roots <= 1)
    return np.where(inside[0], roots[0], np.where(inside[1], roots[1], roots[2]))


def _rates(system: System, family: Family, states: np.ndarray, index: np.ndarray) -> np.ndarray:
    """The field at samples float64[k, M, D]."""
    time = family.period[:, None] * (index / BETWEEN)
    named = {name: states[:, :, i] for i, name in enumerate(system.states)}
    values = {name: column[:, None] for name, column in family.values.items()}
    bits: list[np.ndarray] = []
    for guard in system.guards:
        (gap,) = evaluate([guard.gap], t=time, states=named, values=values, bits=bits)
        bits.append(np.broadcast_to(gap, time.shape) > 0)
    return np.stack(
        [np.broadcast_to(rate, time.shape) for rate in evaluate(system.field, t=time, states=named, values=values, bits=bits)], 2
    )
