"""[bifurcation_curve]: a bifurcation of the study's branches over two parameters;
[event_sensitivity]: the derivatives of its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from pydantic import Field

from saltus.errors import StudyError, nearest, shown
from saltus.results.dataset.schema import CURVE, event_name, kind_of
from saltus.results.provenance import to_json
from saltus.study.answers.branches import Branches
from saltus.study.answers.question import Answers, OneVerb, Question, Show, asked, first_figure
from saltus.study.answers.responses import Diagram
from saltus.study.setting import quantities
from saltus.study.tables.kinds import OF_RESPONSES, whole
from saltus.study.tables.parts import Interval, Quantity
from saltus.study.tables.signature import WrittenAs
from saltus.study.tables.signature import table as asking

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting.setting import Setting


#: A curve begins at an event of the study's branches, named by its kind.
KEYS = OF_RESPONSES | {
    "event": WrittenAs(Literal["fold", "period_doubling", "neimark_sacker", "graze"], ("fold",),
        "Kind of the bifurcation of [branches] at which it begins."),
    "vary": WrittenAs(dict[str, Interval],
        ({"frequency": ["12 Hz", "22 Hz"], "force": ["1 N", "6 N"]},),
        "Two parameters and their ranges.", convert="ranges"),
    "points": whole(400),
}  # fmt: skip
_BRANCHES = Field(None, description="Name of the [branches], of several.", examples=["main"])
_OVER = Field(
    None, description="Name of a [bifurcation_diagram] over the same two parameters: a map of "
    "amplitudes is drawn, with all curves on it so far.", examples=["map"],
)  # fmt: skip
_TO = Field(
    min_length=1,
    description="Parameters that the derivatives are with respect to.",
    examples=[["force", "gap"]],
)
_NEAR = Field(None, description="Value of the branches' parameter near it.", examples=["17.8 Hz"])


class AtEvent(OneVerb):
    """Question that begins at a bifurcation of the study's branches."""

    def check(self, table: Any, setting: Setting) -> None:  # noqa: ARG002
        """Read the event, and the branches that it is on."""
        self.kind, self.near, self.branches_named = table.event, table.near, table.branches

    def join(self, asked: Sequence[Question]) -> None:
        """Find the branches among the questions of the study."""
        known = {one.title: one for one in asked if isinstance(one, Branches)}
        if not known:
            raise StudyError(
                f"[{self.place}] begins at a bifurcation of branches. Give the study a table "
                "[branches]."
            )
        if self.branches_named is None and len(known) > 1:
            raise StudyError(
                f"[{self.place}] needs the name of one of {len(known)} [[branches]]: branches = "
                f'"{next(iter(known))}".'
            )
        if self.branches_named is not None and self.branches_named not in known:
            raise StudyError(
                f"[{self.place}] no [branches] are called {shown(self.branches_named)}. "
                f"{nearest(self.branches_named, known)}"
            )
        branches = known[self.branches_named or next(iter(known))]
        self.needs = (branches.stem,)
        self.parent = to_json(branches.identity())
        (name,) = branches.arguments["vary"]
        if self.near is not None:
            place = f"{self.place}.near"
            self.near = quantities.parameters(self.system, {name: self.near}, place)[name]

    def identity(self) -> dict[str, str]:
        """Identity of the question, with that of the branches at which the curve begins."""
        return super().identity() | {"near": to_json(self.near), "branches": self.parent}

    def compute(self, found: Answers, threads: int | None, progress: Show) -> xr.Dataset:
        """Follow the bifurcation that the table names."""
        self.arguments["event"] = self._event(found[self.needs[0]])
        try:
            return super().compute(found, threads, progress)
        finally:
            self.arguments["event"] = self.kind

    def _event(self, ds: xr.Dataset) -> xr.Dataset:
        """Select the event of that kind that is nearest to a value, or the only one."""
        events = np.flatnonzero(ds["event_kind"].values == self.kind)
        at = ds[event_name(ds.attrs["parameter"])].values[events]
        if not len(events) or (self.near is None and len(events) > 1):
            parameter = ds.attrs["parameter"].replace("_", " ")
            many = f"{len(events)} events" if len(events) else "no event"
            raise StudyError(
                f"[{self.place}] the branches have {many} of the kind {self.kind!r}."
                + (f" Say near which {parameter}: near = ..." if len(events) else "")
            )
        nearest_one = 0 if self.near is None else int(np.argmin(np.abs(at - self.near)))
        return ds.isel(event=int(events[nearest_one]))


@asked(
    120,
    asking(
        "bifurcation_curve",
        ["bifurcation_curve"],
        KEYS,
        called="Bifurcation curve",
        branches=(str | None, _BRANCHES),
        near=(Quantity | None, _NEAR),
        over=(str | None, _OVER),
    ),
)
class CurveQuestion(AtEvent):
    """A curve of bifurcations."""

    whole = "follows a bifurcation from point to point"

    def check(self, table: Any, setting: Setting) -> None:
        """Read the map to draw it on, too."""
        super().check(table, setting)
        self.over = table.over

    def join(self, asked: Sequence[Question]) -> None:
        """Find the branches and the map among the questions of the study."""
        super().join(asked)
        self.needs = (*self.needs, *self._map(asked))

    def _map(self, asked: Sequence[Question]) -> tuple[str, ...]:
        """Stem of the map that the curve is drawn on, if there is one."""
        if self.over is None:
            return ()
        pair = set(self.arguments["vary"])
        maps = {one.title: one for one in asked if isinstance(one, Diagram)}
        fitting = [name for name, one in maps.items() if set(one.varied()) == pair]
        if self.over not in fitting:
            raise StudyError(
                f"[{self.place}] over: no [bifurcation_diagram] over "
                f"{' and '.join(sorted(pair))} is called {shown(self.over)}. "
                f"{nearest(self.over, fitting)}"
            )
        return (maps[self.over].stem,)

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """The curve in the plane of both parameters."""
        from saltus import plot

        axes = plot.bifurcation_curves(ds)
        axes.set_title(self.title, loc="left")
        return {"": first_figure(axes)}

    def pictures_with(self, found: Answers) -> dict[str, Any]:
        """The map of amplitudes, with the curves that are there: on the last one all of them."""
        from saltus import plot

        if self.over is None:
            return {}
        pair = set(self.arguments["vary"])
        curves = [ds for ds in found.values() if kind_of(ds) == CURVE and pair == _pair(ds)]
        axes = plot.amplitude_map(found[self.needs[-1]], bifurcations=curves)
        axes.set_title(f"{self.over}: {axes.get_title('left')}", loc="left")
        return {"-map": first_figure(axes)}


@asked(
    125,
    asking(
        "event_sensitivity",
        ["event_sensitivity"],
        KEYS,
        called="Event sensitivity",
        without=("to",),
        to=(list[str], _TO),
        branches=(str | None, _BRANCHES),
        near=(Quantity | None, _NEAR),
    ),
)
class EventDerivatives(AtEvent):
    """Derivatives of the place of a bifurcation."""

    whole = "takes less time than the branches that it begins at, which one job follows"

    def check(self, table: Any, setting: Setting) -> None:
        """Check what the derivatives are with respect to."""
        from saltus.analysis.derivatives.columns import Columns

        super().check(table, setting)
        self.arguments["to"] = table.to
        Columns.of(self.system, table.to)


def _pair(ds: xr.Dataset) -> set[str]:
    """The two parameters of a curve."""
    return {ds.attrs["parameter_x"], ds.attrs["parameter_y"]}
