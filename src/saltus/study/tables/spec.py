"""What a study file may hold: one class a table, every key typed, unknown keys refused."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field, model_validator

from saltus.study.tables.methods import METHODS, Method
from saltus.study.tables.parts import Header, Named, SystemTable, Table, distinct_names, one_or_many
from saltus.study.tables.questions import (
    REFERENCE,
    RUN,
    Backbone,
    Basins,
    BifurcationCurve,
    BifurcationDiagram,
    Branches,
    Compare,
    Energy,
    Equilibria,
    FrequencyResponse,
    Impacts,
    Lyapunov,
    PeriodicOrbits,
    Poincare,
    Simulate,
    Spectrum,
)

#: Tables that ask something, in the order in which they are answered: the quick ones first.
QUESTIONS: dict[str, type[Table]] = {
    "simulate": Simulate, "poincare": Poincare, "spectrum": Spectrum, "impacts": Impacts,
    "energy": Energy, "lyapunov": Lyapunov,
    "frequency_response": FrequencyResponse, "bifurcation_diagram": BifurcationDiagram,
    "equilibria": Equilibria, "periodic_orbits": PeriodicOrbits, "branches": Branches,
    "bifurcation_curve": BifurcationCurve, "backbone": Backbone,
    "basins": Basins,
}  # fmt: skip
#: Those that may be asked several times, as arrays of tables.
SEVERAL = tuple(name for name, table in QUESTIONS.items() if issubclass(table, Named))


class Study(Table):
    """A study file: one system, a method, and any number of questions."""

    study: Header
    system: SystemTable = SystemTable()
    method: Method = METHODS["Taylor"](name="Taylor")
    simulate: Simulate | None = None
    compare: Compare | None = None
    poincare: one_or_many(Poincare) = Field(default_factory=list)  # type: ignore[valid-type]
    spectrum: one_or_many(Spectrum) = Field(default_factory=list)  # type: ignore[valid-type]
    impacts: one_or_many(Impacts) = Field(default_factory=list)  # type: ignore[valid-type]
    energy: one_or_many(Energy) = Field(default_factory=list)  # type: ignore[valid-type]
    lyapunov: one_or_many(Lyapunov) = Field(default_factory=list)  # type: ignore[valid-type]
    frequency_response: one_or_many(FrequencyResponse) = Field(default_factory=list)  # type: ignore[valid-type]
    bifurcation_diagram: one_or_many(BifurcationDiagram) = Field(default_factory=list)  # type: ignore[valid-type]
    equilibria: one_or_many(Equilibria) = Field(default_factory=list)  # type: ignore[valid-type]
    periodic_orbits: one_or_many(PeriodicOrbits) = Field(default_factory=list)  # type: ignore[valid-type]
    branches: one_or_many(Branches) = Field(default_factory=list)  # type: ignore[valid-type]
    bifurcation_curve: one_or_many(BifurcationCurve) = Field(default_factory=list)  # type: ignore[valid-type]
    backbone: one_or_many(Backbone) = Field(default_factory=list)  # type: ignore[valid-type]
    basins: Basins | None = None

    @model_validator(mode="after")
    def _fits(self) -> Study:
        if not list(self.questions()):
            *most, last = (f"[{name}]" for name in QUESTIONS)
            raise ValueError(f"a study asks something: it has a table {', '.join(most)} or {last}")
        if self.compare is not None and self.simulate is None:
            raise ValueError(
                "[compare] goes with [simulate]; maps are compared with compare = in [[basins.map]]"
            )
        for name in SEVERAL:
            distinct_names(getattr(self, name), name)
        return self

    def questions(self) -> Iterator[tuple[str, Table]]:
        """Name and table of every question, in the order in which they are answered."""
        for name in QUESTIONS:
            tables = getattr(self, name)
            for table in tables if isinstance(tables, list) else [tables]:
                if table is not None:
                    yield name, table

    def answers(self) -> Iterator[tuple[str, str]]:
        """Title and stem of the file of every question whose answer is one Dataset."""
        for _, table in self.questions():
            if isinstance(table, Named):
                yield table.title, table.stem
            elif table is self.simulate:
                yield self.study.name, RUN
                if self.compare is not None and self.compare.reference is not None:
                    yield f"{self.study.name}, reference", REFERENCE
