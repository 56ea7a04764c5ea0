"""Parts of every study besides its questions."""

from __future__ import annotations

from collections.abc import Iterator

from pydantic import Field

from saltus.study.tables.methods import Method
from saltus.study.tables.parts import Header, StudyTable
from saltus.study.tables.system import SystemTable


class Compare(StudyTable):
    """[compare]: compare contact times with printed ones, and with exact ones."""

    printed: str = Field(
        description="CSV in the study's folder: marker, event_number, time_s, "
        "and, if printed, position_minus_boundary_m.",
        examples=["table2.csv"],
    )
    exact: str | None = Field(
        None,
        description="CSV in the study's folder: event_number, time_s.",
        examples=["exact_events.csv"],
    )
    reference: Method | None = Field(
        None,
        description="A second method to run on the same system.",
        examples=[{"name": "Taylor"}],
    )


class Study(StudyTable):
    """A study file: one system, a method, and any number of questions."""

    study: Header
    system: SystemTable = SystemTable()
    method: Method | None = Field(
        None,
        description="How to integrate. Default: Taylor, or Modal from eight states on where it "
        "serves.",
        examples=[{"name": "Taylor"}],
    )
    compare: Compare | None = None

    def questions(self) -> Iterator[tuple[str, StudyTable]]:
        """Name and table of every question, in the order in which they are answered."""
        raise NotImplementedError

    def answers(self) -> Iterator[tuple[str, str]]:
        """Title and stem of the file of every question whose answer is one Dataset."""
        raise NotImplementedError
