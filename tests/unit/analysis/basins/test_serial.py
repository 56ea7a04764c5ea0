"""Attractors and labels as plain data: through JSON and back, bit by bit."""

from __future__ import annotations

import json
import pickle
import struct

import numpy as np
import pytest

from function_maps import FunctionMap
from saltus.analysis.attractors.aperiodic import SampledMotion
from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.find_attractors import find_attractors
from saltus.analysis.basins.labels import Settling, settle
from saltus.analysis.basins.serial import (
    cell_types,
    found_data,
    found_from,
    settling_arrays,
    settling_from,
)
from saltus.analysis.closed.capture import Neighbourhoods
from saltus.analysis.closed.motions import ClosedMotion
from saltus.errors import SaltusError
from saltus.whole_files import seal, unseal

SCALE = np.array([3.0, 1.0])


def henon(a, b):
    """Chaotic at a = 1.4, b = 0.3; a 4-cycle at a = 1, b = 0.3. What escapes stays far away, but
    finite.
    """
    return FunctionMap(
        lambda s: np.clip(
            np.stack([1 - a * s[:, 0] ** 2 + s[:, 1], b * s[:, 0]], axis=1), -1e3, 1e3
        ),
        "x y",
        lambda s: np.stack(
            [
                np.stack([-2 * a * s[:, 0], np.ones(len(s))], 1),
                np.stack([np.full(len(s), b), np.zeros(len(s))], 1),
            ],
            1,
        ),
    )


def starts():
    return np.random.default_rng(2).uniform(-0.1, 0.1, (12, 2))


@pytest.fixture(scope="module", params=["chaotic", "periodic"])
def case(request):
    """A map, and the attractors that were found on it."""
    map_ = henon(1.4 if request.param == "chaotic" else 1.0, 0.3)
    found = find_attractors(map_, starts(), SCALE, 256)[0]
    assert [len(found.sampled), len(found.orbits)] == (
        [1, 0] if request.param == "chaotic" else [0, 1]
    )
    return map_, found


def through_a_store(found):
    """As a store keeps it: JSON with a checksum, as bytes."""
    return found_from(unseal(seal({"value": found_data(found)}))["value"], 2)


def numbers(found):
    """Every number of it, as bytes, with shapes and types."""

    def told(array):
        array = np.asarray(array)
        return array.dtype.str, array.shape, array.tobytes()

    orbits = [
        (told(o.points), told(o.multipliers.astype(complex)), struct.pack("d", o.mismatch))
        for o in (*found.orbits, *found.unstable)
    ]
    sampled = [
        (w.kind, struct.pack("dd", w.exponent, w.exponent_error), told(w.points), told(w.scale))
        for w in found.sampled
    ]
    near = found.near
    return (
        len(found.orbits),
        orbits,
        sampled,
        told(near.centres),
        told(near.weights),
        told(near.owners),
    )


def test_found_comes_back_to_the_last_bit(case):
    assert numbers(through_a_store(case[1])) == numbers(case[1])


def test_labels_do_not_depend_on_whether_attractors_were_read_or_computed(case):
    map_, found = case
    one, other = (settle(map_, starts(), each, 512) for each in (found, through_a_store(found)))
    assert set(one.label) == {0}
    for name in ("label", "periods", "status", "unresolved", "end"):
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name


def test_one_bit_changes_the_bytes(case):
    """The test above can fail: the last bit of one number is seen."""
    data = found_data(case[1])
    again = found_from(json.loads(json.dumps(data)), 2)
    part = (again.sampled or again.orbits)[0].points
    part[0, 0] = np.nextafter(part[0, 0], 9.0)
    assert numbers(again) != numbers(case[1])


def test_twice_is_as_once(case):
    data = found_data(case[1])
    assert json.dumps(found_data(found_from(data, 2))) == json.dumps(data)


def test_numbers_that_text_may_lose():
    """Denormals, signed zero, infinity, not-a-number, 17 digits, complex multipliers, an orbit that
    doesn't attract.
    """
    odd = np.array(
        [[5e-324, -0.0], [0.1 + 0.2, 1.7976931348623157e308], [np.inf, -np.inf], [np.nan, 1 / 3]]
    )
    matrices = np.arange(16.0).reshape(4, 2, 2) / 7
    orbit = ClosedMotion(odd, np.array([0.3 + 0.4j, complex(-0.0, -0.4)]), np.float64(1e-17))
    found = AttractorSet(
        Neighbourhoods(odd[:2].copy(), matrices[:2], np.array([0, 1])),
        [orbit],
        [SampledMotion("quasi_periodic", -0.0, np.nan, odd, SCALE)],
        [orbit],
    )
    data = json.loads(json.dumps(found_data(found)))
    again = found_from(data, 2)
    assert again.near.centres.tobytes() == odd[:2].tobytes()
    assert again.orbits[0].points.tobytes() == odd.tobytes()
    assert again.unstable[0].multipliers.tobytes() == orbit.multipliers.tobytes()
    assert struct.pack("d", again.orbits[0].mismatch) == struct.pack("d", 1e-17)
    assert again.sampled[0].points.tobytes() == odd.tobytes()
    assert struct.pack("d", again.sampled[0].exponent) == struct.pack("d", -0.0)


def test_nothing_found():
    again = through_a_store(AttractorSet(Neighbourhoods.none(2)))
    assert len(again) == 0
    assert again.near.centres.shape == (0, 2)
    assert again.near.weights.shape == (0, 2, 2)
    label, _ = again.near.capture(np.zeros((3, 4, 2)))
    assert set(label) == {-1}


def test_a_worker_gets_the_same_attractors(case):
    """dask hands them over by pickle: between processes of ours, never from a file."""
    assert numbers(pickle.loads(pickle.dumps(case[1]))) == numbers(case[1])


@pytest.mark.parametrize(
    "forge",
    [
        lambda data: data["near"].update(weights=data["near"]["weights"][:1]),
        lambda data: data["near"].update(owners=data["near"]["owners"][:1]),
        lambda data: data["near"].update(owners=[2**40] * len(data["near"]["owners"])),
        lambda data: data["near"].update(owners=[-1] * len(data["near"]["owners"])),
        lambda data: data["near"].update(
            centres=[[float("nan")] * 2] * len(data["near"]["centres"])
        ),
        lambda data: data["near"].update(centres=[[]]),
        lambda data: data.update(orbits=[]),
        lambda data: data["orbits"][0].update(points=[]),
        lambda data: data["orbits"][0].update(points=[["a", {}]]),
        lambda data: data["orbits"][0].update(multipliers=[[0.5, 0.0]]),
        lambda data: data.pop("sampled"),
        lambda data: data.update(near=5),
    ],
)
def test_data_that_do_not_hold_together_are_refused(forge):
    """Machine code reads them by their lengths: somebody else's, with a right checksum, must not
    reach it.
    """
    data = json.loads(json.dumps(found_data(_periodic())))
    found_from(data, 2)
    forge(data)
    with pytest.raises(SaltusError, match="aren't such as saltus writes"):
        found_from(data, 2)


def _periodic():
    orbit = ClosedMotion(np.zeros((2, 2)), np.zeros(2, complex), 0.0)
    return AttractorSet(
        Neighbourhoods(np.zeros((2, 2)), np.stack([np.eye(2)] * 2), np.zeros(2, np.int64)), [orbit]
    )


# -- cells -----------------------------------------------------------------------------------------
def some_cells():
    return Settling(
        np.array([0, 3, -1, -2, -3, -5]), np.array([1, 2000, -1, -1, -1, -1]),
        np.array([2, 3, 8, 12, 6, 2]),
        np.array([0, 32767, 0, 1, 0, 0]),
        np.array([[0.0, -0.0], [1 / 3, 5e-324], [np.inf, np.nan], [1.0, 2.0], [3.0, 4.0],
            [-1e300, 1.0]]),
    )  # fmt: skip


def test_cells_come_back_to_the_last_bit():
    cells, states = some_cells(), ("x", "v")
    arrays = settling_arrays(cells, states)
    assert {name: array.dtype for name, array in arrays.items()} == {
        name: np.dtype(kind) for name, kind in cell_types(states).items()
    }
    again = settling_from(arrays, states)
    for name in ("label", "periods", "status", "unresolved", "end"):
        assert getattr(again, name).tobytes() == getattr(cells, name).tobytes(), name
        assert getattr(again, name).dtype == getattr(cells, name).dtype


def test_states_keep_their_order():
    """Arrays are looked up by name, so a reader that sorts them does no harm."""
    arrays = dict(sorted(settling_arrays(some_cells(), ("x", "v")).items()))
    assert settling_from(arrays, ("x", "v")).end[1].tolist() == [1 / 3, 5e-324]
    assert settling_from(arrays, ("v", "x")).end[1].tolist() == [5e-324, 1 / 3]


def test_a_count_too_large_to_keep_stays_the_largest():
    cells = some_cells()
    cells.unresolved[0] = 10**6
    assert settling_arrays(cells, ("x", "v"))["unresolved"][0] == 32767
    assert cells.unresolved[0] == 10**6
