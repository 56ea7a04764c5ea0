"""Branches of random structures with many modes: each orbit closes, and has its multipliers, by
matrix exponentials that share nothing with the modal flow.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import saltus as sl

#: Steps of a period between which a contact is looked for.
STEPS = 4000


def random_chain(rng, masses):
    """A chain of random masses and springs, driven at its end, with stops at two of them; and what
    it is made of.
    """
    springs = rng.uniform(200, 600, masses + 1)
    stiffness = np.diag(springs[:-1] + springs[1:])
    stiffness -= np.diag(springs[1:-1], 1) + np.diag(springs[1:-1], -1)
    mass = np.diag(rng.uniform(0.5, 2.0, masses))
    damping = 0.15 * mass + 2e-3 * stiffness
    first = np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real.min()) / (2 * np.pi)
    places = rng.choice(masses, 2, replace=False)
    stops = [
        (place, float(rng.uniform(200, 2000)), float(rng.uniform(0.01, 0.03))) for place in places
    ]
    contacts = [
        sl.Contact(f"x{place + 1}", stiff, gap, side="both", name=f"stop_{place}")
        for place, stiff, gap in stops
    ]
    force = sl.Force(f"x{masses}", float(rng.uniform(2, 8)))
    made = sl.structure(
        mass, stiffness, damping, contacts=contacts, forces=[force], frequency=first
    )
    return made, first, (mass, stiffness, damping, stops)


class Exponentials:
    """The motion of such a chain: exponentials of the matrix of (x, v, 1, cos, sin)."""

    def __init__(self, parts, force, frequency):
        self.mass, self.stiffness, self.damping, self.stops = parts
        self.n, self.force, self.rate = len(self.mass), force, 2 * np.pi * frequency
        self.step = 1.0 / frequency / STEPS
        self.known = {}

    def generator(self, sides):
        """Matrix of a contact state: -1, 0 or 1 of each stop."""
        n, stiffness, push = self.n, self.stiffness.copy(), np.zeros(self.n)
        for (place, stiff, gap), side in zip(self.stops, sides, strict=True):
            stiffness[place, place] += abs(side) * stiff
            push[place] += side * stiff * gap
        a = np.zeros((2 * n + 3, 2 * n + 3))
        inverse = np.linalg.inv(self.mass)
        a[:n, n : 2 * n] = np.eye(n)
        a[n : 2 * n, :n], a[n : 2 * n, n : 2 * n] = -inverse @ stiffness, -inverse @ self.damping
        a[n : 2 * n, 2 * n] = inverse @ push
        a[n : 2 * n, 2 * n + 1] = inverse[:, -1] * self.force
        a[2 * n + 1, 2 * n + 2], a[2 * n + 2, 2 * n + 1] = -self.rate, self.rate
        return a

    def sides(self, z):
        return tuple(int(z[place] > gap) - int(z[place] < -gap) for place, _, gap in self.stops)

    def period(self, start, count):
        """State after periods, and the derivative with respect to the start."""
        n, z = self.n, np.concatenate([start, [1.0, 1.0, 0.0]])
        whole = np.eye(len(z))
        sides, left = self.sides(z), count * STEPS
        while left:
            if sides not in self.known:
                a = self.generator(sides)
                self.known[sides] = a, expm(a * self.step)
            a, over = self.known[sides]
            new = over @ z
            behind = self.sides(new)
            if behind == sides:
                z, whole, left = new, over @ whole, left - 1
                continue
            z, whole, sides = self.through(z, whole, sides, self.step)
            left -= 1
        return z[: 2 * n], whole[: 2 * n, : 2 * n]

    def crossing(self, a, z, place, level, rest):
        """Time at which a mass is at a level."""
        return brentq(
            lambda time: (expm(a * time) @ z)[place] - level, 0, rest, xtol=1e-18, rtol=1e-15
        )

    def through(self, z, whole, sides, rest):
        """A step with contacts in it, one after the other."""
        while rest > 0:
            a = self.generator(sides)
            end = expm(a * rest) @ z
            found = []
            for k, (place, _, gap) in enumerate(self.stops):
                for level in (gap, -gap):
                    if sides[k] not in (0, np.sign(level)):
                        continue
                    way = np.sign(level) * (1 if sides[k] else -1)  # positive: no crossing yet
                    here, there = (way * (one[place] - level) for one in (z, end))
                    if there < 0 and here > -1e-15:
                        at = self.crossing(a, z, place, level, rest) if here > 0 else 0.0
                        found.append((at, k, 0 if sides[k] else int(np.sign(level))))
            if not found:
                return end, expm(a * rest) @ whole, sides
            at, k, side = min(found)
            over = expm(a * at)
            z, whole, rest = over @ z, over @ whole, rest - at
            sides = tuple(side if i == k else one for i, one in enumerate(sides))
        return z, whole, sides


@pytest.mark.parametrize("masses", [7, 12])
@pytest.mark.slow
def test_orbits_of_branches_close_by_matrix_exponentials(masses):
    rng = np.random.default_rng(100 + masses)
    made, first, parts = random_chain(rng, masses)
    band = {"frequency": (0.9 * first, 1.2 * first)}
    ds = sl.branches(made, band, np.zeros(2 * masses), at=2, switch=(), points=40, progress=False)
    size = 2 * masses
    orbits = np.stack([ds[f"point_{name}"].values for name in made.states], axis=-1)
    multipliers = ds.point_multiplier_real.values + 1j * ds.point_multiplier_imag.values
    touching = np.flatnonzero(ds.point_contacts.values > 0)
    chosen = np.concatenate(
        [rng.choice(touching, min(6, len(touching)), replace=False),
         rng.choice(len(orbits), 2, replace=False)]
    )  # fmt: skip
    assert len(touching) > 5
    for i in chosen:
        n = int(np.isfinite(orbits[i]).all(axis=1).sum())
        flow = Exponentials(parts, made.values["force"], float(ds.point_frequency[i]))
        end, monodromy = flow.period(orbits[i, 0], n)
        assert np.abs(end - orbits[i, 0])[: size // 2].max() < 1e-10
        found = np.linalg.eigvals(monodromy)
        for mine in multipliers[i]:
            assert np.abs(found - mine).min() < 1e-8 * max(1.0, np.abs(found).max())
