"""Objects from the cache, or compiled: in this process if that is quick, in another one if it takes
long, so that Ctrl-C ends the wait.
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import json
import os
import subprocess
import sys
import tempfile
import threading
import weakref
from collections import OrderedDict, defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from saltus import cache
from saltus.announce import announce
from saltus.codegen import machine, templates
from saltus.codegen.asker import PARENT_ID
from saltus.errors import CacheError
from saltus.interrupt import check_stop, ctrl_c_waits

#: Time between two checks for a stop [s].
CHECK_INTERVAL = 0.1
#: Announced times of LLVM [s]: for a million characters of an equation, for a template, and for
#: lowering templates.
SECONDS_PER_MEGABYTE, SECONDS_OF_TEMPLATE, SECONDS_OF_LOWERING = 0.35, 2.5, 20.0
#: Estimated times [s] above which another process compiles, and above which a compilation is
#: announced.
OTHER_PROCESS, ANNOUNCEMENT = 0.5, 1.0
#: Most objects in memory.
_MAX_OBJECTS = 32

_COMPILING: weakref.WeakSet[subprocess.Popen[bytes]] = weakref.WeakSet()
#: One lock for each object.
_LOCKS: defaultdict[str, threading.Lock] = defaultdict(threading.Lock)
_OBJECTS: OrderedDict[str, bytes] = OrderedDict()


@dataclass(frozen=True)
class BuildOrder:
    """An object to be built.

    Attributes
    ----------
    template : str
        Name of the bitcode in it, "" if there is none.
    texts : tuple of str
        LLVM IR in it.
    called : tuple of str
        Its symbols that others use.
    title : str
        Its title in `saltus cache`.
    said : str
        What is said to be compiled, if it takes long; "" to say nothing.
    open_sizes : bool
        See :func:`saltus.codegen.machine.object_code`.
    """

    template: str
    texts: tuple[str, ...]
    called: tuple[str, ...]
    title: str
    said: str
    open_sizes: bool = False

    @cached_property
    def key(self) -> str:
        """Name of the entry: a hash of everything that the machine code depends on."""
        made_of = templates.identity(self.template) if self.template else ""
        parts = [
            made_of,
            *self.texts,
            *self.called,
            str(self.open_sizes),
            *machine.target(),
            *machine.versions(),
        ]
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:32]

    @property
    def seconds(self) -> float:
        """Estimated time to build it on a quiet machine [s]."""
        return sum(map(len, self.texts)) / 1e6 * SECONDS_PER_MEGABYTE + (
            SECONDS_OF_TEMPLATE if self.template in _SLOW else 0.0
        )


_SLOW = frozenset(name for name in templates.BITCODE if name != "capture")


def built(order: BuildOrder) -> bytes:
    """The object of an order: from memory, from the cache, or compiled now.

    Raises
    ------
    CacheError
        If the process that compiles is killed.
    Interrupted
        If the work that this thread does a part of was asked to stop.
    """
    with _held(_LOCKS[order.key]):
        found = _OBJECTS.get(order.key)
        if found is None:
            found = cache.read(order.key)
        if found is None:
            if order.said and order.seconds > ANNOUNCEMENT:
                announce(order.said, order.seconds)
            found = (_made_elsewhere(order) if order.seconds > OTHER_PROCESS else None) or made(
                order
            )
            cache.keep(order.key, order.title, found)
        _OBJECTS[order.key] = found
        while len(_OBJECTS) > _MAX_OBJECTS:
            _OBJECTS.popitem(last=False)
        return found


def built_to_keep(order: BuildOrder) -> bytes:
    """The object as from :func:`built`, compiled by a process that outlives this one. An object
    that took long is then on disk for the next process.
    """
    with _held(_LOCKS[order.key]):
        found = _OBJECTS.get(order.key) or cache.read(order.key)
        if found is None:
            _kept_elsewhere(order)
            found = cache.read(order.key)
    return built(order) if found is None else found


def made(order: BuildOrder) -> bytes:
    """Compile in this process."""
    template = bitcode(order.template) if order.template else None
    return machine.object_code(
        template, order.texts, frozenset(order.called), open_sizes=order.open_sizes
    )


def bitcode(name: str) -> bytes:
    """The templates' bitcode: that of the package, or bitcode made now if the templates were edited
    since.

    Raises
    ------
    CacheError
        If it would have to be made, and can't.
    """
    if templates.is_current(name):
        return templates.bitcode(name)
    key = templates.source_hash(name)[:32]
    found = cache.read(key)
    if found is None:
        announce(
            f"the templates, which were edited since {name}.bc.xz was made: once",
            SECONDS_OF_LOWERING,
        )
        found = _answer_of(
            "saltus.codegen.lowering", ("--print", name), b"", f"{name} from the templates"
        )
        if found is None:
            raise CacheError(
                f"saltus/kernels was edited since its bitcode {name}.bc.xz was made. Making it "
                f"needs Numba: pip install 'saltus[build]', "
                "then python -m saltus.codegen.lowering."
            )
        cache.keep(key, f"{name}, bitcode", found)
    return found


@contextmanager
def _held(lock: threading.Lock) -> Iterator[None]:
    """Hold a lock; a request to stop ends the wait for it."""
    while not lock.acquire(timeout=CHECK_INTERVAL):
        check_stop()
    try:
        yield
    finally:
        lock.release()


def _made_elsewhere(order: BuildOrder) -> bytes | None:
    """Compile in a process of its own (build_one.py); None if there is none, or it doesn't succeed.

    LLVM can't be stopped while it works. Here this process only waits: Ctrl-C ends the wait at
    once.

    Raises
    ------
    CacheError
        If the process was killed.
    Interrupted
        If the work that this thread does a part of was asked to stop.
    """
    return _answer_of("saltus.codegen.build_one", (), _given(order), order.title)


def _kept_elsewhere(order: BuildOrder) -> None:
    """Compile and store in a process of its own, which nobody ends; return when it has ended."""
    with contextlib.suppress(OSError), tempfile.TemporaryFile() as file:
        file.write(_given(order))
        file.seek(0)
        process = subprocess.Popen(
            [sys.executable, "-P", "-m", "saltus.codegen.build_one", order.key, order.title],
            stdin=file, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            env=_environment(), start_new_session=True,
        )  # fmt: skip
        process.wait()


def _given(order: BuildOrder) -> bytes:
    """An order as build_one.py reads it."""
    if order.template:
        bitcode(order.template)  # made first if it isn't current
    target = machine.target()
    return json.dumps(
        [order.template, order.texts, order.called, target, order.open_sizes]
    ).encode()


def _environment() -> dict[str, str]:
    """The environment of a process that imports this saltus."""
    path = os.pathsep.join(
        [str(Path(__file__).parents[2]), *filter(None, [os.environ.get("PYTHONPATH")])]
    )
    return {**os.environ, "PYTHONPATH": path}


def _answer_of(module: str, options: tuple[str, ...], given: bytes, title: str) -> bytes | None:
    """The output of a module that another process runs on these bytes; None if there is no process,
    or it doesn't succeed.
    """
    environment = {**_environment(), PARENT_ID: str(os.getpid())}
    process: subprocess.Popen[bytes] | None = None
    try:
        # a pipe is full after 64 kB, and communicate() doesn't go on filling it after a timeout
        with tempfile.TemporaryFile() as file:
            file.write(given)
            file.seek(0)
            with ctrl_c_waits():  # half started, nobody would end it and close its pipe
                process = subprocess.Popen(
                    # -P: no modules from the working folder
                    [sys.executable, "-P", "-m", module, *options],
                    stdin=file,
                    stdout=subprocess.PIPE,
                    stderr=subprocess.DEVNULL,
                    env=environment,
                    start_new_session=True,  # Ctrl-C is for this process
                )
                _COMPILING.add(process)
        data = _wait(process)
    except OSError:  # no processes here, or none that can be read
        return None
    finally:
        if process is not None:
            _end(process)
    if process.returncode < 0:
        raise CacheError(
            f"the process that compiled {title} was ended by signal {-process.returncode}, as when "
            f"memory runs out. Try again."
        )
    return data if process.returncode == 0 and data else None


def _wait(process: subprocess.Popen[bytes]) -> bytes:
    while True:
        try:
            data: bytes = process.communicate(timeout=CHECK_INTERVAL)[0]
            return data
        except subprocess.TimeoutExpired:
            check_stop()


def _end(process: subprocess.Popen[bytes]) -> None:
    """End the process, whatever has happened."""
    if process.poll() is None:
        process.kill()
        process.wait()
    if process.stdout is not None:
        with contextlib.suppress(OSError):
            process.stdout.close()
    _COMPILING.discard(process)


def end_all() -> None:
    """End all compiling processes when this process ends."""
    for process in list(_COMPILING):
        with contextlib.suppress(OSError):
            process.kill()


atexit.register(end_all)
