"""Draw the result in a file."""

from __future__ import annotations

import inspect
from pathlib import Path

from saltus.errors import ParameterError

_WORDS = {
    "trajectory": "a run", "stroboscope": "points at whole periods", "basins": "basins",
    "agreement": "the agreement "
        "of two maps of basins",
    "responses": "responses", "section": "a section", "spectrum": "a spectrum",
    "impacts": "impacts", "energy": "energies", "sensitivity": "derivatives",
    "scatter": "sets of values",
    "fit": "a fit to a measurement",
    "methods": "one question by several methods", "exponents": "exponents",
    "branches": "branches of periodic orbits", "orbits": "periodic orbits",
    "bifurcation_curve": "a curve of bifurcations", "backbone": "a backbone",
}  # fmt: skip


def draw(result: Path, kind: str | None, trajectory: int | None, file: Path | None) -> Path:
    """Draw a result to a picture file.

    Parameters
    ----------
    result : Path
        A ``.nc`` file that saltus wrote.
    kind : str, optional
        Which picture, one of :data:`saltus.plot.choice.TAKES`; by default the one that fits the
        result.
    trajectory : int, optional
        Which of a batch; all of them, at most 8, by default.
    file : Path, optional
        The picture; its suffix says the format. By default RESULT-KIND.png.

    Returns
    -------
    Path
        The picture.

    Raises
    ------
    ParameterError
        If there is no such trajectory, or the format is unknown.
    ResultFileError
        If the result can't be read.
    OSError
        If the picture can't be written.
    """
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from matplotlib.backend_bases import FigureCanvasBase

    from saltus import plot
    from saltus.plot.choice import default_kind, pictures_of
    from saltus.results import load
    from saltus.results.dataset.schema import kind_of

    ds = load(result)
    possible = pictures_of(kind_of(ds))
    if not possible:
        raise ParameterError(f"{result} holds {kind_of(ds)}, for which there is no picture yet.")
    kind = kind or default_kind(ds)
    if kind not in possible:
        raise ParameterError(
            f"{result} holds {_WORDS[kind_of(ds)]}: it can't be drawn as {kind}. "
            f"Known: {', '.join(possible)}."
        )
    picture = getattr(plot, kind)
    of_trajectories = "trajectory" in inspect.signature(picture).parameters
    if trajectory is not None and not of_trajectories:
        raise ParameterError(
            f"{result} holds {_WORDS[kind_of(ds)]}, no trajectories. Leave --trajectory out."
        )
    file = file or result.with_name(f"{result.stem}-{kind}.png")
    formats = FigureCanvasBase.get_supported_filetypes()
    if file.suffix.removeprefix(".") not in formats:
        raise ParameterError(
            f"a picture can't be written as {file.name!r}. Known: "
            f"{', '.join('.' + name for name in sorted(formats))}."
        )
    axes = picture(ds, **({"trajectory": trajectory} if of_trajectories else {}))
    first = axes.flat[0] if hasattr(axes, "flat") else axes
    first.figure.savefig(file)
    plt.close("all")
    return file
