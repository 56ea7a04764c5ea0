"""Pictures: a Dataset in, Axes out. Nothing is computed here, and nothing is shown: that is left to
the caller.
"""

from typing import Any

from saltus.errors import shown
from saltus.plot.agreement import agreement
from saltus.plot.backbone import backbone
from saltus.plot.basins import basins
from saltus.plot.bifurcation import bifurcation_diagram
from saltus.plot.bifurcation_curves import bifurcation_curves
from saltus.plot.branches import branches
from saltus.plot.elsewhere import picture_instead
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


def __getattr__(name: str) -> Any:
    if name.startswith("__"):
        raise AttributeError(name)
    raise AttributeError(f"no picture is called {shown(name)}. {picture_instead(name, __all__)}")
