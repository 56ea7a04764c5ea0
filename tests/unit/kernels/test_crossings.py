"""What a step's bounds prove of a gap, against all roots of the gap itself: with the terms to the
seventh, in all lanes at once.
"""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest

from conformance.systems import pair
from saltus.codegen import module
from saltus.codegen.interface import TAYLOR
from saltus.codegen.taylor_head import taylor_head

pytestmark = pytest.mark.nojit
LANES = 512
GRID = np.linspace(0.0, 1.0, 1001)


@cache
def templates(order):
    """The Taylor templates as plain Python, with many lanes."""
    return module._interpreted(TAYLOR, taylor_head(pair, order, LANES))


def proven(terms, order, fresh):
    """What is proven of gaps with the given terms float64[order + 1, LANES] over a step of 0.7:
    clear, once, twice, a bound from below.
    """
    flow, h, guard = templates(order), 0.7, 0
    lanes = SimpleNamespace(
        work=np.zeros((flow.ROWS, LANES)),
        fresh=np.full((flow.NGUARDS, LANES), float(fresh)),
        side=np.ones((flow.NGUARDS, LANES)),
    )
    for k in range(1, order + 1):
        lanes.work[flow.GUARD_ROW[guard] + k] = terms[k] / (flow.GUARD_SIGN[guard] * h**k)
    p = terms[1:5] if fresh else terms[:4]
    noise = 1e-15 * np.abs(terms).sum(axis=0)
    with np.errstate(all="ignore"):
        return flow.with_more_terms(
            lanes, guard, np.full(LANES, h), *p, -p[1] / (2 * p[2]), terms.sum(axis=0), noise
        )


@pytest.mark.parametrize("fresh", [False, True])
@pytest.mark.parametrize("order", [6, 7, 20])
@pytest.mark.parametrize("decay", [0.3, 0.6])
def test_what_is_proven_with_more_terms_holds(order, fresh, decay):
    """Random gaps whose terms fall by 0.3 or 0.6 each: nothing is said that isn't so; with 0.3 next
    to nothing is left open.
    """
    rng = np.random.default_rng(order)
    terms = rng.normal(size=(order + 1, LANES)) * decay ** np.arange(order + 1)[:, None]
    first = 1 if fresh else 0
    # near enough to the boundary to meet it, and bent enough to come back
    terms[first] = 0.1 * np.abs(terms[first])
    terms[first + 2] = 5.0 * np.abs(terms[first + 2])
    terms[:first] = 0.0
    clear, once, twice, least = proven(terms, order, fresh)
    values = np.polynomial.polynomial.polyval(GRID, terms[first:])  # float64[LANES, places]
    changes = (np.diff(np.sign(values), axis=1) != 0).sum(axis=1)
    assert (changes[clear] == 0).all()
    assert (changes[once] == 1).all()
    # two crossings may lie within one place of the grid
    assert np.isin(changes[twice], (0, 2)).all()
    assert (least <= values.min(axis=1)).all()
    assert not (clear & (once | twice)).any()
    if decay < 0.5:
        assert (clear | once | twice).mean() > 0.99
        assert min(clear.sum(), once.sum(), twice.sum()) > 8


def test_a_rest_that_is_left_out_would_prove_what_is_not_so():
    """The gap 1 - 1.5 x^8 crosses, though its terms to the seventh say that it is clear."""
    terms = np.zeros((21, LANES))
    terms[0], terms[8] = 1.0, -1.5
    clear, once, twice, least = proven(terms, 20, False)
    assert not (clear | once | twice).any()
    assert (least < -0.5).all()
