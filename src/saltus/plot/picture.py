"""What every public picture does beside its work: ask what kinds of arguments it is given, and leave no text that can't be drawn."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import numpy as np
from matplotlib.artist import Artist
from matplotlib.cbook import is_math_text
from matplotlib.mathtext import MathTextParser
from matplotlib.text import Text

from saltus.arguments import checked

P = ParamSpec("P")
R = TypeVar("R")


def picture(function: Callable[P, R]) -> Callable[P, R]:
    """Make a function that draws Axes or a Figure a public picture.

    Names of maps, outputs and boundaries may hold dollar signs. What is a formula between two of them is drawn as one; what isn't, and
    would end saving the figure, is drawn as it is written.
    """
    ask = checked(function)

    @functools.wraps(function)
    def drawn(*args: P.args, **kwargs: P.kwargs) -> R:
        result = ask(*args, **kwargs)
        for one in np.ravel(np.asarray(result, dtype=object)):
            keep_drawable(one)
        return result

    return drawn


def keep_drawable(artist: Artist) -> None:
    """Have every text of a Figure or Axes drawn as it is written if Matplotlib can't read the formulas in it."""
    for text in artist.findobj(Text):
        if isinstance(text, Text) and drawable(text.get_text()) != text.get_text():
            text.set_text(drawable(text.get_text()))


@functools.lru_cache(maxsize=256)
def drawable(text: str) -> str:
    """The text itself if Matplotlib can read the formulas in it, else one that is drawn as it is written."""
    parser: Any = MathTextParser("path")
    try:
        if is_math_text(text):
            parser.parse(text)
    except (ValueError, RecursionError):
        return re.sub(r"(?<!\\)\$", r"\\$", text)
    return text
