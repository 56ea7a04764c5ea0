"""Schema of a study file: one class a table, every key typed, unknown keys refused. The tables of
the questions stand with their answers.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic import Field, create_model, model_validator

from saltus.study.answers import questions
from saltus.study.tables import study
from saltus.study.tables.parts import Named, StudyTable, distinct_names, one_or_many

#: Tables that ask something, in the order in which they are answered: the quick ones first.
QUESTIONS: dict[str, type[StudyTable]] = {name: entry.table for name, entry in questions().items()}
#: Those that may be asked several times, as arrays of tables.
SEVERAL = tuple(name for name, table in QUESTIONS.items() if issubclass(table, Named))


class _Asking(study.Study):
    """Study whose questions are checked together."""

    @model_validator(mode="after")
    def _fits(self) -> _Asking:
        if not list(self.questions()):
            *most, last = (f"[{name}]" for name in QUESTIONS)
            raise ValueError(f"a study asks something: it has a table {', '.join(most)} or {last}")
        if self.compare is not None and getattr(self, "simulate", None) is None:
            raise ValueError(
                "[compare] goes with [simulate]; maps are compared with compare = in [[basins.map]]"
            )
        for name in SEVERAL:
            distinct_names(getattr(self, name), name)
        return self

    def questions(self) -> Iterator[tuple[str, StudyTable]]:
        """Name and table of every question, in the order in which they are answered."""
        for name in QUESTIONS:
            tables = getattr(self, name)
            for table in tables if isinstance(tables, list) else [tables]:
                if table is not None:
                    yield name, table

    def answers(self) -> Iterator[tuple[str, str]]:
        """Title and stem of the file of every question whose answer is one Dataset."""
        for name, table in self.questions():
            yield from questions()[name].files(table, self)


def _key(name: str, table: type[StudyTable]) -> Any:
    """Type and Field of the key of a question."""
    if name in SEVERAL:
        return one_or_many(table), Field(default_factory=list)
    return table | None, None


#: A study file.
Study: type[study.Study] = create_model(
    "Study",
    __base__=_Asking,
    __module__=__name__,
    __doc__=study.Study.__doc__,
    **{name: _key(name, table) for name, table in QUESTIONS.items()},
)
