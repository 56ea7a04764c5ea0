"""Checks that every public picture shares: of its arguments, of its name in messages, and of text
that can't be drawn.
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
from saltus.plot.choice import TAKES, pictures_of
from saltus.results.dataset import schema
from saltus.results.dataset.reader import reader

P = ParamSpec("P")
R = TypeVar("R")

_NAME: ContextVar[str] = ContextVar("name", default="")


class PictureError(ParameterError):
    """A picture can't be drawn; the message begins with its name."""


def picture(
    *, needs: Sequence[str] = (), checks: bool = True
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Turn a function that draws Axes or a Figure into a public picture.

    Names of maps, outputs and boundaries may hold dollar signs. What is a formula between two of
    them is drawn as one; what isn't, and would end saving the figure, is drawn as it is written.

    Parameters
    ----------
    needs : sequence of str
        Variables that the first argument must hold, besides those of its kind.
    checks : bool
        Whether the first argument must be a Dataset that the picture draws
        (:data:`saltus.plot.choice.TAKES`); otherwise the function calls :func:`check` itself.
    """

    def decorate(function: Callable[P, R]) -> Callable[P, R]:
        def check_and_draw(*args: P.args, **kwargs: P.kwargs) -> R:
            if checks:
                check(args[0] if args else next(iter(kwargs.values())), needs)
            return function(*args, **kwargs)

        draw = reader(functools.wraps(function)(check_and_draw))

        @functools.wraps(function)
        def drawn(*args: P.args, **kwargs: P.kwargs) -> R:
            token = _NAME.set(function.__name__)
            try:
                result = draw(*args, **kwargs)
            except PictureError:
                raise
            except ParameterError as error:
                named = PictureError(f"{caller()}: {error}")
                raise named.with_traceback(error.__traceback__) from error.__cause__
            finally:
                _NAME.reset(token)
            for one in np.ravel(np.asarray(result, dtype=object)):
                keep_drawable(one)
            return result

        return checked(drawn)

    return decorate


def caller() -> str:
    """The name of the picture that is being drawn, such as ``plot.history``: the subject of its
    messages.
    """
    return f"plot.{_NAME.get()}"


def check(
    ds: Any, needs: Sequence[str] = (), *, kinds: Sequence[str] = (), argument: str = ""
) -> None:
    """Raise a PictureError unless ``ds`` is a Dataset of one of these kinds and holds these
    variables.

    Parameters
    ----------
    ds : Any
        The argument of the picture.
    needs : sequence of str
        Variables.
    kinds : sequence of str, optional
        By default those that the picture draws.
    argument : str, optional
        Argument that it was given as, if it isn't the first one.
    """
    call = f"{caller()}({argument}=)" if argument else caller()
    wanted, kind = tuple(kinds) or TAKES[_NAME.get()], schema.kind_of(ds)
    try:
        schema.check(ds, caller=call, kinds=wanted)
    except ParameterError as error:
        others = [f"plot.{name}" for name in pictures_of(kind)] if kind not in wanted else []
        better = f" Draw it with {_either(others)}." if others else ""
        raise PictureError(f"{error}{better}") from None
    missing = [one for one in needs if one not in ds.variables]
    if missing:
        raise PictureError(
            f"{call} misses {', '.join(missing)} in this Dataset. Give it the whole Dataset, not "
            f"some variables of it."
        )


def _either(names: Sequence[str]) -> str:
    """``a``; ``a or b``; ``a, b or c``."""
    return " or ".join(filter(None, (", ".join(names[:-1]), names[-1])))


def keep_drawable(artist: Artist) -> None:
    """Make every text of a Figure or Axes plain if Matplotlib can't read the formulas in it."""
    for text in artist.findobj(Text):
        if isinstance(text, Text) and drawable(text.get_text()) != text.get_text():
            text.set_text(drawable(text.get_text()))


@functools.lru_cache(maxsize=256)
def drawable(text: str) -> str:
    """Return the text if Matplotlib can read the formulas in it, else one that is drawn
    literally.
    """
    parser: Any = MathTextParser("path")
    try:
        if is_math_text(text):
            parser.parse(text)
    except (ValueError, RecursionError):
        return re.sub(r"(?<!\\)\$", r"\\$", text)
    return text
