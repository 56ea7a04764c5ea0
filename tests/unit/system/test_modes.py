"""The mode of a system at a state, and its rates there."""

import numpy as np
import pytest

from saltus.models import delangre
from saltus.system.modes import field, mode_number, sides


def by_hand(t, x, v, f=15.0, force=4.0, j1=0.0, j2=0.4e-3, kc=1.4e4):
    w, wn = 2 * np.pi * f, 10 * np.pi
    contact = np.where(x < -j1, kc * (x + j1), np.where(x > j2, kc * (x - j2), 0.0))
    return v, (
        force * (1 - 18 / w**2) * np.cos(w * t) - contact
    ) / 3 - 2 * 0.03 * wn * v - wn**2 * x - 7e8 / 3 * x**3


def test_the_rig_against_its_equation_on_arrays():
    x, v = np.meshgrid(np.linspace(-5e-3, 5e-3, 41), np.linspace(-1, 1, 21))
    t = np.linspace(0, 1, 21)[:, None]
    exact = np.array(np.broadcast_arrays(*by_hand(t, x, v)))
    assert np.allclose(field(delangre(), t, (x, v)), exact, rtol=1e-13, atol=0)
    assert field(delangre(), 0.0, (x, v), {"lower_gap": 1.0, "upper_gap": 1.0}).shape == (2, 21, 41)


def test_sides_and_modes():
    rig = delangre()
    x = np.array([-1e-3, 0.0, 2e-4, 4e-4, 1e-3])
    lower, upper = sides(rig, 0.0, (x, 0 * x))
    assert lower.tolist() == [False, False, True, True, True]
    assert upper.tolist() == [False, False, False, False, True]
    assert mode_number([lower, upper]).tolist() == [0, 0, 1, 1, 3]


def test_a_given_mode_is_kept():
    rig = delangre()
    (v, inside), (_, outside) = (
        field(rig, 0.0, (1e-3, 0.5), bits=bits) for bits in ([True, False], [True, True])
    )
    assert v == 0.5
    assert inside - outside == pytest.approx(1.4e4 * 0.6e-3 / 3, rel=1e-12)
