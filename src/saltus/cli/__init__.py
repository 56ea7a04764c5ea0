"""The command `saltus`. No logic here: read what was typed, call :mod:`saltus.study`, show the tables that it returns.

This module imports typer and nothing else that is heavy, so that ``saltus --help`` is there at once; each command imports what it needs.
"""

from __future__ import annotations

import os
import sys

from saltus.cli.app import app


def main() -> None:
    """Entry point of the command."""
    _replace_closed_streams()
    app(prog_name="saltus")


def _replace_closed_streams() -> None:
    """Let what is printed to a closed standard stream (``>&-``) go nowhere; else the next file that is opened would take its place."""
    for number, name in enumerate(("stdin", "stdout", "stderr")):
        try:
            os.fstat(number)
        except OSError:
            setattr(sys, name, open(os.devnull, "w" if number else "r", encoding="utf-8"))  # noqa: SIM115  (takes the lowest number: this one)


__all__ = ["app", "main"]
