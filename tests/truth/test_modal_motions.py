"""Derivatives and numbers of motions by the modal flow, against Taylor's method and matrix
exponentials.
"""

from __future__ import annotations

import time

import numpy as np
import pytest
from scipy.linalg import expm

import saltus as sl
from saltus.analysis.branches.parametric_map import ParametricStroboscope
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.closed.field_zeros import field_of
from saltus.analysis.closed.measures import measure
from saltus.analysis.inputs.outputs import states_alone
from saltus.flow import modal_state_rows
from saltus.flow.maps import Stroboscope
from saltus.flow.modal_eigen import shared_of
from saltus.flow.modal_motions import modal_rates, wave_motions


def chain(modes, *, damping=None, side="both", gap=0.01):
    """A chain of masses with two stops, driven at its end."""
    stiffness = 400.0 * (2 * np.eye(modes) - np.eye(modes, k=1) - np.eye(modes, k=-1))
    stops = [
        sl.Contact(f"x{place}", stiffness=900.0, gap=gap, side=side, damping=damping, name=name)
        for place, name in ((1, "first"), (modes, "last"))
    ]
    return sl.structure(
        np.eye(modes), stiffness, damping_ratio=0.02, modes=modes, contacts=stops,
        forces=[sl.Force(f"x{modes}", 20.0, phase=0.3, name="drive")], frequency=2.3,
    )  # fmt: skip


def starts(system, count, seed):
    """Random states of the size of its motion."""
    rng = np.random.default_rng(seed)
    run = sl.simulate(system, periods=8, samples=16, progress=False)
    sizes = [float(np.abs(run[name]).max()) for name in system.states]
    return rng.uniform(-1, 1, (count, len(sizes))) * sizes


@pytest.mark.parametrize(
    ("modes", "damping", "shared"),
    [(2, None, False), (2, 15.0, False), (5, None, False), (5, 15.0, False), (5, 15.0, True)],
)
def test_derivative_of_the_state(modes, damping, shared, monkeypatch):
    """Also where the force of a damper jumps at the contact; by eigenvectors and their inverse,
    columns side by side, and by shapes alone.
    """
    monkeypatch.setattr(modal_state_rows, "SHARED", 1 if shared else 64)
    system = chain(modes, damping=damping)
    start = starts(system, 6, modes)
    (ends, exact), (others, found) = (
        Stroboscope(system, method).tangent(start, 2) for method in (sl.Taylor(), sl.Modal())
    )
    np.testing.assert_allclose(others, ends, rtol=0, atol=1e-10 * np.abs(ends).max())
    assert np.abs(found - exact).max() < 1e-9 * np.abs(exact).max()


def test_derivative_where_a_drive_resonates():
    """Its force is one on both sides of a boundary at which that of a damper jumps."""

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def driven(t, x, v, *, w=1.0, gap=0.4):
        return v, 0.3 * sl.cos(w * t) - x - sl.where(x > gap, 4.0 * (x - gap) + v, 0.0)

    start = np.random.default_rng(4).normal(0, 0.5, (6, 2))
    (ends, exact), (others, found) = (
        Stroboscope(driven, method).tangent(start, 2) for method in (sl.Taylor(), sl.Modal())
    )
    np.testing.assert_allclose(others, ends, rtol=0, atol=1e-11)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-10 * np.abs(exact).max())


@pytest.mark.nojit
@pytest.mark.parametrize("shared", [False, True])
def test_derivative_is_the_difference_of_neighbours(shared, monkeypatch):
    """Through contacts whose dampers make the force jump."""
    monkeypatch.setattr(modal_state_rows, "SHARED", 1 if shared else 64)
    modes = 5 if shared else 2
    system = chain(modes, damping=15.0)
    map_ = Stroboscope(system, sl.Modal())
    start = np.repeat([[0.012, -0.02, 0.4, 0.3]], [modes - 1, 1, modes - 1, 1], axis=1)
    _, found = map_.tangent(start, 1)
    steps = 1e-6 * np.repeat([0.02, 0.5], modes)
    for j, step in enumerate(steps):
        both = start + step * np.array([[1.0], [-1.0]]) * np.eye(2 * modes)[j]
        (above, below), _ = map_.rows(np.zeros(2, int)).ends(both, 1)
        np.testing.assert_allclose(
            (above - below) / (2 * step), found[0, :, j], atol=1e-5 * np.abs(found).max()
        )


def test_derivative_without_contacts_is_a_matrix_exponential():
    stiffness = 400.0 * (2 * np.eye(3) - np.eye(3, k=1) - np.eye(3, k=-1))
    squares = np.linalg.eigvalsh(stiffness)
    matrix = np.block(
        [[np.zeros((3, 3)), np.eye(3)], [-np.diag(squares), -0.04 * np.diag(np.sqrt(squares))]]
    )
    _, found = Stroboscope(chain(3, gap=1e3), sl.Modal()).tangent(np.zeros((1, 6)), 3)
    expected = expm(matrix * 3 / 2.3)
    np.testing.assert_allclose(found[0], expected, atol=1e-11 * np.abs(expected).max())


def test_derivatives_by_parameters():
    """Columns that the flow carries beside those of Taylor's method, where the force of a damper
    jumps.
    """
    system = chain(3, damping=15.0)
    names = ("frequency", "drive", "last_gap", "first_stiffness", "last_damping")
    z = np.append(starts(system, 1, 5)[0], [system.values[name] for name in names])[None]
    evaluated = [
        PeriodicOrbits(system, names, 1, np.ones_like(z), method).evaluate(z, np.array([0]))
        for method in (sl.Taylor(), sl.Modal())
    ]
    (residual, exact), (other, found) = evaluated
    np.testing.assert_allclose(other, residual, atol=1e-10 * np.abs(residual).max())
    for column, expected in zip(found[0].T, exact[0].T, strict=True):
        np.testing.assert_allclose(column, expected, atol=1e-10 * np.abs(expected).max())


def test_gap_is_a_state_that_modal_serves():
    """A parameter that leaves the equations linear needs no differences."""
    system = chain(3)
    z = np.append(starts(system, 1, 5)[0], system.values["last_gap"])[None]
    by_modes, by_series = (
        PeriodicOrbits(system, ("last_gap",), 1, np.ones_like(z), method)
        for method in (sl.Modal(), sl.Taylor())
    )
    assert not isinstance(by_modes.map, ParametricStroboscope)
    found, exact = (one.evaluate(z, np.array([0]))[1] for one in (by_modes, by_series))
    np.testing.assert_allclose(found, exact, atol=1e-9 * np.abs(exact).max())


@pytest.mark.slow
def test_orbits_and_branches_are_those_of_taylor():
    system = chain(4, damping=15.0)
    both = [
        sl.branches(system, {"frequency": (2.0, 2.4)}, np.zeros(8), method=method, progress=False)
        for method in (sl.Taylor(), sl.Modal())
    ]
    one, other = both
    assert one.sizes["branch"] == other.sizes["branch"]
    assert list(one.event_kind.values) == list(other.event_kind.values)
    np.testing.assert_allclose(other.event_frequency.values, one.event_frequency.values, rtol=1e-8)


@pytest.mark.parametrize("modes", [1, 2, 4])
def test_numbers_of_a_motion_are_those_of_its_polynomials(modes):
    system = chain(modes)
    start = starts(system, 1, modes)
    for _ in range(60):
        start, _ = Stroboscope(system, sl.Modal()).ends(start, 1)
    one, other = (
        measure(Stroboscope(system, method), start, np.array([2]))
        for method in (sl.Taylor(), sl.Modal())
    )
    for name in ("maximum", "minimum", "mean", "deviation", "harmonic", "span", "contacts"):
        expected = getattr(one, name)
        np.testing.assert_allclose(
            getattr(other, name), expected, atol=1e-9 * np.abs(one.maximum).max(), err_msg=name
        )
    np.testing.assert_allclose(other.margin, one.margin, rtol=1e-6)
    assert other.itinerary == one.itinerary
    np.testing.assert_allclose(
        other.turning[0], one.turning[0], atol=1e-8 * np.abs(one.maximum).max()
    )


@pytest.mark.parametrize(
    ("modes", "restitution", "preload"), [(2, 0.6, 0.0), (4, 0.8, 0.0), (3, 0.3, 4.0)]
)
def test_numbers_of_a_motion_between_rigid_stops(modes, restitution, preload):
    """Rates jump at impacts, and a stop may be at rest: beside Taylor's method, and turning points
    beside sign changes of samples.
    """
    stiffness = 400.0 * (2 * np.eye(modes) - np.eye(modes, k=1) - np.eye(modes, k=-1))
    stops = [
        sl.Contact(f"x{place}", gap=0.01, restitution=restitution, name=name)
        for place, name in ((1, "first"), (modes, "last"))
    ]
    loads = [sl.Force("x1", preload, harmonic=0, name="dead")] if preload else []
    system = sl.structure(
        np.eye(modes), stiffness, damping_ratio=0.02, modes=modes, contacts=stops, frequency=2.3,
        forces=[sl.Force(f"x{modes}", 20.0, phase=0.3, name="drive"), *loads],
    )  # fmt: skip
    start, _ = Stroboscope(system, sl.Modal()).ends(np.zeros((1, 2 * modes)), 30)
    maps = [Stroboscope(system, method) for method in (sl.Taylor(), sl.Modal())]
    assert wave_motions(maps[1], start, 2, *_asked(system)) is not None
    one, other = (measure(map_, start, np.array([2])) for map_ in maps)
    # what is left of a chatter is completed to 1e-8 of a time scale
    size = (1e-8 if preload else 1e-9) * np.abs(one.maximum).max()
    for name in ("maximum", "minimum", "mean", "deviation", "harmonic", "span", "contacts"):
        np.testing.assert_allclose(
            getattr(other, name), getattr(one, name), atol=size, err_msg=name
        )
    assert one.contacts[0] > 1
    assert other.itinerary == one.itinerary
    run = sl.simulate(
        system, start[0], periods=2, samples=20_000, progress=False, method=sl.Modal()
    )
    signs = np.sign(run[system.states[modes]].values.ravel()[:-1])
    assert len(other.turning[0]) == np.sum(signs != np.roll(signs, 1))


def _asked(system):
    """No quantities, and all guards."""
    outputs = states_alone(system)
    return outputs.formulas, outputs.guards


def test_modal_is_the_default_of_many_states_that_it_serves():
    """Taylor's method keeps few states, and what isn't linear between contacts."""
    run = [
        sl.simulate(system, periods=2, progress=False).attrs["method"]
        for system in (chain(3), chain(4), sl.models.chain())
    ]
    assert run == ["Taylor", "Modal", "Taylor"]
    curved = [sl.Contact("x1", stiffness=1e4, gap=0.01, power=1.5)]
    hertz = sl.structure(np.eye(5), 400.0 * np.eye(5), modes=5, contacts=curved)
    assert sl.simulate(hertz, t_end=0.1, progress=False).attrs["method"] == "Taylor"


@pytest.mark.parametrize("seed", [40917, 40918, 40919, 40920])
def test_random_structures(seed):
    """Derivatives and numbers of a random structure, damped stops and several forces among them."""
    rng = np.random.default_rng(seed)
    degrees = int(rng.integers(2, 5))
    root = rng.normal(size=(degrees, degrees))
    stops = [
        sl.Contact(
            f"x{place}", float(10 ** rng.uniform(2, 4)), float(rng.uniform(0.001, 0.02)),
            side=str(rng.choice(["both", "upper", "lower"])), name=f"stop_{place}",
            damping=float(rng.uniform(0.5, 5)) if rng.random() < 0.5 else None,
        )
        for place in rng.choice(degrees, 2, replace=False) + 1
    ]  # fmt: skip
    forces = [
        sl.Force("x1", 20.0, phase=0.4, name="a"),
        sl.Force("x2", 2.0, harmonic=2, name="b"),
        sl.Force("x1", 1.5, harmonic=0, name="dead"),
    ]
    system = sl.structure(
        np.eye(degrees), 400 * (root @ root.T / degrees + np.eye(degrees)), modes=degrees,
        damping_ratio=float(rng.uniform(0.005, 0.2)), contacts=stops, frequency=2.5,
        forces=forces,
    )  # fmt: skip
    start, _ = Stroboscope(system, sl.Modal()).ends(np.zeros((1, 2 * degrees)), 20)
    maps = [Stroboscope(system, method) for method in (sl.Taylor(), sl.Modal())]
    (ends, exact), (others, found) = (map_.tangent(start, 1) for map_ in maps)
    np.testing.assert_allclose(others, ends, atol=1e-10 * np.abs(ends).max())
    np.testing.assert_allclose(found, exact, atol=1e-9 * np.abs(exact).max())
    one, other = (measure(map_, start, np.array([1])) for map_ in maps)
    for name in ("maximum", "minimum", "mean", "deviation", "harmonic", "margin"):
        np.testing.assert_allclose(
            getattr(other, name), getattr(one, name), atol=1e-10 * np.abs(one.maximum).max()
        )
    assert other.itinerary == one.itinerary


def test_the_largest_exponents_alone_are_those_of_all():
    """Three directions are carried in place of twelve, from other ones at the start. 800 periods
    leave no doubt about the first one: of 100 it was as large as three errors.
    """
    beam = chain(6, gap=0.02).with_values(first_stiffness=2e4, last_stiffness=2e4)
    kw = {"periods": 800, "transient": 150, "progress": False}
    every, some = (sl.lyapunov(beam, exponents=most, **kw) for most in (None, 3))
    assert every.kind.item() == some.kind.item() == "chaotic"
    apart = np.abs(some.lyapunov_exponent.values - every.lyapunov_exponent.values[:, :3])
    assert (apart < 1e-2 * some.lyapunov_error.values).all()
    np.testing.assert_array_equal(some.mean_divergence, every.mean_divergence)
    assert some.sizes["flow_exponent"] == 3
    assert "exponent_sum" not in some


def test_the_largest_exponents_of_an_orbit_and_by_other_methods():
    quiet = chain(2, gap=10.0)
    kw = {"periods": 64, "transient": 10, "progress": False}
    every, some = (sl.lyapunov(quiet, exponents=most, flow=sl.Taylor(), **kw) for most in (None, 2))
    assert some.kind.item() == "periodic"
    np.testing.assert_array_equal(some.lyapunov_exponent, every.lyapunov_exponent[:, :2])


def test_rates_by_modes_are_those_of_the_equations():
    system = chain(5)
    start = starts(system, 6, 2)
    map_ = Stroboscope(system, sl.Modal()).rows(np.zeros(6, np.int64))
    rates = field_of(system, start, map_.values)
    np.testing.assert_allclose(modal_rates(map_, start), rates, rtol=0, atol=1e-12 * rates.max())


@pytest.mark.parametrize(
    "highest", ["6 Hz", pytest.param("25 Hz", marks=pytest.mark.slow, id="ten resonances")]
)
def test_a_structure_without_contacts_has_the_response_of_its_matrices(highest):
    """Twelve modes of a chain: |(K - w^2 M + i w C)^-1 f|, and one branch over all resonances."""
    n = 12
    mass, stiff = np.eye(n), 1e4 * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    damp, names = 2e-4 * stiff, [f"u{i}" for i in range(n)]
    chain = sl.structure(
        mass, stiff, damp, names=names, modes=n, forces=[sl.Force("u3", "2 N")],
        frequency="5 Hz", sensors={"end": "u11"},
    )  # fmt: skip
    found = sl.frequency_response(chain, ("5 Hz", highest, 3), progress=False)
    rates = 2 * np.pi * found.frequency.values
    wanted = [
        np.abs(np.linalg.solve(stiff - w**2 * mass + 1j * w * damp, 2.0 * np.eye(n)[3])[11])
        for w in rates
    ]
    rows = found.response_of.values.ravel()
    peak = found.output_maximum.sel(output="end").values[rows]
    np.testing.assert_allclose(peak, wanted, rtol=1e-9)
    assert np.isinf(found.response_margin.values).all()
    assert (found.branch_begin.item(), found.branch_end.item()) == ("range", "range")


def random_chain(seed):
    """A chain of 4 to 40 masses, some in two parts, by some of its modes, with one to four stops
    that touch without a damper.
    """
    rng = np.random.default_rng(seed)
    masses = int(rng.integers(4, 41))
    stiffness = 400.0 * (2 * np.eye(masses) - np.eye(masses, k=1) - np.eye(masses, k=-1))
    if rng.random() < 0.3:
        half = masses // 2
        stiffness[half:, :half] = stiffness[:half, half:] = 0.0
    stops = [
        sl.Contact(
            f"x{place}", stiffness=float(10 ** rng.uniform(2, 4)), name=f"stop_{place}",
            gap=float(rng.uniform(0.005, 0.06)), side=str(rng.choice(["upper", "lower", "both"])),
        )
        for place in rng.choice(masses, int(rng.integers(1, 5)), replace=False) + 1
    ]  # fmt: skip
    return sl.structure(
        np.eye(masses), stiffness, damping_ratio=0.02, modes=int(rng.integers(4, masses + 1)),
        forces=[sl.Force(f"x{masses}", 20.0, name="last"), sl.Force("x1", 9.0, name="first")],
        names=[f"x{place + 1}" for place in range(masses)], contacts=stops, frequency=2.3,
    )  # fmt: skip


def check_by_shapes(seed, monkeypatch):
    """The derivative of a motion of a random chain by shapes alone is that by eigenvectors and
    their inverse.
    """
    found, tables, start = [], [], None
    for shared in (1, 10**9):
        monkeypatch.setattr(modal_state_rows, "SHARED", shared)
        monkeypatch.setattr(
            modal_state_rows, "shared_of", lambda *of: tables.append(shared_of(*of)) or tables[-1]
        )
        map_ = Stroboscope(random_chain(seed), sl.Modal(), threads=1)
        if start is None:
            start = map_.ends(np.zeros((1, len(map_.states))), 7)[0]
        found.append(map_.tangent(start, 2))
    (ends, exact), (others, other) = reversed(found)
    np.testing.assert_allclose(others, ends, rtol=0, atol=1e-9 * np.abs(ends).max())
    assert np.abs(other - exact).max() < 1e-8 * np.abs(exact).max()
    assert any(one is not None for one in tables)


@pytest.mark.parametrize("seed", range(4))
def test_derivatives_by_shapes_are_those_by_eigenvectors(seed, monkeypatch):
    check_by_shapes(seed, monkeypatch)


@pytest.mark.nightly
def test_so_are_those_of_a_hundred_chains(monkeypatch):
    seed = int(time.time())
    print(f"seed {seed}")
    for one in range(100):
        check_by_shapes(seed + one, monkeypatch)
