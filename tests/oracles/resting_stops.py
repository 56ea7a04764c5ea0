"""Motions of driven bodies between stops without rebound, to 40 digits: series between contacts,
blows one by one, whichever stop is first until none closes.

Unit masses: x'' = f cos(w t + lag) - K x - c x' - A' p, with pressures p >= 0 of the stops A x = b.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

from mpmath import cos, factorial, findroot, lu_solve, matrix, mpf, pi
from numpy.polynomial.polynomial import polyval

ORDER, STEP = 20, mpf(1) / 128
#: Gap of a stop at which a body stands [m], and closing velocity that has ended [m/s].
STANDS, STOPPED = mpf(10) ** -25, mpf(10) ** -38


@dataclass
class Bodies:
    """K float[n, n], c, w, forces and phases float[n], stops A float[s, n] and b float[s]."""

    stiffness: list
    damping: float
    frequency: float
    force: list
    lag: list
    stops: list
    gaps: list

    def after(self, x, v, end):
        """Positions and velocities float[2 n] at a time."""
        t, rest = mpf(0), ()
        while t < end:
            terms = self.series(t, x, v, rest)
            h, met = min(STEP, end - t), None
            for stop in range(len(self.stops)):
                left = [self.left(stop, rest, k, terms) for k in range(ORDER)]
                if value(left, h) < 0:
                    met, inside = stop, lambda d, g=left: value(g, d)
                    h = findroot(inside, (0, h), solver="anderson")
            x, v = ([value(one, h) for one in terms[part]] for part in (0, 1))
            t += h
            if met is not None:
                rest = tuple(set(rest) - {met}) if met in rest else self.blow(t, x, v)
        return [*x, *v]

    def series(self, t, x, v, rest):
        """Coefficients of positions, velocities, forces and pressures."""
        bodies = range(len(x))
        x, v, f, p = [[a] for a in x], [[a] for a in v], [[] for _ in x], []
        for k in range(ORDER):
            for i in bodies:
                drive = cos(self.frequency * t + self.lag[i] + k * pi / 2) / factorial(k)
                f[i].append(
                    self.force[i] * self.frequency**k * drive
                    - sum(self.stiffness[i][j] * x[j][k] for j in bodies)
                    - self.damping * v[i][k]
                )
            p.append(self.pressures([one[k] for one in f], rest))
            for i in bodies:
                x[i].append(v[i][k] / (k + 1))
                pressed = sum(p[k][s] * self.stops[s][i] for s in rest)
                v[i].append((f[i][k] - pressed) / (k + 1))
        return x, v, f, p

    def pressures(self, force, rest):
        """Pressures of the stops that rest."""
        if not rest:
            return {}
        gram = matrix([[dot(self.stops[a], self.stops[b]) for b in rest] for a in rest])
        found = lu_solve(gram, matrix([dot(self.stops[a], force) for a in rest]))
        return dict(zip(rest, found, strict=True))

    def left(self, stop, rest, k, terms):
        """Coefficient k of the pressure of a stop that rests, of the gap of another."""
        if stop in rest:
            return terms[3][k][stop]
        return (self.gaps[stop] if k == 0 else 0) - dot(self.stops[stop], [x[k] for x in terms[0]])

    def blow(self, t, x, v):
        """Stop the velocities that close, in place; the stops that rest then."""
        near = [s for s, a in enumerate(self.stops) if abs(self.gaps[s] - dot(a, x)) < STANDS]
        while closing := [s for s in near if dot(self.stops[s], v) > STOPPED]:
            a = self.stops[closing[0]]
            share = dot(a, v) / dot(a, a)
            v[:] = [one - share * by for one, by in zip(v, a, strict=True)]
        near = [s for s in near if dot(self.stops[s], v) > -STANDS]
        force = [one[0] for one in self.series(t, x, v, ())[2]]
        for rest in itertools.chain(*(itertools.combinations(near, n) for n in range(3))):
            pressed = self.pressures(force, rest)
            net = [
                f - sum(pressed[s] * self.stops[s][i] for s in rest) for i, f in enumerate(force)
            ]
            others = [dot(self.stops[s], net) for s in near if s not in rest]
            if min([1, *pressed.values()]) > 0 >= max([-1, *others]):
                return rest
        raise ValueError("no contact state")


def dot(a, b):
    return sum(one * other for one, other in zip(a, b, strict=True))


def value(terms, d):
    return polyval(d, terms)
