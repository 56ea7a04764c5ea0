"""Rule 8: a tangency is a `graze` record and no change of mode; one within rounding is
`graze_unresolved` and flags the result.
"""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

import saltus as sl
from conformance.systems import EPS, contacts, lab, pair, quartic, quartic_with_roots, ring

# these tests look at the status themselves
pytestmark = [
    pytest.mark.filterwarnings("ignore::saltus.errors.SaltusWarning"),
    pytest.mark.usefixtures("exact_method"),
]

PARABOLA = lab.with_values(lift=-2.0)  # x = 2 t - t^2 from (0, 2): its top is 1, at t = 1
EIGHTHS = [i / 8 for i in range(1, 8)]


def _owned_up(run, trajectory, touch):
    """Whether a touch below rounding is on record: one exact graze, or anything at all and the
    status says that it can't be trusted.
    """
    kinds = [c.kind for c in contacts(run, trajectory) if abs(c.time - touch) < 1e-5]
    status = str(run.status.values if trajectory is None else run.status.values[trajectory])
    return kinds == ["graze"] or (bool(kinds) and status == "graze_unresolved")


@pytest.mark.parametrize("t_end", [1.5, 2.0, 3.0, 50.0])
def test_exact_tangency(t_end):
    """x'' = -2, boundary 1: one graze at t = 1, no change of mode, nothing else."""
    run = sl.simulate(PARABOLA, (0.0, 2.0), t_end=t_end, samples=4)
    (graze,) = contacts(run)
    assert (graze.time, graze.kind, graze.velocity) == (1.0, "graze", 0.0)
    assert graze.before == graze.after == 0
    assert (
        str(run.status.values),
        int(run.grazes),
        int(run.events),
        int(run.grazes_unresolved),
    ) == ("ok", 1, 0, 0)
    assert not run.mode.values.any()
    assert float(run.smallest_gap_margin) == 0.0


def test_exact_tangency_where_a_contact_would_matter():
    """As above with a spring, a preload and a dashpot beyond the boundary: the motion is that of
    free flight to the last bit.
    """
    touching = PARABOLA.with_values(stiffness=1e4, preload=3.0, dashpot=5.0)
    run, free = (
        sl.simulate(system, (0.0, 2.0), t_end=3.0)
        for system in (touching, touching.with_values(boundary=9.0))
    )
    assert float(run.end_x) == float(free.end_x) == -3.0
    assert (int(run.grazes), int(run.events)) == (1, 0)


def test_tangency_from_within_contact():
    """A body pulled back out of contact just touches the boundary from inside: a graze too, and it
    stays in contact.
    """
    run = sl.simulate(lab.with_values(boundary=0.0, lift=2.0), (1.0, -2.0), t_end=3.0, samples=4)
    (graze,) = contacts(run)
    assert (graze.time, graze.kind, graze.before, graze.after) == (1.0, "graze", 1, 1)


@pytest.mark.parametrize("t_end", [1.0, 1.5])
def test_tangency_where_a_run_ends_and_the_next_begins(t_end):
    """A tangency at the very end of a run: no change of mode there; continued, the free flight goes
    on free.
    """
    run = sl.simulate(PARABOLA.with_values(stiffness=100.0), (0.0, 2.0), t_end=t_end, samples=4)
    on = sl.simulate(
        PARABOLA.with_values(stiffness=100.0),
        (float(run.end_x), float(run.end_v)),
        t_start=t_end,
        t_end=3.0,
        samples=4,
    )
    found = contacts(run) + contacts(on)
    assert [c.kind for c in found] == ["graze"]
    assert all(c.before == c.after for c in found)
    assert float(on.end_x) == pytest.approx(-3.0, abs=1e-15)


def test_grazes_of_two_bodies_at_one_instant():
    """Two bodies touch their stops at t = 1: two grazes."""
    run = sl.simulate(
        pair.with_values(lift=-2.0, gap=9.0), (0.0, 2.0, 0.0, 2.0), t_end=3.0, samples=2
    )
    assert [(c.guard, c.kind, c.time) for c in contacts(run)] == [
        ("stop1", "graze", 1.0),
        ("stop2", "graze", 1.0),
    ]
    assert int(run.grazes) == 2


@pytest.mark.parametrize("far", ["stop1", "stop2"])
def test_grazes_of_two_bodies_in_one_step(far):
    """Two bodies touch their stops at t = 1 and t = 2, both within one step: two grazes, in the
    order of time whichever comes first.
    """
    near, speeds = {"stop1": ("stop2", (4.0, 2.0)), "stop2": ("stop1", (2.0, 4.0))}[far]
    values = {"lift": -2.0, "gap": 99.0, far: 4.0}
    start = (0.0, speeds[0], 0.0, speeds[1])
    run = sl.simulate(pair.with_values(**values), start, t_end=5.0, samples=2)
    assert [(c.guard, c.kind, c.time) for c in contacts(run)] == [
        (near, "graze", 1.0),
        (far, "graze", 2.0),
    ]


@pytest.mark.parametrize("periods", [1, 2, 3])
def test_tangency_where_a_period_ends(periods):
    """One graze at t = 1, where steps end: in a run that goes on, and in one that doesn't."""
    run = sl.simulate(PARABOLA.with_values(frequency=1.0), (0.0, 2.0), periods=periods, samples=4)
    assert [(c.time, c.kind) for c in contacts(run)] == [(1.0, "graze")]
    assert str(run.status.values) == "ok"
    assert int(run.mode[-1]) == 0


def test_two_grazes_of_one_body_in_one_step():
    """x = (t - 1)^2 (t - 2)^2: two touches within one step, each recorded (exact, or unresolved
    where rounding hides it).
    """
    run = sl.simulate(quartic, quartic_with_roots(1, 1, 2, 2), t_end=3.0, samples=2)
    assert {round(c.time, 6) for c in contacts(run)} == {1.0, 2.0}
    assert _owned_up(run, None, 1.0)
    assert _owned_up(run, None, 2.0)


def test_crossings_beyond_a_graze_are_found():
    """x = (t - 1)^2 (t - 2) (t - 3): touches, then crosses twice."""
    run = sl.simulate(quartic, quartic_with_roots(1, 1, 2, 3), t_end=4.0, samples=2)
    assert [(round(c.time, 12), c.direction) for c in contacts(run) if c.kind == "crossing"] == [
        (2.0, -1),
        (3.0, 1),
    ]
    assert [round(c.time, 6) for c in contacts(run) if c.kind != "crossing"] == [1.0]


@pytest.mark.parametrize("offset", [1.0, -1.0])
def test_tangent_of_a_circle(offset):
    """A straight flight along the tangent y = 1 of the unit circle touches it at x = 0."""
    run = sl.simulate(ring.with_values(wind=5.0), (-2.0, offset, 1.0, 0.0), t_end=4.0, samples=4)
    (graze,) = contacts(run)
    assert (graze.time, graze.kind, graze.before, graze.after) == (2.0, "graze", 1, 1)
    assert float(run.end_x) == 2.0


# -- within rounding -------------------------------------------------------------------------------
@pytest.mark.parametrize("t_end", [1.0, 1.1, 2.0])
def test_touch_within_rounding_is_flagged(t_end, exact_method, request):
    """x = (t - a)^2 (t - b) (t - c), a, b, c at eighths: whether the gap closes at a is below
    rounding; record and status say so.
    """
    if exact_method == "Modal":  # one in a hundred: docs/trust.md
        request.applymarker(pytest.mark.xfail(reason="rounding of earlier steps isn't counted"))
    triples = [
        (a, b, c)
        for a in EIGHTHS
        for b in [*EIGHTHS, -0.5, 1.5]
        for c in [*EIGHTHS, 1.25]
        if len({a, b, c}) == 3 and b < c
    ]
    run = sl.simulate(
        quartic,
        np.array([quartic_with_roots(a, a, b, c) for a, b, c in triples]),
        t_end=t_end,
        samples=2,
    )
    silent, wrong = [], []
    for i, (a, *others) in enumerate(triples):
        if not _owned_up(run, i, a):
            silent.append((a, *others))
        sure = [c.time for c in contacts(run, i) if c.kind == "crossing" and abs(c.time - a) > 1e-5]
        if sure != pytest.approx([r for r in others if 0 < r < t_end], abs=1e-9):
            wrong.append((a, *others))
    assert (len(silent), len(wrong)) == (0, 0), (
        f"of {len(triples)}; first: {silent[:2]}, {wrong[:2]}"
    )


@pytest.mark.parametrize("ulps", [-2, -1, 1, 2])
def test_parabola_an_ulp_from_the_boundary_is_flagged(ulps):
    """The top of x(t) = 0.1 + ... lies within a few ulp of the boundary, and the sum is rounded:
    unresolved whichever way it falls.
    """
    speed = 2 * math.sqrt(0.9)  # not a double: top = 1 to an ulp
    boundary = 1 + ulps * EPS / 2
    run = sl.simulate(PARABOLA.with_values(boundary=boundary), (0.1, speed), t_end=3.0, samples=2)
    assert str(run.status.values) == "graze_unresolved"
    assert int(run.grazes_unresolved) >= 1
    assert all(abs(c.time - speed / 2) < 1e-7 for c in contacts(run))


def test_touch_within_rounding_of_the_end_is_flagged():
    """The top of x0 + v t - t^2, t = v / 2, is the end of the run; the boundary is a double beside
    it. No run says nothing, and none takes rounding for two crossings without a word.
    """
    x0, v = 0.1 * np.random.default_rng(3).uniform(-1, 1, 60), 1.375
    top = x0 + v**2 / 4  # rounded, in some cases
    run = sl.simulate(
        PARABOLA.with_values(stiffness=50.0), {"x": x0, "v": v}, t_end=v / 2, samples=2,
        values={"boundary": top},
    )  # fmt: skip
    exact = [
        Fraction(a) + Fraction(v) ** 2 / 4 == Fraction(b) for a, b in zip(x0, top, strict=True)
    ]
    kinds = [{"graze"} if one else {"graze_unresolved"} for one in exact]
    assert 0 < sum(exact) < 60
    assert [{c.kind for c in contacts(run, i)} for i in range(60)] == kinds
    assert run.status.values.tolist() == ["ok" if one else "graze_unresolved" for one in exact]


@pytest.mark.parametrize("root", [0.3, 0.7, 1.1, 1.7])
def test_touch_after_leaving_a_boundary_at_zero_is_flagged(root):
    """x = t (t - a)^2: leaves the boundary x = 0 at the start, so the gap's own terms are zero
    there; its rounding error at a isn't.
    """
    run = sl.simulate(
        quartic.with_values(snap=0.0), (0.0, root * root, -4 * root, 6.0), t_end=2.5, samples=2
    )
    assert _owned_up(run, None, root)


@pytest.mark.parametrize("root", [0.5, 0.3, 0.75, 1.0])
def test_touch_of_fourth_order(root):
    """x = (t - a)^4: a touch without velocity, acceleration or jerk. It may be unresolved; it may
    not pass in silence.
    """
    run = sl.simulate(quartic, quartic_with_roots(root, root, root, root), t_end=1.7, samples=2)
    assert contacts(run)
    assert all(abs(c.time - root) < 1e-2 for c in contacts(run))
    assert {c.kind for c in contacts(run)} == {"graze"} or str(
        run.status.values
    ) == "graze_unresolved"
    assert int(run.mode[-1]) == 1


def test_shallow_contact_beyond_rounding_is_trusted():
    """Depths of 100 to 10^6 ulp: two crossings, status ok. Nothing is flagged that needn't be."""
    boundary = 1 - 10.0 ** np.arange(2, 7) * EPS
    run = sl.simulate(PARABOLA, (0.0, 2.0), t_end=3.0, samples=2, values={"boundary": boundary})
    assert run.events.values.tolist() == [2] * 5
    assert set(run.status.values.tolist()) == {"ok"}


# -- the smallest margin ---------------------------------------------------------------------------
@pytest.mark.parametrize("margin", [1e-12, 1e-9, 1e-6, 1e-3, 0.03, 0.5])
def test_smallest_margin_of_an_oscillation(margin):
    """x = sin t never meets the boundary at 1 + margin: the smallest margin is the margin, neither
    more nor less, near or far.
    """
    run = sl.simulate(
        lab.with_values(spring=1.0, boundary=1 + margin), (0.0, 1.0), t_end=60.0, samples=2
    )
    assert contacts(run) == []
    assert float(run.smallest_gap_margin) == pytest.approx((1 + margin) - 1, rel=1e-14, abs=4e-15)


@pytest.mark.parametrize("margin", [1e-3, 0.03, 0.3])
def test_smallest_margin_of_a_damped_swing(margin):
    """Let go at -1, a damped oscillator comes to exp(-sigma pi / wd), and never so far again."""
    sigma = 0.1
    top = math.exp(-sigma * math.pi / math.sqrt(1 - sigma**2))
    run = sl.simulate(
        lab.with_values(spring=1.0, damping=2 * sigma, boundary=top + margin),
        (-1.0, 0.0),
        t_end=30.0,
        samples=2,
    )
    assert contacts(run) == []
    assert float(run.smallest_gap_margin) == pytest.approx(margin, abs=16 * EPS)


@pytest.mark.parametrize("lean", [-1.0, 0.0, 1.0, 2.0])
def test_smallest_margin_of_a_lopsided_turn(lean):
    """x = (t - 1)^2 (t^2 + lean t + 3) + 0.3 turns at 0.3, where its leading terms at t = 0 don't
    say so.
    """
    c = np.polyadd(np.polymul([1, -2, 1], [1, lean, 3]), [0.3])[::-1]
    run = sl.simulate(quartic, (c[0], c[1], 2 * c[2], 6 * c[3]), t_end=3.0, samples=2)
    assert contacts(run) == []
    assert float(run.smallest_gap_margin) == pytest.approx(0.3, abs=64 * EPS)


@sl.system(states="x u y w")
def turned(t, x, u, y, w, *, push=3.0, level=0.0, force=0.0):
    """y falls and rises with acceleration 1, and with more as soon as x is beyond a boundary; so it
    comes less near to its own.
    """
    return (
        u,
        0.0 * x,
        w,
        1.0
        + sl.piecewise((push, x > level), otherwise=0)
        + sl.piecewise((force, y < level), otherwise=0),
    )


@pytest.mark.parametrize("x", [-0.5, -0.9, -0.999, -1.001, -1.5])
def test_smallest_margin_is_of_turns_that_happen(x):
    """x = x0 + t crosses zero at t = -x0. If that is before t = 1, y = 0.6 - t + t^2 / 2 turns
    sooner than at 0.1.
    """
    run = sl.simulate(turned, (x, 1.0, 0.6, -1.0), t_end=2.0, samples=2)
    at = min(-x, 1.0)
    margin = 0.6 - at + at**2 / 2 - (1.0 - at) ** 2 / (2 * 4.0)
    assert float(run.smallest_gap_margin) == pytest.approx(margin, abs=16 * EPS)


def test_smallest_contact_speed():
    """The smallest |d gap/dt| of all contacts of a trajectory."""
    run = sl.simulate(
        sl.models.delangre("b"), {"x": [1e-3, 2e-3, -3e-3], "v": [0.0, 0.5, -0.2]}, periods=10
    )
    for i in range(3):
        slowest = min(abs(c.velocity) for c in contacts(run, i))
        assert float(run.smallest_contact_speed[i]) == slowest
