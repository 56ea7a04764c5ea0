"""The search for limit cycles: what is deflated, and from where on cycles are known."""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.closed.all_cycles import all_cycles
from saltus.analysis.closed.shooting import close
from saltus.flow.maps import Stroboscope


@sl.system(states="x y")
def circle(t, x, y, *, omega=5.0):
    """r' = r (1 - r^2): the stable circle of radius 1."""
    growth = 1 - x**2 - y**2
    return growth * x - omega * y, growth * y + omega * x


PERIOD = 2 * np.pi / 5


@pytest.fixture(scope="module")
def known():
    map_ = Stroboscope(circle, sl.Taylor(), every=1.2)
    found = all_cycles(map_, np.array([[1.0, 0.2]]), (0.0, 2.0), 1.2)
    (cycle,) = found.motions
    assert cycle.time == pytest.approx(PERIOD, rel=1e-14)
    return found


def around(phase, radius=1.0, turns=1, n=4):
    """The circle as Newton's method has it: from each phase on, float64[k, 2 n + 1]."""
    angle = np.reshape(phase, (-1, 1)) + 2 * np.pi * turns * np.arange(n) / n
    points = radius * np.stack([np.cos(angle), np.sin(angle)], axis=2)
    time = np.full((len(angle), 1), turns * PERIOD)
    return np.concatenate([points.reshape(len(angle), -1), time], axis=1)


@pytest.mark.parametrize("turns", [1, 2])
def test_a_known_cycle_is_a_zero_at_every_phase(known, turns):
    z = around(np.linspace(0, 6, 13), turns=turns)
    np.testing.assert_allclose(known.known(4)(z)[:, 0], z, atol=1e-9)


def test_newtons_method_doesnt_come_back_to_a_deflated_cycle(known):
    """From beside the only cycle there is: it finds that, and with it deflated nothing."""
    z = around(np.linspace(0, 6, 13), radius=1.05)
    guess = known.guess(z[:, :-1].reshape(13, 4, 2), z[:, -1], np.full((13, 2), 2.0))
    assert len(close(guess)[1]) == 13
    assert len(close(guess, known.known(4))[1]) == 0
