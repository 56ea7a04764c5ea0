"""Motions of a few harmonics with the exact orbits beside them.

Their stability is that of the exact orbit which Newton's method finds from each: what Hill's
determinant would tell rests on the truncated motion, and on how its eigenvalues are sorted.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.analysis.branches.arclength import correct
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.closed.cycles import units
from saltus.analysis.harmonics import series as fourier
from saltus.analysis.harmonics.equations import HarmonicOrbits
from saltus.analysis.harmonics.signals import States
from saltus.analysis.inputs.outputs import Outputs
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.flow.request import Schedule
from saltus.system import System
from saltus.system.modes import mode_number, sides

#: Farthest that Newton's method goes from a truncated motion to the exact orbit, in ranges of the
#: states.
NEAR = 0.5
#: Samples of a forcing period by which an exact orbit is read off as a series, and the least by
#: which it is held against a truncated one.
SAMPLES = 256
#: Samples in a period of the first harmonic that is left out, by which it is: the largest distance
#: is missed by half a percent there.
BEHIND_LAST = 32
#: Numbers that are held at a time, of motions beside exact orbits: some 16 MB.
TOGETHER = 2**21


@dataclass(frozen=True)
class Exact:
    """The exact orbits nearest to r truncated motions.

    Attributes
    ----------
    found : bool[r]
    points : float64[r, n, D]
        Their states at whole forcing periods.
    multipliers : complex128[r, D]
        NaN where none was found.
    """

    found: np.ndarray
    points: np.ndarray
    multipliers: np.ndarray


class ClosedHarmonics(HarmonicOrbits):
    """Curves of motions of a few harmonics, with the exact orbits beside them.

    Parameters
    ----------
    method, threads
        Of the exact flow.
    """

    def __init__(
        self, system: System, name: str, harmonics: int, periods: int, scale: np.ndarray,
        symmetric: bool, method: Method, threads: int | None,
    ) -> None:  # fmt: skip
        super().__init__(system, (name,), harmonics, periods, scale, symmetric)
        none = np.ones((0, periods * len(system.states) + 1))
        self._exact = PeriodicOrbits(system, (name,), periods, none, method, threads)
        self._known: dict[bytes, tuple[bool, np.ndarray, np.ndarray]] = {}

    def exact(self, z: np.ndarray) -> Exact:
        """The exact orbits at the parameters of motions float64[r, z], each remembered."""
        new = [i for i, one in enumerate(z) if one.tobytes() not in self._known]
        if new:
            self._close(z[new])
        known = [self._known[one.tobytes()] for one in z]
        found, points, multipliers = zip(*known, strict=True)
        return Exact(np.array(found, bool), np.array(points), np.array(multipliers))

    def _close(self, z: np.ndarray) -> None:
        points = self.points(z)
        guess = np.concatenate([points.reshape(len(z), -1), self.values(z)], axis=1)
        seen = [self.samples(one) for one in z]
        sizes = [self._units(one) for one in seen]
        orbits = copy_with(self._exact, np.array([
            np.append(np.tile(size, self.periods), max(abs(float(one[-1])), 1e-300))
            for size, one in zip(sizes, z, strict=True)
        ]))  # fmt: skip
        normal = np.zeros(guess.shape)
        normal[:, -1] = 1.0
        rows = np.arange(len(z))
        point = correct(orbits, guess, normal, rows, NEAR)
        multipliers = np.full((len(z), points.shape[2]), np.nan + 0j)
        good = np.flatnonzero(point.found)
        if len(good):
            multipliers[good] = orbits.multipliers(point.z[good], point.derivative[good], good)
        ends = orbits.points(point.z)
        for i, one in enumerate(z):
            self._known[one.tobytes()] = bool(point.found[i]), ends[i], multipliers[i]

    def _units(self, seen: np.ndarray) -> np.ndarray:
        """The ranges of states in samples float64[n, D]; of a structure, whose higher modes move
        by little, those of the largest deflection and rate.
        """
        ranges = units(seen.max(axis=0), seen.min(axis=0))
        if not isinstance(self.source, States):
            both = ranges.reshape(2, -1)
            ranges = np.repeat(both.max(axis=1), both.shape[1])
        return ranges

    def multipliers(self, z: np.ndarray, derivative: np.ndarray, rows: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Floquet multipliers of the exact orbits, the largest first, complex128[r, D]; NaN where
        none is near.
        """
        return self.exact(z).multipliers

    def errors(self, z: np.ndarray, outputs: Outputs) -> tuple[np.ndarray, np.ndarray]:
        """Largest distances of outputs of motions float64[r, z] from those of the exact orbits at
        samples of a period, float64[r, K], and the ranges of these, float64[r, K]; NaN where none
        is near.
        """
        apart, ranges = np.full((2, len(z), len(outputs)), np.nan)
        exact = self.exact(z)
        good = np.flatnonzero(exact.found)
        if not len(good):
            return apart, ranges
        per_period = max(SAMPLES, -(-BEHIND_LAST * (self.harmonics + 1) // self.periods))
        each = per_period * self.periods
        for some in np.array_split(good, 1 + len(good) * each * len(outputs) // TOGETHER):
            seen = samples(
                self.system, self.names[0], exact.points[some, 0], self.values(z[some])[:, 0],
                self.periods, self._exact.map.method, per_period,
            )  # fmt: skip
            share = np.arange(each) / each
            here = fourier.basis(2 * np.pi * share, self.harmonics)
            truncated = np.array([here @ self.states(one).T for one in z[some]])
            about = dict(self.system.values) | {self.names[0]: z[some, -1:]}
            time = share * self.period(z[some])[:, None]
            truncated, known = (self._read(one, time, about, outputs) for one in (truncated, seen))
            apart[some] = np.abs(truncated - known).max(axis=1)
            ranges[some] = np.ptp(known, axis=1)
        return apart, ranges

    def _read(
        self, states: np.ndarray, time: np.ndarray, about: dict[str, Any], outputs: Outputs
    ) -> np.ndarray:
        """Outputs at states float64[r, n, D], float64[r, n, K]."""
        mode = np.zeros(time.shape, np.int64)
        if outputs.formulas:
            mode = mode_number(sides(self.system, time, np.moveaxis(states, 2, 0), about))
        return outputs.values(time, states, about, mode)


def copy_with(orbits: PeriodicOrbits, scale: np.ndarray) -> PeriodicOrbits:
    """The equations of orbits with another scale float64[k, z]."""
    other = orbits.near(orbits.scale, np.zeros(0, np.int64))
    other.scale = scale
    return other


def samples(
    system: System, name: str, starts: np.ndarray, values: np.ndarray, periods: int, method: Method,
    per_period: int = SAMPLES,
) -> np.ndarray:  # fmt: skip
    """Exact motions from states float64[r, D] at values of a parameter, in equal steps over some
    forcing periods, float64[r, periods*per_period, D].
    """
    rows = np.tile(np.array(list(system.values.values())), (len(starts), 1))
    rows[:, list(system.values).index(name)] = values
    run = Stroboscope(system, method, rows).run(starts, periods, Schedule.even(periods, per_period))
    return np.asarray(run.samples[:, :, : starts.shape[1]])
