"""Pictures: a Dataset in, Axes out. Nothing is computed here, and nothing is shown: that is left to
the caller.

They come with matplotlib when the first of them is asked for: who wants colours alone
(:mod:`saltus.plot.palette`) doesn't wait for it.
"""

import importlib
import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

from saltus.errors import shown
from saltus.plot.elsewhere import picture_instead

if TYPE_CHECKING:
    from saltus.plot.agreement import agreement
    from saltus.plot.backbone import backbone
    from saltus.plot.basins import basins
    from saltus.plot.bifurcation import bifurcation_diagram
    from saltus.plot.bifurcation_curves import bifurcation_curves
    from saltus.plot.branches import branches
    from saltus.plot.exponents import exponents
    from saltus.plot.frequency_response import frequency_response
    from saltus.plot.gallery import gallery
    from saltus.plot.history import history
    from saltus.plot.measures import energy, impacts
    from saltus.plot.methods import methods
    from saltus.plot.orbits import periodic_orbits
    from saltus.plot.phase import phase
    from saltus.plot.section import section
    from saltus.plot.spectrum import spectrum
    from saltus.plot.style import OKABE_ITO, style
    from saltus.plot.type_map import type_map

__all__ = [
    "OKABE_ITO", "agreement", "backbone", "basins", "bifurcation_curves", "bifurcation_diagram",
    "branches", "energy", "exponents", "frequency_response", "gallery", "history",
    "impacts", "methods", "periodic_orbits", "phase", "section", "spectrum", "style", "type_map",
]  # fmt: skip

#: The files of those that have none of their own name.
_FILES = {
    "OKABE_ITO": "style",
    "bifurcation_diagram": "bifurcation",
    "energy": "measures",
    "impacts": "measures",
    "periodic_orbits": "orbits",
}


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    if name not in __all__:
        instead = picture_instead(name, __all__)
        raise AttributeError(f"no picture is called {shown(name)}. {instead}")
    value = getattr(importlib.import_module(f"{__name__}.{_FILES.get(name, name)}"), name)
    globals()[name] = value
    return value


class _Pictures(ModuleType):
    """A picture and its file have one name, which is the picture's, whichever is imported first."""

    def __setattr__(self, name: str, value: object) -> None:
        if not (name in __all__ and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Pictures
