"""Style of saltus's pictures: a style file, a palette, and units that suit the numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from matplotlib.figure import Figure
from matplotlib.font_manager import fontManager

from saltus.errors import ParameterError, among, shown

#: Eight colours that colour-blind readers tell apart: M. Okabe and K. Ito, Color universal design
#: (2008).
OKABE_ITO = {
    "black": "#000000",
    "orange": "#E69F00",
    "sky blue": "#56B4E9",
    "green": "#009E73",
    "yellow": "#F0E442",
    "blue": "#0072B2",
    "vermillion": "#D55E00",
    "purple": "#CC79A7",
}
#: Colours for things that have no order of their own, such as trajectories.
CYCLE = tuple(
    OKABE_ITO[name]
    for name in ("blue", "vermillion", "green", "purple", "orange", "sky blue", "black", "yellow")
)
#: Lines and texts that stay behind the data.
QUIET = "#555555"
#: Above this many points a marker layer is stored as pixels in vector files: they would otherwise
#: grow to megabytes.
RASTERISE_ABOVE = 500

_MARK = "saltus"
_STYLE_FILE = Path(__file__).with_name("saltus.mplstyle")


@contextmanager
def style() -> Iterator[None]:
    """Context in which figures get saltus's style: ``with sl.plot.style(): fig, axes =
    plt.subplots(2, 2)``.

    The functions of this package use it themselves when they make the figure. A figure keeps its
    fonts and sizes when it is drawn or saved after the context has ended.
    """
    # Load the backend now: it may switch interaction on, which the end of the context would undo.
    plt.draw_if_interactive()
    with plt.style.context(_STYLE_FILE):
        # A generic family is resolved when a figure is saved, by the settings of that moment; a
        # font's own name stays.
        plt.rcParams["font.family"] = _fonts(plt.rcParams["font.sans-serif"])
        before = set(plt.get_fignums())
        try:
            yield
        finally:
            for number in set(plt.get_fignums()) - before:
                figure = plt.figure(number)
                figure.set_gid(_MARK)
                _keep_ticks(figure)


def styled(figure: Figure | None) -> bool:
    """True if a figure was made in the style. What is drawn into it later should be drawn in the
    style too.
    """
    return figure is not None and figure.get_gid() == _MARK


def _fonts(wanted: list[str]) -> list[str]:
    """Fonts of a list that this machine has; Matplotlib brings the last one."""
    known = {font.name for font in fontManager.ttflist}
    return [name for name in wanted if name in known]


def _keep_ticks(figure: Figure) -> None:
    """Write the style of the present ticks into the axes, except where a picture chose its own:
    Matplotlib makes ticks late, by the settings of that moment.
    """
    now: dict[str, Any] = {str(name): value for name, value in plt.rcParams.items()}
    for ax in figure.axes:
        for one in (ax, *ax.child_axes):
            for direction, axis in (("x", one.xaxis), ("y", one.yaxis)):
                for which in ("major", "minor"):
                    settings = {
                        name: now[f"{direction}tick.{name}"]
                        for name in ("labelsize", "direction", "color")
                    }
                    settings |= {
                        name: now[f"{direction}tick.{which}.{name}"] for name in ("width", "pad")
                    }
                    settings |= {
                        "length": now[f"{direction}tick.{which}.size"],
                        "labelfontfamily": now["font.family"],
                    }
                    chosen = axis.get_tick_params(which=which)
                    axis.set_tick_params(
                        which=which,
                        **{name: value for name, value in settings.items() if name not in chosen},
                    )


# -- display units ---------------------------------------------------------------------------------
_PREFIXES = {"G": 1e9, "M": 1e6, "k": 1e3, "": 1.0, "m": 1e-3, "µ": 1e-6, "n": 1e-9}
_SCALABLE = re.compile(r"(m|s|Hz|N|Pa|J|W|V|A)(?=$|[*/])")
_ANGLE = re.compile(r"rad(?=$|[*/])")
#: The prefix is the largest with which the largest value is at least this: 0.43 m/s stays, 0.03 m/s
#: becomes 30 mm/s.
_AT_LEAST = 0.1


@dataclass(frozen=True)
class Scale:
    """Scale of a quantity in a picture: multiply by ``factor``, write ``unit``."""

    factor: float
    unit: str

    def label(self, name: str) -> str:
        """Text of an axis, such as ``x [mm]``."""
        return f"{name} [{self.unit}]" if self.unit not in ("", "1") else name

    def text(self, value: float) -> str:
        """A value in SI as people write it, such as ``0.4 mm``."""
        # + 0.0: never minus zero
        number = f"{value * self.factor + 0.0:.4g}".replace("-", "\N{MINUS SIGN}")
        return f"{number} {self.unit}" if self.unit not in ("", "1") else number


def display_scale(unit: str, largest: float, wanted: str | None = None) -> Scale:
    """Choose the prefix under which numbers of this size read best.

    Parameters
    ----------
    unit : str
        SI unit of the numbers, ``""`` if unknown.
    largest : float
        Largest absolute value to show [unit]. Lengths below 1 m are shown in mm, as is the custom
        of this field; angles in rad, whatever their size, so that one angle has one unit in all
        pictures.
    wanted : str, optional
        Unit to use instead, such as ``"mm"``; ``"deg"`` or ``"deg/s"`` for an angle or its rate.

    Returns
    -------
    Scale

    Raises
    ------
    ParameterError
        If ``wanted`` is not the unit with a prefix.
    """
    known = _PREFIXES if _SCALABLE.match(unit) else {"": 1.0}
    if wanted is not None:
        sizes = {prefix + unit: size for prefix, size in known.items()}
        if _ANGLE.match(unit):
            sizes |= {f"m{unit}": 1e-3, _ANGLE.sub("deg", unit): math.pi / 180}
        if isinstance(wanted, str) and wanted.startswith("u"):  # as keyboards write µ
            wanted = f"µ{wanted[1:]}"
        if among(wanted, sizes):
            return Scale(1 / sizes[wanted], wanted)
        choice = ", ".join(sizes)
        raise ParameterError(
            f"values in {unit or 'an unknown unit'} can't be shown in "
            f"{shown(wanted)}. Known: {choice}."
        )
    for prefix, size in known.items():
        limit = 1.0 if prefix + unit == "m" else _AT_LEAST
        if unit in ("m", "s", "m/s", "m/s^2") and size > 1:
            continue  # nobody reads kilometres or kiloseconds here
        if largest / size >= (limit if size <= 1 else 1.0):
            return Scale(1 / size, prefix + unit)
    return Scale(1.0, unit)
