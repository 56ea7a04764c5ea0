"""Motions of rough-and-ready structures - frequencies over decades or nearly equal, damping from
none to five times critical, gaps of a billionth to a thousand of the motion, stops to 1e9 times
the structure, drives in resonance to the last bits, records that jump - looked at leg by leg.

From each recorded contact to the next the exact motion is stepped by a matrix exponential so that
the fastest mode turns by TURN: it must lead to the recorded state and time, and no other gap may
close on the way. ``PYTHONPATH=src:tests python -m oracles.structure_legs COUNT [SEED]`` asks COUNT
structures; without a seed it draws one from the clock, and prints it.
"""

from __future__ import annotations

import argparse
import math
import time
import warnings
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.linalg import expm

import saltus as sl
from saltus.system.linearity import linear_pieces

TURN, EPS = 0.2, 2.0**-52
#: Steps of a leg, at most: longer ones aren't asked.
MOST = 2**16
#: Contacts as near as this in time are one instant.
ONE_INSTANT = 1e-13
#: Parts of a step in which a gap that turns near its boundary is looked at.
PARTS = 64
METHOD = sl.Modal(max_events=600, max_steps=20_000)


@dataclass
class Found:
    """What the legs of a motion tell: contacts, legs that were too long, the worst time of a
    contact [s] and state in units of the motion, contacts that were missed.
    """

    contacts: int
    skipped: int = 0
    time: float = 0.0
    state: float = 0.0
    missed: list[str] = field(default_factory=list)


class Leg:
    """The exact motion in one contact state: states in units of velocities, the constant 1, cosine
    and sine of each drive, value and derivatives of each record.
    """

    def __init__(self, piece, gaps, sides, rates, lags, records, units):
        n, d, size = len(units), len(rates), len(units) + 1 + 2 * len(rates) + 4 * len(records)
        a = np.zeros((size, size))
        a[:n, :n], a[:n, n] = piece.matrix, piece.constant
        for k in range(d):
            at = n + 1 + 2 * k
            a[:n, at], a[at, at + 1], a[at + 1, at] = piece.driven[:, k], -rates[k], rates[k]
        for k in range(len(records)):
            at = n + 1 + 2 * d + 4 * k
            a[:n, at] = piece.driven[:, d + k]
            a[range(at, at + 3), range(at + 1, at + 4)] = 1.0
        self.rates, self.lags, self.records = rates, lags, records
        self.units = np.concatenate([units, np.ones(size - n)])
        self.matrix = self.units[:, None] * a / self.units
        self.fastest = max(
            np.abs(np.linalg.eigvals(piece.matrix)).max(), np.abs(rates).max(initial=0.0)
        )
        rows = np.zeros((len(sides), size))
        rows[:, :n], rows[:, n] = gaps.matrix, gaps.constant
        self.gaps = sides[:, None] * rows / self.units
        self.slopes = self.gaps @ self.matrix

    def whole(self, z, begin, end):
        """All that moves, at the beginning of a stretch without breaks."""
        parts = [*z, 1.0]
        for rate, lag in zip(self.rates, self.lags, strict=True):
            parts += [math.cos(rate * begin + lag), math.sin(rate * begin + lag)]
        for breaks, terms in self.records:
            piece = np.searchsorted(breaks, (begin + end) / 2, side="right") - 1
            course = np.polynomial.Polynomial(terms[piece])
            parts += [course.deriv(k)(begin - breaks[piece]) for k in range(4)]
        return np.array(parts) * self.units

    def steps(self, whole, length):
        """The motion over a length in equal steps, float64[size, steps + 1], by doubling."""
        count = max(math.ceil(length * self.fastest / TURN), 4)
        power, found = expm(self.matrix * (length / count)), whole[:, None]
        while found.shape[1] <= count:
            found = np.hstack([found, power @ found[:, : count + 1 - found.shape[1]]])
            power = power @ power
        return found


def check(system, run, records=()):
    """Look at all legs of a motion from where it begins."""
    linear, values, n = linear_pieces(system), dict(system.values), len(system.states)
    gaps, (rates, lags) = linear.gaps(values), linear.rates(values)
    names, times = [guard.name for guard in system.guards], run.contact_time.values
    ends = np.array([run[f"contact_{name}"].values for name in system.states]).reshape(n, -1).T
    ends = np.vstack([ends, [float(run[f"end_{name}"]) for name in system.states]])
    modes = [int(run.mode.values.ravel()[0]), *run.contact_mode_after.values.tolist()]
    if len(times):
        modes[0] = int(run.contact_mode_before[0])
    squares = np.min(
        [-np.diag(linear.piece(values, m).matrix[n // 2 :, : n // 2]) for m in modes], 0
    )
    rate = np.sqrt(np.maximum(squares, np.abs(rates).max(initial=1e-3) ** 2 * (squares <= 0)))
    units = np.concatenate([rate, np.ones(n // 2)])
    z = np.array([float(run[name].values.ravel()[0]) for name in system.states])
    sizes = np.abs(np.vstack([z, ends])).max(axis=0) * units
    found, now, known = Found(len(times)), 0.0, {}
    for k, mode in enumerate(modes):
        if mode not in known:
            sides = np.where(mode >> np.arange(len(names)) & 1, 1.0, -1.0)
            piece = linear.piece(values, mode)
            known[mode] = Leg(piece, gaps, sides, rates, lags, records, units)
        to = times[k] if k < len(times) else float(run.end_time)
        met, fresh = (
            {names.index(str(run.contact_guard.values[j])) for j in np.flatnonzero(one)}
            for one in (np.abs(times - to) <= ONE_INSTANT * to,
                        np.abs(times - now) <= ONE_INSTANT * now)
        )  # fmt: skip
        at = names.index(str(run.contact_guard.values[k])) if k < len(times) else -1
        _look(found, known[mode], z, now, to, ends[k], met, fresh, at, sizes)
        z, now = ends[k], to
    return found


def _look(found, leg, z, begin, to, end, met, fresh, crossed, sizes):
    """Look at one leg: where it leads, and whether a gap closes on the way."""
    n, length, at = len(z), to - begin, begin
    if length * leg.fastest > MOST * TURN:
        found.skipped += 1
        return
    if length <= 0.0:
        return
    inner = sorted({one for breaks, _ in leg.records for one in breaks if begin < one < to})
    for stop in [*inner, to]:
        path = leg.steps(leg.whole(z, at, stop), stop - at)
        largest = np.abs(path).max(axis=1)
        largest[:n] = np.maximum(largest[:n], sizes)
        terms = np.abs(leg.gaps) @ largest
        noise = 64 * EPS * terms * (1 + 0.02 * leg.fastest * length)
        values, slopes = leg.gaps @ path, leg.slopes @ path
        for g in range(len(values)):
            first = 1 if g in fresh and at == begin else 0
            last = -1 if g in met and stop == to else None
            least = values[g, first:last].min(initial=np.inf)
            step = (stop - at) / (path.shape[1] - 1)
            least = min(
                least, _dip(leg, g, path, step, values[g, :last], slopes[g, :last], terms[g])
            )
            if least < -noise[g]:
                found.missed.append(f"gap {g} from {at!r} s on: {least / terms[g]:.2g}")
        z, at = path[:n, -1] / leg.units[:n], stop
    loss = 1 + 0.02 * leg.fastest * length
    apart = np.abs((z - end) * leg.units[:n]).max()
    found.state = max(found.state, apart / max(largest[:n].max(), sizes.max()) / loss)
    if crossed >= 0 and abs(values[crossed, -1]) > 30 * EPS * terms[crossed]:
        found.time = max(found.time, abs(values[crossed, -1] / slopes[crossed, -1]))


def _dip(leg, g, path, length, values, slopes, terms):
    """The least value of a gap where it turns between two steps, each of a length, near its
    boundary.
    """
    least, step = np.inf, None
    turns = (slopes[:-1] < 0) & (slopes[1:] > 0) & (values[:-1] > 0) & (values[1:] > 0)
    # a cubic's turn is below the ends by a quarter of the step times the slopes at most, and more
    near = np.minimum(values[:-1], values[1:]) < 0.05 * terms
    for i in np.flatnonzero(turns & near).tolist():
        if step is None:
            step = expm(leg.matrix * (length / PARTS))
        z = path[:, i]
        for _ in range(PARTS):
            z = step @ z
            if leg.slopes[g] @ z > 0:
                break
            least = min(least, leg.gaps[g] @ z)
    return least


# -- structures ------------------------------------------------------------------------------------
def drawn(rng):
    """A random structure, its start, the end of its motion, and its records as polynomials."""
    n, count = int(rng.choice([1, 2, 3, 5, 8, 13, 20, 30])), int(rng.integers(1, 9))
    kind, base = str(rng.choice(["apart", "near", "decades", "beam"])), 10 ** rng.uniform(-1, 3)
    w = {
        "apart": lambda: 10 ** rng.uniform(0, 2, n),
        "near": lambda: (
            (1 + rng.choice([1e-15, 1e-12, 1e-8, 1e-4, 1e-2], n) * rng.normal(size=n))
            * rng.choice([1, 1, 2.5, 7], n)
        ),
        "decades": lambda: 10 ** rng.uniform(0, 5.5, n),
        "beam": lambda: np.arange(1, n + 1) ** 2.0,
    }[kind]()
    w = np.sort(base * w)
    if n > 1 and rng.random() < 0.15:
        w[0] = 0.0
    alone = kind == "decades" or rng.random() < 0.2
    turn = np.eye(n) if alone else np.linalg.qr(rng.normal(size=(n, n)))[0]
    stiffness = turn @ np.diag(w**2) @ turn.T
    stiffness = (stiffness + stiffness.T) / 2
    ratios = rng.choice([0.0, 0.01, 0.1, 0.5, 1.0, 1.0, 2.0, 5.0], n)
    if rng.random() < 0.5:
        ratios[:] = rng.choice([0.0, 0.001, 0.02, 1.0])
    some = w[w > 0]
    own = float(some[min(int(rng.integers(3)), len(some) - 1)])
    contacts, touching = _stops(rng, n, count, own)
    rate = _drive(rng, stiffness, touching, own)
    t_end = 2 * math.pi / rate * rng.uniform(2, 12)
    forces, records = [], []
    for harmonic in rng.choice([0, 1, 1, 1, 2, 5], int(rng.integers(1, 4))).tolist():
        more = {"phase": float(rng.uniform(0, 6))} if harmonic else {}
        at, level = f"x{rng.integers(n) + 1}", float(rng.uniform(0.1, 2))
        forces.append(sl.Force(at, level, harmonic=harmonic, **more))
    if rng.random() < 0.3:
        t_end /= 3
        record, course = _record(rng, t_end)
        forces.append(sl.Force(f"x{rng.integers(n) + 1}", record))
        records.append(course)
    made = sl.structure(
        np.eye(n), stiffness, damping_ratio=ratios.tolist(), modes=n, contacts=contacts,
        forces=forces,
        frequency=rate / (2 * math.pi) if any(one.harmonic and not callable(one.amplitude)
                                              for one in forces) else None,
    )  # fmt: skip
    start = np.zeros(2 * n)
    if rng.random() < 0.3:
        start = 0.3 * rng.normal(size=2 * n) * np.repeat([own**-2, 1 / own], n)
    return made, start, t_end, records


def _stops(rng, n, count, own):
    """Contacts, and what they add to the stiffness."""
    contacts, touching = [], []
    for k in range(count):
        at, to, side = *rng.integers(n, size=2), str(rng.choice(["upper", "lower", "both"]))
        exponent = rng.choice([rng.uniform(-9, 3), rng.uniform(-3, 0.5), rng.uniform(-1, 0.3)])
        gap, more = float(10**exponent / own**2), {}
        exponent = rng.choice([rng.uniform(-2, 3), rng.uniform(0, 2), rng.uniform(3, 9)])
        spring = float(own**2 * 10**exponent)
        if side != "both":
            gap *= float(rng.choice([1, 1, 1, -1, 0]))
            if rng.random() < 0.2:
                more["preload"] = float(rng.choice([0.1, 1, 10]))
        if rng.random() < 0.2:
            share = rng.choice([0.01, 0.3, 1.0, 1.0, 3.0])
            more["damping"] = float(2 * share * math.sqrt(spring + own**2))
        row = np.eye(n)[at]
        if at != to and rng.random() < 0.3:
            more["to"], row = f"x{to + 1}", row - np.eye(n)[to]
        contacts.append(sl.Contact(f"x{at + 1}", spring, gap, side=side, name=f"s{k}", **more))
        touching.append(spring * np.outer(row, row))
    return contacts, touching


def _drive(rng, stiffness, touching, own):
    """The rate of the drive: anywhere, or that of a mode, or of a mode of a contact state."""
    which = rng.random()
    if which < 0.35:
        return own * rng.uniform(0.3, 3)
    if which < 0.65:
        return own * (1 + rng.choice([0.0, 1e-14]))
    whole = stiffness + sum(one * rng.integers(2) for one in touching)
    rates = np.sqrt(np.abs(np.linalg.eigvalsh(whole)))
    rate = rates[min(int(rng.integers(3)), len(rates) - 1)]
    return (rate or own) * (1 + rng.choice([0.0, 1e-14, 1e-10, 1e-6]))


def _record(rng, t_end):
    """A record that repeats values and may jump; its breaks and polynomials."""
    count, kind = int(rng.integers(4, 25)), str(rng.choice(["linear", "spline"]))
    values = rng.choice([0.0, 1.0, -1.0, rng.normal()], count)
    times = np.cumsum(rng.choice([1.0, 1e-9, 1e-3, 3.0], count))
    times = (times - times[0]) * 1.1 * t_end / (times[-1] - times[0])
    if kind == "spline" or (np.diff(times) <= 0).any():
        times = np.linspace(0.0, 1.1 * t_end, count)
    terms = CubicSpline(times, values).c[::-1].T
    if kind == "linear":
        terms = np.column_stack([values[:-1], np.diff(values) / np.diff(times)])
        terms = np.pad(terms, ((0, 0), (0, 2)))
    last = [[values[-1], 0.0, 0.0, 0.0]]
    return sl.recorded(times, values, kind=kind), (times, np.vstack([terms, last]))


def asked(seed, number):
    """The status of one structure's motion, and what its legs tell."""
    made, start, t_end, records = drawn(np.random.default_rng([seed, number]))
    run = sl.simulate(
        made, start, t_end=t_end, samples=2, method=METHOD, progress=False, time_errors="local"
    )
    assert run.attrs["method"] == "Modal"
    return str(run.status.values), check(made, run, records)


def main():
    """Ask many structures."""
    parser = argparse.ArgumentParser(description="Legs of random structures.")
    parser.add_argument("count", type=int)
    parser.add_argument("seed", type=int, nargs="?", default=time.time_ns() % 2**32)
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    print("seed", given.seed)
    contacts, worst, statuses = 0, 0.0, {}
    for number in range(given.count):
        status, found = asked(given.seed, number)
        statuses[status] = statuses.get(status, 0) + 1
        contacts, worst = contacts + found.contacts, max(worst, found.state)
        if found.missed or found.state > 1e-10 or status not in ("ok", "budget_events", "resting"):
            print(f"{given.seed}.{number}: {status}, {found}", flush=True)
    print(f"{contacts} contacts, worst state {worst:.2g}, {statuses}")


if __name__ == "__main__":
    main()
