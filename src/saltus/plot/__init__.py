"""Pictures: a Dataset in, Axes out. Nothing is computed here, and nothing is shown: that is left to
the caller.

They come with matplotlib when the first of them is asked for: who wants colours alone
(:mod:`saltus.plot.palette`) doesn't wait for it.
"""

import importlib
import re
import sys
from types import ModuleType
from typing import Any

from saltus.errors import shown
from saltus.plot.elsewhere import picture_instead

#: Public name: module that holds it. They stand in the stub, which type checkers read too.
with open(f"{__file__}i", encoding="utf-8") as _stub:
    _HOMES = {
        name: home for home, name in re.findall(r"^from (\S+) import (\w+) as", _stub.read(), re.M)
    }
__all__ = sorted(_HOMES)


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    if name not in _HOMES:
        instead = picture_instead(name, __all__)
        raise AttributeError(f"no picture is called {shown(name)}. {instead}")
    value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


class _Pictures(ModuleType):
    """A picture and its file have one name, which is the picture's, whichever is imported first."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _HOMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Pictures
