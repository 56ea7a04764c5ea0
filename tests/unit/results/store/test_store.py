"""A store keeps a map chunk by chunk: what is put in comes out, what isn't there is said, nothing
of another kind gets in.
"""

import hashlib
import json
import math
import os
import time
from contextlib import ExitStack

import numpy as np
import pytest

from saltus import whole_files
from saltus.errors import ParameterError
from saltus.results.store import draft_folder, lock
from saltus.results.store.lock import overlap
from saltus.results.store.store import Store, StoreError
from saltus.whole_files import seal, unseal

IDENTITY = {"study": "a" * 60 + "b" + "c" * 60, "system": "rig"}
MAKE = {"shape": (3, 7), "chunk": 4, "arrays": {"basin": "i2", "peak": float}}


@pytest.fixture
def store(tmp_path):
    return Store.create(tmp_path / "map", IDENTITY, **MAKE)


def values(store, index):
    cells = np.arange(store.chunks.cells)[store.chunks.extent(index)]
    return {"basin": (cells - 9).astype("i2"), "peak": np.sqrt(cells)}


def fill(store, indices=None):
    with store.lock():
        for index in store.missing() if indices is None else indices:
            store.commit(index, values(store, index))
    return store


# -- chunks ----------------------------------------------------------------------------------------
def test_what_is_committed_is_read(store):
    fill(store, [5, 0])
    assert store.done().tolist() == [True, False, False, False, False, True]
    assert store.missing() == [1, 2, 3, 4]
    assert store.missing((1, 3)) == [1, 4]
    assert store.read(5)["basin"].tolist() == [11]
    np.testing.assert_array_equal(store.read(0)["peak"], np.sqrt(np.arange(4)))


def test_a_complete_map_is_read_whole(store):
    everything = fill(store).read_all()
    assert everything["basin"].dtype == np.int16
    assert everything["basin"].tolist() == [cell - 9 for cell in range(21)]
    np.testing.assert_array_equal(everything["peak"], np.sqrt(np.arange(21)))


def test_missing_is_never_a_value(store):
    fill(store, [0, 1, 3, 4, 5])
    with pytest.raises(StoreError, match=r"isn't complete: 1 of 6 chunks are missing \(first: 2\)"):
        store.read_all()
    with pytest.raises(StoreError, match=r"chunk 2 of .* isn't computed yet"):
        store.read(2)
    with pytest.raises(ParameterError, match="no chunk 6: they are numbered from 0 to 5"):
        store.read(6)


def test_every_bit_comes_back(tmp_path):
    """NaN with its payload, minus zero, the fill value, and the ends of each type."""
    kinds = {"?": [True, False], "c16": [complex(-0.0, math.nan), 0j], "f4": [np.inf, 1e-45]} | {
        kind: [np.iinfo(kind).min, np.iinfo(kind).max] for kind in ("i1", "i4", "i8", "u1", "u8")
    }
    arrays = {f"of_{kind.strip('?') or 'b'}": kind for kind in kinds} | {"payload": "f8"}
    store = Store.create(tmp_path / "map", {}, shape=(2,), chunk=1, arrays=arrays)
    put = {f"of_{kind.strip('?') or 'b'}": np.array(both, kind) for kind, both in kinds.items()}
    put["payload"] = np.array([0x7FF8000000000ABC, 1 << 63], "u8").view("f8")
    with store.lock():
        for index in range(2):
            store.commit(index, {name: part[index : index + 1] for name, part in put.items()})
    for name, part in Store.open(store.path).read_all().items():
        assert part.dtype == put[name].dtype, name
        assert part.tobytes() == put[name].tobytes(), name


def test_order_and_repetition_leave_no_trace(tmp_path):
    both = []
    for name, order in ("one", [0, 1, 2, 3, 4, 5]), ("other", [3, 5, 5, 0, 4, 1, 3, 2, 0]):
        (tmp_path / name).mkdir()
        path = fill(
            Store.create(
                tmp_path / name / "map",
                dict(reversed(IDENTITY.items())) if name == "other" else IDENTITY,
                **MAKE,
            ),
            order,
        ).path
        both.append(
            {
                str(file.relative_to(path)): file.read_bytes()
                for file in path.rglob("*")
                if file.is_file() and "locks" not in file.parts
            }
        )
    assert both[0] == both[1]


def test_other_values_for_a_chunk_that_is_done_are_refused(store):
    fill(store)
    with store.lock(), pytest.raises(StoreError, match=r"chunk 2 of .* is done, with other values"):
        store.commit(2, values(store, 1))
    assert store.read(2)["basin"].tolist() == [-1, 0, 1, 2]


@pytest.mark.parametrize(("change", "message"), [
    ({"basin": np.zeros(3, "i2")}, r"has 4 values of int16, not \(3,\)"),
    ({"basin": np.zeros((2, 2), "i2")}, r"not \(2, 2\)"),
    ({"basin": np.zeros(4, "i8")}, "of int64"),
    ({"basin": np.zeros(4)}, "of float64"),
    ({"other": np.zeros(4)}, "the store keeps"),
])  # fmt: skip
def test_wrong_values_are_refused(change, message, store):
    with store.lock(), pytest.raises(ParameterError, match=message):
        store.commit(1, {**values(store, 1), **change})
    assert not store.done().any()


def test_an_array_may_not_be_left_out(store):
    with store.lock(), pytest.raises(ParameterError, match="the store keeps"):
        store.commit(1, {"basin": values(store, 1)["basin"]})


def test_a_chunk_larger_than_the_grid_is_the_grid(tmp_path):
    store = Store.create(tmp_path / "map", {}, shape=(2, 2), chunk=100, arrays={"x": "f8"})
    assert (store.chunks.count, store.chunks.chunk) == (1, 4)
    Store.create_or_resume(tmp_path / "map", {}, shape=(2, 2), chunk=100, arrays={"x": "f8"})


# -- the file of a chunk ---------------------------------------------------------------------------
def test_a_chunk_is_numbers_their_place_and_a_checksum(store):
    """As the documentation of the store says: other programs may read it."""
    fill(store)
    data = (store.path / "chunks/1.chunk").read_bytes()
    assert data[:8] == np.arange(-5, -1, dtype="<i2").tobytes()
    assert np.array_equal(np.frombuffer(data, "<f8", 4, 8), np.sqrt(np.arange(4, 8)))
    assert int.from_bytes(data[40:48], "little") == 1
    assert hashlib.sha256(data[:-32]).digest() == data[-32:]
    assert len(data) == 40 + 8 + 32 + 32


def test_every_bit_of_a_chunk_counts(store):
    data = (fill(store).path / "chunks/1.chunk").read_bytes()
    for bit in range(8 * len(data)):
        flipped = bytearray(data)
        flipped[bit // 8] ^= 1 << bit % 8
        assert store.chunks.decode(1, bytes(flipped), store._made_under) is None
    assert all(
        store.chunks.decode(1, data[:end], store._made_under) is None for end in range(len(data))
    )
    assert store.chunks.decode(1, data + b"0", store._made_under) is None


# -- making and opening ----------------------------------------------------------------------------
def test_resuming_goes_on(store):
    fill(store, [1])
    again = Store.create_or_resume(store.path, IDENTITY, **MAKE)
    assert again.missing() == [0, 2, 3, 4, 5]
    assert Store.open(store.path, IDENTITY).identity == IDENTITY


@pytest.mark.parametrize(("identity", "make", "message"), [
    (IDENTITY | {"system": "duffing"}, {}, "system was 'rig', is 'duffing'"),
    (IDENTITY | {"method": "Taylor"}, {}, "method was not set, is 'Taylor'"),
    ({"system": "rig"}, {}, "study was 'a{40}…', is not set"),
    (IDENTITY | {"study": "a" * 60 + "X" + "c" * 60}, {}, "study was '…a{12}bc{27}…', is "
                                                          "'…a{12}Xc{27}…'"),
    (IDENTITY, {"shape": (7, 3)}, "shape was '3 x 7', is '7 x 3'"),
    (IDENTITY, {"chunk": 5}, "chunk was '4', is '5'"),
    (IDENTITY, {"arrays": {"basin": "i2", "peak": "f4"}}, "arrays was '.*peak float64', is '.*peak "
                                                          "float32'"),
])  # fmt: skip
def test_another_identity_is_refused(identity, make, message, store):
    with pytest.raises(
        StoreError, match=f"made from something else: {message}.*Choose another path"
    ):
        Store.create_or_resume(store.path, identity, **MAKE | make)


def test_opening_compares_only_what_it_is_given(store):
    Store.open(store.path)
    with pytest.raises(StoreError, match="system was 'rig', is 'other'"):
        Store.open(store.path, IDENTITY | {"system": "other"})


def test_nothing_is_overwritten(store, tmp_path):
    (tmp_path / "folder").mkdir()
    (tmp_path / "file").write_text("mine")
    for name in "folder", "file":
        with pytest.raises(StoreError, match="is there already"):
            Store.create(tmp_path / name, IDENTITY, **MAKE)
        with pytest.raises(StoreError, match="not a store of saltus, and it was left alone"):
            Store.create_or_resume(tmp_path / name, IDENTITY, **MAKE)
    with pytest.raises(StoreError, match="is there already"):
        Store.create(store.path, IDENTITY, **MAKE)
    assert (tmp_path / "file").read_text() == "mine"
    assert not list((tmp_path / "folder").iterdir())


def test_paths_that_are_not_there(tmp_path):
    with pytest.raises(StoreError, match=r"there is no folder .*no\. Make it first"):
        Store.create(tmp_path / "no" / "map", IDENTITY, **MAKE)
    with pytest.raises(StoreError, match="there is no store"):
        Store.open(tmp_path / "map")


@pytest.mark.parametrize(
    "change",
    [
        {"shape": ()},
        {"shape": (3, 0)},
        {"chunk": 0},
        {"arrays": {}},
        {"arrays": {"a/b": "f8"}},
        {"arrays": {"x": "U3"}},
    ],
)
def test_what_cannot_be_stored_is_refused_first(change, tmp_path):
    with pytest.raises(ParameterError):
        Store.create(tmp_path / "map", IDENTITY, **MAKE | change)
    with pytest.raises(ParameterError, match="Give it as text"):
        Store.create(tmp_path / "map", {"tolerance": 1e-3}, **MAKE)
    with pytest.raises(ParameterError, match="only plain values"):
        Store.create(tmp_path / "map", IDENTITY, **MAKE, note={"start": np.zeros(2)})
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(("layout", "age"), [(2, "an earlier"), (4, "a later")])
def test_another_layout_is_refused(store, layout, age):
    head = json.loads((store.path / "store.json").read_bytes())
    del head["checksum"]
    (store.path / "store.json").write_bytes(seal(head | {"format": layout}))
    for again in (
        lambda: Store.open(store.path),
        lambda: Store.create_or_resume(store.path, IDENTITY, **MAKE),
    ):
        with pytest.raises(StoreError, match=f"made by {age} saltus"):
            again()


@pytest.mark.parametrize(
    "damage",
    [lambda data: data[:40], lambda data: data.replace(b"rig", b"gir"), lambda _: b"", None],
)
def test_a_damaged_head_is_written_again(store, damage):
    """It follows from the study; what is computed stays, whatever happens to it."""
    fill(store, [0, 3])
    head = store.path / "store.json"
    before = head.read_bytes()
    head.write_bytes(damage(before)) if damage else head.unlink()
    with pytest.raises(StoreError) as told:
        Store.open(store.path)
    assert "delete" not in str(told.value)
    again = Store.create_or_resume(store.path, IDENTITY, **MAKE)
    assert head.read_bytes() == before
    assert (again.missing(), again.damaged()) == ([1, 2, 4, 5], [])


def test_a_damaged_head_is_not_written_over_chunks_of_something_else(store):
    fill(store, [0])
    (store.path / "store.json").write_bytes(b"?")
    with pytest.raises(StoreError, match=r"made from something else.*Nothing was changed"):
        Store.create_or_resume(store.path, IDENTITY | {"system": "another"}, **MAKE)
    assert (store.path / "store.json").read_bytes() == b"?"


def test_the_head_of_another_store_is_put_right(store, tmp_path):
    """An intact file in the wrong place: the chunks say whose it should be."""
    fill(store)
    other = Store.create(tmp_path / "other", IDENTITY | {"system": "another"}, **MAKE)
    (store.path / "store.json").write_bytes((other.path / "store.json").read_bytes())
    assert len(Store.open(store.path).damaged()) == 6, (
        "none of the chunks is taken for another store's"
    )
    again = Store.create_or_resume(store.path, IDENTITY, **MAKE)
    assert again.identity == IDENTITY
    assert again.damaged() == []


def test_a_young_draft_that_looks_old_is_left_alone_while_it_is_filled(tmp_path, monkeypatch):
    """The clock jumps ahead by an hour while another process makes its store."""
    looked = []

    def write_slowly(path, data):
        os.utime(path.parents[len(path.relative_to(tmp_path).parts) - 2], (time.time() - 3600,) * 2)
        draft_folder.remove_old_drafts(tmp_path / "map")
        looked.append(path.parent.is_dir())
        whole_files.write(path, data)

    monkeypatch.setattr(draft_folder, "write", write_slowly)
    Store.create(tmp_path / "map", IDENTITY, **MAKE)
    assert looked
    assert all(looked)


def test_old_drafts_go_young_ones_stay(tmp_path):
    for name, age in ("old", 100), ("young", 0):
        (tmp_path / f".map.{name}.part").mkdir()
        os.utime(tmp_path / f".map.{name}.part", (time.time() - age,) * 2)
    Store.create(tmp_path / "map", IDENTITY, **MAKE)
    assert sorted(one.name for one in tmp_path.iterdir()) == [".map.young.part", "map"]


# -- locks -----------------------------------------------------------------------------------------
def test_writing_needs_the_lock(store):
    for write in (
        lambda: store.commit(0, values(store, 0)),
        store.verify,
        lambda: store.put("x", 1),
    ):
        with pytest.raises(StoreError, match="isn't locked by this process"):
            write()
    fill(store, [0])
    with pytest.raises(StoreError, match="isn't locked by this process"):
        store.commit(1, values(store, 1))


def test_a_shard_writes_its_own_chunks_only(store):
    with store.lock((1, 2)):
        store.commit(3, values(store, 3))
        with pytest.raises(
            StoreError,
            match=r"chunk 2 .* belongs to shard 0 of 2, and the lock is "
            r"for shard 1",
        ):
            store.commit(2, values(store, 2))
    with pytest.raises(ParameterError, match="numbered from 0"), store.lock((2, 2)):
        pass


def test_a_lock_is_for_one_part_of_a_process(store):
    other = Store.open(store.path)
    with store.lock((0, 2)):
        with other.lock((1, 2)):
            assert [text.split(", ")[1] for text in store.status().writers] == [
                "shard 0 of 2",
                "shard 1 of 2",
            ]
        for shard in None, (0, 2):
            with (
                pytest.raises(StoreError, match=f"process {os.getpid()} on .*, shard 0 of 2. Wait"),
                other.lock(shard),
            ):
                pass
    with other.lock():
        pass
    assert store.status().writers == ()


def test_the_name_of_a_killed_holder_goes(store):
    (store.path / "locks" / "0-of-1").write_text(
        '{"host": "a host with a long name", "process": 1, "since": "2026-01-01 '
        '12:00:00+00:00"}' * 2
    )
    assert store.status().writers == ()
    with store.lock():
        assert store.status().writers[0].startswith(f"process {os.getpid()} on")


def test_a_refused_writer_does_not_get_in_the_way(store):
    other = Store.open(store.path)
    with store.lock((0, 2)):
        with pytest.raises(StoreError), other.lock():
            pass
        assert not (store.path / "locks" / "0-of-1").exists(), (
            "it looked before it took its own lock"
        )


def test_two_that_take_a_lock_at_once_are_not_both_let_in(store, monkeypatch):
    """Another process takes shard 0 of 2 just after this one has looked."""
    look = lock._refuse_if_held
    with ExitStack() as late:

        def look_and_lose(folder, shard, *, others_only):
            look(folder, shard, others_only=others_only)
            if not others_only:
                late.enter_context(lock.exclusive(folder / "0-of-2"))

        monkeypatch.setattr(lock, "_refuse_if_held", look_and_lose)
        with (
            pytest.raises(StoreError, match="written by another process, shard 0 of 2"),
            store.lock(),
        ):
            pass


def test_shards_overlap_where_they_share_a_chunk():
    for m in range(1, 7):
        for n in range(1, 7):
            for k in range(m):
                for j in range(n):
                    shared = set(range(k, 60, m)) & set(range(j, 60, n))
                    assert overlap((k, m), (j, n)) == bool(shared)


def test_drafts_of_killed_writers_go(store):
    parts = store.path / "parts"
    for name in ("3.0.part", "4.1.part", "artifact.0.part"):
        (parts / name).touch()
    with store.lock((1, 2)):
        assert sorted(one.name for one in parts.iterdir()) == ["4.1.part", "artifact.0.part"]
    with store.lock():
        assert not list(parts.iterdir())


# -- artifacts -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    "value",
    [b"", bytes(range(256)), None, {"b": [1, 2.5e-310, -0.0, "µ"], "a": {}}, [math.inf, True]],
)
def test_an_artifact_comes_back(value, store):
    assert not store.has("attractors")
    with store.lock():
        assert repr(store.put("attractors", value)) == repr(value) or value == store.get(
            "attractors"
        )
    again = Store.open(store.path)
    assert again.has("attractors")
    assert again.get("attractors") == value
    assert type(again.get("attractors")) is type(value)


def test_an_artifact_is_the_same_for_all(store):
    with store.lock():
        store.put("table", [1, math.nan])
        store.put("table", [1, math.nan])
        with pytest.raises(StoreError, match="keeps another 'table' already"):
            store.put("table", [2])
        assert store.put("table", [2], existing="keep")[0] == 1
    with store.lock((0, 2)):
        with pytest.raises(StoreError, match="under the lock of the whole store"):
            store.put("table", [2], existing="replace")
        assert store.put("table", [2], existing="keep")[0] == 1
    with store.lock():
        assert store.put("table", [2], existing="replace") == [2]


def test_a_damaged_artifact_counts_as_none(store):
    with store.lock():
        store.put("table", [1])
        file = store.path / "artifacts/table.json"
        file.write_bytes(file.read_bytes().replace(b"1", b"3", 1))
        assert not store.has("table")
        assert store.put("table", [2]) == [2]
    with pytest.raises(StoreError, match="has no 'other'"):
        store.get("other")
    with pytest.raises(ParameterError, match="use letters"):
        store.get("../store")


def test_an_artifact_in_the_wrong_place_counts_as_none(store, tmp_path):
    """Another one of this store, and the same one of another store: intact, and not it."""
    other = Store.create(tmp_path / "other", IDENTITY | {"system": "another"}, **MAKE)
    for one, value in (store, [1]), (other, [2]):
        with one.lock():
            one.put("table", value)
            one.put("second", [3])
    for strange in store.path / "artifacts/second.json", other.path / "artifacts/table.json":
        (store.path / "artifacts/table.json").write_bytes(strange.read_bytes())
        assert not store.has("table")
        with pytest.raises(StoreError, match="damaged 'table'"):
            store.get("table")
        with store.lock():
            assert store.put("table", [1]) == [1]


def test_a_seal_sees_every_bit():
    sealed = seal({"a": [1.5, None], "b": "µ"})
    assert sealed == seal({"b": "µ", "a": [1.5, None]})
    assert unseal(sealed)["a"] == [1.5, None]
    for place in range(len(sealed)):
        for bit in range(8):
            assert (
                unseal(sealed[:place] + bytes([sealed[place] ^ 1 << bit]) + sealed[place + 1 :])
                is None
            )
    for text in (b"", b"[]", b"null", b"{}", b"\xff", sealed[:-2], sealed + b"\n", b"[" * 100_000):
        assert unseal(text) is None


def test_a_seal_belongs_where_its_identity_says():
    sealed = seal({"name": "a", "store": "s", "value": [1.0]})
    assert unseal(sealed, name="a", store="s")["value"] == [1.0]
    assert unseal(sealed, name="b", store="s") is None
    assert unseal(sealed, name="a", folder="s") is None
    assert unseal(None, name="a") is None


# -- status ----------------------------------------------------------------------------------------
def test_status_tells_how_far_it_is(store):
    before = store.status()
    assert (before.done, before.total, before.damaged, before.last_written, before.writers) == (
        0,
        6,
        0,
        None,
        (),
    )
    fill(store, [0, 1, 4])
    (store.path / "chunks/1.chunk").write_bytes(b"short")
    file = store.path / "chunks/4.chunk"
    file.write_bytes(b"?" + file.read_bytes()[1:])
    with store.lock((0, 4)):
        status = Store.open(store.path).status()
    assert (status.done, status.damaged, store.status(checksums=True).damaged) == (3, 1, 2)
    assert status.bytes > before.bytes
    assert abs(status.last_written.timestamp() - time.time()) < 60
    assert status.identity == IDENTITY
    assert len(status.writers) == 1


def test_verify_is_for_the_chunks_of_the_lock(store):
    fill(store)
    for index in 1, 2:
        (store.path / f"chunks/{index}.chunk").write_bytes(b"")
    with store.lock((0, 2)):
        assert store.verify() == [2]
    assert store.missing() == [2]
    with store.lock():
        assert store.verify() == [1]
        assert store.verify() == []
    assert store.missing() == [1, 2]


def test_a_store_that_was_deleted_says_so(store):
    store.path.rename(store.path.with_name("elsewhere"))
    with pytest.raises(StoreError, match="moved or deleted"):
        store.done()


# -- what somebody else wrote, with right checksums ------------------------------------------------
@pytest.mark.parametrize(
    ("name", "value"),
    [("format", "3"), ("identity", []), ("note", None), ("shape", [None, 7]), ("shape", []),
        ("shape", [10**9, 10**9]), ("chunk", 0),
     ("chunk", None), ("arrays", {"basin": [-1]}), ("arrays", {"basin": "object"})],
)  # fmt: skip
def test_a_head_that_says_what_none_does_counts_as_damaged(store, name, value):
    head = unseal((store.path / "store.json").read_bytes())
    head = {key: one for key, one in head.items() if key != "checksum"}
    (store.path / "store.json").write_bytes(seal(head | {name: value}))
    with pytest.raises(StoreError, match=r"store\.json is damaged"):
        Store.open(store.path)
    fill(store, [0])
    assert Store.create_or_resume(store.path, IDENTITY, **MAKE).done()[0], (
        "it is written again, and the chunks stay"
    )
