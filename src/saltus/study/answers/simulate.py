"""[simulate]: motions from one start or a batch, with their contacts; [compare]: comparison with
printed and exact times.
"""

from __future__ import annotations

import functools
from typing import TYPE_CHECKING, Any

from saltus.analysis.motion.settled import settled
from saltus.errors import ParameterError, StudyError
from saltus.flow.until import STATUS
from saltus.results.kinds.settled import responses
from saltus.results.kinds.trajectory import rows, sample_rows
from saltus.study.answers.compare import contact_table, exact_times, printed_rows
from saltus.study.answers.question import Answers, OneVerb, Question, asked, first_figure
from saltus.study.setting import quantities
from saltus.study.tables.kinds import OF_MOTION
from saltus.study.tables.signature import OfLength
from saltus.study.tables.signature import table as asking
from saltus.system.condition import end_condition

if TYPE_CHECKING:
    import xarray as xr

    from saltus.results.store.division import Division
    from saltus.results.table import TextTable
    from saltus.study.setting.setting import Setting
    from saltus.study.tables.study import Study


#: Stem of the file of the run.
RUN = "run"
#: Stem of the file of the run by a second method.
REFERENCE = "run-reference"


def _files(_table: Any, study: Study) -> list[tuple[str, str]]:
    second = study.compare is not None and study.compare.reference is not None
    title = study.study.name
    return [(title, RUN), *([(f"{title}, reference", REFERENCE)] if second else [])]


@asked(10, asking("simulate", ["simulate"], OF_MOTION, base=OfLength), _files)
def questions(table: Any, setting: Setting) -> list[Question]:
    """Questions on how given starts move: by the study's method, and before it by the second method
    that [compare] names.

    Raises
    ------
    StudyError, UnitError
        If the table doesn't fit the system.
    """
    motion, compare = Motion(table, setting), setting.study.compare
    if compare is None or compare.reference is None:
        return [motion]
    motion.needs = (REFERENCE,)
    return [Reference(table, setting), motion]


class Motion(OneVerb):
    """Motions from given starts."""

    place, function = "simulate", "simulate"

    def names(self, table: Any, setting: Setting) -> tuple[str, str]:  # noqa: ARG002
        """Its name is that of the study."""
        self.group = setting.study.study.name
        return self.group, RUN

    def check_first(self, table: Any) -> None:
        """Refuse forcing periods for an unforced system."""
        if table.at is not None and table.samples is not None:
            raise StudyError("[simulate] give at (times) or samples (how many), not both.")
        if table.until is not None and table.keep is not None:
            raise StudyError(
                "[simulate] keep counts periods before an end that is known, and until finds it. "
                "Leave one of them out."
            )
        if table.periods is not None and self.system.forced_at is None:
            raise StudyError(
                f"[simulate] periods: {self.system.name} has no forcing period. Write "
                f't_end = "2 s" in place of it.'
            )

    def check(self, table: Any, setting: Setting) -> None:
        """Read the files of [compare] now: errors come before anything is computed."""
        if table.until is not None:
            end_condition(self.system, table.until)
        self.compare = setting.study.compare
        if self.compare is None:
            return
        if quantities.is_batch(table.start or {}, table.values):
            raise StudyError("[compare] is for one start: let [simulate] start hold single values.")
        if table.keep is not None:
            raise StudyError(
                "[compare] counts contacts from the start of the run: leave keep out of [simulate]."
            )
        files = [
            setting.inputs.read(name, "compare")
            for name in (self.compare.printed, self.compare.exact)
            if name is not None
        ]
        self.printed = printed_rows(files[0].data, files[0].path)
        self.exact = exact_times(files[1].data, files[1].path) if len(files) > 1 else {}
        self.inputs = files

    @functools.cached_property
    def division(self) -> Division | str:
        """Chunks of trajectories."""
        from saltus.analysis.motion.divided import DividedMotions

        return DividedMotions.of(self.system, self.method, self.arguments)

    def rows(self, ds: xr.Dataset, found: Answers) -> list[TextTable]:
        """A row for each trajectory, or for each contact that was printed."""
        if self.compare is None:
            repeats = [] if self.arguments["until"] else response_texts(ds)
            tables = rows(self.title, ds, repeats, dict(STATUS.values()))
            return [*tables, sample_rows(ds)] if self.arguments["at"] else tables
        return [contact_table(self.title, ds, self.printed, self.exact, found.get(REFERENCE))]

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """Phase portrait, or time history of a system of one state and of sensors of which none is
        the rate of the first; of a large batch the first trajectories.
        """
        from saltus import plot
        from saltus.plot.selection import MOST, rate_of
        from saltus.results.dataset.schema import told_of

        first, *others = told_of(ds)
        apart = bool(ds.attrs.get("outputs_first")) and not rate_of(ds, first)
        draw = plot.phase if others and not apart else plot.history
        some = (
            {"trajectory": ds["trajectory"].values[:MOST].tolist()}
            if "trajectory" in ds.dims
            else {}
        )
        return {"": first_figure(draw(ds, **some))}


class Reference(Motion):
    """The same motion by the second method of [compare]."""

    def names(self, table: Any, setting: Setting) -> tuple[str, str]:
        """Its file lies next to that of the run."""
        return f"{super().names(table, setting)[0]}, reference", REFERENCE

    def check(self, table: Any, setting: Setting) -> None:
        """Its method is that of [compare]."""
        super().check(table, setting)
        assert self.compare is not None
        self.method = setting.method(self.compare.reference, "compare.reference")

    def rows(self, ds: xr.Dataset, found: Answers) -> list[TextTable]:  # noqa: ARG002
        """It stands in the table of the run."""
        return []

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:  # noqa: ARG002
        """None of its own."""
        return {}


def response_texts(run: xr.Dataset) -> list[str]:
    """``T``, ``3T`` or ``not periodic within 48T`` for each trajectory; empty for an unforced
    system, and for too few samples.
    """
    try:
        return responses(settled(run))
    except ParameterError:
        return []
