"""Steady responses against truth: the linear oscillator, published orbits, plain runs, mirror
twins, bisected bifurcations.
"""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.closed.orbits import find_orbits
from saltus.flow.maps import Stroboscope

ORBITS = {
    row["name"]: row
    for row in csv.DictReader((Path(__file__).parents[1] / "reference" / "orbits.csv").open())
}
#: Exponent of a spiral: half of the rate -2 zeta omega_n at which areas shrink [1/s].
SPIRAL = -0.942477796076938


def rig_of(name):
    row = ORBITS[name]
    return sl.models.delangre(
        "c", force=float(row["p_N"]), frequency=float(row["f_Hz"]),
        contact_stiffness=float(row["Kc_N_per_m"]),
        lower_gap=float(row["j1_m"]), upper_gap=float(row["j2_m"]),
    )  # fmt: skip


def start_of(name):
    return np.array([float(ORBITS[name]["x0_m"]), float(ORBITS[name]["v0_m_per_s"])])


def points(ds, response):
    n = max(int(ds.response_period[response]), 1)
    return np.stack(
        [ds[f"response_{name}"].values[response, :n] for name in ds.attrs["states"].split()], axis=1
    )


@pytest.fixture(scope="module")
def linear():
    """The rig without contact and without cubic spring, from three starts."""
    rig = sl.models.delangre("c", force="4 N", contact_stiffness=0.0, cubic=0.0)
    return sl.frequency_response(
        rig, ("3 Hz", "25 Hz", 89), start={"x": [0.0, 1e-3, -2e-3], "v": 0.0}
    )


def amplitude(frequency):
    """Of the linear rig in steady state [m]."""
    w, wn = 2 * math.pi * frequency, 10 * math.pi
    return 4 * np.abs(1 - 18 / w**2) / 3 / np.hypot(wn**2 - w**2, 2 * 0.03 * wn * w)


# -- closed form -----------------------------------------------------------------------------------
def test_the_linear_oscillator_has_its_closed_form_response(linear):
    exact = amplitude(linear.response_frequency.values)
    # whole periods: rms of a sine is exact
    np.testing.assert_allclose(linear.response_rms, exact / math.sqrt(2), rtol=1e-12)
    np.testing.assert_allclose(linear.response_peak, exact, rtol=1e-12)
    np.testing.assert_allclose(linear.response_exponent, SPIRAL, rtol=1e-12)


def test_the_linear_oscillator_has_one_branch(linear):
    assert (linear.type == "periodic").all()
    assert (linear.period == 1).all()
    assert (linear.response_of.values == np.arange(89)[:, None]).all()
    assert (linear.response_branch == 0).all()
    # the boundaries that it crosses do nothing, and no branch ends
    assert set(linear.event_kind.values.tolist()) <= {"graze"}


def test_turning_points_of_the_linear_oscillator_are_its_amplitudes():
    rig = sl.models.delangre("c", force="4 N", contact_stiffness=0.0, cubic=0.0)
    ds = sl.bifurcation_diagram(rig, {"frequency": ("6 Hz", "20 Hz", 5)}, start=(1e-3, 0.0))
    exact = amplitude(ds.response_frequency.values)
    turns = np.sort(ds.sample_x.values[:, :2], axis=1)
    np.testing.assert_allclose(turns, np.stack([-exact, exact], axis=1), rtol=1e-11)
    assert ds.sizes["sample"] == 2


# -- orbits of the rig -----------------------------------------------------------------------------
@pytest.mark.parametrize("name", list(ORBITS))
def test_published_orbits_are_found(name):
    """From a start beside each; orbits of two independent integrators to 15 digits."""
    rig, start, row = rig_of(name), start_of(name), ORBITS[name]
    ds = sl.bifurcation_diagram(
        rig,
        {"frequency": np.array([float(row["f_Hz"])])},
        start=tuple(start * (1 + 1e-4)),
        sample="contacts",
    )
    assert ds.period.item() == int(row["period_in_T"])
    found = points(ds, 0)
    assert np.abs((found - start) / np.abs(found).max(axis=0)).max(axis=1).min() < 1e-12
    assert ds.contacts_per_period.item() * ds.period.item() == pytest.approx(
        int(row["contact_events_per_period"])
    )
    assert ds.rms.item() == pytest.approx(float(row["rms_m"]), rel=1e-10)
    assert ds.peak.item() == pytest.approx(
        max(float(row["xmax_m"]), -float(row["xmin_m"])), rel=1e-10
    )
    assert ds.response_exponent.item() == pytest.approx(SPIRAL, rel=1e-10)
    assert np.isfinite(ds.sample_x.values).sum() == int(row["contact_events_per_period"])


def test_many_orbits_are_closed_as_one_is():
    """At parameter values of their own, against the references of an independent solver."""
    rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    starts = np.array([start_of(name) for name in ("B4_15_high", "B4_15_P3", "B4_15_P4")])
    values = np.tile(np.array(list(rig.values.values())), (3, 1))
    map_, scale = Stroboscope(rig, sl.Taylor(), values), np.tile([1e-3, 0.1], (3, 1))
    orbits = find_orbits(map_, starts * 1.0001, np.array([2, 3, 8]), scale, map_.noise_of(scale))
    assert orbits.period.tolist() == [1, 3, 4]  # the smallest period is found
    assert orbits.stable.all()
    for i, name in enumerate(("B4_15_high", "B4_15_P3", "B4_15_P4")):
        known = np.array(
            [
                complex(text.strip("()").replace(" ", "").replace("j", "") + "j")
                for text in ORBITS[name]["floquet_multipliers"].split(";")
            ]
        )
        np.testing.assert_allclose(
            np.sort_complex(orbits.multipliers[i]), np.sort_complex(known), atol=1e-12
        )
        assert orbits.distance(starts, np.tile([1e-3, 0.1], (3, 1)))[i] < 1e-11


def test_what_starts_settle_to_is_what_plain_runs_settle_to():
    rig = sl.models.delangre("b", force="4 N")
    frequency, x = (
        grid.ravel()
        for grid in np.meshgrid([9.0, 15.0, 16.5, 18.0], [-1e-3, 0.2e-3, 1e-3, 5e-3], indexing="ij")
    )
    ds = sl.frequency_response(
        rig, np.array([9.0, 15.0, 16.5, 18.0]), start={"x": [-1e-3, 0.2e-3, 1e-3, 5e-3], "v": 0.0}
    )
    plain = sl.stroboscope(rig, {"x": x, "v": 0.0}, 3000, 2, values={"frequency": frequency})
    ends = np.stack([plain.x.values[:, -1], plain.v.values[:, -1]], axis=1)
    for end, response in zip(ends, ds.response_of.values.ravel(), strict=True):
        orbit = points(ds, response)
        assert np.abs((orbit - end) / np.abs(orbit).max(axis=0)).max(axis=1).min() < 1e-7


# -- branches --------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def symmetric():
    """Case a at 15.5 Hz has two mirror images of one response, of equal amplitude."""
    x, v = np.meshgrid(np.linspace(-5e-3, 5e-3, 9), np.linspace(-0.5, 0.5, 5))
    rig = sl.models.delangre("a", force="4 N")
    return sl.frequency_response(
        rig, ("15.2 Hz", "15.8 Hz", 4), start={"x": x.ravel(), "v": v.ravel()}
    )


def test_mirror_twins_are_two_responses_on_two_branches(symmetric):
    branches = []
    for value in symmetric.frequency.values:
        twins = np.flatnonzero(
            (symmetric.response_frequency == value) & (symmetric.response_period == 2)
        )
        assert len(twins) == 2
        assert symmetric.response_rms.values[twins[0]] == pytest.approx(
            symmetric.response_rms.values[twins[1]], rel=1e-9
        )
        assert len(set(symmetric.response_branch.values[twins].tolist())) == 2
        # half a period later, which a 2T orbit's points don't show
        mirrored = -points(symmetric, twins[1])
        assert np.abs(points(symmetric, twins[0]) - mirrored).max() > 1e-5
        branches.append(set(symmetric.response_branch.values[twins].tolist()))
    assert branches == branches[:1] * 4  # both are followed from value to value


def test_sweeps_up_and_down_stay_on_different_branches():
    rig = sl.models.delangre("b", force="4 N")
    up, down = (
        sl.frequency_response(rig, ("11 Hz", "19 Hz", 17), start=f"sweep_{way}")
        for way in ("up", "down")
    )
    at = float(np.flatnonzero(up.frequency.values == 15.0)[0])
    assert up.peak.values[int(at), 0] > 5 * down.peak.values[int(at), 0]
    assert up.peak.values[0, 0] == pytest.approx(down.peak.values[0, 0], rel=1e-9)
    assert up.peak.values[-1, 0] == pytest.approx(down.peak.values[-1, 0], rel=1e-9)
    assert (np.diff(up.peak.values[:, 0]) > 0).sum() > (np.diff(down.peak.values[:, 0]) > 0).sum()


def doubling_by_bisection(low, high):
    """Stiffness at which the multiplier of the 17 Hz response passes -1: the root of det(M + I)."""

    def gap(stiffness):
        rig = sl.models.delangre("c", force="4 N", frequency="17 Hz", contact_stiffness=stiffness)
        map_ = Stroboscope(rig, sl.Taylor())
        orbits = find_orbits(
            map_,
            start_of("C4_17_K7694")[None],
            np.array([1]),
            np.array([[1e-3, 0.1]]),
            np.array([map_.noise]),
        )
        return np.prod(orbits.multipliers[0] + 1.0).real

    side = gap(low) > 0
    for _ in range(20):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (gap(middle) > 0) == side else (low, middle)
    return low


def test_the_period_doubling_is_where_a_multiplier_passes_minus_one():
    rig = sl.models.delangre("c", force="4 N", frequency="17 Hz")
    ds = sl.bifurcation_diagram(
        rig,
        {"contact_stiffness": ("7.6 kN/m", "8.8 kN/m", 13)},
        start=(0.32e-3, 0.0),
        sample="stroboscope",
    )
    assert ds.event_kind.values.tolist() == ["period_doubling"]
    # 20 halvings
    assert abs(ds.event_contact_stiffness.item() - doubling_by_bisection(7.6e3, 8.8e3)) < 2e-3
    assert np.unique(ds.period).tolist() == [1, 2]


def test_a_graze_is_where_the_margin_vanishes():
    rig = sl.models.delangre("c", force="1.5 N", frequency="4 Hz")
    ds = sl.frequency_response(rig, ("3.4 Hz", "3.9 Hz", 26), follow=True)
    grazes = np.flatnonzero(ds.event_kind == "graze")
    assert len(grazes) >= 1
    for event in grazes:
        near = np.abs(ds.response_frequency.values - ds.event_frequency.values[event]).argsort()[:2]
        far = np.abs(ds.response_frequency.values - ds.event_frequency.values[event]).argsort()[4:]
        assert ds.response_margin.values[near].min() < ds.response_margin.values[far].min()
        contacts = ds.response_contacts.values[near]
        assert contacts[0] != contacts[1]


def test_a_graze_of_a_linear_motion_is_where_the_closed_form_says():
    """Below it the multipliers don't change. Beyond, contacts as stiff as these make the motion
    unstable almost at once.
    """
    rig = sl.models.delangre(
        "c",
        cubic=0.0,
        frequency="4.2 Hz",
        lower_gap="2 mm",
        upper_gap="2 mm",
        contact_stiffness="1 kN/mm",
    )
    ds = sl.bifurcation_diagram(
        rig, {"force": ("1.5 N", "2.1 N", 7)}, start=(0.0, 0.0), follow=True
    )
    graze = 2e-3 / (amplitude(4.2) / 4)
    without = ds.response_force.values[ds.response_branch == 0]
    assert (ds.response_contacts.values[ds.response_branch == 0] == 0).all()
    assert without.max() < graze < without.max() + 0.1
    mine = ds.event_branch.values == 0
    assert ds.event_kind.values[mine].tolist()[:2] == ["graze", "graze"]
    (lost,) = np.flatnonzero(mine & ~np.isin(ds.event_kind.values, ["graze"]))
    multipliers = ds.event_multiplier_real.values[lost] + 1j * ds.event_multiplier_imag.values[lost]
    assert np.abs(multipliers).max() == pytest.approx(1.0, abs=1e-4)
    assert graze < ds.event_force.values[lost] < graze + 1e-3
    # the motion is symmetric: which of the two comes first is rounding
    assert sorted(ds.event_guard.values[mine][:2]) == ["lower_gap", "upper_gap"]
    np.testing.assert_allclose(ds.event_force.values[mine][:2], graze, rtol=1e-10)
    assert graze < ds.event_force.values[mine][2] < graze + 1e-3


# -- methods ---------------------------------------------------------------------------------------
@pytest.mark.slow
def test_turning_points_of_ode45_come_to_the_exact_ones_as_its_tolerance_shrinks():
    rig = sl.models.delangre("c", force="4 N", frequency="17 Hz")
    stiffness = {"contact_stiffness": np.array([7e3, 2e4])}
    exact = sl.bifurcation_diagram(rig, stiffness, start=(0.32e-3, 0.0))
    errors = []
    for rtol in (1e-6, 1e-8, 1e-10):
        ds = sl.bifurcation_diagram(
            rig, stiffness, start=(0.32e-3, 0.0), method=sl.ODE45(rtol, rtol * 1e-3)
        )
        assert ds.period.values.tolist() == exact.period.values.tolist()
        errors.append(
            np.nanmax(np.abs(np.sort(ds.sample_x.values) - np.sort(exact.sample_x.values)))
            / np.nanmax(exact.sample_x.values)
        )
    assert errors[0] > 10 * errors[1] > 10 * errors[2]
    assert errors[2] < 1e-7  # what the cubics between 400 samples a period leave


def test_a_method_compared_with_itself_differs_by_nothing_and_with_a_coarser_one_by_its_error():
    rig = sl.models.delangre("c", force="4 N", frequency="5 Hz")
    methods = [sl.ODE45(1e-4, 1e-7), sl.ODE45(1e-6, 1e-9)]
    vary = {"contact_stiffness": ("1e3 N/m", "1e4 N/m", 9, "log")}
    ds = sl.compare_methods(
        rig, "bifurcation_diagram", methods, vary=vary, start=(0.32e-3, 0.0), sample="stroboscope"
    )
    assert ds.method.values.tolist() == [
        "Taylor",
        "ode45 located (0.0001, 1e-07)",
        "ode45 located (1e-06, 1e-09)",
    ]
    assert (ds.agrees[0] == 1).all()
    assert (ds.known[0] == 1).all()
    assert not ds.step_error[0].any()
    assert not ds.orbit_distance[0].any()
    # a hundred times the tolerance, a hundred times the error
    assert 20 < np.median(ds.step_error[1] / ds.step_error[2]) < 500
    assert (ds.step_error[2] > 0).all()
    assert (ds.steps_per_period[2] > ds.steps_per_period[1]).all()
    assert (ds.method_cpu_seconds > 0).all()


def test_one_period_errors_are_those_of_plain_runs():
    rig = sl.models.delangre("c", force="4 N", frequency="5 Hz", contact_stiffness=2e4)
    method = sl.ODE45(1e-4, 1e-7, events="ignore")
    ds = sl.compare_methods(
        rig,
        sl.bifurcation_diagram,
        [method],
        vary={"contact_stiffness": np.array([2e4])},
        start=(0.32e-3, 0.0),
    )
    run = sl.bifurcation_diagram(
        rig, {"contact_stiffness": np.array([2e4])}, start=(0.32e-3, 0.0), sample="stroboscope"
    )
    start = points(run, 0)
    ends = [
        sl.simulate(rig, start, periods=1, method=one, samples=200) for one in (method, sl.Taylor())
    ]
    ranges = [np.ptp(ends[1][name].values) for name in ("x", "v")]
    errors = [
        np.abs(ends[0][f"end_{name}"] - ends[1][f"end_{name}"]).item() / size
        for name, size in zip(("x", "v"), ranges, strict=True)
    ]
    # the range is taken from 32 looks a period
    assert ds.step_error.values[1, 0] == pytest.approx(max(errors), rel=0.02)


def test_ode45_at_the_tightest_tolerance_finds_the_same_responses():
    """AbsTol 1e-12 is 1e-8 of a motion of 0.1 mm: its noise, not RelTol's."""
    rig = sl.models.delangre("b", force="4 N")
    start = {"x": [0.2e-3, -1e-3, 4e-3], "v": 0.0}
    exact, ode45 = (
        sl.frequency_response(rig, np.array([9.0, 20.0]), start, method=m)
        for m in (sl.Taylor(), sl.ODE45(1e-12, 1e-12))
    )
    assert (ode45.type == "periodic").all()
    np.testing.assert_array_equal(ode45.period, exact.period)
    np.testing.assert_allclose(ode45.rms, exact.rms, rtol=1e-6)


def test_a_start_that_hops_between_responses_joins_none_of_them():
    """Three T responses coexist; from value to value the start leads to one or another. Margins to
    the next graze tell them apart.
    """
    rig = sl.models.delangre("c", force="4 N", frequency="5 Hz")
    ds = sl.bifurcation_diagram(
        rig,
        vary={"contact_stiffness": ("20.4 kN/m", "24 kN/m", 26)},
        start=(0.32e-3, 0.0),
        sample="stroboscope",
        progress=False,
    )
    assert ds["response_period"].values.tolist() == [1] * 26
    wide, many = ds["response_margin"].values > 1e-4, ds["response_contacts"].values > 5
    branch = ds["response_branch"].values
    groups = [branch[wide], branch[~wide & ~many], branch[many]]
    assert [len(set(group)) for group in groups] == [1, 1, 1]
    assert len({group[0] for group in groups}) == 3
    ends = [*ds.branch_begin.values, *ds.branch_end.values]
    assert sorted(ends) == 5 * ["range"] + ["unstable"], "just no start leads there"
    assert ds.event_kind.values.tolist() == ["graze", "fold"]
    assert ds.branch_end.values[ds.event_branch.values].tolist() == 2 * ["unstable"]


#: One state of two orbits of the rig that attract, by their period. Followed in steps of 0.5 mHz,
#: the first of each period ends within a few mHz, so does the second 8T; the second 5T doubles its
#: period at 14.64 Hz.
UNRELATED = {
    8: {13.75: (-0.00073242, 0.02373039), 14.0: (-0.00026599, -0.00667558)},
    5: {14.25: (-0.00030938, -0.00753661), 15.0: (-0.00040104, -0.01086994)},
}


@pytest.mark.parametrize("period", list(UNRELATED))
def test_two_orbits_of_a_period_between_which_there_is_none_are_two_branches(period):
    """Newton's method leads from the one to the other; the motion between the two values is of
    other periods, or chaotic.
    """
    rig, states = sl.models.delangre("b", force="4 N"), np.array(list(UNRELATED[period].values()))
    values = np.linspace(*UNRELATED[period], 2 if period == 8 else 4)
    ds = sl.frequency_response(rig, values, start={"x": states[:, 0], "v": states[:, 1]})
    found = []
    for value, state in UNRELATED[period].items():
        here = np.flatnonzero(
            (ds.response_frequency.values == value) & (ds.response_period.values == period)
        )
        apart = [np.abs((points(ds, i) - state) / (1e-3, 0.1)).max(axis=1).min() for i in here]
        assert min(apart) < 1e-4
        found.append(here[int(np.argmin(apart))])
    assert ds.response_branch.values[found[0]] != ds.response_branch.values[found[1]]
    for (value, other), response in zip((values[[0, -1]], values[[-1, 0]]), found, strict=True):
        mine = ds.point_branch.values == ds.response_branch.values[response]
        ends = ds.point_frequency.values[mine][[0, -1]]
        assert ends.min() <= value <= ends.max()
        assert not ends.min() <= other <= ends.max(), "it ends between"


def test_a_sharp_resonance_between_two_values_is_followed_through():
    """The phase turns by nearly 180 degrees, and the amplitude between the two values is forty
    times that at them.
    """
    rig = sl.models.delangre(
        "c", force="4 N", contact_stiffness=0.0, cubic=0.0, damping_ratio=0.003
    )
    ds = sl.frequency_response(rig, ("3.5 Hz", "6.9 Hz", 3), periods=4000)
    assert ds.response_period.values.tolist() == [1, 1, 1]
    assert len(set(ds.response_branch.values.tolist())) == 1
    assert "end" not in ds.event_kind.values


def test_a_torus_is_born_where_the_forcing_no_longer_quenches_a_limit_cycle():
    """To first order in mu the forced motion A cos(2 t), A = force/3, quenches the cycle of van der
    Pol's oscillator while A^2 > 2.
    """

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def quenched(t, x, v, *, mu=0.1, force=5.0, w=2.0):
        return v, mu * (1 - x**2) * v - x + force * sl.cos(w * t)

    ds = sl.bifurcation_diagram(quenched, {"force": (3.8, 5.0, 7)}, periods=1500)
    assert ds.event_kind.values.tolist() == ["neimark_sacker"]
    assert abs(ds.event_force.item() - 3 * math.sqrt(2)) < 0.2  # a step of the grid


def test_an_orbit_that_is_too_long_to_be_closed_is_known_by_its_points():
    """A limit cycle, the unit circle, that takes 101 forcing periods: no torus."""

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def slow(t, x, v, *, w=1.0, rate=1 / 101, pull=1.0):
        growth = pull * (1 - x**2 - v**2)
        return growth * x - rate * w * v, growth * v + rate * w * x + 0 * sl.cos(w * t)

    alike = 0.1 * np.exp(20j * np.pi / 101)  # a point of the same orbit
    starts = [(1.5, 0.0), (alike.real, alike.imag), (0.0, -0.1)]
    ds = sl.frequency_response(slow, (0.9, 1.1, 3), starts)
    assert ds.response_type.values.tolist() == ["long_periodic"] * 6
    assert ds.response_period.values.tolist() == [101] * 6
    first, second, other = ds.response_of.values.T
    assert first.tolist() == second.tolist()
    assert set(other.tolist()).isdisjoint(first.tolist())
    assert (np.abs(ds.response_exponent) <= 4 * ds.response_exponent_error).all()
    points = ds.response_x.values + 1j * ds.response_v.values
    np.testing.assert_allclose(np.abs(points), 1.0, atol=1e-12)
    np.testing.assert_allclose(points[:, 1:] / points[:, :-1], np.exp(2j * np.pi / 101), rtol=1e-9)
    np.testing.assert_allclose(ds.response_peak, 1.0, atol=1e-4)
    assert np.isnan(ds.response_multiplier_real).all()
    said = sl.describe(ds)
    on_its_way = sl.frequency_response(slow.with_values(pull=3e-4), [1.0], [(1.5, 0.0)])
    assert on_its_way.response_type.item() == "long_periodic"
    points = np.hypot(on_its_way.response_x, on_its_way.response_v)
    np.testing.assert_allclose(points, 1.0, atol=1e-3)  # the last ones, not the first ones kept
    assert "6 101T" in said
    assert "6 responses repeat, but only after more than 64 periods" in said


@pytest.mark.parametrize("r", [3.9925202813007035, 3.9962199905499762])
def test_chaos_in_bands_that_are_thin_as_lines_is_chaotic(r):
    """The logistic map in a window of period 8: each eighth point comes back to 5e-4 of the range,
    as on the way to an orbit.
    """

    @sl.system(states="x p", forced_at="w", units={"w": "rad/s"})
    def logistic(t, x, p, *, w=1.0, r=r):
        return 0 * x, w * sl.cos(w * t) - (p - sl.sin(w * t)), sl.jump(p > 0.5, x=r * x * (1 - x))

    ds = sl.bifurcation_diagram(logistic, {"r": [r]}, [(0.49, 0.0), (0.3, 0.0)])
    assert (ds.type == "chaotic").all()
    x, total, count = 0.49, 0.0, 40_000
    for _ in range(count):
        total, x = total + math.log(abs(r * (1 - 2 * x))), r * x * (1 - x)
    apart = np.abs(ds.response_exponent.values - total / count / (2 * math.pi))
    assert (apart < 5 * ds.response_exponent_error.values).all()


def test_nothing_is_left_of_deviations_along_a_long_orbit_that_rests():
    """A ball on a shaken table is at rest where its chatter ends, and leaves when the table lets it
    go, whatever came before. At many accelerations it repeats late.
    """

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def ball(t, x, v, *, shaken=4.0, restitution=0.6, w=1.0):
        return v, -1 + shaken * sl.cos(w * t), sl.impact(x > 0, -v, restitution=restitution)

    ds = sl.bifurcation_diagram(ball, {"shaken": (2.5, 5.5, 16)}, [(0.1, 0.0)])
    long = ds.isel(response=ds.response_type.values == "long_periodic")
    assert long.sizes["response"] > 2
    assert (long.response_period > 64).all()
    assert (long.response_exponent == -np.inf).all()
    assert (long.response_exponent_error == 0.0).all()
    for i, n in enumerate(long.response_period.values.tolist()):
        values = {"shaken": float(long.response_shaken[i])}
        start = [float(long[name][i, 0]) for name in ("response_x", "response_v")]
        end = sl.stroboscope(ball.with_values(**values), start, n, keep=1)
        assert abs(end.x.values.ravel()[-1] - start[0]) < 1e-6 * float(long.response_peak[i])


def test_multipliers_that_stay_near_the_unit_circle_bear_no_torus():
    """The product of the multipliers of an oscillator with linear damping is below one: of it no
    torus can be born.
    """

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def ball(t, x, v, *, damping=0.03, w=2.0):
        return v, 1 + 0.8 * sl.cos(w * t) - damping * v - sl.max(x, 0) ** 1.5

    ds = sl.frequency_response(ball, (2.3, 2.5, 9), start="sweep_up", periods=3000)
    sizes = np.hypot(ds.response_multiplier_real, ds.response_multiplier_imag)
    assert sizes.max() > 0.96
    assert "neimark_sacker" not in ds.event_kind.values
