"""Fourier coefficients of forces along a truncated motion, and their derivatives.

The integrals run from instant to instant at which a boundary is met, so that no kink or jump lies
inside one: they are sums of Gauss's rule to rounding, exact for springs and other polynomials. What
is truncated is the motion alone. Where a force jumps, the instant's own shift adds to the
derivative.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.analysis.harmonics import series as fourier
from saltus.analysis.harmonics.pieces import Intervals, intervals_of
from saltus.analysis.harmonics.powers import bends, degree
from saltus.contact.guards import bits_in, is_hold
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
#: Distance from an instant within which depths are rounding [rad].
BESIDE = 1e-12
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
    whole : float64[m, 2H + 1, 1 + c (2H + 1) + e]
        Behind one another :attr:`values`, :attr:`by_signals` and :attr:`by_constants`.
    signals : int
        Number of the signals.
    intervals : Intervals
        The motion between the boundaries that it meets.
    """

    whole: np.ndarray
    signals: int
    intervals: Intervals

    @property
    def values(self) -> np.ndarray:
        """The coefficients, float64[m, 2H + 1]."""
        return self.whole[:, :, 0]

    @property
    def by_signals(self) -> np.ndarray:
        """Their derivatives with respect to the coefficients of the signals,
        float64[m, 2H + 1, c, 2H + 1].
        """
        forces, width, _ = self.whole.shape
        mine = self.whole[:, :, 1 : 1 + self.signals * width]
        return mine.reshape(forces, width, self.signals, width)

    @property
    def by_constants(self) -> np.ndarray:
        """With respect to the states that don't move, float64[m, 2H + 1, e]."""
        return self.whole[:, :, 1 + self.signals * self.whole.shape[1] :]


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
        # those by moving states first
        self._known = [
            (i, j) for mine in (True, False) for i, row in enumerate(self._slopes)
            for j, one in enumerate(row) if not _is_zero(one) and mine == (j < len(self.moving))
        ]  # fmt: skip
        self._by_moving = sum(j < len(self.moving) for _, j in self._known)
        self._entries = (*forces, *(self._slopes[i][j] for i, j in self._known))
        self._degree = degree(forces, self.moving)
        self._bent = bends(forces, system.values) if math.isinf(self._degree) else 0
        states, rows = list(self.moving), enumerate(self._gap_slopes)
        linear = [
            i for i, row in rows if _is_linear(system.guards[i].gap, row[: len(states)], states)
        ]
        self._linear = {i: self._gap_slopes[i][: len(states)] for i in linear}
        self._numbers = np.array(linear, np.int64)
        self._gap_entries = [
            one for i, row in self._linear.items() for one in (system.guards[i].gap, *row)
        ]
        self._asked = {
            i: sorted(bits_in([guard.gap]))
            for i, guard in enumerate(system.guards) if not is_hold(guard)
        }  # fmt: skip
        self._rest = dict.fromkeys(states, 0.0)
        self._signal = np.array([one.signal for one in self.moving.values()])
        self._times = np.array([one.times for one in self.moving.values()])

    def states(self, signals: np.ndarray, rate: float) -> np.ndarray:
        """The series of the states that move, float64[s, 2H + 1]."""
        found = signals[self._signal]
        for times in range(1, self._times.max() + 1):
            mine = self._times == times
            found[mine] = fourier.derivative(found[mine], times) * rate**times
        return np.asarray(found)

    def motion(self, angle: np.ndarray, seen: np.ndarray, constants: np.ndarray) -> dict[str, Any]:
        """Inputs of expressions at angles float64[n], but for the bits: states that move
        float64[n, s] and those that don't float64[e].
        """
        states = dict(zip(self.moving, seen.T, strict=True))
        states |= dict(zip(self.constants, constants, strict=True))
        return {
            "t": angle * (self.turn / (2 * np.pi)),
            "states": states,
            "values": self.system.values,
        }

    def intervals(self, signals: np.ndarray, constants: np.ndarray, rate: float) -> Intervals:
        """A motion between the boundaries that it meets."""
        states, harmonics = self.states(signals, rate), fourier.harmonics_of(signals.shape[1])
        return intervals_of(
            self.system.name,
            self.system.guards,
            self._asked,
            self._gaps(states, constants),
            lambda angle: self.motion(angle, fourier.basis(angle, harmonics) @ states.T, constants),
            harmonics,
        )

    def _gaps(self, states: np.ndarray, constants: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The guards whose gaps are linear in the moving states, int64[g], and the series of these,
        float64[g, 2H + 1].
        """
        level, slope = self._gap_rows or self._rows(constants)
        gaps = slope @ states
        gaps[:, 0] += level
        return self._numbers, gaps

    def _rows(self, constants: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Levels of these gaps at rest float64[g], and slopes by the moving states
        float64[g, s].
        """
        resting = self._rest | dict(zip(self.constants, constants, strict=True))
        found = evaluate(self._gap_entries, states=resting, values=self.system.values)
        rows = np.reshape(np.array(found, float), (len(self._linear), 1 + len(self.moving)))
        return rows[:, 0], rows[:, 1:]

    @functools.cached_property
    def _gap_rows(self) -> tuple[np.ndarray, np.ndarray] | None:
        """The same where they don't depend on the states that don't move."""
        moved = any(
            node.op == "state" and node.payload in self.constants
            for node in ex.walk(*self._gap_entries)
        )
        return None if moved else self._rows(np.zeros(len(self.constants)))

    @functools.cached_property
    def _jumping(self) -> np.ndarray:
        """Boundaries at which a force may jump, bool[guards]: it does at random states on a
        boundary whose gap is linear; of others it isn't asked.
        """
        random, names = np.random.default_rng(0), list(self.moving)
        found = np.ones(len(self.system.guards), bool)
        for i, slopes in self._linear.items():
            column = next((j for j, one in enumerate(slopes) if not _is_zero(one)), None)
            if column is None:
                continue
            states = {
                name: random.uniform(0.5, 2.0, TRIED) * random.choice([-1.0, 1.0], TRIED)
                for name in (*names, *self.constants)
            }
            states |= {name: np.abs(states[name]) for name in self.constants}
            wanted = [self.system.guards[i].gap, slopes[column]]
            about: dict[str, Any] = {"t": random.uniform(0, 1, TRIED), "values": self.system.values}
            gap, slope = evaluate(wanted, **about, states=states)
            aside = self._on_both_sides(i, about | {"states": dict(states)})
            states[names[column]] = states[names[column]] - gap / slope
            both = self._on_both_sides(i, about | {"states": states})
            # a power of a depth isn't defined where rounding makes that negative
            apart = np.nan_to_num(np.abs(both[0] - both[1]))
            # of a spring alone nothing but rounding is left on the boundary
            size = np.nan_to_num(np.abs([both, aside])).max(axis=(0, 1, 3))
            found[i] = (apart > ROUNDING * size[:, None]).any()
        return found

    def _on_both_sides(self, i: int, about: dict[str, Any]) -> np.ndarray:
        """The forces where a guard's side is taken as either, float64[2, m, TRIED]."""
        bits: list[Any] = []
        for guard in self.system.guards:
            (gap,) = evaluate([guard.gap], **about, bits=bits)
            bits.append(np.broadcast_to(gap > 0, TRIED) & (not is_hold(guard)))
        both = []
        for bits[i] in (np.zeros(TRIED, bool), np.ones(TRIED, bool)):
            forces = evaluate(self._entries[: self.count], **about, bits=bits)
            both.append([np.broadcast_to(one, TRIED) for one in forces])
        return np.array(both)

    def nodes(
        self, intervals: Intervals, harmonics: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See :meth:`Intervals.nodes`: for products of the forces and a harmonic."""
        most = UNEVEN if self._bent else max(int(self._degree), 1)
        return intervals.nodes((most + 1) * harmonics + MULTIPLES * self.periods, self._bent)

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
        harmonics, c = fourier.harmonics_of(signals.shape[1]), len(signals)
        width, states = 2 * harmonics + 1, self.states(signals, rate)
        angle, weight, which = self.nodes(intervals, harmonics)
        here, kept = fourier.basis(angle, 2 * harmonics), _kept(harmonics)
        seen = here[:, kept] @ states.T
        values = evaluate(
            self._entries, **self.motion(angle, seen, constants), bits=list(intervals.bits[which].T)
        )
        found = np.empty((len(values), len(angle)))
        for row, value in zip(found, values, strict=True):
            row[:] = value
        if self._bent:  # a power of a depth isn't defined where rounding makes that negative
            begin = intervals.begin[which]
            aside = np.minimum(angle - begin, begin + intervals.length[which] - angle) < BESIDE
            found[:, aside] = np.nan_to_num(found[:, aside], posinf=0.0, neginf=0.0)
        integrals = (found * (weight / np.pi)) @ here
        series = integrals[:, kept]
        series[:, 0] *= 0.5
        whole = Coefficients(
            np.zeros((self.count, width, 1 + c * width + len(constants))), c, intervals
        )
        whole.values[:], by_constants = series[: self.count], whole.by_constants
        moving = len(self.moving)
        blocks = fourier.products(integrals[self.count :][: self._by_moving], harmonics)
        for (i, j), slope in zip(self._known, series[self.count :], strict=True):
            if j >= moving:
                by_constants[i, :, j - moving] += slope
        for (i, j), block in zip(self._known, blocks, strict=False):
            times, first = self._times[j], 1 + self._signal[j] * width
            mine = fourier.before_derivative(block, times) * rate**times
            whole.whole[i, :, first : first + width] += mine
            if times:
                by_constants[i] += np.outer(block @ states[j], times * rate_by)
        if len(intervals.instants.angle):
            self._add_jumps(whole, states, constants, rate, rate_by)
        return whole

    def _add_jumps(
        self, whole: Coefficients, states: np.ndarray, constants: np.ndarray, rate: float,
        rate_by: np.ndarray,
    ) -> None:  # fmt: skip
        """Add to the derivatives what the shifts of instants do at which forces jump."""
        instants, harmonics = whole.intervals.instants, fourier.harmonics_of(states.shape[1])
        if not self._jumping[instants.guard].any():
            return
        here = fourier.basis(instants.angle, harmonics)
        about = self.motion(instants.angle, here @ states.T, constants)
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
        jumps[:, ~self._jumping[instants.guard]] = 0.0
        moving, width = len(self.moving), here.shape[1]
        for k in np.flatnonzero(jumps.any(axis=0)).tolist():
            one = _at(about, k)
            slopes = np.array(
                evaluate(
                    self._gap_slopes[instants.guard[k]], **one, bits=instants.before[k].tolist()
                ), float,
            )  # fmt: skip
            row = np.zeros(whole.whole.shape[2])
            row[1 + whole.signals * width :] = slopes[moving:]
            for j, slope in enumerate(slopes[:moving]):
                times, first = self._times[j], 1 + self._signal[j] * width
                mine = fourier.before_derivative(here[k], times) * rate**times
                row[first : first + width] += slope * mine
                row[1 + whole.signals * width :] += slope * times * (here[k] @ states[j]) * rate_by
            shift = np.outer(jumps[:, k], _norm(harmonics) * here[k]) / -instants.slope[k]
            whole.whole[:] += shift[:, :, None] * row


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
def _kept(harmonics: int) -> np.ndarray:
    """Places of the coefficients of a series in one of twice the harmonics."""
    return np.asarray(np.r_[: harmonics + 1, 2 * harmonics + 1 : 3 * harmonics + 1])


@functools.lru_cache(maxsize=64)
def _norm(harmonics: int) -> np.ndarray:
    """Factors that make coefficients of integrals over the circle."""
    norm = np.full(2 * harmonics + 1, 1.0 / np.pi)
    norm[0] *= 0.5
    return norm
