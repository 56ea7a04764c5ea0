"""Words that texts on results share."""

import xarray as xr

from saltus.errors import counted
from saltus.results.wording import ended_early, kind_texts, tally
from saltus.units import titled


def test_things_are_counted_in_words():
    assert [counted(n, "trajectory") for n in (0, 1, 2)] == [
        "0 trajectories", "1 trajectory", "2 trajectories",
    ]  # fmt: skip
    assert (counted(3, "branch"), counted(2, "result file")) == ("3 branches", "2 result files")


def test_plain_numbers_have_no_unit_above_them():
    assert [titled("x", unit) for unit in ("m", "1", "")] == ["x [m]", "x", "x"]


def test_motions_have_a_word_each():
    ds = xr.Dataset(
        {
            "attractor_type": ("attractor", ["periodic", "noisy_periodic", "quasi_periodic"]),
            "attractor_period": ("attractor", [3, 24, 0]),
        }
    )
    assert kind_texts(ds, "attractor_") == ["3T", "noisy 24T", "quasi-periodic"]


def test_words_are_told_by_how_often_they_stand_there():
    assert tally(["ok", "escaped", "ok"]) == {"escaped": 1, "ok": 2}
    assert ended_early(xr.Dataset({"status": ((), "ok")})) == {}
    assert ended_early(xr.Dataset({"status": ("trajectory", ["ok", "sliding"])})) == {"sliding": 1}
