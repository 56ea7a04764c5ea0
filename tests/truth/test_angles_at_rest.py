"""What nearly cancels, such as an angle next to a zero of its sine: the right-hand side is as wrong
there as the angle is rounded, and that is no reason to shorten steps.
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


#: Functions of what nearly cancels, the value at which each is zero, and its slope there.
CANCELLING = (
    (lambda u: u / (1 + u * u), 0.0, 1.0),
    (lambda u: sl.log(u), 1.0, 1.0),
    (lambda u: sl.tanh(u), 0.0, 1.0),
    (lambda u: sl.tan(u), 0.0, 1.0),
    (lambda u: sl.atan(u), 0.0, 1.0),
    (lambda u: sl.sqrt(u) - 1e-4, 1e-8, 5e3),
    (lambda u: u**1.5 - 1e-12, 1e-8, 1.5e-4),
    (lambda u: 1e-8 - 1 / (1e8 * u), 1.0, 1e-8),
    (lambda u: sl.exp(1e6 * u) - 1, 0.0, 1e6),
    (lambda u: 1e-4 * sl.sin(u / 1e-4), 0.0, 1.0),
    (lambda u: sl.piecewise((sl.log(1 + u), u > -0.5), otherwise=-0.7), 0.0, 1.0),
)


@sl.system(states=" ".join(f"x{i} v{i}" for i in range(len(CANCELLING))))
def resting(t, *states):
    """Each u = 0.7 + 1.3 x rests where its function is zero, and swings about it by cos(t)."""
    pulls = (
        -function(1.3 * x + 0.7) / (1.3 * slope)
        for x, (function, _, slope) in zip(states[::2], CANCELLING, strict=True)
    )
    return tuple(rate for pair in zip(states[1::2], pulls, strict=True) for rate in pair)


@pytest.mark.parametrize("beside", [0.0, 1e-15, 1e-13])
def test_what_nearly_cancels_swings_in_a_few_steps(beside):
    rest = np.array([(zero - 0.7) / 1.3 for _, zero, _ in CANCELLING])
    start = np.zeros((1, 2 * len(rest)))
    start[0, ::2] = rest + beside
    outcome = Stroboscope(resting, sl.Taylor(max_steps=100), every=1.0).run(start, 3)
    assert outcome.status[0] == 2
    # a force is wrong by the rounding of x and of its terms, and what a step adds to x is rounded
    lost = 1e-16 * outcome.counters[0, 0]
    offset = start[0, ::2] - rest
    assert outcome.state[0, ::2] - rest == pytest.approx(offset * np.cos(3.0), abs=lost)
    assert outcome.state[0, 1::2] == pytest.approx(-offset * np.sin(3.0), abs=lost)
