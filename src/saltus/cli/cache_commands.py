"""The commands of `saltus cache`."""

from __future__ import annotations

from typing import Annotated

import typer

#: The commands of `saltus cache`.
cache = typer.Typer()


@cache.callback(invoke_without_command=True)
def cache_by_default(context: typer.Context) -> None:
    """Show or clear the kernels compiled so far.

    Example: `saltus cache`

    Example: `saltus cache clear`
    """
    if context.invoked_subcommand is None:
        cache_show()


@cache.command("show")
def cache_show() -> None:
    """List the compiled kernels, and where they are.

    Example: `saltus cache show`
    """
    from saltus import cache as entries
    from saltus.cli import screen
    from saltus.results.table import TextTable

    rows = tuple(
        (entry.name[:12], entry.system, f"{entry.size_bytes / 1e6:.2f}")
        for entry in entries.kernels()
    )
    screen.show(TextTable(f"Kernels in {entries.folder()}", ("entry", "system", "MB"), rows))


@cache.command("clear")
def cache_clear(
    everything: Annotated[
        bool, typer.Option("--all", help="Forget too which result files saltus wrote here.")
    ] = False,
) -> None:
    """Delete the compiled kernels. They are built again when they are needed.

    The folder also knows the checksums of the result files that saltus wrote here, so that they are
    loaded at once. They stay: a file whose checksum is forgotten is read by another process first,
    which takes some tenths of a second. With --all they go too.

    Example: `saltus cache clear`
    """
    from saltus import cache as entries
    from saltus.cli import screen
    from saltus.errors import counted
    from saltus.results.files import known

    count = entries.clear()
    screen.say(f"deleted {counted(count, 'entry')} from {entries.folder()}")
    if everything:
        screen.say(f"forgot {counted(known.forget(), 'result file')}")
    elif left := known.count():
        screen.say(
            f"kept the checksums of {counted(left, 'result file')}, which are loaded at once; "
            f"--all forgets them"
        )
