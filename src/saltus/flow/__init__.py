"""Flows: methods that move states and cross contacts. Arrays in, arrays out; people use
:mod:`saltus.analysis`.
"""

from saltus.flow.methods import ODE45, Taylor
from saltus.interrupt import Interrupted

__all__ = ["ODE45", "Interrupted", "Taylor"]
