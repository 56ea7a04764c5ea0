"""The command `saltus`. No logic here: read what was typed, call :mod:`saltus.study`, show the
tables that it returns.

This module imports typer and nothing else that is heavy, so that ``saltus --help`` is there at
once; each command imports its own modules.
"""

from __future__ import annotations

import os
import sys

from saltus.interrupt import EXIT_CODE, ctrl_c_waits, no_ctrl_c_is_lost


def main() -> None:
    """Entry point of the command. Ctrl-C ends it with a word wherever it comes, while modules are
    imported too.
    """
    _replace_closed_streams()
    # pictures go to files; a window needs what a terminal may not have
    os.environ["MPLBACKEND"] = "Agg"
    try:
        with no_ctrl_c_is_lost():
            with ctrl_c_waits():
                from saltus.cli.commands import app
            app(prog_name="saltus")
    except KeyboardInterrupt:
        sys.stderr.write("saltus: stopped.\n")
        sys.exit(EXIT_CODE)


def _replace_closed_streams() -> None:
    """Discard output to a closed standard stream (``>&-``); else the next file opened would take
    its place.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            setattr(sys, name, open(os.devnull, "w" if number else "r", encoding="utf-8"))  # noqa: SIM115  (takes the lowest number: this one)


__all__ = ["main"]
