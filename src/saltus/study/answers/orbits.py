"""[periodic_orbits]: the periodic orbits of a system, stable or not, from many starts."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from pydantic import Discriminator, Tag

from saltus.fence import MOST_PERIODS
from saltus.results.dataset.schema import period_text, states_of
from saltus.results.wording import unit_of
from saltus.study.answers.question import Answers, OneVerb, asked, first_figure
from saltus.study.table import ROWS, number, quantity, table, words
from saltus.study.tables.kinds import KINDS, OF_RESPONSES, whole
from saltus.study.tables.parts import Interval, Quantity, Starts
from saltus.study.tables.signature import Kind
from saltus.study.tables.signature import table as asking

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.table import Column, TextTable


#: A time, or a range of them.
Period = Annotated[
    Annotated[Interval, Tag("list")] | Annotated[Quantity, Tag("quantity")],
    Discriminator(lambda given: "list" if isinstance(given, list) else "quantity"),
]
#: They are found from many starts.
KEYS = OF_RESPONSES | {
    "start": Kind(Starts, (*KINDS["start"].examples, "random 1000"),
        'Where to begin: every state, lists making a batch; or "random 1000" with box.',
        convert="start"),
    "periods": whole(3, most=MOST_PERIODS),
    "period": Kind(Period, (["1 s", "5 s"], "0.1 s"), convert="period"),
}  # fmt: skip


@asked(100, asking("periodic_orbits", ["periodic_orbits"], KEYS, called="Periodic orbits"))
class Orbits(OneVerb):
    """Periodic orbits, stable and unstable."""

    def rows(self, ds: xr.Dataset, found: Answers) -> list[TextTable]:  # noqa: ARG002
        """A row for each orbit; what the search says of those that it missed."""
        real, imag = (ds[f"orbit_multiplier_{part}"].values for part in ("real", "imag"))
        columns = [
            _periods(ds),
            words("stability", ds["orbit_stability"].values),
            number("largest |multiplier|", _largest(np.hypot(real, imag)), ".6g"),
            quantity(
                f"peak |{states_of(ds)[0]}|", ds["orbit_peak"].values, unit_of(ds["orbit_peak"])
            ),
            words("contacts", ds["orbit_itinerary"].values),
            words("starts", ds["orbit_found"].values),
        ]
        shown = list(range(min(ds.sizes["orbit"], ROWS)))
        return [table(self.title, columns, (_search(ds),), shown)]

    def pictures(self, ds: xr.Dataset) -> dict[str, Any]:
        """Their points at whole periods."""
        from saltus import plot

        axes = plot.periodic_orbits(ds)
        axes.set_title(self.title, loc="left")
        return {"": first_figure(axes)}


def _periods(ds: xr.Dataset) -> Column:
    """The periods: in forcing periods, of limit cycles in seconds."""
    if "orbit_cycle" in ds:
        return quantity("period", ds["orbit_cycle"].values, "s")
    return words("period", [period_text(int(n)) for n in ds["orbit_period"].values])


def _largest(sizes: np.ndarray) -> np.ndarray:
    """The largest of each row; NaN in one without numbers."""
    return np.where(np.isnan(sizes).all(axis=1), np.nan, np.fmax.reduce(sizes, axis=1, initial=0))


def _search(ds: xr.Dataset) -> str:
    """What each search found, in a sentence."""
    unseen = [
        f"{period_text(int(n), 'limit cycles')} {100 * share:.2g} %"
        if np.isfinite(share)
        else f"{period_text(int(n), 'limit cycles')} not known"
        for n, share in zip(ds["search_period"].values, ds["search_unseen"].values, strict=True)
    ]
    return f"Estimated share of the starts whose orbit was not found: {', '.join(unseen)}."
