"""The branches between the responses of a grid: against `sl.branches`, closed forms, and what their
events are by definition.
"""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.branches.tracing import trace
from saltus.analysis.responses import arcs
from saltus.errors import ParameterError

RIG = sl.models.delangre("b", force="4 N")
BOX = {"x": ("-5 mm", "5 mm"), "v": ("-1 m/s", "1 m/s")}
BAND = (15.0, 17.0)


@pytest.fixture(scope="module")
def diagram():
    return sl.frequency_response(RIG, (*BAND, 9), "random 10", box=BOX, progress=False)


@pytest.mark.slow
def test_every_event_is_one_of_the_branches_followed_through_instability(diagram):
    whole = sl.branches(RIG, {"frequency": BAND}, diagram, switch=(), progress=False)
    assert diagram.sizes["event"] > 8
    for kind, at in zip(diagram.event_kind.values, diagram.event_frequency.values, strict=True):
        same = whole.event_frequency.values[whole.event_kind.values == kind]
        assert np.abs(same - at).min() < 1e-10 * (BAND[1] - BAND[0])


def test_every_response_that_repeats_lies_on_a_branch_that_passes_its_value(diagram):
    of, kind = diagram.response_branch.values, diagram.response_type.values
    assert (of[kind == "periodic"] < diagram.sizes["branch"]).all()
    assert (of[kind != "periodic"] >= diagram.sizes["branch"]).all()
    for branch, value, period in zip(
        of, diagram.response_frequency.values, diagram.response_period.values, strict=True
    ):
        if period:
            mine = diagram.point_frequency.values[diagram.point_branch.values == branch]
            assert mine.min() <= value <= mine.max()
            assert diagram.branch_periods.values[branch] == period


def ends_checked(diagram):
    """How many branches end with the event at which stability is lost, each asserted."""
    points, found = diagram.point_frequency.values, 0
    for branch in range(diagram.sizes["branch"]):
        mine = np.flatnonzero(diagram.point_branch.values == branch)
        events = diagram.event_frequency.values[diagram.event_branch.values == branch]
        for side, end in ((0, "begin"), (-1, "end")):
            if diagram[f"branch_{end}"].values[branch] == "unstable":
                assert points[mine[side]] == events[side]
                found += 1
        own = diagram.point_multiplier_real.values + 1j * diagram.point_multiplier_imag.values
        assert np.nanmax(np.abs(own[mine])) < 1.0 + 1e-9
    return found


def test_a_branch_ends_with_the_orbit_at_which_stability_is_lost(diagram):
    assert ends_checked(diagram) > 4


def test_multipliers_at_events_are_those_that_define_them(diagram):
    own = diagram.event_multiplier_real.values + 1j * diagram.event_multiplier_imag.values
    for kind, place in (("fold", 1.0), ("period_doubling", -1.0)):
        mine = diagram.event_kind.values == kind
        assert mine.any()
        np.testing.assert_allclose(np.nanmin(np.abs(own[mine] - place), axis=1), 0.0, atol=1e-6)


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def soft(t, x, v, *, stiffness=10.0, gap=0.01, spring=0.0, w=1.0):
    """A forced linear oscillator that comes to touch a spring of no force."""
    force = sl.cos(w * t) - 0.2 * v - stiffness * x - spring * sl.max(x - gap, 0)
    return v, force


@pytest.mark.slow
def test_a_branch_over_four_decades_has_its_closed_form():
    """The amplitude is 1/sqrt((k - 1)^2 + 0.04); the gap is touched where it is 0.01."""
    found = sl.bifurcation_diagram(soft, {"stiffness": (0.03, 300.0, 9, "log")}, progress=False)
    assert (found.response_branch.values == 0).all()
    assert found.event_kind.values.tolist() == ["graze"]
    assert found.event_stiffness.item() == pytest.approx(1 + np.sqrt(1e4 - 0.04), rel=1e-11)
    values = found.point_stiffness.values
    exact = 1 / np.sqrt((values - 1) ** 2 + 0.04)
    np.testing.assert_allclose(found.point_peak.values, exact, rtol=1e-9)
    assert len(values) < 200
    alone = sl.branches(soft, {"stiffness": (0.03, 300.0)}, progress=False)
    assert alone.event_stiffness.item() == pytest.approx(found.event_stiffness.item(), rel=1e-11)


def test_equilibria_over_three_decades_have_their_hopf_point_where_the_closed_form_says():
    @sl.system(states="x y")
    def planar(t, x, y, *, gain=1.0):
        r = x * x + y * y
        return (gain - 50.0) * x - y - r * x, x + (gain - 50.0) * y - r * y

    found = sl.bifurcation_diagram(
        planar, {"gain": (0.1, 40.0, 5, "log")}, {"x": 0.3, "y": 0.1}, periods=400, progress=False
    )
    assert found.event_kind.values.tolist() == []
    assert found.response_branch.values.tolist() == 5 * [0]
    whole = sl.branches(planar, {"gain": (0.1, 100.0)}, {"x": 0.3, "y": 0.1}, progress=False)
    assert whole.event_gain.values[whole.event_kind.values == "hopf"] == pytest.approx([50.0])


def test_ctrl_c_hands_out_the_branches_that_are_done():
    shares = []

    def press(share):
        shares.append(share)
        if share > 0.9:  # some branches are followed
            raise KeyboardInterrupt

    with pytest.raises(sl.Interrupted) as stop:
        sl.frequency_response(RIG, (*BAND, 17), "random 10", box=BOX, progress=press)
    part = stop.value.partial
    assert (part.type.values != "not_computed").all()
    assert part.sizes["branch"] > 0
    assert part.sizes["event"] > 0


def test_ctrl_c_while_branches_are_followed_leaves_those_that_are_done_whole(monkeypatch):
    def stopped(plan, seeds, branches, progress=None):
        trace(plan, seeds[:3], branches)
        raise KeyboardInterrupt

    monkeypatch.setattr(arcs, "trace", stopped)
    with pytest.raises(sl.Interrupted) as stop:
        sl.frequency_response(RIG, (*BAND, 9), "random 10", box=BOX, progress=False)
    part = stop.value.partial
    assert part.sizes["branch"] > 0
    ends_checked(part)
    assert (part.response_branch.values < part.sizes["branch"]).any()


@pytest.mark.slow
def test_responses_of_an_inexact_method_are_on_the_branches_of_the_exact_orbits(diagram):
    starts = {"x": diagram.start_x.values[:4], "v": diagram.start_v.values[:4]}
    values = diagram.frequency.values[::4]
    found = [
        sl.frequency_response(RIG, values, starts, method=one, progress=False)
        for one in (sl.Taylor(), sl.ODE45(1e-8, 1e-11))
    ]
    assert "point_branch" not in found[1]
    for value in values:
        pairs = set()
        for cell in range(4):
            both = [one.response_of.sel(frequency=value).values[cell] for one in found]
            if min(both) < 0 or 0 in [
                one.response_period.values[i] for one, i in zip(found, both, strict=True)
            ]:
                continue
            pairs.add(
                tuple(
                    int(one.response_branch.values[i]) for one, i in zip(found, both, strict=True)
                )
            )
        assert len({a for a, _ in pairs}) == len({b for _, b in pairs}) == len(pairs)


def test_where_no_branch_can_be_followed_responses_are_matched_and_the_reason_is_said():
    play, vary = sl.models.play(), {"frequency": (0.75, 1.3, 4)}
    found = sl.bifurcation_diagram(play, vary, periods=300, progress=False)
    assert found.response_branch.values.tolist() == 4 * [0]
    assert "switches at times that depend on a parameter" in found.attrs["branches_refused"]
    assert "branches are matched by where responses lie: play switches" in sl.describe(found)
    with pytest.raises(ParameterError, match="switches at times that depend"):
        sl.bifurcation_diagram(play, vary, periods=300, unstable=True, progress=False)


# -- budgets ---------------------------------------------------------------------------------------
def test_ctrl_c_within_a_branch_hands_out_its_points():
    shares = []

    def press(share):
        shares.append(share)
        if len({one for one in shares if one > 0.8}) == 5:  # within the first branch
            raise KeyboardInterrupt

    with pytest.raises(sl.Interrupted) as stop:
        sl.frequency_response(RIG, (*BAND, 2), "random 10", box=BOX, progress=press)
    part = stop.value.partial
    assert "interrupted" in {*part.branch_begin.values.tolist(), *part.branch_end.values.tolist()}
    assert part.sizes["point"] > 4
    every = {"frequency": part.point_frequency.values}
    at = {name: part[f"point_{name}"].values[:, 0] for name in ("x", "v")}
    periods = part.branch_periods.values[part.point_branch.values]
    for n in np.unique(periods).tolist():
        mine = periods == n
        ends = [
            sl.simulate(RIG.with_values(frequency=f), (x, v), periods=n, samples=1, progress=False)
            for f, x, v in zip(every["frequency"][mine], at["x"][mine], at["v"][mine], strict=True)
        ]
        assert [float(one.end_x) for one in ends] == pytest.approx(at["x"][mine], abs=1e-11)


def test_the_bar_moves_within_a_branch_and_never_back():
    shares = []
    sl.frequency_response(RIG, (*BAND, 2), "random 4", box=BOX, progress=shares.append)
    following = [one for one in shares if 0.8 < one < 0.95]
    assert len(following) > 50
    assert (np.diff(following) >= 0).all()


def test_what_a_budget_leaves_is_said(monkeypatch):
    monkeypatch.setattr(arcs, "MOST_WORK", 100.0)
    found = sl.frequency_response(RIG, (*BAND, 5), "random 10", box=BOX, progress=False)
    ends = {*found.branch_begin.values.tolist(), *found.branch_end.values.tolist()}
    assert "points" in ends
    on = found.response_branch.values < found.sizes["branch"]
    left = found.attrs["responses_not_followed"]
    assert left == (~on & (found.response_type.values == "periodic")).sum() > 0
    assert f"the branches of {left} responses weren't followed" in sl.describe(found)
    monkeypatch.setattr(arcs, "MOST_WORK", np.inf)
    monkeypatch.setattr(arcs, "MOST_UNKNOWNS", 2)
    found = sl.frequency_response(RIG, (*BAND, 5), "random 10", box=BOX, progress=False)
    longer = found.response_period.values > 1
    assert found.attrs["responses_not_followed"] == longer.sum() > 0
