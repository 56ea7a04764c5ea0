"""Who is stopped for being slow: what stands still soon, what is slow on the whole after a million
steps, nobody else.
"""

import numpy as np
import pytest

import saltus as sl
from saltus.errors import SaltusWarning
from saltus.flow.pace import CHECK_STEPS, LONG_CHECK_STEPS, MIN_PROGRESS, marks, resume
from saltus.kernels import status as st


def batch(count=1, end=100):
    zero = np.zeros(count, np.int64)
    return {
        "status": zero + st.RUNNING, "counters": np.zeros((count, len(st.COUNTERS)), np.int64),
        "count": zero.copy(),
        "phase": np.zeros(count), "period": np.full(count, 2.0), "end_count": zero + end,
        "end_phase": np.zeros(count), **marks(count),
    }  # fmt: skip


def stopped(arrays, steps, periods, due=1e-3):
    """Whether trajectories go on that were stopped after so many steps and periods."""
    arrays["counters"][:, st.STEPS], arrays["status"][:] = steps, st.BUDGET_STEPS
    arrays["count"][:] = np.floor(periods)
    arrays["phase"][:] = 2.0 * (periods - np.floor(periods))
    went_on = resume(arrays, due)
    assert went_on == (arrays["status"] == st.RUNNING).any()
    return (arrays["status"] == st.RUNNING).tolist()


def test_what_stands_still_goes_on_once_and_is_stopped_at_the_second_look():
    arrays = batch()
    assert stopped(arrays, CHECK_STEPS + 1, 3.25) == [True]
    assert stopped(arrays, 2 * (CHECK_STEPS + 1), 3.25 + 0.5 * MIN_PROGRESS * 96) == [False]
    assert stopped(arrays, 2 * (CHECK_STEPS + 1), 3.25 + 0.5 * MIN_PROGRESS * 96) == [False], (
        "asked again it is the same"
    )


def test_what_only_creeps_goes_on_until_a_million_steps_say_otherwise():
    arrays = batch()
    for look in range(1, LONG_CHECK_STEPS // CHECK_STEPS):
        assert stopped(arrays, look * CHECK_STEPS, 3.0 + 1e-5 * look) == [True]
    assert stopped(arrays, LONG_CHECK_STEPS, 3.0005) == [True], "three periods were fast"
    for look in range(1, LONG_CHECK_STEPS // CHECK_STEPS):
        assert stopped(arrays, LONG_CHECK_STEPS + look * CHECK_STEPS, 3.0005 + 1e-5 * look) == [
            True
        ]
    assert stopped(arrays, 2 * LONG_CHECK_STEPS, 3.001) == [False]


def test_a_burst_of_steps_is_forgiven():
    arrays = batch()
    assert stopped(arrays, CHECK_STEPS, 0.0) == [True]
    assert stopped(arrays, 3 * CHECK_STEPS, 1e-9) == [True], (
        "the look between the two was fast enough"
    )
    assert stopped(arrays, 4 * CHECK_STEPS, 1e-4) == [True]


def test_each_is_judged_alone():
    arrays = batch(3)
    stopped(arrays, CHECK_STEPS, np.array([1.0, 2.0, 3.0]))
    assert stopped(arrays, 2 * CHECK_STEPS, np.array([1.0, 2.5, 3.0])) == [False, True, False]


@sl.system(states="h", units={"h": "m"})
def tank(t, h, *, c="0.3 m^0.5/s"):
    return -c * sl.sqrt(h)


def test_a_tank_that_runs_empty_is_told_soon_and_where_it_is_empty():
    """h = (sqrt(h0) - c t/2)^2: empty after 2 sqrt(h0)/c; the root has no derivative there."""
    start = np.array([0.7, 0.31, 0.9])
    with pytest.warns(
        SaltusWarning,
        match="No number of steps gets over such a root: end the law a little before it",
    ):
        run = sl.simulate(tank, {"h": start}, t_end=10, samples=4, progress=False)
    assert set(run.status.values.tolist()) == {"budget_steps"}
    np.testing.assert_allclose(run.end_time, 2 * np.sqrt(start) / 0.3, rtol=1e-7)
    assert run.steps.max() < 5 * CHECK_STEPS
    with pytest.warns(SaltusWarning, match="budget_steps"):
        alone = sl.simulate(tank, [start[0]], t_end=10, samples=4, progress=False)
    assert (alone.steps.item(), alone.end_time.item()) == (
        run.steps.values[0],
        run.end_time.values[0],
    ), "whatever else is in the batch"


def test_a_trial_step_of_ode45_below_the_root_is_explained():
    with pytest.warns(
        SaltusWarning,
        match="A trial step of ODE45 that goes below a root ends it too: end the law before it",
    ):
        run = sl.simulate(tank, [0.7], t_end=10, samples=4, progress=False, method=sl.ODE45())
    assert run.status.item() == "nonfinite"


def test_with_a_budget_of_ones_own_nobody_is_asked():
    with pytest.warns(SaltusWarning, match="budget_steps"):
        run = sl.simulate(
            tank, [0.7], t_end=10, samples=4, progress=False, method=sl.Taylor(max_steps=70_000)
        )
    assert run.steps.item() == 70_001


def test_a_tank_whose_law_ends_before_the_root_rests_empty():
    @sl.system(states="h", units={"h": "m"})
    def mended(t, h, *, c="0.3 m^0.5/s"):
        return sl.piecewise((-c * sl.sqrt(h), h > 1e-9), otherwise=0.0)

    run = sl.simulate(mended, [0.7], t_end=10, samples=4, progress=False)
    assert run.end_h.item() == pytest.approx(1e-9)
    assert run.status.item() == "ok"
