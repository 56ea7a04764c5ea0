"""Analyses: one file per question a scientist asks. They speak to flows only, and answer with Datasets."""

from saltus.analysis.attractors import attractors, basin_fractions
from saltus.analysis.basins import basins
from saltus.analysis.compare import compare
from saltus.analysis.lyapunov import lyapunov
from saltus.analysis.settled import settled
from saltus.analysis.simulate import simulate
from saltus.analysis.stroboscope import stroboscope
from saltus.analysis.wolf import wolf

__all__ = ["attractors", "basin_fractions", "basins", "compare", "lyapunov", "settled", "simulate", "stroboscope", "wolf"]
