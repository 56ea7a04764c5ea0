"""Impact statistics: which side is contact, how contacts are paired and blocks are cut, what a
standard error is worth.
"""

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.motion.impacts import _error_of_row, contact_sides
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
    assert _pairs(rows, enters).tolist() == [[5, 8], [9, 12]]
    assert _pairs(rows[:4], enters[:4]).tolist() == [[5, 8], [9, -1]]
    assert _pairs(rows[:1], enters[:1]).shape == (0, 2)


def test_time_in_contact_is_cut_at_the_borders_of_blocks():
    time, enters = np.array([1.0, 2.0, 2.5, 4.5]), np.array([False, True, False, True])
    spells = _spells(time, enters, True, 0.0, 5.0)
    assert spells.tolist() == [[0.0, 1.0], [2.0, 2.5], [4.5, 5.0]]
    none = np.zeros(0)
    found = Touchdowns(none, none, none, none, none, none, None, {(0, 0): spells})
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

    with pytest.raises(ParameterError, match="has no guard"):
        sl.impact_statistics(free, (0.0, 0.0), t_end=1.0)
