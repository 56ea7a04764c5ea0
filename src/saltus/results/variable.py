"""One line of the tables of the schema, and the lines that several tables share."""

from __future__ import annotations

from dataclasses import dataclass


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


#: The guards of a system, in every kind of result that has them.
GUARD_VARIABLES = {
    "guard": Variable(("guard",), "", "guard", "str"),
    "guard_state": Variable(("guard",), "", "state that the guard bounds", "str"),
    "guard_boundary": Variable(("guard",), "<gap>", "value of the state on the guard"),
    "guard_units": Variable(("guard",), "", "unit of the gap", "str"),
}
