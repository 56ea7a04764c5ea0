"""The equations of harmonic balance: a periodic motion as truncated Fourier series.

The residual of the equations of motion has no component along any of the harmonics kept. Written as
``own X - L W(X) = 0``: X are the series of the signals, W those of the forces along them, and L is
the linear response at each harmonic, so that residuals are in units of the motion. Krack & Gross,
Harmonic Balance for Nonlinear Vibration Problems (2019), chapter 2.
"""

from __future__ import annotations

import copy
import functools
from typing import Self

import numpy as np

from saltus.analysis.harmonics import series as fourier
from saltus.analysis.harmonics.forces import DerivedState, Forces
from saltus.analysis.harmonics.pieces import Intervals
from saltus.analysis.harmonics.signals import States, signals_of
from saltus.analysis.harmonics.sums import LinearSide
from saltus.system import System
from saltus.system.parametric import parametric

#: Motions whose states and boundaries are remembered.
REMEMBERED = 4096


class HarmonicOrbits:
    """Curves of periodic motions of H harmonics over one parameter; a ``CurveEquations``, and what
    a branch asks of the equations of its orbits.

    Unknowns z: the series of each signal, one after the other, then the parameters [SI].

    Parameters
    ----------
    system : System
        With forcing; its equations and values are those of all curves.
    names : tuple of str
        The parameters that are unknown, the forcing frequency first.
    harmonics : int
        Of the fundamental frequency.
    periods : int
        Forcing periods in one of the fundamental.
    scale : float64[k, z]
        Units of the unknowns.
    symmetric : bool
        Whether mirror images of motions are motions: see system/symmetry.py.
    """

    n: int = 1
    free: bool = False

    def __init__(
        self, system: System, names: tuple[str, ...], harmonics: int, periods: int,
        scale: np.ndarray,
        symmetric: bool = False,
    ) -> None:  # fmt: skip
        self.system, self.names, self.scale = system, names, scale
        self.harmonics, self.periods, self.symmetric = harmonics, periods, symmetric
        self.series = 2 * harmonics + 1
        self.source = signals_of(system)
        known = parametric(self.source.system, names)
        self._timed, inner, self._unity = known.timed, known.system, np.eye(len(names))
        self.count, states = len(self.source.chains), self.source.system.states
        self.size = self.count * self.series  # unknowns of a motion
        moving = {
            states[i]: DerivedState(signal, times)
            for signal, chain in enumerate(self.source.chains) for times, i in enumerate(chain)
        }  # fmt: skip
        self._remembered: dict[bytes, tuple[np.ndarray, Intervals]] = {}
        self.turn = periods * (1.0 if self._timed else float(system.period()))
        own = self.source.own(harmonics)
        self._own = np.concatenate([own, own[1:]]).T.ravel()
        forces = [inner.field[i] for i in self.source.forces]
        self.forces = Forces(inner, forces, moving, inner.states[len(states) :], self.turn, periods)

    @property
    def width(self) -> int:
        """Number of unknowns."""
        return self.size + len(self.names)

    # -- unknowns ----------------------------------------------------------------------------------
    def signals(self, z: np.ndarray) -> np.ndarray:
        """The series of the signals, float64[..., c, 2H + 1]."""
        return z[..., : self.size].reshape(*z.shape[:-1], -1, self.series)

    def values(self, z: np.ndarray) -> np.ndarray:
        """The parameter of motions float64[..., z], float64[..., 1]."""
        return z[..., self.size :]

    def period(self, z: np.ndarray) -> np.ndarray:
        """The period of motions float64[..., z] [s], float64[...]."""
        if self.names[0] != self.system.forced_at:
            return np.full(z.shape[:-1], self.periods * self.system.period())
        return np.asarray(self.periods * self.system.period({self.names[0]: z[..., self.size]}))

    def _constants(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
        """The states that don't move, their derivatives by the unknowns beside the signals
        float64[e, u], the rate of the angle [rad/s], and its derivatives by these states over
        itself.
        """
        constants, by = z[self.size :].copy(), np.zeros(len(self.names))
        slopes = self._unity.copy()
        if not self._timed:
            return constants, slopes, 2 * np.pi / self.turn, by
        period = float(self.system.period({self.names[0]: constants[0]}))
        slopes[0, 0], by[0] = -period / constants[0], -1.0 / period
        constants[0] = period
        return constants, slopes, 2 * np.pi / (self.periods * period), by

    def states(self, z: np.ndarray) -> np.ndarray:
        """The series of the states of a motion float64[z], float64[D, 2H + 1]."""
        return self._along(z)[0]

    def intervals(self, z: np.ndarray) -> Intervals:
        """A motion float64[z] between the boundaries that it meets."""
        return self._along(z)[1]

    def _along(self, z: np.ndarray) -> tuple[np.ndarray, Intervals]:
        """The states and intervals of a motion, remembered."""
        key = z.tobytes()
        if key not in self._remembered:
            constants, _, rate, rate_by = self._constants(z)
            signals, forces = self.signals(z), None
            if not isinstance(self.source, States):
                found = self.forces.coefficients(signals, constants, rate, rate_by)
                forces = found.values / self._pace(constants)
            if len(self._remembered) >= REMEMBERED:
                self._remembered.clear()
            self._remembered[key] = (
                self.source.states(signals, forces, rate),
                self.forces.intervals(signals, constants, rate),
            )
        return self._remembered[key]

    def _pace(self, constants: np.ndarray) -> float:
        """Factor of the rates of the equations."""
        return float(constants[0]) if self._timed else 1.0

    def points(self, z: np.ndarray) -> np.ndarray:
        """States at whole forcing periods of motions float64[..., z], float64[..., n, D]."""
        flat = z.reshape(-1, z.shape[-1])
        here = fourier.basis(2 * np.pi * np.arange(self.periods) / self.periods, self.harmonics)
        found = np.array([here @ self.states(one).T for one in flat])
        return found.reshape(*z.shape[:-1], self.periods, -1)

    def samples(self, z: np.ndarray) -> np.ndarray:
        """The states of a motion float64[z] at equidistant angles, float64[n, D]."""
        return np.asarray(self._circle @ self.states(z).T)

    def seen(self, signals: np.ndarray) -> np.ndarray:
        """The signals of a motion float64[size] at equidistant angles, float64[n, c]."""
        return np.asarray(self._circle @ signals.reshape(self.count, -1).T)

    @functools.cached_property
    def _circle(self) -> np.ndarray:
        """The basis at equidistant angles, eight for each harmonic."""
        count = 8 * (self.harmonics + 1)
        return fourier.basis(2 * np.pi * np.arange(count) / count, self.harmonics)

    @functools.cached_property
    def odd(self) -> np.ndarray:
        """True for unknowns of odd harmonics, empty in motions of half the period, bool[z]."""
        order = np.concatenate([np.arange(self.harmonics + 1), np.arange(1, self.harmonics + 1)])
        mine = np.tile(order % 2 == 1, self.count)
        return np.append(mine, np.zeros(self.width - self.size, bool))

    def of_states(self, states: np.ndarray, value: float) -> np.ndarray:
        """The unknowns of a motion with series of the states float64[D, 2h + 1]."""
        signals = fourier.resized(self.source.of_states(states), self.harmonics)
        return np.append(signals.ravel(), value)

    # -- equations ---------------------------------------------------------------------------------
    def evaluate(self, z: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See :class:`saltus.analysis.branches.equations.CurveEquations`."""
        residual, derivative = np.empty(z.shape)[:, 1:], np.empty((*z.shape, z.shape[1]))[:, 1:]
        for i, (one, unit) in enumerate(zip(z, self.scale[rows], strict=True)):
            if not np.isfinite(one).all():
                residual[i], derivative[i] = np.nan, np.nan
                continue
            found, slopes = self._of(one)
            each = unit[:-1]
            np.divide(found, each, out=residual[i])
            np.multiply(slopes, unit, out=derivative[i])
            derivative[i] /= each[:, None]
        return residual, derivative

    def _of(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The residual and its derivative, in units of the motion."""
        constants, slopes, rate, rate_by = self._constants(z)
        pace = self._pace(constants)
        response, by_rate = self.source.response(self.harmonics, rate)
        linear = LinearSide(self._own, response, by_rate, slopes, pace, self._timed)
        return self.forces.equations(self.signals(z), constants, rate, rate_by, linear)

    def accepted(self, z: np.ndarray, rows: np.ndarray) -> None:
        """Nothing depends on it."""

    def near(self, z: np.ndarray, rows: np.ndarray) -> Self:  # noqa: ARG002
        """The equations whose row i is curve rows[i], int64[r]."""
        other = copy.copy(self)
        other.scale = self.scale[rows]
        return other

    def alike(self, z: np.ndarray, rows: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """The same motions from each whole forcing period on, float64[r, n, z]."""
        angles = 2 * np.pi * np.arange(self.periods) / self.periods
        return np.stack([self._shifted(z, angle) for angle in angles], axis=1)

    def mirrored(self, z: np.ndarray) -> np.ndarray:
        """The mirror images -x(t + T/2) of motions float64[r, z]."""
        return self._shifted(z, np.pi / self.periods, -1.0)

    def _shifted(self, z: np.ndarray, angle: float, factor: float = 1.0) -> np.ndarray:
        moved = factor * fourier.shifted(self.signals(z), angle)
        return np.concatenate([moved.reshape(len(z), -1), z[:, self.size :]], axis=1)
