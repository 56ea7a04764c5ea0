"""Fits: closed forms of linear regression, differences, valleys of long histories, and what data
can't decide.
"""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.fits.measurement import measurement
from saltus.analysis.fits.motion import Motions
from saltus.analysis.fits.unknowns import Unknowns
from saltus.flow.methods import check_method


@sl.system(states="x")
def ramp(t, x, *, slope=1.0):
    return slope


@sl.system(states="x v", forced_at="f")
def stopped(t, x, v, *, f=1.0, pull=1.0, k=40.0, more=0.0, d=0.4, gap=0.02, stop=300.0):
    contact = sl.where(x > gap, stop * (x - gap), 0)
    return v, pull * sl.cos(2 * sl.pi * f * t) - (k + more) * x - d * v - contact


def test_a_line_is_fitted_as_linear_regression_does():
    random = np.random.default_rng(5)
    t = np.sort(random.uniform(0.1, 3.0, 40))
    x = 0.7 + 1.3 * t + 0.05 * random.standard_normal(40)
    found = sl.fit(ramp, {"t": t, "x": x}, {"slope": (-5, 5), "x(0)": (-5, 5)}, starts=4)
    columns = np.stack([t, np.ones(40)], axis=1)
    (slope, begin), squares, *_ = np.linalg.lstsq(columns, x)
    covariance = np.linalg.inv(columns.T @ columns) * squares[0] / 38
    errors = np.sqrt(np.diag(covariance))
    assert found.value.values == pytest.approx([slope, begin], rel=1e-8)
    assert found.standard_error.values == pytest.approx(errors, rel=1e-8)
    assert found.correlation.values[0, 1] == pytest.approx(
        covariance[0, 1] / errors.prod(), rel=1e-7
    )
    assert found.noise.item() == pytest.approx(np.sqrt(squares[0] / 38), rel=1e-8)
    assert found.identifiable.values.all()
    # of noise that is known the errors don't follow the residuals
    known = sl.fit(ramp, {"t": t, "x": x}, {"slope": (-5, 5), "x(0)": (-5, 5)}, starts=4, noise=0.1)
    assert known.standard_error.values == pytest.approx(errors * 0.1 / found.noise.item(), rel=1e-8)
    assert known.misfit.item() == pytest.approx(np.sqrt(squares[0] / 40) / 0.1, rel=1e-8)


def test_derivatives_of_what_was_measured_are_the_limits_of_differences():
    system = stopped.with_outputs(
        {"force": lambda t, x, stop, f: stop * x * sl.cos(2 * sl.pi * f * t)}
    )
    t = np.array([0.1, 0.33, 0.9, 1.7, 2.05])
    measured = measurement(system, {"t": t, "x": t**2, "force": np.sin(t)}, missing=False)
    names = ("gap", "stop", "x(0)", "t_start", "f")
    middle = np.array([0.02, 300.0, 0.01, 0.2, 1.0])
    free = {name: (0.5 * one, 2 * one) for name, one in zip(names, middle, strict=True)}
    model = Motions.of(
        system, check_method(None, system), measured, Unknowns.of(system, free), (0, 0), 0.0, 1
    )
    fitted, slopes = model.with_derivatives(middle)
    assert fitted == pytest.approx(model.plain(middle[None])[0], rel=1e-11)
    for column, one in enumerate(middle):
        step = 1e-5 * one
        moved = middle + step * np.eye(5)[column] * np.array([[-2], [-1], [1], [2]])
        expected = np.tensordot([1, -8, 8, -1], model.plain(moved), 1) / (12 * step)
        worst = np.abs(slopes[..., column] - expected).max() / np.abs(expected).max()
        assert worst < 1e-7, names[column]


def test_a_long_history_is_fitted_from_starts_in_none_of_whose_valleys_it_lies():
    # over 60 periods the misfit of a stiffness has a valley every per cent
    truth = stopped.with_values(k=61.0, d=0.01, pull=0.0, gap=1.0)
    t = np.linspace(0.02, 50.0, 900)
    run = sl.simulate(truth, (0.01, 0), at=t)
    x = run.x.values + 1e-4 * np.random.default_rng(6).standard_normal(900)
    found = sl.fit(
        truth.with_values(k=25.0), {"t": t, "x": x}, {"k": (10, 200)}, (0.01, 0), starts=4
    )
    assert abs(found.value.item() - 61.0) < 4 * found.standard_error.item()
    assert found.noise.item() == pytest.approx(1e-4, rel=0.1)
    assert found.standard_error.item() < 1e-2


def test_what_the_data_can_not_decide_is_said():
    t = np.linspace(0.05, 4.0, 80)
    run = sl.simulate(stopped.with_values(gap=1.0), at=t)
    x = run.x.values + 1e-4 * np.random.default_rng(7).standard_normal(80)
    free = {"k": (20, 60), "more": (0, 40), "gap": (0.5, 2.0)}
    found = sl.fit(stopped.with_values(gap=1.2), {"t": t, "x": x}, free, starts=4)
    assert found.identifiable.values.tolist() == [0, 0, 1]
    # nothing touches the stop; of the two stiffnesses the sum alone counts
    assert found.combination_share.values[2] == pytest.approx(
        [np.sqrt(0.5), np.sqrt(0.5), 0], abs=1e-6
    )
    assert np.isinf(found.standard_error.values).all()
    assert sum(found.value.values[:2]) == pytest.approx(40.0, rel=0.01)
    said = str(sl.describe(found))
    assert "They don't fix gap: within the bounds all is alike to them." in said
    assert said.count("which the data don't fix") == 3
    assert "changed together in these shares of their ranges" in said


def test_several_sensors_are_weighed_by_the_noise_of_each():
    random = np.random.default_rng(8)
    t = np.linspace(0.05, 4.0, 80)
    run = sl.simulate(stopped, at=t)
    x = run.x.values + 1e-5 * random.standard_normal(80)
    v = run.v.values + 1e-1 * random.standard_normal(80)
    free = {"gap": (0.005, 0.05), "stop": (100, 1000)}
    start = stopped.with_values(gap=0.03)
    both = sl.fit(start, {"t": t, "x": x, "v": v}, free, starts=4)
    alone = sl.fit(start, {"t": t, "x": x}, free, starts=4)
    assert both.noise.values == pytest.approx([1e-5, 1e-1], rel=0.25)
    assert both.value.values == pytest.approx(
        alone.value.values, abs=0.1 * alone.standard_error.values.max()
    )
    assert (np.abs(both.value.values - [0.02, 300]) < 4 * both.standard_error.values).all()
