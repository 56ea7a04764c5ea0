"""Impact statistics: which side is contact, how contacts are paired and blocks are cut, what a
standard error is worth.
"""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.motion.impact_statistics import _error_of_row, contact_sides
from saltus.analysis.motion.touchdowns import Touchdowns, _pairs, _spells
from saltus.errors import ParameterError


@pytest.mark.parametrize(
    ("system", "sides"),
    [
        (sl.models.delangre("a"), [-1, 1]),
        (sl.models.delangre("b"), [-1, 1]),  # the lower gap is zero
        (sl.models.delangre("a", lower_gap=0, upper_gap=0), [-1, 1]),
        (sl.models.chain(), [-1, 1, -1, 1]),
        (sl.models.gear_pair(), [-1, 1]),
    ],
)
def test_contact_is_where_rest_is_not(system, sides):
    found = dict(
        zip(
            (guard.name for guard in system.guards), contact_sides(system, {}).tolist(), strict=True
        )
    )
    assert all(
        side == (-1 if " = -" in name or "lower" in name else 1) for name, side in found.items()
    )
    assert sorted(found.values()) == sorted(sides)
    assert contact_sides(system, {0: 1})[0] == 1


def test_entries_are_paired_with_the_exit_that_follows():
    rows, enters = np.array([3, 5, 8, 9, 12]), np.array([False, True, False, True, False])
    assert _pairs(rows, enters)[:, :2].tolist() == [[5, 8], [9, 12]]
    assert _pairs(rows[:4], enters[:4])[:, :2].tolist() == [[5, 8], [9, -1]]
    assert _pairs(rows[:1], enters[:1]).shape == (0, 4)


def test_time_in_contact_is_cut_at_the_borders_of_blocks():
    time, enters = np.array([1.0, 2.0, 2.5, 4.5]), np.array([False, True, False, True])
    spells = _spells(time, enters, True, 0.0, 5.0)
    assert spells.tolist() == [[0.0, 1.0], [2.0, 2.5], [4.5, 5.0]]
    none = np.zeros(0)
    found = Touchdowns(none, none, none, none, none, none, None, None, none, {(0, 0): spells})
    assert found.covered(0, 0, np.array([0.0, 0.5, 2.25, 4.75, 5.0])) == pytest.approx(
        [0.5, 0.75, 0.5, 0.25]
    )


def test_the_standard_error_of_values_that_depend_on_each_other():
    """An autoregressive row, coefficient 0.8: the error of its mean is sqrt((1 + 0.8) / (1 - 0.8))
    = 3 times that of independent values.
    """
    random = np.random.default_rng(8)
    noise = random.normal(size=(400, 4000))
    row = np.zeros_like(noise)
    for k in range(1, noise.shape[1]):
        row[:, k] = 0.8 * row[:, k - 1] + noise[:, k]
    claimed = np.sqrt(np.mean([_error_of_row(one) ** 2 for one in row]))
    # 400 rows know it to 3.5 %, 20 blocks of 200 to some more
    assert claimed == pytest.approx(row.mean(axis=1).std(ddof=1), rel=0.12)
    assert claimed > 2.5 * row.std() / np.sqrt(row.shape[1])


def test_too_few_values_have_no_error():
    assert np.isnan(_error_of_row(np.arange(3.0)))
    assert _error_of_row(np.ones(40)) == 0.0


def test_a_system_without_guards_is_refused():
    @sl.system(states="x v")
    def free(t, x, v):
        return v, -x

    with pytest.raises(ParameterError, match="has no boundary"):
        sl.impact_statistics(free, (0.0, 0.0), t_end=1.0)


@sl.system(states="x v")
def pressed(t, x, v, *, push=0.5, restitution=0.7):
    """A mass on a spring that a constant force presses against a stop."""
    return v, -x - push, sl.impact(x > 0, -v, restitution=restitution)


def test_a_chatter_is_one_contact_with_its_impulse_in_closed_form():
    """Closing speeds are e**n, so the impulse of all impacts is (1 + e)/(1 - e); they end at the
    sum of 2 atan(e**n/f), the first at 2 atan(1/f). Two impacts lie before the window of the second
    call.
    """
    found = sl.impact_statistics(pressed, (0.0, 1.0), t_end=12.0)
    stop, rest = (found.isel(contact=i) for i in (0, 1))
    assert found["contacts"].values.tolist() == [1, 1]
    assert stop["contact_guard"].item() == "x = 0"
    assert stop["contact_time"].item() == pytest.approx(2 * np.arctan(2.0), rel=1e-14)
    assert stop["contact_speed"].item() == pytest.approx(1.0, rel=1e-14)
    assert stop["contact_impacts"].item() > 20
    assert stop["contact_impulse_of_impacts"].item() == pytest.approx(1.7 / 0.3, rel=1e-12)
    assert np.isnan(stop["contact_impulse"].item())  # it rests for ever
    zeno = 2 * np.arctan(0.7 ** np.arange(400) / 0.5).sum()
    assert rest["contact_time"].item() == pytest.approx(zeno, rel=1e-12)
    later = sl.impact_statistics(pressed, (0.0, 1.0), t_end=12.0, transient=4.5)
    assert later["contact_impulse_of_impacts"][0].item() == pytest.approx(
        0.7**2 * 1.7 / 0.3, rel=1e-12
    )


def test_the_impulse_of_a_contact_that_rests_and_is_left_again():
    """A driven mass that chatters to rest once a period (C01 to C06 of laws_impact.csv): the force
    at rest is integrated in closed form between the end of the chatter and the release.
    """
    driven = sl.models.impact_oscillator("chatter")
    w, gap = driven.values["frequency"] * 2 * np.pi, driven.values["gap"]
    w = driven.values["frequency"] if driven.units["frequency"] == "rad/s" else w
    start = (gap, 0.0)
    found = sl.impact_statistics(driven, start, periods=2, transient=1)
    run = sl.simulate(driven, start, periods=3, keep=3)
    stop, rest = found.isel(contact=0), found.isel(contact=1)
    begin = rest["contact_time"].item()
    end = begin + rest["contact_duration"].item()
    held = (np.sin(w * end) - np.sin(w * begin)) / w - gap * (end - begin)
    assert rest["contact_impulse"].item() == pytest.approx(held, rel=1e-11)
    mine = (run["contact_time"] >= stop["contact_time"] - 1e-9) & (run["contact_time"] < begin)
    speeds = np.abs(run["contact_velocity"].values[mine.values & (run["contact_kind"] == "impact")])
    assert len(speeds) == stop["contact_impacts"].item()
    assert speeds[0] == pytest.approx(0.46824636412950312, rel=1e-10)
    struck = stop["contact_impulse_of_impacts"].item()
    assert struck == pytest.approx(1.6 * speeds.sum() + 1.6 * 0.6 * speeds[-1] / 0.4, rel=1e-9)
    assert stop["contact_impulse"].item() == pytest.approx(struck + held, rel=1e-11)
    assert found["contact_impulse"].attrs["units"] == driven.units["v"]


def test_two_masses_share_the_impulse_by_their_inertias():
    """Masses of 1 kg and 3 kg that meet with 2 m/s: 1.5 kg of them times 1.8 times that."""

    @sl.system(states="x1 x2 v1 v2", units={"v1": "m/s", "v2": "m/s", "x1": "m", "x2": "m"})
    def meet(t, x1, x2, v1, v2, *, first=1.0, second=3.0):
        law = sl.impact(x1 < x2, v1 - v2, restitution=0.8, inertia=(first, second))
        return v1, v2, 0.0, 0.0, law

    found = sl.impact_statistics(meet, (0.0, 1.0, 1.5, -0.5), t_end=1.0)
    assert found["contact_impulse"].values == pytest.approx([0.75 * 1.8 * 2.0], rel=1e-14)
    assert found["contact_impulse"].attrs["units"] == "N*s"
    assert found["contact_impacts"].values.tolist() == [1]
