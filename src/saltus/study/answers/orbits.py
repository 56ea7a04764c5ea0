"""[periodic_orbits]: the periodic orbits of a system, stable or not, from many starts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from saltus.results.dataset.schema import period_text, states_of
from saltus.results.wording import unit_of
from saltus.study.answers.question import Answers, OneVerb
from saltus.study.table import ROWS, number, quantity, table, words

if TYPE_CHECKING:
    import xarray as xr

    from saltus.study.table import Column, TextTable


class Orbits(OneVerb):
    """Periodic orbits, stable and unstable."""

    place, function = "periodic_orbits", "periodic_orbits"

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
