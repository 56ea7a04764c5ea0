"""A plate on a shaker: finite elements written to a file, reduced to the lowest modes, with stops
under two corners and a recorded acceleration of its base.

python examples/plate/plate.py        writes plate.npz and quake.csv
saltus run examples/plate/study.toml
"""

from pathlib import Path

import numpy as np

LENGTH, WIDTH, THICKNESS = 0.6, 0.4, 3e-3  # m
YOUNG, POISSON, DENSITY = 70e9, 0.33, 2700.0  # Pa, 1, kg/m^3
ACROSS, UP = 9, 7  # elements along the length and the width

#: Powers of x and y in the deflection of an element (Adini, Clough and Melosh, 12 terms).
POWERS = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3), (3, 1),
    (1, 3)]  # fmt: skip


def terms(x, y, dx=0, dy=0):
    """The derivatives of the 12 terms at a point."""
    row = []
    for i, j in POWERS:
        factor = np.prod(np.arange(i - dx + 1, i + 1)) * np.prod(np.arange(j - dy + 1, j + 1))
        row.append(0.0 if i < dx or j < dy else factor * x ** (i - dx) * y ** (j - dy))
    return np.array(row)


def element(a, b):
    """Mass and stiffness of a rectangle a x b: deflection w and slopes along x and y at each
    corner.
    """
    corners = [(0, 0), (a, 0), (a, b), (0, b)]
    values = np.array([terms(*at, *d) for at in corners for d in ((0, 0), (1, 0), (0, 1))])
    shape = np.linalg.inv(values)  # terms of unit values
    rigidity = YOUNG * THICKNESS**3 / 12 / (1 - POISSON**2)
    law = rigidity * np.array([[1, POISSON, 0], [POISSON, 1, 0], [0, 0, (1 - POISSON) / 2]])
    nodes, weights = np.polynomial.legendre.leggauss(4)
    mass, stiffness = np.zeros((2, 12, 12))
    for u, first in zip(nodes, weights, strict=True):
        for v, second in zip(nodes, weights, strict=True):
            x, y, share = a * (1 + u) / 2, b * (1 + v) / 2, first * second * a * b / 4
            deflection = terms(x, y) @ shape
            bent = [terms(x, y, 2, 0), terms(x, y, 0, 2), 2 * terms(x, y, 1, 1)]
            curvature = np.array(bent) @ shape
            mass += share * DENSITY * THICKNESS * np.outer(deflection, deflection)
            stiffness += share * curvature.T @ law @ curvature
    return mass, stiffness


def plate(across=ACROSS, up=UP):
    """Mass and stiffness of the plate, clamped along x = 0, and names such as w_9_0: the deflection
    at the tenth node along the length, first along the width.
    """
    nodes = [(i, j) for i in range(across + 1) for j in range(up + 1)]
    first = {node: 3 * number for number, node in enumerate(nodes)}
    whole = np.zeros((2, 3 * len(nodes), 3 * len(nodes)))
    small = np.array(element(LENGTH / across, WIDTH / up))
    for i in range(across):
        for j in range(up):
            corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)]
            place = [first[one] + k for one in corners for k in range(3)]
            whole[np.ix_([0, 1], place, place)] += small
    free = [first[i, j] + k for i, j in nodes if i > 0 for k in range(3)]
    names = [f"{kind}_{i}_{j}" for i, j in nodes if i > 0 for kind in ("w", "slope_x", "slope_y")]
    return *whole[np.ix_([0, 1], free, free)], names


def quake(duration=2.0, step=2e-3, level=6.0):
    """Times and accelerations of a base: noise between 5 and 60 Hz that grows and dies away."""
    random = np.random.default_rng(28)
    times = np.arange(0, duration + step / 2, step)
    frequencies = np.linspace(5, 60, 80)
    phases = random.uniform(0, 2 * np.pi, 80)
    noise = np.cos(2 * np.pi * np.outer(times, frequencies) + phases).sum(axis=1)
    shaped = noise * np.sin(np.pi * times / duration) ** 2
    return times, level * shaped / np.abs(shaped).max()


def write(folder):
    """Write the files that the study names."""
    mass, stiffness, names = plate()
    np.savez(folder / "plate.npz", M=mass, K=stiffness, names=names)
    columns = np.column_stack(quake())
    np.savetxt(folder / "quake.csv", columns, delimiter=",", header="time [s],acceleration [m/s^2]",
        comments="", fmt="%.9g")  # fmt: skip


if __name__ == "__main__":
    write(Path(__file__).parent)
