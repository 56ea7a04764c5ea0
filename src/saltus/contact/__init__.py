"""Contacts: the boundaries in an equation, the forces and laws of contact, and the equations while
a contact is held.

>>> from saltus.contact import freeplay
>>> freeplay(0.5e-3, stiffness=1.4e4, gap=0.4e-3)  # doctest: +ELLIPSIS
1.4...
"""

from saltus.contact.blend import STEPS
from saltus.contact.declared import impact, jump
from saltus.contact.dry_friction import friction
from saltus.contact.forces import flores, freeplay, hertz, hunt_crossley, lankarani_nikravesh
from saltus.contact.guards import Guard
from saltus.contact.memory import iwan, play, slider
from saltus.contact.rotors import clearance

__all__ = [
    "STEPS", "Guard", "clearance", "flores", "freeplay", "friction", "hertz", "hunt_crossley",
    "impact", "iwan", "jump", "lankarani_nikravesh", "play", "slider",
]  # fmt: skip
