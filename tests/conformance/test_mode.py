"""Rule 11: at every node the gap has the sign that the mode says. No stop is ever passed through
unnoticed.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import saltus as sl
from conformance.systems import contacts, pair, walls

pytestmark = pytest.mark.usefixtures("exact_method")


def _check_sides(run, gaps, slack):
    """Mode bits against the signs of the gaps, where these are larger than the slack; everything on
    the way was counted.
    """
    for bit, gap in enumerate(gaps):
        clear = np.abs(gap.values) > slack
        assert clear.mean() > 0.9
        assert ((run.mode.values >> bit & 1).astype(bool) == (gap.values > 0))[clear].all()
    assert not run.mode_violations.any()


def _flips_match(run, guards):
    """Crossings of each guard make the difference of its side between start and end,
    alternating.
    """
    for i in range(run.sizes["trajectory"]):
        for bit, guard in enumerate(guards):
            directions = [
                c.direction
                for c in contacts(run, i)
                if c.guard == guard and c.kind != "graze" and c.before != c.after
            ]
            assert all(a == -b for a, b in itertools.pairwise(directions))
            if directions:
                assert bool(run.mode.values[i, -1] >> bit & 1) == (directions[-1] > 0)


@pytest.mark.parametrize(
    ("case", "frequency", "stiffness", "count", "periods"),
    [
        ("a", 16.0, 1.4e4, 256, 40),
        ("b", 15.0, 1.4e4, 256, 40),
        ("c", 5.0, 1.4e7, 16, 5),
        ("c", 23.0, 1.4e10, 16, 5),
    ],
)
def test_sides_of_the_rig(case, frequency, stiffness, count, periods):
    """Random starts, soft and hard springs: at every sample the sides are those of the gaps; no
    spring is bent beyond what energy allows.

    The stiffest bounces thousands of times while the beams press the mass onto the stop.
    """
    rng = np.random.default_rng(5)
    rig = sl.models.delangre(case, frequency=frequency, contact_stiffness=stiffness)
    start = {"x": rng.uniform(-5e-3, 5e-3, count), "v": rng.uniform(-1, 1, count)}
    run = sl.simulate(rig, start, periods=periods, samples=50, time_errors="local")
    assert set(run.status.values.tolist()) <= {"ok", "graze_unresolved"}
    _check_sides(run, [run.x + rig.values["lower_gap"], run.x - rig.values["upper_gap"]], 1e-13)
    _flips_match(run.isel(trajectory=slice(0, 8)), ["lower_gap", "upper_gap"])
    depth = 2 * np.sqrt(1.0 / (stiffness / 3)) + 6e-3
    assert float(np.abs(run.x).max()) < depth


def test_sides_of_a_chain_of_three_boundaries():
    """64 random starts of two bodies with stops and a gap between them, and the same in extremely
    stiff.
    """
    rng = np.random.default_rng(6)
    start = {name: rng.uniform(-1, 1, 64) for name in ("x1", "v1", "x2", "v2")}
    for stiff in (50.0, 1e8):
        system = pair.with_values(
            spring=4.0,
            stop1=0.3,
            stop2=0.4,
            gap=0.5,
            stiffness1=stiff,
            stiffness2=stiff / 3,
            stiffness=stiff / 2,
        )
        run = sl.simulate(system, start, t_end=50.0, samples=1000, time_errors="local")
        _check_sides(run, [run.x1 - 0.3, run.x1 - run.x2 - 0.5, run.x2 - 0.4], 1e-12)
        _flips_match(run, ["stop1", "gap", "stop2"])
        assert set(run.status.values.tolist()) <= {"ok", "graze_unresolved"}


def test_sides_of_walls_with_corners():
    """The moving wall, |x| and the ceiling at once, all with springs."""
    rng = np.random.default_rng(8)
    system = walls.with_values(
        moving_stiffness=300.0, stiffness=200.0, ceiling=1.5, ceiling_stiffness=500.0, width=1.0
    )
    run = sl.simulate(
        system,
        {"x": rng.uniform(-1.5, 1.5, 64), "v": rng.uniform(-2, 2, 64)},
        periods=20,
        samples=50,
        time_errors="local",
    )
    wall = 0.5 * np.cos(2 * np.pi * run.time)
    assert [str(name) for name in run.guard.values[1:]] == ["x = 0", "width", "ceiling"]
    _check_sides(run, [run.x - wall, run.x, np.abs(run.x) - 1.0, run.x - 1.5], 1e-12)


def test_a_large_batch_violates_nothing():
    """10^5 contacts of 2000 random starts in case b at 15 Hz: every trajectory ends by name, none
    on a wrong side.
    """
    rng = np.random.default_rng(9)
    start = {"x": rng.uniform(-5e-3, 5e-3, 2000), "v": rng.uniform(-1, 1, 2000)}
    run = sl.simulate(sl.models.delangre("b"), start, periods=20, samples=1, time_errors="local")
    assert int(run.events.sum()) > 90_000
    assert int(run.mode_violations.sum()) == 0
    assert set(run.status.values.tolist()) <= {"ok", "graze_unresolved"}
    # no graze within rounding among them
    assert run.sizes["contact"] == int(run.events.sum() + run.grazes.sum())


def test_a_side_that_lies_ends_the_run():
    """A trajectory that is taken up on the wrong side of a boundary, or as standing on one that is
    far away, isn't followed by equations that aren't its own.
    """
    from saltus.flow.flight import Flight
    from saltus.kernels import status as st

    system = sl.models.impact_oscillator()
    rig = sl.models.delangre("b")
    for model, lie in ((rig, "mode"), (system, "mode"), (system, "fresh")):
        start = np.array([[-1e-5, 0.0], [-2e-5, 0.0]])
        values = np.array([list(model.values.values())])
        flight = Flight(model, sl.Taylor(), start, values, np.full(2, model.period()), 10)
        flight.advance(1)
        assert flight.status.tolist() == [st.OK, st.OK]
        if lie == "mode":
            flight._arrays["mode"][1] ^= 1
        else:
            flight._arrays["carry"][1, -len(model.guards)] = 1.0
        flight.advance(1)
        assert flight.status.tolist() == [st.OK, st.MODE_VIOLATION]
        assert st.STATUS[st.MODE_VIOLATION][0] == "mode_violation"
