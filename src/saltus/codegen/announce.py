"""A line before a kernel is compiled: people who wait want to know what for, and for how long."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar


def _to_stderr(text: str) -> None:
    sys.stderr.write(f"saltus: {text}\n")
    sys.stderr.flush()


_TELL: ContextVar[Callable[[str], None]] = ContextVar("tell", default=_to_stderr)


@contextmanager
def telling(tell: Callable[[str], None]) -> Iterator[None]:
    """Within, sentences about compiling go to this callable; by default they are lines on standard error."""
    token = _TELL.set(tell)
    try:
        yield
    finally:
        _TELL.reset(token)


@contextmanager
def silent() -> Iterator[None]:
    """Within, nothing is said about compiling."""
    with telling(lambda _: None):
        yield


def announce(what: str, seconds: float) -> None:
    """Say what is going to be compiled and how often that happens, and how long it takes on a quiet machine."""
    _TELL.get()(f"compiling {what}, about {seconds:.0f} s")
