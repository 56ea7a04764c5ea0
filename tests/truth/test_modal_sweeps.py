"""Drives that are no polynomials of the time - swept sines, half sines, bursts - by the modal flow,
against integrals over them to 30 digits, and beside Taylor's method.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.system import courses
from saltus.system.courses import SMOOTH_TERMS, course_of
from saltus.system.linearity import linear_pieces
from two_flows import FOLLOWS, same_rows

mpmath = pytest.importorskip("mpmath")
mp = mpmath.mp
PI = np.pi


def swept(first, last, rate, octaves=False):
    """A sweep by its formula, in mpmath."""
    first, last, rate = mp.mpf(first), mp.mpf(last), mp.mpf(rate)
    end = mp.log(last / first, 2) / rate if octaves else (last - first) / rate

    def turns(t):
        if octaves:
            return first * (mp.mpf(2) ** (rate * t) - 1) / (mp.log(2) * rate)
        return (first + rate * t / 2) * t

    def value(t):
        later = turns(end) + last * (t - end) if t > end else turns(t)
        return mp.sin(2 * mp.pi * later)

    return value, [end]


def half_sine(t):
    return mp.sin(mp.pi * t / mp.mpf(1.3)) if t < mp.mpf(1.3) else mp.mpf(0)


#: Each as an equation writes it; by its formula, with its breaks.
DRIVES = {
    "up": (sl.sweep(0.1, 1.0, "0.15 Hz/s"), swept(0.1, 1, 0.15)),
    "down, then steady": (sl.sweep(1.0, 0.3, "0.35 Hz/s"), swept(1, 0.3, -0.35)),
    "octaves": (sl.sweep(0.1, 1.0, "0.5 oct/s"), swept(0.1, 1, 0.5, True)),
    "a half sine": (lambda t: sl.pulse(t, 1.3, shape="half_sine"), (half_sine, [1.3])),
    "a product": (
        lambda t: sl.sin(3 * t) * sl.cos(1.5 * t) ** 2,
        (lambda t: mp.sin(3 * t) * mp.cos(1.5 * t) ** 2, []),
    ),
}
#: Spring, damper, stiffness of the stop.
BODIES = {
    "undamped": (4.0, 0.0, 900.0),
    "overdamped": (4.0, 9.0, 900.0),
    "critical": (4.0, 4.0, 900.0),
    "a rigid body": (0.0, 0.0, 1e6),
    "slow beside the sweep": (0.01, 0.01, 900.0),
    "a very stiff stop": (4.0, 0.2, 1e10),
}
GAP = 0.02


class Driven:
    """x'' + c x' + k x = f(t) from a state at a time, by its answer to a blow."""

    def __init__(self, spring, damper, force, breaks):
        self.spring, self.damper = mp.mpf(spring), mp.mpf(damper)
        self.force, self.breaks = force, breaks
        self.root = mp.sqrt(mp.mpc(self.spring - self.damper**2 / 4))

    def blow(self, t):
        """x and x' a time after a blow of 1."""
        w, decay = self.root, mp.exp(-self.damper * t / 2)
        sine = mp.sin(w * t) / w if abs(w) > 1e-20 else t
        x = decay * mp.re(sine)
        return x, decay * mp.re(mp.cos(w * t)) - self.damper / 2 * x

    def at(self, state, begin, t):
        x, v = self.blow(t - begin)
        place = state[0] * (v + self.damper * x) + state[1] * x
        speed = -self.spring * state[0] * x + state[1] * v
        inner = [mp.mpf(one) for one in self.breaks if begin < one < t]
        pace = max(abs(self.root), 2 * mp.pi)
        for low, high in zip([begin, *inner], [*inner, t], strict=True):
            parts = int((high - low) * pace / 4) + 1
            for k in range(parts):
                half = (high - low) / parts / 2
                for node, weight in LEGENDRE:
                    s = low + half * (2 * k + 1 + node)
                    x, v = self.blow(t - s)
                    force = half * weight * self.force(s)
                    place, speed = place + x * force, speed + v * force
        return place, speed


def legendre(count):
    """Nodes and weights of Gauss to 34 digits."""
    found = []
    for guess in np.polynomial.legendre.leggauss(count)[0]:
        node = mp.findroot(lambda x: mp.legendre(count, x), mp.mpf(float(guess)))
        slope = count * (node * mp.legendre(count, node) - mp.legendre(count - 1, node)) / (
            node**2 - 1
        )  # fmt: skip
        found.append((node, 2 / ((1 - node**2) * slope**2)))
    return found


with mp.workdps(34):
    LEGENDRE = legendre(24)


def body(drive):
    @sl.system(states="x v")
    def one(t, x, v, *, spring=4.0, damper=0.0, stiffness=900.0, dead=0.5):
        stop = stiffness * sl.max(x - GAP, 0.0)
        return v, dead + drive(t) - spring * x - damper * v - stop

    return one


@pytest.mark.parametrize("bodies", BODIES)
@pytest.mark.parametrize("drive", DRIVES)
def test_contacts_are_zeros_of_integrals_over_the_drive(drive, bodies):
    of_time, (force, breaks) = DRIVES[drive]
    spring, damper, stiffness = BODIES[bodies]
    system = body(of_time).with_values(spring=spring, damper=damper, stiffness=stiffness)
    run = sl.simulate(system, (0.0, 0.0), t_end=9.0, method=sl.Modal(), **FOLLOWS)
    assert run.attrs["method"] == "Modal"
    assert str(run.status.values) == "ok"
    with mp.workdps(34):
        state, now, gap = (mp.mpf(0), mp.mpf(0)), mp.mpf(0), mp.mpf(GAP)
        sides = {
            False: Driven(spring, damper, lambda t: force(t) + mp.mpf(0.5), breaks),
            True: Driven(
                spring + stiffness, damper, lambda t: force(t) + mp.mpf(0.5) + stiffness * gap,
                breaks,
            ),
        }  # fmt: skip
        most = 9 if "steady" in drive else 4  # through the end of the sweep
        inside, count = False, min(run.sizes["contact"], most)
        assert count > 1
        for k in range(count):
            claimed = mp.mpf(float(run.contact_time[k]))
            place, speed = sides[inside].at(state, now, claimed)
            away = (gap - place) / speed  # Newton's method: its error is the square of this
            assert abs(away) < 4e-13 * max(1, claimed), k
            state, now = sides[inside].at(state, now, claimed + away), claimed + away
            inside = not inside


@pytest.mark.parametrize("seed", range(4))
def test_random_structures_that_are_swept_meet_the_contacts_of_the_taylor_flow(seed):
    rng = np.random.default_rng(7501 + seed)
    degrees = int(rng.integers(2, 6))
    root = rng.normal(size=(degrees, degrees))
    ends = rng.choice([0.3, 6.0], 2, replace=False)
    rate = str(rng.choice(["1.5 Hz/s", "1 oct/s"]))
    system = sl.structure(
        np.eye(degrees), 400.0 * (root @ root.T / degrees + np.eye(degrees)), modes=degrees,
        damping_ratio=float(rng.uniform(0.0, 0.05)),
        base=sl.Base("x", sl.sweep(*map(float, ends), rate, amplitude=4.0)),
        contacts=[
            sl.Contact(f"x{place}", float(10 ** rng.uniform(2.5, 4.5)), 0.005, side=side)
            for place, side in zip(rng.choice(degrees, 2, replace=False) + 1, ("both", "upper"))  # noqa: B905
        ],
        forces=[sl.Force("x1", sl.recorded(np.arange(9.0), rng.normal(size=9), "N"))],
    )  # fmt: skip
    runs = [
        sl.simulate(system, np.zeros(2 * degrees), t_end=6.0, samples=3, method=one, **FOLLOWS)
        for one in (sl.Modal(), sl.Taylor())
    ]
    assert runs[0].attrs["method"] == "Modal"
    same = same_rows(*runs, 1.0)
    assert same >= 30 or same == runs[0].sizes["contact"] == runs[1].sizes["contact"]


def test_a_sweep_is_known_to_the_rounding_of_its_phase():
    """Its pieces, at times on and between their ends, through the end of the sweep."""
    run_up = sl.sweep(5.0, 80.0, "10 Hz/s", amplitude=3.0)
    (node,) = linear_pieces(body(run_up)).courses
    course = course_of(node, {}, SMOOTH_TERMS)
    times = np.concatenate([course.begins, np.random.default_rng(0).uniform(0, 12, 4000)])
    rounding = 3.0 * 2 * PI * 80 * 12 * 2.3e-16
    value, rate = 3.0 * course.at(times)[:2]  # amplitudes are factors
    np.testing.assert_allclose(value, run_up(times), rtol=0, atol=3 * rounding)
    slope = (run_up(times + 1e-6) - run_up(times - 1e-6)) / 2e-6
    inside = np.abs(times - run_up.duration) > 1e-5
    np.testing.assert_allclose(rate[inside], slope[inside], rtol=0, atol=1e-3)


@pytest.mark.nojit
def test_a_sweep_and_its_steady_end_need_no_compiler():
    """Small enough to run as plain Python: pieces that hold once, then one turn again and again."""
    system = body(sl.sweep(2.0, 1.0, "2 Hz/s"))
    run = sl.simulate(system, (0.0, 0.0), t_end=2.6, samples=4, method=sl.Modal(), **FOLLOWS)
    other = sl.simulate(
        system, (0.0, 0.0), t_end=2.6, samples=4, method=sl.ODE45(1e-11, 1e-13), **FOLLOWS
    )
    np.testing.assert_allclose(run["x"], other["x"], rtol=0, atol=1e-9)
    assert run.sizes["contact"] == other.sizes["contact"] > 1


def test_what_has_no_end_is_moved_by_taylor_and_early_starts_are_refused(monkeypatch):
    assert isinstance(sl.Modal().serving(body(lambda t: sl.exp(-t))), sl.Taylor)
    assert isinstance(sl.Modal().serving(body(lambda t: sl.sin(t * t))), sl.Taylor)
    run_up = body(sl.sweep(5.0, 80.0, "10 Hz/s"))
    assert isinstance(sl.Modal().serving(run_up), sl.Modal)
    with pytest.raises(sl.SaltusError, match=r"from 0 s on.*sl\.Taylor"):
        sl.simulate(run_up, (0.0, 0.0), t_start=-1.0, t_end=1.0, method=sl.Modal(), progress=False)
    monkeypatch.setattr(courses, "MOST_PIECES", 2**12)
    endless = body(sl.sweep(5.0, 8e6, "1 Hz/s"))
    with pytest.raises(sl.SaltusError, match="turns too often"):
        sl.simulate(endless, (0.0, 0.0), t_end=1.0, method=sl.Modal(), progress=False)
