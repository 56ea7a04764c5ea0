"""The command `saltus`. No logic here: read what was typed, call :mod:`saltus.study`, show the tables that it returns.

This module imports typer and nothing else that is heavy, so that ``saltus --help`` is there at once; each command imports what it needs.
"""

from __future__ import annotations

from saltus.cli.app import app


def main() -> None:
    """Entry point of the command."""
    app(prog_name="saltus")


__all__ = ["app", "main"]
