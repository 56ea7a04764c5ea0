"""The System layer: equations of motion with contacts, traced from a Python function.

>>> from saltus.system import cos, freeplay, pi, system
>>> @system(states="x v", forced_at="frequency")
... def rig(t, x, v, *, stiffness=1.4e4, gap=4e-4, force=4.0, frequency=15.0):
...     return v, force * cos(2 * pi * frequency * t) - freeplay(x, stiffness=stiffness, gap=gap)
>>> [guard.name for guard in rig.guards]
['x = -gap', 'x = gap']
"""

import sys
from types import ModuleType

from saltus.system.clocks import mod
from saltus.system.compositions import (
    acos,
    asin,
    atan2,
    clip,
    cosh,
    friction,
    heaviside,
    hypot,
    sign,
    sinh,
    where,
)
from saltus.system.declared import impact, jump
from saltus.system.functions import (
    abs,
    atan,
    cos,
    exp,
    log,
    max,
    min,
    pi,
    piecewise,
    sin,
    sqrt,
    tan,
    tanh,
)
from saltus.system.guards import Guard
from saltus.system.inputs import pulse, recorded, sawtooth, square
from saltus.system.laws import flores, freeplay, hertz, hunt_crossley, lankarani_nikravesh
from saltus.system.memory import iwan, play, slider
from saltus.system.regularisation import regularise
from saltus.system.rotors import clearance
from saltus.system.structures import Contact, Force, structure
from saltus.system.system import System
from saltus.system.tables import table
from saltus.system.trace import system

__all__ = [
    "Contact", "Force", "Guard", "System", "abs", "acos", "asin", "atan", "atan2", "clearance",
    "clip", "cos", "cosh", "exp", "flores", "freeplay", "friction", "heaviside", "hertz",
    "hunt_crossley", "hypot", "impact", "iwan", "jump", "lankarani_nikravesh", "log", "max",
    "min", "mod", "pi", "piecewise", "play", "pulse", "recorded", "regularise", "sawtooth", "sign",
    "sin", "sinh", "slider", "sqrt", "square", "structure", "system", "table", "tan", "tanh",
    "where",
]  # fmt: skip


class _CallableModule(ModuleType):
    """Lets ``saltus.system`` be the decorator, although importing this folder binds that name to
    the module.
    """

    __call__ = staticmethod(system)


sys.modules[__name__].__class__ = _CallableModule
