"""One thread of linear algebra while a verb runs."""

import subprocess
import sys
import threading

import pytest
import threadpoolctl

from saltus.analysis.inputs.verb import verb


def threads() -> set[int]:
    """How many threads each library of linear algebra may take."""
    return {
        library["num_threads"]
        for library in threadpoolctl.threadpool_info()
        if library["user_api"] == "blas"
    }


def allow(number: int) -> None:
    """Set the number on a thread that ends, since a thread that lives would own it."""
    setting = threading.Thread(target=threadpoolctl.threadpool_limits, args=(number, "blas"))
    setting.start()
    setting.join()


def test_a_verb_that_outlasts_another_one_leaves_the_threads_as_they_were():
    """The second verb begins while one thread is allowed. That isn't what it leaves behind."""
    second_runs, first_ended = threading.Event(), threading.Event()
    within = []

    @verb
    def second() -> None:
        second_runs.set()
        assert first_ended.wait(60)

    other = threading.Thread(target=second)

    @verb
    def first() -> None:
        other.start()
        assert second_runs.wait(60)
        within.append(threads())

    found = max(threads())
    allow(2)
    try:
        first()
        after_first = threads()
        first_ended.set()
        other.join(60)
        assert (within, after_first, threads()) == ([{1}], {2}, {2})
    finally:
        allow(found)


WHILE_A_THREAD_LOADS = """
import _ctypes, importlib.util, threading
from saltus import blas_threads

library = importlib.util.find_spec("numpy._core._umath_tests").origin
ended = threading.Event()

def load():
    while not ended.is_set():
        _ctypes.dlclose(_ctypes.dlopen(library, 2))

loading = threading.Thread(target=load)
loading.start()
for _ in range(20):
    blas_threads._libraries.cache_clear()
    blas_threads._libraries(True)
ended.set()
loading.join()
"""


@pytest.mark.skipif(sys.platform == "win32", reason="dlopen is POSIX's")
def test_the_libraries_are_found_while_another_thread_imports():
    """threadpoolctl before 3.8 held the loader's lock and asked for Python's, which an import holds
    the other way round: `saltus demo` then waited for ever.
    """
    command = [sys.executable, "-c", WHILE_A_THREAD_LOADS]
    subprocess.run(command, check=True, timeout=60)
