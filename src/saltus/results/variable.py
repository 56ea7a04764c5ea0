"""One line of the tables of the schema."""

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
