"""`sl.poincare` without a start: from rest, as every verb on motions."""

import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError

CHAIN = sl.structure(
    np.eye(2), 1e4 * np.array([[2.0, -1.0], [-1.0, 2.0]]), modes=2, damping_ratio="2 %",
    frequency="13 Hz", sensors={"tip": "x2"}, forces=[sl.Force("x1", "9 N")],
    contacts=[sl.Contact("x2", stiffness="100 kN/m", gap="1 mm")],
)  # fmt: skip


def test_it_starts_from_rest():
    asked = {"surface": "tip turns", "periods": 5, "progress": False}
    told = sl.poincare(CHAIN, start=np.zeros(4), **asked)
    assert told.sizes["crossing"] >= 10
    assert np.array_equal(sl.poincare(CHAIN, **asked)["crossing_time"], told["crossing_time"])


def test_the_surface_is_asked_for():
    with pytest.raises(ParameterError, match=r"needs a surface, such as surface=.tip turns"):
        sl.poincare(CHAIN, periods=5)
