"""Flows: methods that move states and cross contacts. Arrays in, arrays out; people use
:mod:`saltus.analysis`.
"""

from saltus.flow.methods import ODE23, ODE45, ODE113, RK4, Modal, ODE15s, Taylor
from saltus.interrupt import Interrupted

__all__ = ["ODE23", "ODE45", "ODE113", "RK4", "Interrupted", "Modal", "ODE15s", "Taylor"]
