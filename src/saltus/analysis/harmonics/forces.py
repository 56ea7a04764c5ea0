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
from saltus.analysis.harmonics.pieces import Intervals, intervals_of, series_of
from saltus.analysis.harmonics.powers import bends, degree
from saltus.analysis.harmonics.sums import LinearSide, Sums
from saltus.codegen.forces_head import forces_text
from saltus.codegen.module import balance_module
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
    """

    whole: np.ndarray
    signals: int

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
        self._entries = (*forces, *(self._slopes[i][j] for i, j in self._known))
        smooth = math.isfinite(degree(forces, self.moving, 1, 1))
        self._bent = 0 if smooth else bends(forces, system.values)
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
        gaps = [guard.gap for guard in system.guards]
        self._polynomial = [
            i for i, others in self._asked.items()
            if i not in self._linear and not others
            and math.isfinite(degree([gaps[i]], self.moving, 1, 1))
        ]  # fmt: skip
        #: whether the kernel finds the instants: no boundary asks for the sides of others
        self.cut_in_kernel = len(self._linear) + len(self._polynomial) == len(self._asked)
        self._known_sums: dict[tuple[int, int, int], Sums] = {}
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
            if is_hold(guard):  # its gap may ask for the sides of guards behind it
                bits.append(np.zeros(TRIED, bool))
                continue
            (gap,) = evaluate([guard.gap], **about, bits=bits)
            bits.append(np.broadcast_to(gap > 0, TRIED))
        both = []
        for bits[i] in (np.zeros(TRIED, bool), np.ones(TRIED, bool)):
            forces = evaluate(self._entries[: self.count], **about, bits=bits)
            both.append([np.broadcast_to(one, TRIED) for one in forces])
        return np.array(both)

    def nodes(
        self, intervals: Intervals, harmonics: int
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See :meth:`Intervals.nodes`: for products of the forces and a harmonic."""
        return intervals.nodes(self._products(harmonics), self._bent)

    def _products(self, harmonics: int) -> int:
        """Degree of products of the forces and a harmonic."""
        drive = MULTIPLES * self.periods
        if self._bent:
            return (UNEVEN + 1) * harmonics + drive
        forces = self._entries[: self.count]
        return max(int(degree(forces, self.moving, harmonics, drive)), harmonics) + harmonics

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
        sums = self._along(signals, constants, rate, rate_by, None)
        return Coefficients(sums.whole.copy(), len(signals))

    def equations(
        self, signals: np.ndarray, constants: np.ndarray, rate: float, rate_by: np.ndarray,
        linear: LinearSide,
    ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """Residual ``own X - L W`` along a motion, float64[c (2H + 1)], and its derivative by the
        signals and u more unknowns, float64[c (2H + 1), c (2H + 1) + u].
        """
        sums = self._along(signals, constants, rate, rate_by, linear)
        return sums.residual.copy(), sums.derivative.copy()

    def _along(
        self, signals: np.ndarray, constants: np.ndarray, rate: float, rate_by: np.ndarray,
        linear: LinearSide | None,
    ) -> Sums:  # fmt: skip
        """The sums along a motion."""
        unknowns = 0 if linear is None else linear.turning.shape[1]
        sums = self._sums(len(signals), fourier.harmonics_of(signals.shape[1]), unknowns)
        gaps = intervals = None
        if self.cut_in_kernel:
            gaps = self._gap_rows or self._rows(constants)
        else:
            intervals = self.intervals(signals, constants, rate)
        pace = self.turn / (2 * np.pi)
        sums.take(signals, constants, rate, rate_by, pace, linear, gaps, intervals)
        return sums

    def _sums(self, signals: int, harmonics: int, unknowns: int) -> Sums:
        key = signals, harmonics, unknowns
        if key not in self._known_sums:
            numbers = np.append(self._numbers, self._polynomial).astype(np.int64)
            self._known_sums[key] = Sums(
                self._kernel, (signals, harmonics, len(self.constants), unknowns),
                [(one.signal, one.times) for one in self.moving.values()], self._known, self.count,
                self._jumping, numbers, len(self._numbers), self._highest(harmonics),
                np.array(list(self.system.values.values()), float),
                self._products(harmonics), self._bent,
            )  # fmt: skip
        return self._known_sums[key]

    def _highest(self, harmonics: int) -> int:
        """The highest harmonic of gaps that are polynomials, along motions of some harmonics."""
        most, none = harmonics, np.zeros(len(self.system.guards), bool)
        resting, constants = np.ones(len(self.moving)), np.ones(len(self.constants))
        for guard in (self.system.guards[i] for i in self._polynomial):
            drive = fourier.harmonics_of(len(series_of(
                self.system.name, guard,
                lambda angle: self.motion(angle, np.tile(resting, (len(angle), 1)), constants),
                self.periods, none,
            )))  # fmt: skip
            most = max(most, int(degree([guard.gap], self.moving, harmonics, drive)))
        return most

    @functools.cached_property
    def _kernel(self) -> Any:
        names, system = (*self.moving, *self.constants), self.system
        slopes = [one for row in self._gap_slopes for one in row]
        gaps = [system.guards[i].gap for i in self._polynomial]
        text = forces_text(self._entries, slopes, gaps, names, list(system.values))
        return balance_module(text, system.name)


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
