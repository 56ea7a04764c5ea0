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
    w, told = float(rng.uniform(5, 30)), [k for k in kinds if k != "rough" and (k != "pair" or n > 1)]
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


def by_exponentials(given, start, t_end, steps=400):
    """The changes of a structure with friction alone, as (time, kind, friction), and its state at
    the end. Between them the states and the drives are linear with constant coefficients: a step is
    a matrix exponential, a change is found by halving.
    """
    n, w = given.degrees, given.w
    size = 2 * n + 5
    free = np.zeros((size, size))
    free[:n, n:2 * n] = np.eye(n)
    free[n:2 * n, :n], free[n:2 * n, n:2 * n] = -given.stiffness, -given.damping
    for m in (0, 1):
        c = 2 * n + 1 + 2 * m
        free[n:2 * n, c] = given.force[m] * np.cos(given.lag[m])
        free[n:2 * n, c + 1] = -given.force[m] * np.sin(given.lag[m])
        free[c, c + 1], free[c + 1, c] = -(m + 1) * w, (m + 1) * w
    slides, normals, slip, stick = [], [], [], []
    for kind, i, limit, more, speed in given.frictions:
        j, (mean, sway, phase) = given.pair(kind, i), given.belt(kind, more, speed)
        normal, row = np.zeros(n), np.zeros(size)
        normal[i] += 1.0
        if j != i:
            normal[j] -= 1.0
        row[n:2 * n], row[2 * n] = normal, -mean
        row[2 * n + 1], row[2 * n + 2] = -sway * math.cos(phase), sway * math.sin(phase)
        slides.append(row)
        normals.append(normal)
        slip.append(10 * limit)
        stick.append((12 if kind == "static" else 10) * limit)
    slides, normals, count = np.array(slides), np.array(normals), len(slides)

    def equations(state):
        """A and the rows of the forces of all frictions in a state: 1, -1, or 0 where it sticks."""
        forces, held = np.zeros((count, size)), [k for k in range(count) if state[k] == 0]
        for k in range(count):
            forces[k, 2 * n] = state[k] * slip[k]
        matrix = free.copy()
        matrix[n:2 * n] -= normals.T @ forces
        if held:
            forces[held] = np.linalg.solve(normals[held] @ normals[held].T, slides[held] @ matrix)
            matrix[n:2 * n] -= normals[held].T @ forces[held]
        return matrix, forces

    def left(z, state, forces):
        """What is left of each friction until it changes: of its sliding, or of its limit."""
        return np.array([state[k] * (slides[k] @ z) if state[k] else stick[k] - abs(forces[k] @ z)
            for k in range(count)])  # fmt: skip

    def settled(z, state, asked, found, t):
        """The state behind a change of some frictions; every friction that sticks holds there."""
        for k in asked:
            before = state[k]
            if before == 0:
                state[k] = int(np.sign(equations(state)[1][k] @ z))
                found.append((t, "release", k))
                continue
            state[k] = 0
            if abs(equations(state)[1][k] @ z) < stick[k]:
                z[n:2 * n] -= normals[k] * (slides[k] @ z) / (normals[k] @ normals[k])
                found.append((t, "hold", k))
                forces = equations(state)[1]
                over = [j for j in range(count) if not state[j] and abs(forces[j] @ z) > stick[j]]
                settled(z, state, over, found, t)
            else:
                state[k] = -before
                found.append((t, "crossing", k))

    z = np.concatenate([start, [1, 1, 0, 1, 0]])
    state = [1 if slides[k] @ z > 0 else -1 for k in range(count)]
    for k in range(count):
        if slides[k] @ z == 0:
            settled(z, state, [k], [], 0.0)
    t, found, known, h, young = 0.0, [], {}, 2 * math.pi / w / steps, []
    while t < t_end - 1e-12:
        key = tuple(state)
        if key not in known:
            matrix, forces = equations(state)
            known[key] = [expm(matrix * h / 2**k) for k in range(40)], forces
        powers, forces = known[key]

        def stays(z, but=young, state=state, forces=forces):
            ended = left(z, state, forces) <= 0
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
        z, t, young = powers[39] @ z, t + h / 2**39, []
        ended = np.flatnonzero(left(z, state, forces) <= 0).tolist()
        before = len(found)
        settled(z, state, ended, found, t)
        young = [k for _, kind, k in found[before:] if kind == "release"]
    return found, z[:2 * n]
