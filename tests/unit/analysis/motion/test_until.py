"""Runs that end at a condition: the instant, the state, and nothing behind it."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus as sl
from conformance.systems import ball_of_clay, lab
from saltus.errors import ParameterError, SaltusError, SaltusWarning, TraceError, UnitError
from saltus.flow import engine

SEED = 6702


@sl.system(states="x v", units={"x": "m", "v": "m/s"}, forced_at="frequency")
def shaken(
    t, x, v, *, m="1 kg", k="40 N/m", c="0.4 kg/s", stop="2 kN/m", gap="20 mm", force="1 N",
    frequency="1.3 Hz",
):  # fmt: skip
    """A mass on a spring between two stops."""
    contact = sl.freeplay(x, stiffness=stop, gap=gap)
    return v, (force * sl.cos(2 * sl.pi * frequency * t) - k * x - c * v - contact) / m


def plain(t, y, frequency=1.3):
    """The same by hand."""
    x, v = y
    contact = 2e3 * (max(x - 0.02, 0.0) + min(x + 0.02, 0.0))
    return [v, math.cos(2 * math.pi * frequency * t) - 40 * x - 0.4 * v - contact]


def by_scipy(start, event, t_end):
    """The instant of the first crossing upwards, by another solver."""
    event.terminal, event.direction = True, 1
    run = solve_ivp(
        plain, (0, t_end), start, "DOP853", rtol=1e-12, atol=1e-14, max_step=0.01, events=event
    )
    return run.t_events[0][0], run.y_events[0][0]


@pytest.mark.parametrize("number", range(6))
def test_random_levels_are_met_where_another_solver_meets_them(number):
    random = np.random.default_rng([SEED, number])
    start = random.uniform([-0.01, -0.1], [0.01, 0.1])
    slope, level = random.uniform(-0.05, 0.05), random.uniform(0.012, 0.022)
    if start[0] + slope * start[1] > level:
        level += 0.02
    time, state = by_scipy(start, lambda t, y: y[0] + slope * y[1] - level, 20.0)
    until = f"x > {level!r} m - v*({slope!r})"
    run = sl.simulate(shaken, start, t_end=20.0, until=until, progress=False)
    assert run.status == "until"
    np.testing.assert_allclose(run.end_time, time, rtol=0, atol=1e-9)
    np.testing.assert_allclose([run.end_x, run.end_v], state, rtol=0, atol=1e-9)
    np.testing.assert_allclose(run.end_x + slope * run.end_v, level, rtol=0, atol=1e-16)


METHODS = [
    sl.Taylor(), sl.Modal(), sl.ODE45(1e-9, 1e-11), sl.ODE23(1e-8, 1e-10), sl.ODE113(1e-9, 1e-11),
    sl.ODE15s(1e-9, 1e-11), sl.RK4(1e-4),
]  # fmt: skip


@pytest.mark.parametrize("method", METHODS, ids=lambda one: one.name)
def test_every_method_ends_there_after_contacts(method):
    """Beyond the other stop: contacts come before it."""
    time, state = by_scipy([0.03, 2.0], lambda t, y: -y[0] - 0.03, 20.0)
    run = sl.simulate(
        shaken, (0.03, 2.0), t_end=20, until="x < -30 mm", method=method, progress=False
    )
    assert run.status == "until"
    assert run.sizes["contact"] == 2
    assert run.events == 2
    np.testing.assert_allclose(run.end_time, time, rtol=0, atol=1e-6)
    np.testing.assert_allclose(run.end_x, -0.03, rtol=0, atol=1e-9)
    np.testing.assert_allclose(run.end_v, state[1], rtol=0, atol=1e-4)


@pytest.mark.parametrize("method", METHODS, ids=lambda one: one.name)
def test_what_comes_before_the_end_is_the_same_to_the_bit_as_without_stops(method):
    """A condition that comes late stops at every contact; the motion doesn't feel it."""
    ask = {"t_end": 6.0, "method": method, "progress": False, "time_errors": "local"}
    free = sl.simulate(shaken, (0.03, 2.0), until=lambda x: x > 5.0, **ask)
    other = sl.poincare(
        shaken, (0.03, 2.0), lambda x: x - 5.0, t_end=6.0, method=method, progress=False
    )
    assert free.status == "ok"
    assert free.sizes["contact"] > 5
    assert (free.end_x, free.end_v) == (other.end_x, other.end_v)


@pytest.mark.parametrize(
    "until",
    [
        "x < 5 mm", "5 mm > x", "x - 5e-3 < 0", "x - 5 mm",
        "not x > 5 mm", "x < 5 mm and v < 0 m/s",
        "x < 5 mm or v > 3 m/s", "x < (5 mm)", "x<5mm",
        lambda x: x < 5e-3, lambda x: x - 5e-3, lambda t, x, v: 5e-3 - x,
        lambda x, v: (x < 5e-3) & (v < 0), lambda x, h: x < h / 200,
    ],
)  # fmt: skip
def test_a_ball_that_falls_ends_at_the_height_however_it_is_said(until):
    run = sl.simulate(falling, (1.0, 0.0), t_end=30.0, until=until, progress=False)
    time = math.sqrt(2 * 0.995 / 9.81)
    assert run.status == "until"
    np.testing.assert_allclose(run.end_time, time, rtol=1e-15)
    np.testing.assert_allclose(run.end_x, 0.005, rtol=0, atol=3e-16)
    assert run.time[-1] == run.end_time
    assert run.x[-1] == run.end_x
    assert np.isfinite(run.x).all()


@sl.system(states="x v", units={"x": "m", "v": "m/s"})
def falling(t, x, v, *, h="1 m", g="9.81 m/s^2"):
    """A free fall; h is of meaning to conditions only."""
    return v * (h / h), -g


def test_each_trajectory_of_a_batch_ends_at_its_own_time():
    heights = np.random.default_rng(SEED).uniform(0.5, 2.0, 2500)
    run = sl.simulate(
        falling, {"x": heights, "v": 0.0}, t_end=10, until="x < 0.3 m", samples=10, progress=False
    )
    times = np.sqrt(2 * (heights - 0.3) / 9.81)
    assert (run.status == "until").all()
    np.testing.assert_allclose(run.end_time, times, rtol=1e-14)
    known = np.isfinite(run.x.values)
    np.testing.assert_array_equal(
        known, run.time.values <= run.end_time.values[:, None] * (1 + 1e-15)
    )
    assert float(run.time[-1]) == float(run.end_time.max())


def test_those_for_which_it_never_holds_run_to_the_end():
    run = sl.simulate(
        lab, {"x": 0.0, "v": [1.0, -1.0]}, t_end=3.0, until=lambda x: x > 0.5, progress=False
    )
    assert run.status.values.tolist() == ["until", "ok"]
    np.testing.assert_allclose(run.end_time, [0.5, 3.0], rtol=1e-15)


def test_nothing_behind_the_end_is_computed():
    ask = {"until": "x > 22 mm", "progress": False, "time_errors": "local"}
    short = sl.simulate(shaken, (0.0, 2.0), t_end=2.0, **ask)
    long = sl.simulate(shaken, (0.0, 2.0), t_end=1e5, **ask)
    assert long.steps == short.steps
    assert (long.end_time, long.end_x) == (short.end_time, short.end_x)
    assert long.steps < 20


def test_an_impact_that_makes_it_true_ends_it_there():
    run = sl.simulate(
        ball_of_clay, (0.5, 0.0), t_end=9, until=lambda v: v > 0, values={"slope": 0.0},
        progress=False,
    )  # fmt: skip
    np.testing.assert_allclose([run.end_time, run.end_v], [1.0, 0.5], rtol=1e-15)
    assert run.sizes["contact"] == 1
    assert run.contact_kind[0] == "impact"


def test_a_contact_of_the_system_as_the_condition_is_one_contact():
    run = sl.simulate(
        lab, (0.0, 1.0), t_end=9, until=lambda x, boundary: x > boundary, progress=False
    )
    assert run.end_time == 1.0
    assert run.sizes["contact"] == 1
    assert run.events == 1
    assert run.attrs["until"] == "the condition"


@pytest.mark.parametrize(
    ("start", "ends"),
    [
        ((2.0, 0.0), 0.0),
        ((1.0, 1.0), 0.0),
        ((1.0, 0.0), 0.0),
        ((1.0, -1.0), 2.0),
        ((0.5, 0.5), None),
    ],
)
def test_one_that_holds_at_the_start_ends_there_with_a_word(start, ends):
    """x'' = 1 with x > 1: at the start, entered at once, by the second derivative, later."""
    system = lab.with_values(lift=1.0, boundary=99.0)
    ask = {"t_end": 5.0, "until": lambda x: x > 1, "progress": False}
    if ends == 0.0:
        with pytest.warns(SaltusWarning, match="holds at the start"):
            run = sl.simulate(system, start, **ask)
        assert run.steps == 0
        assert run.x.values.tolist() == [start[0]]
    else:
        run = sl.simulate(system, start, **ask)
    assert run.status == "until"
    time = ends if ends is not None else -0.5 + math.sqrt(0.25 + 1.0)
    np.testing.assert_allclose(run.end_time, time, rtol=0, atol=1e-15)


def test_a_number_ends_it_at_its_next_zero():
    run = sl.simulate(
        lab, (1.0, 1.0), t_end=9, until=lambda x: x - 1, values={"lift": -1.0}, progress=False
    )
    np.testing.assert_allclose(run.end_time, 2.0, rtol=1e-15)


def test_states_at_given_times_and_a_condition_go_together():
    with np.errstate(all="raise"):
        run = sl.simulate(
            falling, (1.0, 0.0), at=[0.4, 0.1, 3.0], until="x < 0.3 m", progress=False
        )
    np.testing.assert_allclose(run.x[:2] if run.end_time > 0.4 else run.x[1], 1 - 9.81 / 2 * 0.01)
    assert np.isnan(run.x[2])


def test_the_budget_of_contacts_holds():
    with pytest.warns(SaltusWarning, match="budget_events"):
        run = sl.simulate(
            shaken, (0.03, 2.0), t_end=20, until="x > 5 m", method=sl.Taylor(max_events=5),
            progress=False,
        )  # fmt: skip
    assert run.status == "budget_events"


def test_an_interrupted_run_keeps_what_it_has(monkeypatch):
    def interrupt(share):
        raise KeyboardInterrupt

    monkeypatch.setattr(engine, "SLICE", 200)
    with pytest.raises(sl.Interrupted) as caught:
        sl.simulate(shaken, (0.03, 2.0), t_end=5000, until="x > 5 m", progress=interrupt, threads=1)
    part = caught.value.partial
    assert part.status == "interrupted"
    assert 0 < part.end_time < 5000
    assert part.sizes["contact"] > 0


@pytest.mark.parametrize(
    ("until", "error", "says"),
    [
        (3, ParameterError, "must be a condition"),
        ("x >", TraceError, "can't be read"),
        ("y > 3 mm", ParameterError, "neither t nor a state"),
        ("x > 3 N", SaltusError, "one unit"),
        ("t > 3 s", TraceError, "compares the time"),
        ("1 > 2", TraceError, "always False"),
        ("h > 2 m", TraceError, "parameters only"),
        ("__import__('os')", ParameterError, "'os' is neither"),
        ("__import__(x)", TraceError, "no function"),
        ("x > 3 m/h", ParameterError, "could be a unit or the 'h'"),
        ("x > 5", UnitError, "5 has no unit, and 'x' is in m. Write '5 m'"),
        ("-1e-3 < x", UnitError, "has no unit"),
        ("x > 2 g", SaltusError, "meanings|acceleration|unit|gram"),
        (lambda y: y > 3, TraceError, "neither t nor a"),
        (lambda x: 3, TraceError, "always 3"),
        (lambda x: None, TraceError, "returns nothing"),
    ],
)
def test_what_is_no_condition_is_refused_with_advice(until, error, says):
    with pytest.raises(error, match=says):
        sl.simulate(falling, (1.0, 0.0), t_end=1, until=until, progress=False)


def spring_and_stop():
    """Outputs of one word and of several; the last has a boundary of its own."""
    return shaken.with_outputs(
        {
            "spring": lambda k, x: k * x,
            "spring force": lambda k, x: k * x,
            "stop force": (lambda stop, gap, x: sl.freeplay(x, stiffness=stop, gap=gap), "N"),
        }
    )


@pytest.mark.parametrize(
    ("until", "same"),
    [
        ("'spring force' > 0.84 N", "x > 21 mm"),
        ("`spring force`>840 mN", "x > 21 mm"),
        ('"spring force" > 0.84 N and v > 0 m/s', "x > 21 mm and v > 0 m/s"),
        ("'spring' > 0.84 N", "x > 21 mm"),
        ("'stop force' > 2 N and 'spring force' > 0.8 N", "x > 21 mm"),
        ("2 N < 'stop force'", "x > 21 mm"),
        ("'x' > 21 mm", "x > 21 mm"),
    ],
)
def test_a_name_of_several_words_stands_in_quotes(until, same):
    ask = {"t_end": 5.0, "progress": False}
    run = sl.simulate(spring_and_stop(), (0.0, 2.0), until=until, **ask)
    other = sl.simulate(shaken, (0.0, 2.0), until=same, **ask)
    assert run.status == other.status == "until"
    assert run.attrs["until"] == until
    np.testing.assert_allclose(run.end_time, other.end_time, rtol=0, atol=1e-14)
    np.testing.assert_allclose(run.end_x, 0.021, rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("until", "says"),
    [
        ("stop force > 2 N", "write 'stop force' in quotes"),
        ("2*stop force > 2 N", "write 'stop force' in quotes"),
        ("'stop forces' > 2 N", "Did you mean 'stop force'"),
        ("'stop force' > 5", "5 has no unit, and 'stop force' is in N. Write '5 N'"),
        ("spring > 5 mm", "'spring' is in N, and is compared with a number in m"),
    ],
)
def test_names_of_several_words_are_refused_with_advice(until, says):
    with pytest.raises(SaltusError, match=says):
        sl.simulate(spring_and_stop(), (0.0, 2.0), t_end=5, until=until, progress=False)


def test_methods_that_step_over_contacts_are_refused():
    with pytest.raises(ParameterError, match="locates contacts"):
        sl.simulate(lab, (0, 1), t_end=3, until=lambda x: x > 1, method=sl.RK4(0.1, "ignore"))
    with pytest.raises(ParameterError, match="Leave one of them out"):
        sl.simulate(shaken, (0, 1), periods=3, keep=1, until="x > 1 m")
    with pytest.raises(UnitError):
        sl.simulate(falling, (0, 1), t_end=3, until="x > 3 parsec/kg")


def test_outputs_at_an_end_at_the_start_are_those_of_its_side():
    """Free between two stops: their force there is none."""
    ask = {"t_end": 1, "progress": False}
    with pytest.warns(SaltusWarning, match="holds at the start"):
        run = sl.simulate(between_stops, (0.0, 0.0), until="x > -1 m", **ask)
    assert float(run.end_force) == float(run.force[0]) == 0.0
    with pytest.warns(SaltusWarning, match="holds at the start"):
        run = sl.simulate(between_stops, (0.3, 0.0), until="x > -1 m", **ask)
    assert float(run.end_force) == pytest.approx(0.2)


def test_a_condition_that_never_came_true_is_told():
    run = sl.simulate(between_stops, (0.0, 0.05), t_end=1, until="x > 1 m", progress=False)
    assert "x > 1 m, which never came true" in sl.describe(run)
    run = sl.simulate(between_stops, (0.0, 0.05), t_end=1, until="x > 0.01 m", progress=False)
    assert "never" not in sl.describe(run)


@sl.system(
    states="x v",
    units={"x": "m", "v": "m/s", "gap": "m", "k": "N/m", "m": "kg"},
    outputs={"force": (lambda x, k, gap: sl.freeplay(x, stiffness=k, upper_gap=gap,
        lower_gap=gap), "N")},
)  # fmt: skip
def between_stops(t, x, v, *, m=1.0, k=1.0, gap=0.1):
    return v, -(sl.freeplay(x, stiffness=k, upper_gap=gap, lower_gap=gap)) / m


def stopped(**options):
    """Four masses in a row that a force pushes onto a damped stop."""
    chain = 900.0 * (2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))
    about = {"modes": 4, "damping_ratio": 0.02, "frequency": "4 Hz",
        "forces": [sl.Force("x1", "6 N")], "contacts": [sl.Contact("x4", stiffness=3e3, gap="2 mm",
            damping=5.0, side="both")]}  # fmt: skip
    return sl.structure(np.eye(4), chain, **about | options)


@pytest.mark.parametrize("limit", ["> 4 N", "< -4 N"])
def test_the_force_of_a_contact_ends_a_run_of_modes(limit):
    """Where the force is a spring's, the condition is about what is linear: the modal method finds
    the same instant as Taylor's, which has the force as it is written.
    """
    until = f"'force at stop' {limit}"
    run = sl.simulate(stopped(), periods=20, until=until, progress=False)
    assert run.attrs["method"] == "Modal"
    assert run.status == "until"
    assert abs(float(run["end_force at stop"])) == pytest.approx(4.0, abs=1e-9)
    sign = 1.0 if limit[0] == ">" else -1.0
    force = sl.simulate(stopped(), periods=20, samples=2000, method=sl.Taylor(), progress=False)
    first = int((sign * force["force at stop"].values > 4.0).argmax())
    before, after = force["time"].values[first - 1 : first + 1]
    assert before <= float(run.end_time) <= after
    exact = sl.simulate(stopped(), periods=20, until=until, method=sl.Taylor(), progress=False)
    assert float(run.end_time) == pytest.approx(float(exact.end_time), rel=1e-10)


def test_the_bar_of_a_run_that_ends_early_moves_through_both_runs():
    shares: list[float] = []
    run = sl.simulate(
        stopped(), periods=1000, until="'force at stop' > 4 N", progress=shares.append
    )
    assert float(run.end_time) < 0.05 * 250
    assert shares == sorted(shares)
    assert shares[-1] > 0.9
    assert sum(0.5 < one < 0.95 for one in shares) > 1
