"""The contract of a map: whatever is asked of orbits, attractors and exponents, it is asked by
these few calls, so every map keeps them.
"""

import numpy as np
import pytest

import saltus as sl
from function_maps import FunctionMap
from saltus.flow.maps import Stroboscope

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")
START = np.array([[1e-3, 0.1], [-2e-3, 0.05], [0.5e-3, -0.2]])


@sl.system(states="x v")
def pendulum(t, x, v, *, damping=0.2):
    """Without forcing, and with no contact."""
    return v, -damping * v - sl.sin(x)


def rows_of(system, name, factors):
    values = np.tile(list(system.values.values()), (len(factors), 1))
    values[:, list(system.values).index(name)] *= factors
    return values


def henon():
    def derivative(z):
        one = np.ones(len(z))
        return np.stack(
            [np.stack([-2 * z[:, 0], one], axis=1), np.stack([0.3 * one, 0 * one], axis=1)], axis=1
        )

    return FunctionMap(
        lambda z: np.stack([1 - z[:, 0] ** 2 + z[:, 1], 0.3 * z[:, 0]], axis=1), "x y", derivative
    )


MAPS = {
    "one row": lambda: Stroboscope(RIG, sl.Taylor()),
    "a row for each": lambda: Stroboscope(RIG, sl.Taylor(), rows_of(RIG, "force", [1.0, 0.9, 1.2])),
    "another period for each": lambda: Stroboscope(
        RIG, sl.Taylor(), rows_of(RIG, "frequency", [1.0, 0.9, 1.2])
    ),
    "without forcing": lambda: Stroboscope(pendulum, sl.Taylor(), every=0.7),
    "other looks for each": lambda: (
        Stroboscope(pendulum, sl.Taylor(), every=0.7)
        .rows(np.arange(3))
        .with_period(np.array([0.7, 1.0, 0.3]))
    ),
    "ode45": lambda: Stroboscope(RIG, sl.ODE45(1e-8, 1e-11)),
    "a function": henon,
}


@pytest.fixture(params=MAPS)
def map_(request):
    return MAPS[request.param]()


def close_to(map_):
    return {"rtol": 1e-9, "atol": 1e-12} if map_.exact else {"rtol": 1e-5, "atol": 1e-7}


def test_trajectories_go_on_as_they_are_asked_to(map_):
    at_once, one_by_one = map_.launch(START, 4), map_.launch(START, 4)
    points = at_once.advance(4)
    assert points.shape == (3, 4, 2)
    assert at_once.age == 4
    assert len(at_once) == 3
    assert at_once.going.all()
    np.testing.assert_array_equal(points[:, -1], at_once.state)
    np.testing.assert_allclose(
        np.concatenate([one_by_one.advance(1) for _ in range(4)], axis=1), points, **close_to(map_)
    )


def test_those_that_are_kept_move_as_if_the_others_had_stayed(map_):
    all_of_them, some = map_.launch(START, 3), map_.launch(START, 3)
    all_of_them.advance(1)
    some.advance(1)
    kept = np.array([True, False, True])
    some.keep(kept)
    np.testing.assert_array_equal(some.advance(2), all_of_them.advance(2)[kept])


def test_all_ways_lead_to_the_same_image(map_):
    for count in (1, 3):
        end = map_.launch(START, count).advance(count)[:, -1]
        np.testing.assert_allclose(map_.sequences(START, count)[0], end, **close_to(map_))
        np.testing.assert_allclose(map_.tangent(START, count)[0], end, **close_to(map_))


def test_the_derivative_is_that_of_the_image(map_):
    """Central differences, with the error of the differences themselves."""
    end, matrix = map_.tangent(START, 1)
    step = 1e-6 * (1.0 if map_.exact else 10.0)
    for j, direction in enumerate(np.eye(2)):
        ahead, behind = (map_.sequences(START + way * step * direction, 1)[0] for way in (1, -1))
        np.testing.assert_allclose(
            (ahead - behind) / (2 * step),
            matrix[:, :, j],
            rtol=1e-3,
            atol=1e-3 * np.abs(matrix).max(),
        )
    assert np.isfinite(end).all()


def test_the_derivative_of_many_iterates_is_a_product_and_may_be_asked_for_in_any_directions(map_):
    end, first = map_.tangent(START, 1)
    _, second = map_.tangent(end, 1)
    _, both = map_.tangent(START, 2)
    _, along = map_.tangent(end, 1, first)
    scale = 1e-7 if map_.exact else 1e-3
    np.testing.assert_allclose(both, second @ first, atol=scale * np.abs(both).max())
    np.testing.assert_allclose(along, second @ first, atol=scale * np.abs(both).max())


def test_each_row_may_be_iterated_as_often_as_it_needs(map_):
    counts = np.array([3, 1, 2])
    ends, matrices = map_.tangent(START, counts)
    for i, count in enumerate(counts):
        end, matrix = map_.rows(np.array([i])).tangent(START[[i]], int(count))
        np.testing.assert_array_equal(ends[i], end[0])
        np.testing.assert_array_equal(matrices[i], matrix[0])


def test_some_of_the_rows_are_a_map_of_these_rows(map_):
    all_of_them = map_.sequences(START, 2)[0]
    for which in (np.array([2, 0, 2]), np.array([False, True, True])):
        np.testing.assert_array_equal(
            map_.rows(which).sequences(START[which], 2)[0], all_of_them[which]
        )


def test_errors_that_are_more_than_rounding_have_a_map_without_them(map_):
    assert (map_.exact_map is None) == map_.exact
    assert map_.exact or map_.exact_map.exact
    noise = map_.noise_of(np.ones((3, 2)))
    assert noise.shape == (3,)
    assert (noise > 0).all()
    assert map_.noise > 0
    assert map_.states == (map_.exact_map or map_).states
    assert (map_.period > 0).all()


def test_a_map_of_no_trajectories_is_as_good_as_any(map_):
    none, nobody = START[:0], map_.rows(np.zeros(0, np.int64))
    assert nobody.tangent(none, 1)[1].shape == (0, 2, 2)
    assert nobody.launch(none, 1).advance(1).shape == (0, 1, 2)
