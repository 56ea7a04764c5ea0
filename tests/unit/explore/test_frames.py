"""Frames: what goes in comes out, and a page can view it in place."""

import json
import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays_of

from saltus.explore.frames import TYPES, packed, unpacked

ARRAYS = st.dictionaries(
    st.text(max_size=8),
    st.sampled_from(TYPES).flatmap(
        lambda kind: arrays_of.arrays(np.dtype(kind), st.integers(0, 20), fill=st.nothing())
    ),
    max_size=4,
)
HEADS = st.dictionaries(
    st.text(max_size=8).filter(lambda name: name != "arrays"),
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
        max_leaves=5,
    ),
    max_size=4,
)


def finite(value):
    """A value as JSON holds it: null for what isn't a number."""
    if isinstance(value, float) and not np.isfinite(value):
        return None
    if isinstance(value, dict):
        return {name: finite(one) for name, one in value.items()}
    return [finite(one) for one in value] if isinstance(value, list) else value


@settings(max_examples=25)
@given(head=HEADS, arrays=ARRAYS)
def test_a_frame_holds_its_head_and_arrays_to_the_bit(head, arrays):
    told, found = unpacked(packed(head, arrays))
    assert told == finite(head)
    assert list(found) == list(arrays)
    for name, array in arrays.items():
        assert found[name].dtype == array.dtype
        assert found[name].tobytes() == array.tobytes()


@settings(max_examples=25)
@given(head=HEADS, arrays=ARRAYS)
def test_every_array_begins_where_a_page_can_view_it(head, arrays):
    frame = packed(head, arrays)
    (length,) = struct.unpack_from("<I", frame)
    assert (4 + length) % 8 == 0
    places = json.loads(frame[4 : 4 + length])["arrays"]
    for name, kind, count, at in places:
        assert at % 8 == 0
        assert frame[4 + length + at :][: count * int(kind[1])] == arrays[name].tobytes()


def test_numbers_of_numpy_are_numbers_of_json():
    head = {"a": np.float64(0.5), "b": np.int64(3), "c": np.array([1.0, np.nan]), "d": (np.True_,)}
    assert unpacked(packed(head, {}))[0] == {"a": 0.5, "b": 3, "c": [1.0, None], "d": [True]}


def test_other_types_than_a_page_knows_are_refused():
    with pytest.raises(TypeError, match="int64"):
        packed({}, {"x": np.zeros(3, np.int64)})
