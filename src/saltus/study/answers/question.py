"""Questions of a study: each computes its Dataset, puts it into rows, draws it. Nothing here writes
a file.
"""

from __future__ import annotations

import functools
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

from saltus.errors import SaltusError, StudyError
from saltus.results.dataset.schema import KINDS, kind_of
from saltus.study.identity import identity
from saltus.study.setting.arguments import arguments, system_of_question
from saltus.study.tables.signature import verb
from saltus.study.tables.toml import fault

if TYPE_CHECKING:
    import xarray as xr

    from saltus.results.store.division import Division
    from saltus.results.table import TextTable
    from saltus.study.setting.inputs import Input
    from saltus.study.setting.setting import Setting
    from saltus.study.tables.signature import Generated
    from saltus.study.tables.study import Study

#: A function that makes the questions of a table of a study.
Make = Callable[[Any, "Setting"], "list[Question]"]
M = TypeVar("M", bound="Make | type[OneVerb]")


@dataclass(frozen=True)
class RegisteredTable:
    """Table of study files that asks a question.

    Attributes
    ----------
    rank : int
        Rank among the questions, which are answered in this order: the quick ones first.
    table : type
        The table.
    make : callable
        Its questions.
    files : callable
        Title and stem of each file of a table that can be known from the study alone.
    """

    rank: int
    table: type[Generated]
    make: Make
    files: Callable[[Any, Study], list[tuple[str, str]]]


#: Every table that asks something, by its name; those of the files beside this one.
REGISTER: dict[str, RegisteredTable] = {}


def asked(
    rank: int,
    table: Any,
    files: Callable[[Any, Study], list[tuple[str, str]]] = lambda one, _: [(one.title, one.stem)],
) -> Callable[[M], M]:
    """Register a table with its answer: a class of questions of one function, or a callable that
    makes the questions of a table.
    """

    def entered(answer: M) -> M:
        question_type: Any = answer
        make = question_type
        if isinstance(answer, type):
            question_type.place, question_type.function = table.place, table.function
            make = lambda asked, setting: [question_type(asked, setting)]  # noqa: E731
        REGISTER[table.place] = RegisteredTable(rank, table, make, files)
        return answer

    return entered


#: Datasets that answer a study, by the stems of their files.
Answers = Mapping[str, "xr.Dataset"]
#: Callable that takes the share done.
Show = Callable[[float], None]


class Question(ABC):
    """Question of a study whose answer is one Dataset. All checks that need no computation are done
    when it is made.

    Attributes
    ----------
    title : str
        Its name in tables and pictures.
    stem : str
        Stem of the names of its files.
    place : str
        The table of the study that asks it.
    group : str
        Name that it shares with other questions, besides its table.
    needs : tuple of str
        Stems of the questions whose answers it takes.
    shared : bool
        Whether every job (shard) answers it that has the answers it needs; else, if it doesn't
        divide into chunks, one of them takes it.
    all_rows : str
        End of the name of a CSV file of every row of the Dataset; "" if the table holds them all.
    inputs : list of Input
        Files that take part in the answer.
    whole : str
        Reason why its work has no chunks, a sentence without its end.
    """

    title: str
    stem: str
    place: str = ""
    group: str = ""
    needs: tuple[str, ...] = ()
    shared: bool = False
    all_rows: str = ""
    inputs: Sequence[Input] = ()
    whole: str = "is answered at once"

    @property
    def stems(self) -> tuple[str, ...]:
        """Stems of all its files."""
        return (self.stem,)

    def identity(self) -> dict[str, str] | None:
        """Texts that must be the same for a file to hold the answer; None if the answer follows at
        once from other answers.
        """
        return None

    @functools.cached_property
    def division(self) -> Division | str:
        """Its work in independent chunks; the reason why it doesn't divide, a sentence without its
        end, if it doesn't.
        """
        return self.whole

    def join(self, asked: Sequence[Question]) -> None:  # noqa: ARG002
        """Find the questions whose answers this question needs. Raises StudyError if there are
        none.
        """
        return

    @abstractmethod
    def compute(self, found: Answers, threads: int | None, progress: Show) -> xr.Dataset:
        """The answer."""

    def rows(self, ds: xr.Dataset, found: Answers) -> list[TextTable]:  # noqa: ARG002
        """The answer in rows: tables to print, the first of which is the CSV file."""
        return KINDS[kind_of(ds)].rows(self.title, ds)

    @abstractmethod
    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """Figures by the end of their file names; the first one is the usual one."""

    def pictures_with(self, found: Answers) -> dict[str, Any]:  # noqa: ARG002
        """Figures in which other answers stand too, by the end of their file names."""
        return {}


class OneVerb(Question):
    """Question that one function of the analyses answers. Its table was made from the parameters of
    the function.

    Parameters
    ----------
    table : Generated
        Arguments of the function, from the study.
    setting : Setting
        Of the study.

    Raises
    ------
    StudyError, UnitError, ParameterError
        If it doesn't fit the system, before anything is computed.
    """

    whole = "is computed as a whole"
    #: Name of the function, and of its argument that says how to integrate.
    function: ClassVar[str] = ""
    how: ClassVar[str] = "method"

    def __init__(self, table: Any, setting: Setting) -> None:
        self.title, self.stem = self.names(table, setting)
        self.system = system_of_question(table, setting, self.place)
        self.method = setting.method(getattr(table, self.how, None), f"{self.place}.{self.how}")
        self.check_first(table)
        self.arguments = arguments(table, self.system, setting, self.place)
        try:
            self.check(table, setting)
        except StudyError:
            raise
        except SaltusError as error:
            raise fault(self.place, error) from error

    def names(self, table: Any, setting: Setting) -> tuple[str, str]:  # noqa: ARG002
        """Title, and stem of the files."""
        return table.title, table.stem

    def check_first(self, table: Any) -> None:  # noqa: ARG002
        """Refuse a table that doesn't fit the system, before quantities are read."""
        return

    def check(self, table: Any, setting: Setting) -> None:  # noqa: ARG002
        """Refuse what doesn't fit the system, and complete the arguments."""
        return

    def identity(self) -> dict[str, str]:
        """Texts that must be the same for a file to hold the answer."""
        return identity(self.system, self.method, self.arguments)

    def compute(self, found: Answers, threads: int | None, progress: Show) -> xr.Dataset:  # noqa: ARG002
        """Call the function."""
        try:
            return self.call({self.how: self.method, "threads": threads, "progress": progress})
        except SaltusError as error:
            raise fault(self.place, error) from error

    def call(self, how: dict[str, Any]) -> xr.Dataset:
        """Compute the answer; ``how`` holds the method, the threads and the progress callable."""
        ds: xr.Dataset = verb(self.function)(self.system, **(self.arguments | how))
        return ds

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """The usual picture of such a result, if there is one, under the title of the question."""
        from saltus import plot
        from saltus.plot.choice import default_kind

        kind = default_kind(ds)
        if not kind:
            return {}
        first = first_axes(getattr(plot, kind)(ds))
        first.set_title(self.title, loc="left")
        return {"": first.figure}


def first_axes(axes: Any) -> Any:
    """The Axes, or the first of the array of Axes, that a picture returns."""
    return axes.flat[0] if hasattr(axes, "flat") else axes


def first_figure(axes: Any) -> Any:
    """Figure of the Axes, or of the array of Axes, that a picture returns."""
    return first_axes(axes).figure
