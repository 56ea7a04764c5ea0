"""A line before a kernel is compiled: its purpose, and how long it takes."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar


def _to_stderr(text: str) -> None:
    sys.stderr.write(f"saltus: {text}\n")
    sys.stderr.flush()


_WRITE: ContextVar[Callable[[str], None]] = ContextVar("write", default=_to_stderr)


@contextmanager
def announcing_to(write: Callable[[str], None]) -> Iterator[None]:
    """A context in which sentences about compiling go to ``write``; by default they go to standard
    error.
    """
    token = _WRITE.set(write)
    try:
        yield
    finally:
        _WRITE.reset(token)


@contextmanager
def silent() -> Iterator[None]:
    """A context without sentences about compiling."""
    with announcing_to(lambda _: None):
        yield


def announce(what: str, seconds: float) -> None:
    """Announce a compilation, and its duration on a quiet machine [s]."""
    _WRITE.get()(f"compiling {what}, about {seconds:.0f} s")
