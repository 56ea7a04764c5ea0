"""Branches of random impact oscillators: each orbit closes, flight by flight, in closed form."""

from __future__ import annotations

import time

import numpy as np
import pytest
from scipy.optimize import brentq

import saltus as sl
from saltus.errors import ParameterError

#: Times in a flight between which the stop is looked for, in periods: bounces may be short.
GRID = np.concatenate([[0.0], np.geomspace(1e-7, 1.0, 800)])
#: Impacts of an orbit that are counted: each is slower than the one before.
FEW = 12
#: Largest multiplier of orbits that are asked: rounding grows by it.
CALM = 1e3
#: Smallest gap of orbits that are asked: at a graze rounding moves the end by its root.
GRAZES = 1e-6


def flown(values, start, n):
    """State after n forcing periods, and the impacts on the way."""
    k, d, f, gap, e, w = (
        values[name]
        for name in ("stiffness", "damping", "force", "gap", "restitution", "frequency")
    )
    rate, steady = -d / 2 + 1j * np.sqrt(k - d * d / 4), f / (k - w * w + 1j * d * w)
    period, at, (x, v), impacts = 2 * np.pi / w, 0.0, start, 0
    while True:
        drive = steady * np.exp(1j * w * at)
        a = x - drive.real
        b = (v - (1j * w * drive).real - rate.real * a) / -rate.imag
        free = a + 1j * b

        def state(since, drive=drive, free=free):
            own, other = free * np.exp(rate * since), drive * np.exp(1j * w * since)
            return (own + other).real, (rate * own + 1j * w * other).real

        left = n * period - at
        times = period * np.concatenate([GRID, 1.0 + np.arange(1, 400 * n - 399) / 400])
        times = np.append(times[times < left], left)
        place, speed = state(times)
        tops = [
            brentq(lambda s: state(s)[1], times[i], times[i + 1], xtol=1e-16)
            for i in np.flatnonzero((speed[:-1] > 0) & (speed[1:] <= 0) & (place[1:] <= gap))
        ]
        times = np.union1d(times, tops)
        beyond = np.flatnonzero(state(times)[0][1:] > gap)
        if not len(beyond):
            return state(left), impacts
        i = int(beyond[0])
        begin = times[i] if i else 0.5 * times[1]
        since = brentq(lambda s: state(s)[0] - gap, begin, times[i + 1], xtol=1e-16)
        at, x, v, impacts = at + since, gap, -e * state(since)[1], impacts + 1


def checked(seed):
    """Points of a random oscillator's branches that were held against the closed form."""
    rng = np.random.default_rng(seed)
    values = {
        "damping": rng.uniform(0.02, 0.2), "restitution": rng.uniform(0.3, 0.9),
        "gap": rng.choice([0.0, rng.uniform(0.0, 1.0)]),
    }  # fmt: skip
    stop, low = sl.models.impact_oscillator("chatter", **values), rng.uniform(0.25, 2.5)
    band = (low, low * rng.uniform(1.2, 2.0))
    try:
        found = sl.branches(stop, {"frequency": band}, at=2, points=200, progress=False)
    except ParameterError:  # no start settles to an orbit
        return 0
    along, of = found.point_frequency.values, found.point_branch.values
    assert band[0] * (1 - 1e-12) <= along.min() <= along.max() <= band[1] * (1 + 1e-12)
    rests = np.array(["at rest" in one for one in found.point_itinerary.values])
    assert all(len(set(rests[of == branch])) == 1 for branch in set(of.tolist()))
    size = np.hypot(found.point_multiplier_real, found.point_multiplier_imag).max("multiplier")
    count = 0
    clear = ~rests & (size.values < CALM) & (found.point_margin.values > GRAZES)
    for i in np.flatnonzero(clear)[::3]:
        n = int(found.branch_periods[of[i]])
        start = [float(found[f"point_{name}"].values[i, 0]) for name in ("x", "v")]
        end, impacts = flown({**stop.values, "frequency": along[i]}, start, n)
        error = np.abs(np.subtract(end, start)).max()
        assert error < 1e-9 * max(1.0, float(size[i])), (seed, along[i])
        known = found.point_contacts.values[i]  # of more the last ones may be lower than rounding
        assert impacts == known or min(impacts, known) > FEW, (seed, along[i])
        count += 1
    return count


@pytest.mark.slow
def test_orbits_of_random_branches_close_in_closed_form():
    assert sum(checked(seed) for seed in range(4)) > 50


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [pytest.param(time.time_ns() % 2**32, id="clock")])
def test_orbits_of_more_random_branches_close_in_closed_form(seed):
    assert sum(checked(seed + number) for number in range(60)) > 500
