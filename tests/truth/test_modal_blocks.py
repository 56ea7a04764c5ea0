"""Contact states whose modes don't go their own ways, by the modal flow, against exponentials of
matrices to 50 digits.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.system.linearity import linear_pieces

mpmath = pytest.importorskip("mpmath")
mp = mpmath.mp

from oracles.exact_contacts import check_contacts, exact_record  # noqa: E402


def moved(system, start, **kw):
    return sl.simulate(system, start, method=sl.Modal(), progress=False, time_errors="local", **kw)


@sl.system(states="x v", forced_at="frequency")
def struck(
    t, x, v, *, frequency=1 / (2 * np.pi), force=0.1, dead=0.0, gap=1.0, spring=1.0, damper=0.0,
    stiffness=50.0, loss=0.0,
):  # fmt: skip
    """An oscillator of frequency 1 with a stop."""
    stop = sl.where(x > gap, stiffness * (x - gap) + loss * v, 0.0)
    return v, force * sl.cos(2 * sl.pi * frequency * t) + dead - spring * x - damper * v - stop


CASES = {
    "exact resonance": {},
    "near resonance": {"spring": 1 + 1e-9},
    "resonance and a dead load": {"dead": 0.05},
    "critical in the stop": {"stiffness": 24.0, "loss": 10.0, "force": 0.3},
    "nearly critical in the stop": {"stiffness": 24.0, "loss": 10.0 * (1 - 1e-12), "force": 0.3},
    "critical everywhere": {"damper": 2.0, "force": 3.0},
    "overdamped": {"damper": 20.0, "force": 30.0, "loss": 50.0},
    "growing": {"damper": -0.05},
    "a very stiff stop": {"stiffness": 1e12, "damper": 0.01},
    "a body under its weight": {"spring": 0.0, "dead": 1.0, "stiffness": 1e6},
    "a weak spring under a weight": {"spring": 1e-9, "dead": 1.0, "stiffness": 1e6},
    "a body with a damper": {"spring": 0.0, "damper": 0.1, "dead": 1.0, "stiffness": 1e3},
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.slow
def test_an_oscillator_meets_its_stop_where_matrix_exponentials_say(case):
    system = struck.with_values(**CASES[case])
    run = moved(system, (0.0, 0.0), periods=40)
    assert str(run.status.values) == "ok"
    assert check_contacts(system, (0.0, 0.0), run, 10, 1e-12 * 2 * np.pi) > 5


@pytest.mark.slow
def test_tables_that_are_dropped_and_made_anew_give_the_same_bits(monkeypatch):
    """Many sets of parameter values in memory for a few contact states only, on two threads."""
    from saltus.flow import modal, modal_tables

    start, values = np.zeros((60, 2)), {"gap": np.linspace(0.2, 1.2, 60)}

    def run():
        modal.modal_flow.cache_clear()
        return sl.stroboscope(
            struck.with_values(damper=0.1), start, 30, values=values, keep=1, progress=False,
            method=sl.Modal(), threads=2,
        )  # fmt: skip

    whole = run()
    monkeypatch.setattr(modal_tables, "MOST_BYTES", 2**16)
    few = run()
    tables = modal.modal_flow(struck.origin).tables
    assert tables.generation > 5
    assert tables.modes.table.nbytes + tables.steady.table.nbytes < 2**18
    for name in ("x", "v"):
        assert np.isfinite(whole[name]).all()
        assert (whole[name].values == few[name].values).all()


TIMES = np.linspace(0.0, 3.0, 13)
HEIGHTS = np.random.default_rng(64).normal(size=13)
RECORDS = {kind: sl.recorded(TIMES, HEIGHTS, kind=kind) for kind in ("linear", "spline")}
#: A record of a switch, which repeats its values and jumps within a billionth of its length.
SWITCHES = np.array([0.0, 0.7, 0.7 + 3e-9, 1.6, 1.6 + 3e-9, 3.0])
LEVELS = np.array([1.0, 1.0, -1.0, -1.0, 1.0, 1.0])


def exact_square(frequency, share):
    """The same of a square wave, by its formula."""
    period = 1 / mp.mpf(frequency)
    breaks = [period * (k // 2) + (period * share if k % 2 else 0) for k in range(6)]
    return breaks, [[mp.mpf(1 - 2 * (k % 2)), mp.mpf(0), mp.mpf(0), mp.mpf(0)] for k in range(6)]


def exact_triangle(frequency):
    period = 1 / mp.mpf(frequency)
    breaks = [period * k / 2 for k in range(6)]
    sign = [1 - 2 * (k % 2) for k in range(6)]
    return breaks, [[mp.mpf(-s), 4 * s / period, mp.mpf(0), mp.mpf(0)] for s in sign]


def shaken(drive):
    """Two bodies on springs, the second one behind a stop."""

    @sl.system(states="x y v w")
    def pair(
        t, x, y, v, w, *, spring=20.0, coupling=30.0, damper=0.0, stiffness=900.0, loss=0.0,
        gap=0.02, dead=0.0,
    ):  # fmt: skip
        u = drive(t)
        stop = sl.where(y > gap, stiffness * (y - gap) + loss * w, 0.0)
        pull = coupling * (y - x)
        return v, w, pull - spring * x - damper * v + u, dead - pull - damper * w - stop

    return pair


DRIVES = {
    "a linear record": (RECORDS["linear"], exact_record(TIMES, HEIGHTS, "linear")),
    "a spline": (RECORDS["spline"], exact_record(TIMES, HEIGHTS)),
    "a record that jumps": (
        sl.recorded(SWITCHES, LEVELS, kind="linear"),
        exact_record(SWITCHES, LEVELS, "linear"),
    ),
    "a square wave": (
        lambda t: sl.square(2 * sl.pi * 0.75 * t, duty=0.25),
        exact_square(0.75, mp.mpf(1) / 4),
    ),
    "triangles": (
        lambda t: sl.sawtooth(2 * sl.pi * 0.75 * t, width=0.5),
        exact_triangle(0.75),
    ),
}
BODIES = {
    "undamped": {},
    "damped": {"damper": 1.0, "loss": 3.0},
    "overdamped": {"damper": 30.0, "stiffness": 1e5, "gap": 0.001},
    "free, stiff": {"spring": 0.0, "stiffness": 1e6, "dead": 3.0},
    "slow beside the record": {"spring": 1e-3, "coupling": 1e4, "dead": 3.0},
}


@pytest.mark.parametrize("bodies", BODIES)
@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.slow
def test_bodies_that_are_shaken_meet_a_stop_where_matrix_exponentials_say(drive, bodies):
    of_time, course = DRIVES[drive]
    system = shaken(of_time).with_values(**BODIES[bodies])
    assert len(linear_pieces(system).courses) == 1
    run = moved(system, np.zeros(4), t_end=3.0, samples=3)
    assert str(run.status.values) == "ok"
    assert int(run.steps) < 2000, "a steep piece shortens no steps but its own"
    assert check_contacts(system, np.zeros(4), run, 3, 1e-12, [course]) > 1


@pytest.mark.nojit
def test_a_body_under_its_weight_that_is_shaken_needs_no_compiler():
    """Small enough to run as plain Python: a block with a constant and a course in it."""

    @sl.system(states="x v")
    def body(t, x, v, *, weight=3.0, stiffness=900.0):
        stop = sl.where(x > 0.02, stiffness * (x - 0.02), 0.0)
        return v, weight + RECORDS["spline"](t) - stop

    run = moved(body, np.zeros(2), t_end=0.6, samples=2)
    assert check_contacts(body, np.zeros(2), run, 2, 1e-12, [DRIVES["a spline"][1]]) == 2


@pytest.mark.nojit
def test_a_free_body_that_nothing_moves_rests_on_its_boundary_beside_one_that_resonates():
    """Both go together, and x stays exactly zero: y = t sin(t)/2."""

    @sl.system(states="x y v w")
    def pair(t, x, y, v, w, *, stiffness=900.0, gap=0.0):
        return v, w, -stiffness * sl.max(x - gap, 0.0), sl.cos(t) - y

    run = moved(pair, np.zeros(4), t_end=9.0, samples=1)
    assert str(run.status.values) == "resting"
    assert int(run.steps) < 2000
    assert (float(run.end_x), float(run.end_v), run.sizes["contact"]) == (0.0, 0.0, 0)
    assert float(run.end_y) == pytest.approx(4.5 * np.sin(9.0), abs=1e-13)


def test_two_free_bodies_that_bounce_keep_their_energy():
    """Joined by a spring, under their weight, over ten thousand contacts: rounding of each."""

    @sl.system(states="x y v w")
    def pair(t, x, y, v, w, *, stiffness=5e4, weight=9.81):
        pull = 200.0 * (y - x)
        return v, w, pull - weight - sl.where(x < 0, stiffness * x, 0.0), -pull - weight

    def energy(x, y, v, w):
        springs = 0.5 * 200 * (y - x) ** 2 + 0.5 * 5e4 * min(x, 0.0) ** 2
        return 0.5 * (v * v + w * w) + 9.81 * (x + y) + springs

    start = (0.5, 0.55, 0.0, 0.0)
    run = moved(pair, start, t_end=1700.0, samples=1)
    assert run.sizes["contact"] > 10_000
    end = [float(run[f"end_{name}"]) for name in "xyvw"]
    allowed = 4 * 2.2e-16 * run.sizes["contact"]
    assert energy(*end) == pytest.approx(energy(*start), rel=allowed)


def two(*stops, force=3.0):
    """Two bodies on springs, driven, with stops."""
    return sl.structure(
        np.diag([1.0, 2.0]), np.array([[500.0, -200.0], [-200.0, 400.0]]), damping_ratio=0.01,
        modes=2, contacts=stops, forces=[sl.Force("x1", force)], frequency=2.3,
    )  # fmt: skip


STOPS = {
    "two at one place": [
        sl.Contact("x1", stiffness=3e3, gap=0.01, name="first"),
        sl.Contact("x1", stiffness=9e4, gap=0.014, name="second"),
    ],
    "between two parts": [sl.Contact("x1", to="x2", stiffness=2e4, gap=0.005, side="both")],
    "pressed on at rest": [sl.Contact("x1", stiffness=2e4, gap=0.001, preload=2.0)],
    "touching at the start": [
        sl.Contact("x1", stiffness=2e4, gap=0.0),
        sl.Contact("x2", stiffness=2e4, gap=0.001, side="lower"),
    ],
    "an interference": [sl.Contact("x2", stiffness=2e4, gap=-0.002)],
}


@pytest.mark.parametrize("stops", STOPS)
def test_stops_of_all_places_are_met_where_matrix_exponentials_say(stops):
    system, start = two(*STOPS[stops], force=6.0), np.zeros(4)
    run = moved(system, start, periods=12)
    assert str(run.status.values) == "ok"
    assert check_contacts(system, start, run, 12, 1e-12 / 2.3) > 7


@pytest.mark.slow
def test_the_phase_is_kept_over_a_million_periods_without_a_contact():
    """An undamped oscillator and its drive: x = a cos W t + b cos w t, w/W = sqrt(2)."""
    system = struck.with_values(spring=2.0, gap=1e3, force=0.1)
    periods = 1_000_000
    run = sl.stroboscope(system, (0.4, 0.0), periods, keep=1, method=sl.Modal(), progress=False)
    with mp.workdps(30):
        rate = 2 * mp.pi * mp.mpf(system.values["frequency"])
        answer = mp.mpf(0.1) / (2 - rate**2)
        t, own = periods / mp.mpf(system.values["frequency"]), mp.sqrt(2)
        free = mp.mpf(0.4) - answer
        x, v = free * mp.cos(own * t) + answer, -own * free * mp.sin(own * t)
    assert float(run["x"].values.ravel()[-1]) == pytest.approx(float(x), abs=1e-9)
    assert float(run["v"].values.ravel()[-1]) == pytest.approx(float(v), abs=1e-9)
