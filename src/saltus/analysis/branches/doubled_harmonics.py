"""Branches of motions of a few harmonics that leave others for twice the period.

They leave where the derivative of the equations over two periods by the odd harmonics, which a
motion of one period leaves empty, is singular. That is beside where the exact orbits double
theirs, or nowhere if the harmonics are too few.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from saltus.analysis.branches.arclength import Arc, correct
from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.closed_harmonics import ClosedHarmonics
from saltus.analysis.branches.special_points import zeros
from saltus.analysis.branches.switching import Seed
from saltus.analysis.harmonics import series as fourier


def doubled(branch: Branch, number: int, orbits: ClosedHarmonics) -> Iterator[Seed]:
    """Seeds of the branches of twice the period that leave one along which exact orbits double
    theirs.

    Parameters
    ----------
    branch : Branch
        Of truncated motions, with its events.
    number : int
        Its own.
    orbits : ClosedHarmonics
        The equations over twice its period, with twice its harmonics.
    """
    double = [i for i, event in enumerate(branch.events) if event.kind == "period_doubling"]
    single = branch.orbits
    if not double or not isinstance(single, ClosedHarmonics):
        return
    size = single.size
    ranges = np.repeat(branch.scale[: size : single.series], orbits.series)
    orbits.scale, odd = np.append(ranges, branch.scale[size:])[None], orbits.odd

    def over_two(z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        motions = fourier.doubled(single.signals(z)).reshape(len(z), -1)
        whole = np.append(motions, z[:, size:], axis=1)
        derivative = orbits.evaluate(whole, np.zeros(len(z), np.int64))[1]
        return whole, derivative[:, odd[:-1]][:, :, odd]

    def test(z: np.ndarray) -> np.ndarray:
        sign, logarithm = np.linalg.slogdet(over_two(z)[1])
        return np.asarray(sign * np.exp(logarithm / odd.sum()))

    values = test(branch.z)
    after = np.flatnonzero(values[1:] * values[:-1] < 0)
    begin, tangent = branch.z[after], branch.tangent[after]
    length = np.einsum("ei,ei->e", (branch.z[after + 1] - begin) / branch.scale, tangent)
    near = single.near(begin, np.full(len(after), branch.row))
    found: dict[int, np.ndarray] = {}

    def at(step: np.ndarray, which: np.ndarray) -> np.ndarray:
        guess = begin[which] + step[:, None] * tangent[which] * branch.scale
        point = correct(near, guess, tangent[which], which)
        found.update(zip(which.tolist(), point.z, strict=True))
        return np.where(point.found, test(point.z), np.nan)

    places = zeros(at, length, np.stack([values[after], values[after + 1]], axis=1))
    for i in np.flatnonzero(np.isfinite(places)).tolist():
        whole, derivative = over_two(found[i][None])
        way = np.zeros(orbits.width)
        way[odd] = np.linalg.svd(derivative[0])[2][-1]
        nearest = min(double, key=lambda one: abs(branch.events[one].after - after[i]))
        yield Seed(whole[:, :-1], whole[0, -1:], ranges, way, (number, nearest))


def halved(orbits: ClosedHarmonics, curve: Arc) -> str:
    """``period_doubling`` if a motion of 2m periods has just passed one of m periods."""
    if orbits.periods % 2 or len(curve.z) < 2:
        return ""
    before, here = (one[orbits.odd] / orbits.scale[0, orbits.odd] for one in curve.z[-2:])
    return "period_doubling" if before @ here < 0.0 else ""
