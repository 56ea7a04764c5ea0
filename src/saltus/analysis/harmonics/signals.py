"""A system as harmonic balance sees it: the signals that it takes as unknown series, the forces
along them, and the linear response of the one to the other.

Of equations the signals are the states that are no derivatives of others. Of a structure they are
the deflections at its contacts, whatever its number of degrees of freedom is: the rest responds to
the forces there and to the drives by its dynamic stiffness. Krack & Gross, Harmonic Balance for
Nonlinear Vibration Problems (2019), section 2.5.
"""

from __future__ import annotations

import functools
from typing import Protocol

import numpy as np

from saltus.analysis.harmonics import series as fourier
from saltus.system import System

#: Largest ratio of the terms of a static stiffness that is inverted.
SINGULAR = 1e12


class Signals(Protocol):
    """See this file.

    Attributes
    ----------
    system : System
        Its rates are the forces, and its guards the boundaries.
    chains : list of list of int
        Of each signal the states of ``system`` that are it and its derivatives by time.
    forces : list of int
        The rates that are forces.
    """

    system: System
    chains: list[list[int]]
    forces: list[int]

    def response(self, harmonics: int, rate: float) -> tuple[np.ndarray, np.ndarray]:
        """Responses of the signals to the forces at each harmonic of an angle's rate [rad/s], real
        and imaginary parts float64[2, H + 1, c, m], and their derivatives by the rate, times the
        rate.
        """

    def own(self, harmonics: int) -> np.ndarray:
        """Factors of the amplitudes of the signals, float64[H + 1, c]."""

    def states(self, signals: np.ndarray, forces: np.ndarray | None, rate: float) -> np.ndarray:
        """The states of the motion, float64[D, 2H + 1], from the signals float64[c, 2H + 1] and the
        forces float64[m, 2H + 1], which those of equations don't need.
        """

    def of_states(self, states: np.ndarray) -> np.ndarray:
        """The signals, float64[c, ...], of states float64[D, ...]."""


def signals_of(system: System) -> Signals:
    """The signals of a system, as few as there are."""
    seen = system.interfaces
    if seen is not None and seen.field is system.field:
        stiffness = seen.dynamics[2]
        if np.linalg.cond(stiffness) < SINGULAR:
            return AtContacts(system)
    return States(system)


class States:
    """The signals of equations: the states that are no derivatives of others."""

    def __init__(self, system: System) -> None:
        self.system, self.chains = system, chains_of(system)
        self.forces = [chain[-1] for chain in self.chains]
        self._each = tuple(len(chain) for chain in self.chains)
        self._orders = np.array(self._each)

    def response(self, harmonics: int, rate: float) -> tuple[np.ndarray, np.ndarray]:
        """See :class:`Signals`. A mean isn't integrated: there the equation is that the mean of the
        force vanishes, over the rate for its unit.
        """
        whole = _integrals(harmonics, self._each) * (1.0 / rate**self._orders)[:, None]
        return whole, -self._orders[:, None] * whole

    def own(self, harmonics: int) -> np.ndarray:
        """See :class:`Signals`."""
        own = np.ones((harmonics + 1, len(self._orders)))
        own[0] = 0.0
        return own

    def states(
        self,
        signals: np.ndarray,
        forces: np.ndarray | None,  # noqa: ARG002
        rate: float,
    ) -> np.ndarray:
        """See :class:`Signals`."""
        found = np.zeros((len(self.system.states), signals.shape[1]))
        for signal, chain in zip(signals, self.chains, strict=True):
            for times, i in enumerate(chain):
                found[i] = fourier.derivative(signal, times) * rate**times
        return found

    def of_states(self, states: np.ndarray) -> np.ndarray:
        """See :class:`Signals`."""
        return states[[chain[0] for chain in self.chains]]


@functools.lru_cache(maxsize=64)
def _integrals(harmonics: int, orders: tuple[int, ...]) -> np.ndarray:
    """Factors of integrals of some orders over the angle, float64[2, H + 1, c, c]."""
    turns = np.arange(harmonics + 1) * 1j
    turns[0] = 1.0
    each = 1.0 / turns[:, None] ** np.array(orders)
    return _parts(each[:, :, None] * np.eye(len(orders)))


def _parts(amplitudes: np.ndarray) -> np.ndarray:
    """Real and imaginary parts, one behind the other."""
    return np.array([amplitudes.real, amplitudes.imag])


class AtContacts:
    """The signals of a structure: the deflections at its contacts."""

    def __init__(self, system: System) -> None:
        seen = system.interfaces
        values = {name: system.values[name] for name in seen.system.values}
        self.system = seen.system.with_values(**values)
        count, half = len(seen.signals), len(self.system.states) // 2
        self.chains = [[i, half + i] for i in range(count)]
        self.forces = list(range(half, 2 * half))
        self._signals, self._forced = seen.signals, seen.forced
        self._mass, self._damping, self._stiffness = seen.dynamics
        parts = (self._mass, self._damping, self._stiffness)
        self._plain = all(np.count_nonzero(one - np.diag(np.diag(one))) == 0 for one in parts)
        self._diagonals = [np.diag(one)[:, None] for one in parts]

    def _solved(self, angular: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Coordinates under forces complex128[h, r, m] at angular frequencies
        float64[h] [rad/s].
        """
        at = angular[:, None, None]
        if self._plain:
            mass, damping, stiffness = self._diagonals
            return np.asarray(right / (stiffness - at**2 * mass + 1j * at * damping))
        whole = self._stiffness - at**2 * self._mass + 1j * at * self._damping
        return np.linalg.solve(whole, right)

    def response(self, harmonics: int, rate: float) -> tuple[np.ndarray, np.ndarray]:
        """See :class:`Signals`."""
        angular = np.arange(harmonics + 1) * rate
        right = np.broadcast_to(self._forced.T + 0j, (harmonics + 1, *self._forced.T.shape))
        found, at = self._solved(angular, right), angular[:, None, None]
        slope = -2.0 * at**2 * (self._mass @ found) + 1j * at * (self._damping @ found)
        turned = self._solved(angular, slope)
        return _parts(self._signals @ found), _parts(-self._signals @ turned)

    def own(self, harmonics: int) -> np.ndarray:
        """See :class:`Signals`."""
        return np.ones((harmonics + 1, len(self.chains)))

    def states(self, signals: np.ndarray, forces: np.ndarray | None, rate: float) -> np.ndarray:
        """See :class:`Signals`."""
        assert forces is not None
        angular = np.arange(fourier.harmonics_of(signals.shape[1]) + 1) * rate
        pushed = (self._forced.T @ fourier.to_complex(forces)).T[:, :, None]
        found = fourier.of_complex(self._solved(angular, pushed)[:, :, 0].T)
        return np.concatenate([found, fourier.derivative(found) * rate])

    def of_states(self, states: np.ndarray) -> np.ndarray:
        """See :class:`Signals`."""
        return np.asarray(self._signals @ states[: len(states) // 2])


def chains_of(system: System) -> list[list[int]]:
    """States that are derivatives of each other by time, each from the signal to its highest
    derivative.
    """
    places = {name: i for i, name in enumerate(system.states)}
    follows = {
        i: places[str(entry.payload)] for i, entry in enumerate(system.field) if entry.op == "state"
    }
    taken: dict[int, int] = {}
    for i, j in follows.items():
        taken.setdefault(j, i)
    follows = {i: j for i, j in follows.items() if taken[j] == i and i != j}
    behind = set(follows.values())
    found: list[list[int]] = []
    for first in range(len(system.states)):
        if first in behind:
            continue
        chain = [first]
        while chain[-1] in follows:
            chain.append(follows[chain[-1]])
        found.append(chain)
    return found
