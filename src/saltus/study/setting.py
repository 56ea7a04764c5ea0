"""What all questions of a study share: its system, its method, the files that it names."""

from __future__ import annotations

from dataclasses import dataclass
from inspect import signature
from typing import TYPE_CHECKING, Any

from saltus.errors import StudyError
from saltus.study import quantities

if TYPE_CHECKING:
    from saltus.study.inputs import Inputs
    from saltus.study.spec import Study
    from saltus.study.spec_parts import SystemTable
    from saltus.study.spec_parts import Table as SpecTable
    from saltus.system import System


@dataclass(frozen=True)
class Setting:
    """What the questions of one study share.

    Attributes
    ----------
    study : Study
    base : System
        With the values of [system].
    inputs : Inputs
        The files that the study names.
    """

    study: Study
    base: System
    inputs: Inputs

    def system(self, values: Any, place: str) -> System:
        """The system with the values of one question."""
        return self.base.with_values(**quantities.parameters(self.base, values, place)) if values else self.base

    def method(self, own: SpecTable | None = None) -> Any:
        """The method of one question: its own, or the study's."""
        return method_of(own or self.study.method)


def system_of(table: SystemTable, own: System | None = None) -> System:
    """The system that [system] names, with its values.

    Raises
    ------
    StudyError
        If neither or both of the table and the command line give a system, or a value lacks its unit.
    ParameterError, UnitError
        If the model, the case or a value is refused.
    """
    from saltus import models

    if own is not None:
        if table.model is not None or table.case is not None:
            raise StudyError("[system] names a model, and --system gives another system. Keep one of the two.")
        base = own
    elif table.model is None:
        raise StudyError('[system] names no model. Write model = "delangre" (`saltus models` lists them), or give --system my_rig.py:rig.')
    else:
        model = models.find(table.model)
        if table.case is not None and "case" not in signature(model).parameters:
            raise StudyError(f"[system] case: {table.model} has no cases.")
        base = model() if table.case is None else model(table.case)
    return base.with_values(**quantities.parameters(base, table.values))


def method_of(table: SpecTable) -> Any:
    """The method that a [method] table describes."""
    from saltus import flow

    options = table.model_dump(exclude_unset=True)
    return getattr(flow, options.pop("name"))(**options)
