"""Maps of the desk: every cell is that of `sl.basins`, however the map came about."""

import functools

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.basins import growing, labels, pipeline
from saltus.explore import map as maps
from saltus.explore import responses
from saltus.explore.attractors import Legend
from saltus.explore.cells import packed_cells, unpacked_cells
from saltus.explore.desk import Desk
from saltus.explore.frames import packed, unpacked
from saltus.explore.opening import opening_of
from saltus.explore.questions import question_of
from saltus.interrupt import Interrupted, Stop

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")
BOX = {"x": (-5e-3, 5e-3), "v": (-1.0, 1.0)}
SIZE = (20, 16)


@pytest.fixture(autouse=True)
def few_scouts(monkeypatch):
    """Fewer starts are looked through for attractors, and fewer cells checked."""
    monkeypatch.setattr(pipeline, "SCOUTS", 64)
    monkeypatch.setattr(pipeline, "CHECKED", 32)
    monkeypatch.setattr(growing, "FEW_SCOUTS", 16)
    monkeypatch.setattr(maps, "LOOKED", 16)


@pytest.fixture
def desk():
    return Desk(opening_of(RIG, None, axes=BOX), 2)


class Screen:
    """What a page has of a map: the newest label of each cell, and what it was told."""

    def __init__(self, desk, axes=BOX, size=SIZE, stop_after=None, **fields):
        self.heads, self.label = [], np.full(size, -100)
        self.age, self.times = np.full(size, 0), np.zeros(size, int)
        self._stop, self._after = Stop(), stop_after
        box = {name: list(ends) for name, ends in axes.items()}
        question = question_of("map", {"id": 1, "axes": box, "size": list(size), **fields})
        with self._stop:
            desk.answer(question, self._take)

    def _take(self, head, arrays):
        told, found = unpacked(packed(head, arrays))
        self.heads.append(told)
        if told["kind"] == "map-piece":
            found = unpacked_cells(found, self.label.shape[1])
            cell = found["cell"]
            rows, columns = np.unravel_index(cell, self.label.shape)
            assert len(np.unique(cell)) == len(cell)
            assert (
                np.gcd(np.gcd(rows, columns), self.heads[0]["levels"][0]) == told["level"]
            ).all()
            self.label[rows, columns] = found["label"]
            self.age[rows, columns] = found["age"]
            self.times[rows, columns] += 1
            if self._after is not None and (self.label >= 0).sum() >= self._after:
                self._stop.set()

    @property
    def end(self):
        return self.heads[-1]

    def kinds(self):
        return [head["kind"] for head in self.heads]


def held_against(screen, ds):
    """Each cell leads to the same orbit as in a Dataset of sl.basins, or to none for one reason."""
    rows = {row["key"]: row for row in screen.end["attractors"]}
    same = {}
    for i in ds["attractor"].values.tolist():
        period, peak = int(ds["attractor_period"][i]), float(ds["attractor_peak"][i])
        kind = str(ds["attractor_type"][i].item())
        (same[i],) = [
            key
            for key, row in rows.items()
            if (row["period"], row["kind"]) == (period, kind)
            and row["peak"]["x"] == pytest.approx(peak, rel=1e-3 if kind == "chaotic" else 1e-9)
        ]
    wanted = np.vectorize(lambda label: same.get(label, label))(ds["basin"].values)
    np.testing.assert_array_equal(screen.label, wanted)
    return same


def basins(axes=BOX, size=SIZE, system=RIG):
    return _basins(tuple(axes.items()), size, system)


@functools.cache
def _basins(axes, size, system):
    axes = dict(axes)
    box = {name: (*ends, n) for (name, ends), n in zip(axes.items(), size, strict=True)}
    return sl.basins(system, **box)


def test_a_finished_map_is_that_of_basins(desk):
    screen, ds = Screen(desk), basins()
    same = held_against(screen, ds)
    assert (screen.times == 1).sum() > 0.8 * screen.times.size  # few were open at first
    for i, key in same.items():
        (row,) = [row for row in screen.end["attractors"] if row["key"] == key]
        assert row["fraction"] == pytest.approx(float(ds["attractor_fraction"][i]))
        assert row["low"] == pytest.approx(float(ds["attractor_fraction_low"][i]))
        assert row["order"] == i
    for name in ("flip_rate", "basin_entropy"):
        assert screen.end[name] == pytest.approx(float(ds.attrs[name]), nan_ok=True)
    periods = ds["periods_to_settle"].values
    settled = periods >= 0
    age = np.ceil(np.log2(np.maximum(periods, 1)))
    np.testing.assert_array_equal(screen.age[settled], age[settled])
    assert screen.kinds()[0] == "map-begin"
    assert screen.kinds()[-1] == "map-end"


def test_what_is_known_is_not_computed_again(desk, monkeypatch):
    first = Screen(desk)
    started = _starts_counted(monkeypatch)
    again = Screen(desk)
    assert started == []
    np.testing.assert_array_equal(again.label, first.label)
    assert again.end["flip_rate"] == first.end["flip_rate"]
    assert again.heads[0]["cached"]


@pytest.mark.slow
def test_a_panned_map_computes_what_came_into_sight(desk, monkeypatch):
    step = 2.0**-11  # of which all starts are multiples, to the bit
    first, panned = (
        {"x": (k * step, (k + SIZE[0] - 1) * step), "v": (-0.5, 0.5)} for k in (-10, -4)
    )
    Screen(desk, first)
    started = _starts_counted(monkeypatch)
    screen = Screen(desk, panned)
    assert sum(started) == 6 * SIZE[1] + pipeline.CHECKED
    held_against(screen, basins(panned))


def test_a_zoomed_map_takes_the_attractors_along(desk):
    Screen(desk)
    zoomed = {"x": (-1e-3, 1.5e-3), "v": (-0.1, 0.1)}
    screen = Screen(desk, zoomed)
    held_against(screen, basins(zoomed))


def _starts_counted(monkeypatch):
    """Numbers of starts that are followed from now on."""
    started = []
    add = labels.Wanderers.add

    def counted(self, who, start):
        started.append(len(who))
        add(self, who, start)

    monkeypatch.setattr(growing.Wanderers, "add", counted)
    return started


def test_a_stopped_map_goes_on_where_it_was(desk, monkeypatch):
    with pytest.raises(Interrupted):
        Screen(desk, stop_after=60)
    started = _starts_counted(monkeypatch)
    screen = Screen(desk)
    assert started[0] <= screen.label.size - 60
    held_against(screen, basins())


def test_a_coarse_map_shows_whole_levels_and_goes_on_to_the_full_one(desk):
    coarse = Screen(desk, size=(64, 64), coarse=True)
    shown = coarse.label != -100
    assert shown.sum() == 256
    assert shown[::4, ::4].all()
    assert coarse.end["coarse"]
    assert coarse.end["flip_rate"] is None
    assert sum(one["fraction"] for one in coarse.end["attractors"]) <= 1


def test_shares_come_from_whole_levels_with_their_interval(desk):
    screen = Screen(desk, size=(36, 32))
    told = [head for head in screen.heads if head["kind"] == "map-level"]
    assert {head["level"] for head in told} == {2, 1}
    assert told[-1]["of"] == 1
    for head in told:
        seen = screen.label[:: head["of"] or 99, :: head["of"] or 99]
        assert bool(head["fractions"]) == bool(head["of"])
        for one in head["fractions"]:  # what was open then has a label now
            assert one["fraction"] <= (seen == one["key"]).mean() + 1e-12
            assert one["low"] <= one["fraction"] <= one["high"]
        named = sum(one["fraction"] for one in head["fractions"])
        assert named > 0.8 or not head["of"]


def test_an_attractor_that_only_open_cells_reveal_joins_the_legend(desk, monkeypatch):
    monkeypatch.setattr(pipeline, "SCOUTS", 2)
    monkeypatch.setattr(maps, "FEW_SCOUTS", 1)
    screen = Screen(desk)
    monkeypatch.setattr(pipeline, "SCOUTS", 64)
    known = len(screen.heads[0]["attractors"])
    assert len(screen.end["attractors"]) > known
    held_against(screen, basins())
    keys = [row["key"] for row in screen.heads[0]["attractors"]]
    hues = [row["hue"] for row in screen.heads[0]["attractors"]]
    later = {row["key"]: row["hue"] for row in screen.end["attractors"]}
    assert [later[key] for key in keys] == hues  # nothing on the screen jumps


@pytest.mark.slow
def test_a_map_that_is_stopped_while_open_cells_settle_keeps_its_labels(desk, monkeypatch):
    monkeypatch.setattr(pipeline, "SCOUTS", 2)
    monkeypatch.setattr(maps, "FEW_SCOUTS", 1)

    def stopped(*_):
        raise Interrupted

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(labels, "settle_all", stopped)
        with pytest.raises(Interrupted):
            Screen(desk)
    screen = Screen(desk)
    monkeypatch.setattr(pipeline, "SCOUTS", 64)
    held_against(screen, basins())


def test_a_hue_belongs_to_an_orbit_at_neighbouring_values(desk):
    first, then = Screen(desk), Screen(desk, values={"frequency": 15.02})
    hues = {(row["period"], row["kind"]): row["hue"] for row in first.end["attractors"]}
    for row in then.end["attractors"]:
        if (row["period"], row["kind"]) in hues:
            assert row["hue"] == hues[row["period"], row["kind"]]
    fresh = [row for row in then.end["attractors"] if (row["period"], row["kind"]) not in hues]
    assert not {row["hue"] for row in fresh} & set(hues.values())


@pytest.mark.slow
def test_a_hue_follows_a_branch_to_other_values(desk, monkeypatch):
    monkeypatch.setattr(responses, "VALUES", 1)
    monkeypatch.setattr(responses, "STARTS", 1)
    at_home, found = Screen(desk, size=(16, 16)), []
    hues = {row["period"]: row["hue"] for row in at_home.end["attractors"]}
    question = {"id": 2, "parameter": "frequency", "range": [15.0, 15.08]}
    desk.answer(question_of("responses", question), lambda *answer: found.append(answer))
    away = RIG.with_values(frequency=15.06)
    orbits, reserved = desk.responses.orbits_at(away)
    on_branches = {one.period: hue for one, hue in orbits}
    assert {1, 3, 4, 5} <= set(on_branches)
    assert on_branches == {period: hues[period] for period in on_branches}
    assert reserved >= set(hues.values())
    for other in (away.with_values(force=2.0), RIG.with_values(frequency=15.1)):
        assert desk.responses.orbits_at(other) == ([], set())
    plan = desk.plan_of(away, sl.Taylor())
    told = [(one, hue + 7) for one, hue in orbits]  # what no order of discovery gives
    legend = Legend(plan.map(1), plan.scale, None, lambda: (told, set()))
    legend.grow(plan.scout())
    shown = {row["period"]: row["hue"] for row in legend.table()}
    known = {period: hue for period, hue in shown.items() if period in on_branches}
    assert known
    assert known == {period: hues[period] + 7 for period in known}


def test_a_map_without_forcing_is_that_of_basins():
    belt = sl.models.belt_stribeck()
    axes = {"x": (-3.0, 3.0), "v": (-1.0, 1.0)}
    desk = Desk(opening_of(belt, None, axes=axes), 2)
    screen = Screen(desk, axes, (16, 16))
    ds = basins(axes, (16, 16), belt)
    rows = screen.end["attractors"]
    assert [row["kind"] for row in rows] == ds["attractor_type"].values.tolist()
    np.testing.assert_array_equal(screen.label, ds["basin"].values)


def test_old_maps_make_room(monkeypatch):
    monkeypatch.setattr(maps, "KEPT", 3 * 400 * (maps.CELL + 2 * 8))
    kept = maps.KeptMaps()
    plans = [
        pipeline.basin_plan(
            RIG, {"x": (-1e-3, n * 1e-3, 20), "v": (-1, 1, 20)}, None, sl.Taylor(), 9, None
        )
        for n in range(1, 6)
    ]
    for plan in plans:
        kept.put(maps.KeptMap(plan, labels.Settling.empty(400, 2), None))
    assert [kept.get(plan) is not None for plan in plans] == [False, False, True, True, True]


def test_agreement_of_two_methods_is_that_of_compare():
    rig, size, found = sl.models.delangre("a", force="1.5 N", frequency="10 Hz"), (32, 16), []
    desk = Desk(opening_of(rig, None, axes=BOX), 2)
    box = {name: list(ends) for name, ends in BOX.items()}
    question = {"id": 1, "axes": box, "size": list(size), "against": "ODE45"}
    desk.answer(
        question_of("agreement", question), lambda *one: found.append(unpacked(packed(*one)))
    )
    axes = {name: (*ends, n) for (name, ends), n in zip(BOX.items(), size, strict=True)}
    rough = sl.basins(rig, **axes, method=sl.ODE45(1e-4, 1e-7))
    theirs = sl.compare(basins(size=size, system=rig), rough)
    told = [one for one in found if one[0]["kind"] == "agreement"]
    assert [head["level"] for head, _ in told] == [2, 1, 1]
    assert [head["done"] for head, _ in told] == [False, False, True]
    finished = told[-1][1]["agreement"]
    np.testing.assert_array_equal(finished, theirs["agreement"].values.ravel(), strict=True)
    assert {0, 1} <= set(finished.tolist())
    assert f"{100 * theirs.attrs['agreement']:.3g} %" in told[-1][0]["words"][0]
    coarse = told[0][1]["agreement"]
    every = theirs["agreement"].values[::2, ::2].ravel()
    assert (coarse == every)[coarse >= 0].all()
    assert (coarse >= 0).mean() > 0.5


@pytest.mark.parametrize("shape", [(16, 16), (70, 200), (400, 400)])
def test_cells_are_two_bytes_each_and_come_back(shape):
    random = np.random.default_rng(4127)
    for share in (0.0, 0.01, 0.3, 1.0):
        cells = np.flatnonzero(random.uniform(size=shape[0] * shape[1]) < share)
        label = random.integers(-5, 127, len(cells)).astype("i1")
        age = random.choice(np.array([*range(12), 255], "u1"), len(cells))
        label[:-1000] = label[:-1000] % 7
        packed_ones = packed_cells(cells, label, age, shape[1])
        back = unpacked_cells(packed_ones, shape[1])
        order = np.argsort(back["cell"])
        np.testing.assert_array_equal(back["cell"][order], cells)
        np.testing.assert_array_equal(back["label"][order], label)
        np.testing.assert_array_equal(back["age"][order], age)
        if share >= 0.3:
            assert packed_ones["step"].nbytes < 1.05 * len(cells)
