"""Systems whose motions have mirror images."""

from __future__ import annotations

import pytest

import saltus as sl
from saltus.system.symmetry import is_symmetric


@sl.system(states="x v", forced_at="omega", units={"omega": "rad/s"})
def walls(t, x, v, *, low=1.0, high=1.0, slow=0.8, fast=0.8, bias=0.0, force=1.0, omega=1.0):
    push = force * sl.cos(omega * t) + bias - 0.1 * v
    lower = sl.impact(x > -low, -v, restitution=slow)
    return v, push, sl.impact(x < high, v, restitution=fast), lower


@sl.system(states="x v", forced_at="omega", units={"omega": "rad/s"})
def both(t, x, v, *, even=0.0, odd=1.0, omega=1.0):
    """A force that is as strong in both halves of a period."""
    return v, odd * sl.cos(omega * t) + even * sl.cos(2 * omega * t) - x**3 - 0.1 * v


@pytest.mark.parametrize(
    ("system", "varied", "expected"),
    [
        (walls, {"force": (1, 2)}, True),
        (walls, {"omega": (0.5, 2)}, True),
        (walls, {"low": (0.5, 2)}, False),
        (walls, {"slow": (0.5, 1)}, False),
        (walls, {"bias": (0, 1)}, False),
        (walls.with_values(fast=0.81), {"force": (1, 2)}, False),
        (walls.with_values(high=1.001), {"force": (1, 2)}, False),
        (both, {"odd": (1, 2)}, True),
        (both.with_values(even=1e-3), {"odd": (1, 2)}, False),
        (sl.models.soft_stop(), {"frequency": (1, 2)}, True),
        (sl.models.delangre("a"), {"frequency": (4, 30)}, True),
        (sl.models.delangre("a"), {"upper_gap": (1e-4, 1e-3)}, False),
        (sl.models.delangre("b"), {"frequency": (4, 30)}, False),
    ],
)
def test_a_system_is_its_own_mirror_image(system, varied, expected):
    assert is_symmetric(system, varied) is expected
