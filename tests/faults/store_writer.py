"""What the writers in the tests of a store do: cheap values that follow from the number of the
chunk. Run in processes of their own.
"""

import os
import signal
import sys
import time
from pathlib import Path

import numpy as np

from saltus.results.store.store import Store

IDENTITY = {"study": "0a1b2c", "system": "rig", "version": "0.1.0"}
MAKE = {
    "shape": (7, 11),
    "chunk": 8,
    "arrays": {"basin": "i2", "peak": "f8", "settled": "?"},
    "note": {"title": "a test"},
}
SMALL = MAKE | {"shape": (4, 5), "arrays": {"basin": "i2", "peak": "f8"}}
FINE = MAKE | {"chunk": 2}
FINEST = MAKE | {"chunk": 1}


def values(store, index):
    """Values of a chunk; the last one is cut off at the end of the grid."""
    cells = np.arange(store.chunks.cells)[store.chunks.extent(index)]
    every = {
        "settled": cells % 3 == 0,
        "peak": np.sin(cells) * 1e-3,
        "basin": (cells**2 % 5 - 2).astype("i2"),
    }
    return {name: part for name, part in every.items() if name in store.chunks.arrays}


def compute(path, shard=None, order=1, pause=0.0, make=MAKE, most=None):
    """Resume the store and finish it, or a shard of it; or wait for an end after `most` chunks."""
    store = Store.create_or_resume(path, IDENTITY, **make)
    with store.lock(shard):
        store.verify()
        store.put("attractors", [[1.0, float("nan")], [2.0, -0.0]])
        for count, index in enumerate(store.missing(shard)[::order]):
            time.sleep(60.0 if count == most else pause)
            store.commit(index, values(store, index))
    return store


def hold(path, shard, ready, leave):
    """Hold a lock until told otherwise; tell what came of it."""
    try:
        with Store.open(path).lock(shard):
            ready.put("held")
            leave.wait(20)
    except OSError as error:
        ready.put(str(error))


def hold_and_fork(path, ready):
    """Hold a lock, with a child that tries to write under it and lives on."""
    store = Store.open(path)
    tried, tell = os.pipe()
    with store.lock():
        child = os.fork()
        if child == 0:
            try:
                store.commit(0, values(store, 0))
                os.write(tell, b"written")
            except OSError as error:
                os.write(tell, str(error).encode())
            time.sleep(20)
            os._exit(0)
        ready.put((child, os.read(tried, 1000).decode()))
        time.sleep(20)


def die_at(path, step):
    """Be killed at the n-th time that the writer touches the disk: before a file is opened,
    flushed, renamed, linked or removed.
    """
    watched = {
        "open",
        "os.rename",
        "os.mkdir",
        "os.remove",
        "os.rmdir",
        "os.truncate",
        "os.listdir",
    }
    prefix, count = str(Path(path)), 0

    def touch():
        nonlocal count
        if count == step:
            os.kill(os.getpid(), signal.SIGKILL)
        count += 1

    def hook(event, arguments):
        if (
            event in watched and any(prefix in str(argument) for argument in arguments[:2])
        ) or event == "os.truncate":
            touch()

    flush = os.fsync
    os.fsync = lambda handle: (touch(), flush(handle))[1]
    sys.addaudithook(hook)
    compute(path, make=SMALL)
