"""Free vibrations of a few harmonics, each held against the exact one of the same size."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.analysis.branches.arclength import correct
from saltus.analysis.branches.closed_harmonics import NEAR
from saltus.analysis.branches.free_vibration import SAMPLES, FreeOrbits
from saltus.analysis.harmonics import series as fourier
from saltus.analysis.harmonics.free import FreeHarmonics
from saltus.analysis.harmonics.sizes import amplitudes
from saltus.analysis.inputs.outputs import outputs_of


class ClosedFree(FreeHarmonics):
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
        units = self.source.of_states(exact.scale[0, : exact.size])
        own = exact.scale[0, exact.size :]
        self.scale = np.concatenate([np.repeat(units, self.series), own])[None]

    def closed(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The exact vibrations float64[r, z] of the sizes of truncated ones, and where they were
        found, bool[r].
        """
        size = self.exact.size
        guess = np.concatenate([self.points(z)[:, 0], z[:, self.size :]], axis=1)
        normal = np.zeros(guess.shape)
        normal[:, :size] = (guess[:, :size] - self.exact.rest) / self.exact.scale[0, :size]
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        found = correct(self.exact, guess, normal, np.zeros(len(z), np.int64), NEAR)
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
        here = fourier.basis(2 * np.pi * np.arange(SAMPLES) / SAMPLES, self.harmonics)
        apart, share = np.full((len(z), len(outputs)), np.nan), np.full(len(z), np.nan)
        for i in np.flatnonzero(good):
            seen = self.exact.sampled(exact[i, :size], float(exact[i, size]))
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


def begun(exact: FreeOrbits, harmonics: int, z: np.ndarray) -> tuple[ClosedFree, np.ndarray]:
    """The equations of truncated vibrations, and the series of a small exact one float64[1, z]."""
    orbits, size = ClosedFree(exact, harmonics), exact.size
    seen = exact.sampled(z[0, :size], float(z[0, -2]))
    flat = orbits.of_states(fourier.of_samples(seen.T, harmonics), 0.0)[:-1]
    return orbits, np.concatenate([flat, z[0, size:]])[None]
