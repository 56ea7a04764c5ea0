"""The command `saltus`. It contains no logic: it reads the arguments, calls :mod:`saltus.study`,
and prints the tables that come back.

This module imports typer and nothing else that is heavy, so that ``saltus --help`` is there at
once; each command imports its own modules.
"""

from __future__ import annotations

import os
import sys

from saltus.interrupt import EXIT_CODE, ctrl_c_waits, no_ctrl_c_is_lost


def main() -> None:
    """Entry point of the command. Ctrl-C ends it with a word at any time, also during imports."""
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
    """Discard output to a closed standard stream (``>&-``); otherwise the next opened file would
    take its number.
    """
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            setattr(sys, name, open(os.devnull, "w" if number else "r", encoding="utf-8"))  # noqa: SIM115  (takes the lowest number: this one)


__all__ = ["main"]
