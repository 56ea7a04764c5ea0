"""Values of models are given by name: what a call by position is answered."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any, TypeVar, cast

from saltus.errors import ParameterError, shown
from saltus.system import System

Model = TypeVar("Model", bound=Callable[..., System])


def by_name(model: Model) -> Model:
    """A model that answers values without a name in a sentence. Its signature stays."""
    cases = [one.name for one in inspect.signature(model).parameters.values() if one.kind is one.POSITIONAL_OR_KEYWORD]

    @functools.wraps(model)
    def called(*given: Any, **values: Any) -> System:
        if len(given) > len(cases):
            names = list(model().values)
            takes = " and ".join([*(f"a {case}" for case in cases), "values by name"])
            raise ParameterError(
                f"{model.__name__} takes {takes}, and {shown(given[len(cases)])} has no name. "
                f"Write {model.__name__}({names[0]}=...); its parameters are {', '.join(names)}."
            )
        return model(*given, **values)

    return cast("Model", called)
