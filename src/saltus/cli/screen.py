"""The output of the commands: tables, notes, files, messages."""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.markup import escape
from rich.measure import Measurement
from rich.table import Table

from saltus.fence import printable

if TYPE_CHECKING:
    from saltus.results.table import TextTable
    from saltus.study.run.running import Report

#: Columns assumed if the output isn't a terminal: a table in a log file isn't cut.
LOG_WIDTH = 220


def console(stderr: bool = False) -> Console:
    """A console on the current standard output (or error)."""
    stream = sys.stderr if stderr else sys.stdout
    return Console(
        stderr=stderr,
        highlight=False,
        emoji=False,
        width=None if stream.isatty() else LOG_WIDTH,
        soft_wrap=False,
    )


def show(table: TextTable) -> None:
    """Print a table and its notes; row by row if the terminal is too narrow for it."""
    screen = console()
    screen.print(_plain(table.title), style="bold")
    grid = Table(
        show_header=any(table.columns),
        header_style="dim",
        box=None,
        pad_edge=False,
        padding=(0, 2, 0, 0),
    )
    for number, column in enumerate(table.columns):
        numeric = all(_is_number(row[number]) for row in table.rows if row[number])
        grid.add_column(_plain(column), justify="right" if numeric else "left", no_wrap=True)
    for row in table.rows:
        grid.add_row(*map(_plain, row))
    if (
        Measurement.get(screen, screen.options.update(max_width=10 * LOG_WIDTH), grid).maximum
        <= screen.width
    ):
        screen.print(grid)
    else:
        for row in table.rows:
            lines = [
                f"{column:>{max(map(len, table.columns))}}  {text}"
                for column, text in zip(table.columns, row, strict=True)
                if text
            ]
            screen.print(_plain("\n".join(lines)), end="\n\n")
    for note in table.notes:
        screen.print(_plain(note), style="dim")


def say(text: str) -> None:
    """Print a line unchanged."""
    console().print(_plain(text))


def files(paths: Iterable[Path]) -> None:
    """Print the paths of written files."""
    for path in paths:
        say(f"wrote {path}")


def fail(text: str) -> None:
    """Print an error message to standard error."""
    console(stderr=True).print(f"[bold red]saltus:[/] {_plain(text)}")


@contextmanager
def working() -> Iterator[Callable[[float], None]]:
    """Show that something is being computed, and afterwards the time it took. Yields a function of
    the share done.
    """
    begin = time.perf_counter()
    with console(stderr=True).status("working ...") as status:
        yield lambda share: status.update(f"integrating, {share:.0%} ...")
    say(f"computed in {time.perf_counter() - begin:.1f} s")


@contextmanager
def reporting(kind: str) -> Iterator[tuple[Callable[[Report], None], Callable[[str], None]]]:
    """Show the progress of questions. Yields a function of a report, and one of a sentence.

    ``kind`` "bar" shows a line that changes, "json" prints a JSON object a line to standard error,
    "none" nothing.
    """
    begin, shown = time.perf_counter(), [0.0]
    if kind == "bar":
        with console(stderr=True).status("working ...") as status:
            yield (
                (lambda report: status.update(_progress_text(report)))
                if sys.stderr.isatty()
                else _log_lines(),
                say,
            )
        say(f"computed in {time.perf_counter() - begin:.1f} s")
        return

    def report_json(report: Report) -> None:
        now = time.perf_counter()
        if kind == "json" and (now - shown[0] > 1.0 or report.last):
            shown[0] = now
            left = report.seconds_left
            fields = {
                "question": report.name,
                "done": report.done,
                "total": report.total,
                "seconds": report.seconds,
                "seconds_left": left,
            }
            print(json.dumps(fields), file=sys.stderr, flush=True)  # noqa: T201

    def note_json(text: str) -> None:
        if kind == "json":
            print(json.dumps({"note": text}), file=sys.stderr, flush=True)  # noqa: T201

    from saltus.announce import announcing_to

    with announcing_to(note_json):
        yield report_json, say if kind != "json" else lambda _: None


def _log_lines() -> Callable[[Report], None]:
    """A function of reports for standard error in a log: a line now and then for each question."""
    from saltus.flow.progress import LogLines

    lines: dict[str, LogLines] = {}

    def report(report: Report) -> None:
        name = report.name
        if name not in lines:
            lines[name] = LogLines(
                lambda text: console(stderr=True).print(escape(f"saltus: {name}: {text}"))
            )
        lines[name].show(report.done / max(report.total, 1))

    return report


def _progress_text(report: Report) -> str:
    left = report.seconds_left
    if report.what == "%":
        return _plain(
            f"{report.name}: {report.done} %{f', {left:.0f} s left' if left is not None else ''}"
        )
    rate = (
        f", {report.computed / report.seconds:.1f} chunks a second, {left:.0f} s left"
        if left is not None and report.seconds > 0
        else ""
    )
    return _plain(f"{report.name}: {report.done} of {report.total} chunks{rate}")


def _plain(text: str) -> str:
    """A text that is shown unchanged: without markup, and without characters that a terminal
    obeys.
    """
    return escape(printable(text))


def _is_number(text: str) -> bool:
    return text == "-" or text.lstrip("+-")[:1].isdigit()
