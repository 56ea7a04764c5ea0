"""A whole map from nothing or from old attractors: the labels are those of `sl.basins`."""

from dataclasses import replace

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.attractors.followed import followed
from saltus.analysis.basins import growing
from saltus.analysis.basins.growing import Grown, KnownAttractors, grow_all
from saltus.analysis.basins.labels import Settling
from saltus.analysis.basins.pipeline import basin_plan
from saltus.analysis.closed.motions import same
from saltus.flow.methods import ODE45
from saltus.results.dataset.kinds import Kind

SIZE = 24
AXES = {"x": (-5e-3, 5e-3, SIZE), "v": (-1.0, 1.0, SIZE)}


def plan_at(frequency, scouts=1024, **more):
    system = sl.models.delangre("b", force="4 N", frequency=frequency)
    return replace(basin_plan(system, AXES, None, sl.Taylor(), 2000, None), scouts=scouts, **more)


class Page:
    """What who looks at a map draws: cells, and attractors under ids of its own."""

    def __init__(self, plan):
        self.label = np.full(plan.cells, int(Kind.NOT_COMPUTED))
        self.told = []

    def __call__(self, one):
        if isinstance(one, KnownAttractors):
            settled = self.label >= 0
            self.label[settled] = np.append(one.ids, -99)[self.label[settled]]
            self.told.append(one)
        else:
            assert isinstance(one, Grown)
            assert one.part.label.max(initial=-1) < len(self.told[-1].found)
            self.label[one.cells] = one.part.label


@pytest.mark.parametrize("scouts", [pytest.param(1024, marks=pytest.mark.slow), 3])
def test_a_map_from_nothing_is_that_of_basins(monkeypatch, scouts):
    """With few scouts the cells themselves reveal attractors, in both."""
    monkeypatch.setattr(growing, "FEW_SCOUTS", 2)
    plan = plan_at(14.0, scouts)
    page = Page(plan)
    found, result = grow_all(plan, page, threads=2)
    assert len(page.told) > 1
    np.testing.assert_array_equal(page.label, result.label)
    ds = plan.finish(result, found, 2)
    if scouts == 1024:
        whole = sl.basins(plan.system, **AXES, progress=False)
    else:
        alone = plan.scout(1)
        whole = plan.finish(growing.grow(plan, alone, lambda _: None, threads=2), alone, 2)
    for name in ("basin", "attractor_period", "attractor_fraction"):
        np.testing.assert_array_equal(ds[name].values, whole[name].values)
    for name in ("flip_rate", "basin_entropy", "uncertainty_exponent"):
        np.testing.assert_equal(ds.attrs[name], whole.attrs[name])


def test_old_attractors_are_followed_and_the_map_is_the_same():
    old, new = plan_at(14.0, 256), plan_at(14.02, 256)
    before = old.scout(1)
    known, came_from = followed(new.map(1), before, new.scale)
    assert len(known) > 2
    assert len(set(came_from.tolist())) == len(known)
    alone = new.scout(1)
    for one, origin in zip(known.orbits, came_from, strict=True):
        assert one.period == before.orbits[origin].period
        assert any(same(one, other, new.scale, 1e-6) for other in alone.orbits)
    page = Page(new)
    found, result = grow_all(new, page, known, threads=2)
    assert page.told[0].found is known
    whole = growing.grow(new, alone, lambda _: None, threads=2)
    ds, direct = (new.finish(*one, 2) for one in ((result, found), (whole, alone)))
    np.testing.assert_array_equal(ds["basin"].values, direct["basin"].values)


def test_attractors_of_an_inexact_method_and_chaotic_ones_are_left_to_a_search():
    plan = plan_at(14.0, 64)
    before = plan.scout(1)
    known, came_from = followed(plan.map(1).by(ODE45(1e-4, 1e-7)), before, plan.scale)
    assert (len(known), len(came_from)) == (0, 0)


def test_a_limit_cycle_is_followed():
    """Its radius is sqrt(mu): r' = r (mu - r^2)."""

    @sl.system(states="x y", check_units=False)
    def turning(t, x, y, *, mu=1.0):
        free = mu - x * x - y * y
        return free * x - 2 * y, free * y + 2 * x

    axes = {"x": (-2.0, 2.0, 5), "y": (-2.0, 2.0, 5)}
    plans = [
        replace(
            basin_plan(turning.with_values(mu=mu), axes, None, sl.Taylor(), 400, None), scouts=12
        )
        for mu in (1.0, 1.21)
    ]
    before = plans[0].scout(1)
    known, came_from = followed(plans[1].map(1), before, plans[1].scale)
    (cycle,) = known.sampled
    assert cycle.kind == "limit_cycle"
    np.testing.assert_allclose(np.hypot(*cycle.points.T), 1.1, rtol=1e-9)
    assert before.every[came_from[len(known.orbits)]].kind == "limit_cycle"


def test_a_stopped_map_ends_all_its_work_and_goes_on_where_it_stood(monkeypatch):
    stop, plan = sl.Stop(), plan_at(14.0, 256)
    monkeypatch.setattr(growing, "POOL", 32)
    result, found = Settling.empty(plan.cells, 2), plan.scout(1)

    def take(one):
        if isinstance(one, Grown) and one.known > 99:
            stop.set()

    with pytest.raises(sl.Interrupted), stop:
        grow_all(plan, take, found, threads=2, result=result, scouted=True)
    settled = result.label >= 0
    assert 99 < settled.sum() < plan.cells
    page = Page(plan)
    grow_all(plan, page, found, threads=2, result=result, scouted=True)
    assert page.told[0].found is found
    assert (page.label[settled] == Kind.NOT_COMPUTED).all()  # they are known, and aren't told again
    whole = growing.grow(plan, found, lambda _: None, threads=2)
    basin = plan.finish(whole, found, 1)["basin"].values.ravel()
    np.testing.assert_array_equal(result.label, basin)
