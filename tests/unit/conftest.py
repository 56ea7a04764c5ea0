"""Random expressions for property tests."""

import pytest
from hypothesis import strategies as st

from saltus.language import expression as ex

NAMES = {"state": ("x", "v"), "param": ("p", "q")}


@pytest.fixture(scope="session")
def expressions():
    """A strategy of smooth expressions in x, v, t, p, q that are defined for all real arguments,
    except for overflow.
    """
    leaves = st.one_of(
        st.sampled_from(
            [ex.state("x"), ex.state("v"), ex.parameter("p"), ex.parameter("q"), ex.TIME]
        ),
        st.integers(-3, 3).map(ex.constant),
        st.floats(-2, 2).map(ex.constant),
    )
    return st.recursive(leaves, _larger, max_leaves=12)


def _larger(inner):
    pairs = st.tuples(inner, inner)
    return st.one_of(
        pairs.map(lambda pair: pair[0] + pair[1]),
        pairs.map(lambda pair: pair[0] - pair[1]),
        pairs.map(lambda pair: pair[0] * pair[1]),
        pairs.map(lambda pair: pair[0] / (1.5 + ex.elementary("sin", pair[1]))),
        inner.map(lambda a: -a),
        inner.map(lambda a: a**2),
        inner.map(lambda a: a**3),
        inner.map(lambda a: (1 + a**2) ** ex.parameter("q")),
        inner.map(lambda a: ex.elementary("sqrt", 1 + a**2)),
        inner.map(lambda a: ex.elementary("log", 1 + a**2)),
        inner.map(lambda a: ex.elementary("exp", ex.elementary("tanh", a))),
        st.tuples(st.sampled_from(["sin", "cos", "atan", "tanh"]), inner).map(
            lambda pair: ex.elementary(*pair)
        ),
        inner.map(lambda a: ex.elementary("tan", ex.elementary("atan", a))),
    )
