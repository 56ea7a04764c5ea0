"""Truncated Fourier series of H harmonics: their values, derivatives and zeros.

A series is its coefficients float64[2H + 1]: the mean, the H cosines, the H sines, of an angle that
turns once in the fundamental period.
"""

from __future__ import annotations

import numpy as np

from saltus.codegen.module import harmonics_module

#: Zeros for which there is room, for each harmonic.
ROOM = 4


def harmonics_of(size: int) -> int:
    """Number of harmonics of a series of some coefficients."""
    return (size - 1) // 2


def basis(angle: np.ndarray, harmonics: int) -> np.ndarray:
    """One, the cosines and the sines at angles float64[n], float64[n, 2H + 1]."""
    turned = np.empty((harmonics, len(angle)), complex)
    turned[:1] = np.cos(angle) + 1j * np.sin(angle)
    known = 1
    while known < harmonics:  # powers of the first, twice as many each time
        more = min(known, harmonics - known)
        np.multiply(turned[:more], turned[known - 1], out=turned[known : known + more])
        known += more
    found = np.ones((2 * harmonics + 1, len(angle)))
    found[1 : harmonics + 1], found[harmonics + 1 :] = turned.real, turned.imag
    return found.T


def derivative(series: np.ndarray, times: int = 1) -> np.ndarray:
    """The derivative of series float64[..., 2H + 1] with respect to the angle, ``times`` times."""
    split = harmonics_of(series.shape[-1])
    order = np.arange(1, split + 1)
    for _ in range(times):
        found = np.zeros(series.shape)
        found[..., 1 : split + 1] = order * series[..., split + 1 :]
        found[..., split + 1 :] = -order * series[..., 1 : split + 1]
        series = found
    return series


def to_complex(series: np.ndarray) -> np.ndarray:
    """Amplitudes c of ``Re(c exp(i k angle))``, k = 0 to H, complex128[..., H + 1]."""
    split = harmonics_of(series.shape[-1])
    found = series[..., : split + 1].astype(complex)
    found[..., 1:] -= 1j * series[..., split + 1 :]
    return found


def of_complex(amplitudes: np.ndarray) -> np.ndarray:
    """The series of amplitudes complex128[..., H + 1], float64[..., 2H + 1]."""
    return np.concatenate([amplitudes.real, -amplitudes.imag[..., 1:]], axis=-1)


def shifted(series: np.ndarray, angle: float) -> np.ndarray:
    """The series of what happens an angle later: its values at ``angle`` stand at zero."""
    amplitudes = to_complex(series)
    return of_complex(amplitudes * np.exp(1j * angle * np.arange(amplitudes.shape[-1])))


def of_samples(samples: np.ndarray, harmonics: int) -> np.ndarray:
    """The series through values at equidistant angles from zero on, float64[..., n], cut off behind
    H harmonics; exact for a series of fewer than n/2.
    """
    amplitudes = np.fft.rfft(samples)[..., : harmonics + 1] * (2.0 / samples.shape[-1])
    amplitudes[..., 0] *= 0.5
    missing = harmonics + 1 - amplitudes.shape[-1]
    return of_complex(np.pad(amplitudes, [(0, 0)] * (samples.ndim - 1) + [(0, max(missing, 0))]))


def resized(series: np.ndarray, harmonics: int) -> np.ndarray:
    """The series with other numbers of harmonics: new ones are zero."""
    if harmonics == harmonics_of(series.shape[-1]):
        return series
    amplitudes = to_complex(series)[..., : harmonics + 1]
    missing = harmonics + 1 - amplitudes.shape[-1]
    return of_complex(np.pad(amplitudes, [(0, 0)] * (series.ndim - 1) + [(0, missing)]))


def doubled(series: np.ndarray) -> np.ndarray:
    """The same motions over twice the period: harmonic k becomes 2k, float64[..., 4H + 1]."""
    amplitudes = to_complex(series)
    found = np.zeros((*amplitudes.shape[:-1], 2 * amplitudes.shape[-1] - 1), complex)
    found[..., ::2] = amplitudes
    return of_complex(found)


# -- zeros -----------------------------------------------------------------------------------------
def zeros(series: np.ndarray) -> np.ndarray:
    """All angles in [0, 2 pi) at which a series float64[2H + 1] changes its sign."""
    return zeros_of(series[None])[1]


def zeros_of(series: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All angles in [0, 2 pi) at which series float64[g, 2H + 1] change their sign, float64[r];
    which series does, int64[r], ascending; and its slope there, float64[r].

    Bounds of the slope prove how many zeros a piece of the circle holds
    (kernels/harmonics/series.py). Zeros nearer to each other than rounding tells apart are none.
    """
    room = ROOM * len(series) * (series.shape[1] + 1)
    which, (angle, slope) = np.empty(room, np.int64), np.empty((2, room))
    found = harmonics_module().propagate(np.ascontiguousarray(series), which, angle, slope)
    return which[:found], angle[:found] % (2.0 * np.pi), slope[:found]
