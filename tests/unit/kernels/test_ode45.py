"""The ode45 kernel on hand-written heads: MATLAB's digits, orders of convergence, pauses, samples,
budgets.
"""

from __future__ import annotations

import csv
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from saltus.codegen.head import Head
from saltus.codegen.interface import PAIR
from saltus.codegen.kernels import Kernels
from saltus.codegen.tableaux import DORMAND_PRINCE
from saltus.kernels import status as st

REFERENCE = Path(__file__).parents[2] / "reference"
# The rig of de Langre et al., p = m zeta f_n alpha K_c j_1 j_2 p f, summed in the order of the
# paper's equation (3): v' = -2 zeta wn v - wn^2 x - alpha/m x^3 - K_c/m (x beyond the gap) + p_eff
# cos(w t)/m. Two of Table 2's digits depend on it.
RIG_SIZES = dict(
    NSTATES=2, NMOVED=2, NGUARDS=2, NCONST=9, NDRIVE=1, GAPS_IN_TIME=False, TANGENT=False
)
RIG = """
@kernel
def prepare(p, c):
    w, wn = 2.0 * math.pi * p[8], 2.0 * math.pi * p[2]
    c[0], c[1], c[2] = -p[5], p[6], p[4] / p[0]
    c[3], c[4], c[5] = 2.0 * p[1] * wn, wn * wn, p[3] / p[0]
    c[6], c[7], c[8] = p[7] * (1.0 - 18.0 / (w * w)), w, p[0]

@kernel
def drive(t, c, h, q):
    q[0] = c[6] * math.cos(c[7] * t) / c[8]

@kernel
def field(t, y, c, q, h, mode, out):
    below, above = y[0] - c[0], y[0] - c[1]
    beyond = below if not below > 0.0 else (above if above > 0.0 else 0.0)
    out[0] = y[1]
    out[1] = -c[3] * y[1] - c[4] * y[0] - c[5] * (y[0] * y[0] * y[0]) - c[2] * beyond + q[0]

@kernel
def gaps(t, y, c, q, h, out):
    out[0], out[1] = y[0] - c[0], y[0] - c[1]

@kernel
def jump(t, y, p, h, before, after, g):
    pass

@kernel
def gap_rates(t, y, dy, c, q, h, out):
    out[0], out[1] = dy[0], dy[0]
"""
# x' = a + b x^2 with boundaries at s_0 and at s_1 + r t; p = a b s_0 s_1 r.
RAMP_SIZES = dict(
    NSTATES=1, NMOVED=1, NGUARDS=2, NCONST=5, NDRIVE=1, GAPS_IN_TIME=True, TANGENT=False
)
RAMP = """
@kernel
def prepare(p, c):
    c[0], c[1], c[2], c[3], c[4] = p[0], p[1], p[2], p[3], p[4]

@kernel
def drive(t, c, h, q):
    q[0] = c[4] * t

@kernel
def field(t, y, c, q, h, mode, out):
    out[0] = c[0] + c[1] * (y[0] * y[0])

@kernel
def gaps(t, y, c, q, h, out):
    out[0], out[1] = y[0] - c[2], y[0] - c[3] - q[0]

@kernel
def jump(t, y, p, h, before, after, g):
    pass

@kernel
def gap_rates(t, y, dy, c, q, h, out):
    out[0], out[1] = dy[0], dy[0] - c[4]
"""
# Neither has a clock, by which something is decided by time alone, nor a jump of the state.
PLAIN = dict(
    NCLOCKS=0,
    CLOCK_KIND=(0,),
    CLOCK_TABLE=(0,),
    LAWS=False,
    LEVELS=False,
    LAW=(0,),
    LAW_SIDE=(0.0,),
)
OF_PLAIN = """
@kernel
def numbers_of_clocks(p, n):
    pass

@kernel
def reset(t, y, p, h, before, after, g, out):
    pass

@kernel
def levels(t, y, p, h, mode, out):
    pass
"""
B4 = {
    "mass": 3.0,
    "zeta": 0.03,
    "fn": 5.0,
    "alpha": 7e8,
    "kc": 1.4e4,
    "j1": 0.0,
    "j2": 0.4e-3,
    "force": 4.0,
    "f": 15.0,
}


def build(sizes, functions):
    return Kernels(
        PAIR,
        "pair",
        Head(sizes | PLAIN | DORMAND_PRINCE, functions + OF_PLAIN),
        "a test",
        "a test",
    )


@pytest.fixture(scope="module")
def rig():
    return build(RIG_SIZES, RIG)


@pytest.fixture(scope="module")
def ramp():
    return build(RAMP_SIZES, RAMP)


def values(**changes):
    return np.array([list({**B4, **changes}.values())])


def flow(
    module,
    start,
    p,
    periods=0,
    *,
    rtol=1e-4,
    atol=1e-7,
    locate=True,
    extra=0.0,
    period=None,
    origin=0.0,
    samples=(),
    rows=512,
    budget=10**9,
    max_steps=10**9,
    max_events=10**9,
    record_from=0,
):
    """Run a batch to its end, however often it pauses."""
    state = np.array(np.atleast_2d(start), float, order="C")
    n, states = state.shape
    row, m = np.ones(n), len(samples)
    r = SimpleNamespace(
        state=state, count=np.zeros(n, np.int64), phase=np.zeros(n), mode=np.full(n, -1),
        carry=np.zeros((n, module.CARRY)),
        status=np.full(n, st.RUNNING), counters=np.zeros((n, 6), np.int64),
        minima=np.full((n, 2), np.inf), cursor=np.zeros(n, np.int64),
        samples=np.full((n, m, states), np.nan), sample_mode=np.full((n, m), -1), calls=0,
    )  # fmt: skip
    rec_i, rec_f = (
        np.zeros((rows, st.RECORD_INTEGERS), np.int64),
        np.zeros((rows, st.RECORD_FLOATS + states + 1)),
    )
    used = np.zeros(1, np.int64)
    count, fraction = (
        np.array([s[0] for s in samples], np.int64),
        np.array([s[1] for s in samples], float),
    )
    options = np.tile([rtol, atol, float(locate), max_steps, max_events], (n, 1))
    integers, floats, outcome = [], [], st.PAUSED
    while outcome == st.PAUSED:
        outcome = module.propagate(
            row * (1 / p[0, -1] if period is None else period), row * origin, p, int(len(p) > 1),
            r.state, r.count, r.phase, r.mode,
            np.zeros(n, np.int64), r.carry, r.status, np.full(n, periods), row * extra, r.counters,
            r.minima, count, fraction, r.cursor,
            r.samples, r.sample_mode, np.full(n, record_from), rec_i, rec_f, used, options,
            np.zeros(1), budget, *module.workspace(),
        )  # fmt: skip
        integers.append(rec_i[: used[0]].copy())
        floats.append(rec_f[: used[0]].copy())
        used[0], r.calls = 0, r.calls + 1
    r.integers, r.floats = np.concatenate(integers), np.concatenate(floats)
    r.times = r.floats[:, -1]
    return r


def table(name):
    with (REFERENCE / name).open() as file:
        return list(csv.DictReader(file))


# -- MATLAB's digits -------------------------------------------------------------------------------
@pytest.mark.nojit
def test_table_2_to_the_digit(rig):
    r = flow(rig, [0.0, 0.0], values(f=7.0), periods=7)
    for row in table("table2.csv"):
        e = int(row["event_number"]) - 1
        assert abs(r.times[e] - float(row["time_s"])) < 2e-15
        assert r.floats[e, 3] == pytest.approx(float(row["boundary_m"]), abs=2e-16)
    assert f"{r.floats[0, 3] - 0.4e-3:.10e}" == "5.1499603193e-18"  # as printed, event A
    assert np.diff(r.integers[:13, st.REC_STEPS], prepend=0).tolist() == [
        6,
        5,
        3,
        8,
        3,
        8,
        3,
        9,
        3,
        7,
        5,
        7,
        3,
    ]
    assert r.integers[:4, st.REC_GUARD].tolist() == [1, 1, 0, 0]
    assert r.integers[:4, st.REC_MODE_BEFORE].tolist() == [1, 3, 1, 0]
    assert r.integers[:4, st.REC_MODE_AFTER].tolist() == [3, 1, 0, 1]
    assert np.array_equal(r.integers[:, st.REC_DIRECTION], np.sign(r.floats[:, st.REC_VELOCITY]))
    assert r.counters[0, st.VIOLATIONS] == 0


def test_table_2_is_the_same_for_any_run_of_half_a_second_or_more(rig):
    times = [
        flow(rig, [0.0, 0.0], values(f=7.0), extra=t, rows=5000).times[:13]
        for t in (0.5, 1.0, 2.0, 10.0)
    ]
    assert all(np.array_equal(t, times[0]) for t in times)
    # a tenth of what is left limits the steps
    short = flow(rig, [0.0, 0.0], values(f=7.0), extra=0.4).times[:13]
    assert not np.array_equal(short, times[0])


def test_time_is_count_and_phase(rig):
    r = flow(rig, [1e-3, 0.0], values(), periods=20, origin=0.25)
    again = 0.25 + r.integers[:, st.REC_PERIOD] / 15 + r.floats[:, st.REC_PHASE]
    assert np.abs(again - r.times).max() < 1e-15
    assert r.floats[:, st.REC_PHASE].min() >= 0.0
    assert r.floats[:, st.REC_PHASE].max() < 1 / 15


@pytest.mark.parametrize(("rtol", "worst"), [(1e-4, 4e-4), (1e-8, 1e-7), (1e-12, 1e-10)])
def test_all_events_of_figure_2b(rig, rtol, worst):
    r = flow(rig, [0.0, 0.0], values(f=7.0), periods=14, rtol=rtol, atol=rtol * 1e-3)
    exact = table("fig2b_exact_events.csv")
    errors = np.abs(r.times - [float(row["t_s"]) for row in exact])
    assert errors.max() < worst
    assert np.median(errors / r.floats[:, st.REC_TIME_ERROR]) < 1.0  # an estimate, not a bound
    assert (errors / r.floats[:, st.REC_TIME_ERROR]).max() < 30.0
    assert r.integers[:, st.REC_DIRECTION].tolist() == [int(row["direction"]) for row in exact]
    assert r.minima[0, st.CONTACT_SPEED] == np.abs(r.floats[:, st.REC_VELOCITY]).min()


def test_agrees_with_another_solver(rig):
    integrate = pytest.importorskip("scipy.integrate")
    wn, w = 10 * np.pi, 30 * np.pi

    def rate(t, y):
        beyond = y[0] if y[0] < 0 else max(y[0] - 0.4e-3, 0.0)
        return y[1], 4 / 3 * (1 - 18 / w**2) * np.cos(w * t) - 0.06 * wn * y[1] - wn**2 * y[
            0
        ] - 7e8 / 3 * y[0] ** 3 - 1.4e4 / 3 * beyond

    other = integrate.solve_ivp(
        rate, (0, 0.2), [1e-3, 0.1], method="DOP853", rtol=1e-12, atol=1e-15, max_step=2e-4
    )
    ours = flow(rig, [1e-3, 0.1], values(), periods=3, rtol=1e-12, atol=1e-15)
    assert np.abs(ours.state[0] - other.y[:, -1]).max() < 1e-10


# -- order of convergence: RelTol so loose that every step is a tenth of a leg ---------------------
def errors_of_fixed_steps(rig, p, locate):
    rng = np.random.default_rng(1)
    starts = rng.uniform(-1, 1, (64, 2)) * [5e-3, 1.0]
    exact = flow(rig, starts, p, periods=3, rtol=3e-14, atol=1e-18).state
    for pieces in (16, 32, 64, 128):
        state = starts
        for k in range(pieces):
            state = flow(
                rig,
                state,
                p,
                extra=0.2 / pieces,
                origin=k * 0.2 / pieces,
                locate=locate,
                rtol=1e9,
                atol=1e9,
            ).state
        yield np.exp(np.mean(np.log(np.hypot(*((state - exact) / [1.0, 94.0]).T))))


@pytest.mark.parametrize(
    ("kc", "locate", "order"),
    [
        (0.0, False, 5.0),
        (1.4e4, False, 2.0),
        # Location alone doesn't restore the order: the stages of the step that is cut lie beyond
        # the boundary, on the other branch.
        (1.4e4, True, 2.0),
    ],
)
def test_order_of_convergence(rig, kc, locate, order):
    errors = np.array(list(errors_of_fixed_steps(rig, values(kc=kc), locate)))
    assert -np.polyfit(range(4), np.log2(errors), 1)[0] == pytest.approx(order, abs=0.3)


# -- the root finder -------------------------------------------------------------------------------
@pytest.mark.nojit
def test_a_gap_that_moves_in_time(ramp):
    # x = t meets 0.7 - t
    r = flow(ramp, [0.0], np.array([[1.0, 0.0, 9.0, 0.7, -1.0]]), periods=1, period=1.0)
    assert abs(r.times[0] - 0.35) < 128 * np.spacing(0.35)
    assert r.floats[0, st.REC_VELOCITY] == pytest.approx(2.0)


@pytest.mark.nojit
def test_gaps_that_close_together_are_recorded_together(ramp):
    r = flow(ramp, [0.0], np.array([[1.0, 0.0, 0.35, 0.35, 0.0]]), periods=1, period=1.0)
    assert r.times[0] == r.times[1]
    assert len(r.times) == 2
    assert r.integers[:, st.REC_GUARD].tolist() == [0, 1]
    assert r.integers[:, st.REC_MODE_AFTER].tolist() == [3, 3]


@pytest.mark.nojit
def test_the_first_of_two_gaps_wins(ramp):
    r = flow(ramp, [0.0], np.array([[1.0, 0.0, 0.3501, 0.35, 0.0]]), periods=1, period=1.0)
    assert r.integers[0, st.REC_GUARD] == 1
    assert abs(r.times[0] - 0.35) < 128 * np.spacing(0.35)


@pytest.mark.nojit
def test_a_contact_just_after_a_contact_is_lost_as_in_matlab_but_counted(ramp):
    """Where the first bracket of a leg holds the contact that began it, odezero looks no further in
    that step.
    """
    late = flow(ramp, [0.0], np.array([[1.0, 0.0, 0.6, 0.35, 0.0]]), periods=1, period=1.0)
    assert late.integers[:, st.REC_GUARD].tolist() == [1, 0]
    assert late.counters[0, st.VIOLATIONS] == 0
    early = flow(ramp, [0.0], np.array([[1.0, 0.0, 0.3501, 0.35, 0.0]]), periods=1, period=1.0)
    assert len(early.times) + early.counters[0, st.VIOLATIONS] == 2
    assert early.mode[0] == 3


@pytest.mark.nojit
def test_a_start_on_the_boundary_is_no_event(ramp):
    r = flow(ramp, [0.35], np.array([[1.0, 0.0, 0.35, 9.0, 0.0]]), periods=1, period=1.0)
    assert len(r.times) == 0
    assert r.counters[0, st.VIOLATIONS] == 0
    assert r.mode[0] == 1


# -- running in pieces -----------------------------------------------------------------------------
def test_pauses_change_nothing(rig):
    starts, samples = (
        [[0.0, 0.0], [1e-3, 0.2], [-4e-3, -0.9]],
        [(k // 8, k % 8 / 8) for k in range(1, 60)],
    )
    whole = flow(rig, starts, values(), periods=8, samples=samples)
    pieces = flow(rig, starts, values(), periods=8, samples=samples, budget=7, rows=3)
    assert pieces.calls > 50
    for name in (
        "state",
        "count",
        "phase",
        "mode",
        "counters",
        "minima",
        "samples",
        "sample_mode",
        "integers",
        "floats",
    ):
        assert np.array_equal(getattr(whole, name), getattr(pieces, name)), name


def test_a_trajectory_does_not_depend_on_its_batch(rig):
    rng = np.random.default_rng(2)
    starts = rng.uniform(-1, 1, (20, 2)) * [5e-3, 1.0]
    p = np.repeat(values(), 20, axis=0)
    p[:, -1] = rng.uniform(5, 25, 20)
    together = flow(rig, starts, p, extra=0.5, period=0.1)
    for i in (0, 7, 19):
        alone = flow(rig, starts[i], p[i : i + 1], extra=0.5, period=0.1)
        assert np.array_equal(alone.state[0], together.state[i])
        assert np.array_equal(
            alone.times, together.times[together.integers[:, st.REC_TRAJECTORY] == i]
        )


# -- samples ---------------------------------------------------------------------------------------
@pytest.mark.parametrize("locate", [True, False])
def test_samples_lie_on_the_solution(rig, locate):
    samples = [(k // 4, k % 4 / 4) for k in range(21)]
    r = flow(
        rig, [1e-3, 0.2], values(), periods=5, samples=samples, rtol=1e-9, atol=1e-12, locate=locate
    )
    assert r.samples[0, 0].tolist() == [1e-3, 0.2]
    assert np.array_equal(r.samples[0, -1], r.state[0])
    for m in (3, 10, 17):
        exact = flow(
            rig,
            [1e-3, 0.2],
            values(),
            periods=samples[m][0],
            extra=samples[m][1] / 15,
            rtol=1e-13,
            atol=1e-17,
        ).state[0]
        assert np.abs((r.samples[0, m] - exact) / [1.0, 94.0]).max() < 5e-9
    x = r.samples[0, :, 0]
    assert np.array_equal(r.sample_mode[0], (x > 0.0) + 2 * (x > 0.4e-3))


def test_a_sample_that_rounding_puts_past_the_end_is_written(rig):
    for count, fraction in ((5, 0.1), (6, 0.7), (11, 0.3)):
        r = flow(
            rig,
            [1e-3, 0.2],
            values(f=13.7),
            periods=count,
            extra=fraction / 13.7,
            samples=[(count, fraction)],
        )
        assert np.abs(r.samples[0, 0] - r.state[0]).max() < 1e-14


def test_without_location_nothing_is_recorded(rig):
    r = flow(rig, [1e-3, 0.2], values(), periods=5, locate=False)
    assert len(r.times) == 0
    assert r.counters[0, st.EVENTS] == 0
    assert r.minima[0].tolist() == [np.inf, np.inf]
    assert r.status[0] == st.OK
    assert r.mode[0] == (r.state[0, 0] > 0.0) + 2 * (r.state[0, 0] > 0.4e-3)


def test_only_contacts_of_late_periods_are_kept(rig):
    everything = flow(rig, [1e-3, 0.2], values(), periods=6)
    late = flow(rig, [1e-3, 0.2], values(), periods=6, record_from=4)
    assert np.array_equal(late.times, everything.times[everything.times >= 4 / 15])
    assert late.counters[0, st.EVENTS] == len(everything.times)


# -- ways to end -----------------------------------------------------------------------------------
@pytest.mark.nojit
def test_budgets(ramp):
    p = np.array([[1.0, 0.0, 0.35, 0.6, 0.0]])
    assert flow(ramp, [0.0], p, periods=1, period=1.0, max_steps=3).status[0] == st.BUDGET_STEPS
    assert flow(ramp, [0.0], p, periods=1, period=1.0, max_events=1).status[0] == st.BUDGET_EVENTS
    assert flow(ramp, [0.0], p, periods=1, period=1.0, max_events=2).status[0] == st.OK


@pytest.mark.nojit
def test_a_solution_that_blows_up_ends_with_a_status_and_a_finite_state(ramp):
    # x = 1/(1 - t)
    r = flow(ramp, [1.0], np.array([[0.0, 1.0, -9.0, -9.0, 0.0]]), periods=2, period=1.0)
    assert r.status[0] == st.NONFINITE
    assert np.isfinite(r.state).all()
    assert r.count[0] + r.phase[0] == pytest.approx(1.0, abs=1e-4)


@pytest.mark.nojit
def test_no_time_to_run_is_ok(ramp):
    r = flow(ramp, [0.1], np.array([[1.0, 0.0, 0.35, 0.6, 0.0]]), period=1.0, samples=[(0, 0.0)])
    assert r.status[0] == st.OK
    assert r.samples[0, 0, 0] == 0.1
