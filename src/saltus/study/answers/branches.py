"""[branches]: periodic orbits over a parameter, stable or not, and their bifurcations; [backbone]:
the vibrations that resonances follow.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from saltus.fence import MOST_COUNT
from saltus.results.dataset.schema import event_name, period_text, point_name, states_of
from saltus.results.wording import unit_of
from saltus.study.answers.question import Answers, OneVerb, asked, first_figure
from saltus.study.setting import quantities
from saltus.study.table import ROWS, number, quantity, table, words
from saltus.study.tables.kinds import OF_RESPONSES, whole
from saltus.study.tables.parts import Interval, Quantity
from saltus.study.tables.signature import Kind
from saltus.study.tables.signature import table as asking

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.setting.setting import Setting
    from saltus.study.table import TextTable

#: Digits of the parameter at a bifurcation.
DIGITS = 10
#: Why a backbone may end before the amplitude asked for.
ENDS = ("points", "lost")


#: Branches go over a range, without steps.
OF_BRANCHES = OF_RESPONSES | {
    "vary": Kind(
        dict[str, Interval], ({"frequency": ["2 Hz", "30 Hz"]},),
        "One parameter and its range.", convert="ranges",
    ),
    "at": whole(12, most=MOST_COUNT),
    "longest": whole(8),
    "points": whole(1000),
    "switch": Kind(
        list[Literal["period_doubling", "branch_point"]], (["period_doubling"],),
        default=["period_doubling", "branch_point"],
    ),
}  # fmt: skip
#: Backbones go over a range of amplitudes; parameters that are zero are taken out.
OF_BACKBONES = OF_RESPONSES | {
    "amplitude": Kind(Interval, (["0.1 mm", "5 mm"],)),
    "state": Kind(examples=("x",)),
    "force": Kind(examples=("force",)),
    "values": Kind(dict[str, Quantity], ({"force": "0 N", "damping_ratio": 0},),
        "Values of parameters: of free vibrations the force and all that damps are zero.", {},
        convert="values"),
    "mode": whole(1),
    "points": whole(400),
}  # fmt: skip


@asked(110, asking("branches", ["branches"], OF_BRANCHES, called="Branches of periodic orbits"))
class Branches(OneVerb):
    """Branches of periodic orbits over a parameter."""

    def rows(self, ds: xr.Dataset, found: Answers) -> list[TextTable]:  # noqa: ARG002
        """Branches, and the bifurcations on them."""
        tables = [_branches(self.title, ds)]
        return [*tables, events(f"{self.title}: bifurcations", ds)] if ds.sizes["event"] else tables

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """Stable solid, unstable dashed."""
        from saltus import plot

        axes = plot.branches(ds)
        axes.set_title(self.title, loc="left")
        return {"": first_figure(axes)}


@asked(130, asking("backbone", ["backbone"], OF_BACKBONES, called="Backbone"))
class Backbone(OneVerb):
    """The backbone of resonances over their amplitude."""

    def check(self, table: Any, setting: Setting) -> None:  # noqa: ARG002
        """The amplitude is in the unit of its state."""
        state = table.state or self.system.states[0]
        place = f"{self.place}.amplitude"
        self.arguments["amplitude"] = tuple(
            quantities.states(self.system, {state: one}, place)[state] for one in table.amplitude
        )

    def rows(self, ds: xr.Dataset, found: Answers) -> list[TextTable]:  # noqa: ARG002
        """A row for each point; on the screen some of them."""
        state, count = ds.attrs["amplitude_of"], ds.sizes["point"]
        one = ds.sel(output=state)
        columns = [
            quantity(
                f"peak |{state}|", one["point_output_peak"].values, str(one.output_units.item()), 6
            ),
            quantity("frequency", ds["backbone_frequency"].values, "Hz", DIGITS),
            words("stable", ["yes" if stable else "no" for stable in ds["point_stable"].values]),
            words("contacts", ds["point_itinerary"].values),
        ]
        if "fictitious_damping" in ds:
            columns.append(
                number("fictitious damping", ds["fictitious_damping"].values, ".1e", "1/s")
            )
        shown = np.unique(np.linspace(0, count - 1, ROWS).astype(int)).tolist()
        end = ds.attrs["end"]
        lost = (f"It ends before the amplitude asked for: {end}.",) if end in ENDS else ()
        return [table(self.title, columns, (f"{count} points.", *lost), shown)]

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """Amplitude over frequency."""
        from saltus import plot

        axes = plot.backbone(ds)
        axes.set_title(self.title, loc="left")
        return {"": first_figure(axes)}


def _branches(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each branch."""
    name, of = ds.attrs["parameter"], ds["point_branch"].values
    values, unit = ds[point_name(name)].values, unit_of(ds[point_name(name)])
    stable, peak = ds["point_stable"].values, ds["point_peak"].values
    numbers = ds["branch"].values
    mine = [np.flatnonzero(of == number) for number in numbers]
    along, first = name.replace("_", " "), states_of(ds)[0]
    columns = [
        words("branch", numbers),
        words("period", [period_text(int(n)) for n in ds["branch_periods"].values]),
        quantity(f"{along} from", [values[i].min() for i in mine], unit, 6),
        quantity("to", [values[i].max() for i in mine], unit, 6, name=f"{along} to"),
        words("closed", ["yes" if one else "no" for one in ds["branch_closed"].values]),
        words("stable orbits", [f"{100 * stable[i].mean():.0f} %" for i in mine]),
        quantity(f"largest |{first}|", [peak[i].max() for i in mine], unit_of(ds["point_peak"])),
        words("bifurcations", [int((ds["event_branch"].values == i).sum()) for i in numbers]),
    ]
    missed = int(ds["branch_unexplained"].sum())
    notes = [f"{len(of)} orbits on {len(numbers)} branches."]
    if missed:
        notes.append(f"{missed} changes of stability are not explained by the bifurcations found.")
    shown = np.sort(np.argsort([-len(i) for i in mine], kind="stable")[:ROWS]).tolist()
    return table(title, columns, tuple(notes), shown)


def events(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each bifurcation, in the order of the parameter."""
    name = ds.attrs["parameter"]
    at = ds[event_name(name)]
    order = np.argsort(at.values, kind="stable")
    columns = [
        quantity(name.replace("_", " "), at.values[order], unit_of(at), DIGITS),
        words("branch", ds["event_branch"].values[order]),
        words("what happens", [kind.replace("_", " ") for kind in ds["event_kind"].values[order]]),
        quantity(
            f"peak |{states_of(ds)[0]}|", ds["event_peak"].values[order], unit_of(ds["event_peak"])
        ),
    ]
    return table(title, columns, (), list(range(min(len(order), ROWS))))
