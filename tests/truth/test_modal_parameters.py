"""Derivatives of motions by parameters that the modal flow carries: matrix exponentials, and
differences of the flow.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm, expm_frechet

import saltus as sl
from saltus.analysis.branches.parametric_map import parametric_map
from saltus.flow import engine, modal
from saltus.flow.maps import Stroboscope
from saltus.system.parametric import parametric


def by_differences(map_, start, name, step):
    """The derivative of the ends, float64[D], by central differences of fourth order."""
    rows = np.repeat(map_.parameters, 4, axis=0)
    rows[:, list(map_.system.values).index(name)] += step * np.array([-2.0, -1.0, 1.0, 2.0])
    none = np.zeros(4, int)
    ends, _ = map_.with_parameters(rows, none).ends(np.repeat(start, 4, axis=0), 1)
    return np.array([1.0, -8.0, 8.0, -1.0]) @ ends / (12 * step)


def test_derivatives_do_not_depend_on_pauses(monkeypatch):
    """A run is paused to hear Ctrl-C, and where a contact state has to be made first."""
    chain, start, found = sl.models.chain(), ("2 mm", 0, 0, 0), []
    for slow in (False, True):
        if slow:
            monkeypatch.setattr(engine, "SLICE", 1)
            monkeypatch.setattr(modal, "MOST_AT_ONCE", 1)
        asked = {"to": ["ground_gap", "frequency"], "periods": 4, "method": sl.Modal()}
        found.append(sl.sensitivity(chain, start, **asked, extremes=False))
    assert found[0].sizes["contact"] > 0
    assert found[0].identical(found[1])


@pytest.mark.nojit
@pytest.mark.parametrize("apart", [1e-9, 1e-3, 0.3])
def test_derivatives_are_those_of_a_matrix_exponential(apart):
    """Of a linear system with two modes that nearly coincide, and one that is overdamped. With the
    drives as states the motion is e^(M T): its derivative along dM/dp is a Frechet derivative.
    """

    @sl.system(states="x y z v u", forced_at="w", units={"w": "rad/s"})
    def plain(t, x, y, z, v, u, *, w=1.7, k=4.0, c=0.3, push=0.6, dead=0.2, gap=1e3):
        far = sl.where(x > gap, 100.0 * (x - gap), 0.0)
        rate = -k * x - c * v + push * sl.sin(w * t + 0.4) + dead + 0.2 * z - far
        return v, u, -3.0 * z + 0.1 * y, rate, -k * (1.0 + apart) * y - 0.3 * u + push * v

    def generator(w, k, c, push, dead):
        rows = np.zeros((8, 8))
        rows[0, 3] = rows[1, 4] = 1.0
        rows[2, [1, 2]] = 0.1, -3.0
        rows[3, [0, 2, 3, 5, 7]] = -k, 0.2, -c, dead, push
        rows[4, [1, 3, 4]] = -k * (1.0 + apart), push, -0.3
        rows[6, 7], rows[7, 6] = -w, w  # cosine and sine
        return rows

    values = {name: plain.values[name] for name in ("w", "k", "c", "push", "dead")}
    names, period = tuple(plain.values), 2 * np.pi / values["w"]
    names = tuple(name for name in names if name in values)
    start = np.array([[0.3, -0.2, 0.5, 0.1, 0.4]])
    given = np.append(start[0], [1.0, np.cos(0.4), np.sin(0.4)])
    ends, found = Stroboscope(plain, sl.Modal()).tangent_by(start, 2, names)
    time, matrix = 2 * period, generator(**values)
    np.testing.assert_allclose(ends[0], (expm(matrix * time) @ given)[:5], atol=1e-12)
    for j, name in enumerate(names):
        along = generator(**{**values, name: values[name] + 1.0}) - matrix
        expected = expm_frechet(matrix * time, along * time, compute_expm=False) @ given
        np.testing.assert_allclose(
            found[0, :, 5 + j], expected[:5], atol=1e-11 * np.abs(expected).max(), err_msg=name
        )


@pytest.mark.parametrize(
    ("name", "sway"),
    [
        pytest.param("w", 0.0, marks=pytest.mark.nojit),
        pytest.param("lag", 0.02, marks=pytest.mark.nojit),
        ("k", 0.02),
        ("push", 0.02),
    ],
)
def test_derivatives_through_impacts_and_rest(name, sway):
    """At a stop that may move with the drive: the instants of impacts, and what they change, do."""

    @sl.system(states="x y v u", forced_at="w", units={"w": "rad/s"})
    def pair(t, x, y, v, u, *, w=0.6, gap=0.2, k=4.0, push=1.5, lag=0.2):
        force = push * sl.cos(w * t + lag) + 0.5 * (y - x)
        wall, speed = sway * sl.sin(w * t + lag), sway * w * sl.cos(w * t + lag)
        law = sl.impact(x < gap + wall, v - speed, restitution=0.3)
        return v, u, force - x - 0.1 * v, 0.5 * (x - y) - k * y, law

    start = np.array([[0.0, 0.1, 0.3, -0.2]])
    run = sl.simulate(pair, start[0], periods=1, method=sl.Modal(), progress=False)
    assert {"impact", "hold", "release"} <= set(run.contact_kind.values.tolist())
    map_ = Stroboscope(pair, sl.Modal())
    _, found = map_.tangent_by(start, 1, (name,))
    expected = by_differences(map_, start, name, 1e-4)
    np.testing.assert_allclose(found[0, :, -1], expected, atol=1e-8 * np.abs(expected).max())


def test_modes_that_go_together_leave_it_to_differences():
    """A drive at resonance. The derivative of the state is carried all the same."""

    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def driven(t, x, v, *, w=1.0, gap=0.4):
        return v, 0.3 * sl.cos(w * t) - x - sl.where(x > gap, 4.0 * (x - gap), 0.0)

    start = np.array([[0.3, 0.5]])
    map_ = Stroboscope(driven, sl.Modal())
    ends, found = map_.tangent_by(start, 1, ("w",))
    assert np.isnan(found[0, :, 2]).all()
    np.testing.assert_allclose(found[..., :2], map_.tangent(start, 1)[1], atol=1e-14)
    whole = parametric_map(driven, parametric(driven, ("w",)), sl.Modal())
    states = np.append(start, [[2 * np.pi]], axis=1)
    _, slopes = whole.tangent(states, 1)
    by_period = by_differences(map_, start, "w", 1e-4) * -1.0 / (2 * np.pi)
    rate = np.array([ends[0, 1], 0.3 - ends[0, 0] - 4.0 * max(ends[0, 0] - 0.4, 0.0)])
    np.testing.assert_allclose(slopes[0, :2, 2], rate + by_period, atol=1e-8)


def test_a_restitution_is_left_to_differences():
    @sl.system(states="x v", forced_at="w", units={"w": "rad/s"})
    def stop(t, x, v, *, w=2.0, gap=0.2, e=0.7):
        return v, sl.cos(w * t) - x, sl.impact(x < gap, v, restitution=e)

    map_ = Stroboscope(stop, sl.Modal())
    assert map_.tangent_by(np.zeros((1, 2)), 1, ("e",)) is None
    assert map_.tangent_by(np.zeros((1, 2)), 1, ("w",)) is not None
