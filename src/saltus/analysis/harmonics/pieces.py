"""A truncated motion cut where it meets the boundaries of the equations.

Along a truncated Fourier series the distance from a boundary is a series too where it is a
polynomial of the states, so that its zeros are found: all of them, to rounding.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from saltus.analysis.harmonics import series as fourier
from saltus.contact.guards import Guard
from saltus.errors import ParameterError
from saltus.flow import polynomials
from saltus.language.evaluate import evaluate

#: Amplitude of a gap behind its last harmonic, in units of its largest, that is rounding.
ROUNDING = 1e-12
#: Most samples by which a gap is read off as a series.
MOST_SAMPLES = 2**14
#: Nodes of Gauss's rule, as in kernels/harmonics/sums.py.
BEYOND, FOR_BEND = 5, 15

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
    gaps : float64[g, 2h + 1]
        The series of the gaps that don't ask for the sides of others.
    """

    begin: np.ndarray
    length: np.ndarray
    bits: np.ndarray
    instants: Instants
    gaps: np.ndarray = field(default_factory=lambda: np.zeros((0, 1)))

    @property
    def middle(self) -> np.ndarray:
        """[rad]"""
        return self.begin + 0.5 * self.length

    def of(self, angle: np.ndarray) -> np.ndarray:
        """The intervals that hold angles float64[n], int64[n]."""
        return (np.searchsorted(self.begin, angle % (2 * np.pi), side="right") - 1) % len(
            self.begin
        )

    def nodes(self, degree: int, bent: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Angles and weights by which series of a degree are integrated over the circle to
        rounding, and the interval of each: float64[n], float64[n], int64[n].

        On the whole circle they are equidistant; between instants they are Gauss's. ``bent``: of
        forces that aren't polynomials, such as powers of a depth: a sine, so many times, then takes
        the angle to either end with no slope, behind which such powers are smooth.
        """
        if len(self.begin) == 1 and len(self.instants.angle) == 0:
            count = degree + 1
            angle = 2.0 * np.pi * np.arange(count) / count
            return angle, np.full(count, 2.0 * np.pi / count), np.zeros(count, np.int64)
        turns = self.length * degree * 0.25 * (0.5 * np.pi) ** bent
        counts = np.ceil(turns + 4.5 * np.cbrt(turns)).astype(np.int64) + BEYOND + FOR_BEND * bent
        rules = [_gauss(int(count)) for count in counts]
        place, weight = (np.concatenate(one) for one in zip(*rules, strict=True))
        for _ in range(bent):
            turned = np.pi * (place - 0.5)
            weight = weight * 0.5 * np.pi * np.cos(turned)
            place = 0.5 + 0.5 * np.sin(turned)
        which = np.repeat(np.arange(len(counts)), counts)
        length = self.length[which]
        return self.begin[which] + length * place, length * weight, which


def intervals_of(
    name: str, guards: Sequence[Guard], asked: Mapping[int, list[int]],
    linear: tuple[np.ndarray, np.ndarray], about: About, harmonics: int,
) -> Intervals:  # fmt: skip
    """Cut a motion at the boundaries of some guards, each after those whose sides it asks for.

    Parameters
    ----------
    name : str
        Of the system, for a message.
    guards : sequence of Guard
        That a contact is held never is: a series isn't held anywhere.
    asked : mapping of int to list of int
        Of each of the others, whose sides it asks for.
    linear : int64[g], float64[g, 2H + 1]
        The guards whose gaps are known as series, and these.
    about : callable
        States, parameters and time at angles.
    harmonics : int
        Of the motion.

    Raises
    ------
    ParameterError
        If a gap isn't a series: it isn't smooth between the other boundaries.
    """
    frozen = np.zeros(len(guards), bool)
    numbers, gaps = linear
    if more := [i for i, others in asked.items() if not others and i not in numbers]:
        each = [*gaps, *(series_of(name, guards[i], about, harmonics, frozen) for i in more)]
        split = max(fourier.harmonics_of(len(one)) for one in each)
        numbers = np.append(numbers, more)
        gaps = np.array([fourier.resized(one, split) for one in each])
    which, angle, slope = fourier.zeros_of(gaps)
    found = np.array([angle, numbers[which], slope])
    intervals = _cut(uncut(len(guards)), found)
    here = fourier.basis(intervals.middle, fourier.harmonics_of(gaps.shape[1]))
    intervals.bits[:, numbers] = here @ gaps.T > 0
    for number, mine in asked.items():
        if not mine:
            continue
        for sides in np.unique(intervals.bits[:, mine], axis=0):
            bits = frozen.copy()
            bits[mine] = sides
            gap = series_of(name, guards[number], about, harmonics, bits)
            _, angle, slope = fourier.zeros_of(gap[None])
            there = (intervals.bits[intervals.of(angle)][:, mine] == sides).all(axis=1)
            new = np.array([angle, np.full(len(angle), number), slope])
            found = np.append(found, new[:, there], axis=1)
        intervals = _cut(intervals, found)
        middle = about(intervals.middle)
        (values,) = evaluate([guards[number].gap], **middle, bits=list(intervals.bits.T))  # type: ignore[arg-type]
        intervals.bits[:, number] = np.asarray(values) > 0
    angle, which, slope = found[:, found[0].argsort(kind="stable")]
    at = np.searchsorted(intervals.begin, angle)
    before, behind = intervals.bits[at - 1], intervals.bits[at]
    instants = Instants(angle, which.astype(np.int64), slope, before, behind)
    return replace(intervals, instants=instants, gaps=gaps)


def uncut(guards: int) -> Intervals:
    """The circle, uncut."""
    return Intervals(np.zeros(1), np.full(1, 2 * np.pi), np.zeros((1, guards), bool), _NONE)


_NONE = Instants(
    np.zeros(0), np.zeros(0, np.int64), np.zeros(0), np.zeros((0, 0), bool), np.zeros((0, 0), bool)
)


def _cut(intervals: Intervals, found: np.ndarray) -> Intervals:
    """Intervals between the angles of crossings (rows: angle, guard, slope), with the sides known
    so far.
    """
    if not found.size:
        return intervals
    begin = np.sort(found[0])
    if (begin[1:] == begin[:-1]).any():
        begin = np.unique(begin)
    length = np.append(begin[1:], begin[0] + 2 * np.pi) - begin
    bits = intervals.bits[intervals.of(begin + 0.5 * length)]
    return Intervals(begin, length, bits, _NONE)


def series_of(
    name: str, guard: Guard, about: About, harmonics: int, bits: np.ndarray
) -> np.ndarray:
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
