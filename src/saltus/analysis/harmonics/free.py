"""Free vibrations without damping as truncated Fourier series, in families over the amplitude."""

from __future__ import annotations

import numpy as np

from saltus.analysis.harmonics.equations import HarmonicOrbits
from saltus.system import System


class FreeHarmonics(HarmonicOrbits):
    """The family of free vibrations of H harmonics in which a signal passes its rest at zero.

    Unknowns z: the series of each signal, the period [s], and a fictitious damping [1/s] that makes
    the equations independent, as of exact orbits (see branches/free_vibration.py).

    Parameters
    ----------
    system : System
        Without forcing.
    name : str
        The parameter that is the damping.
    harmonics : int
        Number of harmonics.
    scale : float64[1, z]
        Units of the unknowns.
    rest : float64[D]
        The place of rest.
    column : int
        The state that passes it.
    """

    def __init__(
        self, system: System, name: str, harmonics: int, scale: np.ndarray, rest: np.ndarray,
        column: int,
    ) -> None:  # fmt: skip
        super().__init__(system, (name,), harmonics, 1, scale)
        self._place, self._signal = self.source.of_states(rest), self._number(column)
        series = np.zeros((self.count, self.series))
        series[:, 0] = self._place
        self.rest = series.ravel()

    def _number(self, column: int) -> int:
        """The signal that a state is."""
        return [chain[0] for chain in self.source.chains].index(column)

    @property
    def width(self) -> int:
        """Number of unknowns."""
        return self.size + 2

    def values(self, z: np.ndarray) -> np.ndarray:
        """The damping of motions float64[..., z], float64[..., 1]."""
        return z[..., self.size + 1 :]

    def period(self, z: np.ndarray) -> np.ndarray:
        """See :meth:`HarmonicOrbits.period`."""
        return np.asarray(z[..., self.size])

    def _constants(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, float, np.ndarray]:
        constants = z[self.size :].astype(float)
        rate = 2 * np.pi / float(constants[0])
        return constants, np.eye(2), rate, np.array([-1.0 / constants[0], 0.0])

    def _of(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        residual, derivative = super()._of(z)
        first, row = self._signal * self.series, np.zeros(self.width)
        row[first : first + self.harmonics + 1] = 1.0
        at_zero = row[: self.size] @ z[: self.size] - self._place[self._signal]
        # in units of the period, which is that of this row
        period, unit = self.scale[0, self.size], self.scale[0, first]
        turned = period / unit
        return np.append(residual, at_zero * turned), np.vstack([derivative, row * turned])
