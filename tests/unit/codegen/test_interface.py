"""What compiled code knows of its arguments before it is called."""

from __future__ import annotations

import numpy as np
import pytest

from saltus.codegen.interface import MODAL, columns_of, known_of_argument, numba_type
from saltus.codegen.kernels import Call


def test_columns_of_an_array_are_known_to_the_compiler():
    assert (columns_of("float64[:, 4]"), numba_type("float64[:, 4]")) == (4, "float64[:, ::1]")
    assert known_of_argument("float64[:, 4]") == [0, 0, None, 8, None, None, 4, 32, 8]


@pytest.mark.parametrize("kind", ["int64", "float64[::1]", "float64[:, ::1]", "int64[:, :, ::1]"])
def test_open_columns_are_left_to_the_call(kind):
    axes = kind.count(",") + 1
    assert columns_of(kind) is None
    assert numba_type(kind) == kind
    known = known_of_argument(kind)
    # no owner and no parent, a number of eight bytes after the other
    assert [one for one in known if one is not None] == ([] if kind == "int64" else [0, 0, 8, 8])
    assert len(known) == (1 if kind == "int64" else 5 + 2 * axes)


def test_what_is_known_is_what_a_call_hands_over():
    """A block of arguments holds these numbers at these places, for each array of the flow."""
    kinds = [kind for kind in MODAL.arguments if "[" in kind]
    shapes = [(3,) * kind.count(",") + (columns_of(kind) or 5,) for kind in kinds]
    given = [np.zeros(s, k.partition("[")[0]) for s, k in zip(shapes, kinds, strict=True)]
    block = Call(tuple(kinds)).block(tuple(given)).tolist()
    known = [number for kind in kinds for number in known_of_argument(kind)]
    assert len(block) == len(known)
    assert all(a == b for a, b in zip(block, known, strict=True) if b is not None)


def test_an_array_with_other_columns_is_refused():
    with pytest.raises(TypeError, match=r"2 axes and 4 columns, not of float64 \(2, 5\)"):
        Call(("float64[:, 4]",)).block((np.zeros((2, 5)),))
