"""Setting that all questions of a study share: its system, its method, the files that it names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from inspect import signature
from typing import TYPE_CHECKING, Any

from saltus import flow
from saltus.errors import ParameterError, SaltusError, StudyError, nearest
from saltus.flow.methods import default_method
from saltus.study.setting import quantities
from saltus.study.setting.curves import curve_of
from saltus.study.setting.structures import structure_of
from saltus.study.tables.toml import fault
from saltus.system.formula import Equations, Formula, Formulas

if TYPE_CHECKING:
    from saltus.study.setting.inputs import Inputs
    from saltus.study.tables.parts import Header, Output, Quantity, StudyTable
    from saltus.study.tables.study import Study
    from saltus.study.tables.system import SystemTable
    from saltus.system import System


@dataclass(frozen=True)
class Setting:
    """Setting that the questions of one study share.

    Attributes
    ----------
    study : Study
    base : System
        With the values of [system].
    inputs : Inputs
        The files that the study names.
    formulas : Formulas
        The terms and tables that its formulas share.
    """

    study: Study
    base: System
    inputs: Inputs
    formulas: Formulas = field(default_factory=Formulas)

    def system(self, values: Any, place: str) -> System:
        """The system with the values of one question."""
        return _with_values(self.base, values, place) if values else self.base

    def formula(self, text: str, place: str) -> Formula:
        """A formula of the study. Raises StudyError if it can't be read."""
        try:
            return self.formulas.formula(text)
        except SaltusError as error:
            raise fault(place, error) from None

    def outputs(
        self, system: System, given: Mapping[str, Output], place: str
    ) -> dict[str, Any] | None:
        """Outputs as the analyses take them, checked now: errors come before anything
        is computed.
        """
        from saltus.analysis.inputs.outputs import outputs_of

        place = f"{place}.outputs"
        outputs = {
            name: (self.formula(one.formula, place), one.unit) for name, one in given.items()
        }
        try:
            outputs_of(system, outputs)
        except SaltusError as error:
            raise fault(place, error) from None
        return outputs or None

    def method(self, own: StudyTable | None, place: str) -> Any:
        """Method of one question: its own, which the table ``place`` holds, or the study's, or the
        one that serves the system.
        """
        if own is not None:
            return method_of(own, self.base, place)
        return method_of(self.study.method, self.base)


def setting_of(study: Study, own: System | None, inputs: Inputs) -> Setting:
    """The setting of a study: its system, the names that its formulas share, and their files.

    Raises
    ------
    StudyError, UnitError, ParameterError
        If the system can't be made, or a file can't be read.
    """
    formulas = formulas_of(study.system, inputs)
    system = system_of(study.system, own, formulas, study.study, inputs)
    return Setting(study, system, inputs, formulas)


def formulas_of(table: SystemTable, inputs: Inputs) -> Formulas:
    """The terms and tables of [system]. Raises StudyError if one can't be read."""
    tables = {
        name: curve_of(inputs.read(one.file, f"system.tables.{name}"), one, name)
        for name, one in table.tables.items()
    }
    try:
        return Formulas(table.terms, tables)
    except SaltusError as error:
        raise fault("system", error) from None


def system_of(
    table: SystemTable,
    own: System | None = None,
    formulas: Formulas | None = None,
    header: Header | None = None,
    inputs: Inputs | None = None,
) -> System:
    """The system that [system] names or writes out, with its values; ``inputs`` are the files that
    it may name.

    Raises
    ------
    StudyError
        If there is none, or more than one, or a value lacks its unit.
    ParameterError, UnitError
        If the model, the case or a value is refused.
    """
    from saltus import models

    kinds = {
        "a model": table.model or table.case, "rates": table.rates, "structure": table.structure,
        "--system": own,
    }  # fmt: skip
    if len(given := [kind for kind, one in kinds.items() if one]) > 1:
        raise StudyError(f"[system] {' and '.join(given)}: these are several systems. Keep one.")
    own_keys = [
        key
        for key in ("units", "guards", "forced_at", "check_units")
        if key in table.model_fields_set
    ]
    if not table.rates and own_keys:
        raise StudyError(
            f"[system] {', '.join(own_keys)}: this is for equations of your own. Give "
            f"rates, or leave it out."
        )
    if own is not None:
        base = own
    elif table.rates:
        base = _written(table, formulas or Formulas(), header)
    elif table.structure is not None:
        assert inputs is not None, "a structure names files"
        base = structure_of(table.structure, inputs, formulas or Formulas(), header)
    elif table.model is None:
        raise StudyError(
            '[system] names no model. Write model = "delangre" (`saltus models` lists them), give '
            "rates or a structure, or --system my_rig.py:rig."
        )
    else:
        try:
            model = models.find(table.model)
            if table.case is not None and "case" not in signature(model).parameters:
                raise StudyError(f"[system] case: {table.model} has no cases.")
            base = model() if table.case is None else model(table.case)
        except ParameterError as error:
            raise fault("system", error) from None
    with_values = _with_values(base, table.values, "system")
    return _with_outputs(with_values, table.outputs, formulas or Formulas())


def _with_values(system: System, values: Mapping[str, Quantity], place: str) -> System:
    """System with the values of a table. Raises StudyError or UnitError if one is refused."""
    given = quantities.parameters(system, values, place)
    try:
        return system.with_values(**given)
    except ParameterError as error:
        raise fault(place, error) from None


def _with_outputs(system: System, given: Mapping[str, Output], formulas: Formulas) -> System:
    """System with the outputs of a table. Raises StudyError if one is refused."""
    try:
        outputs = {name: (formulas.formula(one.formula), one.unit) for name, one in given.items()}
        return system.with_outputs(outputs) if outputs else system
    except SaltusError as error:
        raise fault("system.outputs", error) from None


def _written(table: SystemTable, formulas: Formulas, header: Header | None) -> System:
    """The system whose equations stand in [system]."""
    from saltus.system import system

    try:
        rates = {name: formulas.formula(text) for name, text in table.rates.items()}
        used = {name for rate in rates.values() for name in rate.names} | (
            {table.forced_at} if table.forced_at else set()
        )
        if unused := [name for name in table.values if name not in used]:
            unknown = sorted(used - {*rates, *table.values, "t"})
            advice = "Take it out, or write it into one."
            raise StudyError(
                f"[system] {unused[0]!r} stands in no rate. "
                f"{nearest(unused[0], unknown) if unknown else advice}"
            )
        equations = Equations(rates, table.values, header.description if header else "")
        title, source = (header.name, header.source) if header else ("system", "")
        guards = {name: formulas.formula(text) for name, text in table.guards.items()}
        return system(
            states=list(rates),
            units=table.units,
            forced_at=table.forced_at,
            guards=guards,
            check_units=table.check_units,
            name=title,
            source=source,
        )(equations)
    except StudyError:
        raise
    except SaltusError as error:
        raise fault("system", error) from None


def method_of(table: StudyTable | None, system: System, place: str = "method") -> Any:
    """The method that a table describes; without one that which serves the system. Raises
    StudyError if it doesn't take one of the options.
    """
    if table is None:
        return default_method(system)
    options = table.model_dump(exclude_unset=True)
    try:
        return getattr(flow, options.pop("name"))(**options)
    except ParameterError as error:
        raise fault(place, error) from None
