"""Periodic motions with impacts in closed form: a point of each for the stroboscope at t = 0."""

from __future__ import annotations

import math

import numpy as np


def flow(stiffness: float, damping: float, t: float) -> np.ndarray:
    """Matrix of x'' + damping x' + stiffness x = 0 over a time."""
    w, a = math.sqrt(stiffness - damping**2 / 4), damping / 2
    c, s = math.exp(-a * t) * math.cos(w * t), math.exp(-a * t) * math.sin(w * t) / w
    return np.array([[c + a * s, s], [-stiffness * s, c - a * s]])


def oscillator(
    *, stiffness=1.0, damping=0.0, force=1.0, gap=0.0, restitution=0.8, frequency=1.0, n=1
) -> list[tuple[float, np.ndarray]]:
    """Of x'' + c x' + k x = A cos(wt) with a stop at x = d: the orbits with one impact in n
    periods, each with its velocity before the impact, the slowest first.

    Free motion q about the forced response p has to return after n periods: that leaves the
    velocity v as the root of a quadratic equation, |p|^2 = (A/|Z|)^2.
    """
    w, one = frequency, np.eye(2)
    whole = flow(stiffness, damping, 2 * math.pi * n / w)
    g = np.linalg.solve(one - whole, whole @ [0.0, restitution] + [0.0, 1.0])
    response = force / (stiffness - w**2 + 1j * damping * w)
    # (d + v g0)^2 + (v g1 / w)^2 = |p|^2, with p = d - q and q = -v g at the impact
    roots = np.roots([g[0] ** 2 + (g[1] / w) ** 2, 2 * gap * g[0], gap**2 - abs(response) ** 2])
    found = []
    for v in sorted(root.real for root in roots if abs(root.imag) < 1e-6 and root.real > 0):
        p, rate = gap + v * g[0], v * g[1]
        phase = np.angle((p - 1j * rate / w) / response) % (2 * math.pi)
        later = flow(stiffness, damping, (2 * math.pi - phase) / w)
        free = later @ [gap - p, -restitution * v - rate]
        found.append((v, free + np.array([response.real, (1j * w * response).real])))
    return found


def ball_on_table(amplitude: float, restitution: float, n: int = 1) -> list[np.ndarray]:
    """Of a ball on a table G sin t, gravity 1: the two orbits with one impact in n periods."""
    cosine = n * math.pi * (1 - restitution) / (1 + restitution) / amplitude
    found = []
    for phase in (math.acos(cosine), 2 * math.pi - math.acos(cosine)):
        later = 2 * math.pi - phase
        height = amplitude * math.sin(phase) + n * math.pi * later - later**2 / 2
        found.append(np.array([height, n * math.pi - later]))
    return found


def ball_in_box(length: float, restitution: float) -> list[tuple[float, np.ndarray]]:
    """Of a ball between walls that move as sin t: the symmetric orbits with an impact on either
    wall in each period, with their speeds, the slowest first.
    """
    ratio = (1 - restitution) / (1 + restitution)
    roots = np.roots([math.pi**2 / 4 + ratio**2, -math.pi * length / 2, length**2 / 4 - 1])
    found = []
    for v in sorted(root.real for root in roots if abs(root.imag) < 1e-6 and root.real > 0):
        phase = math.atan2((math.pi * v - length) / 2, -ratio * v) % (2 * math.pi)
        wall, later = length / 2 + math.sin(phase), 2 * math.pi - phase
        side = -1 if later < math.pi else 1  # towards the left wall, or back from it
        found.append((v, side * np.array([v * (later % math.pi) - wall, v])))
    return found
