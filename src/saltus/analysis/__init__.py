"""Analyses: one file per question a scientist asks. They speak to flows only, and answer with Datasets."""

from saltus.analysis.attractors import attractors, basin_fractions
from saltus.analysis.basins import basins
from saltus.analysis.bifurcation_diagram import bifurcation_diagram
from saltus.analysis.compare import compare
from saltus.analysis.compare_methods import compare_methods
from saltus.analysis.energy import energy_balance
from saltus.analysis.frequency_response import frequency_response
from saltus.analysis.impacts import impact_statistics
from saltus.analysis.lyapunov import lyapunov
from saltus.analysis.poincare import poincare
from saltus.analysis.settled import settled
from saltus.analysis.simulate import simulate
from saltus.analysis.spectrum import spectrum
from saltus.analysis.stroboscope import stroboscope
from saltus.analysis.transmissibility import transmissibility
from saltus.analysis.wolf import wolf

__all__ = [
    "attractors",
    "basin_fractions",
    "basins",
    "bifurcation_diagram",
    "compare",
    "compare_methods",
    "energy_balance",
    "frequency_response",
    "impact_statistics",
    "lyapunov",
    "poincare",
    "settled",
    "simulate",
    "spectrum",
    "stroboscope",
    "transmissibility",
    "wolf",
]
