"""Draw a result that stands in a file."""

from __future__ import annotations

from pathlib import Path

from saltus.errors import ParameterError

#: The picture of each kind of result that has one of its own; runs have two.
OWN = {name: name for name in ("basins", "agreement", "section", "spectrum", "impacts", "energy")}
#: Those that know no trajectories.
MAPS = ("basins", "agreement")


def draw(result: Path, kind: str | None, trajectory: int | None, file: Path | None) -> Path:
    """Draw a result to a picture file.

    Parameters
    ----------
    result : Path
        A ``.nc`` file that saltus wrote.
    kind : {"history", "phase", "basins", "agreement", "section", "spectrum", "impacts", "energy"}, optional
        Which picture; by default the one that fits the result.
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
    from saltus.results import load
    from saltus.results.schema import kind_of

    ds = load(result)
    own = OWN.get(kind_of(ds))
    kind = kind or own or "history"
    if (kind in OWN.values() or own is not None) and kind != own:
        raise ParameterError(f"{result} holds {own or 'a run'}: it can't be drawn as {kind}. Leave --kind out.")
    if own in MAPS and trajectory is not None:
        raise ParameterError(f"{result} holds {own}, no trajectories. Leave --trajectory out.")
    file = file or result.with_name(f"{result.stem}-{kind}.png")
    formats = FigureCanvasBase.get_supported_filetypes()
    if file.suffix.removeprefix(".") not in formats:
        raise ParameterError(f"a picture can't be written as {file.name!r}. Known: {', '.join('.' + name for name in sorted(formats))}.")
    axes = getattr(plot, kind)(ds, **({} if own in MAPS else {"trajectory": trajectory}))
    first = axes.flat[0] if hasattr(axes, "flat") else axes
    first.figure.savefig(file)
    plt.close("all")
    return file
