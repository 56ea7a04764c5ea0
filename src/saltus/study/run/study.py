"""Run a study: from a checked file to the answers of its questions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from saltus.errors import ParameterError, StudyError, TraceError, UnitError, nearest
from saltus.results.files.atomic import remove_old_drafts
from saltus.study.answers import basins, lyapunov, responses, simulate
from saltus.study.answers.energy import Balance
from saltus.study.answers.impacts import Statistics
from saltus.study.answers.poincare import Section
from saltus.study.answers.spectrum import Lines
from saltus.study.run.copies import keep_copy
from saltus.study.run.running import Outcome, Report, Resources, Running
from saltus.study.setting.inputs import Inputs
from saltus.study.setting.setting import Setting, setting_of
from saltus.study.tables.spec import Study
from saltus.study.tables.wording import fault

if TYPE_CHECKING:
    from saltus.study.answers.question import Question
    from saltus.system import System

#: What makes a question of each table.
_PLANS: dict[str, Callable[[Any, Setting], list[Question]]] = {
    "simulate": simulate.questions,
    "poincare": Section.questions,
    "spectrum": Lines.questions,
    "impacts": Statistics.questions,
    "energy": Balance.questions,
    "lyapunov": lyapunov.questions,
    "frequency_response": responses.frequency_responses,
    "bifurcation_diagram": responses.bifurcation_diagrams,
    "basins": basins.questions,
}


def run_study(
    study: Study,
    text: str,
    folder: Path,
    own: System | None,
    resources: Resources,
    report: Callable[[Report], None],
    say: Callable[[str], None],
    pictures: bool = True,
    *,
    inputs: Inputs | None = None,
    only: Sequence[str] = (),
) -> Outcome:
    """Answer the questions of a study, or what is missing of the answers, and write what came out.

    Parameters
    ----------
    study : Study
        What to compute.
    text : str
        The file as it stands; a copy goes to the folder. :func:`saltus.study.tables.read.read` returns both.
    folder : Path
        Output: for each question a ``.nc``, a ``.csv`` and pictures; the stores of basins.
    own : System, optional
        The system, if it isn't one of saltus's models.
    resources : Resources
        What to compute with.
    report, say : callable
        Called with the progress of a question; with a sentence.
    pictures : bool
        Whether to draw.
    inputs : Inputs, optional
        The files that the study names. By default they are looked for in ``folder``.
    only : sequence of str
        Names of questions to answer; by default all.

    Raises
    ------
    StudyError, UnitError, ParameterError
        If the study doesn't fit its system: told before anything is computed.
    StoreError
        If a store in the folder was made from something else: names what differs.
    """
    remove_old_drafts(folder)
    inputs = inputs or Inputs(folder)
    asked = questions_of(study, own, inputs, only)
    if resources.scheduler not in (None, "local"):
        from saltus.study.run.cluster import check_scheduler

        check_scheduler(str(resources.scheduler))
    for question in asked:
        question.prepare(folder)
    keep_copy(folder, text, inputs.taken)
    at, outcome = Running(folder, text, resources, report, say, pictures), Outcome()
    for question in asked:
        if resources.shard is None or resources.shard[0] == 0 or question.shared:
            with _told_of(question.asked_as):
                outcome.add(question.answer(at))
    return outcome


@contextmanager
def _told_of(table: str) -> Iterator[None]:
    """What an analysis says of its arguments is said of a table of the study."""
    try:
        yield
    except (ParameterError, TraceError, UnitError) as error:
        raise fault(table, error) from error


def questions_of(study: Study, own: System | None, inputs: Inputs, only: Sequence[str] = ()) -> list[Question]:
    """The questions of a study, or some of them, checked against its system.

    Raises
    ------
    StudyError, UnitError, ParameterError
        If one doesn't fit the system, two would write the same files, or ``only`` names none.
    """
    setting = setting_of(study, own, inputs)
    for_all = inputs.taken
    asked: list[tuple[str, Question]] = []
    for name, table in study.questions():
        with _told_of(name):
            asked += [(name, question) for question in _PLANS[name](table, setting)]
    stems = [stem for _, question in asked for stem in question.stems]
    twice = sorted({stem for stem in stems if stems.count(stem) > 1})
    if twice:
        raise StudyError(f"names of this study give the same file names, such as {twice[0]}. Let them differ in letters or digits.")
    for name, question in asked:
        question.shared_inputs, question.asked_as = for_all, name
    chosen = [question for name, question in asked if not only or _names(name, question) & set(only)]
    known = {name for one in asked for name in _names(*one)}
    for name in only:
        if name not in known:
            raise StudyError(f"--only {name}: this study has no such question. {nearest(name, known)}")
    return chosen


def _names(table: str, question: Question) -> set[str]:
    """What a question may be called on the command line."""
    return {table, question.title, question.stems[0]}
