"""The command `saltus explore`."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from saltus.cli.app import app
from saltus.errors import ParameterError

if TYPE_CHECKING:
    from saltus.explore.desk import Desk
    from saltus.system import System


@app.command()
def explore(
    what: Annotated[
        str,
        typer.Argument(
            help="A model, a study file, the folder of its results, or FILE.py:NAME, which runs "
            "that file. Leave it out to choose a model on the page."
        ),
    ] = "",
    values: Annotated[
        list[str] | None, typer.Argument(help="Values of a model: NAME=VALUE, with units.")
    ] = None,
    system: Annotated[
        str, typer.Option(help="The system of your own that a study is about: FILE.py:NAME.")
    ] = "",
    browser: Annotated[bool, typer.Option(help="Open the page in the browser.")] = True,
    until_closed: Annotated[
        bool, typer.Option("--until-closed", help="End a minute after the last page was closed.")
    ] = False,
    threads: Annotated[
        int | None, typer.Option(min=1, help="Threads of a map; by default one for each core.")
    ] = None,
) -> None:
    """Explore a system in the browser: click a start, drag a parameter, follow a branch.

    The page is served on this machine alone, to whoever has its address. From another machine use
    ssh: `ssh -L PORT:127.0.0.1:PORT HOST`, and open the address that is printed there. Ctrl-C ends
    it.

    Example: `saltus explore delangre case=b force="4 N"`

    Example: `saltus explore my_study.toml`

    Example: `saltus explore my_rig.py:rig`
    """
    from saltus.cli import screen
    from saltus.explore import opened
    from saltus.explore.desk import Models

    known: dict[str, Desk] = {}

    def model(name: str) -> Desk:
        if name not in known:
            known[name] = _desk(_model(name, []), threads)
        return known[name]

    if what:
        desk = _desk_of(what, values or [], system, threads)
        explorer = opened(desk, browser=browser, framed_by=())
    else:
        explorer = opened(Models(), model, browser=browser, framed_by=())
    screen.say(explorer.url)
    explorer.wait(until_closed)


def _desk_of(what: str, values: list[str], system: str, threads: int | None) -> Desk:
    """The desk of what stands on the command line."""
    from saltus.cli.own_system import own_system
    from saltus.explore.desk import Desk

    path = Path(what)
    if ".py" in path.suffix:
        _no_values(what, values)
        return _desk(own_system(what), threads, what)
    if path.is_dir() or path.suffix == ".toml":
        from saltus.explore.studies import desk_of_results, opening_of_study

        _no_values(what, values)
        own = own_system(system) if system else None
        desk = (
            desk_of_results(path, own, threads)
            if path.is_dir()
            else Desk(opening_of_study(path, own), threads)
        )
        desk.opening = replace(desk.opening, file=system)
        return desk
    return _desk(_model(what, values), threads)


def _no_values(what: str, values: list[str]) -> None:
    if values:
        raise ParameterError(f"{what} brings its own values: leave out {' '.join(values)}.")


def _model(name: str, values: list[str]) -> System:
    from saltus.models import find

    given: dict[str, Any] = {}
    for one in values:
        key, equals, value = one.partition("=")
        if not equals:
            raise ParameterError(f"{one}: write NAME=VALUE, such as force='4 N'.")
        try:
            given[key] = float(value)
        except ValueError:
            given[key] = value
    return find(name)(**given)


def _desk(system: System, threads: int | None, file: str = "") -> Desk:
    from saltus.explore.desk import Desk
    from saltus.explore.opening import opening_of

    return Desk(opening_of(system, file=file), threads)
