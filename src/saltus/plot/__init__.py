"""Pictures: a Dataset in, Axes out. Nothing is computed or shown here: showing is left to the
caller.

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


def __dir__() -> list[str]:
    return __all__


class _Pictures(ModuleType):
    """Module in which a picture keeps its name if its file has the same name, in any order of
    imports.
    """

    def __call__(self, *_: Any, **__: Any) -> None:
        raise TypeError(
            "sl.plot holds the pictures: write sl.plot.history(run), or another of "
            f"{', '.join(__all__)}."
        )

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in _HOMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Pictures
