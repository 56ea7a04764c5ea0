"""Pictures: a Dataset in, Axes out. Nothing is computed here, and nothing is shown: that is left to the caller."""

from saltus.plot.agreement import agreement
from saltus.plot.basins import basins
from saltus.plot.exponents import exponents
from saltus.plot.gallery import gallery
from saltus.plot.history import history
from saltus.plot.phase import phase
from saltus.plot.style import OKABE_ITO, style

__all__ = ["OKABE_ITO", "agreement", "basins", "exponents", "gallery", "history", "phase", "style"]
