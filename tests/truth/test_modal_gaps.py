"""What the modal flow proves of gaps: legs beside matrix exponentials, tries, Bernstein rows."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import BPoly
from scipy.linalg import expm

import saltus as sl
from saltus.system.linear import linear_pieces


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


def check_legs(system, run, parts):
    """From each recorded contact to the next by a matrix exponential of the states, of cosine, sine
    and one: it ends at the recorded state, on the boundary, and no gap closes before.
    """
    linear, values = linear_pieces(system), dict(system.values)
    gaps, (rates, _) = linear.gaps(values), linear.rates(values)
    states, rate, matrices = len(system.states), float(rates[0]), {}
    names = [guard.name for guard in system.guards]
    at = np.array([run[f"contact_{name}"].values for name in system.states]).T
    times, size = run.contact_time.values, np.abs(at).max(axis=0)
    for k in range(len(times) - 1):
        mode = int(run.contact_mode_after[k])
        if mode not in matrices:
            piece, every = linear.piece(values, mode), np.zeros((states + 3, states + 3))
            every[:states, :states], every[:states, states] = piece.matrix, piece.driven[:, 0]
            every[:states, states + 2] = piece.constant
            every[states, states + 1], every[states + 1, states] = -rate, rate
            matrices[mode] = every
        whole = times[k + 1] - times[k]
        step = expm(matrices[mode] * whole / parts)
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


@pytest.mark.parametrize(("seed", "degrees", "contacts"), [(1, 9, 1), (2, 14, 3), (3, 20, 2)])
def test_legs_of_many_modes_are_those_of_matrix_exponentials(seed, degrees, contacts):
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


def test_few_tries_are_in_vain():
    """Where a step isn't decided as a whole, its first parts are: without them there are two tries
    in vain for each contact.
    """
    run = sl.simulate(spread(20261127, 9, 1), periods=40, progress=False, method=sl.Modal(),
        time_errors="local")  # fmt: skip
    assert run.events > 200
    assert run.rejected_steps < 0.7 * run.events


def test_bernstein_rows_are_those_of_scipy():
    from saltus.codegen.module import MODAL_LANES
    from saltus.flow.modal import bernstein_table

    rows = bernstein_table(MODAL_LANES).reshape(2, 16, 16)
    terms = np.random.default_rng(2).normal(size=16)
    polynomial, x = BPoly((terms @ rows[0])[:, None], [0.0, 1.0]), np.linspace(0, 1, 33)
    assert polynomial(x) == pytest.approx(np.polyval(terms[::-1], x), abs=1e-13)
    rates = BPoly(15 * (terms @ rows[1])[:15, None], [0.0, 1.0])
    assert rates(x) == pytest.approx(np.polyval(np.polyder(terms[::-1]), x), abs=1e-11)
