"""The desk: its numbers are those of the public functions, and bad input gets a sentence."""

import random
import warnings
from dataclasses import replace

import numpy as np
import pytest

import saltus as sl
from explorer_systems import van_der_pol
from mad_page import mad_message
from saltus.errors import SaltusError
from saltus.explore import motion as motions
from saltus.explore import orbits, responses
from saltus.explore.attractors import Legend
from saltus.explore.desk import Desk, Models
from saltus.explore.frames import packed, unpacked
from saltus.explore.kept_responses import NO_HUE, crossings, stretches
from saltus.explore.opening import Opening, opening_of
from saltus.explore.orbits import settled
from saltus.explore.questions import QuestionError, question_of, read
from saltus.explore.shown import shown
from saltus.explore.studies import opening_of_study
from saltus.interrupt import Interrupted, Stop, check_stop

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")
BOX = {"x": (-5e-3, 5e-3), "v": (-1.0, 1.0)}


def desk_of(system=RIG, axes=BOX):
    opening = opening_of(system, None, axes=axes) if axes else opening_of(system)
    return Desk(opening, 1)


def asked(desk, ask, **fields):
    """All answers to a question, as a page has them."""
    found = []
    question = question_of(ask, {"id": 1, **fields})
    desk.answer(question, lambda *answer: found.append(unpacked(packed(*answer))))
    return found


def one(desk, ask, **fields):
    (answer,) = asked(desk, ask, **fields)
    return answer


@pytest.fixture(scope="module")
def desk():
    return desk_of()


# -- motions ---------------------------------------------------------------------------------------
def test_a_motion_is_that_of_simulate(desk):
    head, arrays = one(
        desk, "motion", start={"x": "1 mm", "v": 0}, values={"force": "3.5 N"}, periods=20
    )
    run = sl.simulate(RIG.with_values(force=3.5), ("1 mm", 0), periods=20)
    assert (head["t0"], head["count"], head["status"]) == (0.0, run.sizes["time"], "ok")
    assert head["values"] == {**RIG.values, "force": 3.5}
    times = head["t0"] + head["dt"] * np.arange(head["count"])
    np.testing.assert_allclose(times, run["time"].values, rtol=1e-12)
    for name in ("x", "v"):
        np.testing.assert_array_equal(arrays[f"sample:{name}"], run[name].values.astype("f4"))
        np.testing.assert_array_equal(
            arrays[f"contact:{name}"], run[f"contact_{name}"].values.astype("f4")
        )
    np.testing.assert_array_equal(arrays["mode"], run["mode"].values)
    for name in ("time", "direction"):
        np.testing.assert_array_equal(arrays[f"contact_{name}"], run[f"contact_{name}"].values)
    np.testing.assert_array_equal(arrays["contact_error"], run["contact_time_error"].values)
    guards = [guard.name for guard in RIG.guards]
    assert [guards[i] for i in arrays["contact_guard"]] == run["contact_guard"].values.tolist()
    about, _ = one(desk, "about")
    kinds = [about["contact_kinds"][i] for i in arrays["contact_kind"]]
    assert kinds == run["contact_kind"].values.tolist()
    assert {gap["guard"]: gap["value"] for gap in head["gaps"]} == {
        "lower_gap": 0.0, "upper_gap": 4e-4,
    }  # fmt: skip


def test_a_click_is_a_small_frame(desk):
    question = question_of("motion", {"id": 1, "start": [1e-3, 0.0]})
    sizes = []
    desk.answer(question, lambda *answer: sizes.append(len(packed(*answer))))
    assert sizes[0] <= 120_000


def test_of_a_long_motion_all_extremes_are_sent_and_the_last_periods_in_full(desk, monkeypatch):
    monkeypatch.setattr(motions, "KEPT", 10)
    monkeypatch.setattr(motions, "COLUMNS", 300)
    head, arrays = one(desk, "motion", start=[3e-3, 0.0], periods=40, samples=100)
    run = sl.simulate(RIG, (3e-3, 0.0), periods=40, samples=100)
    x = run["x"].values.astype("f4")
    np.testing.assert_array_equal(arrays["sample:x"], x[3000:])
    assert head["t0"] == run["time"].values[3000]
    edges = np.searchsorted(run["time"].values, arrays["column_time"])
    parts = np.split(x, edges[1:])
    np.testing.assert_array_equal(arrays["least:x"], [part.min() for part in parts])
    np.testing.assert_array_equal(arrays["most:x"], [part.max() for part in parts])
    assert len(parts) == 300


def test_another_method_parts_where_the_first_sample_says_so(desk):
    values = {"force": 3.0}
    head, arrays = one(desk, "motion", start=[1e-3, 0.0], values=values, against="ODE45")
    told = head["against"]
    ours, theirs = arrays["sample:x"], arrays["other:x"]
    apart = np.abs(ours - theirs) > 0.01 * np.ptp(ours)
    apart |= np.abs(arrays["sample:v"] - arrays["other:v"]) > 0.01 * np.ptp(arrays["sample:v"])
    first = head["t0"] + head["dt"] * int(np.argmax(apart))
    assert told["parts"] == pytest.approx(first, abs=1e-9)
    assert arrays["contact_time"][told["contact"]] <= first
    assert "part by 1% of the range" in told["words"]
    same, _ = one(desk, "motion", start=[1e-3, 0.0], periods=5, against="Taylor")
    assert same["against"]["parts"] is None


def test_a_motion_that_fails_is_drawn_as_far_as_it_went():
    grows = sl.system(states="x y")(lambda t, x, y, *, c=1.0: (x * x, -c * y))
    desk = Desk(Opening(grows, sl.Taylor(), {"x": (-1, 1), "y": (-1, 1)}, turn=0.05), 1)
    head, arrays = one(desk, "motion", start=[2.0, 1.0], periods=20)  # x = 2/(1 - 2 t)
    assert head["status"] == "nonfinite"
    assert head["words"][0].startswith("It ended at 500 ms: the state")
    times = head["dt"] * np.arange(head["count"])
    reached = times < 0.499
    exact = 2 / (1 - 2 * times[reached])
    np.testing.assert_allclose(arrays["sample:x"][reached], exact, rtol=1e-6)
    assert not np.isfinite(arrays["sample:x"][times > 0.501]).any()


def test_a_motion_can_be_stopped(desk):
    stop = Stop()
    stop.set()
    with stop, pytest.raises(Interrupted):
        asked(desk, "motion", start=[1e-3, 0.0], periods=100_000, samples=2)


# -- orbits ----------------------------------------------------------------------------------------
def test_a_start_settles_to_what_attractors_says(desk):
    start = {"x": "1 mm", "v": 0}
    found = sl.attractors(RIG, {"x": 1e-3, "v": 0.0})
    for _ in range(2):  # found, then known
        head, arrays = one(desk, "settle", start=start)
        told = head["attractor"]
        assert told["period"] == found["attractor_period"].item()
        assert told["peak"]["x"] == pytest.approx(found["attractor_peak"].item(), rel=1e-9)
        assert told["margin"] == pytest.approx(found["attractor_margin"].item(), rel=1e-6)
        assert head["settles"] == found["periods_to_settle"].item() or head["settles"] > 0
        x = arrays["sample:x"]
        assert x[0] == pytest.approx(x[-1], abs=1e-9)  # a whole period
        assert np.abs(x).max() == pytest.approx(told["peak"]["x"], rel=1e-3)
    again, _ = one(desk, "orbit", attractor=told["key"])
    assert again["multipliers"] == told["multipliers"]


def test_a_row_of_the_legend_stays_with_its_attractor_when_ids_change(desk):
    """What is found later may sort before it, and join what nobody had lost."""
    plan = desk.plan_of(RIG, desk.opening.method)
    known = Legend(plan.map(1), plan.scale)
    for x in (1e-3, 3e-3):
        settled(known, [x, 0.0])
    peaks = [row["peak"] for row in known.table()]
    assert len(peaks) > 1
    backwards = replace(known.found, orbits=known.found.orbits[::-1])
    assert not known.grow(backwards)
    assert [row["peak"] for row in known.table()] == peaks


@pytest.mark.parametrize(("damping", "words"), [(0.0, "Nothing damps"), (-0.5, "negative damping")])
def test_where_nothing_attracts_that_is_said_at_once(desk, damping, words):
    values = {"damping_ratio": damping}
    head, _ = one(desk, "settle", start=[1e-3, 0.0], values=values)
    assert words in head["words"][0]
    axes = {"x": [-1e-3, 1e-3], "v": [-0.1, 0.1]}
    for ask in (
        {"ask": "map", "axes": axes, "size": [40, 40]},
        {"ask": "responses", "parameter": "frequency", "range": [14, 16]},
    ):
        with pytest.raises(QuestionError, match=words):
            asked(desk, **ask, values=values)


def test_a_start_that_takes_too_long_is_left(desk, monkeypatch):
    def wanders(*_):
        while True:
            check_stop()

    monkeypatch.setattr(orbits, "settled", wanders)
    monkeypatch.setattr(orbits, "WITHIN", 0.01)
    head, _ = one(desk, "settle", start=[1e-3, 0.0])
    assert head["attractor"] is None
    assert "hasn't settled within 0.01 s" in head["words"][0]
    monkeypatch.setattr(orbits, "WITHIN", 60.0)
    stop = Stop()
    stop.set()
    with stop, pytest.raises(Interrupted):
        one(desk, "settle", start=[1e-3, 0.0])


def test_a_motion_without_end_is_drawn_as_far_as_its_budget(desk, monkeypatch):
    monkeypatch.setattr(motions, "MOST_MET", 2000)
    head, arrays = one(desk, "motion", start=[0.0, 0.0], values={"damping_ratio": -0.5})
    assert head["status"].startswith("budget")
    assert "It ended at" in head["words"][0]
    assert head["contacts"] <= motions.MOST_MET
    assert np.isfinite(arrays["sample:x"][:100]).all()


@pytest.fixture(scope="module")
def found():
    """Branches of the orbit that a start settles to, with a fold."""
    return sl.branches(RIG, {"frequency": (14.9, 15.5)}, sl.attractors(RIG, {"x": 1e-3, "v": 0.0}))


def test_an_orbit_is_tracked_to_where_branches_has_it_and_lost_at_the_fold(desk, found):
    head, _ = one(desk, "settle", start={"x": "1 mm", "v": 0})
    key = head["attractor"]["key"]
    mine = found["branch_periods"].values == 3
    points = mine[found["point_branch"].values] & (found["point_stable"].values == 1)
    frequency = found["point_frequency"].values[points]
    at = int(np.argmin(np.abs(frequency - 15.05)))
    now, arrays = one(desk, "track", key=key, source={}, values={"frequency": frequency[at]})
    assert now["lost"] is None
    assert now["stable"]
    peak = found["point_peak"].values[points][at]
    assert np.abs(arrays["sample:x"]).max() == pytest.approx(peak, rel=1e-3)
    fold = found["event_frequency"].values[found["event_kind"].values == "fold"]
    lost, _ = one(desk, "track", key=key, source={}, values={"frequency": 15.5})
    assert lost["lost"].startswith("folded between")
    assert np.abs(fold - lost["values"]["frequency"]).min() < 2e-3


def test_a_hue_belongs_to_one_side_of_a_fold(desk, found):
    three = one(desk, "settle", start={"x": "1 mm", "v": 0})[0]["attractor"]["hue"]
    desk.keep_responses(found)
    ((head, arrays),) = asked(
        desk, "responses", parameter="frequency", range=[14.9, 15.5], quantity="x"
    )
    assert head["done"]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(found["point_frequency"].values))) != 0) + 1
    fold = found["event_point"].values[found["event_kind"].values == "fold"]
    assert len(fold)
    for point in fold.tolist():
        near = int(turns[np.argmin(np.abs(turns - point))])
        assert abs(near - point) <= 1
        sides = arrays["point_hue"][near - 1], arrays["point_hue"][near + 2]
        assert sides[0] != sides[1]
    stable = arrays["point_stable"] == 1
    here = np.abs(arrays["point_parameter"] - 15.0) < 0.02
    assert three in arrays["point_hue"][stable & here & (arrays["point_period"] == 3)]
    far = np.abs(np.arange(len(stable))[:, None] - turns).min(axis=1) > 2
    assert NO_HUE not in arrays["point_hue"][stable & far]
    number, way = stretches(found), found["point_frequency"].values
    coloured = [i for i in set(number.tolist()) if arrays["point_hue"][number == i][0] != NO_HUE]
    ends = {i: (way[number == i].min(), way[number == i].max()) for i in coloured}
    for i, (low, high) in ends.items():  # where two exist at one value, their hues differ
        beside = [j for j, (a, b) in ends.items() if j != i and a <= high and b >= low]
        mine = arrays["point_hue"][number == i][0]
        assert mine not in {arrays["point_hue"][number == j][0] for j in beside}


def test_responses_are_branches_and_their_points_are_orbits(desk, monkeypatch):
    monkeypatch.setattr(responses, "STARTS", 1)
    monkeypatch.setattr(responses, "VALUES", 1)
    monkeypatch.setattr(responses, "LOOKED", 1)
    one(desk, "settle", start={"x": "1 mm", "v": 0})
    question = {"ask": "responses", "parameter": "frequency", "range": [14.5, 15.1]}
    head, arrays = asked(desk, **question)[-1]
    assert head["done"]
    told, fresh = asked(desk_of(), **question)[-1]  # nothing was asked before
    assert told["events"] == head["events"]
    for name in fresh.keys() - {"point_hue"}:
        np.testing.assert_array_equal(arrays[name], fresh[name])
    unstable = np.flatnonzero(arrays["point_stable"] == 0)
    for point in (int(unstable[0]), 0):
        orbit, samples = one(desk, "orbit", responses=head["key"], point=point)
        assert orbit["stable"] == bool(arrays["point_stable"][point])
        assert orbit["values"]["frequency"] == arrays["point_parameter"][point]
        x = samples["sample:x"]
        assert x[0] == pytest.approx(x[-1], abs=2e-7)
        assert np.abs(x).max() == pytest.approx(arrays["point_peak"][point], rel=1e-3)
        outside = [np.hypot(*pair) > 1 for pair in orbit["multipliers"]]
        assert any(outside) != orbit["stable"]
    event, _ = one(desk, "orbit", responses=head["key"], event=0)
    assert event["event"] == head["events"][0]
    again = asked(desk, **question)
    assert [one[0]["key"] for one in again] == [head["key"]]  # kept
    view = {name: question[name] for name in ("parameter", "range")}
    view = {"responses": {**view, "quantity": "x"}}
    starts = np.stack([*shown(desk, view)[0].starts.values()], axis=1)
    ds = desk.responses.get(head["key"])[1]
    both = [RIG.with_values(frequency=value) for value in (14.8, 15.0)]
    on = [one.points[0] for here in both for _, one in crossings(ds, here)]
    assert len(on) >= 2  # a study that is saved begins on each of them, once
    assert len(np.unique(starts, axis=0)) == len(starts)
    five = one(desk, "settle", start=on[-1].tolist())[0]["attractor"]
    assert five["period"] == 5
    assert set(arrays["point_hue"][arrays["point_stable"] == 1].tolist()) == {five["hue"]}
    assert all(np.abs(starts - point).max(axis=1).min() < 1e-12 for point in on)


# -- other systems ---------------------------------------------------------------------------------
def test_a_system_without_forcing_has_limit_cycles():
    belt = desk_of(sl.models.belt_stribeck(), None)
    about, _ = one(belt, "about")
    assert not about["forced"]
    head, arrays = one(belt, "settle", start=[2.0, 0.0])
    told = head["attractor"]
    assert (told["kind"], told["period"]) == ("limit_cycle", 0)
    x = arrays["sample:x"]
    assert head["dt"] * (len(x) - 1) == pytest.approx(told["seconds"], rel=1e-9)
    assert x[0] == pytest.approx(x[-1], abs=1e-5)
    now, _ = one(belt, "track", key=told["key"], source={}, values={"mass": 1.01})
    assert now["lost"] is None


@pytest.mark.slow
def test_a_branch_of_limit_cycles_has_the_hue_of_its_attractor():
    desk = desk_of(van_der_pol, None)
    told = one(desk, "settle", start=[1.0, 0.0])[0]["attractor"]
    desk.keep_responses(sl.branches(van_der_pol, {"mu": (0.9, 1.1)}, [[1.0, 0.0], [0.0, 0.0]]))
    head, arrays = one(desk, "responses", parameter="mu", range=[0.9, 1.1], quantity="x")
    kinds = np.array([row["kind"] for row in head["branches"]])[arrays["point_branch"]]
    assert set(arrays["point_hue"][kinds == "limit_cycle"].tolist()) == {told["hue"]}
    assert set(arrays["point_hue"][kinds == "equilibrium"].tolist()) == {NO_HUE}  # it repels


def test_a_system_without_forcing_has_equilibria():
    swings = sl.system(states="x v")(lambda t, x, v, *, k=1.0, c=0.2: (v, -k * x - c * v))
    desk = desk_of(swings, None)
    head, _ = one(desk, "settle", start=[0.3, 0.0])
    told = head["attractor"]
    assert told["kind"] == "equilibrium"
    assert told["eigenvalues"]
    np.testing.assert_allclose(sorted(told["multipliers"])[0], [-0.1, -np.sqrt(0.99)], rtol=1e-9)
    now, _ = one(desk, "track", key=told["key"], source={}, values={"k": 2.0})
    assert now["name"] == "equilibrium"
    np.testing.assert_allclose(sorted(now["multipliers"])[0], [-0.1, -np.sqrt(1.99)], rtol=1e-9)


def test_a_structure_shows_its_sensors():
    stiffness = 1e4 * np.array([[2.0, -1.0], [-1.0, 1.0]])
    rig = sl.structure(
        np.eye(2), stiffness, damping_ratio=0.02, modes=2, names=["w1", "w2"],
        frequency="12 Hz", forces=[sl.Force("w2", "5 N")], sensors={"tip": "w2"},
        contacts=[sl.Contact("w2", stiffness="50 kN/m", gap="1 mm")],
    )  # fmt: skip
    desk = desk_of(rig, None)
    about, _ = one(desk, "about")
    assert "tip" in about["panels"]["history"]
    assert about["panels"]["response"]["quantity"] == rig.outputs.names[0]
    assert set(about["axes"]) <= set(rig.states)
    head, arrays = one(desk, "motion", start={"tip": "2 mm"}, periods=5)
    run = sl.simulate(rig, {"tip": "2 mm"}, periods=5)
    np.testing.assert_array_equal(arrays["sample:tip"], run["tip"].values.astype("f4"))
    assert head["contacts"] == run.sizes["contact"] > 0
    gap = {"guard": rig.guards[0].name, "quantity": "tip", "value": 1e-3}
    assert head["gaps"] == [gap]  # the contact's deflection is the sensor's


# -- bad input -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("ask", "fields", "field", "words"),
    [
        ("motion", {"start": [1, 2, 3]}, "start", "2 numbers"),
        ("motion", {"start": {"x": 0}}, "start", "gives no 'v'"),
        ("motion", {"start": {"y": 0, "v": 0}}, "start", "no state 'y'"),
        ("motion", {"start": {"x": "1 kg", "v": 0}}, "start", "wrong unit"),
        ("motion", {"start": [0, 0], "values": {"force": "3 m"}}, "values.force", "wrong unit"),
        ("motion", {"start": [0, 0], "values": {"farce": 3}}, "values.farce", "Did you mean"),
        ("motion", {"start": [0, 0], "values": {"mass": 0}}, "values.mass", "positive"),
        ("motion", {"start": [0, 0], "method": "ode"}, "method", "no method 'ode'"),
        ("motion", {"start": [0, 0], "against": "x"}, "against", "no method"),
        ("motion", {"start": [0, 0], "quantities": ["y"]}, "quantities", "no quantity"),
        ("motion", {"start": [0, 0], "t_end": 1e308}, "t_end", "a time from 0"),
        ("motion", {"start": [0, 0], "t_end": "3 m"}, "t_end", "wrong unit"),
        ("map", {"axes": {"x": [1, 0], "v": [0, 1]}, "size": [16, 16]}, "axes", "ascend"),
        ("map", {"axes": {"x": [0, 0], "v": [0, 1]}, "size": [16, 16]}, "axes", "ascend"),
        ("map", {"axes": {"y": [0, 1], "v": [0, 1]}, "size": [16, 16]}, "axes", "no state"),
        ("map", {"axes": {"x": ["1 s", 1], "v": [0, 1]}, "size": [16, 16]}, "axes", "wrong unit"),
        ("responses", {"parameter": "mss", "range": [1, 2]}, "parameter", "Did you mean"),
        ("responses", {"parameter": "mass", "range": [2, 1]}, "range", "ascend"),
        ("orbit", {"attractor": 99}, "attractor", "no attractor 99"),
        ("orbit", {"responses": 77, "point": 0}, "point", "kept"),
        ("track", {"source": {}, "key": 99}, "key", "no orbit"),
    ],
)
def test_bad_input_gets_a_sentence(desk, ask, fields, field, words):
    with pytest.raises(QuestionError) as refused:
        asked(desk, ask, **fields)
    assert words in str(refused.value)
    assert refused.value.field == field


def test_no_question_that_can_be_read_upsets_the_desk(desk):
    draw, answered, sentences = random.Random(831), 0, []
    for number in range(400):
        try:
            text = mad_message(draw, number)
            question = read(text if isinstance(text, str) else text.decode("latin"))
        except QuestionError:
            continue
        if question.ask in ("map", "responses"):  # long answers
            continue
        try:
            with np.errstate(all="ignore"), warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)
                desk.answer(question, lambda *answer: packed(*answer))
            answered += 1
        except SaltusError as error:
            sentences.append(str(error))
    assert answered > 20
    assert len(sentences) > 20
    assert not [one for one in sentences if "\n" in one or not one.endswith(".")]


def test_without_a_system_there_are_models_to_choose():
    (answer,) = asked(Models(), "about")
    assert answer[0]["system"] is None
    assert [one["name"] for one in answer[0]["models"]] == list(sl.models.MODELS)
    with pytest.raises(QuestionError, match="choose a model"):
        asked(Models(), "motion", start=[0, 0])


@pytest.mark.parametrize("name", ["chain", "double_scroll", "shaken_belt", "thermostat", "play"])
def test_every_kind_of_model_opens_with_a_box_that_holds_its_motion(name):
    opening = opening_of(sl.models.find(name)())
    assert isinstance(opening, Opening)
    for low, high in opening.axes.values():
        assert 0 < high < 1e4
        assert low == -high
    about, _ = one(Desk(opening, 1), "about")
    for row in about["parameters"]:
        assert row["low"] <= row["value"] <= row["high"] or row["value"] == 0


@pytest.mark.parametrize(
    ("name", "axis", "side", "place"),
    [("impact_oscillator", "x", 1, 1.0), ("rocking_block", "tilt", 0, 0.0)],
)
def test_a_map_ends_at_a_rigid_stop(name, axis, side, place):
    ends = opening_of(sl.models.find(name)()).axes[axis]
    assert ends[side] == place
    assert ends[1 - side] == pytest.approx(-20.0 if side else 5.0)


def test_a_study_with_a_record_opens_with_all_of_its_motion(tmp_path):
    chain = 900.0 * (2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    np.savez(tmp_path / "chain.npz", M=np.eye(4), K=chain, names=["w1", "w2", "w3", "w4"])
    times = np.linspace(0, 3, 61)
    np.savetxt(tmp_path / "quake.csv", np.column_stack([times, np.sin(9 * times)]), delimiter=",",
        header="time [s],acceleration [m/s^2]", comments="")  # fmt: skip
    (tmp_path / "study.toml").write_text(STUDY)
    opening = opening_of_study(tmp_path / "study.toml")
    slowest = 2 * np.pi / (2 * 30.0 * np.sin(np.pi / 10))
    assert opening.turn == pytest.approx(slowest, rel=0.03)  # of two digits
    assert opening.view["motion"]["periods"] == np.ceil(4 / opening.turn)
    assert opening.method == sl.Modal()
    largest = np.abs(sl.simulate(opening.system, t_end=4.0)["tip"].values).max()
    assert largest < opening.box["tip"][1] < 30 * largest


STUDY = """
[study]
name = "a record"

[system.structure]
mass = "chain.npz"
modes = 4
damping_ratio = "1 %"
base = { direction = "w", amplitude = "quake(t)" }
sensors = { tip = "w4" }

[system.tables]
quake = { file = "quake.csv", kind = "spline" }

[simulate]
t_end = "4 s"
"""
