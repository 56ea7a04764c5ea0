"""Friction in the modal flow: closed forms, matrix exponentials, and Taylor's method."""

from __future__ import annotations

import math

import numpy as np
import pytest

import saltus as sl
from rubbing import by_exponentials, random_rubbing
from saltus.errors import SaltusWarning
from saltus.flow.maps import Stroboscope
from saltus.system.linearity import linear_pieces
from two_flows import same_rows

SEED = 20261126
ALL = ("ground", "belt", "shaken", "static", "jenkins", "pair")


def moved(system, start, method=None, **span):
    run = sl.simulate(system, start, method=method or sl.Modal(), progress=False, **span)
    assert str(run.status.values) == "ok"
    return run


# -- closed forms ----------------------------------------------------------------------------------
@sl.system(states="x v")
def rubbed(t, x, v, *, level=0.3):
    return v, -x - sl.friction(v, slip=level)


@pytest.mark.parametrize("start", [pytest.param(1.0, marks=pytest.mark.nojit), -5.9, 3.7])
def test_vibration_decays_by_twice_the_friction_a_half_cycle_and_sticks(start):
    """Turning points at pi, 2 pi, ...; the first one within the friction is the last."""
    run, size, half = moved(rubbed, (start, 0.0), t_end=40.0), abs(start), 0
    while size > 0.3:
        size, half = size - 0.6, half + 1
    times, kinds = run.contact_time.values, run.contact_kind.values.tolist()
    assert kinds == ["crossing"] * (half - 1) + ["hold"]
    assert times == pytest.approx(math.pi * np.arange(1, half + 1), rel=1e-14)
    assert float(run.end_x) == pytest.approx(
        (-1) ** half * math.copysign(1, start) * size, abs=1e-14
    )
    assert float(run.end_v) == 0.0


def test_response_is_den_hartogs():
    """Continuous sliding: X^2 = V^2 - (U f)^2, Trans. ASME 53 (1931) 107."""

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def driven(t, x, v, *, w=1.4, level=0.4):
        return v, sl.cos(w * t) - x - sl.friction(v, slip=level)

    given = np.array([0.45, 0.7, 1.4, 2.3])
    for w, level in zip(given, (0.2, 0.4, 0.4, 0.1), strict=True):
        system = driven.with_values(w=w, level=level)
        run = moved(system, (0.0, 0.0), periods=200, keep=1)
        v, u = 1 / (1 - w**2), math.sin(math.pi / w) / (w * (1 + math.cos(math.pi / w)))
        size = math.sqrt(v**2 - (u * level) ** 2)
        assert float(run.x.max()) == pytest.approx(size, rel=1e-4), "the largest of the samples"


def test_belt_carries_a_mass_to_the_limit_again_and_again():
    """Static over kinetic friction, Galvanetto's block: stick 5 s, slip 3.90 s."""

    @sl.system(states="x v")
    def block(t, x, v, *, speed=0.2):
        return v, -x - sl.friction(v - speed, slip=0.5, stick=1.0)

    run = moved(block, (1.0, 0.2), t_end=40.0)
    times, kinds = run.contact_time.values, run.contact_kind.values
    assert np.diff(times[kinds == "release"]) == pytest.approx(8.902605407814523, rel=1e-13)


# -- beside other solvers --------------------------------------------------------------------------
@pytest.mark.parametrize("seed", range(6))
def test_random_frictions_slide_and_stick_as_by_matrix_exponentials(seed):
    rng = np.random.default_rng([SEED, seed])
    degrees = 1 + seed % 4
    given = random_rubbing(rng, degrees, 1 + seed % min(3, degrees), kinds=ALL[:4] + ALL[5:])
    start, period = rng.normal(0, 0.02, 2 * degrees), 2 * math.pi / given.w
    changes, end = by_exponentials(given, start, 4 * period, steps=200)
    run = moved(given.system(), start, periods=4)
    assert run.contact_kind.values.tolist() == [kind for _, kind, _ in changes]
    times = [time for time, _, _ in changes]
    np.testing.assert_allclose(run.contact_time.values, times, rtol=0, atol=1e-9 * period)
    ends = [float(run[f"end_{name}"]) for name in given.system().states]
    np.testing.assert_allclose(ends, end, rtol=0, atol=1e-8)


@pytest.mark.parametrize("seed", range(9))
def test_random_structures_rub_as_by_taylor(seed):
    """Every row, of frictions of all kinds, Jenkins elements, stops and rough stops; driven by
    harmonics or a record.
    """
    rng = np.random.default_rng([SEED, 1, seed])
    degrees = 1 + seed % 5
    given = random_rubbing(
        rng, degrees, min(degrees, 1 + seed % 3), seed % 3,
        kinds=(*ALL, "rough")[: 6 + seed % 2], recorded=seed % 4 == 3,
    )  # fmt: skip
    system, period = given.system(), 2 * math.pi / given.w
    start = np.zeros(len(system.states))
    start[: 2 * degrees] = rng.normal(0, 0.02, 2 * degrees) if seed % 2 else 0.0
    span = {"t_end": 6 * period} if given.table is not None else {"periods": 6}
    modal, taylor = moved(system, start, **span), moved(system, start, sl.Taylor(), **span)
    assert same_rows(modal, taylor, period) == modal.sizes["contact"] == taylor.sizes["contact"]
    for name in system.states:
        assert float(modal[f"end_{name}"]) == pytest.approx(float(taylor[f"end_{name}"]), abs=1e-9)


@pytest.mark.parametrize("seed", range(8))
def test_derivatives_through_sliding_and_sticking_are_those_of_taylor(seed):
    rng = np.random.default_rng([SEED, 2, seed])
    degrees = 1 + seed % 3
    given = random_rubbing(rng, degrees, min(degrees, 1 + seed % 2), seed % 2, kinds=ALL)
    system = given.system()
    start = np.zeros((3, len(system.states)))
    start[1:, : 2 * degrees] = rng.normal(0, 0.02, (2, 2 * degrees))
    assert isinstance(sl.Modal().serving(sl.Modal().tangents(system)), sl.Modal)
    (ends, exact), (others, found) = (
        Stroboscope(system, method).tangent(start, 2) for method in (sl.Taylor(), sl.Modal())
    )
    np.testing.assert_allclose(others, ends, rtol=0, atol=1e-11)
    sizes = np.abs(exact).max(axis=(1, 2), keepdims=True)
    assert (np.abs(found - exact) <= 1e-9 * np.maximum(sizes, 1)).all()


# -- what is served --------------------------------------------------------------------------------
def test_result_says_why_another_flow_has_moved_it():
    @sl.system(states="x v")
    def stribeck(t, x, v):
        return v, -x - sl.friction(v - 0.2, slip=0.5 + 0.3 * sl.exp(-(v**2)))

    run = sl.simulate(stribeck, (0.0, 0.0), t_end=1.0, method=sl.Modal(), progress=False)
    assert "moved by Taylor: it isn't linear between its contacts" in sl.describe(run)
    run = moved(rubbed, (1.0, 0.0), t_end=1.0)
    assert "moved by" not in sl.describe(run)

    @sl.system(states="x v y w")
    def dependent(t, x, v, y, w):
        force = sl.friction(v, slip=0.5), sl.friction(w, slip=0.3), sl.friction(v - w, slip=0.1)
        return v, -x - force[0] - force[2], w, -y - force[1] + force[2]

    assert "depend on one another" in linear_pieces(dependent)


def test_start_beyond_the_limit_of_a_memory_is_refused():
    @sl.system(states="x v")
    def joint(t, x, v):
        return v, -x - sl.slider(x, stiffness=2.0, limit=1.0)

    moved(joint, (0.0, 1.0, 0.5), t_end=1.0)
    with pytest.warns(SaltusWarning, match="beyond a stop"):
        run = sl.simulate(joint, (0.0, 1.0, 0.6), t_end=1.0, method=sl.Modal(), progress=False)
    assert str(run.status.values) == "invalid"
