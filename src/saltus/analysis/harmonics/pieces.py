"""A truncated motion cut where it meets the boundaries of the equations.

Along a truncated Fourier series the distance from a boundary is a series too where it is a
polynomial of the states, so that its zeros are found: all of them, to rounding.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from saltus.analysis.harmonics import series as fourier
from saltus.contact.guards import Guard, bits_in, is_hold
from saltus.errors import ParameterError
from saltus.flow import polynomials
from saltus.language.evaluate import evaluate

#: Amplitude of a gap behind its last harmonic, in units of its largest, that is rounding.
ROUNDING = 1e-12
#: Most samples by which a gap is read off as a series.
MOST_SAMPLES = 2**14
#: Nodes of Gauss's rule on an interval beyond half its turns.
BEYOND = 10

_gauss = functools.lru_cache(maxsize=512)(polynomials.gauss)
#: Inputs of expressions at angles float64[n], but for the bits.
About = Callable[[np.ndarray], dict[str, object]]


@dataclass(frozen=True)
class Instants:
    """Angles at which a motion meets boundaries.

    Attributes
    ----------
    angle : float64[i]
        In [0, 2 pi).
    guard : int64[i]
        Which boundary.
    slope : float64[i]
        Of its gap over the angle.
    before, behind : bool[i, guards]
        Sides of all boundaries on both sides of it.
    """

    angle: np.ndarray
    guard: np.ndarray
    slope: np.ndarray
    before: np.ndarray
    behind: np.ndarray


@dataclass(frozen=True)
class Intervals:
    """Intervals of the circle in which no boundary is crossed.

    Attributes
    ----------
    begin, length : float64[p]
        [rad]
    bits : bool[p, guards]
        Sides of the boundaries.
    instants : Instants
    gaps : tuple of float64[2h + 1]
        The series of the gaps that don't ask for the sides of others.
    """

    begin: np.ndarray
    length: np.ndarray
    bits: np.ndarray
    instants: Instants
    gaps: tuple[np.ndarray, ...] = ()

    @property
    def middle(self) -> np.ndarray:
        """[rad]"""
        return self.begin + 0.5 * self.length

    def of(self, angle: np.ndarray) -> np.ndarray:
        """The intervals that hold angles float64[n], int64[n]."""
        return (np.searchsorted(self.begin, angle % (2 * np.pi), side="right") - 1) % len(
            self.begin
        )

    def nodes(self, degree: int, bent: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Angles and weights by which series of a degree are integrated over the circle to
        rounding, and the interval of each: float64[n], float64[n], int64[n].

        On the whole circle they are equidistant; between instants they are Gauss's. ``bent``: of
        forces that aren't polynomials, such as powers of a depth: a sine then takes the angle to
        either end with no slope, behind which such powers are smooth.
        """
        if len(self.begin) == 1 and len(self.instants.angle) == 0:
            count = degree + 1
            angle = 2.0 * np.pi * np.arange(count) / count
            return angle, np.full(count, 2.0 * np.pi / count), np.zeros(count, np.int64)
        turns = self.length * degree * (0.25 * np.pi if bent else 0.5) * 0.5
        counts = np.ceil(turns + 3.0 * np.cbrt(turns)).astype(np.int64) + BEYOND * (1 + bent)
        angles, weights = [], []
        for begin, length, count in zip(self.begin, self.length, counts, strict=True):
            place, weight = _gauss(int(count))
            if bent:
                turned = np.pi * (place - 0.5)
                weight = weight * 0.5 * np.pi * np.cos(turned)
                place = 0.5 + 0.5 * np.sin(turned)
            angles.append(begin + length * place)
            weights.append(length * weight)
        return (
            np.concatenate(angles),
            np.concatenate(weights),
            np.repeat(np.arange(len(counts)), counts),
        )


def intervals_of(
    name: str, guards: Sequence[Guard], linear: Mapping[int, np.ndarray], about: About,
    harmonics: int,
) -> Intervals:  # fmt: skip
    """Cut a motion at the boundaries of some guards, each after those whose sides it asks for.

    Parameters
    ----------
    name : str
        Of the system, for a message.
    guards : sequence of Guard
        That a contact is held never is: a series isn't held anywhere.
    linear : mapping of int to float64[2H + 1]
        The gaps that are known as series.
    about : callable
        States, parameters and time at angles.
    harmonics : int
        Of the motion.

    Raises
    ------
    ParameterError
        If a gap isn't a series: it isn't smooth between the other boundaries.
    """
    moving = [i for i, guard in enumerate(guards) if not is_hold(guard)]
    asked = {number: sorted(bits_in([guards[number].gap])) for number in moving}
    frozen = np.zeros(len(guards), bool)
    series = {
        number: linear[number]
        if number in linear
        else _series(name, guards[number], about, harmonics, frozen)
        for number in moving if not asked[number]
    }  # fmt: skip
    found = _crossings(series)
    intervals = _cut(uncut(len(guards)), found)
    middle = intervals.middle
    for number, gap in series.items():
        here = fourier.basis(middle, fourier.harmonics_of(len(gap)))
        intervals.bits[:, number] = here @ gap > 0
    for number in moving:
        if not (mine := asked[number]):
            continue
        for sides in np.unique(intervals.bits[:, mine], axis=0):
            bits = frozen.copy()
            bits[mine] = sides
            gap = _series(name, guards[number], about, harmonics, bits)
            found += [
                one for one in _crossings({number: gap})
                if (intervals.bits[intervals.of(np.array([one[0]]))[0], mine] == sides).all()
            ]  # fmt: skip
        intervals = _cut(intervals, found)
        there = about(intervals.middle)
        (values,) = evaluate([guards[number].gap], **there, bits=list(intervals.bits.T))  # type: ignore[arg-type]
        intervals.bits[:, number] = np.asarray(values) > 0
    instants = _NONE
    if found:
        angle, which, slope = (np.array(one) for one in zip(*sorted(found), strict=True))
        at = np.searchsorted(intervals.begin, angle)
        before, behind = intervals.bits[at - 1], intervals.bits[at]
        instants = Instants(angle, which.astype(np.int64), slope, before, behind)
    return replace(intervals, instants=instants, gaps=tuple(series.values()))


def _crossings(gaps: Mapping[int, np.ndarray]) -> list[tuple[float, int, float]]:
    """Angles at which gaps vanish, the numbers of these, and their slopes there."""
    split = max((fourier.harmonics_of(len(gap)) for gap in gaps.values()), default=1)
    series = np.reshape([fourier.resized(gap, split) for gap in gaps.values()], (-1, 2 * split + 1))
    which, angles = fourier.zeros_of(series)
    here = fourier.basis(angles, split)
    slopes = np.einsum("ri,ri->r", here, fourier.derivative(series)[which])
    number = np.array(list(gaps), np.int64)[which]
    return list(zip(angles.tolist(), number.tolist(), slopes.tolist(), strict=True))


def uncut(guards: int) -> Intervals:
    """The circle, uncut."""
    return Intervals(np.zeros(1), np.full(1, 2 * np.pi), np.zeros((1, guards), bool), _NONE)


_NONE = Instants(
    np.zeros(0), np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 0), bool), np.zeros((0, 0), bool)
)


def _cut(intervals: Intervals, found: list[tuple[float, int, float]]) -> Intervals:
    """Intervals between the angles of crossings, with the sides known so far."""
    if not found:
        return intervals
    begin = np.unique([angle for angle, _, _ in found])
    length = np.diff(np.append(begin, begin[0] + 2 * np.pi))
    bits = intervals.bits[intervals.of(begin + 0.5 * length)].copy()
    return Intervals(begin, length, bits, _NONE)


def _series(name: str, guard: Guard, about: About, harmonics: int, bits: np.ndarray) -> np.ndarray:
    """The gap of a guard as a series, the bits that it asks for frozen."""
    count = 4 * harmonics + 16
    while count <= MOST_SAMPLES:
        angle = 2.0 * np.pi * np.arange(count) / count
        (values,) = evaluate([guard.gap], **about(angle), bits=bits.tolist())  # type: ignore[arg-type]
        amplitudes = np.fft.rfft(np.broadcast_to(values, count)) * (2.0 / count)
        amplitudes[0] *= 0.5
        sizes = np.abs(amplitudes)
        known = np.flatnonzero(sizes > ROUNDING * sizes.max())
        last = int(known[-1]) if len(known) else 0
        if 4 * last <= 3 * (count // 2):
            return fourier.of_complex(amplitudes[: last + 1])
        count *= 4
    raise ParameterError(
        f"the boundary {guard.name!r} of {name} isn't smooth along a harmonic motion, so where it "
        "is crossed can't be told by harmonics. Follow the exact orbits: leave out ",
        lambda say: f"{say.key('by')}.",
    )
