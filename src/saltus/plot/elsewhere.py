"""Names of pictures in other programs: a sentence for each name that saltus.plot doesn't have."""

from __future__ import annotations

from collections.abc import Sequence

from saltus.errors import nearest

_ANIMATED = (
    "There are no animations; matplotlib.animation.FuncAnimation can draw run.x and run.v, "
    "the samples of a run."
)

#: Pictures that are called otherwise here, in small letters and without _.
_PICTURES: dict[str, str] = {
    **dict.fromkeys(("animate", "animation", "movie"), _ANIMATED),
    **dict.fromkeys(("plot", "timehistory", "timeseries", "time", "displacement", "waveform"),
        "Write sl.plot.history(run)."),
    **dict.fromkeys(("phaseportrait", "phaseplane", "trajectory", "orbit"),
        "Write sl.plot.phase(run)."),
    **dict.fromkeys(("frf", "bode", "resonance", "response", "sweep"),
        "Write sl.plot.frequency_response(response)."),
    **dict.fromkeys(("poincare", "poincaresection", "stroboscope"),
        "Write sl.plot.section(points)."),
    **dict.fromkeys(("fft", "psd", "waterfall"), "Write sl.plot.spectrum(spectrum)."),
    **dict.fromkeys(("lyapunov", "lyapunovexponents"), "Write sl.plot.exponents(exponents)."),
    **dict.fromkeys(("orbitdiagram", "continuation"), "Write sl.plot.bifurcation_diagram(diagram) "
        "or sl.plot.branches(branches)."),
    **dict.fromkeys(("attractors", "map"), "Write sl.plot.basins(map) or sl.plot.gallery(found)."),
    **dict.fromkeys(("show", "savefig", "figure"), "A picture gives its axes: "
        "axes.figure.savefig(path), or matplotlib.pyplot.show()."),
    **dict.fromkeys(("amplitude", "heatmap", "contour", "surface"), "Of two parameters "
        "sl.plot.type_map(diagram) draws the kinds of motion, and sl.plot.amplitude_map(diagram) "
        "their sizes."),
    **dict.fromkeys(("basinfractions", "fractions", "stackplot"),
        "Write sl.plot.shares(responses)."),
}  # fmt: skip
#: Likeness from which on a name is a slip of the pen.
_NEAR = 0.7


def picture_instead(name: str, known: Sequence[str]) -> str:
    """Sentence for the name of a picture that saltus doesn't have; ``known`` are the pictures that
    it has.
    """
    return _PICTURES.get(name.lower().replace("_", "")) or nearest(name, known, _NEAR)
