"""Texts of a result: control characters, which a terminal would obey, are refused in writing and in
reading.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

from saltus.fence import has_control


def place_of_control(ds: xr.Dataset) -> str:
    """Locate the first control character among names, texts and attributes, such as ``the attribute
    'source'``; "" if there is none.
    """
    for place, text in _texts(ds):
        if has_control(text):
            return place
    return ""


def _texts(ds: xr.Dataset) -> Iterator[tuple[str, str]]:
    yield from _attributes(ds.attrs, "")
    for name, variable in ds.variables.items():
        yield f"the name of the variable {str(name)!a}", str(name)
        yield from _attributes(variable.attrs, f" of {str(name)!a}")
        if variable.dtype.kind in "OUST":
            for text in np.unique(np.asarray(variable.values).astype(str)):
                yield f"the variable {str(name)!a}", str(text)


def _attributes(attrs: Any, owner: str) -> Iterator[tuple[str, str]]:
    for key, value in attrs.items():
        yield f"the attribute {str(key)!a}{owner}", f"{key}{value}"
