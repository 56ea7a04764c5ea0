"""Scouts within a budget, maps and boxes over sensors, and what they hand out if interrupted."""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from function_maps import FunctionMap
from saltus.analysis.attractors.aperiodic import SURVEY_ITERATES
from saltus.analysis.basins import basin_fractions as fractions
from saltus.analysis.basins import labels, scouting
from saltus.analysis.basins.pipeline import basin_plan
from saltus.errors import ParameterError
from saltus.flow.methods import check_method
from saltus.results.dataset.kinds import Kind


@pytest.fixture(scope="module")
def chain():
    stiffness = 400.0 * (2 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1))
    return sl.structure(
        np.eye(5), stiffness, modes=4, damping_ratio=0.05, frequency=2.3,
        contacts=[sl.Contact("x5", 900.0, 0.02)], forces=[sl.Force("x5", 20.0)],
        sensors={"tip": "x5", "tip speed": sl.velocity("x5"), "root": "x1"},
    )  # fmt: skip


def test_few_states_have_all_scouts_and_many_as_many_as_their_cost_allows():
    longest = 2000 + SURVEY_ITERATES
    assert scouting.affordable(longest, 4) == scouting.SCOUTS
    assert scouting.affordable(longest, 20) == scouting.FEWEST
    assert scouting.FEWEST < scouting.affordable(300, 20) < scouting.SCOUTS


def test_the_first_scouts_say_how_many_follow(chain, monkeypatch):
    plan = basin_plan(
        chain, {"tip": (-0.05, 0.05, 3), "root": (-0.01, 0.01, 3)}, None,
        check_method(None, chain), 200, None,
    )  # fmt: skip
    seen, find = [], scouting.find_attractors
    monkeypatch.setattr(
        scouting, "find_attractors", lambda map_, start, *rest, **more: (
            seen.append(len(start)), find(map_, start, *rest, **more))[1]
    )  # fmt: skip
    for work, count in ((1.0, [16]), (8**3 * 64 * 20.0, None), (np.inf, [1024])):
        seen.clear()
        monkeypatch.setattr(scouting, "WORK", work)
        known = list(plan.scouted(1))
        assert len(known[0]) == 0
        assert [len(one) for one in known[1:]] == [1] * len(seen)
        assert seen == count if count else (seen[0] == 16 and 0 < seen[1] < 1008)


@pytest.mark.parametrize(("states", "found"), [(2, ["quasi_periodic"]), (6, [])])
def test_a_first_look_at_many_states_waits_for_nothing_that_never_repeats(states, found):
    turn = np.sqrt(2.0) * np.arange(1, states // 2 + 1)
    cos, sin = np.diag(np.cos(turn)), np.diag(np.sin(turn))
    matrix = np.block([[cos, -sin], [sin, cos]])
    map_ = FunctionMap(
        lambda z: z @ matrix.T, " ".join(f"x{i}" for i in range(states)),
        lambda z: np.broadcast_to(matrix, (len(z), states, states)),
    )  # fmt: skip
    launch, asked = map_.launch, []
    map_.launch = lambda start, longest: (
        asked.append(len(start) * longest),
        launch(start, longest),
    )[1]
    start = np.random.default_rng(2612).uniform(-1, 1, (64, states))
    seen = scouting.glanced(map_, start[:8], np.ones(states), 512)
    assert {one.kind for one in seen.every} == set(found)  # a circle of each start
    assert found or sum(asked) <= 8 * scouting.GLANCE


def test_a_fine_map_of_a_structure_has_a_budget_and_a_given_number_of_periods_stands(chain):
    def planned(count, periods):
        axes = {"tip": (-0.05, 0.05, count), "tip speed": (-1.0, 1.0, count)}
        return basin_plan(chain, axes, None, check_method(None, chain), periods, None).periods

    states = len(chain.states)
    assert states >= 8
    assert planned(10, None) == 2000
    assert 2**35 - 400**2 * states**3 < planned(400, None) * 400**2 * states**3 <= 2**35
    assert planned(400, 1500) == 1500


def test_a_map_over_sensors_begins_where_they_show_its_cells(chain):
    axes = {"tip": (-0.05, 0.05, 3), "tip speed": ("-1 m/s", "1 m/s", 2)}
    plan = basin_plan(chain, axes, {"root": "2 mm"}, check_method(None, chain), 200, None)
    starts = plan.starts(np.arange(6))
    shown = sl.simulate(chain, starts, periods=1, samples=2, progress=False).isel(time=0)
    np.testing.assert_allclose(shown.tip, np.repeat([-0.05, 0.0, 0.05], 2), atol=1e-12)
    np.testing.assert_allclose(shown["tip speed"], np.tile([-1.0, 1.0], 3), atol=1e-12)
    np.testing.assert_allclose(shown.root, 2e-3, atol=1e-12)
    found = sl.basins(chain, at={"root": "2 mm"}, progress=False, **axes)
    assert found.basin.dims == ("tip", "tip speed")
    assert (found.basin == 0).all()
    assert found["tip speed"].units == "m/s"
    assert np.isnan(found.flip_rate)


@pytest.mark.parametrize(
    ("axes", "at", "message"),
    [
        ({"tip": (-1, 1, 3), "nose": (-1, 1, 3)}, None, "no state and no sensor 'nose'"),
        ({"tip": (-1, 1, 3), "root": (-1, 1, 3)}, {"q1": 1.0}, "no sensor 'q1'"),
        ({"tip": (-1, 1, 3), "q1": (-1, 1, 3)}, None, "no state 'tip'"),
    ],
)
def test_axes_that_can_not_be_used(chain, axes, at, message):
    with pytest.raises(ParameterError, match=message):
        sl.basins(chain, at=at, **axes)


def test_what_was_found_is_handed_out_even_before_a_cell_was_followed():
    rig, stop = sl.models.delangre("a", force="4 N", frequency="17 Hz"), sl.Stop()
    axes = {"x": ("-5 mm", "5 mm", 20), "v": ("-1 m/s", "1 m/s", 20)}
    with pytest.raises(sl.Interrupted) as caught, stop:
        sl.basins(rig, progress=lambda _: stop.set(), **axes)
    assert (caught.value.partial.basin == Kind.NOT_COMPUTED).all()


def test_a_box_over_sensors_draws_what_they_show(chain, monkeypatch):
    begun = []

    def settle_all(map_, start, *rest):
        begun.append(start)
        return labels.settle_all(map_, start, *rest)

    monkeypatch.setattr(fractions, "settle_all", settle_all)
    box = {"tip": ("-5 cm", "5 cm"), "tip speed": ("-1 m/s", "1 m/s")}
    found = sl.basin_fractions(
        chain, samples=20, at={"root": "2 mm"}, periods=200, progress=False, **box
    )
    assert found.attractor_fraction.values.tolist() == [1.0]
    shown = sl.simulate(chain, begun[0], periods=1, samples=2, progress=False).isel(time=0)
    drawn = np.random.default_rng(1).random((20, 2))
    np.testing.assert_allclose(shown.tip, -0.05 + 0.1 * drawn[:, 0], atol=1e-12)
    np.testing.assert_allclose(shown["tip speed"], -1 + 2 * drawn[:, 1], atol=1e-12)
    np.testing.assert_allclose(shown.root, 2e-3, atol=1e-12)


def test_shares_so_far_are_of_starts_that_were_followed(chain, monkeypatch):
    def settle_all(map_, start, found, most, threads, progress, result):
        result.put(slice(0, 16), labels.settle(map_, start[:16], found, most))
        raise KeyboardInterrupt

    monkeypatch.setattr(fractions, "settle_all", settle_all)
    with pytest.raises(sl.Interrupted) as caught:
        sl.basin_fractions(chain, samples=48, periods=200, tip=(-0.05, 0.05), progress=False)
    partial = caught.value.partial
    assert partial.basin.values.tolist() == [0] * 16 + [Kind.NOT_COMPUTED] * 32
    assert partial.attractor_fraction.values.tolist() == [1.0]
    assert partial.attractor_fraction_low.item() < 0.9
