"""Results of several jobs as one: every bit is that of a single call, and strangers are refused."""

from __future__ import annotations

import pytest

import saltus as sl
from saltus.errors import ParameterError

RIG = sl.models.delangre("b", force="4 N", frequency="17 Hz")
STARTS = [0.0, 1e-3, 2e-3, 4e-3, 5e-3]


def moved(first=0, last=5, system=RIG, **more):
    start = {"x": STARTS[first:last], "v": 0.0}
    return sl.simulate(system, start, **({"periods": 4, "progress": False} | more))


def test_parts_are_the_whole(tmp_path):
    """Datasets and files; the last one has a trajectory."""
    whole = moved()
    file = sl.save(moved(2, 4), tmp_path / "second.nc")
    joined = sl.join(moved(0, 2), file, moved(4, 5))
    assert joined.identical(whole)
    assert joined.attrs["result_hash"] == whole.attrs["result_hash"]
    assert len(set(joined["contact_trajectory"].values)) == 5


def test_derivatives_with_values_of_their_own():
    to, values = ["contact_stiffness"], [16.0, 17.0, 18.0, 19.0]

    def asked(some):
        return sl.sensitivity(
            RIG, {"x": 1e-3, "v": 0.0}, to=to, periods=2, values={"frequency": some}, progress=False
        )

    assert sl.join(asked(values[:2]), asked(values[2:])).identical(asked(values))


@pytest.mark.parametrize(
    ("other", "told"),
    [
        (lambda: moved(system=RIG.with_values(force=5.0)), "result 2 .* force is 5.0, not 4.0"),
        (lambda: moved(periods=5), "has other"),
        (lambda: moved(samples=50), "has other"),
        (lambda: sl.simulate(RIG, (0.0, 0.0), periods=4), "result 2 is a single trajectory"),
        (lambda: sl.stroboscope(RIG, (0.0, 0.0), periods=4), "parts know of each other"),
        (lambda: 7, "results"),
    ],
)
def test_strangers_are_refused(other, told):
    with pytest.raises(ParameterError, match=told):
        sl.join(moved(), other())


def test_nothing_to_join():
    with pytest.raises(ParameterError, match="nothing to join"):
        sl.join()
