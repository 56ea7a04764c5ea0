"""Ladders of grazes: where they accumulate."""

import math

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.branches.ladders import accumulation


@pytest.mark.nojit
@pytest.mark.parametrize("ratio", [0.3, 0.7, 0.95])
def test_a_geometric_ladder_has_its_limit(ratio):
    values = 2.0 - 0.3 * ratio ** np.arange(5)
    assert accumulation([2, 3, 4, 5, 6], values) == pytest.approx(2.0, abs=1e-12)


@pytest.mark.nojit
@pytest.mark.parametrize(
    ("contacts", "values"),
    [
        ([2, 3, 4, 5], 0.5 ** np.arange(4)),  # too short to tell
        ([2, 3, 4, 3, 4], 0.5 ** np.arange(5)),  # contacts come and go
        ([6, 5, 4, 3, 2], 0.5 ** np.arange(5)),  # away from a chatter
        ([2, 3, 4, 5, 6], 2.0 ** np.arange(5)),  # grows
        ([2, 3, 4, 5, 6], 1.0 / np.arange(1, 6)),  # slower than a geometric one
        ([2, 3, 4, 5, 6], (-0.5) ** np.arange(5)),
        ([2, 3, 4, 5, 6], [1.0, 1.0, 1.0, 1.0, 1.0]),
    ],
)
def test_what_is_no_ladder(contacts, values):
    assert math.isnan(accumulation(contacts, values))


def test_a_branch_ends_before_its_grazes_accumulate():
    """The ladder of ever more impacts in two periods, each kept for 0.7 of its speed. Followed to
    16 impacts, its grazes are 2.9973952943520854, 2.997369120902456, 2.9973554207981943,
    2.9973484715919883, 2.997345156781613: the limit lies beyond them by less than their steps.
    """
    stop = sl.models.impact_oscillator(damping=0, gap=0, restitution=0.7, frequency=2.8)
    vary = {"frequency": ("2.9 rad/s", "3.1 rad/s")}
    found = sl.branches(stop, vary, (0.0, -0.5), at=2, switch=(), progress=False)
    ends = np.stack([found.branch_begin, found.branch_end])
    limits = np.stack([found.branch_begin_limit, found.branch_end_limit])
    assert (np.isfinite(limits) == (ends == "accumulates")).all()
    assert np.abs(limits[ends == "accumulates"] - 2.9973453).min() < 1e-5
    assert found.branch_begin_limit.attrs["units"] == "rad/s"
    assert "its grazes accumulate at 2.99734" in sl.describe(found)
    assert found.sizes["point"] < 500


def test_a_branch_of_orbits_that_rest_ends_where_the_chatter_is_cut_short():
    """Beyond, each orbit flies: these are a branch of their own, back to where its grazes
    accumulate, one after the other.
    """
    chatter = sl.models.impact_oscillator("chatter", restitution=0.5)
    found = sl.branches(
        chatter, {"frequency": ("0.55 rad/s", "0.57 rad/s")}, at=2, switch=(), progress=False
    )
    rests = np.array(["at rest" in one for one in found.point_itinerary.values])
    values, of = found.point_frequency.values, found.point_branch.values
    assert all(len(set(rests[of == branch])) == 1 for branch in range(found.sizes["branch"]))
    assert found.branch_end.values[of[np.argmax(np.where(rests, values, 0))]] == "held"
    assert "the chatter before a held contact changes" in sl.describe(found)
    number = of[np.argmin(np.where(rests, 1, values))]
    assert found.branch_begin.values[number] == "accumulates"
    limit = found.branch_begin_limit.values[number]
    assert values[rests].max() < limit < values[~rests].min()
    assert values[~rests].min() - values[rests].max() < 1e-4
    assert found.branch_end.values[number] == "range"


def test_a_branch_of_orbits_that_rest_passes_impacts_that_cross_the_whole_period():
    """Points at whole periods jump there. Each orbit is reached from rest, too."""
    chatter = sl.models.impact_oscillator("chatter", restitution=0.5)
    found = sl.branches(
        chatter, {"frequency": ("0.3 rad/s", "0.56 rad/s")}, at=2, switch=(), progress=False
    )
    assert (found.branch_begin.values, found.branch_end.values) == (["range"], ["range"])
    values = found.point_frequency.values
    assert np.diff(values).max() < 0.04
    assert np.diff(values).min() > -1e-5
    jumps = np.abs(np.diff(found.point_v.values[:, 0]))
    assert (jumps > 0.05).sum() > 3
    for i in range(0, len(values), 10):
        system = chatter.with_values(frequency=float(values[i]))
        run = sl.stroboscope(system, (0.0, 0.0), 60, keep=1, progress=False)
        for name in ("x", "v"):
            assert abs(run[name].values.ravel()[-1] - found[f"point_{name}"].values[i, 0]) < 1e-9
