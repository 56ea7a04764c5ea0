"""What questions on motions from given starts have in common: where one starts, for how long it is looked at, how it is answered."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, ClassVar

from saltus.errors import SaltusError, StudyError
from saltus.study.answers.question import OneDataset, Question
from saltus.study.setting import quantities
from saltus.study.tables.motions import Followed
from saltus.study.tables.wording import fault

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting.setting import Setting
    from saltus.study.table import TextTable
    from saltus.system import System


class Looked(OneDataset):
    """A question on motions: planned from its table, answered by one function of the analyses.

    Parameters
    ----------
    table : Followed
        What the study asks.
    setting : Setting
        Of the study.

    Raises
    ------
    StudyError, UnitError, ParameterError
        If it doesn't fit the system: told before anything is computed.
    """

    #: The table of the study file; the function of :mod:`saltus.plot` that draws the answer; whether it draws some trajectories of a batch.
    place: ClassVar[str]
    picture: ClassVar[str]
    several: ClassVar[bool] = False

    def __init__(self, table: Any, setting: Setting) -> None:
        from saltus.analysis.motion.window import stretch

        place = self.place
        quantities.is_batch(table.start or {}, table.values, place=place)
        fixed = {name: value for name, value in table.values.items() if not isinstance(value, list)}
        lists = {name: value for name, value in table.values.items() if isinstance(value, list)}
        system = setting.system(fixed, f"{place}.values")
        motion = self._motion(table, system) | {"values": quantities.varied(system, lists, f"{place}.values") or None}
        super().__init__(table.title, table.stem, system, setting.method(table.method), motion)
        try:
            stretch(system, **motion)
            self.arguments |= self.more_arguments(table, setting)
        except StudyError:
            raise
        except SaltusError as error:
            raise fault(place, error) from error

    @classmethod
    def questions(cls, table: Any, setting: Setting) -> list[Question]:
        """The question that the table asks."""
        return [cls(table, setting)]

    def _motion(self, table: Followed, system: System) -> dict[str, Any]:
        """Start and length in SI."""
        place, forced = self.place, system.forced_at is not None
        if forced != (table.periods is not None):
            right = "periods = 200 in place of t_end" if forced else 't_end = "20 s" in place of periods'
            raise StudyError(f"[{place}] {system.name} is {'forced' if forced else 'not forced'}. Write {right}.")
        transient = 0.0 if table.transient is None else quantities.number(table.transient, "1" if forced else "s", place, "transient")
        return {
            "start": quantities.start_or_rest(system, table.start, place),
            "periods": table.periods,
            "t_end": None if table.t_end is None else quantities.number(table.t_end, "s", place, "t_end"),
            "t_start": quantities.number(table.t_start, "s", place, "t_start"),
            "transient": int(transient) if forced and transient == int(transient) else transient,
        }

    def more_arguments(self, table: Any, setting: Setting) -> dict[str, Any]:  # noqa: ARG002
        """What the analysis is called with besides, in SI, checked against the system."""
        return {}

    def compute(self, threads: int | None, progress: Callable[[float], None]) -> xr.Dataset:
        """Call the analysis."""
        try:
            return self.call({"method": self.method, "threads": threads, "progress": progress})
        except SaltusError as error:
            raise fault(self.place, error) from error

    @abstractmethod
    def call(self, how: dict[str, Any]) -> xr.Dataset:
        """The answer; ``how`` are the method, the threads and where progress is told."""

    def tables(self, ds: xr.Dataset) -> list[TextTable]:
        """The one table."""
        from saltus.study.answers.followed_tables import TABLES

        return [TABLES[self.place](self.title, ds)]

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """The picture of the same name."""
        from saltus import plot
        from saltus.plot.selection import MOST

        drawn = getattr(plot, self.picture)
        many = self.several and "trajectory" in ds.dims
        return {"": (drawn(ds, trajectory=ds["trajectory"].values[:MOST].tolist()) if many else drawn(ds)).figure}


def needs_contacts(method: Any, place: str) -> None:
    """Refuse a method that steps over contacts."""
    if not method.records_contacts:
        raise StudyError(f'[{place}] needs a method that locates contacts: name = "Taylor", or ODE45 with events = "locate".')
