"""Angles next to a zero of their sine or cosine: the right-hand side is as wrong there as the angle
is rounded, and that is no reason to shorten steps.
"""

import numpy as np
import pytest

import saltus as sl
from saltus.flow.maps import Stroboscope

#: What the pendulum's angle lacks of pi.
MISSING = 1.2246467991473532e-16


@sl.system(states="a b")
def pendulum(t, a, b):
    """Upright at pi; its rate of growth is 1/s."""
    return b, -sl.sin(a)


@sl.system(states="a b")
def turned(t, a, b):
    """a' = b cos(a) rests at pi/2, where a - pi/2 decays by exp(-b t)."""
    return b * sl.cos(a), 0.0 * b


@pytest.mark.parametrize(
    ("beside", "speed"), [(0.0, 0.0), (1e-14, 0.0), (1e-10, 0.0), (0.0, 1e-10)]
)
def test_an_upright_pendulum_falls_in_a_few_steps(beside, speed):
    start = np.array([[np.pi + beside, speed]])
    outcome = Stroboscope(pendulum, sl.Taylor(max_steps=100), every=1.0).run(start, 3)
    offset = start[0, 0] - np.pi - MISSING
    exact = offset * np.sinh(3.0) + speed * np.cosh(3.0)
    assert outcome.status[0] == 2
    assert outcome.state[0, 1] == pytest.approx(exact, rel=1e-6, abs=1e-14)


def test_the_tangent_of_an_angle_at_rest_next_to_a_zero_of_its_cosine():
    """d a(t) / d a(0) = exp(-b t); d a / d b = t cos(a), which is nothing at pi/2."""
    map_ = Stroboscope(turned, sl.Taylor(max_steps=100), every=1.0)
    end, matrix = map_.tangent(np.array([[np.pi / 2, 1.0]]), 2)
    assert end[0] == pytest.approx([np.pi / 2, 1.0], abs=1e-14)
    assert matrix[0] == pytest.approx(np.array([[np.exp(-2.0), 0.0], [0.0, 1.0]]), abs=1e-13)
