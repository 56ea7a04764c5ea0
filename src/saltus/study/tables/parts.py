"""Parts of the tables of a study file: the strict base, quantities as written, systems, methods,
ranges.

Quantities stay as written here ("4 N"); :mod:`saltus.study.setting.quantities` turns them into SI
once the system is known.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Annotated, Any, ClassVar, Literal, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    Tag,
    model_validator,
)

from saltus.fence import MOST_COUNT, has_control

#: A quantity as written: a bare number if it has no dimension, else text with its unit.
Quantity = float | str
Start = Quantity | list[Quantity]
#: A formula as written: ``"k*(x - gap)"``.
Formula = str


def _ends(given: Any) -> Any:
    """Ends of an interval, which may be written like a range: first and last."""
    if not isinstance(given, dict):
        return given
    if "count" in given or "scale" in given:
        raise ValueError(
            "takes first and last only: how many points lie between follows from the curve"
        )
    if set(given) != {"first", "last"}:
        raise ValueError('takes { first = "2 Hz", last = "30 Hz" }, or ["2 Hz", "30 Hz"]')
    return [given["first"], given["last"]]


#: Lower and upper end: ``["2 Hz", "30 Hz"]``, or as those of a range, first and last.
Interval = Annotated[
    list[Quantity],
    Field(min_length=2, max_length=2),
    BeforeValidator(_ends, json_schema_input_type=list[Quantity] | dict[str, Quantity]),
]


def slug(name: str) -> str:
    """File name made of a name: it can't lead out of the folder."""
    return re.sub(r"[^a-z0-9.]+", "-", name.lower()).strip("-.") or "map"


def _title(name: str) -> str:
    if has_control(name) or len(name.splitlines()) != 1 or not name.strip():
        raise ValueError("must be one line of plain text")
    return name


def _file_name(name: str) -> str:
    if len(slug(name)) > LONGEST:
        raise ValueError(
            f"gives a file name of {len(slug(name))} characters; at most {LONGEST} are allowed"
        )
    return name


#: Longest name that names files too [characters].
LONGEST = 100
#: Name in tables and pictures; and in the names of files as well.
Title = Annotated[str, Field(min_length=1), AfterValidator(_title)]
FileTitle = Annotated[Title, AfterValidator(_file_name)]


class StudyTable(BaseModel):
    """A table of a study file: strict types, no unknown keys, never changed after reading."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)


class Header(StudyTable):
    """[study]: title and description, for readers."""

    name: FileTitle = Field(description="A title.", examples=["Rig b4 at 15 Hz"])
    description: str = Field(
        "", description="What the study shows.", examples=["Four starts, four responses"]
    )
    source: str = Field(
        "",
        description="Where the setting comes from.",
        examples=["Saunders et al. (2021), Table 2"],
    )


class MeasuredCurve(StudyTable):
    """[system.tables.<name>]: measured points from a file, which formulas call by their name:
    ``stop(x)``, ``drive(t)``.
    """

    file: str = Field(
        description="CSV in the study's folder: two columns, units in the headings. Where the "
        "curve is known, ascending; its values there.",
        examples=["stop.csv"],
    )
    kind: Literal["linear", "pchip", "spline"] = Field(
        "linear",
        description="Straight between the points, cubics without overshoot, or a cubic spline.",
        examples=["pchip"],
    )
    outside: Literal["hold", "extend", "periodic"] = Field(
        "hold",
        description="Before and after the points: the values at the ends, the polynomials there, "
        "or the curve again.",
        examples=["extend"],
    )


class Output(StudyTable):
    """An output: a formula, and the unit that it is in."""

    formula: Formula = Field(description="What is read off the motion.", examples=["k*(x - gap)"])
    unit: str = Field(
        "", description="Its unit; by default what the formula comes to.", examples=["N"]
    )


def _alone(given: Any) -> Any:
    """A formula alone: ``"spring force" = "k*x"``."""
    if not isinstance(given, str | dict | Output):
        raise ValueError('must be a formula, such as "k*x", or a table of a formula and its unit')
    return {"formula": given} if isinstance(given, str) else given


Outputs = dict[str, Annotated[Output, BeforeValidator(_alone, json_schema_input_type=str | Output)]]


# -- questions -------------------------------------------------------------------------------------
class Range(StudyTable):
    """Values of a parameter: from one to another, ends included, or given one by one."""

    first: Quantity | None = Field(None, description="The first value.", examples=["2 Hz"])
    last: Quantity | None = Field(None, description="The last value.", examples=["30 Hz"])
    count: int | None = Field(
        None, ge=1, le=MOST_COUNT, description="How many values.", examples=[281]
    )
    scale: Literal["linear", "log"] = Field(
        "linear",
        description="Evenly spaced in the values, or in their logarithms.",
        examples=["log"],
    )
    values: list[Quantity] | None = Field(
        None,
        min_length=1,
        description="The values themselves, ascending.",
        examples=[["5 Hz", "17 Hz"]],
    )

    @model_validator(mode="before")
    @classmethod
    def _listed(cls, given: Any) -> Any:
        """An array holds the values: ``frequency = ["5 Hz", "17 Hz"]``."""
        return {"values": given} if isinstance(given, list) else given

    @model_validator(mode="after")
    def _either(self) -> Range:
        ends = (self.first, self.last, self.count)
        if self.values is None and None in ends:
            raise ValueError(
                'needs first, last and count, such as { first = "2 Hz", last = "30 Hz", count = '
                "281 }, "
                'or an array of values, such as ["5 Hz", "17 Hz"]'
            )
        if self.values is not None and (ends != (None, None, None) or self.scale != "linear"):
            raise ValueError("has values one by one: leave first, last, count and scale out")
        return self


class Named(StudyTable):
    """Base of questions that may be asked several times."""

    #: Name of one without a name.
    called: ClassVar[str]

    name: FileTitle | None = Field(
        None,
        description="What it is called in tables, pictures and files.",
        examples=["stiff stop"],
    )

    @property
    def title(self) -> str:
        """Return the name, or the default name."""
        return self.name or self.called

    @property
    def stem(self) -> str:
        """Stem of the names of its files."""
        return slug(self.title)


#: States at the start, or how starts are found.
Starts = Annotated[
    Annotated[dict[str, Start], Tag("dict[str]")] | Annotated[str, Tag("str")],
    Discriminator(lambda given: "dict[str]" if isinstance(given, dict) else "str"),
]


T = TypeVar("T", bound=StudyTable)


def _as_list(given: Any) -> Any:
    return [given] if isinstance(given, dict) else given


def one_or_many(table: type[T]) -> Any:
    """Type of a question that may be asked once, as a table, or several times, as an array of
    tables. Its value is always a tuple.
    """
    rows = BeforeValidator(_as_list, json_schema_input_type=table | list[table])  # type: ignore[valid-type]
    return Annotated[list[table], rows]  # type: ignore[valid-type]


def distinct_names(tables: Sequence[Any], key: str) -> None:
    """Raise a ValueError if several tables have no names, or two names are equal."""
    names = [one.name for one in tables]
    if len(names) > 1 and None in names:
        raise ValueError(f"each of several [[{key}]] needs a name of its own")
    if len(set(names)) < len(names):
        raise ValueError(f"two [[{key}]] have the same name")
