"""Maps that grow: every cell once, coarse ones first, and each labelled as by `sl.basins`."""

import threading
from dataclasses import fields, replace

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.attractors.find_attractors import find_attractors
from saltus.analysis.basins import growing, labels
from saltus.analysis.basins.growing import grow
from saltus.analysis.basins.labels import OPEN, Settling, Wanderers, settle
from saltus.analysis.basins.levels import TILE, levels_of, stride_of
from saltus.analysis.basins.pipeline import basin_plan
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import ODE45, RK4
from saltus.results.dataset.kinds import Kind

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")
SEED = 8203


def plan_of(shape, system=RIG, method=None, periods=600):
    axes = {"x": (-5e-3, 5e-3, shape[0]), "v": (-1.0, 1.0, shape[1])}
    plan = basin_plan(system, axes, None, method or sl.Taylor(), periods, None)
    return replace(plan, scouts=128)


def same(one, other):
    for field in fields(Settling):
        np.testing.assert_array_equal(getattr(one, field.name), getattr(other, field.name))


# -- the order -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "shape", [(400, 400), (25, 25), (3, 5), (100, 37), (1, 1), (17, 200), (1300, 20)]
)
def test_levels_hold_every_cell_once(shape):
    levels = levels_of(shape)
    cells = [np.concatenate(list(one.tiles())) for one in levels]
    assert [one.count for one in levels] == [len(one) for one in cells]
    np.testing.assert_array_equal(np.sort(np.concatenate(cells)), np.arange(shape[0] * shape[1]))
    rows, columns = np.unravel_index(cells[0], shape)
    assert not (rows % levels[0].stride).any()
    assert not (columns % levels[0].stride).any()
    for one, its in zip(levels, cells, strict=True):
        assert (stride_of(its, shape) == one.stride).all()
    assert levels[-1].stride == 1
    assert len(levels) == 1 or 16 <= max(shape) / levels[0].stride < 32


def test_a_level_goes_from_the_middle_of_the_map_outwards():
    shape = (400, 300)
    for level in levels_of(shape):
        far = []
        for tile in level.tiles():
            places = np.stack(np.unravel_index(tile, shape), axis=1)
            assert (np.ptp(places // TILE, axis=0) == 0).all()  # one tile of the screen
            far.append(np.linalg.norm(places[0] // TILE * TILE + TILE / 2 - np.array(shape) / 2))
        assert far == sorted(far)


# -- trajectories of any ages ----------------------------------------------------------------------
@pytest.mark.parametrize(
    ("system", "method", "size"),
    [
        (RIG, sl.Taylor(), (5e-3, 1.0)),
        (RIG, ODE45(1e-4, 1e-7), (5e-3, 1.0)),
        (RIG, RK4("0.5 ms"), (5e-3, 1.0)),
        (sl.models.impact_oscillator(), sl.Taylor(), (0.5, 1.0)),
        (sl.models.two_masses(), sl.Modal(), (2.0, 2.0, 2.0, 2.0)),
        (sl.models.dry_friction(), sl.Taylor(), (1.0, 1.0)),
    ],
)
def test_travellers_join_and_leave_at_any_time_and_no_bit_changes(system, method, size):
    """Each trajectory is the one that it is alone, whatever the ages of its neighbours."""
    map_ = Stroboscope(system, method)
    random = np.random.default_rng(SEED)
    start = random.uniform(-1.0, 1.0, (40, len(size))) * size
    alone = map_.launch(start, 64)
    whole = np.concatenate([alone.advance(8) for _ in range(5)], axis=1)
    flight, who, seen = map_.launch(start[:10], 64), np.arange(10), {i: [] for i in range(40)}
    for turn in range(8):
        for i, row in zip(who, flight.advance(8, 40), strict=True):
            seen[int(i)].append(row)
        stays = random.random(len(who)) < 0.9
        flight.keep(stays)
        who = who[stays]
        if turn < 3:
            more = np.arange(10 * (turn + 1), 10 * (turn + 2))
            flight.add(map_.launch(start[more], 64))
            who = np.concatenate([who, more])
    for i, rows in seen.items():
        here = np.concatenate(rows)
        assert np.isnan(here[40:]).all()  # none goes farther than asked
        np.testing.assert_array_equal(here[:40], whole[i, : len(here)])


def chaotic():
    """A map with a chaotic attractor and a way out: Duffing's equation in two wells."""

    @sl.system(states="x v", forced_at="f", check_units=False)
    def duffing(t, x, v, *, f=0.1591549, a=0.3, c=0.2):
        return v, x - x * x * x - c * v + a * sl.cos(2 * sl.pi * f * t)

    axes = {"x": (-1.5, 1.5, 12), "v": (-1.0, 1.0, 12)}
    return replace(basin_plan(duffing, axes, None, sl.Taylor(), 500, None), scouts=24)


@pytest.mark.slow
def test_a_pool_labels_as_one_call_does_attractors_that_never_repeat_too():
    plan = chaotic()
    map_, start = plan.map(1), plan.starts(np.arange(plan.cells))
    found = find_attractors(map_, start[::6], plan.scale, 500)[0]
    assert found.sampled
    for most in (140, 20):  # neither whole blocks nor windows
        pool, result, at = Wanderers(map_, found, most, 2), Settling.empty(plan.cells, 2), 0
        while len(pool) or at < plan.cells:
            more = np.arange(at, min(at + 8, plan.cells))  # their ages differ
            if len(more):
                pool.add(more, start[more])
                at = more[-1] + 1
            result.put(*pool.go_on())
        same(result, settle(map_, start, found, most))


# -- a map -----------------------------------------------------------------------------------------
def test_a_grown_map_is_that_of_basins(monkeypatch):
    monkeypatch.setattr(growing, "POOL", 64)
    plan, taken = plan_of((40, 33)), []
    found = plan.scout(1)
    result = grow(plan, found, taken.append, patience=40, threads=2)
    same(result, settle(plan.map(1), plan.starts(np.arange(plan.cells)), found, plan.periods))
    seen = np.full(plan.cells, Kind.NOT_COMPUTED, int)
    for one in taken:
        assert (stride_of(one.cells, plan.shape) == one.stride).all()
        seen[one.cells] = one.part.label
        assert one.known == np.isin(seen, (Kind.NOT_COMPUTED, OPEN), invert=True).sum()
        level = stride_of(np.arange(plan.cells), plan.shape) == one.stride
        assert one.whole == (seen[level] != Kind.NOT_COMPUTED).all()
    np.testing.assert_array_equal(seen, result.label)
    assert taken[0].stride == 2
    assert taken[-1].whole


@pytest.mark.slow
def test_coarse_starts_wait_and_a_stopped_map_goes_on(monkeypatch):
    monkeypatch.setattr(growing, "POOL", 64)
    plan = plan_of((66, 40))
    found = plan.scout(1)
    coarse = grow(plan, found, lambda _: None, finest=4, patience=24, threads=1)
    strides = stride_of(np.arange(plan.cells), plan.shape)
    assert (coarse.label[strides < 4] == Kind.NOT_COMPUTED).all()
    opened = coarse.label == OPEN
    assert opened.any()
    assert (coarse.label[strides >= 4] != Kind.NOT_COMPUTED).all()
    followed = []
    monkeypatch.setattr(
        labels.Wanderers, "add",
        lambda self, who, start, add=Wanderers.add: (followed.append(who), add(self, who, start)),
    )  # fmt: skip
    stop = sl.Stop()

    def some(one):
        if one.known > plan.cells // 2:
            stop.set()

    with pytest.raises(sl.Interrupted), stop:
        grow(plan, found, some, result=coarse, threads=2)
    known = ~np.isin(coarse.label, (OPEN, Kind.NOT_COMPUTED))
    assert plan.cells // 2 < known.sum() < plan.cells
    followed.clear()
    grow(plan, found, lambda _: None, result=coarse, threads=2)
    assert not known[np.concatenate(followed)].any()  # what is known isn't followed again
    same(coarse, settle(plan.map(1), plan.starts(np.arange(plan.cells)), found, plan.periods))


def test_an_error_of_the_taker_ends_all_threads():
    plan = plan_of((40, 40))
    found = plan.scout(1)
    before = threading.active_count()

    def broken(_):
        raise ZeroDivisionError("the page is gone")

    with pytest.raises(ZeroDivisionError):
        grow(plan, found, broken, threads=2)
    assert threading.active_count() == before
