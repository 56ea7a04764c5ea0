"""Functions that read a result, with an error that explains when the Dataset isn't a result any
more.
"""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Iterator
from typing import Any, ParamSpec, TypeVar

import xarray as xr

from saltus.errors import ParameterError, SaltusError, shown
from saltus.results.provenance import content_hash

P = ParamSpec("P")
R = TypeVar("R")


def reader(function: Callable[P, R]) -> Callable[P, R]:
    """Wrap a function that takes results: if it fails, and a Dataset was changed or forged, the
    error says so.

    A variable that was renamed, a dim that was cut to nothing, an attribute of another kind fail
    anywhere. What ``result_hash`` says is asked only then. A failure over Datasets as they were
    returned is raised as it is: it is a mistake of saltus, or of other arguments.
    """

    @functools.wraps(function)
    def called(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return function(*args, **kwargs)
        except SaltusError:
            raise
        except (
            LookupError,
            ValueError,
            TypeError,
            AttributeError,
            ArithmeticError,
            RecursionError,
        ) as error:
            if not any(_is_changed(ds) for ds in _datasets([*args, *kwargs.values()])):
                raise
            raise ParameterError(
                f"{function.__name__} ends in {type(error).__name__}: {shown(str(error), 200)}. A "
                f"Dataset that it was given isn't "
                "as saltus made it: variables, dims or attributes were dropped or changed. Give it "
                "as it was, or a selection of it."
            ) from error

    return called


def _datasets(given: Any) -> Iterator[xr.Dataset]:
    for item in given:
        if isinstance(item, xr.Dataset):
            yield item
        elif isinstance(item, list | tuple):
            yield from _datasets(item)
        elif isinstance(item, dict):
            yield from _datasets(item.values())


def _is_changed(ds: xr.Dataset) -> bool:
    """True where the variables, or the attributes that are JSON, aren't those that a function of
    saltus returned.
    """
    try:
        kinds = {
            "equations": list,
            "varied_parameters": list,
            "parameters": dict,
            "units": dict,
            "method_options": dict,
            "versions": dict,
        }
        plain = all(
            isinstance(json.loads(ds.attrs[name]), kind)
            for name, kind in kinds.items()
            if name in ds.attrs
        )
    except (ValueError, TypeError, RecursionError):
        plain = False
    return not plain or ds.attrs.get("result_hash") != content_hash(ds)
