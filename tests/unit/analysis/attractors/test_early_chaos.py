"""Chaos of structures that is told before a motion was followed to its end."""

import math

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.attractors import early_chaos
from saltus.analysis.attractors.aperiodic import kind_of_growth
from saltus.analysis.attractors.divided_grid import _settled_arrays, _settled_from
from saltus.analysis.attractors.early_chaos import SEEN, looked_at, told_early
from saltus.analysis.attractors.find_responses import SettledMotions, find_responses
from saltus.analysis.solve.tolerances import ROUND
from saltus.flow.maps import Stroboscope
from saltus.results.dataset.kinds import Kind

#: First natural frequency of the chain [rad/s]: 2 sqrt(k/m) sin(pi/10).
FIRST = 200.0 * math.sin(math.pi / 10)


def chain(damping_ratio=0.02, frequency=13.0, gap="0.1 mm", stiffness="1 MN/m"):
    """Four masses between springs, the first one driven, the last one between two stops."""
    springs = 1e4 * (2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    return sl.structure(
        np.eye(4), springs, frequency=frequency, damping_ratio=damping_ratio, modes=4,
        contacts=[sl.Contact("x4", stiffness=stiffness, gap=gap, side="both")],
        forces=[sl.Force("x1", 20.0)], sensors={"end": "x4"},
    )  # fmt: skip


@pytest.mark.parametrize("damping_ratio", [0.002, 0.01, 0.05])
@pytest.mark.parametrize("frequency", [13.0, 40.0])
def test_a_structure_is_looked_at_once_its_slowest_free_motion_has_died(damping_ratio, frequency):
    """It decays by exp(-zeta w) in a second; what is looked at comes after."""
    map_ = Stroboscope(chain(damping_ratio, frequency), sl.Modal())
    died = math.log(1000.0) / (damping_ratio * FIRST / frequency)
    (age,) = looked_at(map_, 4000)
    assert age == min(ROUND * math.ceil(max(died + SEEN, 1000.0) / ROUND), 4000)


def test_what_may_not_be_told_early_is_followed_to_its_end():
    """Nothing dies without damping; few states are cheap; by Taylor's method nothing tells how
    slowly a structure settles.
    """
    rig = sl.models.delangre("b")
    for system, method in (
        (chain(0.0), sl.Modal()),
        (chain(), sl.Taylor()),
        (rig, sl.Modal()),
        (rig, sl.Taylor()),
    ):
        assert looked_at(Stroboscope(system, method), 2000).tolist() == [2000]
    assert looked_at(Stroboscope(chain(), sl.Modal()), 300).tolist() == [300]


def test_chaos_is_told_after_a_quarter_and_the_answer_says_so(monkeypatch):
    """Followed to the end it is chaotic too, with an exponent that agrees within their errors."""
    system = chain()
    early = sl.frequency_response(system, ["13 Hz"], progress=False)
    assert early["type"].values.tolist() == [["chaotic"]]
    assert early.attrs["periods_watched"] == 512
    assert "at least 512 periods" in str(sl.describe(early))
    monkeypatch.setattr(early_chaos, "EARLY", 1.0)
    late = sl.frequency_response(system, ["13 Hz"], progress=False)
    assert late["type"].values.tolist() == [["chaotic"]]
    assert "periods_watched" not in late.attrs
    apart = float((early["response_exponent"] - late["response_exponent"]).item())
    errors = [float(one["response_exponent_error"].item()) for one in (early, late)]
    assert abs(apart) < 5 * math.hypot(*errors)


def test_numbers_of_chaos_are_taken_where_free_motions_have_died():
    """A start far off swings for long: the response is that of a start at rest, in its size."""
    system, sizes = chain(damping_ratio=0.01), []
    far = np.zeros(8)
    far[:4] = 0.3 * np.sin(np.pi * np.arange(1, 5) / 5)
    for start in (np.zeros(8), far):
        found = sl.frequency_response(system, ["13 Hz"], start=start, progress=False)
        assert found["type"].values.tolist() == [["chaotic"]]
        assert found.attrs["periods_watched"] < 2000
        sizes.append(float(found["output_peak"].sel(output="end").item()))
    assert 0.5 < sizes[1] / sizes[0] < 2.0


def test_a_motion_that_repeats_or_settles_is_not_told_to_be_chaotic():
    """An orbit without contacts, reached from afar: nothing grows, and it recurs in the end."""
    map_ = Stroboscope(chain(gap="1 m"), sl.Modal(), threads=1)
    past = map_.launch(np.full((1, 8), 1e-3), 1024).advance(1024)
    scale = np.ptp(past[:, -ROUND:], axis=1) + 1e-6
    assert told_early(map_, past[:, -SEEN:], scale) == [None]
    past[0, -SEEN] = np.nan
    assert told_early(map_, past[:, -SEEN:], scale) == [None]
    found = find_responses(map_, np.full((1, 8), 1e-3), 2000, 1)
    assert found.kind.tolist() == [Kind.PERIODIC]


def test_growth_of_many_errors_is_chaos_however_unsure_its_size_is():
    """1.6 an iterate, give or take 0.2: ten errors from zero. One of no sure sign says nothing."""
    random = np.random.default_rng(5)
    strong = random.normal(1.6, 1.0, (29, 1))
    assert kind_of_growth(strong)[0] == "chaotic"
    assert kind_of_growth(random.normal(0.0, 1.0, (29, 1))) is None


@pytest.mark.parametrize("counts", [{}, {0: 5, 2: 3}])
def test_points_of_unequal_numbers_come_back_from_a_chunk(counts):
    random, settled = np.random.default_rng(2), SettledMotions.empty(3, 2)
    settled.iterates.update({row: random.normal(size=(n, 2)) for row, n in counts.items()})
    back = _settled_from(_settled_arrays(settled), 3, 2)
    assert list(back.iterates) == list(counts)
    for row, points in settled.iterates.items():
        assert np.array_equal(back.iterates[row], points)
