"""A store survives what befalls a computer: kill -9 at any moment, Ctrl-C, a full disk, damaged
files, a second writer.
"""

import errno
import multiprocessing
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from multiprocessing import forkserver
from pathlib import Path

import numpy as np
import pytest

from faults.store_writer import (
    FINE,
    FINEST,
    IDENTITY,
    MAKE,
    SMALL,
    compute,
    die_at,
    hold,
    hold_and_fork,
    values,
)
from saltus.results.store.chunks import TRAILER
from saltus.results.store.store import Store, StoreError

posix = pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")


@pytest.fixture(scope="module")
def processes():
    """Processes that start in milliseconds: forked from a server that has imported the store, and
    used nothing of it.
    """
    if sys.platform == "win32":
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["faults.store_writer"])
    with pytest.MonkeyPatch.context() as patch:
        # where the server looks for what it imports
        patch.setenv("PYTHONPATH", os.pathsep.join(filter(None, sys.path)))
        forkserver.ensure_running()
    return context


@pytest.fixture
def memory():
    """A folder in memory where there is one: what a kill leaves behind doesn't depend on the disk,
    and hundreds of maps are made.
    """
    with tempfile.TemporaryDirectory(
        dir="/dev/shm" if os.path.isdir("/dev/shm") else None
    ) as folder:
        yield Path(folder)


@pytest.fixture
def undisturbed(tmp_path):
    (tmp_path / "undisturbed").mkdir()
    return contents(compute(tmp_path / "undisturbed" / "map").path)


def contents(path):
    """Every file of a finished store but the locks; nothing else may be in it, or beside it."""
    assert [one.name for one in path.parent.iterdir()] == [path.name]
    files = {
        str(file.relative_to(path)): file.read_bytes() for file in path.rglob("*") if file.is_file()
    }
    return {name: data for name, data in files.items() if not name.startswith("locks")}


def start(processes, function, *arguments):
    process = processes.Process(target=function, args=arguments)
    process.start()
    return process


# -- killed ----------------------------------------------------------------------------------------
@posix
@pytest.mark.slow
def test_killed_at_random_moments(processes, tmp_path):
    """One map, its writer killed 20 times: a moment after it started, or after it got on by a chunk
    or two. No writer gets on by more than three, so none finishes the map, however fast it is.
    """
    moments = random.Random(3)
    path, progress = tmp_path / "map" / "map", [0]
    path.parent.mkdir()
    for _ in range(20):
        chunks = moments.randrange(3)
        writer = start(processes, compute, path, None, 1, 0.002, FINEST, chunks + 1)
        goal = progress[-1] + chunks
        wait_for(lambda goal=goal: goal == 0 or committed(path) >= goal)
        time.sleep(moments.uniform(0.0, 0.02))
        writer.kill()
        writer.join()
        assert writer.exitcode == -signal.SIGKILL
        progress.append(committed(path))
    assert progress == sorted(progress), "what is done stays done"
    assert len(set(progress)) > 5, "it got on between the kills"
    forget_drafts(path)
    compute(path, make=FINEST)
    (tmp_path / "undisturbed").mkdir()
    assert contents(path) == contents(compute(tmp_path / "undisturbed" / "map", make=FINEST).path)


def committed(path):
    return len(list((path / "chunks").glob("*.chunk")))


@pytest.mark.slow
@posix
def test_killed_at_every_touch_of_the_disk(processes, memory):
    """A new map of three chunks each time, its writer killed at its n-th touch; the resumed map is
    the undisturbed one.
    """
    (memory / "undisturbed").mkdir()
    undisturbed = contents(compute(memory / "undisturbed" / "map", make=SMALL).path)
    found = set()
    for step in range(1000):
        path = memory / str(step) / "map"
        path.parent.mkdir()
        writer = start(processes, die_at, path, step)
        writer.join()
        found.add(committed(path) if path.exists() else "nothing")
        assert not path.exists() or Store.open(path).damaged() == [], (
            "what is there is true before anything is mended"
        )
        forget_drafts(path)
        assert contents(compute(path, make=SMALL).path) == undisturbed, step
        if writer.exitcode == 0:
            break
        assert writer.exitcode == -signal.SIGKILL
    assert step > 40
    assert found == {"nothing", 0, 1, 2, 3}, "it was killed in every phase"


def forget_drafts(path):
    """Make drafts of a store that was never made old enough to be removed."""
    for draft in path.parent.glob(".map.*.part"):
        os.utime(draft, (0, 0))


@posix
@pytest.mark.slow
def test_interrupted(undisturbed, tmp_path):
    """Ctrl-C ends the writer, not the map."""
    path = tmp_path / "map" / "map"
    path.parent.mkdir()
    code = f"""
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # a background job has it ignored
sys.path[:0] = {sys.path!r}
from faults.store_writer import compute
compute({str(path)!r}, pause=0.1)"""
    writer = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True)
    wait_for(lambda: path.exists() and Store.open(path).done().sum() >= 2)
    writer.send_signal(signal.SIGINT)
    assert "KeyboardInterrupt" in writer.communicate(timeout=20)[1]
    assert 2 <= Store.open(path).done().sum() < 10
    assert not list((path / "parts").iterdir())
    compute(path)
    assert contents(path) == undisturbed


def wait_for(condition):
    end = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


# -- a full disk -----------------------------------------------------------------------------------
@pytest.fixture
def small_disk(tmp_path):
    """A file system of 256 kB, if this machine lets us make one."""
    place = tmp_path / "disk"
    place.mkdir()
    mounted = sys.platform == "linux" and subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(place)],
        capture_output=True,
        check=False,
    )
    if not mounted or mounted.returncode:
        pytest.skip("mounting a small file system needs rights that this user doesn't have")
    yield place
    subprocess.run(["umount", str(place)], check=True)


def test_full_disk(small_disk, undisturbed):
    store = Store.create(small_disk / "map", IDENTITY, **MAKE)
    ballast = fill(small_disk / "ballast")
    with store.lock():
        with pytest.raises(
            StoreError,
            match=r"can't be written: No space left on "
            r"device.*make room",
        ):
            commit_all(store)
        halves = [
            file
            for file in store.path.rglob("*")
            if file.is_file()
            and undisturbed.get(str(file.relative_to(store.path))) != file.read_bytes()
        ]
        assert {file.parent.name for file in halves} == {"locks"}
        assert store.verify() == []
        before = store.done().sum()
        assert before < 10
    fill(ballast)
    with pytest.raises(StoreError, match=r"can't be made: No space left on device"):
        Store.create(small_disk / "second", IDENTITY, **MAKE)
    assert sorted(one.name for one in small_disk.iterdir()) == ["ballast", "map"]
    ballast.unlink()
    assert contents(compute(store.path).path) == undisturbed


def fill(path):
    """Use up what is left of the disk."""
    with suppress(OSError), path.open("ab", buffering=0) as file:
        while True:
            file.write(b"\0" * 512)
    return path


def commit_all(store):
    for index in store.missing():
        store.commit(index, values(store, index))


def test_disk_full_at_every_flush(undisturbed, tmp_path, monkeypatch):
    """The same without a small disk: the n-th flush fails."""
    (tmp_path / "map").mkdir()
    store = Store.create(tmp_path / "map" / "map", IDENTITY, **MAKE)
    flush, refused = os.fsync, 0
    for step in range(20):
        count = iter(range(100))

        def full(handle, step=step, count=count):
            if next(count) == step:
                raise OSError(errno.ENOSPC, "No space left on device")
            flush(handle)

        with store.lock():
            before = store.done()
            monkeypatch.setattr(os, "fsync", full)
            try:
                for index in store.missing()[:2]:
                    store.commit(index, values(store, index))
            except StoreError:
                refused += 1
            monkeypatch.undo()
            assert not list((store.path / "parts").iterdir())
            assert (store.done() >= before).all()
            assert store.damaged() == []
    assert refused == 4, "two flushes of two chunks: the file, and its name"
    assert contents(compute(store.path).path) == undisturbed


# -- damaged files ---------------------------------------------------------------------------------
def test_any_damaged_file_is_found_and_computed_again(memory):
    """Each file of a store in turn: cut short, one bit flipped, removed."""
    store = compute(memory / "map", make=SMALL)
    undisturbed = contents(store.path)
    places = random.Random(5)
    for name, data in undisturbed.items():
        flipped = bytearray(data)
        flipped[places.randrange(len(data))] ^= 1 << places.randrange(8)
        for damage in (data[: len(data) // 2], bytes(flipped), b"", None):
            file = store.path / name
            file.write_bytes(damage) if damage is not None else file.unlink()
            index = int(file.stem) if name.startswith("chunks") else None
            gone = damage is None
            if name == "store.json":
                with pytest.raises(
                    StoreError, match="not a store" if damage is None else "is damaged"
                ):
                    Store.open(store.path)
            if index is not None:
                with pytest.raises(
                    StoreError, match="isn't computed yet" if gone else "is damaged"
                ):
                    store.read(index)
                with pytest.raises(StoreError):
                    store.read_all()
                assert store.damaged() == ([] if gone else [index])
            if name.startswith("artifacts"):
                assert not store.has("attractors")
                with pytest.raises(
                    StoreError, match="has no" if damage is None else "has a damaged"
                ):
                    store.get("attractors")
            compute(store.path, make=SMALL)
            assert contents(store.path) == undisturbed, name


@posix
@pytest.mark.parametrize("name", ["store.json", "chunks/1.chunk", "artifacts/attractors.json"])
@pytest.mark.parametrize(
    "device",
    [os.mkfifo if sys.platform != "win32" else None, lambda file: os.symlink("/dev/zero", file)],
)
def test_a_pipe_or_a_device_in_place_of_a_file_is_not_waited_for(name, device, memory):
    store = compute(memory / "map", make=SMALL)
    undisturbed = contents(store.path)
    (store.path / name).unlink()
    device(store.path / name)
    assert store.damaged() == ([1] if name.startswith("chunks") else [])
    assert contents(compute(store.path, make=SMALL).path) == undisturbed


@posix
def test_a_pipe_or_a_link_in_place_of_a_lock_is_refused(memory):
    store, other = compute(memory / "map", make=SMALL), memory / "other"
    other.write_text("kept")
    lock = store.path / "locks/0-of-1"
    for make in (os.mkfifo, lambda file: os.symlink(other, file)):
        lock.unlink()
        make(lock)
        with pytest.raises(StoreError, match="no regular file"), store.lock():
            pass
    assert other.read_text() == "kept"


@pytest.mark.parametrize("name", ["parts", "locks", "chunks", "artifacts"])
def test_a_folder_that_is_gone_is_made_again(name, memory):
    store = compute(memory / "map", make=SMALL)
    undisturbed = contents(store.path)
    shutil.rmtree(store.path / name)
    assert name == "chunks" or store.status().writers == ()
    assert contents(compute(store.path, make=SMALL).path) == undisturbed


def test_numbers_of_another_chunk_are_found(tmp_path):
    """The numbers of one chunk before the last bytes of another, which alone are read where
    checksums aren't asked for.
    """
    store = compute(tmp_path / "map")
    one, other = (store.path / "chunks" / f"{name}.chunk" for name in "34")
    one.write_bytes(other.read_bytes()[:-TRAILER] + one.read_bytes()[-TRAILER:])
    assert store.damaged() == [3]
    assert store.damaged(checksums=False) == []


def test_whole_pairs_in_the_wrong_place_are_found_and_computed_again(memory):
    """What a careless merge of folders does: the file of a chunk, intact, at another number or in
    another store.
    """
    (memory / "other").mkdir()
    other = Store.create(memory / "other" / "map", IDENTITY | {"study": "another"}, **SMALL)
    with other.lock():
        other.put("attractors", [[3.0]])
        for index in other.missing():
            other.commit(
                index, {name: part[::-1].copy() for name, part in values(other, index).items()}
            )
    (memory / "own").mkdir()
    store = compute(memory / "own" / "map", make=SMALL)
    undisturbed = contents(store.path)
    carried = {
        (path, i, j) for path in (store.path, other.path) for i in range(3) for j in range(3)
    }
    for path, i, j in sorted(carried - {(store.path, i, i) for i in range(3)}):
        if (store.chunks.extent(i).stop - store.chunks.extent(i).start) == (
            store.chunks.extent(j).stop - store.chunks.extent(j).start
        ):
            carry(path, i, store.path, j)
            assert store.damaged(checksums=False) == [j], "seen without reading the chunk"
            with pytest.raises(StoreError, match="is damaged"):
                store.read(j)
            compute(store.path, make=SMALL)
            assert contents(store.path) == undisturbed, (path, i, j)
    (store.path / "artifacts/attractors.json").write_bytes(
        (other.path / "artifacts/attractors.json").read_bytes()
    )
    compute(store.path, make=SMALL)
    assert contents(store.path) == undisturbed


def test_all_chunks_permuted_are_all_found(tmp_path):
    store = compute(tmp_path / "map", make=FINE)
    intact = store.chunks.count - (store.chunks.cells % 2)
    for i in range(intact):
        carry(store.path, i, tmp_path / "shuffled", (i + 7) % intact)
    for file in (tmp_path / "shuffled" / "chunks").iterdir():
        file.replace(store.path / "chunks" / file.name)
    assert store.damaged() == list(range(intact))


def carry(source, i, target, j):
    """Copy the file of chunk i of one store to where another one has its chunk j."""
    place = target / "chunks" / f"{j}.chunk"
    place.parent.mkdir(parents=True, exist_ok=True)
    place.write_bytes((source / "chunks" / f"{i}.chunk").read_bytes())


# -- more than one process -------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("first", "second"),
    [
        (None, None),
        (None, (1, 2)),
        ((1, 2), None),
        ((1, 2), (1, 2)),
        ((1, 2), (3, 4)),
        ((0, 2), (2, 3)),
    ],
)
def test_second_writer_is_refused(first, second, processes, tmp_path):
    store = Store.create(tmp_path / "map", IDENTITY, **MAKE)
    ready, leave = processes.Queue(), processes.Event()
    holder = start(processes, hold, store.path, first, ready, leave)
    assert ready.get(timeout=20) == "held"
    with (
        pytest.raises(
            StoreError,
            match=rf"written by process {holder.pid} on \S+ since "
            rf"20\d\d-.*Wait for it",
        ),
        store.lock(second),
    ):
        pass
    assert len(store.status().writers) == 1
    leave.set()
    holder.join()
    with store.lock(second):
        assert store.status().writers[0].startswith(f"process {os.getpid()} on")


@posix
def test_a_lock_ends_with_its_process(processes, tmp_path):
    store = Store.create(tmp_path / "map", IDENTITY, **MAKE)
    ready, leave = processes.Queue(), processes.Event()
    holder = start(processes, hold, store.path, None, ready, leave)
    assert ready.get(timeout=20) == "held"
    holder.kill()
    holder.join()
    with store.lock():
        pass


@posix
def test_a_child_neither_writes_under_its_parents_lock_nor_keeps_it(processes, tmp_path):
    store = Store.create(tmp_path / "map", IDENTITY, **MAKE)
    ready = processes.Queue()
    holder = start(processes, hold_and_fork, store.path, ready)
    child, answer = ready.get(timeout=20)
    assert "isn't locked by this process" in answer
    with pytest.raises(StoreError), store.lock():
        pass
    holder.kill()
    holder.join()
    os.kill(child, 0)  # it is alive
    with store.lock():
        pass
    os.kill(child, signal.SIGKILL)


def test_shards_at_once_are_one_map(processes, undisturbed, tmp_path):
    """Three processes race to make the store, each computes its shard, one of them backwards."""
    path = tmp_path / "map" / "map"
    path.parent.mkdir()
    shards = [
        start(processes, compute, path, (k, 3), order, 0.01) for k, order in enumerate((1, -1, 1))
    ]
    for shard in shards:
        shard.join()
        assert shard.exitcode == 0
    store = Store.open(path)
    assert store.done().all()
    assert contents(path) == undisturbed
    np.testing.assert_array_equal(store.read_all()["peak"], np.sin(np.arange(77)) * 1e-3)
