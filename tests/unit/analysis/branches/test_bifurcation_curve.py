"""Curves of bifurcations against closed forms, normal forms and an independent solver."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar, root

import impact_orbits
import saltus as sl
from saltus.analysis.branches import bifurcation_curve as of_curves
from saltus.errors import ParameterError

NORMAL_FORMS = {
    "cusp": lambda p, q, x: p + 2 * q + q * x - x**3,
    "isola_birth": lambda p, q, x: q - p**2 - x**2,
    "branches_join": lambda p, q, x: q + p**2 - x**2,
}


def normal_form(kind):
    """A system whose periodic orbits are the zeros of a normal form."""

    @sl.system(states="x", forced_at="frequency")
    def form(t, x, *, p=0.0, q=0.0, frequency=1.0):
        return NORMAL_FORMS[kind](p, q, x)

    return form


@sl.system(states="x v", forced_at="omega", units={"omega": "rad/s"})
def duffing(t, x, v, *, c=0.2, force=0.5, omega=1.8):
    return v, -c * v - x - x**3 + force * sl.cos(omega * t)


@sl.system(states="x v", forced_at="omega", units={"omega": "rad/s"})
def parametric(t, x, v, *, c=0.1, depth=0.3, quadratic=0.0, cubic=0.2, omega=2.0):
    pull = (1 + depth * sl.cos(omega * t)) * x + quadratic * x**2 + cubic * x**3
    return v, -c * v - pull


@sl.system(states="x v", forced_at="omega", units={"omega": "rad/s"})
def linear(t, x, v, *, a=0.05, omega=1.4):
    return v, -2 * a * v - (1 + a**2) * x + sl.cos(omega * t)


def bifurcations(found, kind, n=1):
    """The events of a kind on branches of n periods, as Datasets."""
    periods = found.branch_periods.values[found.event_branch.values]
    return [
        found.sel(event=int(i))
        for i in np.flatnonzero((found.event_kind.values == kind) & (periods == n))
    ]


def only(curve, kind):
    """The one point of a kind on a curve."""
    (place,) = np.flatnonzero(curve.codim2_kind.values == kind)
    return curve.isel(codim2=place)


# -- closed forms ----------------------------------------------------------------------------------
def test_the_doubling_of_an_impact_oscillator_over_its_restitution():
    """cos^2(pi n/w) (w^2 - 1 + 4e/(1 + e)^2) = 1 for one impact in n = 1 periods."""
    values = {"restitution": 0.8, "frequency": 2.5}
    system = sl.models.impact_oscillator(stiffness=1, damping=0, force=1, gap=0, **values)
    _, start = impact_orbits.oscillator(**values)[-1]
    found = sl.branches(system, {"frequency": (2.5, 2.7)}, start, at=1, longest=1)
    (event,) = bifurcations(found, "period_doubling")
    curve = sl.bifurcation_curve(
        system, event, {"frequency": (2.3, 2.9), "restitution": (0.3, 0.95)}
    )
    w, e = curve.point_frequency.values, curve.point_restitution.values
    assert (e.min(), e.max()) == pytest.approx((0.3, 0.95), abs=1e-12)
    residual = np.cos(np.pi / w) ** 2 * (w**2 - 1 + 4 * e / (1 + e) ** 2) - 1
    np.testing.assert_allclose(residual, 0, atol=1e-11)
    assert curve.attrs["bifurcation"] == "period_doubling"
    assert not len(curve.codim2)


def longest_gap(frequency, damping=0.05, restitution=0.5):
    """The largest stop distance at which an orbit with one impact a period exists."""
    whole = impact_orbits.flow(1.0, damping, 2 * np.pi / frequency)
    g = np.linalg.solve(np.eye(2) - whole, whole @ [0.0, restitution] + [0.0, 1.0])
    response = 1 / abs(1 - frequency**2 + 1j * damping * frequency)
    return response * np.sqrt(1 + (g[0] * frequency / g[1]) ** 2)


def test_orbits_with_an_impact_are_born_as_an_isola_at_the_largest_gap():
    values = {"damping": 0.05, "restitution": 0.5, "frequency": 0.55, "gap": 1.95}
    system = sl.models.impact_oscillator(stiffness=1, force=1, **values)
    _, start = impact_orbits.oscillator(**values)[-1]
    found = sl.branches(system, {"frequency": (0.52, 0.6)}, start, at=1, longest=1, switch=())
    event = bifurcations(found, "fold")[0]
    curve = sl.bifurcation_curve(system, event, {"frequency": (0.53, 0.58), "gap": (1.8, 2.1)})
    w, gap = curve.point_frequency.values, curve.point_gap.values
    np.testing.assert_allclose(gap, [longest_gap(one) for one in w], rtol=1e-11)
    best = minimize_scalar(lambda w: -longest_gap(w), bracket=(0.55, 0.558, 0.565), tol=1e-12)
    birth = only(curve, "isola_birth")
    assert birth.codim2_extremum.item() == "gap"
    assert birth.codim2_gap.item() == pytest.approx(-best.fun, rel=1e-11)
    assert birth.codim2_frequency.item() == pytest.approx(best.x, abs=1e-7)


def test_a_torus_of_a_linear_oscillator_and_its_resonances():
    """exp(2 pi (-a +- i)/w): on the circle at a = 0, resonant where w is 3/2 and 4/3."""
    found = sl.branches(linear, {"a": (-0.1, 0.3)}, (0, 0), at=2)
    (event,) = bifurcations(found, "neimark_sacker")
    curve = sl.bifurcation_curve(linear, event, {"omega": (1.1, 3.0), "a": (-0.2, 0.3)})
    np.testing.assert_allclose(curve.point_a.values, 0, atol=1e-12)
    assert {curve.attrs["begin"], curve.attrs["end"]} == {"resonance_1_2", "range"}
    assert curve.point_omega.values.max() == pytest.approx(2.0, abs=1e-4)
    assert only(curve, "resonance_1_3").codim2_omega.item() == pytest.approx(3 / 2, abs=1e-11)
    assert only(curve, "resonance_1_4").codim2_omega.item() == pytest.approx(4 / 3, abs=1e-11)
    assert len(curve.codim2) == 2


def test_many_states_have_fewer_points_and_what_is_known_is_handed_out(monkeypatch):
    (event,) = bifurcations(sl.branches(linear, {"a": (-0.1, 0.3)}, (0, 0), at=2), "neimark_sacker")
    vary, stop = {"omega": (1.1, 3.0), "a": (-0.2, 0.3)}, sl.Stop()
    with pytest.raises(sl.Interrupted) as caught, stop:
        sl.bifurcation_curve(
            linear, event, vary, points=60, progress=lambda share: share > 0.05 and stop.set()
        )
    curve = caught.value.partial
    assert (curve.attrs["begin"], curve.attrs["end"]) == ("interrupted", "interrupted")
    assert len(curve.point) > 6
    np.testing.assert_allclose(curve.point_a.values, 0, atol=1e-12)
    monkeypatch.setattr(of_curves, "POINTS", 8)
    monkeypatch.setattr(of_curves, "FEW_STATES", 1)
    curve = sl.bifurcation_curve(linear, event, vary)
    assert len(curve.point) == 4 + 4 - 1
    assert {curve.attrs["begin"], curve.attrs["end"]} == {"points"}


# -- normal forms ----------------------------------------------------------------------------------
#: Where the branch over p is followed, and what its folds are over both parameters.
FOLDS = {
    "cusp": (1.0, 1.1, lambda p, q: 27 * (p + 2 * q) ** 2 - 4 * q**3),
    "isola_birth": (0.5, 0.3, lambda p, q: q - p**2),
    "branches_join": (-0.1, 0.8, lambda p, q: q + p**2),
}


@pytest.mark.parametrize("kind", NORMAL_FORMS)
def test_the_fold_of_a_normal_form(kind):
    system = normal_form(kind)
    q, x, residual = FOLDS[kind]
    found = sl.branches(system.with_values(q=q), {"p": (-4.0, 2.0)}, (x,), at=5)
    event = bifurcations(found, "fold")[0]
    curve = sl.bifurcation_curve(system, event, {"p": (-4.0, 1.0), "q": (-1.0, 1.5)})
    p, q = curve.point_p.values, curve.point_q.values
    np.testing.assert_allclose(residual(p, q), 0, atol=1e-11)
    assert np.ptp(p) > 0.3
    assert {curve.attrs[end] for end in ("begin", "end")} == {"range"}
    point = only(curve, kind)
    assert [point.codim2_p.item(), point.codim2_q.item()] == pytest.approx([0, 0], abs=1e-9)
    assert point.codim2_extremum.item() == ("" if kind == "cusp" else "q")
    assert len(curve.codim2) == 1


def test_a_doubling_is_degenerate_where_its_cubic_term_vanishes():
    """Without quadratic stiffness the orbits of twice the period bend by the cubic one alone."""
    system = parametric
    found = sl.branches(system, {"depth": (0.0, 0.6)}, (0, 0), at=2, longest=1)
    (event,) = bifurcations(found, "period_doubling")
    curve = sl.bifurcation_curve(system, event, {"depth": (0.0, 0.6), "cubic": (-0.5, 0.5)})
    assert np.ptp(curve.point_depth.values) < 1e-12
    assert only(curve, "degenerate_doubling").codim2_cubic.item() == pytest.approx(0, abs=1e-9)


def test_beyond_a_degenerate_doubling_the_doubled_branch_leaves_to_the_other_side():
    system = parametric.with_values(quadratic=0.4, omega=2.2)
    found = sl.branches(system, {"depth": (0.0, 0.8)}, (0, 0), at=3, longest=1)
    (event,) = bifurcations(found, "period_doubling")
    curve = sl.bifurcation_curve(system, event, {"depth": (0.0, 0.8), "cubic": (-0.5, 0.5)})
    cubic = only(curve, "degenerate_doubling").codim2_cubic.item()
    sides = []
    for value in (cubic - 0.02, cubic + 0.02):
        both = sl.branches(
            system.with_values(cubic=value), {"depth": (0.0, 0.8)}, (0, 0), at=3, longest=2,
            points=12,
        )  # fmt: skip
        doubled = both.point_depth.values[both.point_branch.values == 1]
        sides.append(np.sign(doubled[5] - doubled[0]))
    assert sorted(sides) == [-1, 1]


# -- an independent solver -------------------------------------------------------------------------
def shot(x, v, omega, force, n, c):
    """End of n periods and its derivative by the start, by SciPy."""

    def rates(_, y):
        m = y[3:].reshape(2, 2)
        slope = np.array([[0, 1], [-1 - 3 * y[0] ** 2, -c]])
        pull = -c * y[1] - y[0] - y[0] ** 3 + force * np.cos(y[2])
        return [y[1], pull, omega, *(slope @ m).ravel()]

    start = [x, v, 0.0, 1.0, 0.0, 0.0, 1.0]
    end = solve_ivp(
        rates, (0, 2 * np.pi * n / omega), start, method="DOP853", rtol=1e-12, atol=1e-13
    ).y[:, -1]
    return end[:2], end[3:].reshape(2, 2)


def along_null(at, matrix, z, n, c, step=1e-4):
    """Derivative of det(M - 1) along the null vector of M - 1."""
    null = np.linalg.svd(matrix - np.eye(2))[2][-1]
    ends = [shot(*(z[:2] + s * null), *z[2:], n, c)[1] for s in (step, -step)]
    return (np.linalg.det(ends[0] - np.eye(2)) - np.linalg.det(ends[1] - np.eye(2))) / (2 * step)


def across(at, matrix, z, n, c, step=1e-4):
    """w'dP/d omega, w the left null vector of M - 1."""
    null = np.linalg.svd((matrix - np.eye(2)).T)[2][-1]
    ends = [shot(*z[:2], z[2] + s, z[3], n, c)[0] for s in (step, -step)]
    return null @ (ends[0] - ends[1]) / (2 * step)


@pytest.mark.parametrize(
    ("kind", "values", "n", "last"),
    [
        ("cusp", {"c": 0.2, "force": 0.5}, 1, along_null),
        ("isola_birth", {"c": 0.2, "force": 12.0}, 3, across),
    ],
    ids=["cusp", "isola of three periods"],
)
@pytest.mark.slow
def test_a_point_of_codimension_two_by_scipy(kind, values, n, last):
    system, c = duffing.with_values(**values), values["c"]
    if n == 1:
        found = sl.branches(system, {"omega": (0.8, 3.0)}, (0, 0), at=2)
        bounds = {"omega": (0.8, 3.0), "force": (0.01, 1.0)}
    else:
        seed = system.with_values(omega=6.0)
        start = {"x": np.repeat(np.linspace(-4, 4, 8), 8), "v": np.tile(np.linspace(-6, 6, 8), 8)}
        found = sl.branches(seed, {"omega": (3.0, 9.0)}, sl.attractors(seed, start), longest=3)
        bounds = {"omega": (2.0, 9.0), "force": (0.01, 13.0)}
    curve = sl.bifurcation_curve(system, bifurcations(found, "fold", n)[0], bounds)
    points = curve.isel(codim2=curve.codim2_kind.values == kind)
    points = points.isel(codim2=points.codim2_extremum.values != "omega")
    point = points.isel(codim2=0)
    z = np.array([
        point.codim2_x.values[0], point.codim2_v.values[0], point.codim2_omega.item(),
        point.codim2_force.item(),
    ])  # fmt: skip

    def defining(z):
        end, matrix = shot(*z, n, c)
        return [*(end - z[:2]), np.linalg.det(matrix - np.eye(2)), last(end, matrix, z, n, c)]

    other = root(defining, z * (1 + 1e-5), tol=1e-11)
    np.testing.assert_allclose(z, other.x, rtol=2e-7, atol=2e-7)


# -- the verb --------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def folded():
    return sl.branches(duffing, {"omega": (0.8, 3.0)}, (0, 0), at=2)


def test_each_point_of_a_curve_is_a_fold(folded):
    both = {"omega": (0.8, 3.0), "force": (0.1, 1.0)}
    curve = sl.bifurcation_curve(duffing, folded.sel(event=0), both)
    critical = np.abs(curve.point_multiplier_real.values - 1).min(axis=1)
    np.testing.assert_allclose(critical, 0, atol=1e-9)
    other = sl.bifurcation_curve(duffing, folded.sel(event=1), both)
    assert other.codim2_omega.values == pytest.approx(curve.codim2_omega.values, abs=1e-9)
    text = sl.describe(curve)
    assert "fold of T" in text
    assert "cusp at omega 1.187299858" in text


def test_what_cannot_be_followed_is_said_in_a_sentence(folded):
    event, both = folded.sel(event=0), {"omega": (0.8, 3.0), "force": (0.1, 1.0)}
    wrong = {
        "two parameters": (event, {"omega": (0.8, 3.0)}),
        r"Choose one: branches.sel\(event=0\)": (folded, both),
        "what sl.branches returned": (xr.Dataset(), both),
        "no parameter 'forc'": (event, {"omega": (0.8, 3.0), "forc": (0.1, 1.0)}),
        "outside the range": (event, {"omega": (0.8, 3.0), "force": (0.6, 1.0)}),
        "must ascend": (event, {"omega": (3.0, 0.8), "force": (0.1, 1.0)}),
    }
    for message, (one, vary) in wrong.items():
        with pytest.raises(ParameterError, match=message):
            sl.bifurcation_curve(duffing, one, vary)
    with pytest.raises(ParameterError, match="equations are others"):
        sl.bifurcation_curve(linear, event, {"omega": (1, 2), "a": (0, 1)})
