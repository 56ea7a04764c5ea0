"""The modal flow against 40-digit matrix exponentials, Taylor's method, closed forms and energy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import saltus as sl
from saltus.system.linearity import linear_pieces

mpmath = pytest.importorskip("mpmath")
mp = mpmath.mp


def plate(rng, degrees, contacts, *, ratio=0.02, damped=False, two_sided=False):
    """A random structure of some degrees of freedom, driven, with stops behind random gaps."""
    root = rng.normal(size=(degrees, degrees))
    stiffness = 400.0 * (root @ root.T / degrees + np.eye(degrees))
    places = rng.choice(degrees, contacts, replace=False) + 1
    stops = [
        sl.Contact(
            f"x{place}",
            stiffness=float(10 ** rng.uniform(2.5, 4.5)),
            gap=float(rng.uniform(0.0, 0.02)),
            side="both" if two_sided else str(rng.choice(["upper", "lower", "both"])),
            damping=float(rng.uniform(0, 5)) if damped else None,
        )
        for place in places
    ]
    forces = [
        sl.Force("x1", float(rng.uniform(5, 30)), phase=0.3, name="first"),
        sl.Force(f"x{degrees}", 2.0, harmonic=3, name="third"),
        sl.Force("x1", 1.5, harmonic=0, name="dead"),
    ]
    return sl.structure(
        np.eye(degrees),
        stiffness,
        damping_ratio=ratio,
        modes=degrees,
        contacts=stops,
        forces=forces,
        frequency=float(rng.uniform(1.5, 5)),
    )


def runs(system, periods):
    """The motion from rest, by the modal flow and by Taylor's method."""
    kw = {"periods": periods, "progress": False, "time_errors": "local"}
    start = np.zeros(len(system.states))
    return [sl.simulate(system, start, method=one, **kw) for one in (sl.Modal(), sl.Taylor())]


def agree(one, other, period, tolerance):
    """How many of the first contacts agree in kind and, to a tolerance that grows with each, in
    time.
    """
    count = min(one.sizes["contact"], other.sizes["contact"])
    apart = np.abs(one.contact_time.values[:count] - other.contact_time.values[:count]) / period
    same = one.contact_guard.values[:count] == other.contact_guard.values[:count]
    wrong = np.flatnonzero(~same | (apart > tolerance * 1.3 ** np.arange(count)))
    return int(wrong[0]) if len(wrong) else count


@pytest.mark.parametrize("seed", range(24))
@pytest.mark.slow
def test_random_structures_meet_the_contacts_of_the_taylor_flow(seed):
    """Errors of rounding grow from contact to contact; by the tolerance of the first it is asked
    that they grow no faster than by a third at each.
    """
    rng = np.random.default_rng(20261125 + seed)
    system = plate(rng, int(rng.integers(1, 7)), 1, damped=bool(seed % 2), two_sided=seed % 3 == 0)
    modal, taylor = runs(system, 12)
    assert str(modal.status.values) == "ok"
    period = 1 / system.values["frequency"]
    same = agree(modal, taylor, period, 1e-12)
    assert same == min(modal.sizes["contact"], taylor.sizes["contact"]) or same >= 40
    if same == modal.sizes["contact"] == taylor.sizes["contact"] and same < 40:
        for name in system.states:
            size = max(abs(float(taylor[f"end_{name}"])), 1e-3)
            assert float(modal[f"end_{name}"]) == pytest.approx(
                float(taylor[f"end_{name}"]), abs=1e-7 * size
            )


def test_contacts_are_zeros_of_matrix_exponentials_to_40_digits():
    """From contact to contact by the eigenvalues of each contact state, to 40 digits: the gap of
    the boundary vanishes at the instant found, and no other gap closes before.
    """
    rng = np.random.default_rng(7)
    system = plate(rng, 3, 2, two_sided=True)
    run = sl.simulate(system, np.zeros(6), periods=20, progress=False, method=sl.Modal(),
        time_errors="local")  # fmt: skip
    assert run.sizes["contact"] > 50
    linear, values = linear_pieces(system), dict(system.values)
    names = [guard.name for guard in system.guards]
    gaps, (rates, lags), known = linear.gaps(values), linear.rates(values), {}
    with mp.workdps(40):
        state, mode, now = mp.zeros(6, 1), int(run.contact_mode_before[0]), mp.mpf(0)
        for k in range(50):
            if mode not in known:
                known[mode] = Exact(linear.piece(values, mode), rates, lags)
            motion = known[mode].motion(state, now)
            g = names.index(str(run.contact_guard.values[k]))
            claimed = mp.mpf(float(run.contact_time[k]))

            found = root_of(gaps.matrix[g], gaps.constant[g], motion, claimed)
            assert abs(found - claimed) < mp.mpf("1e-12")
            for part in np.linspace(0.02, 0.98, 12):
                there = motion(now + (found - now) * mp.mpf(float(part)))
                z = np.array([float(one) for one in there])
                signs = gaps.matrix @ z + gaps.constant
                for other in range(len(signs)):
                    side = 1.0 if mode >> other & 1 else -1.0
                    assert signs[other] * side > -1e-13
            state, now, mode = motion(found), found, int(run.contact_mode_after[k])


def root_of(row, constant, motion, near):
    """A zero of row z(t) + constant near an instant."""
    exact = mp.matrix([row.tolist()])
    gap = lambda t: (exact * motion(t))[0] + mp.mpf(float(constant))  # noqa: E731
    return mp.findroot(gap, near, solver="secant")


class Exact:
    """The motion in one contact state, by its eigenvalues in mpmath."""

    def __init__(self, piece, rates, lags):
        self.values, self.vectors = mp.eig(mp.matrix(piece.matrix.tolist()))
        self.inverse = mp.inverse(self.vectors)
        self.answers = []
        for rate, lag, load in zip(
            [0.0, *rates], [0.0, *lags], [piece.constant, *piece.driven.T], strict=True
        ):
            parts = self.inverse * mp.matrix(load.tolist())
            for j, value in enumerate(self.values):
                parts[j] = parts[j] / (mp.mpc(0, float(rate)) - value)
            self.answers.append((mp.mpf(float(rate)), mp.mpf(float(lag)), self.vectors * parts))

    def steady(self, t):
        """The steady answer to the drives."""
        total = mp.zeros(len(self.values), 1)
        for rate, lag, answer in self.answers:
            total += (answer * mp.expj(rate * t + lag)).apply(mp.re)
        return total

    def motion(self, state, begin):
        """z(t) from a state at a time."""
        parts = self.inverse * (state - self.steady(begin))

        def at(t):
            moved = [part * mp.exp(v * (t - begin)) for part, v in zip(parts, self.values)]  # noqa: B905
            return (self.vectors * mp.matrix(moved)).apply(mp.re) + self.steady(t)

        return at


def test_an_undamped_structure_keeps_its_energy_over_a_hundred_thousand_contacts():
    stiffness = np.array([[3e3, -1e3, 0], [-1e3, 2e3, -1e3], [0, -1e3, 1.5e3]])
    system = sl.structure(
        np.eye(3), stiffness, contacts=[sl.Contact("x2", stiffness=5e4, gap=1e-3, side="both")]
    )
    start = np.array([2e-3, -1e-3, 3e-3, 0.1, 0.2, -0.1])

    def energy(x, v):
        deep = max(abs(x[1]) - 1e-3, 0.0)
        return 0.5 * v @ v + 0.5 * x @ stiffness @ x + 0.5 * 5e4 * deep**2

    run = sl.simulate(system, start, t_end=1650.0, samples=10, progress=False, method=sl.Modal(),
        time_errors="local")  # fmt: skip
    assert run.sizes["contact"] > 100_000
    x = np.array([run[f"x{i}"].values.ravel() for i in (1, 2, 3)])
    v = np.array([run[f"v{i}"].values.ravel() for i in (1, 2, 3)])
    begun = energy(start[:3], start[3:])
    for k in range(x.shape[1]):
        assert energy(x[:, k], v[:, k]) == pytest.approx(begun, rel=1e-10)


def test_ten_modes_meet_their_stops_as_by_dop853_at_its_smallest_tolerance():
    """SciPy integrates each contact state by itself and finds where it ends."""
    system = plate(np.random.default_rng(75), 10, 2, two_sided=True)
    linear, values = linear_pieces(system), dict(system.values)
    gaps, (rates, lags) = linear.gaps(values), linear.rates(values)
    run = sl.simulate(system, np.zeros(20), periods=2, progress=False, method=sl.Modal(),
        time_errors="local")  # fmt: skip
    now, z, mode, times = 0.0, np.zeros(20), int(run.contact_mode_before[0]), []
    end = 2 / values["frequency"]
    while now < end:
        piece = linear.piece(values, mode)

        def motion(t, z, piece=piece):
            drives = piece.driven @ np.cos(rates * t + lags)
            return piece.matrix @ z + piece.constant + drives

        ends = []
        for g in range(len(gaps.constant)):
            ends.append(lambda t, z, g=g: gaps.matrix[g] @ z + gaps.constant[g])
            ends[-1].terminal, ends[-1].direction = True, -1.0 if mode >> g & 1 else 1.0
        leg = solve_ivp(motion, (now, end), z, "DOP853", rtol=1e-12, atol=1e-16, events=ends)
        now, z = leg.t[-1], leg.y[:, -1]
        if leg.status == 1:
            times.append(now)
            mode ^= 1 << next(g for g, found in enumerate(leg.t_events) if len(found))
    assert len(times) == run.sizes["contact"] > 8
    np.testing.assert_allclose(run.contact_time, times, rtol=0, atol=1e-11 * end)
    found = [float(run[f"end_{name}"]) for name in system.states]
    np.testing.assert_allclose(found, z, rtol=0, atol=1e-10 * np.abs(z).max())


def test_batches_give_the_bits_of_single_runs():
    system = plate(np.random.default_rng(3), 4, 2, two_sided=True)
    starts = np.random.default_rng(4).normal(0, 0.01, (9, 8))
    many = sl.stroboscope(system, starts, 30, keep=1, progress=False, method=sl.Modal(), threads=2)
    for i in (0, 4, 8):
        one = sl.stroboscope(system, starts[i], 30, keep=1, progress=False, method=sl.Modal())
        for name in system.states:
            assert many[name].values[i].tolist() == one[name].values.ravel().tolist()


def test_what_it_does_not_serve_is_moved_by_taylor():
    rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    kw = {"periods": 5, "progress": False}
    one, other = (sl.simulate(rig, (0, 0), method=m, **kw) for m in (sl.Modal(), sl.Taylor()))
    assert float(one.end_x) == float(other.end_x)


@pytest.mark.nojit
def test_a_mass_between_two_stops_meets_them_as_by_taylor():
    """Small enough to run without the compiler: two modes, a stop of two sides and one of one."""
    stiffness = np.array([[300.0, -100.0], [-100.0, 250.0]])
    system = sl.structure(
        np.eye(2),
        stiffness,
        0.01 * stiffness,
        contacts=[
            sl.Contact("x1", stiffness=2e3, gap=0.01, side="both", name="first"),
            sl.Contact("x2", stiffness=1e3, gap=0.005, name="second"),
        ],
        forces=[sl.Force("x1", 5.0), sl.Force("x2", 1.0, harmonic=2)],
        frequency=2.0,
    )
    modal, taylor = runs(system, 3)
    assert modal.sizes["contact"] == taylor.sizes["contact"] > 8
    assert modal.contact_guard.values.tolist() == taylor.contact_guard.values.tolist()
    np.testing.assert_allclose(modal.contact_time, taylor.contact_time, rtol=0, atol=1e-12)
    np.testing.assert_allclose(modal.x1, taylor.x1, rtol=0, atol=1e-13)


@pytest.mark.nojit
def test_a_free_flight_that_only_touches_is_a_graze_of_both_flows():
    """From rest at its turning point a linear oscillator comes back to where it began."""

    @sl.system(states="x v")
    def oscillator(t, x, v, *, gap=1.0, stiffness=50.0):
        return v, -x - stiffness * sl.max(x - gap, 0.0)

    for start, touches in ((1.0 - 1e-6, 0), (1.0 + 1e-6, 1)):
        run = sl.simulate(oscillator, (-start, 0.0), t_end=4.0, samples=4, method=sl.Modal(),
            progress=False, time_errors="local")  # fmt: skip
        assert (run.sizes["contact"] > 0) == bool(touches)
        if not touches:
            assert float(run.smallest_gap_margin) == pytest.approx(1e-6, rel=1e-6)
