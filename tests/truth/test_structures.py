"""Structures from matrices against closed forms, against an equation written by hand, and against a
published one.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.sparse as sp

import saltus as sl
from saltus.errors import ParameterError
from saltus.flow.maps import Stroboscope

N, F = 6, 0.17


def chain_matrices(n=N):
    """Masses of 1 between walls, joined by springs of 1."""
    return np.eye(n), 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)


def consistent_mass(n=N):
    """The mass matrix of linear finite elements: full inverse."""
    return (4 * np.eye(n) + np.eye(n, k=1) + np.eye(n, k=-1)) / 6


FORCES = [
    sl.Force("x2", 1.5, phase=0.4, name="first"),
    sl.Force("x5", 0.7, harmonic=3, name="third"),
    sl.Force("x4", 0.2, harmonic=0, name="dead"),
]


def steady_state(mass, damping, stiffness):
    """Deflections and velocities at whole periods: a linear solve for each harmonic."""
    x, v = np.zeros(len(mass)), np.zeros(len(mass))
    for force in FORCES:
        w = 2 * math.pi * F * force.harmonic
        load = np.zeros(len(mass), complex)
        load[int(force.at[1:]) - 1] = force.amplitude * np.exp(1j * (force.phase or 0.0))
        amplitude = np.linalg.solve(stiffness - w**2 * mass + 1j * w * damping, load)
        x, v = x + amplitude.real, v + (1j * w * amplitude).real
    return x, v


@pytest.mark.parametrize("kind", ["physical", "sparse", "consistent", "modes"])
def test_steady_state_of_a_linear_chain(kind):
    mass, stiffness = chain_matrices()
    if kind == "consistent":
        mass = consistent_mass()
    damping = 0.3 * stiffness + 0.1 * mass
    x, v = steady_state(mass, damping, stiffness)
    given = [sp.csr_array(one) if kind == "sparse" else one for one in (mass, stiffness, damping)]
    count = N if kind == "modes" else None
    made = sl.structure(*given, forces=FORCES, frequency=F, modes=count)
    start, truth = np.zeros(2 * N), np.concatenate([x, v])
    if kind == "modes":
        shapes = sl.structure_modes(mass, stiffness)["shape"].values
        truth = np.concatenate([shapes.T @ mass @ x, shapes.T @ mass @ v])
    map_ = Stroboscope(made, sl.Taylor(lanes=2))
    settled = map_.run(start[None, :], 200).state[0]
    assert np.abs(settled - truth).max() < 1e-13 * np.abs(truth).max() * N
    again = map_.run(truth[None, :], 1).state[0]
    assert np.abs(again - truth).max() < 1e-14 * N


def test_modes_of_a_chain():
    """Shapes sin(j i pi/(n + 1)), angular frequencies 2 sin(i pi/(2 (n + 1)))."""
    table = sl.structure_modes(*chain_matrices())
    i = np.arange(1, N + 1)
    angular = 2 * np.sin(i * math.pi / (2 * (N + 1)))
    assert np.allclose(2 * math.pi * table["frequency"], angular, rtol=1e-14)
    shapes = np.sin(np.outer(i, i) * math.pi / (N + 1)) * math.sqrt(2 / (N + 1))
    found = table["shape"].values
    assert np.allclose(found * np.sign(found[0] * shapes[0]), shapes, atol=1e-14)


@pytest.mark.parametrize("n", [40, 3000])
def test_what_a_reduction_leaves_out(n):
    """Of a chain, dense or sparse: flexibility i (n + 1 - i)/(n + 1), of mode k sin^2/omega^2."""
    at, keep, k = n // 3, 5, np.arange(1, 6)
    stiffness = sp.diags_array([-np.ones(n - 1), 2 * np.ones(n), -np.ones(n - 1)],
        offsets=[-1, 0, 1])  # fmt: skip
    table = sl.structure_modes(sp.eye_array(n), stiffness, keep, at=f"x{at}")
    total = at * (n + 1 - at) / (n + 1)
    parts = np.sin(at * k * math.pi / (n + 1)) ** 2 / (2 * np.sin(k * math.pi / 2 / (n + 1))) ** 2
    kept = 2 / (n + 1) * parts.sum()
    assert table["flexibility"].item() == pytest.approx(total, rel=1e-9)
    assert table["residual_flexibility"].item() == pytest.approx(total - kept, rel=1e-6)
    assert table["flexibility_share"].item() == pytest.approx(kept / total, rel=1e-8)


def test_free_bodies_move():
    """Two masses joined by a spring, free: their stretch is 1/k, each alone runs away."""
    stiffness = 50.0 * np.array([[1, -1], [-1, 1]])
    both = sl.structure_modes(np.diag([1.0, 3.0]), stiffness, at="x1 x2")
    assert both["frequency"].values == pytest.approx([0, math.sqrt(50 * 4 / 3) / (2 * math.pi)],
        abs=1e-8)  # fmt: skip
    assert np.isinf(both["flexibility"]).all()
    one, two = (
        sl.structure_modes(np.diag([1.0, 3.0]), stiffness, count, at=[("x2", "x1")])
        for count in (1, 2)
    )
    assert one["flexibility"].item() == pytest.approx(0.02, rel=1e-12)
    assert one["residual_flexibility"].item() == pytest.approx(0.02, rel=1e-12)
    assert two["flexibility_share"].item() == 1.0


def test_as_the_equation_written_by_hand():
    hand = sl.models.chain()
    contacts = [
        sl.Contact("x1", "20 kN/m", "1 mm", side="both", name="ground"),
        {"at": "x2", "to": "x1", "stiffness": "10 kN/m", "gap": "0.5 mm", "side": "both",
            "name": "coupling"},
    ]  # fmt: skip
    matrices = (
        np.diag([1.0, 0.5]), np.array([[1400.0, -400], [-400, 400]]), np.array([[6.0, -2], [-2, 2]])
    )  # fmt: skip
    rest, common = np.zeros(4), {"contacts": contacts, "forces": [sl.Force("x1", "2 N")]}
    truth = sl.simulate(hand, rest, periods=20)
    made = sl.structure(*matrices, **common, frequency="7 Hz")
    run = sl.simulate(made, rest, periods=20)
    for name in ("end_x1", "end_x2", "end_v1", "end_v2"):
        assert abs(run[name] - truth[name]) < 1e-14
    assert np.abs(run.contact_time.values - truth.contact_time.values).max() < 1e-12
    modal = sl.simulate(sl.structure(*matrices, **common, frequency="7 Hz", modes=2), rest,
        periods=20)  # fmt: skip
    assert np.abs(modal.contact_time.values - truth.contact_time.values).max() < 1e-12


#: Two masses with a one-sided spring, example 03 of NLvib (Krack & Gross): angular frequencies of
#: its bifurcations, orbits there, and the multiplier that each has (pseudo-arclength on the exact
#: map; DOP853 closes the orbits to 7e-15).
BIFURCATIONS = [
    (0.755627352609, [-0.6760294564523489, -0.8176047071240563, 1.0508781878135274,
        0.190765997505432], 1.0),
    (0.738783025373, [0.44546929801001506, 0.463302734474232, 0.6417253713846581,
        1.0173423689843566], -1.0),
    (0.618606874267, [0.9727670384844287, 0.6451373577605555, 0.24830190915693517,
        0.07050740081979488], None),
]  # fmt: skip


@pytest.mark.parametrize(("angular", "orbit", "multiplier"), BIFURCATIONS)
def test_bifurcations_of_two_masses(angular, orbit, multiplier):
    stiffness = np.array([[1.0, -1.0], [-1.0, 2.0]])
    pair = sl.structure(
        np.eye(2), stiffness, 0.03 * stiffness, frequency=angular / (2 * math.pi),
        contacts=[sl.Contact("x1", 100.0, 1.0)], forces=[sl.Force("x2", 0.1)],
    )  # fmt: skip
    end, tangent = Stroboscope(pair, sl.Taylor(lanes=2)).tangent(np.array([orbit]), 1)
    assert np.abs(end[0] - orbit).max() < 1e-11
    found = np.linalg.eigvals(tangent[0])
    if multiplier is None:  # a pair on the unit circle
        pair_of = found[found.imag > 0]
        assert np.abs(np.abs(pair_of) - 1).min() < 1e-9
    else:
        assert np.abs(found - multiplier).min() < 1e-5  # a double root at a fold


def test_damping_ratios():
    """Each mode of the free structure decays as exp(-zeta omega t)."""
    mass, stiffness = consistent_mass(3), chain_matrices(3)[1]
    ratios = [0.01, 0.02, 0.05]
    made = sl.structure(mass, stiffness, damping_ratio=ratios)
    eigenvalues = np.linalg.eigvals(np.array([[float(made.rhs(0.0, row)[i]) for row in np.eye(6)]
        for i in range(6)]))  # fmt: skip
    modal = sl.structure(mass, stiffness, damping_ratio=ratios, modes=3)
    assert made.states[0] == "x1"
    found = np.sort(-eigenvalues.real / np.abs(eigenvalues))
    assert np.allclose(found, np.repeat(ratios, 2), rtol=1e-12)
    assert np.allclose(
        [-modal.rhs(0.0, row)[3 + i] for i, row in enumerate(np.eye(6)[3:])],
        2 * np.array(ratios) * np.sort(np.abs(eigenvalues))[::2], rtol=1e-12,
    )  # fmt: skip


@pytest.mark.parametrize("masses", [4, 800])  # dense, and sparse above 1500 degrees of freedom
def test_degrees_of_freedom_without_mass_follow_the_others(masses):
    """Of a chain whose every other point has a mass each two springs are one of half the rate."""
    n, rate = 2 * masses + 1, 900.0
    ones = np.ones(n)
    chain = rate * sp.diags([-ones[1:], 2 * ones, -ones[1:]], [-1, 0, 1], format="csr")
    weight = np.arange(n) % 2.0
    mass = sp.diags(weight, format="csr")
    table = sl.structure_modes(mass, chain, 3, at="x1")
    turns = np.arange(1, 4) * np.pi / (2 * (masses + 1))
    closed = 2 * np.sqrt(rate / 2) * np.sin(turns) / (2 * np.pi)
    np.testing.assert_allclose(table["frequency"], closed, rtol=1e-9)
    middle = table["shape"].values[2::2][: masses - 1]
    apart = table["shape"].values
    np.testing.assert_allclose(middle, (apart[1:-2:2] + apart[3::2]) / 2, atol=1e-9)
    x1 = n / (n + 1) / rate  # static deflection of the first of n under its own force
    assert float(table["flexibility"][0]) == pytest.approx(x1, rel=1e-9)
    stop = sl.Contact("x3", stiffness=1e4, gap=1e-3)
    made = sl.structure(mass, chain, modes=3, contacts=[stop])
    assert len(made.states) == 6
    with pytest.raises(ParameterError, match=r"no mass, so there are \d+ modes: give modes="):
        sl.structure_modes(mass, chain, masses + 1)
