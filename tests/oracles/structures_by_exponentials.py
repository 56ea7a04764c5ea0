"""Random structures with springs and dampers as stops, and their motions from contact to contact by
matrix exponentials of their physical matrices. Nothing of the modal flow is used.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm
from scipy.optimize import brentq

import saltus as sl

#: A step turns the quickest mode of a contact state by so much at most [rad].
TURN = 0.25


@dataclass
class Stop:
    """A stop of one side: its deflection is ``row.x``, times ``side`` that of the side."""

    name: str
    row: np.ndarray
    side: int
    gap: float
    spring: float
    damper: float = 0.0
    preload: float = 0.0


@dataclass
class Structure:
    """``mass x'' + damping x' + stiffness x = drives - stops``; waves are (force, rate, phase),
    records (force, times, values).
    """

    mass: np.ndarray
    damping: np.ndarray
    stiffness: np.ndarray
    stops: list[Stop]
    waves: list[tuple[np.ndarray, float, float]]
    records: list[tuple[np.ndarray, np.ndarray, np.ndarray]]

    def reduced(self, shapes):
        """The same in coordinates of modes: x = shapes q."""
        return Structure(
            *(shapes.T @ one @ shapes for one in (self.mass, self.damping, self.stiffness)),
            [replace(one, row=one.row @ shapes) for one in self.stops],
            [(force @ shapes, *rest) for force, *rest in self.waves],
            [(force @ shapes, *rest) for force, *rest in self.records],
        )


class Exponentials:
    """The motion of a structure: z = (x, x', 1, cosine and sine of each wave, value and three
    derivatives of each record).
    """

    def __init__(self, given):
        self.given, self.n, self.known = given, len(given.mass), {}
        self.splines = [CubicSpline(times, values) for _, times, values in given.records]
        self.breaks = sorted({float(one) for _, times, _ in given.records for one in times})

    def rows(self, stop):
        """What of z is the gap that a stop still has, and its rate."""
        size = 2 * self.n + 1 + 2 * len(self.given.waves) + 4 * len(self.splines)
        gap, rate = np.zeros((2, size))
        gap[: self.n] = rate[self.n : 2 * self.n] = -stop.side * stop.row
        gap[2 * self.n] = stop.gap
        return gap, rate

    def state(self, touching):
        """Matrix of a contact state, its step, and the gaps with their rates, positive as long as
        the state lasts.
        """
        if touching in self.known:
            return self.known[touching]
        given, n = self.given, self.n
        pairs = [self.rows(stop) for stop in given.stops]
        a = np.zeros(2 * (len(pairs[0][0]),))
        a[:n, n : 2 * n] = np.eye(n)
        a[n : 2 * n, : 2 * n] = -np.hstack([given.stiffness, given.damping])
        at = 2 * n + 1
        for force, rate, _ in given.waves:
            a[n : 2 * n, at] = force
            a[at, at + 1], a[at + 1, at] = -rate, rate
            at += 2
        for force, _, _ in given.records:
            a[n : 2 * n, at] = force
            a[range(at, at + 3), range(at + 1, at + 4)] = 1.0
            at += 4
        for stop, (gap, rate), touches in zip(given.stops, pairs, touching, strict=True):
            along = stop.side * stop.row
            a[n : 2 * n, 2 * n] += along * stop.preload
            if touches:
                a[n : 2 * n] += np.outer(along, stop.spring * gap + stop.damper * rate)
        a[n : 2 * n] = np.linalg.solve(given.mass, a[n : 2 * n])
        step = TURN / np.abs(np.linalg.eigvals(a)).max()
        signs = [-1.0 if one else 1.0 for one in touching]
        rows = np.array([sign * gap for sign, (gap, _) in zip(signs, pairs, strict=True)])
        self.known[touching] = a, step, expm(a * step), rows
        return self.known[touching]

    def drives(self, t):
        found = [1.0]
        for _, rate, phase in self.given.waves:
            found += [math.cos(rate * t + phase), math.sin(rate * t + phase)]
        for spline in self.splines:
            piece = min(np.searchsorted(spline.x, t, side="right"), len(spline.x) - 1) - 1
            found += [np.polyder(spline.c[:, piece], k) for k in range(4)]
            found[-4:] = [float(np.polyval(one, t - spline.x[piece])) for one in found[-4:]]
        return found

    def run(self, start, t_end, most=np.inf):
        """The contacts, as (time, number of the stop, whether it begins, the largest entry of the
        derivative there), the state at the end and its derivative with respect to the start; it
        ends after ``most`` contacts. A start may be on a boundary from exact rest.
        """
        z, whole, now, found = np.r_[start, self.drives(0.0)], np.eye(len(start)), 0.0, []
        touching, zero = self.begin(z)
        size, stretches = len(start), [one for one in self.breaks if 0 < one < t_end]
        for end in [*stretches, t_end]:
            while now < end and len(found) < most:
                a, step, over, rows = self.state(touching)
                if step > end - now:
                    step, over = end - now, expm(a * (end - now))
                first = self.first(a, rows, z, over @ z, step, zero)
                zero = None
                if first is not None:
                    step, zero = first
                    over = expm(a * step)
                z, now = over @ z, end if step == end - now else now + step
                whole = (over[:size, :size]) @ whole
                z[size:] = self.drives(now)
                if first is not None:
                    touching = tuple(one != (k == zero) for k, one in enumerate(touching))
                    found.append((now, zero, touching[zero], np.abs(whole).max()))
                    jump = ((self.state(touching)[0] - a) @ z)[:size]
                    whole += np.outer(jump, rows[zero, :size] @ whole / (rows[zero] @ a @ z))
        return found, z[:size], whole

    def begin(self, z):
        """The contact state at the start. A gap that is zero goes where its first derivative that
        isn't zero leads.
        """
        touching = [self.rows(stop)[0] @ z < 0 for stop in self.given.stops]
        zero = None
        for k, stop in enumerate(self.given.stops):
            gap, a = self.rows(stop)[0], self.state(tuple(touching))[0]
            for _ in range(6):
                if gap @ z != 0:
                    break
                zero, gap = k, gap @ a
            touching[k] = bool(gap @ z < 0)
        return tuple(touching), zero

    def first(self, a, rows, z, after, step, zero):
        """The first gap that closes in a step, as (time, number); one is zero as it begins. A gap
        that is open at both ends may be closed between, if its rate is negative there.
        """
        found, ends = [], np.array([z, after])
        gaps, rates, bends = (ends @ one.T for one in (rows, rows @ a, rows @ a @ a))
        for k, row in enumerate(rows):
            gap, rate, bend = (
                lambda t, one=one: one @ (expm(a * t) @ z) for one in (row, row @ a, row @ a @ a)
            )
            begin, end = 1e-3 * step if k == zero else 0.0, step
            if gaps[1, k] > 0:
                if rates[0, k] < 0 < rates[1, k]:
                    end = zero_of(rate, begin, step)
                elif rates[1, k] > 0 and bends[0, k] < 0 < bends[1, k]:
                    turn = zero_of(bend, 0.0, step)
                    if rate(turn) > 0:
                        continue
                    end = zero_of(rate, turn, step)
                else:
                    continue
                if gap(end) > 0:
                    continue
            assert gap(begin) > 0, "a contact shorter than a thousandth of a step"
            found.append((zero_of(gap, begin, end), k))
        return min(found, default=None)


def zero_of(function, begin, end):
    return brentq(function, begin, end, xtol=1e-18, rtol=1e-15)


def random_structure(rng):
    """A random structure as :func:`saltus.structure` takes it, the same as matrices in its
    coordinates, their shapes, and the time of its motion.

    1 to 12 degrees of freedom, 1 to 4 stops: soft to very stiff, damped, pressed on, on both sides,
    between two degrees of freedom, closed at the start. Forces and bases of one or more harmonics,
    constant, or a record of unequal steps in units of its own. Undamped to overdamped, a free body
    now and then, all modes or some.
    """
    n = int(rng.integers(1, 13))
    turn, rates = np.linalg.qr(rng.normal(size=(n, n)))[0], 10 ** rng.uniform(1.5, 4.0, n)
    if n > 1 and rng.random() < 0.15:
        rates[0] = 0.0
    root = rng.normal(size=(n, n)) * rng.choice([0.0, 0.5])
    mass = np.eye(n) + root @ root.T / n
    stiffness = turn @ np.diag(rates) @ turn.T
    stiffness = (stiffness + stiffness.T) / 2
    loss = rng.normal(size=(n, n)) * rng.choice([0.0, 0.5, 2.0, 30.0])
    damping = loss @ loss.T / n
    w = math.sqrt(np.sort(rates)[min(1, n - 1)]) * rng.uniform(0.6, 2.5)
    modes, names = int(rng.integers((n + 1) // 2, n + 1)), [f"x{i + 1}" for i in range(n)]
    contacts, stops, forces, bases, waves, records = [], [], [], [], [], []
    for k in range(int(rng.integers(1, 5))):
        at, to = int(rng.integers(n)), int(rng.integers(n))
        side = str(rng.choice(["upper", "lower", "both"]))
        gap = float(
            rng.choice([*rng.uniform([1e-3, -2e-3], [0.02, 0.0]), 0.0][: 3 if k == 0 else 2])
        )
        gap = gap if side != "both" else abs(gap) + 1e-4
        spring = float(10 ** rng.choice([rng.uniform(2.5, 5), rng.uniform(5, 7)]))
        damper = float(rng.choice([0.0, 10 ** rng.uniform(-1, 2)]))
        preload = float(rng.choice([0.0, 10.0])) if side != "both" else 0.0
        more = {"damping": damper} if damper else {}
        more |= {"preload": preload} if preload else {}
        more |= {"to": names[to]} if to != at else {}
        contacts.append(sl.Contact(names[at], spring, gap, side=side, name=f"s{k}", **more))
        row = np.eye(n)[at] - (np.eye(n)[to] if to != at else 0.0)
        for word, sign in (("upper", 1), ("lower", -1)):
            if side == word or side == "both":
                name = f"s{k} {word}" if side == "both" else f"s{k}"
                stops.append(Stop(name, row, sign, gap, spring, damper, preload))
    for harmonic in rng.choice([0, 1, 1, 2, 3], int(rng.integers(1, 4))).tolist():
        level, phase = float(rng.uniform(2, 30)), float(rng.uniform(0, 6)) * (harmonic > 0)
        more = {"harmonic": harmonic} | ({"phase": phase} if harmonic else {})
        if rng.random() < 0.7:
            at = int(rng.integers(n))
            forces.append(sl.Force(names[at], level, **more))
            waves.append((level * np.eye(n)[at], harmonic * w, phase))
        else:
            moved = rng.normal(size=n)
            bases.append(sl.Base(moved, level, **more))
            waves.append((-level * mass @ moved, harmonic * w, phase))
    t_end = 2 * math.pi / w * float(rng.uniform(3, 8))
    if rng.random() < 0.3:
        times = np.cumsum(rng.uniform(0.3, 1.7, 30))
        times = (times - times[0]) * 1.1 * t_end / (times[-1] - times[0])
        values, moved = rng.normal(size=30), rng.normal(size=n)
        unit, size = [("g0", 9.80665), ("mm/s^2", 1e-3)][int(rng.integers(2))]
        values = values * 8 / size
        bases.append(sl.Base(moved, sl.recorded(times, values, unit)))
        records.append((-mass @ moved, times, values * size))
    some = any(rate for _, rate, _ in waves)
    made = sl.structure(
        mass, stiffness, damping, modes=modes, contacts=contacts, forces=forces, base=bases or None,
        frequency=w / (2 * math.pi) if some else None,
    )  # fmt: skip
    shapes = sl.structure_modes(mass, stiffness, modes)["shape"].values
    whole = Structure(mass, damping, stiffness, stops, waves, records)
    return made, whole.reduced(shapes), 2 * math.pi / w, t_end
