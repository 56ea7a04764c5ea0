"""The demo: one rig, six starts, the response that each settles to, and that of starts one
nanometre away.
"""

from __future__ import annotations

import contextlib
import io
import threading
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.analysis.motion.settled import LAST, settled
from saltus.results.dataset.schema import period_text
from saltus.results.table import Column, TextTable, quantity, table, words
from saltus.study.answers.simulate import response_texts
from saltus.units import from_si

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

#: Callable that takes the share done, or None.
Progress = Callable[[float], None] | None
#: Starts (x [m], v [m/s]): the four of Saunders et al. (2021), Fig. 5; then 1.9 mm, which reaches
#: the 4T that they report from 2 mm (there the outcome changes from one nanometre to the next); and
#: a high one, which reaches the T-periodic response.
STARTS = ((1.0e-3, 0.0), (0.2e-3, 0.0), (0.4e-3, 0.0), (2.0e-3, 0.0), (1.9e-3, 0.0), (4.0e-3, 0.3))
#: Distance [m] of the neighbouring starts on either side: less than any experiment can set.
NEIGHBOUR = 1e-9
#: Periods to run: enough for the slowest response, 24T from x = 0.4 mm, to repeat to ten digits.
PERIODS = 2000
#: Forcing periods drawn in a time history.
SHOWN = 12
#: Forcing periods drawn in the phase portrait of a response that doesn't repeat.
SHOWN_IF_APERIODIC = 24
#: Margins of the panels, in shares of the figure: fixed, since searching them takes longer than
#: drawing.
MARGINS = {
    "left": 0.075, "right": 0.985, "bottom": 0.075, "top": 0.975, "hspace": 0.6, "wspace": 0.36,
}  # fmt: skip


@dataclass(frozen=True)
class Demo:
    """The results of the demo.

    Attributes
    ----------
    run : Dataset
        The motions, a trajectory for each start.
    settled : Dataset
        The responses that they settled to.
    neighbours : array of int, shape (2, trajectory)
        Periods of the responses from one nanometre to either side, 0 if none was found.
    table : TextTable
        The table to print.
    """

    run: xr.Dataset
    settled: xr.Dataset
    neighbours: np.ndarray
    table: TextTable


def demo(
    frequency: str = "15 Hz",
    case: str = "b",
    force: str = "4 N",
    periods: int = PERIODS,
    progress: Progress = None,
) -> Demo:
    """Run the rig from six starts, and from their neighbours, until it settles.

    Parameters
    ----------
    frequency, force : str
        Of the drive, with units.
    case : str
        ``"a"``, ``"b"`` or ``"c"``.
    periods : int
        Forcing periods to run; the last 96 (or all, if fewer) are recorded.
    progress : callable, optional
        Called with the share done.

    Raises
    ------
    UnitError, ParameterError
        If a value can't be used.
    """
    from saltus import models
    from saltus.analysis.motion.simulate import simulate
    from saltus.analysis.motion.stroboscope import stroboscope

    rig = models.delangre(case, force=force, frequency=frequency)
    x, v = np.array(STARTS).T
    recorded = min(LAST, periods)
    run = simulate(
        rig, start={"x": x, "v": v}, periods=periods, keep=recorded, progress=progress or False
    )
    twins = {"x": np.concatenate([x - NEIGHBOUR, x + NEIGHBOUR]), "v": np.tile(v, 2)}
    twin_run = stroboscope(rig, start=twins, periods=periods, keep=recorded + 1)
    neighbours = settled(twin_run)["response_period"].values.reshape(2, len(STARTS))
    found = settled(run)
    title = f"deLangre rig, case {case}, {force} at {frequency}, {periods} forcing periods"
    return Demo(run, found, neighbours, _table(run, found, neighbours, title))


def prepare_files(plot: bool) -> threading.Thread:
    """Import the modules for the files in a thread, which is joined before they are written. A
    processor is free while the demo computes, or waits for another process to compile.
    """

    def imported() -> None:
        for begin in (_netcdf, _fonts) if plot else (_netcdf,):
            with contextlib.suppress(Exception):  # `save` or `draw` fails again, and reports it
                begin()

    thread = threading.Thread(target=imported, name="imports for the files", daemon=True)
    thread.start()
    return thread


def _netcdf() -> None:
    import xarray as xr

    from saltus.results.files import hdf5

    hdf5.content(xr.Dataset({"one": 1.0}))


def _pyplot() -> Any:
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot

    from saltus.plot import history, phase, style  # noqa: F401

    return matplotlib.pyplot


def _fonts() -> None:
    """Load the fonts, which takes the first picture as long as a row of the demo's."""
    plt = _pyplot()
    figure = plt.figure(figsize=(1.0, 1.0))
    figure.add_subplot().plot([0.0, 1.0])
    figure.savefig(io.BytesIO())
    plt.close(figure)


def draw(result: Demo, file: Path) -> Path:
    """Draw a row for each start, with the time history and the phase portrait of its response;
    return the file.
    """
    plt = _pyplot()
    from saltus import plot

    with plot.style():
        figure, axes = plt.subplots(
            len(STARTS),
            2,
            figsize=(9.0, 1.75 * len(STARTS)),
            width_ratios=(2.6, 1),
            gridspec_kw=MARGINS,
            layout="none",
        )
        for i, (row, text) in enumerate(zip(axes, response_texts(result.run), strict=True)):
            n = int(result.settled["response_period"][i]) or SHOWN_IF_APERIODIC
            plot.history(result.run, trajectory=i, periods=SHOWN, ax=row[0], time="T", legend=False)
            plot.phase(result.run, trajectory=i, periods=n, ax=row[1], legend=False)
            if i < len(STARTS) - 1:
                row[0].set_xlabel("")
            row[0].set_title(f"start x, v = {_start(i)}: {text}", loc="left")
        named = {label: handle for handle, label in _handles(axes.flat)}
        figure.legend(named.values(), named.keys(), loc="lower center", ncols=len(named))
        figure.savefig(file)
        plt.close(figure)
    return file


def _handles(axes: Iterable[Axes]) -> Iterator[tuple[Any, str]]:
    """Legend entries of all axes."""
    for one in axes:
        yield from zip(*one.get_legend_handles_labels(), strict=True)


def _table(run: xr.Dataset, found: xr.Dataset, neighbours: np.ndarray, title: str) -> TextTable:
    texts, periods = response_texts(run), found["response_period"].values.tolist()
    statuses = run["status"].values.astype(str).tolist()
    shifted = [_shifted(n, neighbours[:, i].tolist()) for i, n in enumerate(periods)]
    counts = [
        float(count) if n else None
        for n, count in zip(periods, found["contacts_per_response"].values, strict=True)
    ]
    x, v = zip(*STARTS, strict=True)
    columns = [
        Column("start x, v", _start, {"start x [m]": x, "start v [m/s]": v}),
        words(
            "settles to",
            [
                text if status == "ok" else f"{text} ({status})"
                for text, status in zip(texts, statuses, strict=True)
            ],
        ),
        words("1 nm off", shifted),
        Column(
            "contacts",
            lambda i: "-" if counts[i] is None else f"{counts[i]:g} in {texts[i]}",
            {"contacts in a response": counts},
        ),
        quantity("peak |x|", found["x_peak"].values, "m"),
        quantity("rms x", found["x_rms"].values, "m"),
        words("steps", run["steps"].values),
    ]
    periodic = found["response_period"] > 0
    notes = [
        f"Periods are read off the last {2 * found.attrs['longest_period']} forcing periods. "
        f"Stability isn't examined."
        + (
            f" States repeat to {float(found['mismatch'].where(periodic).max()):.0e} of their "
            f"range."
            if periodic.any()
            else ""
        )
    ]
    if set(shifted) - {"same", "-"}:
        notes.append(
            "Where a start 1 nm away settles to something else, no experiment and no "
            "other program need agree."
        )
    return table(title, columns, notes)


def _shifted(n: int, neighbours: list[int]) -> str:
    """The responses of the neighbours of a start, if it settles itself."""
    if n == 0:
        return "-"
    return "same" if set(neighbours) == {n} else ", ".join(map(period_text, neighbours))


def _start(number: int) -> str:
    x, v = STARTS[number]
    return f"{from_si(x, 'm')}, {from_si(v, 'm/s')}"
