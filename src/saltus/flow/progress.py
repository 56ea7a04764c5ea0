"""Progress of long work: a callable of the user's, a bar on a terminal, or lines elsewhere. Bar and
lines appear only if the work lasts, and then also where no share of it is reported.
"""

from __future__ import annotations

import math
import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.errors import ParameterError
from saltus.interrupt import heartbeat

if TYPE_CHECKING:
    from rich.progress import Progress

#: Time without a report after which the last one is shown again [s].
BEAT = 0.5


@contextmanager
def reporting(
    progress: bool | Callable[[float], None] | None,
) -> Iterator[Callable[[float], None] | None]:
    """A context with the progress callable: the user's own, a bar after two seconds on a terminal,
    lines elsewhere.

    Raises ParameterError if it is neither a callable, nor True, False or None.
    """
    if not (callable(progress) or progress is None or isinstance(progress, bool | np.bool_)):
        raise ParameterError(
            f"progress must be True, False or a function of the share done, not {progress!r:.80}."
        )
    if callable(progress):
        with _alive(progress) as show:
            yield show
    elif progress is not None and not progress:
        yield None
    elif progress is None and not os.isatty(2) and not in_notebook():
        with _alive(LogLines(_to_stderr).show) as show:
            yield show
    else:
        bar = _NotebookBar() if in_notebook() else _Bar()
        try:
            with _alive(bar.show) as show:
                yield show
        finally:
            bar.close()


@contextmanager
def _alive(show: Callable[[float], None]) -> Iterator[Callable[[float], None]]:
    """``show``, which is called with the last share again while none is reported."""
    last, shown = 0.0, time.monotonic()

    def report(share: float) -> None:
        nonlocal last, shown
        last, shown = share, time.monotonic()
        show(share)

    def beat() -> None:
        if time.monotonic() - shown > BEAT:
            report(last)

    with heartbeat(beat):
        yield report


def stage(
    show: Callable[[float], None] | None, begin: float, end: float
) -> Callable[[float], None] | None:
    """Progress of one stage as a part of the whole."""
    return None if show is None else lambda share: show(begin + (end - begin) * share)


def _to_stderr(text: str) -> None:
    sys.stderr.write(f"saltus: {text}\n")
    sys.stderr.flush()


class LogLines:
    """Lines for a log: once the work lasts, at 25, 50 and 75 %, and at least one in five minutes.

    Parameters
    ----------
    write : callable
        Called with each line.
    clock : callable
        The time [s].
    """

    PATIENCE, EVERY = 2.0, 300.0

    def __init__(
        self, write: Callable[[str], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._write, self._clock = write, clock
        self._begun, self._written = clock(), -math.inf
        self._passed = 0
        self._first: tuple[float, float] | None = None

    def show(self, share: float) -> None:
        """Write the share done, if a line is due."""
        now, quarter = self._clock(), int(4 * share)
        if self._first is None:
            self._first = now, share
        if (
            share >= 1.0
            or now - self._begun < self.PATIENCE
            or (quarter <= self._passed and now - self._written < self.EVERY)
        ):
            return
        since, before = self._first  # the time before, such as compiling, doesn't count
        left = (now - since) * (1 - share) / (share - before) if share > before else None
        self._passed, self._written = max(quarter, self._passed), now
        self._write(
            f"{share:.0%} done in {now - self._begun:.0f} s"
            + (f", about {left:.0f} s left" if left is not None else "")
        )


def in_notebook() -> bool:
    """True in a notebook, which shows outputs below cells."""
    ipython = sys.modules.get("IPython")
    return ipython is not None and hasattr(ipython.get_ipython(), "kernel")


class _NotebookBar:
    """A bar below a cell that appears only if the work lasts, and is removed at the end."""

    PATIENCE, EVERY = 2.0, 0.2

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._begun = self._shown = clock()
        self._output: Any = None

    def show(self, share: float) -> None:
        """Show the share done, once patience has run out."""
        now = self._clock()
        if now - self._begun < self.PATIENCE or now - self._shown < self.EVERY:
            return
        self._shown = now
        text = f"integrating: {share:.0%} in {now - self._begun:.0f} s"
        self._put(
            {
                "text/plain": text,
                "text/html": f'<progress value="{share:.4f}"></progress> <small>{text}</small>',
            }
        )

    def close(self) -> None:
        """Remove the bar."""
        if self._output is not None:
            self._put({})

    def _put(self, content: dict[str, str]) -> None:
        from IPython.display import display

        if self._output is None:
            self._output = display(content, raw=True, display_id=True)
        else:
            self._output.update(content, raw=True)


class _Bar:
    """A rich progress bar that appears only if the work lasts."""

    PATIENCE = 2.0

    def __init__(self) -> None:
        self._begun = time.monotonic()
        self._bar: Progress | None = None

    def show(self, share: float) -> None:
        """Show the share done, once patience has run out."""
        if self._bar is None:
            if time.monotonic() - self._begun < self.PATIENCE:
                return
            from rich.console import Console
            from rich.progress import (
                BarColumn,
                Progress,
                TextColumn,
                TimeElapsedColumn,
                TimeRemainingColumn,
            )

            columns = (
                TextColumn("integrating"),
                BarColumn(),
                TextColumn("{task.percentage:>3.0f} %"),
                TimeElapsedColumn(),
                TimeRemainingColumn(),
            )
            self._bar = Progress(*columns, console=Console(stderr=True), transient=True)
            self._bar.add_task("", total=1.0)
            self._bar.start()
        self._bar.update(self._bar.task_ids[0], completed=share)

    def close(self) -> None:
        """Remove the bar."""
        if self._bar is not None:
            self._bar.stop()
