"""The quasi-random points that scouts start from."""

import numpy as np
import pytest
from scipy.stats import qmc

from saltus.analysis.inputs.halton import halton


@pytest.mark.parametrize(("count", "dimensions"), [(1, 1), (1024, 2), (777, 30), (20_000, 3)])
def test_they_are_those_of_scipy_to_the_bit(count, dimensions):
    np.testing.assert_array_equal(
        halton(count, dimensions), qmc.Halton(dimensions, scramble=False).random(count)
    )


def test_every_cell_of_a_grid_of_their_bases_has_its_share():
    """Of the first 4*9 points each cell of a 4 x 9 grid holds one: what makes them evener than
    chance.
    """
    x, y = (halton(36, 2) * (4, 9) + 1e-9).astype(int).T  # many lie on the edge of a cell
    assert len(set(zip(x, y, strict=True))) == 36
