"""Flows: methods that integrate states through contacts. They take and return arrays; users call
:mod:`saltus.analysis`.
"""

from saltus.flow.methods import ODE23, ODE45, ODE113, RK4, Modal, ODE15s, Taylor
from saltus.interrupt import Interrupted

__all__ = ["ODE23", "ODE45", "ODE113", "RK4", "Interrupted", "Modal", "ODE15s", "Taylor"]
