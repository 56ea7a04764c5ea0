"""Truncated Fourier series of H harmonics: their values, derivatives and zeros.

A series is its coefficients float64[2H + 1]: the mean, the H cosines, the H sines, of an angle that
turns once in the fundamental period.
"""

from __future__ import annotations

import functools

import numpy as np

#: Cells of the circle, for each harmonic, in which zeros are looked for first.
CELLS = 8
#: Halvings of a cell of which it isn't known how many zeros it holds: what is left is rounding.
HALVINGS = 40
#: Steps of Newton's method, or halvings, by which a zero is located.
STEPS = 60
#: Length of the last step of Newton's method towards a zero, behind which there is rounding [rad].
LOCATED = 1e-9


def harmonics_of(size: int) -> int:
    """Number of harmonics of a series of some coefficients."""
    return (size - 1) // 2


def basis(angle: np.ndarray, harmonics: int) -> np.ndarray:
    """One, the cosines and the sines at angles float64[n], float64[n, 2H + 1]."""
    turned = angle[:, None] * np.arange(1, harmonics + 1)
    found = np.ones((len(angle), 2 * harmonics + 1))
    np.cos(turned, out=found[:, 1 : harmonics + 1])
    np.sin(turned, out=found[:, harmonics + 1 :])
    return found


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


def transfer(blocks: np.ndarray) -> np.ndarray:
    """The matrix that multiplies each amplitude of series by a complex number: from
    complex128[H + 1, c, m], float64[c, 2H + 1, m, 2H + 1].
    """
    split = len(blocks) - 1
    whole = np.zeros((blocks.shape[1], 2 * split + 1, blocks.shape[2], 2 * split + 1))
    cosine, sine = np.arange(split + 1), np.arange(1, split + 1)
    whole[:, cosine, :, cosine] = blocks.real
    whole[:, split + sine, :, split + sine] = blocks.real[1:]
    whole[:, sine, :, split + sine] = blocks.imag[1:]
    whole[:, split + sine, :, sine] = -blocks.imag[1:]
    return whole


# -- zeros -----------------------------------------------------------------------------------------
def zeros(series: np.ndarray) -> np.ndarray:
    """All angles in [0, 2 pi) at which a series float64[2H + 1] changes its sign, ascending."""
    return zeros_of(series[None])[1]


def zeros_of(series: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """All angles in [0, 2 pi) at which series float64[g, 2H + 1] change their sign, float64[r], and
    which series does, int64[r]; ascending in the series, then in the angle.

    A cell of the circle holds no zero where the series is larger than its slope and its largest
    second derivative allow it to fall there, and at most one where the slope keeps its sign; other
    cells are halved. Zeros nearer to each other than rounding tells apart are none.
    """
    split = harmonics_of(series.shape[1])
    order = np.arange(1, split + 1)
    bend = np.hypot(series[:, 1 : split + 1], series[:, split + 1 :]) @ order**2
    slopes = derivative(series)
    circle, at_middle, at_edge = _cells(split)
    half = np.pi / len(circle)
    value, slope = series @ at_middle.T, slopes @ at_middle.T
    edge = series @ at_edge.T > 0
    clear, single = _told(value, slope, bend[:, None], half)
    which, place = np.nonzero(single & (edge != np.roll(edge, -1, axis=1)))
    found = [(which, circle[place] - half, np.full(len(which), 2.0 * half))]
    which, place = np.nonzero(~clear & ~single & (bend[:, None] > 0))
    middle = circle[place]
    for _ in range(HALVINGS):
        if not len(middle):
            break
        half *= 0.5
        which, middle = np.tile(which, 2), np.concatenate([middle - half, middle + half])
        here = basis(middle, split)
        value, slope = (np.einsum("ri,ri->r", here, one[which]) for one in (series, slopes))
        clear, single = _told(value, slope, bend[which], half)
        found.append((which[single], middle[single] - half, np.full(single.sum(), 2.0 * half)))
        which, middle = which[~clear & ~single], middle[~clear & ~single]
    which, begin, width = (np.concatenate(one) for one in zip(*found, strict=True))
    if not len(begin):
        return which, begin
    low, high = (
        np.einsum("ri,ri->r", basis(at, split), series[which]) > 0 for at in (begin, begin + width)
    )
    changes = low != high
    which, rising = which[changes], high[changes]
    angle = _located(series[which], slopes[which], begin[changes], width[changes], rising)
    angle %= 2.0 * np.pi
    order = np.lexsort((angle, which))
    which, angle = which[order], angle[order]
    new = np.append(True, (np.diff(which) != 0) | (np.diff(angle) != 0))[: len(which)]
    return which[new], angle[new]


def _told(
    value: np.ndarray, slope: np.ndarray, bend: np.ndarray, half: float
) -> tuple[np.ndarray, np.ndarray]:
    """Cells without a zero, and others with one at most, by what is known in their middles."""
    clear = np.abs(value) > np.abs(slope) * half + 0.5 * bend * half**2
    return clear, ~clear & (np.abs(slope) > bend * half)


@functools.lru_cache(maxsize=64)
def _cells(harmonics: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The middles of the first cells, and the basis there and where they begin."""
    count = CELLS * (harmonics + 1)
    begin = 2.0 * np.pi * np.arange(count) / count
    middle = begin + np.pi / count
    return middle, basis(middle, harmonics), basis(begin, harmonics)


def _located(
    series: np.ndarray, slopes: np.ndarray, begin: np.ndarray, width: np.ndarray, rising: np.ndarray
) -> np.ndarray:
    """The zeros of series float64[r, 2H + 1] between angles where their signs change, by Newton's
    method that stays between.
    """
    low, high, way = begin.copy(), begin + width, np.where(rising, 1.0, -1.0)
    place, split = begin + 0.5 * width, harmonics_of(series.shape[1])
    for _ in range(STEPS):
        here = basis(place, split)
        value, slope = (way * np.einsum("ri,ri->r", here, one) for one in (series, slopes))
        low, high = np.where(value > 0, low, place), np.where(value > 0, place, high)
        with np.errstate(all="ignore"):
            step = -value / slope
        inside = (place + step >= low) & (place + step <= high)
        step = np.where(inside, step, 0.5 * (low + high) - place)
        step[value == 0] = 0.0
        place = place + step
        if np.abs(step).max(initial=0.0) < LOCATED:
            break
    return place
