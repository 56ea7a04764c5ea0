"""What every public picture does besides its work: check its arguments, name itself in messages,
and leave no text that can't be drawn.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Sequence
from contextvars import ContextVar
from typing import Any, ParamSpec, TypeVar

import numpy as np
from matplotlib.artist import Artist
from matplotlib.cbook import is_math_text
from matplotlib.mathtext import MathTextParser
from matplotlib.text import Text

from saltus.arguments import checked
from saltus.errors import ParameterError
from saltus.results.dataset import schema
from saltus.results.dataset.reader import reader

P = ParamSpec("P")
R = TypeVar("R")

#: What draws each kind of result.
_PICTURES = {
    schema.BASINS: "plot.basins",
    schema.AGREEMENT: "plot.agreement",
    schema.TRAJECTORY: "plot.history or plot.phase",
    schema.STROBOSCOPE: "plot.phase",
    schema.RESPONSES: "plot.frequency_response, plot.bifurcation_diagram or plot.type_map",
    schema.BRANCHES: "plot.branches",
    schema.CURVE: "plot.bifurcation_curves",
    schema.BACKBONE: "plot.backbone",
}
_NAME: ContextVar[str] = ContextVar("name", default="the picture")


def picture(*kinds: str, needs: Sequence[str] = ()) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Make a function that draws Axes or a Figure a public picture.

    Names of maps, outputs and boundaries may hold dollar signs. What is a formula between two of
    them is drawn as one; what isn't, and would end saving the figure, is drawn as it is written.

    Parameters
    ----------
    *kinds : str
        Kinds of Dataset (:data:`saltus.results.schema.NAMES`) that the first argument may be.
        Without any, the function checks itself.
    needs : sequence of str
        Variables that it must hold, besides those of its kind.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        def check_and_draw(*args: P.args, **kwargs: P.kwargs) -> R:
            if kinds:
                check(args[0] if args else next(iter(kwargs.values())), kinds, needs)
            return function(*args, **kwargs)

        draw = checked(reader(functools.wraps(function)(check_and_draw)))

        @functools.wraps(function)
        def drawn(*args: P.args, **kwargs: P.kwargs) -> R:
            token = _NAME.set(f"plot.{function.__name__}")
            try:
                result = draw(*args, **kwargs)
            except ParameterError as error:
                if not str(error).startswith("plot."):
                    error.args = (f"{_NAME.get()}: {error}",)
                raise
            finally:
                _NAME.reset(token)
            for one in np.ravel(np.asarray(result, dtype=object)):
                keep_drawable(one)
            return result

        return drawn

    return decorate


def caller() -> str:
    """The name of the picture that is being drawn, such as ``plot.history``: the subject of its
    messages.
    """
    return _NAME.get()


def check(ds: Any, kinds: Sequence[str], needs: Sequence[str] = ()) -> None:
    """Raise a ParameterError unless ``ds`` is a Dataset of one of these kinds and holds these
    variables.
    """
    kind = schema.kind_of(ds)
    try:
        schema.check(ds, caller=caller(), kinds=kinds)
    except ParameterError as error:
        better = (
            f" Draw it with {_PICTURES[kind]}." if kind not in kinds and kind in _PICTURES else ""
        )
        raise ParameterError(f"{error}{better}") from None
    missing = [one for one in needs if one not in ds.variables]
    if missing:
        raise ParameterError(
            f"{caller()} misses {', '.join(missing)} in this Dataset. Give it the whole Dataset, "
            f"not some variables of it."
        )


def keep_drawable(artist: Artist) -> None:
    """Have every text of a Figure or Axes drawn as it is written if Matplotlib can't read the
    formulas in it.
    """
    for text in artist.findobj(Text):
        if isinstance(text, Text) and drawable(text.get_text()) != text.get_text():
            text.set_text(drawable(text.get_text()))


@functools.lru_cache(maxsize=256)
def drawable(text: str) -> str:
    """The text itself if Matplotlib can read the formulas in it, else one that is drawn as it is
    written.
    """
    parser: Any = MathTextParser("path")
    try:
        if is_math_text(text):
            parser.parse(text)
    except (ValueError, RecursionError):
        return re.sub(r"(?<!\\)\$", r"\\$", text)
    return text
