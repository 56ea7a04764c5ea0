"""Running of a study: from a checked file to the answers of its questions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from saltus.errors import StudyError
from saltus.results import save
from saltus.results.files.atomic import remove_old_drafts
from saltus.results.store.division import Division
from saltus.study.answers.basins import BasinMap
from saltus.study.ask import naming_table, questions_of
from saltus.study.run.copies import keep_copy
from saltus.study.run.divided import answer_in_chunks, compute, finish, open_store, place_of
from saltus.study.run.running import Report, Resources, Running, StudyOutcome
from saltus.study.run.stored import load_or_compute
from saltus.study.run.write import write
from saltus.study.setting.inputs import Inputs
from saltus.study.tables.study import Study

if TYPE_CHECKING:
    import xarray as xr

    from saltus.results.store.store import Store
    from saltus.study.answers.question import Question
    from saltus.system import System


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
) -> StudyOutcome:
    """Answer the questions of a study that have no answer yet, and write the results.

    Parameters
    ----------
    study : Study
        The questions, and their system.
    text : str
        The file as it stands; a copy goes to the folder. :func:`saltus.study.read.read`
        returns both.
    folder : Path
        Output: for each question a ``.nc``, a ``.csv`` and pictures; the stores of basins.
    own : System, optional
        The system, if it isn't one of saltus's models.
    resources : Resources
        Resources to compute with.
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
        If the study doesn't fit its system, before anything is computed.
    StoreError
        If a store in the folder was made from something else: names what differs.
    """
    remove_old_drafts(folder)
    inputs = inputs or Inputs(folder)
    asked = questions_of(study, own, inputs, only)
    divided = [question for question in asked if isinstance(question.division, Division)]
    sets = turns([question for question in asked if question not in divided])
    if resources.divide:
        _check_divided(asked, divided or (resources.shard is not None and len(sets) > 1))
    if resources.scheduler not in (None, "local"):
        from saltus.study.run.cluster import check_scheduler, open_to_all

        check_scheduler(str(resources.scheduler))
        if warning := open_to_all(str(resources.scheduler)):
            say(warning)
    stores = {
        question.stem: open_store(question, folder)
        for question in divided
        if isinstance(question, BasinMap)
    }
    keep_copy(folder, text, inputs.taken)
    at, outcome = Running(folder, text, resources, report, say, pictures), StudyOutcome()
    found: dict[str, xr.Dataset] = {}
    for question in asked:
        shared = question in divided or question.shared
        mine = shared or _is_mine(question, sets, resources.shard)
        if mine and found.keys() >= set(question.needs):
            with naming_table(question.place):
                ds = _answer(question, found, at, stores)
                if ds is None:
                    outcome.waiting.append(question.title)
                    continue
                found[question.stem] = ds
                outcome.add(write(question, ds, found, at))
    return outcome


def turns(whole: Sequence[Question]) -> list[set[str]]:
    """The stems of questions that don't divide, in sets that need each other's answers."""
    sets: list[set[str]] = []
    for question in whole:
        needed = [one for one in sets if one & set(question.needs)]
        sets = [one for one in sets if one not in needed]
        sets.append({question.stem}.union(*needed))
    return sets


def _is_mine(question: Question, sets: Sequence[set[str]], shard: tuple[int, int] | None) -> bool:
    """True if a question that doesn't divide is left to this job: jobs take them in turn."""
    if shard is None:
        return True
    place = next(i for i, one in enumerate(sets) if question.stem in one)
    return place % shard[1] == shard[0]


def _check_divided(asked: Sequence[Question], divides: object) -> None:
    """Raise StudyError if there is nothing to divide among jobs or processes."""
    if not divides:
        why = ". ".join(dict.fromkeys(f"[{one.place}] {one.division}" for one in asked))
        raise StudyError(
            "--workers, --scheduler and --shard divide questions into chunks, and none of this "
            f"study's can be divided: {why}. Leave them out."
        )


def _answer(
    question: Question, found: Mapping[str, xr.Dataset], at: Running, stores: Mapping[str, Store]
) -> xr.Dataset | None:
    """Load or compute an answer; None if other shards have yet to work on it."""
    resources = at.resources
    if (identity := question.identity()) is None:
        ds = question.compute(found, resources.threads, lambda _: None)
        save(ds, at.folder / f"{question.stem}.nc")
        return ds
    if not isinstance(question, BasinMap):
        return load_or_compute(
            question.stem,
            question.title,
            identity,
            lambda show: _one(question, found, at, show),
            at,
        )
    store = stores[question.stem]
    if not compute(question, store, resources, at.report, at.say):
        return None
    ds = finish(question, store, resources.threads).assign_attrs(
        study=at.text, title=question.title
    )
    save(ds, at.folder / f"{question.stem}.nc")
    return ds


def _one(
    question: Question,
    found: Mapping[str, xr.Dataset],
    at: Running,
    show: Callable[[float], None],
) -> xr.Dataset | None:
    """Compute an answer: in chunks if that is asked for, or some of them are there already."""
    divides = isinstance(question.division, Division)
    if divides and (at.resources.divide or place_of(question, at.folder).exists()):
        store = open_store(question, at.folder)
        return answer_in_chunks(question, store, at.resources, at.report, at.say, show)
    return question.compute(found, at.resources.threads, show)
