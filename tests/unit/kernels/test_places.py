"""Where a gap of modes crosses: the polynomial by which the search begins."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.polynomial import Polynomial

from saltus.codegen import module
from saltus.codegen.head import Head
from saltus.codegen.interface import MODAL, MODE_LANES

pytestmark = pytest.mark.nojit


@pytest.fixture(scope="module")
def flow():
    """The modal templates as plain Python."""
    return module._interpreted(MODAL, Head({"LANES": MODE_LANES}, ""))


@pytest.mark.parametrize("x", [0.0, 0.3, 1.0, -0.7])
def test_a_polynomial_in_lanes_has_its_value_and_slope(flow, x):
    terms = np.random.default_rng(5).normal(size=flow.ORDER + 1)
    sums = np.zeros((flow.ORDER + 4 + flow.HALF, MODE_LANES))
    sums.flat[: len(terms)] = terms
    value, slope = flow.value_and_slope(x, SimpleNamespace(sums=sums))
    exact = Polynomial(terms)
    assert value == pytest.approx(exact(x), abs=1e-14 * np.abs(terms).sum())
    assert slope == pytest.approx(exact.deriv()(x), abs=1e-13 * np.abs(terms).sum())
