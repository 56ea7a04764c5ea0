"""Free vibrations, and forced ones in quadrature, of a few harmonics, each held against the exact
one of the same size.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from saltus.analysis.branches.arclength import correct
from saltus.analysis.branches.closed_harmonics import NEAR, samples
from saltus.analysis.branches.forced_vibration import QuadratureOrbits
from saltus.analysis.branches.free_vibration import SAMPLES, FreeOrbits
from saltus.analysis.harmonics import series as fourier
from saltus.analysis.harmonics.equations import HarmonicOrbits
from saltus.analysis.harmonics.free import FreeHarmonics
from saltus.analysis.harmonics.sizes import amplitudes
from saltus.analysis.inputs.outputs import outputs_of
from saltus.language.evaluate import evaluate

#: Shift of the frequency by which the force's harmonics are derived, as a share of it.
ASIDE = 1e-5


class BesideFamily(HarmonicOrbits):
    """A family of truncated vibrations beside one of exact ones.

    Attributes
    ----------
    exact : FreeOrbits or QuadratureOrbits
        The equations of the exact ones.
    rest : float64[size]
        The series at the place of rest.
    """

    exact: FreeOrbits | QuadratureOrbits
    rest: np.ndarray

    def _take_units(self) -> None:
        """Take the scale from that of the exact ones."""
        units = self.source.of_states(self.exact.scale[0, : self.exact.size])
        own = self.exact.scale[0, self.exact.size :]
        self.scale = np.concatenate([np.repeat(units, self.series), own])[None]

    def _seen(self, exact: np.ndarray) -> np.ndarray:
        """Samples of the exact vibration float64[z] in equal steps over its period,
        float64[n, D].
        """
        return sampled(self.exact, exact)

    def closed(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The exact vibrations float64[r, z] of the sizes of truncated ones, and where they were
        found, bool[r].
        """
        size = self.exact.size
        guess = np.concatenate([self.points(z)[:, 0], z[:, self.size :]], axis=1)
        normal = np.zeros(guess.shape)
        normal[:, :size] = (guess[:, :size] - self.exact.rest) / self.exact.scale[0, :size]
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        # the scale is that of small vibrations: fast ones have larger velocities
        ranges = np.array([np.ptp(self.samples(one), axis=0) for one in z])
        astray = NEAR * np.maximum(1.0, (ranges / self.exact.scale[0, :size]).max(axis=1))
        found = correct(self.exact, guess, normal, np.zeros(len(z), np.int64), astray)
        return found.z, found.found

    def multipliers(self, z: np.ndarray, derivative: np.ndarray, rows: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Those of the exact vibrations; NaN where none is near."""
        exact, good = self.closed(z)
        rows = np.zeros(len(z), np.int64)
        found = self.exact.multipliers(exact, self.exact.evaluate(exact, rows)[1], rows)
        return np.where(good[:, None], found, np.nan)

    def told(self, z: np.ndarray) -> dict[str, Any]:
        """The variables of truncated vibrations, besides those of exact ones."""
        exact, good = self.closed(z)
        outputs, size = outputs_of(self.system), self.exact.size
        apart, share = np.full((len(z), len(outputs)), np.nan), np.full(len(z), np.nan)
        for i in np.flatnonzero(good):
            seen = self._seen(exact[i])
            here = fourier.basis(2 * np.pi * np.arange(len(seen)) / len(seen), self.harmonics)
            apart[i, :size] = np.abs(here @ self.states(z[i]).T - seen).max(axis=0)
            share[i] = (apart[i, :size] / np.maximum(np.ptp(seen, axis=0), 1e-300)).max()
        whole = np.array([amplitudes(self, one, outputs) for one in z])
        return {
            "harmonic": np.arange(self.harmonics + 1),
            "point_error": share,
            "point_output_error": apart,
            "point_harmonic_real": whole.real,
            "point_harmonic_imag": whole.imag,
        }


class ClosedFree(BesideFamily, FreeHarmonics):
    """The family of truncated free vibrations beside a family of exact ones.

    Parameters
    ----------
    exact : FreeOrbits
        The equations of the exact ones.
    harmonics : int
        Number of harmonics.
    """

    def __init__(self, exact: FreeOrbits, harmonics: int) -> None:
        bare = np.ones((1, 1))
        super().__init__(
            exact.system, exact.names[0], harmonics, bare, exact.rest, exact.column
        )  # fmt: skip
        self.exact = exact
        self._take_units()


class ClosedQuadrature(BesideFamily):
    """The family of truncated vibrations in quadrature, over the forcing frequency and the
    amplitude of the force, beside a family of exact ones.

    The mean of the displacement times the force over a period is zero: a sum over their harmonics.

    Parameters
    ----------
    exact : QuadratureOrbits
        The equations of the exact ones.
    harmonics : int
        Number of harmonics.
    """

    def __init__(self, exact: QuadratureOrbits, harmonics: int) -> None:
        # its displacement is an unknown then, also of a structure
        system = replace(exact.system, interfaces=None)
        super().__init__(system, exact.names, harmonics, 1, np.ones((1, 1)))
        self.exact = exact
        self._take_units()
        self._drive = exact.force.rates[exact.force.row]
        chains = [chain[0] for chain in self.source.chains]
        first = chains.index(exact.force.displacement) * self.series
        self._own_signal = slice(first, first + self.series)
        rest = np.zeros((self.count, self.series))
        rest[:, 0] = self.source.of_states(exact.rest)
        self.rest = rest.ravel()

    def _force(self, frequency: float) -> np.ndarray:
        """Weights of the displacement's series in the mean of it times the force, over the force's
        size, float64[2H + 1].
        """
        values = {**self.system.values, self.names[0]: frequency}
        share = np.arange(SAMPLES) / SAMPLES
        time = share * self.system.period({self.names[0]: frequency})
        (seen,) = evaluate([self._drive], t=time, values=values)
        found = fourier.of_samples(np.asarray(seen), self.harmonics)
        found[1:] *= 0.5
        return np.asarray(found / np.linalg.norm(found))

    def _of(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        residual, derivative = super()._of(z)
        frequency, mine = z[self.size], z[self._own_signal]
        row, near = np.zeros(self.width), ASIDE * frequency
        row[self._own_signal] = force = self._force(frequency)
        ahead, back = (self._force(frequency + step) for step in (near, -near))
        row[self.size] = mine @ (ahead - back) / (2.0 * near)
        # in units of the frequency, which is that of this row
        unit = self.scale[0, self.size] / self.scale[0, self._own_signal.start]
        return np.append(residual, force @ mine * unit), np.vstack([derivative, row * unit])


def sampled(exact: FreeOrbits | QuadratureOrbits, z: np.ndarray) -> np.ndarray:
    """Samples of an exact vibration float64[z] in equal steps over its period, float64[n, D]."""
    start, value = z[: exact.size], z[exact.size]
    if isinstance(exact, FreeOrbits):
        return np.asarray(exact.sampled(start, float(value)))
    system = exact.system.with_values(**{exact.names[1]: float(z[-1])})
    found = samples(
        system, exact.names[0], start[None], np.array([value]), 1, exact.map.method
    )  # fmt: skip
    return np.asarray(found[0])


def begun(
    exact: FreeOrbits | QuadratureOrbits, harmonics: int, z: np.ndarray
) -> tuple[BesideFamily, np.ndarray]:
    """The equations of truncated vibrations, and the series of a small exact one float64[1, z]."""
    free = isinstance(exact, FreeOrbits)
    orbits = ClosedFree(exact, harmonics) if free else ClosedQuadrature(exact, harmonics)  # type: ignore[arg-type]
    seen = sampled(exact, z[0])
    flat = orbits.of_states(fourier.of_samples(seen.T, harmonics), 0.0)[:-1]
    return orbits, np.concatenate([flat, z[0, exact.size :]])[None]
