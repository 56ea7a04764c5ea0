"""The equations of periodic orbits with a given contact sequence: each leg from one contact to the
next must end where that one begins, and on its boundary.

The unknowns are the times of all contacts and the states before them. A leg is a flight in one mode
without boundaries (system/leg.py), so the equations are smooth where a contact appears or vanishes,
and beyond: an impact may have no speed, or be met from behind. Orbits there are *virtual*, see
:meth:`Legs.admissible`. The map over a period has a square root at such a place, or a jump.
Dankowicz & Schilder, Recipes for Continuation (2013), chapter 9.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from saltus.analysis.branches.contact_sequences import ContactSequence, sequences, shift
from saltus.analysis.branches.contacts_along import At, Jumps
from saltus.analysis.branches.leg_flights import LegFlights
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.solve.floquet import across, multipliers
from saltus.kernels import status as st

#: Shorter times are rounding, in periods.
AT_ONCE = 1e-14
#: Contacts of an orbit that the free flow meets earlier or later by this share of its time are
#: others: as many, but not these. What rounding moves beside a graze is a thousandth of it.
FREE = 1e-3


class Legs:
    """Curves of periodic orbits of n periods with one contact sequence; a ``CurveEquations``.

    Unknowns z: the time of each contact in periods since the orbit's first point and the state
    before it, one contact after the other; the period [s] of a system without forcing; the
    parameters [SI]. An orbit without contacts has its first point in their place, at time 0.

    Parameters
    ----------
    orbits : PeriodicOrbits
        The equations with the contact sequence left to the flow.
    sequence : ContactSequence
        The contacts.
    scale : float64[k, z]
        Units of the unknowns.
    """

    def __init__(
        self, orbits: PeriodicOrbits, sequence: ContactSequence, scale: np.ndarray
    ) -> None:
        self.orbits, self.sequence, self.scale = orbits, sequence, scale
        self.n, self.size, self.free = orbits.n, orbits.size, orbits.free
        self.contacts = sequence.contacts
        self.count = max(len(self.contacts), 1)
        self._modes = [one.after for one in self.contacts] or [sequence.mode]
        self._beside = _widest_gap(sequence.phase)
        self._jumps = Jumps(orbits.parametric.system, self.contacts, self.size, sequence.mode)
        self.unit = float(orbits.map.period[0])  # of the time, in those of the parametric system
        self.flights = LegFlights(orbits, self._modes)
        self.phase = np.full((len(scale), 2, self.size), np.nan)  # point and direction

    @classmethod
    def of(
        cls, orbits: PeriodicOrbits, sequence: ContactSequence, z: np.ndarray, scale: np.ndarray
    ) -> tuple[Legs, np.ndarray]:
        """The equations of an orbit's own sequence, and its unknowns float64[z] in them.

        Parameters
        ----------
        orbits, z, scale
            An orbit float64[z] and the units of its unknowns.
        sequence : ContactSequence
            Its contacts, or some of them.
        """
        size, n, count = orbits.size, orbits.n, max(len(sequence.contacts), 1)
        others, unit = z[n * size :], scale[n * size :]
        each = np.append(1.0, scale[:size])
        legs = cls(orbits, sequence, np.append(np.tile(each, count), unit)[None])
        phase, after = sequence.phase, sequence.after
        if not sequence.contacts:
            phase, after = np.zeros(1), z[None, :size]
            before = after
        else:
            span = legs.spans(phase[None])
            before = np.roll(
                legs.flights.fly(after[None], others[None], phase[None], span)[0][0], 1, axis=0
            )
        nodes = np.concatenate([phase[:, None], before], axis=1)
        return legs, np.append(nodes.ravel(), others)

    @property
    def width(self) -> int:
        """Number of unknowns."""
        return self.count * (self.size + 1) + len(self.orbits.names) + self.free

    # -- unknowns ----------------------------------------------------------------------------------
    def nodes(self, z: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Times of the contacts of orbits float64[r, z] in periods, float64[r, m], the states
        before them, float64[r, m, D], and the other unknowns, float64[r, e].
        """
        used = self.count * (self.size + 1)
        nodes = z[:, :used].reshape(len(z), self.count, self.size + 1)
        return nodes[..., 0], nodes[..., 1:], z[:, used:]

    def values(self, z: np.ndarray) -> np.ndarray:
        """The parameters of orbits float64[..., z], float64[..., names]."""
        return z[..., self.count * (self.size + 1) + self.free :]

    def spans(self, phase: np.ndarray) -> np.ndarray:
        """Durations of the legs behind the contacts, in periods."""
        span: np.ndarray = np.roll(phase, -1, axis=1) - phase
        span[:, -1] += self.n
        return span

    def leg_at(self, z: np.ndarray, phase: float) -> int:
        """The leg of an orbit float64[z] that flies at a time [periods]."""
        return int(((phase - self.nodes(z[None])[0][0]) % self.n).argmin())

    def mode_of(self, place: int) -> int:
        """The mode of a leg, as bits."""
        return self._modes[place]

    def jumps_at(self, place: int) -> bool:
        """True if the state jumps at a contact."""
        return self.contacts[place].kind == st.IMPACT

    def sequence_at(self, z: np.ndarray) -> ContactSequence:
        """The contacts of an orbit float64[z]."""
        phase, _, _ = self.nodes(z[None])
        after = self.at(z[None]).after[0]
        speeds = self.speeds(z[None])[0] if self.contacts else np.zeros(1)
        count = len(self.contacts)
        return ContactSequence(
            self.contacts, phase[0, :count], after[:count], speeds[:count], self.sequence.mode
        )

    @property
    def free_scale(self) -> np.ndarray:
        """Units of the unknowns with the contact sequence left to the flow."""
        unit = self.scale[0]
        others = unit[self.count * (self.size + 1) :]
        return np.append(np.tile(unit[1 : self.size + 1], self.n), others)

    def tangent(self, z: np.ndarray) -> np.ndarray:
        """A unit vector along the curve at an orbit float64[z], in units of the scale."""
        derivative = self.evaluate(z[None], np.zeros(1, np.int64))[1]
        return np.asarray(np.linalg.svd(derivative[0])[2][-1])

    def at(self, z: np.ndarray) -> At:
        """Evaluate the contacts of orbits float64[r, z]: gaps, rates, states behind, and
        derivatives.
        """
        phase, before, others = self.nodes(z)
        carried = np.repeat(self.orbits.parameter_states(others)[0][:, None], self.count, axis=1)
        return self._jumps.at(phase * self.unit, np.concatenate([before, carried], axis=2))

    # -- equations ---------------------------------------------------------------------------------
    def evaluate(self, z: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See :class:`saltus.analysis.branches.equations.CurveEquations`."""
        at, spans = self.at(z), self.spans(self.nodes(z)[0])
        return self.closed(z, rows, at, *self.along(z, at, spans))

    def closed(
        self,
        z: np.ndarray,
        rows: np.ndarray,
        at: At,
        ends: np.ndarray,
        derivative: np.ndarray,
        by_end: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Residual and derivative that :meth:`evaluate` returns, from the results of :meth:`along`
        at the ends of the legs.
        """
        phase, before, others = self.nodes(z)
        derivative = np.concatenate([derivative, self._of_gaps(at, others)], axis=2)
        for i in range(self.count):
            there = (i + 1) % self.count * (self.size + 1)
            derivative[:, i, : self.size, there] += by_end[:, i]
            derivative[:, i, : self.size, there + 1 : there + 1 + self.size] -= np.eye(self.size)
        unit = self.scale[rows]
        residual = np.concatenate([ends - np.roll(before, -1, axis=1), at.gap[..., None]], axis=2)
        each = np.repeat(unit[:, None, 1 : self.size + 1], self.count, axis=1)
        if self.contacts:
            slope = np.abs(derivative[:, :, -1] * unit[:, None]).max(axis=2)
        else:  # the first point is at time 0
            residual[:, :, -1], derivative[:, :, -1] = phase, 0.0
            derivative[:, 0, -1, 0], slope = 1.0, np.ones((len(z), 1))
        each = np.concatenate([each, slope[..., None]], axis=2)
        residual = (residual / each).reshape(len(z), -1)
        derivative = (derivative / each[..., None]).reshape(*residual.shape, -1) * unit[:, None]
        if not self.free:
            return residual, derivative
        row, where = np.zeros((len(z), 1, z.shape[1])), phase[:, 0]
        row[:, 0, 0] = 1.0
        if not self.contacts:
            along = self.phase[rows, 1]
            where = ((before[:, 0] - self.phase[rows, 0]) / unit[:, 1 : self.size + 1] * along).sum(
                axis=1
            )
            row[:, 0, 0], row[:, 0, 1 : self.size + 1] = 0.0, along
        return np.append(residual, where[:, None], axis=1), np.append(derivative, row, axis=1)

    def along(
        self, z: np.ndarray, at: At, spans: np.ndarray, more: Sequence[int] = ()
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """States some time [periods] after each contact of orbits float64[r, z], and after ``more``
        of them: float64[r, m + more].

        Returns
        -------
        float64[r, m + more, D], float64[r, m + more, D, z], float64[r, m + more, D]
            The states, their derivatives with respect to the unknowns at a time that stays, and
            those with respect to that time [periods].
        """
        size, used, legs = self.size, self.count * (self.size + 1), [*range(self.count), *more]
        phase, _, others = self.nodes(z)
        _, slopes, order = self.orbits.parameter_states(others)
        ends, matrices = self.flights.fly(at.after[:, legs], others, phase[:, legs], spans, legs)
        by_state, by_start, by_span = matrices[..., :size], matrices[..., -2], matrices[..., -1]
        through = by_state @ at.by_state[:, legs]  # with respect to the states before the contact
        jumped = (by_state @ at.by_time[:, legs, :, None])[..., 0] * self.unit
        derivative = np.zeros((*ends.shape, z.shape[1]))
        for flight, i in enumerate(legs):
            here, mine = i * (size + 1), derivative[:, flight]
            mine[..., here] = by_start[:, flight] - by_span[:, flight] + jumped[:, flight]
            mine[..., here + 1 : here + 1 + size] = through[:, flight, :, :size]
        by_parameters = matrices[..., size:-2] + through[..., size:]
        derivative[..., used + order] = by_parameters * slopes[:, None, None]
        return ends, derivative, by_span

    def flight(self, z: np.ndarray, place: int, count: int) -> tuple[np.ndarray, np.ndarray]:
        """The leg behind a contact of an orbit float64[z], cut into ``count`` equal times: those
        since the contact [periods], float64[count + 1], and the states, float64[count + 1, D].
        """
        phase, _, others = self.nodes(z[None])
        span, after = self.spans(phase)[:, [place]], self.at(z[None]).after[:, [place]]
        start = self.flights.states(after, others, phase[:, [place]], span)[0]
        states = self.flights.samples(start, place, count)
        return span[0, 0] * np.linspace(0.0, 1.0, count + 1), states

    def _of_gaps(self, at: At, others: np.ndarray) -> np.ndarray:
        """Derivatives of the gaps at the contacts, float64[r, m, 1, z]."""
        size, used = self.size, self.count * (self.size + 1)
        _, slopes, order = self.orbits.parameter_states(others)
        result = np.zeros((*at.gap.shape, 1, used + others.shape[1]))
        for i in range(self.count):
            here = i * (size + 1)
            result[:, i, 0, here] = at.gap_by_time[:, i] * self.unit
            result[:, i, 0, here + 1 : here + 1 + size] = at.normal[:, i, :size]
        result[..., 0, used + order] = at.normal[..., size:] * slopes[:, None]
        return result

    def accepted(self, z: np.ndarray, rows: np.ndarray) -> None:
        """See :class:`saltus.analysis.branches.equations.CurveEquations`."""
        if self.free and not self.contacts:
            self.phase[rows, 0] = self.nodes(z)[1][:, 0]
            flow = self.at(z).rate[:, 0] / self.scale[rows, 1 : self.size + 1]
            self.phase[rows, 1] = flow / np.linalg.norm(flow, axis=1)[:, None]

    def near(self, z: np.ndarray, rows: np.ndarray) -> Legs:
        """The equations whose row i is curve rows[i], int64[r], with the condition on its phase at
        the orbit float64[r, z].
        """
        other = copy.copy(self)
        other.scale, other.phase = self.scale[rows], self.phase[rows].copy()
        other.accepted(z, np.arange(len(rows)))
        return other

    def alike(self, z: np.ndarray, rows: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """The same orbits from another period on, float64[r, s, z]."""
        phase, before, others = self.nodes(z)
        m, n, result = self.count, self.n, [z]
        for by in range(1, m):
            order = (np.arange(m) + by) % m
            if any(self.contacts[i] != self.contacts[j] for i, j in enumerate(order)):
                continue
            rolled = phase[:, order] + n * (np.arange(m) + by >= m)
            for periods in range(1, n):
                nodes = np.concatenate([(rolled - periods)[..., None], before[:, order]], axis=2)
                result.append(np.concatenate([nodes.reshape(len(z), -1), others], axis=1))
        return np.stack(result, axis=1)

    # -- what an orbit is --------------------------------------------------------------------------
    def multipliers(self, z: np.ndarray, derivative: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Floquet multipliers of orbits float64[r, z], the largest first, without the trivial one
        of a system without forcing; complex128[r, D] or [r, D - 1].
        """
        at, result = self.at(z), []
        for i in range(len(z)):
            segments = self.segments(at, derivative[i], i, int(rows[i]))
            if self.free:
                segments = across(product(segments), at.rate[i, 0])[None]
            result.append(segments)
        count, size = (1, self.size - 1) if self.free else (self.count, self.size)
        return multipliers(np.array(result).reshape(len(z), count, size, size))

    def segments(self, at: At, derivative: np.ndarray, i: int, row: int) -> np.ndarray:
        """The tangent map from each contact to the next one, both before them, float64[m, D, D]."""
        size, m, unit = self.size, self.count, self.scale[row]
        result = np.empty((m, size, size))
        for j in range(m):
            rows = slice(j * (size + 1), j * (size + 1) + size)
            here = j * (size + 1)
            block = derivative[rows, here : here + size + 1] / unit[here : here + size + 1]
            block = block * unit[1 : size + 1, None]
            through, by_time = block[:, 1:], block[:, 0]
            if m == 1:  # the end of the leg is at the same unknowns
                through, by_time = through + np.eye(size), by_time - at.rate[i, 0] * self.unit
            result[j] = self.behind(at, i, j, through, by_time)
        return result

    def behind(
        self, at: At, i: int, j: int, through: np.ndarray, by_time: np.ndarray
    ) -> np.ndarray:
        """The tangent map from before contact j of orbit i to a place behind it, float64[D, D]:
        from the derivatives there by the state before the contact and by its time [periods].
        """
        if not self.contacts:
            return through
        normal, rate = at.normal[i, j, : self.size], at.rate[i, j] * self.unit
        closing = normal @ rate + at.gap_by_time[i, j] * self.unit
        return np.asarray(through - np.outer(through @ rate + by_time, normal) / closing)

    def speeds(self, z: np.ndarray) -> np.ndarray:
        """Rates of the gaps before the contacts of orbits float64[r, z] in the directions in which
        they are met [unit/s or per period]; negative where one is met from behind, float64[r, m].
        """
        at, way = self.at(z), np.array([one.direction for one in self.contacts])
        closing = np.einsum("rmi,rmi->rm", at.normal[..., : self.size], at.rate) + at.gap_by_time
        return np.asarray(closing * way)

    def begin(self, z: np.ndarray) -> np.ndarray:
        """Times well away from a contact at which limit cycles float64[r, z], and all of their
        parts, may begin [periods], float64[r]; 0 without contacts, and for orbits that the forcing
        tells where to begin.
        """
        if not self.free or not self.contacts:
            return np.zeros(len(z))
        one, other = self.nodes(z)[0][:, self._beside].T
        gap = (other - one) % 1.0
        return np.asarray(one + 0.5 * np.where(gap == 0.0, 1.0, gap))

    def orbit(self, z: np.ndarray, begin: np.ndarray | float = 0.0) -> np.ndarray:
        """Orbits float64[r, z] by their points at whole periods after times float64[r] [periods]:
        unknowns of the free sequence.
        """
        phase, _, others = self.nodes(z)
        whole = np.arange(self.n) + np.broadcast_to(begin, len(z))[:, None]
        since = (whole[..., None] - phase[:, None]) % self.n  # of each point and contact
        since[np.minimum(since, self.n - since) < AT_ONCE] = 0.0
        # of contacts at once, as at a corner, the last in their order: behind it all have happened
        latest = since < since.min(axis=2, keepdims=True) + AT_ONCE
        last = (latest & ~np.roll(latest, -1, axis=2)).argmax(axis=2)
        rows = np.arange(len(z))[:, None]
        span = np.take_along_axis(since, last[..., None], axis=2)[..., 0]
        start = self.flights.states(self.at(z).after[rows, last], others, phase[rows, last], span)
        points = self.flights.ends(start, np.array(self._modes)[last])[0]
        return np.concatenate([points.reshape(len(z), self.n * self.size), others], axis=1)

    def points(self, z: np.ndarray) -> np.ndarray:
        """The points at whole periods of orbits float64[r, z], float64[r, n, D]."""
        return self.orbits.points(self.orbit(z))

    def admissible(self, z: np.ndarray) -> np.ndarray:
        """True for orbits float64[r, z] that the free flow makes: they meet these contacts and no
        others, bool[r].
        """
        result = np.array((self.spans(self.nodes(z)[0]) > 0).all(axis=1))
        if self.contacts:
            result &= (self.speeds(z) > 0).all(axis=1)
        which = np.flatnonzero(result)
        if not len(which):
            return result
        phase = self.nodes(z)[0]
        for i, free in zip(which, self.free_flow(z[which]), strict=True):
            sequence = ContactSequence(
                self.contacts,
                phase[i],
                self.sequence.after,
                self.sequence.velocity,
                self.sequence.mode,
            )
            result[i] = free is not None and shift(sequence, free, self.n, FREE) is not None
        return result

    def free_flow(self, z: np.ndarray) -> list[ContactSequence | None]:
        """The sequences of the free flow that begins on the orbits float64[r, z], in their time."""
        begin = self.begin(z)
        return [
            None if found is None else replace(found, phase=found.phase + since)
            for found, since in zip(
                sequences(self.orbits, self.orbit(z, begin)), begin, strict=True
            )
        ]


def _widest_gap(phase: np.ndarray) -> list[int]:
    """The contacts between which there is none for longest, whatever period they are in."""
    if not len(phase):
        return [0, 0]
    order = np.argsort(phase % 1.0)
    gaps = np.diff(phase[order] % 1.0, append=phase[order[0]] % 1.0 + 1.0)
    widest = int(gaps.argmax())
    return [int(order[widest]), int(order[(widest + 1) % len(order)])]


def product(segments: np.ndarray) -> np.ndarray:
    """The last times ... times the first."""
    result = np.eye(len(segments[0]))
    for one in segments:
        result = one @ result
    return result
