"""One orbit has one set of numbers, whichever verb was asked for it."""

import numpy as np
import pytest

import saltus as sl

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")
START = {"x": 1e-3, "v": 0.0}


@pytest.fixture(scope="module")
def answers(few_scouts):
    found = sl.attractors(RIG, START)
    cells = sl.basins(RIG, x=[1e-3, 1.1e-3], v=[0.0, 0.01])
    response = sl.frequency_response(RIG, [15.0], start=START)
    diagram = sl.bifurcation_diagram(RIG, {"force": [4.0]}, start=START)
    methods = sl.compare_methods(
        RIG, "frequency_response", [sl.Taylor(order=9)], frequency=[15.0], start=START
    )
    return found, cells.isel(attractor=int(cells.basin[0, 0])), response, diagram, methods


def numbers(ds, name):
    return np.ravel(
        ds[f"attractor_{name}" if f"attractor_{name}" in ds else f"response_{name}"].values
    )


@pytest.mark.parametrize(
    "name", ["peak", "rms", "margin", "period", "exponent", "multiplier_real", "multiplier_imag"]
)
def test_every_verb_tells_the_same_numbers(answers, name):
    found, cells, response, diagram, _ = answers
    for other in (cells, response, diagram):
        np.testing.assert_allclose(
            numbers(other, name), numbers(found, name), rtol=1e-9, atol=1e-11
        )


def test_peaks_agree_to_rounding(answers):
    found, cells, response, diagram, methods = answers
    for other in (
        *numbers(cells, "peak"),
        *numbers(response, "peak"),
        *numbers(diagram, "peak"),
        *np.ravel(methods.peak.values),
    ):
        assert other == pytest.approx(numbers(found, "peak")[0], rel=1e-13)


def test_the_exponents_of_a_motion_are_those_of_its_orbit(answers):
    found = answers[0]
    exponents = sl.lyapunov(RIG, START, periods=64, transient=600)
    assert exponents.kind.item() == "periodic"
    assert exponents.response_period.item() == found.attractor_period.item()
    assert exponents.lyapunov_exponent.values[0, 0] == pytest.approx(
        found.attractor_exponent.item(), rel=1e-9
    )
