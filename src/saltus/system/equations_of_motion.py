"""Equations of motion as data: the fields of a System, for the files that it is built on."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from saltus.contact.guards import Guard
from saltus.errors import must_be
from saltus.language.expression import Expr
from saltus.system.named_outputs import NO_OUTPUTS, NamedOutputs


@dataclass(frozen=True, eq=False, repr=False)
class EquationsOfMotion:
    """Equations of motion with contacts, and values of their parameters. The attributes are those
    of a System, and are described there.
    """

    name: str
    states: tuple[str, ...]
    field: tuple[Expr, ...]
    guards: tuple[Guard, ...]
    values: Mapping[str, float]
    units: Mapping[str, str]
    forced_at: str | None = None
    source: str = ""
    description: str = ""
    made: int = 0
    tangent_of: EquationsOfMotion | None = None
    tangent_by: tuple[str, ...] = ()
    outputs: NamedOutputs = NO_OUTPUTS

    def period(self, values: Mapping[str, Any] | None = None) -> Any:
        """Forcing period T [s]; None for a system that isn't forced.

        Parameters
        ----------
        values : mapping of str to float or array, optional
            Values [SI] that replace the system's own; with an array of frequencies the result is an
            array.
        """
        if self.forced_at is None:
            return None
        if values is not None and not isinstance(values, Mapping):
            raise must_be("values", f"a mapping, such as {{{self.forced_at!r}: 15.0}}", values)
        frequency = (values or {}).get(self.forced_at, self.values[self.forced_at])
        try:
            return (2 * math.pi if self.units[self.forced_at] == "rad/s" else 1.0) / frequency
        except (TypeError, ArithmeticError):
            raise must_be(
                f"{self.forced_at}", "a positive number or an array of them", frequency
            ) from None
