"""Fourier coefficients of forces along a truncated motion, and their derivatives.

The integrals run from instant to instant at which a boundary is met, so that no kink or jump lies
inside one: they are sums of Gauss's rule to rounding, exact for springs and other polynomials. What
is truncated is the motion alone. Where a force jumps, the instant's own shift adds to the
derivative.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.analysis.harmonics import series as fourier
from saltus.analysis.harmonics.pieces import Intervals, intervals_of
from saltus.contact.guards import is_hold
from saltus.language import expression as ex
from saltus.language.derivatives import gradients
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr
from saltus.system import System

#: Degree that forces count as which aren't polynomials.
UNEVEN = 6
#: Highest multiple of the forcing frequency in a force whose integrals are exact.
MULTIPLES = 12
#: A jump below this share of a force is rounding.
ROUNDING = 1e-12
#: Random states at which forces are compared on both sides of a boundary.
TRIED = 16


@dataclass(frozen=True)
class DerivedState:
    """A state of a system that is a derivative of a signal.

    Attributes
    ----------
    signal : int
        Which signal.
    times : int
        How often it is derived by time.
    """

    signal: int
    times: int


@dataclass(frozen=True)
class Coefficients:
    """Fourier coefficients of m forces along a motion of c signals of H harmonics.

    Attributes
    ----------
    values : float64[m, 2H + 1]
    by_signals : float64[m, 2H + 1, c, 2H + 1]
        Their derivatives with respect to the coefficients of the signals.
    by_constants : float64[m, 2H + 1, e]
        With respect to the states that don't move.
    intervals : Intervals
        The motion between the boundaries that it meets.
    """

    values: np.ndarray
    by_signals: np.ndarray
    by_constants: np.ndarray
    intervals: Intervals


class Forces:
    """Forces along motions.

    Parameters
    ----------
    system : System
        Its guards are the boundaries; its values those of the parameters.
    forces : sequence of Expr
        What to integrate.
    moving : mapping of str to DerivedState
        The states that move with signals.
    constants : sequence of str
        The states that don't move.
    turn : float
        Time of the equations in the fundamental period.
    periods : int
        Forcing periods in it.
    """

    def __init__(
        self, system: System, forces: Sequence[Expr], moving: Mapping[str, DerivedState],
        constants: Sequence[str], turn: float, periods: int,
    ) -> None:  # fmt: skip
        self.system, self.moving, self.constants = system, dict(moving), tuple(constants)
        self.turn, self.periods, self.count = turn, periods, len(forces)
        names = (*self.moving, *self.constants)
        self._slopes = gradients(forces, names)
        self._gap_slopes = gradients([guard.gap for guard in system.guards], names)
        self._known = [
            (i, j) for i, row in enumerate(self._slopes) for j, one in enumerate(row)
            if not _is_zero(one)
        ]  # fmt: skip
        self._entries = (*forces, *(self._slopes[i][j] for i, j in self._known))
        self._degree = degree(forces, self.moving)
        states, rows = list(self.moving), enumerate(self._gap_slopes)
        self._linear = {
            i: [(self.moving[name], j) for j, name in enumerate(states) if not _is_zero(row[j])]
            for i, row in rows if _is_linear(system.guards[i].gap, row[: len(states)], states)
        }  # fmt: skip
        self._rest = dict.fromkeys(states, 0.0)

    def motion(
        self, angle: np.ndarray, signals: np.ndarray, constants: np.ndarray, rate: float
    ) -> dict[str, Any]:
        """Inputs of expressions at angles float64[n], but for the bits: signals float64[c, 2H + 1],
        the constants float64[e], and the angle's rate.
        """
        here = fourier.basis(angle, fourier.harmonics_of(signals.shape[1]))
        known: dict[int, np.ndarray] = {}
        for times in {one.times for one in self.moving.values()}:
            known[times] = here @ (fourier.derivative(signals, times) * rate**times).T
        states = {name: known[one.times][:, one.signal] for name, one in self.moving.items()}
        states |= {
            name: np.asarray(value) for name, value in zip(self.constants, constants, strict=True)
        }
        return {
            "t": angle * (self.turn / (2 * np.pi)),
            "states": states,
            "values": self.system.values,
        }

    def intervals(self, signals: np.ndarray, constants: np.ndarray, rate: float) -> Intervals:
        """A motion between the boundaries that it meets."""
        return intervals_of(
            self.system.name,
            self.system.guards,
            self._gaps(signals, constants, rate),
            functools.partial(self.motion, signals=signals, constants=constants, rate=rate),
            fourier.harmonics_of(signals.shape[1]),
        )

    def _gaps(
        self, signals: np.ndarray, constants: np.ndarray, rate: float
    ) -> dict[int, np.ndarray]:
        """The series of the gaps that are linear in the moving states."""
        resting = self._rest | dict(zip(self.constants, constants.tolist(), strict=True))
        about: dict[str, Any] = {"states": resting, "values": self.system.values}
        found = {}
        for i, terms in self._linear.items():
            wanted = [self.system.guards[i].gap, *(self._gap_slopes[i][j] for _, j in terms)]
            level, *slopes = evaluate(wanted, **about)
            gap = np.zeros(signals.shape[1])
            gap[0] = level
            for (one, _), slope in zip(terms, slopes, strict=True):
                series = fourier.derivative(signals[one.signal], one.times)
                gap += slope * rate**one.times * series
            found[i] = gap
        return found

    @functools.cached_property
    def _jumping(self) -> np.ndarray:
        """Boundaries at which a force may jump, bool[guards]: it does at random states on a
        boundary whose gap is linear; of others it isn't asked.
        """
        random, names = np.random.default_rng(0), list(self.moving)
        found = np.ones(len(self.system.guards), bool)
        for i, terms in self._linear.items():
            states = {
                name: random.uniform(0.5, 2.0, TRIED) * random.choice([-1.0, 1.0], TRIED)
                for name in (*names, *self.constants)
            }
            states |= {name: np.abs(states[name]) for name in self.constants}
            wanted = [self.system.guards[i].gap, *(self._gap_slopes[i][j] for _, j in terms)]
            about: dict[str, Any] = {"t": random.uniform(0, 1, TRIED), "values": self.system.values}
            if not terms:
                continue
            gap, slope, *_ = evaluate(wanted, **about, states=states)
            states[names[terms[0][1]]] = states[names[terms[0][1]]] - gap / slope
            bits: list[Any] = []
            for guard in self.system.guards:
                (gap,) = evaluate([guard.gap], **about, states=states, bits=bits)
                bits.append(np.broadcast_to(gap > 0, TRIED) & (not is_hold(guard)))
            both = []
            for bits[i] in (np.zeros(TRIED, bool), np.ones(TRIED, bool)):
                forces = evaluate(self._entries[: self.count], **about, states=states, bits=bits)
                both.append(np.array([np.broadcast_to(one, TRIED) for one in forces]))
            # a power of a depth isn't defined where rounding makes that negative
            apart = np.nan_to_num(np.abs(both[0] - both[1]))
            size = np.nan_to_num(np.abs(both)).max(axis=0)
            found[i] = (apart > ROUNDING * size.max(axis=1)[:, None]).any()
        return found

    def nodes(
        self, intervals: Intervals, harmonics: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See :meth:`Intervals.nodes`: for products of the forces and a harmonic."""
        bent = math.isinf(self._degree)
        most = UNEVEN if bent else max(int(self._degree), 1)
        return intervals.nodes((most + 1) * harmonics + MULTIPLES * self.periods, bent)

    def coefficients(
        self, signals: np.ndarray, constants: np.ndarray, rate: float, rate_by: np.ndarray
    ) -> Coefficients:
        """The coefficients along a motion.

        Parameters
        ----------
        signals : float64[c, 2H + 1]
            The series of the motion.
        constants : float64[e]
            The states that don't move.
        rate : float
            Rate of the angle, as velocities are to be in [rad/s].
        rate_by : float64[e]
            Its derivatives with respect to the constants, over itself.
        """
        intervals = self.intervals(signals, constants, rate)
        harmonics = fourier.harmonics_of(signals.shape[1])
        angle, weight, which = self.nodes(intervals, harmonics)
        about = self.motion(angle, signals, constants, rate)
        bits = list(intervals.bits[which].T)
        found = [
            np.broadcast_to(one, len(angle)) for one in evaluate(self._entries, **about, bits=bits)
        ]
        here = fourier.basis(angle, harmonics)
        project = here.T * weight * _norm(harmonics)[:, None]
        values = np.array(found[: self.count]).reshape(self.count, -1) @ project.T
        width, c = 2 * harmonics + 1, len(signals)
        by_signals = np.zeros((self.count, width, c, width))
        by_constants = np.zeros((self.count, width, len(constants)))
        names = list(self.moving)
        for (i, j), slope in zip(self._known, found[self.count :], strict=True):
            if j >= len(names):
                by_constants[i, :, j - len(names)] += project @ slope
                continue
            one = self.moving[names[j]]
            block = (project * slope) @ here
            by_signals[i, :, one.signal] += _derived(block, one.times) * rate**one.times
            if one.times:
                value = about["states"][names[j]]
                by_constants[i] += np.outer(project @ (slope * value), one.times * rate_by)
        whole = Coefficients(values, by_signals, by_constants, intervals)
        if len(intervals.instants.angle):
            self._add_jumps(whole, signals, constants, rate, rate_by)
        return whole

    def _add_jumps(
        self, whole: Coefficients, signals: np.ndarray, constants: np.ndarray, rate: float,
        rate_by: np.ndarray,
    ) -> None:  # fmt: skip
        """Add to the derivatives what the shifts of instants do at which forces jump."""
        instants, harmonics = whole.intervals.instants, fourier.harmonics_of(signals.shape[1])
        if not self._jumping[instants.guard].any():
            return
        about = self.motion(instants.angle, signals, constants, rate)
        sides = [
            np.array([
                np.broadcast_to(one, len(instants.angle))
                for one in evaluate(self._entries[: self.count], **about, bits=list(bits.T))
            ])
            for bits in (instants.before, instants.behind)
        ]  # fmt: skip
        jumps = sides[0] - sides[1]
        # a power of a depth isn't defined where rounding makes that negative, and doesn't jump
        jumps[~(np.abs(jumps) > ROUNDING * np.abs(sides).max(axis=0))] = 0.0
        if not jumps.any():
            return
        here = fourier.basis(instants.angle, harmonics)
        names = list(self.moving)
        for k in np.flatnonzero(jumps.any(axis=0)).tolist():
            one = _at(about, k)
            slopes = evaluate(
                self._gap_slopes[instants.guard[k]], **one, bits=instants.before[k].tolist()
            )
            by_signals = np.zeros(signals.shape)
            by_constants = np.array(slopes[len(names) :], float)
            for name, slope in zip(names, slopes, strict=False):
                state = self.moving[name]
                row = _derived(here[k][None], state.times)[0] * rate**state.times
                by_signals[state.signal] += slope * row
                by_constants += slope * state.times * one["states"][name] * rate_by
            shift = np.outer(jumps[:, k], _norm(harmonics) * here[k]) / -instants.slope[k]
            whole.by_signals[:] += shift[:, :, None, None] * by_signals
            whole.by_constants[:] += shift[:, :, None] * by_constants


def _is_zero(entry: Expr) -> bool:
    return entry.op == "const" and entry.payload == 0


def _is_linear(gap: Expr, slopes: Sequence[Expr], moving: Sequence[str]) -> bool:
    """True for a gap with constant derivatives by the moving states, and nothing else in it that
    varies.
    """
    if ex.depends_on(gap, ("time",)) or gap.bits:
        return False
    return not any(
        node.op == "state" and node.payload in moving for node in ex.walk(*slopes)
    )  # fmt: skip


def _at(about: Mapping[str, Any], k: int) -> dict[str, Any]:
    """Inputs of expressions at one of several angles."""
    states = {name: one[k] if np.ndim(one) else one for name, one in about["states"].items()}
    return {"t": about["t"][k], "states": states, "values": about["values"]}


@functools.lru_cache(maxsize=64)
def _norm(harmonics: int) -> np.ndarray:
    """Factors that make coefficients of integrals over the circle."""
    norm = np.full(2 * harmonics + 1, 1.0 / np.pi)
    norm[0] *= 0.5
    return norm


def _derived(block: np.ndarray, times: int) -> np.ndarray:
    """A matrix float64[n, 2H + 1] that multiplies a series, for one that multiplies it in place of
    the series' derivative: the adjoint of :func:`saltus.analysis.harmonics.series.derivative`.
    """
    return fourier.derivative(block, times) * (-1.0) ** times


def degree(roots: Sequence[Expr], moving: Collection[str]) -> float:
    """The highest power of moving states in expressions; inf if they are no polynomials."""
    known: dict[Expr, float] = {}
    for node in ex.walk(*roots, conditions=False):
        below = [known[one] for one in node.args]
        match node.op:
            case "state":
                known[node] = 1 if node.payload in moving else 0
            case "add" | "sub" | "neg" | "select":
                known[node] = max(below)
            case "mul":
                known[node] = sum(below)
            case "div":
                known[node] = below[0] if below[1] == 0 else math.inf
            case "pow":
                whole = node.args[1].op == "const" and float(node.args[1].payload) % 1 == 0
                power = float(node.args[1].payload) if whole else math.inf
                known[node] = 0 if not any(below) else below[0] * power if power > 0 else math.inf
            case _:
                known[node] = math.inf if any(below) else 0
    return max((known[root] for root in roots), default=0)
