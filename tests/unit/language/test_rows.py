"""Long sums of states as rows of a matrix."""

import math

import numpy as np

from saltus.language import expression as ex
from saltus.language.evaluate import evaluate
from saltus.language.rows import LONG, products, split_rows

NAMES = tuple(f"q{i}" for i in range(40))
Q = [ex.state(name) for name in NAMES]
NUMBERS = np.random.default_rng(3).normal(size=40)


def weighted(count):
    total = ex.constant(0.0)
    for number, one in zip(NUMBERS[:count], Q, strict=False):
        total = total - number * one / 2.0 if number < 0 else total + (-one) * number
    return total


def test_long_sums_become_rows_wherever_they_stand():
    """By themselves, in a product, in a condition's branch, within a longer one, and beside terms
    that are no numbers times states, in which they stand again; short ones stay as they are.
    """
    k, gap = ex.parameter("k"), ex.parameter("gap")
    long, longer, short = weighted(LONG + 4), weighted(40), weighted(LONG - 1)
    given = (
        long,
        k * (long - gap),
        ex.select(ex.Bit(0), k * long, 0.0),
        longer + 3.0 * long,
        short,
        longer * Q[0],
        Q[1] + gap,
        longer - 2.0 * (k * long * gap) + 0.5 * (Q[0] * Q[1] - longer / 4.0),
    )
    found, names, rows = split_rows(given, NAMES)
    assert names == ("sum 0", "sum 1", "sum 2", "sum 3")
    assert rows.shape == (4, 40)
    assert found[4] is short
    assert found[6] is given[6]
    states = np.random.default_rng(4).normal(size=(3, 70, 40))
    known = dict(zip(NAMES, np.moveaxis(states, -1, 0), strict=True))
    about = {"values": {"k": 2.5, "gap": 0.1}, "bits": [states[..., 5] > 0]}
    plain = evaluate(given, states=known, **about)
    known |= dict(zip(names, products(states, rows), strict=True))
    for one, other in zip(evaluate(found, states=known, **about), plain, strict=True):
        np.testing.assert_allclose(one, other, rtol=0, atol=1e-13)


def test_a_value_does_not_depend_on_the_points_beside_it():
    rows = np.random.default_rng(5).normal(size=(3, 40))
    states = np.random.default_rng(6).normal(size=(150, 40))
    states[7, 3] = math.nan
    whole = products(states, rows)
    assert whole.shape == (3, 150)
    assert np.isnan(whole[:, 7]).all()
    assert np.isfinite(np.delete(whole, 7, axis=1)).all()
    for some in (slice(0, 1), slice(0, 64), slice(64, 70), slice(128, 150)):
        np.testing.assert_array_equal(products(states[some], rows), whole[:, some])
    assert products(states[7], rows).shape == (3,)
    assert products(states[:0], rows).shape == (3, 0)
    assert products(states, rows[:0]).shape == (0, 150)
