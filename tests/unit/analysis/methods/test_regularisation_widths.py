"""The width of equal errors, held against runs of its own and against the order of the law."""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError

RIG = sl.models.delangre("a", force="4 N", frequency="17 Hz")
START = ("0.75 mm", 0.0)
METHOD = sl.ODE45(rtol=1e-6, atol=1e-9)


@pytest.fixture(scope="module")
def table():
    return sl.regularisation_widths(RIG, "tanh", method=METHOD, start=START, points=3)


def test_errors_fall_with_the_square_of_the_width(table):
    small = table.sel(width=table.width < 1e-6)
    order = np.diff(np.log(small.regularisation_error)) / np.diff(np.log(small.width))
    assert np.abs(order - 2).max() < 0.02


def test_the_widths_error_is_the_methods_error(table):
    """Both are measured again, by simulate from the same points of the orbit of three periods."""
    narrow = sl.regularise(RIG, "tanh", width=table.equal_width.item())
    orbit = sl.stroboscope(RIG, START, periods=203)
    points = np.stack([orbit.x.values[0], orbit.v.values[0]], axis=1)[200:203]
    ranges = sl.simulate(RIG, points[0], periods=4)
    scale = np.array([np.ptp(ranges.x.values), np.ptp(ranges.v.values)])

    def error(system, method):
        ends, truth = (
            sl.simulate(one, points, periods=1, method=by)
            for one, by in ((system, method), (RIG, sl.Taylor()))
        )
        apart = np.stack([(ends[n] - truth[n]).values for n in ("end_x", "end_v")], axis=1) / scale
        return np.sqrt(np.mean(apart**2))

    assert error(RIG, METHOD) == pytest.approx(table.method_error.item(), rel=0.05)
    assert error(narrow, sl.Taylor()) == pytest.approx(table.method_error.item(), rel=0.1)


def test_out_of_the_widths_there_is_no_answer():
    wide = sl.regularisation_widths(RIG, method=METHOD, start=START, widths="0.1 mm", points=2)
    assert np.isnan(wide.equal_width)
    assert np.isnan(wide.equal_steps_per_period)
    assert wide.width.attrs["units"] == "m"
    assert wide.width.values == [1e-4]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"law": "tan"}, "tanh"),
        ({"widths": [-1.0]}, "positive"),
        ({"points": 0}, "points"),
        ({"start": {"x": [0.0, 1.0], "v": 0.0}}, "one start"),
    ],
)
def test_refusals(arguments, words):
    with pytest.raises(ParameterError, match=words):
        sl.regularisation_widths(RIG, **arguments)
