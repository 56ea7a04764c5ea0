"""The numbers of motions of a few harmonics: extremes, means, contacts, how near they come to a
graze.
"""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from saltus.analysis.closed.measures import Measures, unknown
from saltus.analysis.harmonics import series as fourier
from saltus.analysis.harmonics.equations import HarmonicOrbits
from saltus.analysis.harmonics.pieces import Intervals
from saltus.analysis.inputs.outputs import Outputs
from saltus.system.modes import mode_number

#: Angles at which an extreme is looked for first, for each harmonic.
ANGLES = 16
#: Places between the neighbours of the best one, in each of the next rounds.
PLACES = 33
#: Rounds: the place of an extreme is known to the root of rounding, the extreme to rounding.
ROUNDS = 5


def measured(orbits: HarmonicOrbits, z: np.ndarray, outputs: Outputs) -> Measures:
    """The numbers of motions float64[r, z]."""
    result = unknown(len(z), len(orbits.system.states), len(outputs))
    for i, one in enumerate(z):
        _Motion(orbits, one, outputs).put(result, i)
    return result


def amplitudes(orbits: HarmonicOrbits, z: np.ndarray, outputs: Outputs) -> np.ndarray:
    """Amplitudes c of ``Re(c exp(i k angle))`` of the outputs of a motion float64[z], k = 0 to H,
    complex128[K, H + 1].
    """
    motion = _Motion(orbits, z, outputs)
    angle, weight, which = orbits.forces.nodes(motion.intervals, orbits.harmonics)
    turned = np.exp(-1j * np.outer(np.arange(orbits.harmonics + 1), angle)) * (weight / np.pi)
    turned[0] *= 0.5
    return np.asarray((turned @ motion.values(angle, which)).T)


class _Motion:
    """One motion, and outputs along it."""

    def __init__(self, orbits: HarmonicOrbits, z: np.ndarray, outputs: Outputs) -> None:
        self.orbits, self.outputs = orbits, outputs
        self.states = orbits.states(z)
        self.intervals: Intervals = orbits.intervals(z)
        self.period = float(orbits.period(z))
        known = dict(orbits.system.values) | {orbits.names[0]: float(orbits.values(z)[0])}
        self.parameters: dict[str, Any] = known

    def values(self, angle: np.ndarray, which: np.ndarray | None = None) -> np.ndarray:
        """The outputs at angles float64[n] in some of the intervals, float64[n, K]."""
        here = fourier.basis(angle, self.orbits.harmonics)
        bits = self.intervals.bits[self.intervals.of(angle) if which is None else which]
        time = angle * (self.period / (2 * np.pi))
        return self.outputs.values(time, here @ self.states.T, self.parameters, mode_number(bits.T))

    def put(self, result: Measures, row: int) -> None:
        """Write its numbers into a row."""
        intervals, periods = self.intervals, self.orbits.periods
        angle, weight, which = self.orbits.forces.nodes(intervals, self.orbits.harmonics)
        share, values = weight / (2 * np.pi), self.values(angle, which)
        result.mean[row] = share @ values
        values = values - result.mean[row]
        result.deviation[row] = np.sqrt(share @ values**2)
        result.harmonic[row] = 2.0 * ((share * np.exp(-1j * periods * angle)) @ values)
        result.maximum[row], result.minimum[row] = self._extremes(1.0), -self._extremes(-1.0)
        instants = intervals.instants
        result.contacts[row] = len(instants.angle) / periods
        names = [guard.name for guard in self.orbits.system.guards]
        result.itinerary[row] = " ".join(
            f"{names[number]}{'+' if slope > 0 else '-'}"
            for number, slope in zip(instants.guard, instants.slope, strict=True)
        )
        which, turns, _ = fourier.zeros_of(fourier.derivative(intervals.gaps))
        here = fourier.basis(turns, fourier.harmonics_of(intervals.gaps.shape[1]))
        gaps = np.abs(np.einsum("ri,ri->r", here, intervals.gaps[which]))
        each = [gaps[which == number] for number in np.unique(which)]
        result.margin[row] = gaps.min(initial=np.inf)
        result.span[row] = max(map(np.ptp, each), default=0.0)

    def _extremes(self, sign: float) -> np.ndarray:
        """The largest values of the outputs times a sign, float64[K]: of states where they turn,
        of functions looked for ever nearer to the best place.
        """
        count, states = ANGLES * (self.orbits.harmonics + 1), len(self.states)
        angle, half = 2 * np.pi * np.arange(count) / count, 2 * np.pi / count
        found = sign * self.values(angle)
        high, best = found.max(axis=0), angle[np.argmax(found, axis=0)][states:]
        turned = sign * fourier.basis(self._turns, self.orbits.harmonics) @ self.states.T
        high[:states] = np.maximum(high[:states], turned.max(axis=0, initial=-np.inf))
        functions = len(best)
        for _ in range(ROUNDS if functions else 0):
            around = best[:, None] + half * np.linspace(-1.0, 1.0, PLACES)
            found = sign * self.values(around.ravel())[:, states:]
            own = found.reshape(functions, PLACES, functions)
            own = own[np.arange(functions), :, np.arange(functions)]
            best = around[np.arange(functions), own.argmax(axis=1)]
            high[states:] = np.maximum(high[states:], own.max(axis=1))
            half *= 2.0 / (PLACES - 1)
        return np.asarray(high)

    @functools.cached_property
    def _turns(self) -> np.ndarray:
        """Angles at which a state turns."""
        return fourier.zeros_of(fourier.derivative(self.states))[1]
