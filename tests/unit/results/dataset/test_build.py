"""Arrays of many states in a Dataset."""

import numpy as np
import pytest

from saltus.results.dataset.build import last_axis_first


@pytest.mark.parametrize("shape", [(7, 3), (2, 5000, 3), (1, 41, 20), (2, 5000, 20), (9,), (0, 20)])
def test_numbers_of_a_state_stand_together(shape):
    """Of few states and of more than a line of the cache holds, along any number of axes."""
    values = np.random.default_rng(7).normal(size=shape)
    found = last_axis_first(values)
    np.testing.assert_array_equal(found, np.moveaxis(values, -1, 0))
    if shape[-1] > 8:
        assert all(one.flags.c_contiguous for one in found)
