"""Random structures with dry friction, Jenkins elements and soft stops; and their motions from
contact state to contact state by matrix exponentials, as far as they have friction alone.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import expm

import saltus as sl


@dataclass
class Rubbing:
    """Unit masses on springs, driven by two harmonics: K, C, forces and their phases, the base
    rate; frictions as (kind, body, limit, more, speed); stops as (body, gap, spring, damper); a
    record that drives the first body; whether the first stop is rough.
    """

    stiffness: np.ndarray
    damping: np.ndarray
    force: np.ndarray
    lag: np.ndarray
    w: float
    frictions: list
    stops: list = field(default_factory=list)
    table: object = None
    rough: bool = False

    @property
    def degrees(self):
        return len(self.stiffness)

    def pair(self, kind, i):
        """The body against which a friction acts; its own number for the ground or a belt."""
        return (i + 1) % self.degrees if kind == "pair" else i

    def belt(self, kind, more, speed):
        """Speed of a belt: its mean, its amplitude, the phase of that."""
        return {"belt": (0.2 * speed, 0, 0), "static": (0.1 * speed, 0, 0),
            "shaken": (0, 0.2, more)}.get(kind, (0, 0, 0))  # fmt: skip

    def equation(self, t, w, *z):
        n = self.degrees
        x, v = z[:n], z[n:]
        rates = [
            sum(-float(self.stiffness[i, k]) * x[k] - float(self.damping[i, k]) * v[k]
                for k in range(n))
            + sum(float(self.force[m, i]) * sl.cos((m + 1) * w * t + float(self.lag[m, i]))
                for m in (0, 1))
            for i in range(n)
        ]  # fmt: skip
        if self.table is not None:
            rates[0] = rates[0] + self.table(t)
        for kind, i, limit, more, speed in self.frictions:
            if kind == "jenkins":
                rates[i] = rates[i] - sl.slider(x[i], stiffness=300 * more, limit=10 * limit)
                continue
            j, (mean, sway, phase) = self.pair(kind, i), self.belt(kind, more, speed)
            against = v[j] if j != i else mean + (sway * sl.cos(w * t + phase) if sway else 0)
            level = {"slip": 10 * limit} | ({"stick": 12 * limit} if kind == "static" else {})
            rubbed = sl.friction(v[i] - against, **level)
            rates[i] = rates[i] - rubbed
            if j != i:
                rates[j] = rates[j] + rubbed
        for number, (i, gap, spring, damper) in enumerate(self.stops):
            normal = spring * sl.max(x[i] - gap, 0.0)
            rates[i] = rates[i] - normal - sl.piecewise((damper * v[i], x[i] > gap), otherwise=0.0)
            j = (i + 1) % n
            if self.rough and number == 0 and j not in [one[1] for one in self.frictions]:
                rates[j] = rates[j] - sl.friction(v[j], slip=0.4 * normal)
        return (*v, *rates)

    def system(self):
        names = [f"{letter}{i + 1}" for letter in "xv" for i in range(self.degrees)]
        space, given = {"equation": self.equation}, ", ".join(names)
        exec(f"def f(t, {given}, *, w={self.w}):\n return equation(t, w, {given})", space)
        forced = None if self.table is not None else "w"
        states = " ".join(names)
        return sl.system(states=states, forced_at=forced, units={"w": "rad/s"})(space["f"])


def random_rubbing(rng, degrees, frictions, stops=0, *, kinds=("ground", "belt"), recorded=False):
    """A random structure with frictions of some kinds: against the ground, a belt or a shaken one,
    with a static limit, of a Jenkins element, of a pair of bodies; ``rough``: of a stop.
    """
    root, n = rng.normal(size=(degrees, degrees)), degrees
    stiffness = 200.0 * (root @ root.T / n + np.eye(n))
    damping = rng.choice([0.0, 0.3, 2.0]) * np.eye(n) + rng.choice([0, 0.002]) * stiffness
    force, lag = rng.uniform(5, 30, (2, n)), rng.uniform(0, 6, (2, n))
    w = float(rng.uniform(5, 30))
    told = [kind for kind in kinds if kind != "rough" and (kind != "pair" or n > 1)]
    chosen = [(str(rng.choice(told)), int(i), *rng.uniform(0.2, 1.5, 3).tolist())
        for i in rng.permutation(n)[:frictions]]  # fmt: skip
    walls = [(int(rng.integers(n)), *rng.uniform([0.003, 200, 0], [0.05, 3000, 20]).tolist())
        for _ in range(stops)]  # fmt: skip
    table = None
    if recorded:
        times = np.arange(0, 120 * math.pi / w, 2 * math.pi / w / 7.3)
        table = sl.recorded(times, rng.normal(0, 15, len(times)), "N")
    rough = "rough" in kinds and n > 1
    return Rubbing(stiffness, damping, force, lag, w, chosen, walls, table, rough)


class _Exponentials:
    """The equations of a structure with friction alone in its contact states: 1 or -1 for each
    friction that slides, 0 where it sticks.
    """

    def __init__(self, given):
        n = given.degrees
        self.n, self.count, self.size = n, len(given.frictions), 2 * n + 5
        self.free = np.zeros((self.size, self.size))
        self.free[:n, n : 2 * n] = np.eye(n)
        self.free[n : 2 * n, : 2 * n] = np.hstack([-given.stiffness, -given.damping])
        for m in (0, 1):
            c, rate = 2 * n + 1 + 2 * m, (m + 1) * given.w
            self.free[n : 2 * n, c] = given.force[m] * np.cos(given.lag[m])
            self.free[n : 2 * n, c + 1] = -given.force[m] * np.sin(given.lag[m])
            self.free[c, c + 1], self.free[c + 1, c] = -rate, rate
        self.slides, self.normals = np.zeros((self.count, self.size)), np.zeros((self.count, n))
        for k, (kind, i, _, more, speed) in enumerate(given.frictions):
            j, (mean, sway, phase) = given.pair(kind, i), given.belt(kind, more, speed)
            self.normals[k, i] = 1.0
            if j != i:
                self.normals[k, j] = -1.0
            self.slides[k, n : 2 * n] = self.normals[k]
            belt = mean, sway * math.cos(phase), -sway * math.sin(phase)
            self.slides[k, 2 * n : 2 * n + 3] = -np.array(belt)
        self.slip = np.array([10 * limit for _, _, limit, *_ in given.frictions])
        static = [1.2 if kind == "static" else 1.0 for kind, *_ in given.frictions]
        self.stick = self.slip * static

    def equations(self, state):
        """A, and the rows of the forces of all frictions."""
        forces, held = np.zeros((self.count, self.size)), [k for k, s in enumerate(state) if not s]
        forces[:, 2 * self.n] = np.array(state) * self.slip
        matrix, rates = self.free.copy(), slice(self.n, 2 * self.n)
        matrix[rates] -= self.normals.T @ forces
        if held:
            own = self.normals[held]
            forces[held] = np.linalg.solve(own @ own.T, self.slides[held] @ matrix)
            matrix[rates] -= own.T @ forces[held]
        return matrix, forces

    def left(self, z, state, forces):
        """What is left of each friction until it changes: of its sliding, or of its limit."""
        way, rest = np.array(state) * (self.slides @ z), self.stick - np.abs(forces @ z)
        return np.where(np.array(state) == 0, rest, way)

    def settle(self, z, state, asked, found, t):
        """Change some frictions; each that sticks holds afterwards."""
        for k in asked:
            before, kind = state[k], "crossing"
            state[k] = 0
            needed = self.equations(state)[1][k] @ z
            if before == 0:
                state[k], kind = int(np.sign(needed)), "release"
            elif abs(needed) < self.stick[k]:
                normal = self.normals[k]
                z[self.n : 2 * self.n] -= normal * (self.slides[k] @ z) / (normal @ normal)
                kind = "hold"
            else:
                state[k] = -before
            found.append((t, kind, k))
            forces = self.equations(state)[1]
            over = [j for j in range(self.count)
                if not state[j] and abs(forces[j] @ z) > self.stick[j]]  # fmt: skip
            if kind == "hold":
                self.settle(z, state, over, found, t)


def by_exponentials(given, start, t_end, steps=400):
    """The changes of a structure with friction alone, as (time, kind, friction), and its state at
    the end. Between them the states and the drives are linear with constant coefficients: a step is
    a matrix exponential, a change is found by halving.
    """
    one, z = _Exponentials(given), np.concatenate([start, [1, 1, 0, 1, 0]])
    state = [1 if row @ z > 0 else -1 for row in one.slides]
    t, found, known, h, young = 0.0, [], {}, 2 * math.pi / given.w / steps, []
    while t < t_end - 1e-12:
        key = tuple(state)
        if key not in known:
            matrix, forces = one.equations(state)
            known[key] = [expm(matrix * h / 2**k) for k in range(40)], forces
        powers, forces = known[key]

        def stays(z, but=young, state=state, forces=forces):
            ended = one.left(z, state, forces) <= 0
            ended[but] = False  # a velocity that has just begun to grow
            return not ended.any()

        k = 5 if young else 0
        while t + h / 2**k > t_end:
            k += 1
        if stays(ahead := powers[k] @ z):
            z, t, young = ahead, t + h / 2**k, []
            continue
        for finer in range(k + 1, 40):
            if stays(ahead := powers[finer] @ z):
                z, t = ahead, t + h / 2**finer
        z, t, before = powers[39] @ z, t + h / 2**39, len(found)
        ended = np.flatnonzero(one.left(z, state, forces) <= 0).tolist()
        one.settle(z, state, ended, found, t)
        young = [k for _, kind, k in found[before:] if kind == "release"]
    return found, z[: 2 * given.degrees]
