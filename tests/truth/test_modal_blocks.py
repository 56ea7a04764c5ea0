"""Contact states whose modes don't go their own ways, by the modal flow, against exponentials of
matrices to 50 digits.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.system.linear import linear_pieces

mpmath = pytest.importorskip("mpmath")
mp = mpmath.mp


class Exact:
    """z(t) from a state at a time in one contact state: the exponential of the equations and their
    drives in one matrix.
    """

    def __init__(self, piece, rates, lags):
        n, d = len(piece.matrix), len(rates)
        self.matrix, self.lags, self.rates = mp.zeros(n + 1 + 2 * d), lags, rates
        for i in range(n):
            for j in range(n):
                self.matrix[i, j] = mp.mpf(float(piece.matrix[i, j]))
            self.matrix[i, n] = mp.mpf(float(piece.constant[i]))
            for k in range(d):
                self.matrix[i, n + 1 + 2 * k] = mp.mpf(float(piece.driven[i, k]))
        for k in range(d):
            at, rate = n + 1 + 2 * k, mp.mpf(float(rates[k]))
            self.matrix[at, at + 1], self.matrix[at + 1, at] = -rate, rate

    def motion(self, state, begin):
        parts = [*state, mp.mpf(1)]
        for rate, lag in zip(self.rates, self.lags, strict=True):
            angle = mp.mpf(float(rate)) * begin + mp.mpf(float(lag))
            parts += [mp.cos(angle), mp.sin(angle)]
        whole, n = mp.matrix(parts), len(state)
        return lambda t: (mp.expm(self.matrix * (t - begin)) * whole)[:n, 0]


def check_contacts(system, start, run, most, tolerance):
    """Each contact is a zero of its gap on the exact motion from the exact contact before it, and
    no other gap is beyond its boundary on the way. Returns how many there were.
    """
    linear, values = linear_pieces(system), dict(system.values)
    names = [guard.name for guard in system.guards]
    gaps, (rates, lags), known = linear.gaps(values), linear.rates(values), {}
    count = min(run.sizes["contact"], most)
    with mp.workdps(50):
        state = mp.matrix([mp.mpf(float(one)) for one in start])
        mode, now = int(run.contact_mode_before[0]), mp.mpf(0)
        for k in range(count):
            if mode not in known:
                known[mode] = Exact(linear.piece(values, mode), rates, lags)
            motion = known[mode].motion(state, now)
            g = names.index(str(run.contact_guard.values[k]))
            row = mp.matrix([[mp.mpf(float(one)) for one in gaps.matrix[g]]])
            away = mp.mpf(float(gaps.constant[g]))
            claimed = mp.mpf(float(run.contact_time[k]))
            gap = lambda t, r=row, a=away, m=motion: (r * m(t))[0] + a  # noqa: E731
            found = mp.findroot(gap, (claimed, claimed * (1 + mp.mpf("1e-12"))), solver="secant")
            assert abs(found - claimed) < tolerance, (k, float(found - claimed))
            for part in (0.1, 0.5, 0.9):
                there = np.array([float(one) for one in motion(now + (found - now) * part)])
                others = gaps.matrix @ there + gaps.constant
                sides = np.where(mode >> np.arange(len(names)) & 1, 1.0, -1.0)
                assert (others * sides > -1e-12).all()
            state, now, mode = motion(found), found, int(run.contact_mode_after[k])
    return count


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
    "a body under its weight": {"spring": 0.0, "dead": 1.0, "stiffness": 1e6},
    "a weak spring under a weight": {"spring": 1e-9, "dead": 1.0, "stiffness": 1e6},
    "a body with a damper": {"spring": 0.0, "damper": 0.1, "dead": 1.0, "stiffness": 1e3},
}


@pytest.mark.parametrize("case", CASES)
def test_an_oscillator_meets_its_stop_where_matrix_exponentials_say(case):
    system = struck.with_values(**CASES[case])
    run = moved(system, (0.0, 0.0), periods=40)
    assert str(run.status.values) == "ok"
    assert check_contacts(system, (0.0, 0.0), run, 16, 1e-12 * 2 * np.pi) > 5


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
