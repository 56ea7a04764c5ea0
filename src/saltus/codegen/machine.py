"""Machine code of a generated module as bytes: compiled here or in another process, and made into a module again.

A module is never imported from a path, and Numba's own files are never read: its text is compiled, and its one compiled function is
rebuilt, from bytes that the caller holds and has checked.
"""

from __future__ import annotations

import contextlib
import json
import marshal
import os
import pickle
import subprocess
import sys
import tempfile
import weakref
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

from saltus.errors import CacheError
from saltus.interrupt import check_stop

#: Time between two looks whether the work is to stop [s].
LOOK = 0.1
_COMPILING: weakref.WeakSet[subprocess.Popen] = weakref.WeakSet()


class _InHand:
    """Stands in Numba for the cache of one function: what it holds is rebuilt, what is compiled is held. See numba.core.caching.Cache."""

    cache_path = None

    def __init__(self, data: bytes | None):
        self.data = data

    def load_overload(self, _signature: Any, target_context: Any) -> Any:
        from numba.core.compiler import CompileResult

        target_context.refresh()
        return None if self.data is None else CompileResult._rebuild(target_context, *pickle.loads(self.data))

    def save_overload(self, _signature: Any, result: Any) -> None:
        from numba.core.serialize import dumps

        if not result.library.has_dynamic_globals:  # addresses of this process: of no use to another
            self.data = dumps(result._reduce())

    def enable(self) -> None:
        """Part of the interface."""

    def disable(self) -> None:
        """Part of the interface."""

    def flush(self) -> None:
        """Part of the interface."""


def _kept(cache: _InHand, signature: str, **options: Any) -> Callable[[Callable], Any]:
    """The decorator that generated modules know as ``kept``: compile a function for one signature, or take it from the cache."""
    from numba import njit

    def decorate(function: Callable) -> Any:
        dispatcher = njit(**options)(function)
        dispatcher._cache = cache
        dispatcher.compile(signature)
        dispatcher.disable_compile()
        return dispatcher

    return decorate


def compiled(name: str, source: str) -> tuple[ModuleType, bytes | None]:
    """Compile a module in this process; what :func:`rebuilt` makes it from, None if that can't be kept."""
    code = compile(source, f"<{name}>", "exec")
    cache = _InHand(None)
    module = _run(name, code, cache)
    return module, None if cache.data is None else pickle.dumps((marshal.dumps(code), cache.data))


def rebuilt(name: str, data: bytes) -> ModuleType:
    """The module that these bytes of :func:`compiled` stand for. They are code: whoever wrote them may do anything."""
    code, machine = pickle.loads(data)
    return _run(name, marshal.loads(code), _InHand(machine))


def _run(name: str, code: Any, cache: _InHand) -> ModuleType:
    module = ModuleType(name)
    module.__dict__["kept"] = partial(_kept, cache)
    sys.modules[name] = module  # Numba looks a function's module up by name
    try:
        exec(code, module.__dict__)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def compiled_elsewhere(name: str, source: str, title: str) -> bytes | None:
    """What :func:`compiled` gives, by a process of its own (build_one.py); None if there is none, or it doesn't succeed.

    Numba holds the interpreter while it compiles, and can lose a Ctrl-C in it. Here this process only waits: others of its threads go on,
    and Ctrl-C ends the wait at once.

    Raises
    ------
    CacheError
        If the process was killed.
    Interrupted
        If the work that this thread does a part of was asked to stop.
    """
    path = os.pathsep.join([str(Path(__file__).parents[2]), *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-P", "-m", "saltus.codegen.build_one"]  # -P: not what lies in the working folder
    try:
        with tempfile.TemporaryFile() as order:  # a pipe is full after 64 kB, and communicate() doesn't go on filling it after a timeout
            order.write(json.dumps({"name": name, "source": source}).encode())
            order.seek(0)
            process = subprocess.Popen(
                command, stdin=order, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env={**os.environ, "PYTHONPATH": path},
                start_new_session=True,  # Ctrl-C is for this process
            )  # fmt: skip
    except OSError:  # no processes here
        return None
    _COMPILING.add(process)
    try:
        data = _wait(process)
    finally:
        _end(process)
    if process.returncode < 0:
        raise CacheError(
            f"the process that compiled {title} was ended by signal {-process.returncode}, as when memory runs out. Try again."
        )
    return data if process.returncode == 0 and data else None


def _wait(process: subprocess.Popen) -> bytes:
    while True:
        try:
            return process.communicate(timeout=LOOK)[0]
        except subprocess.TimeoutExpired:
            check_stop()


def _end(process: subprocess.Popen) -> None:
    """Whatever has happened, leave no process behind."""
    if process.poll() is None:
        process.kill()
        process.wait()
    if process.stdout is not None:
        with contextlib.suppress(OSError):
            process.stdout.close()
    _COMPILING.discard(process)


def end_all() -> None:
    """End what still compiles when this process ends."""
    for process in list(_COMPILING):
        with contextlib.suppress(OSError):
            process.kill()
