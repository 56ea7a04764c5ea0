"""A cantilever beam whose tip strikes a stop: finite elements, reduced to the lowest modes.

saltus run examples/beam/study.toml --system examples/beam/beam.py:beam
"""

import numpy as np

import saltus as sl

ELEMENTS, MODES = 20, 3
LENGTH, WIDTH, THICKNESS = 0.4, 20e-3, 2e-3  # m
YOUNG, DENSITY = 210e9, 7850.0  # Pa, kg/m^3


def matrices():
    """Mass and stiffness of Euler's and Bernoulli's beam: deflection and slope at each node."""
    h, area, inertia = LENGTH / ELEMENTS, WIDTH * THICKNESS, WIDTH * THICKNESS**3 / 12
    stiffness = (YOUNG * inertia / h**3) * np.array([
        [12, 6 * h, -12, 6 * h],
        [6 * h, 4 * h**2, -6 * h, 2 * h**2],
        [-12, -6 * h, 12, -6 * h],
        [6 * h, 2 * h**2, -6 * h, 4 * h**2],
    ])  # fmt: skip
    mass = (DENSITY * area * h / 420) * np.array([
        [156, 22 * h, 54, -13 * h],
        [22 * h, 4 * h**2, 13 * h, -3 * h**2],
        [54, 13 * h, 156, -22 * h],
        [-13 * h, -3 * h**2, -22 * h, 4 * h**2],
    ])  # fmt: skip
    size = 2 * ELEMENTS + 2
    whole = np.zeros((2, size, size))
    for first in range(0, 2 * ELEMENTS, 2):
        place = slice(first, first + 4)
        whole[:, place, place] += mass, stiffness
    return whole[:, 2:, 2:]  # the first node is clamped


NAMES = [f"{kind}{node}" for node in range(1, ELEMENTS + 1) for kind in ("x", "slope")]
TIP, MIDDLE = f"x{ELEMENTS}", f"x{ELEMENTS // 2}"

beam = sl.structure(
    *matrices(), damping_ratio=0.03, modes=MODES, names=NAMES, name="beam", frequency="11 Hz",
    contacts=[sl.Contact(TIP, stiffness="20 kN/m", gap="1 mm")],
    forces=[sl.Force(MIDDLE, "0.5 N")],
)  # fmt: skip
