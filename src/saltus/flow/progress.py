"""Progress of long work: a callable of the user's, or a bar that appears only if the work lasts."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress


def reporter(progress: bool | Callable[[float], None] | None) -> tuple[Callable[[float], None] | None, Callable[[], None]]:
    """A progress callable and what to call at the end: the user's own, a bar after two seconds on a terminal, or nothing."""
    if callable(progress):
        return progress, lambda: None
    if progress is False or (progress is None and not os.isatty(2)):
        return None, lambda: None
    bar = _Bar()
    return bar.show, bar.close


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
            from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

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
        """Take the bar away."""
        if self._bar is not None:
            self._bar.stop()
