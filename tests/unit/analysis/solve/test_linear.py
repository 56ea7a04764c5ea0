"""How zeros of equations move with parameters."""

import numpy as np

from saltus.analysis.solve.linear import moves


def test_a_point_of_a_circle_and_a_line_moves_as_its_formula_says():
    # x^2 + y^2 = r^2 and y = s x: x = r / sqrt(1 + s^2)
    r, s = np.array([1.0, 2.0, 3.0]), np.array([0.5, -1.0, 2.0])
    root = np.sqrt(1.0 + s * s)
    x, y = r / root, r * s / root
    by_unknowns = np.array([[2 * x, 2 * y], [-s, np.ones(3)]]).transpose(2, 0, 1)
    by_parameters = np.array([[-2 * r, 0 * r], [0 * r, -x]]).transpose(2, 0, 1)
    moved = moves(by_unknowns, by_parameters)
    expected = [[1 / root, -r * s / root**3], [s / root, r / root**3]]
    np.testing.assert_allclose(moved, np.transpose(expected, (2, 0, 1)), rtol=1e-14)


def test_where_there_is_no_move_the_others_have_theirs():
    by_unknowns = np.array([[[0.0]], [[2.0]], [[np.inf]], [[4.0]]])
    by_parameters = np.array([[[1.0]], [[1.0]], [[1.0]], [[np.nan]]])
    np.testing.assert_array_equal(
        moves(by_unknowns, by_parameters)[:, 0, 0], [np.nan, -0.5, np.nan, np.nan]
    )
