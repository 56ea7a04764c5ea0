"""The application without its commands, which register on it, and the handling of errors and
Ctrl-C.
"""

from __future__ import annotations

import errno
import functools
import os
import warnings
from typing import Any

import typer
from typer.core import TyperGroup

from saltus.errors import SaltusError, SaltusWarning
from saltus.interrupt import EXIT_CODE

#: Exit code if the task can't be done as asked.
REFUSED = 2


def _sentence(
    message: Any, category: Any, filename: Any, lineno: Any, line: Any = None, usual: Any = None
) -> str:
    """A warning as text: of saltus's own the sentence alone, without a place in its code."""
    if issubclass(category, SaltusWarning):
        return f"saltus: {message}\n"
    return str(usual(message, category, filename, lineno, line))


class Commands(TyperGroup):
    """Runs a command; ends saltus's own errors, and Ctrl-C, with a message instead of a
    traceback.
    """

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        usual = warnings.formatwarning
        warnings.formatwarning = functools.partial(_sentence, usual=usual)
        try:
            return self._ended(ctx)
        finally:
            warnings.formatwarning = usual

    def _ended(self, ctx: Any) -> Any:
        from saltus.cli import screen

        try:
            return super().invoke(ctx)
        except SaltusError as error:
            screen.fail(str(error))
            raise typer.Exit(REFUSED) from None
        except BrokenPipeError:  # `saltus models | head`
            raise
        except OSError as error:
            # standard output was closed meanwhile: nobody reads on, as with a pipe
            if error.errno == errno.EBADF and not error.filename:
                raise BrokenPipeError(errno.EPIPE, os.strerror(errno.EPIPE)) from None
            # a library that can't be loaded, not a file that can't be written
            if error.errno is None:
                screen.fail(str(error))
            else:
                screen.fail(
                    f"{error.filename or 'a file'}: {error.strerror or error}. Choose "
                    f"another folder, or free some space."
                )
            raise typer.Exit(REFUSED) from None
        except MemoryError as error:
            why = f" ({error})" if str(error) else ""
            screen.fail(
                f"memory is used up{why}. Ask for fewer starts, samples or cells, or take "
                f"--threads 1."
            )
            raise typer.Exit(REFUSED) from None
        except KeyboardInterrupt:
            screen.fail(
                "stopped. Files are written in full or not at all: none is left half-written."
            )
            raise typer.Exit(EXIT_CODE) from None


app = typer.Typer(
    cls=Commands,
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
    help="Vibration with contacts, to machine precision: freeplay, backlash, stops.\n\nStart with "
    "`saltus demo`.",
)


@app.callback(invoke_without_command=True)
def version(
    version: bool = typer.Option(False, "--version", help="Print the version and stop."),
) -> None:
    """Print the version if asked for."""
    if version:
        from importlib import metadata

        typer.echo(f"saltus {metadata.version('saltus')}")
        raise typer.Exit
