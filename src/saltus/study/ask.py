"""The questions of a study: planned from its tables, and asked without a file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from saltus.errors import ParameterError, StudyError, TraceError, UnitError, nearest
from saltus.study.answers import questions
from saltus.study.answers.question import Question
from saltus.study.read import parse, study_of
from saltus.study.setting.inputs import Inputs
from saltus.study.setting.setting import setting_of
from saltus.study.tables.study import Study
from saltus.study.tables.toml import fault

if TYPE_CHECKING:
    import xarray as xr

    from saltus.results.table import TextTable
    from saltus.system import System


@dataclass(frozen=True)
class Answer:
    """Answer to a question of a study.

    Attributes
    ----------
    question : Question
    dataset : Dataset
        All of it.
    rows : list of TextTable
        The answer in rows.
    """

    question: Question
    dataset: xr.Dataset
    rows: list[TextTable]

    @property
    def figure(self) -> Any:
        """The usual picture, drawn now; None if there is none."""
        from saltus import plot

        with plot.style():
            return next(iter(self.question.pictures(self.dataset).values()), None)


def ask(
    study: str | Mapping[str, Any],
    *,
    own: System | None = None,
    inputs: Inputs | None = None,
    only: Sequence[str] = (),
    threads: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[Answer]:
    """Answer the questions of a study without writing a file.

    Parameters
    ----------
    study : str or mapping
        A study as TOML, or the tables that TOML would hold.
    own : System, optional
        The system, if it isn't one of saltus's models.
    inputs : Inputs, optional
        Files that the study names; by default none may be read.
    only : sequence of str
        Names of questions to answer; by default all.
    threads : int, optional
        Default all processors.
    progress : callable, optional
        Called with the share done of all questions, counted alike.

    Returns
    -------
    list of Answer
        One for each question, in the order in which they are answered.

    Raises
    ------
    StudyError, UnitError, ParameterError
        If it isn't a study, or doesn't fit its system, before anything is computed.
    Interrupted
        On Ctrl-C, or where the work is asked to stop (:class:`saltus.interrupt.Stop`); its
        ``partial`` is the Dataset of the question that was being answered.
    """
    read = parse(study) if isinstance(study, str) else study_of(study)
    asked = questions_of(read, own, inputs or NoInputs(), only)
    found: dict[str, xr.Dataset] = {}
    answers = []
    for number, question in enumerate(asked):

        def show(share: float, done: int = number) -> None:
            if progress is not None:
                progress((done + share) / len(asked))

        with naming_table(question.place):
            found[question.stem] = question.compute(found, threads, show)
            answers.append(
                Answer(question, found[question.stem], question.rows(found[question.stem], found))
            )
    return answers


class NoInputs(Inputs):
    """Inputs of a study that may read no file."""

    def __init__(self) -> None:
        super().__init__(Path())

    def _find(self, name: str, place: str) -> Path:
        raise StudyError(
            f"[{place}] names the file {name!r}, and no file may be read here. Leave "
            f"it out, or run the study as a file."
        )


@contextmanager
def naming_table(table: str) -> Iterator[None]:
    """A context in which errors in arguments of an analysis name the table of the study."""
    try:
        yield
    except (ParameterError, TraceError, UnitError) as error:
        raise fault(table, error) from error


def questions_of(
    study: Study, own: System | None, inputs: Inputs, only: Sequence[str] = ()
) -> list[Question]:
    """Questions of a study, or some of them, checked against its system.

    Raises
    ------
    StudyError, UnitError, ParameterError
        If one doesn't fit the system, two would write the same files, or ``only`` names none.
    """
    setting = setting_of(study, own, inputs)
    of_system = inputs.taken
    asked: list[Question] = []
    for name, table in study.questions():
        with naming_table(name):
            asked += questions()[name].make(table, setting)
    for question in asked:
        question.join(asked)
    stems = [stem for question in asked for stem in question.stems]
    twice = sorted({stem for stem in stems if stems.count(stem) > 1})
    if twice:
        raise StudyError(
            f"names of this study give the same file names, such as {twice[0]}. Let "
            f"them differ in letters or digits."
        )
    known = {name for question in asked for name in _names(question)}
    for name in only:
        if name not in known:
            raise StudyError(
                f"--only {name}: this study has no such question. {nearest(name, known)}"
            )
    chosen = {
        stem
        for question in asked
        if not only or _names(question) & set(only)
        for stem in (question.stem, *question.needs)
    }
    for question in asked:
        question.inputs = [*of_system, *question.inputs]
    return [question for question in asked if question.stem in chosen]


def _names(question: Question) -> set[str]:
    """Return the names by which a question may be called."""
    return {
        name for name in (question.place, question.group, question.title, question.stem) if name
    }
