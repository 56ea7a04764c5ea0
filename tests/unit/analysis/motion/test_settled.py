"""`settled` against sequences whose period is known by construction."""

from __future__ import annotations

import numpy as np
import pytest

import made_results
from saltus.analysis.motion.settled import settled
from saltus.errors import ParameterError
from saltus.results import Guards

NONE = Guards((), (), np.empty(0))


def stroboscope(*strobes: np.ndarray, status: str = "ok"):
    """A stroboscope of one state with these rows."""
    rows = np.stack(strobes)
    return made_results.stroboscope(
        states=("x",),
        units={"x": "m"},
        period=np.arange(rows.shape[1]),
        values={"x": rows},
        status=[status] * len(rows),
        guards=NONE,
    )


def cycle(n: int, length: int = 97, seed: int = 1) -> np.ndarray:
    """A sequence of smallest period n."""
    return np.resize(np.random.default_rng(seed).normal(size=n), length) * 1e-3


@pytest.mark.nojit
@pytest.mark.parametrize("n", [1, 2, 3, 12, 24, 48])
def test_period_by_construction(n):
    assert settled(stroboscope(cycle(n)))["response_period"].item() == n


def test_longer_than_half_of_what_was_kept():
    found = settled(stroboscope(cycle(49)))
    assert found["response_period"].item() == 0
    assert found.attrs["longest_period"] == 48
    assert found["mismatch"].item() > 1e-3


def test_a_doubled_orbit_is_not_its_half():
    """Every second repeat of 12T off by 1e-4 of the range: 24T, as the rig does at 15 Hz from x =
    0.4 mm.
    """
    doubled = cycle(12)
    doubled[np.arange(97) % 24 == 5] += 1e-4 * np.abs(doubled).max()
    assert settled(stroboscope(doubled))["response_period"].item() == 24


def test_a_transient_is_not_settled():
    """A residue that loses 1 % a period, at 1e-3 of the motion."""
    slow = cycle(3) * (1 + 1e-3 * 0.99 ** np.arange(97))
    assert settled(stroboscope(slow))["response_period"].item() == 0


def test_a_turning_transient_is_not_taken_for_a_multiple():
    """A residue of 5T whose multiplier turns by a third each 5 periods repeats better after 15:
    that isn't a 15T response.
    """
    k = np.arange(97)
    turning = cycle(5) * (1 + 1e-6 * 0.999**k * np.cos(2 * np.pi * k / 15))
    assert settled(stroboscope(turning))["response_period"].item() == 0


def test_a_transient_in_the_part_left_out_does_not_matter():
    early = cycle(3)
    early[:40] += 1.0
    assert settled(stroboscope(early), last=50)["response_period"].item() == 3


def test_rest_is_t_periodic():
    assert settled(stroboscope(np.zeros(97)))["response_period"].item() == 1


def test_rounding_does_not_hide_a_period():
    noisy = cycle(4) * (1 + 1e-15 * np.random.default_rng(2).normal(size=97))
    assert settled(stroboscope(noisy))["response_period"].item() == 4


def test_a_lane_does_not_see_its_neighbours():
    found = settled(stroboscope(cycle(3), np.full(97, np.nan), cycle(5) * 1e6))
    assert found["response_period"].values.tolist() == [3, 0, 5]
    assert found["response_period"].dims == ("trajectory",)


def test_a_failed_trajectory_has_no_period():
    assert settled(stroboscope(cycle(3), status="budget_steps"))["response_period"].item() == 0


@pytest.mark.parametrize("last", [1, 97])
def test_too_little_kept(last):
    with pytest.raises(ParameterError, match="whole forcing periods"):
        settled(stroboscope(cycle(3)), last=last)
