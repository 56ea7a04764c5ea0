"""The commands. Each help has an example; each imports its modules when it runs."""

from __future__ import annotations

import shlex
import textwrap
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from saltus.cli.app import app as app
from saltus.cli.cache_commands import cache
from saltus.cli.explore_command import explore as explore
from saltus.errors import StudyError

if TYPE_CHECKING:
    from saltus.results.table import TextTable
    from saltus.study.run.running import Resources
    from saltus.study.setting.inputs import Inputs
    from saltus.study.tables.study import Study
    from saltus.system import System

app.add_typer(cache, name="cache")


class Case(StrEnum):
    """Gaps of the rig (lower, upper)."""

    a = "a"
    b = "b"
    c = "c"


class PictureKind(StrEnum):
    """Pictures of a result."""

    history = "history"
    phase = "phase"
    basins = "basins"
    agreement = "agreement"
    frequency_response = "frequency_response"
    bifurcation_diagram = "bifurcation_diagram"
    branches = "branches"
    backbone = "backbone"
    bifurcation_curves = "bifurcation_curves"
    periodic_orbits = "periodic_orbits"
    type_map = "type_map"
    amplitude_map = "amplitude_map"
    shares = "shares"
    section = "section"
    spectrum = "spectrum"
    impacts = "impacts"
    contact_forces = "contact_forces"
    energy = "energy"
    sensitivity = "sensitivity"
    scatter = "scatter"
    corner = "corner"
    fit = "fit"
    exponents = "exponents"
    methods = "methods"


class Progress(StrEnum):
    """Displays of the progress."""

    bar = "bar"
    json = "json"
    none = "none"


Only = Annotated[
    list[str] | None,
    typer.Option(help="Answer this question only, by its table or its name; may be given again."),
]
Threads = Annotated[
    int | None, typer.Option(min=1, help="Threads; by default one for each usable core.")
]
Workers = Annotated[
    int | None,
    typer.Option(
        min=1, help="Processes of this machine, in place of threads, for questions in chunks."
    ),
]
Scheduler = Annotated[
    str,
    typer.Option(
        help="A dask scheduler for questions in chunks, tls://HOST:PORT. Whoever can reach it "
        "without a secret, tcp://, can run code as you."
    ),
]
Shard = Annotated[
    str, typer.Option(help="K/N, the K-th of N jobs that share the folder; K from 0.")
]
ProgressKind = Annotated[
    Progress, typer.Option(help="bar; json: a line of JSON on standard error each second; none.")
]


@app.command()
def demo(
    frequency: Annotated[str, typer.Option(help="Forcing frequency, with its unit.")] = "15 Hz",
    force: Annotated[str, typer.Option(help="Forcing amplitude, with its unit.")] = "4 N",
    case: Annotated[
        Case, typer.Option(help="Gaps: a = 0.4, 0.4 mm; b = 0, 0.4 mm; c = 0, 0.8 mm.")
    ] = Case.b,
    periods: Annotated[int, typer.Option(min=3, help="Forcing periods to run.")] = 2000,
    out: Annotated[Path, typer.Option(help="Folder for the picture and the data.")] = Path(
        "saltus-demo"
    ),
    plot: Annotated[bool, typer.Option(help="Draw the picture.")] = True,
) -> None:
    """One rig, six starts: what does each settle to?

    A block between two springs with gaps, shaken sideways. Where it starts decides how it vibrates
    for ever after. Prints a table, draws each motion, keeps the data.

    Example: `saltus demo --case c --frequency "5 Hz"`
    """
    from saltus.cli import demo as study
    from saltus.cli import screen
    from saltus.results import save, usable_folder
    from saltus.results.files.sheets import write_table

    usable_folder(out)
    files = study.prepare_files(plot)

    with screen.working() as progress:
        result = study.demo(frequency, case.value, force, periods, progress)
    files.join()
    screen.show(result.table)
    written = [save(result.run, out / "demo.nc"), write_table(result.table, out / "demo.csv")]
    if plot:
        written.append(study.draw(result, out / "demo.png"))
    screen.files(written)


@app.command()
def run(
    study: Annotated[Path, typer.Argument(help="The study file (TOML).")],
    system: Annotated[
        str, typer.Option(help="A system of your own: FILE.py:NAME. Runs that file.")
    ] = "",
    out: Annotated[
        Path | None, typer.Option(help="Folder for results; default saltus-runs/STUDY.")
    ] = None,
    only: Only = None,
    inputs: Annotated[
        list[Path] | None,
        typer.Option(
            help="Another folder in which the study may read the files that it names; may "
            "be given again."
        ),
    ] = None,
    threads: Threads = None,
    workers: Workers = None,
    scheduler: Scheduler = "",
    shard: Shard = "",
    progress: ProgressKind = Progress.bar,
) -> None:
    """Run a study file: answer its questions, print their tables, keep data and pictures.

    A study names a model of saltus and its values; it never runs code, and reads no file outside
    its folder unless you allow it with --inputs. A system of your own is given here, by you.
    Results are stored: a study stopped at any moment, by anything, goes on where it was when it is
    run again. An answer isn't computed twice unless its inputs changed.

    Example: `saltus run replications/saunders2021/table2.toml`

    Example: `saltus run examples/two_masses/study.toml --system
    examples/two_masses/two_masses.py:rig`

    Example: `saltus run my_study.toml --only frequency_response`

    Example: `saltus run replications/saunders2021/fig6b.toml --workers 2`
    """
    from saltus.cli.own_system import check_beside, own_system
    from saltus.results import usable_folder
    from saltus.results.files.atomic import no_folder_left
    from saltus.study.read import read
    from saltus.study.setting.inputs import Inputs

    spec, text = read(study)
    for place in inputs or []:
        if not place.is_dir():
            raise StudyError(f"--inputs {place}: there is no such folder.")
    user_system = own_system(system) if system else None
    named = spec.system.model or spec.system.rates or spec.system.structure
    if user_system is None and not named:
        check_beside(study)
    resources = _resources(threads, workers, scheduler, shard)
    folder = out or Path("saltus-runs") / study.stem
    found = Inputs(study.parent, inputs or [])
    again = _again(folder, system)
    with no_folder_left(folder):
        usable_folder(folder)
        _run(spec, text, folder, found, user_system, only or [], resources, progress, again)


def _resources(threads: int | None, workers: int | None, scheduler: str, shard: str) -> Resources:
    from saltus.study.run.running import Resources, shard_of

    return Resources(threads, workers, scheduler or None, shard_of(shard) if shard else None)


def _run(
    spec: Study, text: str, folder: Path, inputs: Inputs, user_system: System | None,
    only: list[str], resources: Resources, progress: Progress, again: str,
) -> None:  # fmt: skip
    from saltus.cli import screen
    from saltus.study.run.study import run_study

    try:
        with screen.reporting(progress.value) as (report, say):
            outcome = run_study(
                spec, text, folder, user_system, resources, report, say, inputs=inputs, only=only
            )
    except KeyboardInterrupt:
        screen.fail(f"stopped; results so far are stored. Go on with: {again}")
        raise
    for table in outcome.tables:
        screen.show(table)
    screen.files(outcome.files)
    for name in outcome.waiting:
        screen.say(f"{name}: other shards aren't done yet. When they are: {again}")


def _again(folder: Path, system: str) -> str:
    """The command that resumes the study, with the user's own system if there is one."""
    return shlex.join(["saltus", "resume", str(folder), *(["--system", system] if system else [])])


@app.command()
def status(
    store: Annotated[
        Path, typer.Argument(help="The output folder of a study, or one of its stores of basins.")
    ],
) -> None:
    """Show which questions of a study are answered, and how far its maps are, on this machine and
    any other that works on the folder.

    Example: `saltus status saltus-runs/fig6b`
    """
    from saltus.cli import screen
    from saltus.study.run.status import status_tables

    for table in status_tables(store):
        screen.show(table)


@app.command()
def resume(
    store: Annotated[Path, typer.Argument(help="The output folder of a study.")],
    system: Annotated[
        str, typer.Option(help="The system of your own that it was run with: FILE.py:NAME.")
    ] = "",
    only: Only = None,
    threads: Threads = None,
    workers: Workers = None,
    scheduler: Scheduler = "",
    shard: Shard = "",
    progress: ProgressKind = Progress.bar,
) -> None:
    """Go on with a study that was stopped: only missing or damaged results are computed.

    Example: `saltus resume saltus-runs/fig6b`
    """
    from saltus.cli.own_system import own_system
    from saltus.study.read import read
    from saltus.study.run.copies import copy_of, inputs_of

    spec, text = read(copy_of(store))
    user_system = own_system(system) if system else None
    resources = _resources(threads, workers, scheduler, shard)
    _run(
        spec,
        text,
        store,
        inputs_of(store, text),
        user_system,
        only or [],
        resources,
        progress,
        _again(store, system),
    )


@app.command()
def plot(
    result: Annotated[Path, typer.Argument(help="A result (.nc) that saltus wrote.")],
    kind: Annotated[
        PictureKind | None,
        typer.Option(
            help="history: state against time. phase: velocity against displacement. "
            "Others: the one picture of their result."
        ),
    ] = None,
    trajectory: Annotated[
        int | None,
        typer.Option(min=0, help="Which trajectory of a batch; by default all, at most 8."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="Picture (.png, .pdf, .svg); default RESULT-KIND.png."),
    ] = None,
) -> None:
    """Draw a result: history and phase of a run; basins; responses; a section; a spectrum; impacts;
    energies. By default what fits.

    Example: `saltus plot saltus-demo/demo.nc --trajectory 2 --kind phase -o phase.pdf`
    """
    from saltus.cli import screen
    from saltus.cli.draw import draw

    screen.files([draw(result, None if kind is None else kind.value, trajectory, out)])


@app.command()
def reproduce(
    paper: Annotated[
        str, typer.Argument(help="The paper; leave it out to list those that can be reproduced.")
    ] = "",
    figure: Annotated[
        list[str] | None,
        typer.Option(
            help="A figure of the paper, 8 or fig8; may be given several times. By default all."
        ),
    ] = None,
    quick: Annotated[
        bool,
        typer.Option(
            "--quick",
            help="Coarser and shorter: some three minutes on two cores, not ten to fifteen.",
        ),
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the report; default saltus-runs/PAPER or PAPER-quick."),
    ] = None,
    threads: Threads = None,
) -> None:
    """Redraw a published paper's figures and hold each of its claims against exact arithmetic: one
    HTML report.

    Every claim gets a verdict (holds, holds in part, does not hold, not decidable), computed from
    the data by a rule printed with it. Stopped at any moment, it goes on where it was when it is
    run again; nothing is computed twice.

    Writes report.html; claims.csv, each claim with the answers and the verdict in a row; the data
    and the pictures. Of some figures only: report-fig8.html and claims-fig8.csv, next to those of
    all figures. Exit code 1 if something could not be computed; see the report.

    Example: `saltus reproduce saunders2021 --quick`

    Example: `saltus reproduce saunders2021 --figure 8 --figure 9`
    """
    import matplotlib

    from saltus import replication
    from saltus.cli import screen
    from saltus.results.table import TextTable

    if not paper:
        screen.show(
            TextTable(
                "Papers; `saltus reproduce NAME` does one",
                ("name", "title"),
                tuple(replication.names().items()),
            )
        )
        return
    chosen = replication.find(paper)
    folder = out or Path("saltus-runs") / (f"{paper}-quick" if quick else paper)
    matplotlib.use("Agg")  # no window, and none needed
    try:
        with screen.reporting("bar") as (report, say):
            result = replication.reproduce(
                chosen, folder, figure or (), quick, threads, report, say
            )
    except KeyboardInterrupt:
        screen.fail(f"stopped; results so far are stored in {folder}. Go on with the same command.")
        raise
    screen.show(replication.verdict_table(result))
    screen.files([result.report, result.claims_file])
    for why in dict.fromkeys(result.failures.values()):
        screen.fail(why)
    if result.failures:
        raise typer.Exit(1)


@app.command()
def models(
    name: Annotated[
        str, typer.Argument(help="A model, to see its equations, values and source.")
    ] = "",
) -> None:
    """List the published systems that come with saltus, or show one.

    Example: `saltus models delangre`
    """
    from saltus import models as published
    from saltus.cli import screen

    if not name:
        screen.show(_models_table(screen.console().width))
        return
    screen.say(published.describe()[published.find(name).__name__])
    screen.say(repr(published.find(name)()))
    if published.has_energy(name):
        screen.say(f'energy      sl.models.energy("{name}"), as sl.energy_balance takes it')


def _models_table(width: int) -> TextTable:
    """A line for each model; sources are cut to the width of the screen."""
    from saltus import models as published
    from saltus.results.table import TextTable

    systems = {name: model() for name, model in published.MODELS.items()}
    left = max(width - max(map(len, systems)) - len("  states  contacts  "), 20)
    rows = tuple(
        (
            name,
            str(len(system.states)),
            str(sum(guard.law is None or guard.law.kind != "hold" for guard in system.guards)),
            textwrap.shorten(system.source, left, placeholder=" ..."),
        )
        for name, system in systems.items()
    )
    title = "Models; `saltus models NAME` shows one"
    return TextTable(title, ("name", "states", "contacts", "source"), rows)


@app.command()
def doctor() -> None:
    """Show what saltus runs on here, and check its answers against closed forms. Exit code 1 if one
    is wrong.

    Example: `saltus doctor`
    """
    from saltus.cli import doctor as study
    from saltus.cli import screen

    screen.show(study.machine())
    with screen.working():
        found = study.checks()
    screen.show(study.check_table(found))
    if not all(check.passed for check in found):
        screen.fail(
            "a self-check failed: results on this machine can't be trusted. Try `saltus "
            "cache clear`, then report this output."
        )
        raise typer.Exit(1)


@app.command()
def schema() -> None:
    """Print the JSON schema of study files, for editors that check TOML.

    Example: `saltus schema > study.schema.json`
    """
    import json

    from saltus.study.spec import Study

    typer.echo(json.dumps(Study.model_json_schema(), indent=2, ensure_ascii=False))
