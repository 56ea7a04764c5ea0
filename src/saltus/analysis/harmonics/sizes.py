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
from saltus.system import margin_gaps
from saltus.system.modes import mode_number

#: Angles at which an extreme is looked for first, for each harmonic.
ANGLES = 16
#: An output that is off by a smaller share of its size is a series of the harmonics.
ROUNDING = 1e-12
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
    return _Motion(orbits, z, outputs).amplitudes()


@functools.lru_cache(maxsize=16)
def _even(harmonics: int) -> tuple[np.ndarray, np.ndarray]:
    """Equidistant angles, and the basis there."""
    angle = 2 * np.pi * np.arange(ANGLES * (harmonics + 1)) / (ANGLES * (harmonics + 1))
    return angle, fourier.basis(angle, harmonics)


class _Motion:
    """One motion, and outputs along it."""

    def __init__(self, orbits: HarmonicOrbits, z: np.ndarray, outputs: Outputs) -> None:
        self.orbits, self.outputs = orbits, outputs
        self.states = orbits.states(z)
        self.intervals: Intervals = orbits.intervals(z)
        self.period = float(orbits.period(z))
        own = dict(zip(orbits.names, orbits.values(z).tolist(), strict=True))
        self.parameters: dict[str, Any] = dict(orbits.system.values) | own
        angle, here = _even(orbits.harmonics)
        self.even, self.series = here @ self.states.T, self.states
        #: outputs that are no series of these harmonics, such as forces of contacts
        self.others = np.zeros(0, np.int64)
        if outputs.formulas:
            self.even = self._read(angle, self.even, self.intervals.of(angle))
            others = fourier.of_samples(self.even[:, len(self.states) :].T, orbits.harmonics)
            self.series = np.append(self.states, others, axis=0)
            off = np.abs(self.even - here @ self.series.T).max(axis=0)
            self.others = np.flatnonzero(~(off <= ROUNDING * np.abs(self.even).max(axis=0)))
            self.others = self.others[self.others >= len(self.states)]

    def values(self, angle: np.ndarray, which: np.ndarray | None = None) -> np.ndarray:
        """The outputs at angles float64[n] in some of the intervals, float64[n, K]."""
        here = fourier.basis(angle, self.orbits.harmonics)
        which = self.intervals.of(angle) if which is None else which
        return self._read(angle, here @ self.states.T, which)

    def _read(self, angle: np.ndarray, states: np.ndarray, which: np.ndarray) -> np.ndarray:
        """The outputs where the states are float64[n, D]."""
        time, mode = angle * (self.period / (2 * np.pi)), mode_number(self.intervals.bits[which].T)
        return self.outputs.values(time, states, self.parameters, mode)

    @functools.cached_property
    def _within(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Angles between the instants, their shares of the period, and the other outputs there."""
        angle, weight, which = self.orbits.forces.nodes(self.intervals, self.orbits.harmonics)
        return angle, weight / (2 * np.pi), self.values(angle, which)[:, self.others]

    def amplitudes(self) -> np.ndarray:
        """See :func:`amplitudes`."""
        found = fourier.to_complex(self.series)
        if len(self.others):
            angle, share, values = self._within
            turned = np.exp(-1j * np.outer(np.arange(found.shape[1]), angle)) * (2.0 * share)
            turned[0] *= 0.5
            found[self.others] = (turned @ values).T
        return found

    def put(self, result: Measures, row: int) -> None:
        """Write its numbers into a row."""
        intervals, periods, found = self.intervals, self.orbits.periods, self.amplitudes()
        result.mean[row] = found[:, 0].real
        result.deviation[row] = np.sqrt(0.5 * (np.abs(found[:, 1:]) ** 2).sum(axis=1))
        result.harmonic[row] = found[:, periods] if periods < found.shape[1] else 0.0
        if len(self.others):
            _, share, values = self._within
            result.deviation[row, self.others] = np.sqrt(share @ (values - share @ values) ** 2)
        result.maximum[row], result.minimum[row] = self._extremes(1.0), -self._extremes(-1.0)
        instants = intervals.instants
        result.contacts[row] = len(instants.angle) / periods
        names = [guard.name for guard in self.orbits.system.guards]
        result.itinerary[row] = " ".join(
            f"{names[number]}{'+' if slope > 0 else '-'}"
            for number, slope in zip(instants.guard, instants.slope, strict=True)
        )
        which, _, gaps = _turns(intervals.gaps)
        counted = np.isin(which, margin_gaps(self.orbits.system)[0])
        which, gaps = which[counted], np.abs(gaps[counted])
        each = [gaps[which == number] for number in np.unique(which)]
        result.margin[row] = gaps.min(initial=np.inf)
        result.span[row] = max(map(np.ptp, each), default=0.0)

    def _extremes(self, sign: float) -> np.ndarray:
        """The largest values of the outputs times a sign, float64[K]: of series where they turn,
        of others looked for ever nearer to the best place.
        """
        angle, _ = _even(self.orbits.harmonics)
        high = (sign * self.even).max(axis=0)
        which, _, turned = self._turned
        np.maximum.at(high, which, sign * turned)
        if not len(self.others):
            return np.asarray(high)
        half, most = 2 * np.pi / len(angle), high[self.others]
        best = angle[(sign * self.even[:, self.others]).argmax(axis=0)]
        functions = np.arange(len(best))
        for _ in range(ROUNDS):
            around = best[:, None] + half * np.linspace(-1.0, 1.0, PLACES)
            found = sign * self.values(around.ravel())[:, self.others]
            own = found.reshape(len(best), PLACES, len(best))[functions, :, functions]
            best = around[functions, own.argmax(axis=1)]
            most = np.maximum(most, own.max(axis=1))
            half *= 2.0 / (PLACES - 1)
        high[self.others] = most
        return np.asarray(high)

    @functools.cached_property
    def _turned(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Turning points of the outputs that are series, as :func:`_turns`."""
        series = self.series.copy()
        series[self.others] = 0.0
        return _turns(series)


def _turns(series: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Angles at which series float64[g, 2H + 1] turn: which does, the angle, and its value."""
    which, angle, _ = fourier.zeros_of(fourier.derivative(series))
    here = fourier.basis(angle, fourier.harmonics_of(series.shape[1]))
    return which, angle, np.einsum("ri,ri->r", here, series[which])
