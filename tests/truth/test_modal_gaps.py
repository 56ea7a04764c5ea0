"""What the modal flow says of legs, beside matrix exponentials: contacts, samples, tries."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import BPoly
from scipy.linalg import expm

import saltus as sl
from saltus.codegen.module import MODAL_LANES
from saltus.flow import modal_state_rows
from saltus.flow.modal import bernstein_table
from saltus.flow.modal_eigen import shared_of
from saltus.kernels.modal.layout import (
    CLOSER,
    FACTORIAL,
    HALF,
    LEFT_HALF,
    ORDER,
    OVER_X,
    PLACES,
    QUEUE,
    RIGHT_HALF,
    SHARES,
    SPANNED,
    STEEPER,
    TABLE,
)
from saltus.system.linearity import linear_pieces


def spread(seed, degrees, contacts):
    """A structure whose frequencies are as far apart as those of a beam, with soft stops; at the
    first, which is driven, all modes have one size, as at the tip of a beam.
    """
    rng = np.random.default_rng(seed)
    columns = rng.normal(size=(degrees, degrees))
    columns[:, 0] = 1.0
    turn = np.linalg.qr(columns)[0].T
    rates = 20.0 * np.arange(1, degrees + 1) ** 2
    stops = [
        sl.Contact(f"x{place + 1}", stiffness=float(10 ** rng.uniform(4.5, 5.5)), gap=1e-3,
                   side="both")
        for place in range(contacts)
    ]  # fmt: skip
    return sl.structure(
        np.eye(degrees), turn @ np.diag(rates**2) @ turn.T, damping_ratio=0.01, modes=degrees,
        contacts=stops, forces=[sl.Force("x1", 40.0)], frequency=1.1 * rates[0] / (2 * np.pi),
    )  # fmt: skip


def augmented(system, mode):
    """The matrix of a contact state for the states, cosine, sine and one; the rate of the drive."""
    linear, values = linear_pieces(system), dict(system.values)
    piece, rate, states = (
        linear.piece(values, mode),
        float(linear.rates(values)[0][0]),
        len(system.states),
    )
    every = np.zeros((states + 3, states + 3))
    every[:states, :states], every[:states, states] = piece.matrix, piece.driven[:, 0]
    every[:states, states + 2] = piece.constant
    every[states, states + 1], every[states + 1, states] = -rate, rate
    return every, rate


def check_legs(system, run, parts):
    """From each recorded contact to the next by a matrix exponential of the states, of cosine, sine
    and one: it ends at the recorded state, on the boundary, and no gap closes before.
    """
    linear, values = linear_pieces(system), dict(system.values)
    gaps, states, matrices = linear.gaps(values), len(system.states), {}
    names = [guard.name for guard in system.guards]
    at = np.array([run[f"contact_{name}"].values for name in system.states]).T
    times, size = run.contact_time.values, np.abs(at).max(axis=0)
    for k in range(len(times) - 1):
        mode = int(run.contact_mode_after[k])
        if mode not in matrices:
            matrices[mode] = augmented(system, mode)
        every, rate = matrices[mode]
        whole = times[k + 1] - times[k]
        step = expm(every * whole / parts)
        z = np.concatenate([at[k], [np.cos(rate * times[k]), np.sin(rate * times[k]), 1.0]])
        for part in range(1, parts + 1):
            z = step @ z
            signs = (gaps.matrix @ z[:states] + gaps.constant) * [
                1.0 if mode >> g & 1 else -1.0 for g in range(len(names))
            ]
            assert (signs > -1e-12).all() or part == parts
        g = names.index(str(run.contact_guard.values[k + 1]))
        assert abs(signs[g]) < 1e-12
        assert (np.abs(z[:states] - at[k + 1]) < 1e-10 * size).all()


@pytest.mark.parametrize(("seed", "degrees", "contacts"), [(1, 9, 1), (2, 14, 3), (3, 33, 2)])
def test_legs_of_many_modes_are_those_of_matrix_exponentials(seed, degrees, contacts, monkeypatch):
    monkeypatch.setattr(modal_state_rows, "SHARED", 33)
    system = spread(20261126 + seed, degrees, contacts)
    run = sl.simulate(system, periods=20, progress=False, method=sl.Modal(), time_errors="local")
    assert str(run.status.values) == "ok"
    assert run.sizes["contact"] > 100
    check_legs(system, run, 40)


@pytest.mark.nojit
def test_legs_need_no_compiler():
    system = spread(5, 9, 1)
    run = sl.simulate(system, periods=2, progress=False, method=sl.Modal(), time_errors="local")
    assert run.sizes["contact"] > 10
    check_legs(system, run, 10)


@pytest.mark.nojit
@pytest.mark.parametrize("shared", [False, True])
def test_samples_are_those_of_matrix_exponentials_however_many_there_are(shared, monkeypatch):
    """States are written some samples at a time, of one contact state each: more samples between
    two contacts than are written together, and a fourth of them, which are the same to the bit. By
    eigenvectors and their inverse, and by shapes alone; five coordinates fill no lanes.
    """
    found = []
    monkeypatch.setattr(modal_state_rows, "SHARED", 1 if shared else 6)
    monkeypatch.setattr(
        modal_state_rows, "shared_of", lambda *of: found.append(shared_of(*of)) or found[-1]
    )
    system = spread(6 + shared, 5, 1)
    few, many = (
        sl.simulate(system, periods=1, samples=samples, progress=False, method=sl.Modal(),
            time_errors="local") for samples in (60, 240)
    )  # fmt: skip
    states = np.array([many[name].values for name in system.states]).T
    assert (states[::4] == np.array([few[name].values for name in system.states]).T).all()
    at = np.array([many[f"contact_{name}"].values for name in system.states]).T
    before = np.searchsorted(many.contact_time.values, many.time.values, side="right") - 1
    assert np.bincount(before[before >= 0]).max() > 2 * QUEUE
    assert bool(found) == shared
    assert None not in found
    for k in np.flatnonzero(before >= 0)[::3]:
        begin = float(many.contact_time[before[k]])
        every, rate = augmented(system, int(many.contact_mode_after[before[k]]))
        z = np.concatenate([at[before[k]], [np.cos(rate * begin), np.sin(rate * begin), 1.0]])
        there = (expm(every * (float(many.time[k]) - begin)) @ z)[: len(system.states)]
        assert (np.abs(there - states[k]) < 1e-10 * np.abs(states).max(axis=0)).all()


def test_contacts_of_sixty_modes_are_those_of_dense_sampling(monkeypatch):
    """The first contacts of the beam of the benchmark from rest: by matrix exponentials, one of
    twenty thousand parts of a period after the other, then halves of these where a gap changes its
    sign.
    """
    monkeypatch.syspath_prepend(Path(__file__).resolve().parents[2])
    from benchmarks.structures import structure

    system = structure(60, 1)
    run = sl.simulate(system, periods=1, progress=False, method=sl.Modal(), time_errors="local")
    linear, values = linear_pieces(system), dict(system.values)
    gaps, steps, now, mode = linear.gaps(values), {}, 0.0, int(run.contact_mode_before[0])
    part = 1 / (values["frequency"] * 20_000)
    z, found = np.append(np.zeros(len(system.states)), [1.0, 0.0, 1.0]), []
    while len(found) < min(run.sizes["contact"], 30):
        if mode not in steps:
            every, _ = augmented(system, mode)
            steps[mode] = [expm(every * part / 2**k) for k in range(28)]
        sides = np.array([1.0 if mode >> g & 1 else -1.0 for g in range(len(gaps.matrix))])

        def open_(z, sides=sides):
            return (gaps.matrix @ z[:-3] + gaps.constant) * sides > 0

        k, h = 0, part
        if not open_(steps[mode][0] @ z).all():
            for k in range(1, 28):
                h /= 2
                if open_(steps[mode][k] @ z).all():
                    z, now = steps[mode][k] @ z, now + h
            z, now = steps[mode][k] @ z, now + h
            g = int(np.flatnonzero(~open_(z))[0])
            found.append((now, g))
            mode ^= 1 << g
        else:
            z, now = steps[mode][0] @ z, now + h
    names = [guard.name for guard in system.guards]
    assert len(found) > 20
    assert [names[g] for _, g in found] == list(run.contact_guard.values[: len(found)])
    late = np.array([at for at, _ in found]) - run.contact_time.values[: len(found)]
    assert np.abs(late).max() < 1e-11 * 20_000 * part


def test_few_tries_are_in_vain():
    """Where a step isn't decided as a whole, its first parts are: without them there are two tries
    in vain for each contact.
    """
    run = sl.simulate(spread(20261127, 9, 1), periods=40, progress=False, method=sl.Modal(),
        time_errors="local")  # fmt: skip
    assert run.events > 200
    assert run.rejected_steps < 0.7 * run.events


def test_terms_at_both_ends_tell_the_polynomial_of_scipy():
    rows = bernstein_table(MODAL_LANES)[:LEFT_HALF].reshape(3, 16, 16)
    terms = np.random.default_rng(2).normal(size=(2, HALF))
    factorials = np.array([float(math.factorial(k)) for k in range(HALF)])
    told = BPoly.from_derivatives([0.0, 1.0], terms * factorials)
    assert terms.ravel() @ rows[0] == pytest.approx(told.c[:, 0], abs=1e-11)
    rates = (terms.ravel() @ rows[1])[:ORDER]
    assert ORDER * rates == pytest.approx(told.derivative().c[:, 0], abs=1e-10)
    x = np.linspace(0, 1, 33)
    powers = np.polynomial.Polynomial(terms.ravel() @ rows[2])
    assert powers(x) == pytest.approx(told(x), abs=1e-8)


def test_tables_of_the_halves_of_a_part_are_those_of_de_casteljau():
    """By scipy's Bernstein polynomials; one of a lower degree is the end of the right table."""
    table, rng = bernstein_table(MODAL_LANES), np.random.default_rng(5)
    left, right = (table[at : at + TABLE].reshape(16, 16) for at in (LEFT_HALF, RIGHT_HALF))
    x = np.linspace(0, 1, 30)
    for degree in (15, 14, 13):
        less, parts = ORDER - degree, rng.normal(size=degree + 1)
        whole = BPoly(parts[:, None], [0, 1])
        first = BPoly((parts @ left[: degree + 1, : degree + 1])[:, None], [0, 1])
        second = BPoly((parts @ right[less:, less:])[:, None], [0, 1])
        assert first(x) == pytest.approx(whole(x / 2), abs=1e-14)
        assert second(x) == pytest.approx(whole((1 + x) / 2), abs=1e-14)
    places, over_x, shares = (table[at:].ravel()[:16] for at in (PLACES, OVER_X, SHARES))
    assert places.tolist() == list(range(16))
    assert over_x.tolist() == [ORDER / (k + 1.0) for k in range(16)]
    assert shares.tolist() == [1.0 / math.factorial(k) for k in range(16)]


def test_what_terms_at_both_ends_leave_out_of_waves_is_within_its_bound():
    """Of the wave, of its slope, and of the wave over the time from its zero."""
    rng = np.random.default_rng(20261126)
    x, shares = np.linspace(0.01, 1, 100), []
    for _ in range(300):
        rate = SPANNED * rng.uniform(0.5, 1) * np.exp(1j * rng.uniform(0.5, 1) * np.pi)
        size = np.exp(2j * np.pi * rng.uniform())
        ends = [[(size * rate**k * np.exp(rate * at)).real for k in range(HALF)] for at in (0, 1)]
        told = BPoly.from_derivatives([0.0, 1.0], ends)
        wave, left = size * np.exp(rate * x), abs(rate) ** (ORDER + 1) / FACTORIAL / CLOSER
        error = np.abs(told(x) - wave.real)
        slope_error = np.abs(told.derivative()(x) - (rate * wave).real)
        shares.append([error.max() / left, slope_error.max() / (STEEPER * left)])
        assert (error / x).max() < STEEPER * left
    most, steepest = np.max(shares, axis=0)
    assert 0.5 < most < 1.0  # twice as close would be too close
    assert steepest < 1.0


def test_runs_hold_all_that_is_not_zero_and_no_more_than_two_gaps_less():
    from saltus.flow.modal_state_rows import runs_of

    rng = np.random.default_rng(20261126)
    for share in (0.02, 0.3, 0.9, 1.0):
        filled = rng.uniform(size=(40, 17)) < share
        filled[0] = False
        for row, (first, end, again, last) in zip(filled, runs_of(filled).astype(int), strict=True):
            covered = [*range(first, end), *range(again, last)]
            assert set(np.flatnonzero(row)) <= set(covered)
            assert len(set(covered)) == len(covered)
            # the widest gap is left out, and so is what lies outside
            inner = np.diff(np.flatnonzero(row)).max(initial=1) - 1
            spread_ = np.ptp(np.flatnonzero(row)) + 1 if row.any() else 0
            assert len(covered) == spread_ - inner
