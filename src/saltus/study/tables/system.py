"""The table [system] of a study file."""

from __future__ import annotations

from pydantic import ConfigDict, Field

from saltus.study.tables.parts import Formula, MeasuredCurve, Outputs, Quantity, StudyTable
from saltus.study.tables.structure import Structure


class SystemTable(StudyTable):
    """[system]: a model that comes with saltus, equations of your own, or a structure from
    matrices, and values of the parameters.
    """

    model_config = ConfigDict(extra="allow", strict=True, frozen=True, allow_inf_nan=False)
    __pydantic_extra__: dict[str, Quantity] = Field(init=False)

    model: str | None = Field(
        None, description="A published system; `saltus models` lists them.", examples=["delangre"]
    )
    case: str | None = Field(
        None, description="A named set of values of the model.", examples=["b"]
    )

    rates: dict[str, Formula] = Field(
        default_factory=dict,
        description="A system of your own: its states, and the formula of the time derivative of "
        "each. Every other key is a parameter.",
        examples=[{"x": "v", "v": "(force*cos(2*pi*frequency*t) - k*x)/mass"}],
    )
    units: dict[str, str] = Field(
        default_factory=dict,
        description="Units of states and parameters of a system of your own.",
        examples=[{"x": "m", "v": "m/s"}],
    )
    guards: dict[str, Formula] = Field(
        default_factory=dict,
        description="Names for the boundaries of a system of your own, each with its comparison.",
        examples=[{"teeth": "x2 - x1 > gap"}],
    )
    forced_at: str | None = Field(
        None,
        description="The parameter of a system of your own that is the forcing frequency.",
        examples=["frequency"],
    )
    check_units: bool = Field(
        True,
        description="Whether units of what a formula of the rates adds or compares must be "
        "the same.",
        examples=[False],
    )
    structure: Structure | None = Field(
        None,
        description="A structure from matrices of mass and stiffness in files, with its contacts, "
        "forces and base.",
        examples=[{"mass": "plate.npz", "modes": 8}],
    )
    terms: dict[str, Formula] = Field(
        default_factory=dict,
        description="Formulas by name, for all other formulas of the study. One may use those "
        "before it.",
        examples=[{"contact": "k*(x - gap) if x > gap else 0"}],
    )
    tables: dict[str, MeasuredCurve] = Field(
        default_factory=dict,
        description="Curves by name, for formulas to call.",
        examples=[{"stop": {"file": "stop.csv"}}],
    )

    outputs: Outputs = Field(
        default_factory=dict,
        description="What every result holds besides the states, by name: formulas. They may be of "
        "a model or of --system too.",
        examples=[{"spring force": "k*x", "power": {"formula": "c*v**2", "unit": "W"}}],
    )

    @property
    def values(self) -> dict[str, Quantity]:
        """Parameter values as written."""
        return dict(self.__pydantic_extra__ or {})
