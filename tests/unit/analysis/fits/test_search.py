"""Descents end where the linear terms tell all."""

import numpy as np
import pytest

from saltus.analysis.fits.search import MisfitSearch
from saltus.analysis.fits.unknowns import Unknowns


class Line:
    """Numbers that are linear in two unknowns."""

    least_step = 1e-8

    def __init__(self, rows):
        self.rows, self.flows = rows, 0

    def plain(self, values):
        return (values @ self.rows.T)[..., None]

    def with_derivatives(self, values):
        self.flows += 1
        return (self.rows @ values)[:, None], self.rows[:, None]


def test_a_descent_whose_step_leads_to_a_known_minimum_ends_there():
    random = np.random.default_rng(3)
    rows = random.standard_normal((30, 2))
    data = (rows @ [0.3, 0.6] + 0.01 * random.standard_normal(30))[:, None]
    ends = np.zeros(2), np.ones(2)
    unknowns = Unknowns(("a", "b"), ("1", "1"), *ends, np.zeros(2, bool))
    search = MisfitSearch(Line(rows), unknowns, data, np.ones((30, 1)), 100)
    search.descend(np.array([0.9, 0.1]), None)
    exact = np.linalg.lstsq(rows, data[:, 0])[0]
    assert search.minima[0].shares == pytest.approx(exact, abs=1e-6)
    first = search.model.flows
    for start in ([0.1, 0.1], [0.5, 0.95], [0.99, 0.99]):
        search.descend(np.array(start), None)
    assert search.model.flows == first + 3  # the start alone
    assert all(one is search.minima[0] for one in search.minima[1:])
