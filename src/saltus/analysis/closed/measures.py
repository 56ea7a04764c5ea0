"""The numbers of an orbit: its largest and smallest values, means, first harmonics, contacts, and
how near it comes to a graze.

All come from the motion as the flow computed it, in pieces that are polynomials (flow/pieces.py).
Turning points are roots of these polynomials, so they are located, not sampled; means are sums by
Gauss's rule, which is exact for polynomials. An orbit of a method that locates no contacts is known
at its samples and by the cubics between them.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np

from saltus.analysis.inputs.outputs import Outputs, states_alone
from saltus.flow import polynomials
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import MANY_STATES
from saltus.flow.modal_motions import wave_motions
from saltus.flow.motion_series import Pieces
from saltus.flow.pieces import nodes_of, pieces
from saltus.flow.request import Outcome
from saltus.flow.threads import on_threads
from saltus.flow.wave_turns import extremes, least_turns, turns
from saltus.flow.waves import WaveLegs, deviations, harmonics, means
from saltus.kernels import status as st
from saltus.system import margin_gaps

#: Forcing periods of a motion that never repeats from which its numbers are taken, where there are
#: many such motions.
APERIODIC_PERIODS = 64
#: Nodes that a thread holds at a time: some 20 MB.
HELD = 8192
#: Motions of many states that a thread takes at a time: each takes ten milliseconds or more.
TOGETHER = 8
#: Places of Gauss's rule on a piece: exact for the square of a polynomial of degree 20.
PLACES = 21
#: Turning points closer than this are one [forcing periods].
SAME = 1e-9
#: A gap that closes at more than this share of its largest rate is struck, not grazed.
STRUCK = 1e-6


@dataclass(frozen=True)
class Measures:
    """The numbers of m motions of D states and K outputs, each over its period, or over many
    forcing periods if it never repeats.

    Attributes
    ----------
    maximum, minimum, mean : float64[m, K]
        Of each output [its unit]; the states come first.
    deviation : float64[m, K]
        Root mean square about the mean.
    harmonic : complex128[m, K]
        First harmonic: ``A exp(i phi)`` of ``A cos(2 pi t/T + phi)``, T the forcing period, t the
        time of the equations; NaN if unforced.
    margin : float64[m]
        Smallest size of a gap where it turns, of those of one unit
        (:func:`saltus.system.margin_gaps`); zero if it is within rounding, inf without gaps.
    span : float64[m]
        Largest range of these gaps [their unit].
    contacts : float64[m]
        Contacts per forcing period; NaN where the method doesn't locate them.
    itinerary : list of str
        Guards met, with + where the gap becomes positive, in the order of time; empty for a motion
        that never repeats.
    turning : list of float64[n, K]
        The outputs where the first state turns, or the first output where these stand first, in the
        order of time.
    """

    maximum: np.ndarray
    minimum: np.ndarray
    mean: np.ndarray
    deviation: np.ndarray
    harmonic: np.ndarray
    margin: np.ndarray
    span: np.ndarray
    contacts: np.ndarray
    itinerary: list[str]
    turning: list[np.ndarray]

    @property
    def peak(self) -> np.ndarray:
        """Largest magnitude, float64[m, K]."""
        peak: np.ndarray = np.maximum(np.abs(self.maximum), np.abs(self.minimum))
        return peak

    @property
    def rms(self) -> np.ndarray:
        """Root mean square about zero, float64[m, K]."""
        rms: np.ndarray = np.hypot(self.mean, self.deviation)
        return rms

    def by_name(self) -> dict[str, np.ndarray]:
        """Measures of each motion, float64[m, K], by the names that results use."""
        return {
            "maximum": self.maximum, "minimum": self.minimum, "peak": self.peak,
            "peak_to_peak": self.maximum - self.minimum,
            "mean": self.mean, "rms": self.rms, "rms_about_mean": self.deviation,
            "amplitude": np.abs(self.harmonic), "phase": np.angle(self.harmonic),
        }  # fmt: skip

    def columns(self, period: np.ndarray) -> dict[str, Any]:
        """Columns of an :class:`saltus.results.AttractorTable` for the first state and the
        contacts: of those in a whole period int64[m], in one forcing period where it is 0.
        """
        return {
            "period": period,
            "contacts": self.contacts * np.maximum(period, 1),
            "itinerary": self.itinerary,
            "peak": self.peak[:, 0],
            "rms": self.rms[:, 0],
            "margin": self.margin,
        }

    def rows(self, which: slice | np.ndarray) -> Measures:
        """Those of some of the motions, int64[n]."""
        index = np.arange(len(self.margin))[which].tolist()

        def some(column: Any) -> Any:
            return column[which] if isinstance(column, np.ndarray) else [column[i] for i in index]

        return Measures(*(some(getattr(self, field.name)) for field in fields(self)))

    def put(self, rows: np.ndarray, other: Measures) -> None:
        """Write another's numbers to the rows int64[n]."""
        for field in fields(self):
            mine, theirs = getattr(self, field.name), getattr(other, field.name)
            if isinstance(mine, np.ndarray):
                mine[rows] = theirs
            else:
                for row, one in zip(rows, theirs, strict=True):
                    mine[row] = one


def unknown(m: int, size: int, outputs: int | None = None) -> Measures:
    """Nothing known of m motions of these states and outputs (default: no outputs)."""
    wide = size if outputs is None else outputs
    maximum, minimum, mean, deviation = np.full((4, m, wide), np.nan)
    margin, span, contacts = np.full((3, m), np.nan)
    harmonic, turning = np.full((m, wide), np.nan + 0j), [np.zeros((0, wide)) for _ in range(m)]
    return Measures(
        maximum, minimum, mean, deviation, harmonic, margin, span, contacts, [""] * m, turning
    )


def measure(
    map_: Stroboscope,
    start: np.ndarray,
    periods: np.ndarray,
    window: int = APERIODIC_PERIODS,
    outputs: Outputs | None = None,
) -> Measures:
    """The numbers of the motions from states float64[m, D], row i by row i of the map.

    Parameters
    ----------
    map_ : Stroboscope
        The flow.
    start : float64[m, D]
        A point at a whole period on each.
    periods : int64[m]
        Period of each [forcing periods]; 0 for a motion that never repeats.
    window : int
        Forcing periods of such a motion that are looked at.
    outputs : Outputs, optional
        What is asked about; default the states.
    """
    wanted = outputs or states_alone(map_.system)
    result, parts = unknown(len(start), start.shape[1], len(wanted)), []
    for n in np.unique(periods):
        rows = np.flatnonzero(periods == n)
        step = max(1, HELD // (nodes_of(map_) * int(n or window)))
        step = min(step, TOGETHER) if start.shape[1] >= MANY_STATES else step
        parts += [rows[first : first + step] for first in range(0, len(rows), step)]

    def work(part: np.ndarray) -> Measures:
        n = int(periods[part[0]])
        return _measured(map_.rows(part, threads=1), start[part], n or window, n > 0, wanted)

    on_threads(work, parts, result.put, map_.threads)
    return result


def _measured(
    map_: Stroboscope, start: np.ndarray, span: int, closed: bool, outputs: Outputs
) -> Measures:
    """The numbers of some motions over ``periods`` periods, after which they repeat or don't."""
    waves = wave_motions(map_, start, span, outputs.formulas, outputs.guards)
    if waves is not None:
        return _measured_by_waves(map_, *waves, span, closed, len(outputs))
    size, wide = start.shape[1], len(outputs)
    whole, outcome = pieces(map_, start, span, outputs.formulas, outputs.guards)
    result = unknown(len(start), size, wide)
    if map_.method.records_contacts:
        _count_contacts(map_, outcome, span, closed, result)
    known = np.unique(whole.motion)
    if len(known):
        first = np.flatnonzero(np.diff(whole.motion, prepend=-1))
        turns = [
            _Turns.of(whole, first, quantity, closed) for quantity in range(whole.terms.shape[1])
        ]
        for output in range(wide):
            result.maximum[known, output], result.minimum[known, output] = _extremes(
                whole, first, turns[output], output
            )
        _means(map_, whole, first, wide, result)
        gaps = [wide + number for number in margin_gaps(map_.system)[0]]
        margins = [_margin(whole, first, turns[gap], gap) for gap in gaps]
        ranges = [np.subtract(*_extremes(whole, first, turns[gap], gap)) for gap in gaps]
        result.margin[known] = np.min(margins, axis=0, initial=np.inf) if margins else np.inf
        result.span[known] = np.max(ranges, axis=0) if ranges else 0.0
        shown = turns[size if map_.system.outputs.first and wide > size else 0]
        for motion, points in zip(known, shown.states(map_, whole, first, wide), strict=True):
            result.turning[motion] = points
    return result


def _count_contacts(
    map_: Stroboscope, outcome: Outcome, span: int, closed: bool, result: Measures
) -> None:
    result.contacts[:] = outcome.counters[:, st.EVENTS] / span
    if closed:
        result.itinerary[:] = _itineraries([guard.name for guard in map_.system.guards], outcome)


def _measured_by_waves(
    map_: Stroboscope,
    motions: list[WaveLegs | None],
    outcome: Outcome,
    span: int,
    closed: bool,
    outputs: int,
) -> Measures:
    """The numbers of motions that are sums of waves between their contacts."""
    size = outcome.state.shape[1]
    result = unknown(len(motions), size, outputs)
    _count_contacts(map_, outcome, span, closed, result)
    known = np.array([i for i, one in enumerate(motions) if one is not None], np.int64)
    if not len(known):
        return result
    legs = WaveLegs.joined([one for one in motions if one is not None])
    gaps = outputs + np.array(margin_gaps(map_.system)[0], np.int64)
    low, high = extremes(legs)
    result.maximum[known], result.minimum[known] = high[:, :outputs], low[:, :outputs]
    wanted = replace(legs, rows=legs.rows[:, :outputs])
    result.mean[known] = mean = means(wanted)
    result.deviation[known] = deviations(wanted, mean)
    if map_.system.forced_at is not None:
        period = np.broadcast_to(map_.period, len(motions))[known]
        result.harmonic[known] = harmonics(wanted, 2.0 * np.pi / period)
    result.margin[known] = least_turns(legs, gaps)
    result.span[known] = (high - low)[:, gaps].max(axis=1, initial=0.0)
    for i, states in zip(known, _turning_states(legs, size, closed), strict=True):
        result.turning[i] = states
    return result


def _turning_states(legs: WaveLegs, size: int, closed: bool) -> Iterator[np.ndarray]:
    """The states where the first one turns, float64[n, D], in the order of time, motion by motion:
    inside legs, and where one ends and the next begins.
    """
    states = replace(legs, rows=legs.rows[:, :size])
    leg, _, time = turns(legs, np.zeros(1, np.int64))
    moving = replace(legs, rows=legs.rows[:, :1] * legs.rates[:, None])
    every = np.arange(len(legs.length))
    first, last = (moving.values(every, at)[:, 0] for at in (0.0 * legs.length, legs.length))
    for motion in range(legs.motions):
        own = np.flatnonzero(legs.owner == motion)
        own = own[np.argsort(legs.begin[own])]
        before = np.roll(last[own], 1)
        before[0] = before[0] if closed else 0.0
        joints = own[before * first[own] < 0.0]
        inside = legs.owner[leg] == motion
        when = np.concatenate([legs.begin[leg[inside]] + time[inside], legs.begin[joints]])
        points = [states.values(leg[inside], time[inside]), states.values(joints, 0.0 * joints)]
        yield np.concatenate(points)[np.argsort(when, kind="stable")]


@dataclass(frozen=True)
class _Turns:
    """Turning points of a quantity: pieces int64[r], ascending, and positions on them, float64[r]
    in [0, 1].
    """

    piece: np.ndarray
    place: np.ndarray

    @classmethod
    def of(cls, whole: Pieces, first: np.ndarray, quantity: int, closed: bool) -> _Turns:
        """Inside pieces, and where one ends and the next begins; a closed motion goes on with its
        first piece after its last.
        """
        rates = polynomials.derivative(whole.terms[:, quantity])
        piece, place = polynomials.sign_changes(rates)
        after, before = polynomials.leading_signs(rates)
        last = np.append(first[1:], len(whole.motion)) - 1
        arrives = np.roll(before, 1)
        arrives[first] = before[last] if closed else 0.0
        joints = np.flatnonzero(arrives * after < 0.0)
        # it turns nowhere, or everywhere
        resting = first[(np.add.reduceat(after != 0.0, first) == 0)]
        piece, place = (
            np.concatenate([piece, joints, resting]),
            np.concatenate([place, np.zeros(len(joints) + len(resting))]),
        )
        order = np.lexsort((place, piece))
        return cls(piece[order], place[order])

    def values(self, whole: Pieces, quantity: int) -> np.ndarray:
        """The quantity there, float64[r]."""
        return polynomials.value(whole.terms[:, quantity, self.piece], self.place)

    def states(
        self, map_: Stroboscope, whole: Pieces, first: np.ndarray, size: int
    ) -> list[np.ndarray]:
        """The first ``size`` quantities there, float64[n, size] for each motion, each turn once."""
        period, motion = map_.period[whole.motion[self.piece]], whole.motion[self.piece]
        time = (
            whole.period[self.piece] * period
            + whole.phase[self.piece]
            + self.place * whole.length[self.piece]
        )
        again = np.append(False, (np.diff(motion) == 0) & (np.diff(time) < SAME * period[1:]))[
            : len(motion)
        ]
        points = polynomials.value(whole.terms[:, :size][:, :, self.piece], self.place).T[~again]
        return np.split(points, np.searchsorted(motion[~again], whole.motion[first])[1:])


def _extremes(
    whole: Pieces, first: np.ndarray, turns: _Turns, quantity: int
) -> tuple[np.ndarray, np.ndarray]:
    """Largest and smallest value of each motion: at its turns, and at the ends of its pieces, where
    it may jump.
    """
    begin, end = whole.terms[0, quantity], whole.terms[:, quantity].sum(axis=0)
    high, low, inside = (
        np.maximum(begin, end),
        np.minimum(begin, end),
        turns.values(whole, quantity),
    )
    np.maximum.at(high, turns.piece, inside)
    np.minimum.at(low, turns.piece, inside)
    return np.maximum.reduceat(high, first), np.minimum.reduceat(low, first)


def _margin(whole: Pieces, first: np.ndarray, turns: _Turns, gap: int) -> np.ndarray:
    """Smallest size of a gap where it turns, of each motion; zero where it is below the rounding
    error of the gap. Where an impact turns it, it has been closed at a speed and is no graze.
    """
    sizes = np.abs(turns.values(whole, gap))
    closed = sizes <= whole.noise[gap, turns.piece]
    sizes = np.where(closed, 0.0, sizes)
    sizes[closed & (turns.place == 0.0) & _struck(whole, first, gap)[turns.piece]] = np.inf
    least = np.full(len(whole.motion), np.inf)
    np.minimum.at(least, turns.piece, sizes)
    return np.minimum.reduceat(least, first)


def _struck(whole: Pieces, first: np.ndarray, gap: int) -> np.ndarray:
    """Pieces before which a gap has closed at a speed, bool[p]."""
    rates = polynomials.derivative(whole.terms[:, gap])
    begin, end = np.abs(rates[0]) / whole.length, rates.sum(axis=0) / whole.length
    before = np.arange(len(end)) - 1
    before[first] = np.append(first[1:], len(end)) - 1
    count = np.diff(np.append(first, len(end)))
    fastest = np.repeat(np.maximum.reduceat(np.maximum(begin, np.abs(end)), first), count)
    return np.asarray(np.abs(end[before]) > STRUCK * fastest)


def _means(
    map_: Stroboscope, whole: Pieces, first: np.ndarray, outputs: int, result: Measures
) -> None:
    """Mean, root mean square about it and first harmonic of the outputs, over the whole of each
    motion.
    """
    motion, count = whole.motion, np.diff(np.append(first, len(whole.motion)))
    known, forced = motion[first], map_.system.forced_at is not None
    places, weights = polynomials.gauss(PLACES)
    share = weights[:, None] * (
        whole.length / np.repeat(np.add.reduceat(whole.length, first), count)
    )
    if forced:
        angle = 2.0 * np.pi * (whole.phase + places[:, None] * whole.length) / map_.period[motion]
        in_phase, behind = share * np.cos(angle), share * np.sin(angle)

    def sums(part: np.ndarray) -> np.ndarray:
        return np.add.reduceat(part.sum(axis=0), first)

    for output in range(outputs):
        # by Horner's rule: a product of matrices rounds a piece by where it stands among others
        values = polynomials.value(whole.terms[:, output], places[:, None])
        # a small motion about a large mean keeps its digits
        origin = np.repeat(whole.terms[0, output, first], count)
        mean = sums(share * (values - origin))
        values -= origin + np.repeat(mean, count)
        result.mean[known, output] = whole.terms[0, output, first] + mean
        result.deviation[known, output] = np.sqrt(sums(share * values**2))
        if forced:
            sine = sums(behind * values)
            result.harmonic[known, output] = 2.0 * (sums(in_phase * values) - 1j * sine)


def _itineraries(names: list[str], outcome: Outcome) -> list[str]:
    """Guards met by each motion and the ways they were crossed; grazes left out."""
    contacts = outcome.contacts.rows(outcome.contacts.kind != st.GRAZE)
    texts = [
        f"{names[guard]}{'+' if way > 0 else '-'}"
        for guard, way in zip(contacts.guard, contacts.direction, strict=True)
    ]
    return [
        " ".join(texts[i:j]) for i, j in itertools.pairwise(contacts.begins(len(outcome.status)))
    ]
