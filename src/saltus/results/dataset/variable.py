"""What one variable of a result is, and the variables that several kinds of result share."""

from __future__ import annotations

from dataclasses import dataclass, replace


@dataclass(frozen=True)
class Variable:
    """What one variable of a result is.

    Attributes
    ----------
    dims : tuple of str
        Dims of one trajectory.
    units : str
        SI unit, ``"1"`` for a plain number, ``""`` for text.
    long_name : str
        A few words, as on an axis.
    dtype : str
        ``f8``, ``i8``, ``i4``, ``i2``, ``i1`` or ``str``.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    dtype: str = "f8"

    def along(self, dim: str) -> Variable:
        """The same variable with one more dim in front."""
        return replace(self, dims=(dim, *self.dims))


#: Of each trajectory.
STATUS = Variable((), "", "how the trajectory ended", "str")
COUNTERS = {
    "events": Variable((), "1", "contacts", "i8"),
    "grazes": Variable((), "1", "grazes", "i8"),
    "grazes_unresolved": Variable((), "1", "grazes shallower than the local error", "i8"),
    "steps": Variable((), "1", "accepted steps", "i8"),
    "rejected_steps": Variable((), "1", "rejected steps", "i8"),
    "mode_violations": Variable((), "1", "accepted steps that ended on the wrong side of a guard", "i8"),
}
MINIMA = {
    "smallest_contact_speed": Variable((), "<gap rate>", "smallest gap rate at a contact"),
    "smallest_gap_margin": Variable((), "<gap>", "smallest distance of a turning point of the gap from a guard"),
}
#: The guards of the system.
GUARDS = {
    "guard": Variable(("guard",), "", "guard", "str"),
    "guard_state": Variable(("guard",), "", "state that the guard bounds", "str"),
    "guard_boundary": Variable(("guard",), "<gap>", "value of the state on the guard"),
    "guard_units": Variable(("guard",), "", "unit of the gap", "str"),
}

TRAJECTORY_NUMBER = Variable((), "1", "trajectory", "i8")
FORCING_PERIOD = Variable((), "s", "forcing period")
