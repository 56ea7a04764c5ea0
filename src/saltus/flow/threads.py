"""Independent pieces of work on threads, with Ctrl-C between them."""

from __future__ import annotations

import _signal  # signal without its enumerations, which cost a tenth of a short run
import contextlib
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager, nullcontext
from contextvars import copy_context
from typing import Any, TypeVar

from saltus.interrupt import Stop, check_stop

Item = TypeVar("Item")
Result = TypeVar("Result")
_CTRL_C = int(signal.SIGINT)


def usable_processors() -> int:
    """Processors that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def on_threads(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    done: Callable[[Item, Result], None],
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
    stop: Stop | None = None,
    every: float = 0.1,
) -> None:
    """Call ``work(item)`` for every item, and ``done(item, result)`` from this thread as each is
    ready, in any order. ``progress(share)`` is called from this thread too, after ``every`` seconds
    at most.

    Raises whatever a piece raises. On that, and on Ctrl-C, ``stop`` is set, pieces under way are
    waited for and the rest is left. What a piece calls asks ``stop`` too, threads of its own
    included, so that pieces end at once; they raise Interrupted then. The caller's context holds in
    the threads too, such as its settings of NumPy. A single piece without progress is done by this
    very thread: Newton's method asks for thousands of them, each shorter than it takes to make a
    thread.
    """
    stop = stop or Stop()

    def run_item(item: Item) -> tuple[Item, Result] | None:
        stop.hold()
        return None if stop.is_set() else (item, work(item))

    handler = _ctrl_c_of(stop)
    if len(items) == 1 and progress is None and _is_ours(handler):
        with _ctrl_c_asks(stop) if handler is signal.default_int_handler else nullcontext():
            result = copy_context().run(run_item, items[0])
        if result is not None:
            done(*result)
        check_stop()
        return
    with (
        _OneThread()
        if len(items) == 1
        else ThreadPoolExecutor(min(threads or usable_processors(), max(len(items), 1))) as pool
    ):
        waiting: set[Future[Any]] = set()
        try:
            waiting |= {pool.submit(copy_context().run, run_item, item) for item in items}
            while waiting:
                ready, waiting = wait(waiting, timeout=every, return_when=FIRST_COMPLETED)
                for result in (future.result() for future in ready):
                    if result is not None:  # None: left out, because the work is to stop
                        done(*result)
                if progress:
                    progress(1.0 - len(waiting) / len(items))
                check_stop()
        except BaseException:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def may_wait(stop: Stop) -> bool:
    """True if Ctrl-C can wait until a piece of work in this thread has ended: wherever no handler
    of the user's is installed.
    """
    return _is_ours(_ctrl_c_of(stop))


def _ctrl_c_of(stop: Stop) -> Any:
    """The handler of Ctrl-C during this thread's work; None where it doesn't arrive."""
    if stop.inside or threading.current_thread() is not threading.main_thread():
        return None
    return _signal.getsignal(_CTRL_C)


def _is_ours(handler: Any) -> bool:
    return handler is signal.default_int_handler or not callable(handler)


@contextmanager
def _ctrl_c_asks(stop: Stop) -> Iterator[None]:
    """Delay Ctrl-C to the end of the block, and ask the work to stop. Raised inside the block it
    would cut a table of contacts in two.
    """
    pressed = False

    def note(*_: object) -> None:
        nonlocal pressed
        pressed = True
        stop.set()

    _signal.signal(_CTRL_C, note)
    try:
        yield
    finally:
        _signal.signal(_CTRL_C, signal.default_int_handler)
    if pressed:
        raise KeyboardInterrupt


class _OneThread(Executor):
    """A thread for a single piece of work. A pool takes three times as long to make and to end,
    which a single trajectory would feel.
    """

    _thread: threading.Thread | None = None

    def submit(self, function: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Start the piece."""
        future: Future[Any] = Future()

        def run() -> None:
            try:
                future.set_result(function(*args, **kwargs))
            except BaseException as error:
                future.set_exception(error)

        self._thread = threading.Thread(target=run)
        self._thread.start()
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: ARG002  (it has begun already)
        """Wait for the piece to end."""
        if wait and self._thread is not None:
            with contextlib.suppress(RuntimeError):  # Ctrl-C came before it was started
                self._thread.join()
