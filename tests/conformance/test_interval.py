"""Rule 7: the interval (t0, t_end]. What lies at t0 is an initial condition, what lies at t_end is
reported once, and never twice.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl
from conformance.systems import contacts, lab, pair, slider, walls
from oracles import cut_check

pytestmark = pytest.mark.usefixtures("exact_method")

FLIGHT = lab.with_values(boundary=0.0)  # x' = v, nothing else


@pytest.mark.parametrize("t_end", [1.0, 0.5, 0.75, 3.0])
def test_event_exactly_at_the_end_is_reported_once(t_end):
    """x = t - t_end arrives at the boundary at t_end exactly, the first event of its life."""
    run = sl.simulate(FLIGHT, (-t_end, 1.0), t_end=t_end, samples=4)
    (only,) = contacts(run)
    assert (only.time, only.kind, only.direction, only.before, only.after) == (
        t_end,
        "crossing",
        1,
        0,
        1,
    )
    assert (float(run.end_x), int(run.events)) == (0.0, 1)


def test_second_event_exactly_at_the_end_is_reported_once():
    """x = -1 + 2 t - t^2 / 2 ... crosses 0.5 at t = 1 and again at t = 3, the end."""
    run = sl.simulate(lab.with_values(lift=-1.0, boundary=0.5), (-1.0, 2.0), t_end=3.0, samples=4)
    assert [(c.time, c.direction) for c in contacts(run)] == [(1.0, 1), (3.0, -1)]


def test_event_at_the_end_of_one_run_is_not_an_event_of_the_next():
    """Ended exactly on the boundary and continued from there: in contact by its velocity, no second
    report.
    """
    first = sl.simulate(FLIGHT, (-1.0, 1.0), t_end=1.0, samples=4)
    second = sl.simulate(
        FLIGHT, (float(first.end_x), float(first.end_v)), t_start=1.0, t_end=2.0, samples=4
    )
    assert [c.time for c in contacts(first) + contacts(second)] == [1.0]
    assert int(second.mode_violations) == 0


def test_event_just_beyond_the_end_is_not_reported():
    run = sl.simulate(FLIGHT, (-np.nextafter(1.0, 2.0), 1.0), t_end=1.0, samples=4)
    assert (contacts(run), float(run.end_x)) == ([], 1.0 - np.nextafter(1.0, 2.0))


def test_no_contact_is_later_than_the_end(exact_method):
    """t_start + (t_end - t_start) rounds beyond t_end: a contact there, the end of the run and its
    last sample are at t_end. Modes go there in several steps, whose rounding may leave the body
    before the boundary: then the run that goes on meets it at once.
    """
    rng = np.random.default_rng(5)
    begin, end = rng.uniform(0, 1, 400), rng.uniform(1, 5, 400)
    late = np.flatnonzero(begin + (end - begin) > end)
    assert len(late) >= 5
    for i in late[:5]:
        for system in (FLIGHT, pair.with_values(stop1=0.0, stop2=9.0, gap=99.0)):
            still = [0.0] * (len(system.states) - 2)
            run = sl.simulate(
                system,
                (-(end[i] - begin[i]), 1.0, *still),
                t_start=begin[i],
                t_end=end[i],
                samples=4,
            )
            met = [c.time for c in contacts(run)]
            if exact_method == "Modal" and not met:
                ended = [float(run[f"end_{name}"]) for name in system.states]
                on = sl.simulate(system, ended, t_start=end[i], t_end=end[i] + 1.0, samples=4)
                met = [end[i] for c in contacts(on) if c.time <= end[i] + 4 * np.spacing(end[i])]
            assert met == [end[i]]
            assert float(run.end_time) == end[i]
            assert run.time.values.max() <= end[i]


@pytest.mark.parametrize("whole", [1, 2, 5])
def test_event_exactly_at_a_whole_period_is_reported_once(whole):
    """The clock turns over at every period; an event exactly there is reported in one of the two,
    at the end of a run too.
    """
    system = FLIGHT.with_values(frequency=1.0)
    for periods in (whole, 6):
        run = sl.simulate(system, (-float(whole), 1.0), periods=periods, samples=4)
        assert [(c.time, c.direction) for c in contacts(run)] == [(float(whole), 1)]


def test_several_boundaries_exactly_at_the_end():
    """Two bodies and their distance arrive at t = 1, the end: three events, once each; none when
    continued.
    """
    system = pair.with_values(stop1=1.0, stop2=-1.0, gap=2.0)
    run = sl.simulate(system, (0.0, 1.0, 0.0, -1.0), t_end=1.0, samples=4)
    assert sorted((c.guard, c.time, c.direction) for c in contacts(run)) == [
        ("gap", 1.0, 1),
        ("stop1", 1.0, 1),
        ("stop2", 1.0, -1),
    ]
    on = sl.simulate(
        system,
        [float(run[f"end_{name}"]) for name in system.states],
        t_start=1.0,
        t_end=2.0,
        samples=4,
    )
    assert contacts(on) == []


def test_moving_boundary_at_the_end_far_from_the_origin_of_time():
    """x = 0.3 meets 0.5 cos(2 pi t) near t = 0.148; a run from 1e6 s that ends 1e-9 s before
    doesn't report it, 1e-9 s after does.
    """
    instant = np.arccos(0.6) / (2 * np.pi)
    for ends, count in ((instant - 1e-9, 0), (instant + 1e-9, 1)):
        run = sl.simulate(walls, (0.3, 0.0), t_start=1e6, t_end=1e6 + ends, samples=4)
        assert len(contacts(run)) == count


# -- a run cut in two ------------------------------------------------------------------------------
def _halves(system, start, cut, t_end, method=None):
    given = {"samples": 4, "method": method, "progress": False}
    first = sl.simulate(system, start, t_end=cut, **given)
    state = [float(first[f"end_{name}"]) for name in system.states]
    second = sl.simulate(system, state, t_start=cut, t_end=t_end, **given)
    return contacts(first), contacts(second), second


BOUND = pair.with_values(
    spring=4.0, stop1=0.3, stop2=0.4, gap=0.5, stiffness1=50.0, stiffness2=9.0, stiffness=20.0
)
MOTIONS = {
    "rig": (sl.models.delangre("b"), (1e-3, 0.0), 0.4),
    "slider": (slider.with_values(friction=0.5), (0.1,), 5.0),
    "pair": (BOUND, (0.0, 1.0, 0.1, -1.0), 5.0),
}


@pytest.mark.parametrize("shift", [-1, 0, 1])
@pytest.mark.parametrize("name", MOTIONS)
def test_cut_at_a_contact(name, shift):
    """Cut at each contact of a run, or an ulp beside it, and continued: every contact is reported
    once in all, none twice, none lost.
    """
    system, start, t_end = MOTIONS[name]
    whole = contacts(sl.simulate(system, start, t_end=t_end, samples=4))
    assert len(whole) >= 8
    for contact in whole[:8]:
        cut = contact.time + shift * np.spacing(contact.time)
        before, after, end = _halves(system, start, cut, t_end)
        assert [(c.guard, c.direction) for c in before + after] == [
            (c.guard, c.direction) for c in whole
        ], (contact, before, after)
        assert [c.time for c in before + after] == pytest.approx([c.time for c in whole], abs=1e-12)
        assert int(end.mode_violations) == 0


def test_cut_anywhere():
    """Cut at 20 random times: the same contacts and the same end, to the rounding of a chaotic
    motion over half a second.
    """
    rig = sl.models.delangre("b")
    whole = sl.simulate(rig, (1e-3, 0.0), t_end=0.4, samples=4)
    for cut in np.random.default_rng(7).uniform(0.01, 0.39, 20):
        before, after, end = _halves(rig, (1e-3, 0.0), float(cut), 0.4)
        assert [c.guard for c in before + after] == [c.guard for c in contacts(whole)]
        assert float(abs(end.end_x - whole.end_x)) < 1e-14


# -- the same of structures, and of friction, by both methods --------------------------------------
CUT = [(kind, "Modal") for kind in ("soft", "rigid", "rigid pair", "clay", "clays")]
CUT += [(kind, "Taylor") for kind in ("soft", "rigid", "rigid pair", "rough")]
SECTIONS = {"soft": "stretch turns", "rough": None}  # no speed that an impact turns


@pytest.mark.parametrize(("kind", "method"), CUT)
def test_structures_cut_anywhere(kind, method):
    """Three masses by their modes, and a section of an output: cut at random times, at contacts,
    and some ulp beside them, every contact of the whole run is in one of the parts, and the end is
    the same. ``python -m oracles.cut_check`` draws hundreds, of more kinds.
    """
    rng = np.random.default_rng(2026)
    system = cut_check.made(kind, SECTIONS.get(kind, ("tip", 1.3e-3)))
    found = cut_check.cuts(
        *cut_check.drawn(kind, system, rng), cut_check.METHODS[method], rng, most=5
    )
    assert len(found) == 27
    assert [row for row in found if row[2]] == []


@sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
def caught(t, x, v, *, w=3.0, push=4.0, gap=0.1):
    return v, push * sl.sin(w * t) - x, sl.impact(x < gap, v, restitution=0.0)


@pytest.mark.nojit
@pytest.mark.parametrize("method", [sl.Taylor(), sl.Modal()], ids=lambda one: one.name)
@pytest.mark.parametrize("gap", [0.0735, 0.2503])
def test_rest_on_a_stop_without_rebound_cut_where_it_ends(gap, method):
    """What presses the body is push sin(w t) - gap until it leaves. The state says nothing of it:
    it is the same all the time.
    """
    system = caught.with_values(gap=gap)
    leaves = (math.pi - math.asin(gap / 4.0)) / 3.0
    for shift in (-3, -1, 0, 1, 3):
        cut = leaves + shift * np.spacing(leaves)
        before, after, _ = _halves(system, (0.0, 0.0), cut, 1.2, method)
        rows = before + after
        assert [row.kind for row in rows] == ["impact", "hold", "release"], shift
        assert rows[-1].time == pytest.approx(leaves, abs=1e-14)


@sl.system(states="x y u v", forced_at="w", units={"w": "rad/s"})
def rubbed(t, x, y, u, v, *, w=3.0, level=1.1):
    force = sl.friction(0.3 * u - 0.7 * v, slip=level)
    push = 2 * sl.cos(w * t) - x - 0.3 * force
    return u, v, push, 0.5 * sl.sin(w * t) - 2 * y + 0.7 * force


@pytest.mark.nojit
@pytest.mark.parametrize("method", [sl.Taylor(), sl.Modal()], ids=lambda one: one.name)
@pytest.mark.parametrize("level", [0.4, 1.1])
def test_friction_cut_where_it_sticks_slides_and_turns(level, method):
    """Where it sticks its velocity, a sum, is rounding; so it is where it has nearly come to."""
    system, start = rubbed.with_values(level=level), (0.1, 0.0, 0.3, 0.1)
    whole = sl.simulate(system, start, t_end=2.0, samples=4, method=method, progress=False)
    for contact in contacts(whole):
        for shift in (-3, -1, 0, 1, 3):
            cut = contact.time + shift * np.spacing(contact.time)
            before, after, end = _halves(system, start, cut, 2.0, method)
            kinds = [
                [(c.kind, c.direction) for c in of] for of in (before + after, contacts(whole))
            ]
            assert kinds[0] == kinds[1], (contact.time, shift)
            assert end_of(end, system) == pytest.approx(end_of(whole, system), abs=1e-13)


def end_of(run, system):
    return np.array([float(run[f"end_{name}"]) for name in system.states])
