"""The System: equations of motion with contacts, traced from a Python function.

>>> from saltus.contact import freeplay
>>> from saltus.language import cos, pi
>>> from saltus.system import system
>>> @system(states="x v", forced_at="frequency")
... def rig(t, x, v, *, stiffness=1.4e4, gap=4e-4, force=4.0, frequency=15.0):
...     return v, force * cos(2 * pi * frequency * t) - freeplay(x, stiffness=stiffness, gap=gap)
>>> [guard.name for guard in rig.guards]
['x = -gap', 'x = gap']
"""

import sys
from types import ModuleType

from saltus.system.checks import check_values
from saltus.system.guard_units import gap_units, margin_gaps
from saltus.system.periodic import jumps_by_time, repeats_by_formula
from saltus.system.regularisation import regularise
from saltus.system.structures import (
    Base,
    Contact,
    Force,
    acceleration,
    contact_force,
    structure,
    velocity,
)
from saltus.system.system import System
from saltus.system.trace import system

__all__ = [
    "Base", "Contact", "Force", "System", "acceleration", "check_values", "contact_force",
    "gap_units", "jumps_by_time", "margin_gaps", "regularise", "repeats_by_formula", "structure",
    "system", "velocity",
]  # fmt: skip


class _CallableModule(ModuleType):
    """Let ``saltus.system`` be the decorator, although importing this folder binds that name to the
    module.
    """

    __call__ = staticmethod(system)


sys.modules[__name__].__class__ = _CallableModule
