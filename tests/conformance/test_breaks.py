"""Boundaries that jump at a break of time: over the state, or away from under it. A contact at that
instant, made by no motion.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from conformance.systems import contacts, latch
from saltus.system.tangent import tangent_system

ALONE = sl.Taylor(lanes=2)


@sl.system(states="x v")
def stepping(t, x, v, *, early=1.0, late=0.5, instant=0.25, spring=0.0, stiffness=0.0, preload=0.0):
    """A unit mass and a wall that stands elsewhere from an instant on."""
    wall = sl.piecewise((late, t > instant), otherwise=early)
    return v, -spring * x - sl.piecewise((stiffness * (x - wall) + preload, x > wall), otherwise=0)


@sl.system(states="x v", forced_at="frequency")
def shuttle(t, x, v, *, frequency=17.0, shift=0.0, push=0.0):
    """A mass that nothing moves, and a wall that steps over it and back in every period."""
    wall = sl.piecewise((-1.0, sl.sin(2 * sl.pi * frequency * t + shift) > 0), otherwise=1.0)
    return v, sl.piecewise((push, x > wall), otherwise=0)


@pytest.mark.parametrize(
    ("start", "early", "late", "expected"),
    [
        pytest.param((0.45, 1.0), 1.0, 0.5, [(0.25, 1)], id="towards a body that comes"),
        pytest.param((0.75, 0.0), 1.0, 0.5, [(0.25, 1)], id="over a body at rest"),
        pytest.param(
            (0.75, 1.0), 0.875, 1.5, [(0.125, 1), (0.25, -1), (0.75, 1)], id="away, and met again"
        ),
        pytest.param((0.25, 1.0), 1.0, 0.5, [(0.25, 1)], id="to where the body is just then"),
        pytest.param(
            (0.25, 1.0), 0.5, 0.125, [(0.25, 1)], id="away behind a body that just arrives"
        ),
        pytest.param((0.25, 1.0), 0.5, 1.0, [(0.75, 1)], id="away before a body that just arrives"),
        pytest.param((0.25, 0.0), 1.0, 0.5, [], id="short of the body"),
    ],
)
def test_a_wall_that_steps(start, early, late, expected):
    """Free flight: contacts at the break and where x + v t meets the wall; no step went wrong, and
    no jump is shallow.
    """
    run = sl.simulate(
        stepping.with_values(early=early, late=late), start, t_end=1.0, samples=8, method=ALONE
    )
    assert [(c.time, c.direction, c.kind) for c in contacts(run)] == [
        (time, side, "crossing") for time, side in expected
    ]
    assert (int(run.mode_violations), str(run.status.values)) == (0, "ok")
    wall = np.where(run.time.values <= 0.25, early, late)
    clear = (run.time.values != 0.25) & (run.x.values != wall)
    assert (run.mode.values == (run.x.values > wall))[clear].all()


def test_a_wall_that_steps_away_within_an_ulp_of_a_landing():
    """The state stands on the boundary when that jumps away: it is on no boundary then, so the next
    crossing isn't taken for a return.
    """
    early = float(np.nextafter(0.75, 0.0))
    run = sl.simulate(
        stepping.with_values(early=early, late=1.5), (0.5, 1.0), t_end=2.0, samples=8, method=ALONE
    )
    assert [c.direction for c in contacts(run)] == [1, -1, 1]
    assert run.contact_time.values == pytest.approx([0.25, 0.25, 1.0], abs=1e-15)
    assert int(run.mode_violations) == 0


@pytest.mark.parametrize("end", [0.25, 0.75])
def test_a_wall_that_steps_at_the_end_of_the_run(end):
    """A contact at the end is reported once, and the state stays where it is."""
    run = sl.simulate(
        stepping.with_values(instant=end), (0.75, 0.0), t_end=end, samples=8, method=ALONE
    )
    assert [(c.time, c.direction, c.kind) for c in contacts(run)] == [(end, 1, "crossing")]
    assert (float(run.end_x), int(run.mode_violations), str(run.status.values)) == (0.75, 0, "ok")


@pytest.mark.parametrize("shift", [0.0, 1.0])
def test_a_wall_that_steps_in_every_period(shift):
    """Breaks at ends of periods, and within them: two contacts a period, for a thousand periods."""
    run = sl.stroboscope(shuttle.with_values(shift=shift), (0.25, 0.0), 1000, keep=1, method=ALONE)
    assert abs(run.events.item() - 2000) <= 1
    assert (run.mode_violations.item(), run.status.item()) == (0, "ok")


@pytest.mark.parametrize(
    ("system", "start", "end"),
    [
        (
            stepping.with_values(instant=0.3, spring=1.0, stiffness=9.0, preload=1.0),
            (0.45, 1.0),
            1.0,
        ),
        (latch.with_values(gain=0.4), (-0.35, 0.1), 5.0),
    ],
    ids=["a break", "another boundary"],
)
def test_tangent_where_a_boundary_jumps(system, start, end):
    """The instant of the jump doesn't depend on the state, or as that of the crossing which makes
    it: beside central differences.
    """
    both = tangent_system(system)
    moved = sl.simulate(
        both, (*start, 1.0, 0.0, 0.0, 1.0), t_end=end, samples=1, method=ALONE, time_errors="local"
    )
    tangent = np.array([[moved[f"end_d{a}/d{b}(0)"].item() for b in "xv"] for a in "xv"])
    step = 1e-6
    beside = np.array([start] * 4) + step * np.array([[1, 0], [-1, 0], [0, 1], [0, -1]])
    run = sl.simulate(system, beside, t_end=end, samples=1, method=ALONE, time_errors="local")
    ends = np.array([run.end_x.values, run.end_v.values])
    assert int(run.mode_violations.sum()) == 0
    assert tangent == pytest.approx((ends[:, 0::2] - ends[:, 1::2]) / (2 * step), abs=1e-8)
