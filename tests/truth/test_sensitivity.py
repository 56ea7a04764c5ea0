"""Derivatives of motions with respect to parameters: closed forms, and differences of runs."""

import mpmath as mp
import numpy as np
import pytest

import saltus as sl
from saltus.errors import SaltusWarning

#: Differences of fourth order, and their steps.
WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / 12.0
SHIFTS = np.array([-2.0, -1.0, 1.0, 2.0])


@sl.system(states="x v", forced_at="f")
def bumper(t, x, v, *, f=2.0, pull=3.0, k=40.0, d=0.3, gap=0.01, stop=900.0):
    return v, pull * sl.cos(2 * sl.pi * f * t) - k * x - d * v - sl.where(
        x > gap, stop * (x - gap), 0
    )


@sl.system(states="x v", forced_at="f")
def hammer(t, x, v, *, f=2.0, pull=3.0, k=40.0, gap=0.01, e=0.7):
    law = sl.impact(x < gap, v, restitution=e)
    return v, pull * sl.cos(2 * sl.pi * f * t) - k * x, law


@sl.system(states="x v", forced_at="f")
def slider(t, x, v, *, f=2.0, pull=3.0, k=140.0, limit=1.2):
    friction = sl.friction(v, slip=limit, stick=limit)
    return v, pull * sl.cos(2 * sl.pi * f * t) - k * x - friction


@sl.system(states="h v")
def ball(t, h, v, *, g=9.81, e=0.5):
    return v, -g, sl.impact(h > 0, -v, restitution=e)


def beam(modes=4):
    """A chain of four masses between two stops, one of them damped."""
    stiffness = 100.0 * (2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    return sl.structure(
        np.eye(4),
        stiffness,
        contacts=[
            sl.Contact("x1", stiffness="1e4 N/m", gap="1 mm", damping="3 N*s/m", name="s"),
            sl.Contact("x3", stiffness="3e3 N/m", gap="4 mm", side="both", name="r"),
        ],
        forces=[sl.Force("x2", "1 N")],
        frequency="2 Hz",
        damping_ratio="2 %",
        sensors={"tip": "x3"},
        modes=modes,
    )


def by_differences(system, start, name, times, *, t_start=0.0, step=1e-6):
    """Derivatives of states and outputs at times, and of contact times."""
    unit = step * abs(system.values.get(name, 0.01))
    states, contacts = [], []
    for shift in SHIFTS * unit:
        moved, values = np.array(start, float), {}
        if name.endswith("(0)"):
            moved[system.states.index(name[:-3])] += shift
        else:
            values = {name: system.values[name] + shift}
        run = sl.simulate(
            system, moved, at=times, t_start=t_start, values=values, time_errors="local",
            progress=False,
        )  # fmt: skip
        names = (*system.states, *system.outputs.names)
        states.append(np.stack([run[one].values for one in names], axis=1))
        contacts.append(run.contact_time.values)
    return (np.tensordot(WEIGHTS, np.array(part), 1) / unit for part in (states, contacts))


def off(found, expected):
    """Largest difference, in the largest of the expected."""
    return float(np.nanmax(np.abs(found - expected)) / np.nanmax(np.abs(expected)))


def test_a_bouncing_ball_has_the_derivatives_of_its_formulas():
    height, g, e = 0.1, 9.81, 0.5
    found = sl.sensitivity(ball, (height, 0), t_end=0.5, to=["g", "e", "h(0)"])
    # impact n: t_n = t_1 (1 + 2 e + ... + 2 e^(n - 1)), t_1 = sqrt(2 h/g)
    first = np.sqrt(2 * height / g)
    for n in range(6):
        powers = 1 + 2 * sum(e**j for j in range(1, n + 1))
        slope = 2 * sum(j * e ** (j - 1) for j in range(1, n + 1))
        expected = [-first * powers / (2 * g), first * slope, first * powers / (2 * height)]
        assert found.contact_time.values[n] == pytest.approx(first * powers, rel=1e-13)
        assert found.contact_time_derivative.values[n] == pytest.approx(expected, rel=1e-11)
    # the highest point after the start is the start; the deepest speed is that of the first impact
    assert found.maximum.values == pytest.approx([height, e * np.sqrt(2 * g * height)], rel=1e-12)
    assert found.maximum_derivative.values[0] == pytest.approx([0.0, 0.0, 1.0], abs=1e-12)
    speed = np.sqrt(2 * g * height)
    assert found.maximum_derivative.values[1] == pytest.approx(
        [e * height / speed, speed, e * g / speed], rel=1e-11
    )


@pytest.mark.parametrize(
    ("system", "start", "to"),
    [
        (bumper, (0.0, 0.0), ["gap", "stop", "k", "d", "pull", "f", "x(0)", "v(0)"]),
        (hammer, (0.0, 0.0), ["gap", "e", "k", "pull", "f", "v(0)"]),
        (slider, (0.02, 0.0), ["limit", "k", "pull", "f", "x(0)"]),
        (beam(), np.zeros(8), ["s_gap", "s_stiffness", "s_damping", "r_gap", "force", "frequency"]),
        (beam(3), np.zeros(6), ["s_gap", "r_stiffness", "frequency", "q1(0)"]),
    ],
    ids=["soft stop", "impacts", "friction", "modal flow", "structure by Taylor"],
)  # fmt: skip
@pytest.mark.parametrize("t_start", [0.0, 0.13])
def test_derivatives_are_the_limits_of_differences(system, start, to, t_start):
    times = t_start + np.linspace(0.2, 1.1, 5)
    found = sl.sensitivity(system, start, at=times, t_start=t_start, to=to, extremes=False)
    assert found.sizes["contact"] > 1
    for column, name in enumerate(to):
        states, contacts = by_differences(system, start, name, times, t_start=t_start)
        assert off(found.derivative.values[..., column], states) < 1e-6, name
        assert off(found.contact_time_derivative.values[:, column], contacts) < 1e-6, name


def test_extremes_and_their_derivatives_are_exact():
    outputs = {"force": (lambda x, gap, stop: sl.where(x > gap, stop * (x - gap), 0), "N")}
    to = ["gap", "stop", "f"]
    found = sl.sensitivity(bumper, periods=6, to=to, outputs=outputs)
    run = sl.simulate(bumper, periods=6, samples=20_000)
    force = np.maximum(bumper.values["stop"] * (run.x.values - bumper.values["gap"]), 0.0)
    for k, sampled in enumerate([run.x.values, run.v.values, force]):
        size = np.ptp(sampled)
        for word, extreme in (("maximum", sampled.max()), ("minimum", sampled.min())):
            assert found[word].values[k] == pytest.approx(extreme, abs=1e-6 * size)
            assert (found[word].values[k] - extreme) * (1 if word == "maximum" else -1) >= -1e-14
    for column, name in enumerate(to):
        unit = 1e-6 * bumper.values[name]
        each = [
            sl.sensitivity(
                bumper.with_values(**{name: bumper.values[name] + shift * unit}),
                periods=6, to=name, outputs=outputs,
            )
            for shift in SHIFTS
        ]  # fmt: skip
        for word in ("maximum", "minimum"):
            expected = WEIGHTS @ np.array([one[word].values for one in each]) / unit
            assert found[f"{word}_derivative"].values[:, column] == pytest.approx(
                expected, abs=1e-6 * np.abs(expected).max()
            ), (word, name)


@pytest.mark.slow
def test_random_rough_oscillators_agree_with_differences():
    random, worst, contacts = np.random.default_rng(261126), 0.0, 0
    for _ in range(24):
        system = [bumper, hammer, slider][random.integers(3)]
        values = {
            name: value * random.uniform(0.7, 1.3)
            for name, value in system.values.items()
            if name != "e"
        }
        system = system.with_values(**values)
        to = list(random.choice(list(system.values), 2, replace=False))
        start = random.uniform(-1, 1, 2) * (0.008, 0.05)
        times = np.sort(random.uniform(0.05, 1.0, 3))
        found = sl.sensitivity(system, start, at=times, to=to, extremes=False)
        contacts += found.sizes["contact"]
        for column, name in enumerate(to):
            states, instants = by_differences(system, start, name, times, step=3e-7)
            worst = max(worst, off(found.derivative.values[..., column], states))
            if instants.size:
                slopes = found.contact_time_derivative.values[:, column]
                worst = max(worst, off(slopes, instants))
    assert contacts > 60
    assert worst < 2e-6


def test_many_trajectories_are_those_of_one_each():
    starts = {"x": [0.0, 2e-3], "v": [0.0, 0.01]}
    many = sl.sensitivity(bumper, starts, periods=3, to=["gap", "x(0)"], values={"f": [2.0, 2.3]})
    for i in range(2):
        one = sl.sensitivity(
            bumper.with_values(f=[2.0, 2.3][i]), (starts["x"][i], starts["v"][i]), periods=3,
            to=["gap", "x(0)"],
        )  # fmt: skip
        mine = many.isel(trajectory=i)
        assert np.array_equal(mine.end_derivative.values, one.end_derivative.values)
        assert np.array_equal(mine.maximum_derivative.values, one.maximum_derivative.values)
        here = many.contact_trajectory.values == i
        assert np.array_equal(
            many.contact_time_derivative.values[here], one.contact_time_derivative.values
        )


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def resting(t, x, v, *, w=9.0, wall=0.02):
    """A body on a spring that rests on a wall after each impact, until it is pulled off."""
    return v, 12 * sl.cos(w * t) - 50 * x, sl.impact(x < wall, v, restitution=0)


@pytest.mark.parametrize("method", [sl.Taylor(), sl.Modal()], ids=["Taylor", "Modal"])
def test_times_of_impacts_without_rebound_and_of_releases_move_as_differences_say(method):
    start, h = (0.0, 0.3), 1e-7
    found = sl.sensitivity(resting, start, periods=3, to=["wall"], method=method)
    low, high = (
        sl.simulate(resting.with_values(wall=0.02 + d), start, periods=3).contact_time.values
        for d in (-h, h)
    )
    assert {"impact", "hold", "release"} == set(found.contact_kind.values)
    np.testing.assert_allclose(
        found.contact_time_derivative.values[:, 0], (high - low) / (2 * h), rtol=1e-6
    )


@sl.system(states="x y u v", forced_at="w", units={"w": "rad/s"})
def leaning(t, x, y, u, v, *, w=3.0, push=4.0, gap=0.1, wall=0.3):
    """A body is pushed onto one that stands still, without rebound, and both against a wall."""
    return (
        u, v, push * sl.sin(w * t) - x, -2 * y - 0.1 * v,
        sl.impact(x < y + gap, u - v, restitution=0.0, inertia={"u": 1.0, "v": 1.0}),
        sl.impact(y < wall, v, restitution=0.0),
    )  # fmt: skip


def test_a_blow_moves_a_body_that_stands_where_its_velocity_turns():
    """Its velocity is zero until it is struck: it rides the surface on which it turns."""
    times = np.linspace(0.2, 0.7, 5)  # before the wall
    found = sl.sensitivity(
        leaning, np.zeros(4), at=times, to=("gap", "push"), method=sl.Taylor(), progress=False
    )
    assert str(found.status.values) == "ok"
    for column, name in enumerate(("gap", "push")):
        states, _ = by_differences(leaning, np.zeros(4), name, times)
        assert off(found.derivative.values[..., column], states) < 1e-6, name


@sl.system(states="x v", forced_at="f")
def adrift(t, x, v, *, f=1.3, pull=2.0):
    return v, pull * sl.cos(2 * sl.pi * f * t)


def test_a_body_that_drifts_has_derivatives_by_modes():
    at = np.array([0.3, 1.1])
    found = sl.sensitivity(adrift, (0, 0), at=at, to=["pull"], extremes=False, method=sl.Modal())
    rate = 2 * np.pi * 1.3
    expected = np.stack([(1 - np.cos(rate * at)) / rate**2, np.sin(rate * at) / rate], axis=1)
    assert found.derivative.values[..., 0] == pytest.approx(expected, abs=1e-13)


def test_no_sample_at_the_end_is_lost_where_the_frequency_moves():
    for at in np.linspace(0.7, 2.9, 12):
        found = sl.sensitivity(adrift, (0, 0), at=[0.1, at], to="f", t_start=0.03)
        assert np.isfinite(found.derivative.values).all()
        assert found.sizes["time"] == 2


def turned_back(law):
    """A body against friction whose velocity a law takes away at a gap: it turns back at once."""

    @sl.system(states="x v")
    def system(t, x, v, *, k=40.0, slip=3.0, gap=0.3):
        return v, -k * x - sl.friction(v, slip=slip), law(x, v, gap)

    return system


CLAY = turned_back(lambda x, v, gap: sl.impact(x < gap, v, restitution=0.0))


@pytest.mark.nojit
@pytest.mark.parametrize(
    "system",
    [CLAY, turned_back(lambda x, v, gap: sl.jump(x > gap, v=0 * v))],
    ids=["impact", "jump"],
)
def test_friction_that_a_law_turns_acts_on_the_derivatives_from_that_instant_on(system):
    """The formulas: x = (slip/k)(cos wt - 1) + (v(0)/w) sin wt up to t1, where it is the gap, then
    slip/k + (gap - slip/k) cos w(t - t1).
    """
    end, start = 0.4, (0.0, 4.0)

    def formula(k, slip, gap, speed):
        w = mp.sqrt(k)
        time = mp.findroot(
            lambda t: slip / k * (mp.cos(w * t) - 1) + speed / w * mp.sin(w * t) - gap, 0.08
        )
        return slip / k + (gap - slip / k) * mp.cos(w * (end - time))

    found = sl.sensitivity(
        system, start, t_end=end, to=["k", "slip", "gap", "v(0)"], samples=2, method=sl.Taylor()
    )
    given = (*system.values.values(), start[1])
    expected = [
        float(mp.diff(formula, given, tuple(int(i == j) for i in range(4)))) for j in range(4)
    ]
    assert found.end_derivative.values[0] == pytest.approx(expected, rel=1e-8)


@sl.system(states="x v", forced_at="f")
def loose(t, x, v, *, f=1.77, k=80.0, spring=60.0, gap=0.1, pull=10.0, d=0.3):
    return v, pull * sl.cos(2 * sl.pi * f * t) - k * x - d * v - spring * sl.play(x, gap=gap)


def test_a_start_on_either_limit_of_a_play_has_the_derivatives_of_its_mirror_image():
    high, low = (
        sl.sensitivity(
            loose.with_values(pull=side * 10.0), (side * 0.15, side * 0.2, side * 0.1),
            t_end=1.0, to=["gap", "k"], method=sl.Taylor(),
        )
        for side in (1, -1)
    )  # fmt: skip
    assert str(high.status.item()) == str(low.status.item()) == "ok"
    np.testing.assert_allclose(low.end_derivative, -high.end_derivative, rtol=1e-9)
    np.testing.assert_allclose(low.minimum_derivative, -high.maximum_derivative, rtol=1e-9)


def test_a_graze_of_a_rigid_stop_to_rounding_is_warned_of():
    """x = cos t with a damper that the force balances touches its stop where it turns."""
    motion = sl.models.impact_oscillator(force=0.1)
    with pytest.warns(SaltusWarning, match="slope is infinite on the side with contact"):
        result = sl.sensitivity(motion, (0.0, 1.0), t_end=3.0, to="force")
    assert str(result.status.values) == "graze_unresolved"


def test_two_samples_on_zeros_of_a_motion_tell_nothing_of_its_range():
    motion = sl.models.impact_oscillator(force=0.1 - 1e-6)
    sl.sensitivity(motion, (0.0, 1.0 - 1e-5), t_end=5.0, samples=2, to="force")


@sl.system(states="x y u w")
def trip(t, x, y, u, w, *, push=1.0, load=0.5, gap=0.0, near=0.0):
    """A body that comes to rest on a stop and releases a load on another one there."""
    trigger = sl.piecewise((load, x > near), otherwise=0.0)
    return u, w, push, trigger, sl.impact(x < gap, u, restitution=0.0)


@pytest.mark.parametrize("method", [sl.Taylor(), sl.Modal()], ids=lambda one: one.name)
@pytest.mark.nojit
def test_a_load_begins_where_a_stop_takes_the_rate_away(method):
    """The body arrives at t = 1 with velocity 1; the load acts for a time of 1."""
    found = sl.sensitivity(
        trip, (-0.5, 0.0, 0.0, 0.0), t_end=2.0, to=["x(0)", "u(0)", "load"], samples=2,
        method=method, extremes=False, progress=False,
    )  # fmt: skip
    assert str(found.status.values) == "ok"
    known = [[0, 0, 0], [0.5, 0.5, 0.5], [0, 0, 0], [0.5, 0.5, 1]]
    assert found.end_derivative.values == pytest.approx(np.array(known), abs=1e-14)


@sl.system(states="x y u w")
def beside(t, x, y, u, w, *, brake=0.7):
    """A body that rebounds, and another one that runs into a brake."""
    force = sl.piecewise((-brake, y > 0.0), otherwise=0.0)
    return u, w, 0.0, force, sl.impact(x < 0.0, u, restitution=0.5)


@pytest.mark.nojit
def test_a_crossing_that_comes_with_an_impact_by_chance_moves_by_itself():
    """Both at t = 1, with velocities 1 and 2; they have nothing to do with each other."""
    found = sl.sensitivity(
        beside, (-1.0, -2.0, 1.0, 2.0), t_end=1.5, to=["x(0)", "y(0)"], samples=2,
        method=sl.Taylor(), extremes=False, progress=False,
    )  # fmt: skip
    known = [[-0.5, 0], [0, 1 - 0.35 / 2], [0, 0], [0, -0.35]]
    assert found.end_derivative.values == pytest.approx(np.array(known), abs=1e-14)
