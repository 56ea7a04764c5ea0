"""Contacts of systems that are linear between them, one after the other by exponentials of their
matrices to 50 digits.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy.interpolate
from mpmath import mp

from saltus.system.linearity import linear_pieces


class Exact:
    """z(t) from a state at a time in one contact state: the exponential of the equations and their
    drives in one matrix. A course is given by its breaks and, between them, by coefficients of the
    time since the break.
    """

    def __init__(self, piece, rates, lags, courses=()):
        n, d, size = len(piece.matrix), len(rates), 1 + 2 * len(rates) + 4 * len(courses)
        self.matrix, self.lags, self.rates = mp.zeros(n + size), lags, rates
        self.courses = courses
        for i in range(n):
            for j in range(n):
                self.matrix[i, j] = mp.mpf(float(piece.matrix[i, j]))
            self.matrix[i, n] = mp.mpf(float(piece.constant[i]))
            for k in range(d):
                self.matrix[i, n + 1 + 2 * k] = mp.mpf(float(piece.driven[i, k]))
            for k in range(len(courses)):
                self.matrix[i, n + 1 + 2 * d + 4 * k] = mp.mpf(float(piece.driven[i, d + k]))
        for k in range(d):
            at, rate = n + 1 + 2 * k, mp.mpf(float(rates[k]))
            self.matrix[at, at + 1], self.matrix[at + 1, at] = -rate, rate
        for k in range(len(courses)):
            for j in range(3):
                at = n + 1 + 2 * d + 4 * k + j
                self.matrix[at, at + 1] = 1

    def path(self, state, begin, end):
        """States at tenths of each stretch between breaks, by one exponential for a stretch; the
        last one is that at the end.
        """
        stretches, found = [begin, *self.breaks(begin, end), end], []
        for now, next in pairwise(stretches):
            tenth, whole = mp.expm(self.matrix * (next - now) / 10), self.whole(state, now, next)
            for _ in range(10):
                whole = tenth * whole
                found.append(whole[: len(state), 0])
            state = found[-1]
        return found

    def zero(self, z, row, away, t):
        """A time at which row.z + away vanishes, and the state there, by Newton's method from a
        time near it; steps are series of the exponential, for they are short.
        """
        for _ in range(8):
            whole = term = self.whole(z, t, t)
            slope = row * (self.matrix * whole)[: len(z), 0]
            step = ((row * z)[0] + away) / slope[0]
            if abs(step) < mp.mpf("1e-22"):
                return t, z
            assert abs(step) * mp.mnorm(self.matrix, 1) < 1
            for k in range(1, 40):
                term = self.matrix * term * (-step / k)
                whole += term
            t, z = t - step, whole[: len(z), 0]
        raise AssertionError("Newton's method doesn't end")

    def breaks(self, begin, end):
        every = [one for breaks, _ in self.courses for one in breaks]
        return sorted({one for one in every if begin < one < end})

    def whole(self, z, now, end):
        parts = [*z, mp.mpf(1)]
        for rate, lag in zip(self.rates, self.lags, strict=True):
            angle = mp.mpf(float(rate)) * now + mp.mpf(float(lag))
            parts += [mp.cos(angle), mp.sin(angle)]
        for breaks, terms in self.courses:
            piece = max(sum(one <= (now + end) / 2 for one in breaks) - 1, 0)
            since = now - breaks[piece]
            for k in range(4):
                parts.append(
                    mp.fsum(terms[piece][j] * mp.ff(j, k) * since ** (j - k) for j in range(k, 4))
                )
        return mp.matrix(parts)


def check_contacts(system, start, run, most, tolerance, courses=(), *, afresh=False):
    """Each contact is a zero of its gap on the exact motion from the exact contact before it - or
    afresh, from the recorded one, to which it leads - and no other gap is beyond its boundary on
    the way. Returns how many there were.
    """
    linear, values = linear_pieces(system), dict(system.values)
    names = [guard.name for guard in system.guards]
    gaps, (rates, lags), known = linear.gaps(values), linear.rates(values), {}
    count = min(run.sizes["contact"], most)
    sizes = np.array([np.abs(run[f"contact_{name}"]).max() for name in system.states])
    with mp.workdps(50):
        state = mp.matrix([mp.mpf(float(one)) for one in start])
        mode, now = int(run.contact_mode_before[0]), mp.mpf(0)
        for k in range(count):
            if mode not in known:
                known[mode] = Exact(linear.piece(values, mode), rates, lags, courses)
            g = names.index(str(run.contact_guard.values[k]))
            row = mp.matrix([[mp.mpf(float(one)) for one in gaps.matrix[g]]])
            away = mp.mpf(float(gaps.constant[g]))
            claimed = mp.mpf(float(run.contact_time[k]))
            *way, there = known[mode].path(state, now, claimed)
            found, state = known[mode].zero(there, row, away, claimed)
            assert abs(found - claimed) < tolerance, (k, float(found - claimed))
            sides = np.where(mode >> np.arange(len(names)) & 1, 1.0, -1.0)
            others = np.array(mp.matrix([list(z) for z in way]).tolist(), float) @ gaps.matrix.T
            assert ((others + gaps.constant) * sides > -1e-12).all()
            now, mode = found, int(run.contact_mode_after[k])
            if afresh:
                recorded = [float(run[f"contact_{name}"][k]) for name in system.states]
                apart = np.abs(np.array(state.tolist(), float).ravel() - recorded)
                assert (apart < 1e-11 * sizes).all(), (k, apart / sizes)
                state, now = mp.matrix(recorded), claimed
    return count


def exact_record(times, heights, kind="spline"):
    """Breaks and coefficients of a record by scipy, to the last bit of its own numbers."""
    if kind == "linear":
        terms = np.column_stack([heights[:-1], np.diff(heights) / np.diff(times)])
        terms = np.pad(terms, ((0, 0), (0, 2)))
    else:
        terms = scipy.interpolate.CubicSpline(times, heights).c[::-1].T
    last = [heights[-1], 0.0, 0.0, 0.0]
    return [mp.mpf(float(one)) for one in times], [
        [mp.mpf(float(one)) for one in row] for row in [*terms, last]
    ]
