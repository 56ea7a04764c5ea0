"""The named outputs of a system as data: formulas of its motion, with their units."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from saltus.contact.guards import Guard, renumbered
from saltus.language.expression import Expr, substituted


@dataclass(frozen=True, eq=False)
class NamedOutputs:
    """Named functions of the motion of a system, such as a sensor or a force.

    Attributes
    ----------
    names : tuple of str
        Their names.
    units : tuple of str
        Coherent SI unit of each, ``""`` where it isn't known.
    formulas : tuple of Expr
        What they are; conditions hold bits.
    guards : tuple of Guard
        The boundaries of these conditions that aren't boundaries of the system. No motion is
        stopped there: they are read off a motion that is known.
    after : int
        Number of the first of these guards: that of the guards of the system itself.
    first : bool
        True if they stand before the states in pictures and tables, as the sensors of a structure
        do whose states are coordinates of modes.
    """

    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    formulas: tuple[Expr, ...] = ()
    guards: tuple[Guard, ...] = ()
    after: int = 0
    first: bool = False

    def __len__(self) -> int:
        return len(self.names)

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def substituted(self, new: Mapping[Expr, Expr]) -> NamedOutputs:
        """The outputs with other expressions in the places of some."""
        guards = tuple(Guard(one.name, substituted(one.gap, new)) for one in self.guards)
        formulas = tuple(substituted(one, new) for one in self.formulas)
        return replace(self, formulas=formulas, guards=guards)

    def behind(self, known: Sequence[Guard]) -> tuple[tuple[Expr, ...], tuple[Guard, ...]]:
        """The formulas and all guards, those of the outputs behind known ones, which begin with the
        guards of the system.
        """
        more = len(known) - self.after
        if not more or not self.guards:
            return self.formulas, (*known, *self.guards)
        new = {number: number for number in range(self.after)}
        new |= {self.after + i: len(known) + i for i in range(len(self.guards))}
        guards = [replace(one, gap=renumbered(one.gap, new)) for one in self.guards]
        return tuple(renumbered(one, new) for one in self.formulas), (*known, *guards)


#: A system without outputs has these.
NO_OUTPUTS = NamedOutputs()
