"""Structures: systems made of matrices of mass, damping and stiffness, and contacts as data."""

from saltus.system.structures.parts import Base, Contact, Force
from saltus.system.structures.sensors import acceleration, contact_force, velocity
from saltus.system.structures.structure import structure

__all__ = [
    "Base", "Contact", "Force", "acceleration", "contact_force", "structure", "velocity",
]  # fmt: skip
