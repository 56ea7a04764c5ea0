"""Result of ``periodic_orbits`` and ``edge_orbit``: those variables of attractors that any orbit
has, and those that only a search for all orbits gives.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import xarray as xr

from saltus.errors import counted
from saltus.results.dataset.attractors import rows_as
from saltus.results.dataset.orbits import OF_ATTRACTORS
from saltus.results.dataset.schema import ResultKind, kind_text, period_text, states_of
from saltus.results.dataset.variable import Variable
from saltus.results.table import Column, TextTable, number, quantity, table, words
from saltus.results.wording import LINES, more, sized, unit_of

_EACH = ("orbit",)
_SEARCH = ("search_period",)

#: Variables of the result of ``periodic_orbits``.
VARIABLES = {
    **rows_as("orbit", without=OF_ATTRACTORS),
    "orbit_stable": Variable(
        _EACH,
        "1",
        "whether all multipliers lie inside the unit circle",
        "i1",
        flags={0: "unstable", 1: "stable"},
    ),
    "orbit_stability": Variable(_EACH, "", "kind of stability, from the multipliers", "str"),
    "orbit_unstable_directions": Variable(_EACH, "1", "multipliers outside the unit circle", "i8"),
    "orbit_found": Variable(_EACH, "1", "starts that led to it", "i8"),
    "orbit_mismatch": Variable(
        _EACH, "1", "largest distance of a point from the image of the one before, of the range"
    ),
    "search_period": Variable(
        _SEARCH, "1", "period that was searched for, in forcing periods", "i8", coord=True
    ),
    "search_converged": Variable(_SEARCH, "1", "starts that led to an orbit", "i8"),
    "search_found_once": Variable(_SEARCH, "1", "orbits that one start alone led to", "i8"),
    "search_unseen": Variable(
        _SEARCH, "1", "estimated share of the starts whose orbits aren't known"
    ),
    "search_deflated": Variable(
        _SEARCH, "1", "orbits found only after the others were deflated", "i8"
    ),
    "search_exhausted": Variable(
        _SEARCH,
        "1",
        "whether the last search with all known orbits deflated found nothing",
        "i1",
        flags={0: "no", 1: "yes"},
    ),
    "search_given_up": Variable(
        _SEARCH, "1", "starts given up, since their motion used up its budget", "i8"
    ),
}


# -- account ---------------------------------------------------------------------------------------
def account(ds: xr.Dataset) -> list[str]:
    """A line on each orbit, and lines on the search for the others."""
    stable = int((ds["orbit_stable"].values == 1).sum())
    count = ds.sizes["orbit"]
    lines = [f"found    {counted(count, 'orbit')}, {stable} of them stable"]
    lines += [f"  {i}: {_one(ds.isel(orbit=i))}" for i in range(min(count, LINES))]
    lines += more(count)
    lines += [f"search   {one}" for one in _searches(ds)]
    if "search_given_up" in ds and (dropped := int(ds["search_given_up"].max())):
        lines.append(
            f"given up {counted(dropped, 'start')}: the motion took more steps or contacts than "
            f"allowed. Start nearer to where the system moves, or allow more: "
            f"method=sl.Taylor(max_steps=..., max_events=...); impacts written as impact(...) in "
            f"place of jump(...) come to rest"
        )
    return lines


def _one(orbit: xr.Dataset) -> str:
    """Kind, stability, size and largest multiplier of an orbit."""
    real, imag = (
        float(np.ravel(orbit[f"orbit_multiplier_{part}"].values)[0]) for part in ("real", "imag")
    )
    cycle = f" of {float(orbit['orbit_cycle']):.8g} s" if "orbit_cycle" in orbit else ""
    kind = kind_text(str(orbit["orbit_type"].item()), int(orbit["orbit_period"]))
    return (
        f"{kind}{cycle}, {orbit['orbit_stability'].item()}, peak {sized(orbit['orbit_peak'])}, "
        f"largest multiplier {np.hypot(real, imag):.4g}"
    )


def _searches(ds: xr.Dataset) -> Iterator[str]:
    """Lines on the search for orbits of each period: the orbits found, and the share that may be
    missed.
    """
    for i in range(ds.sizes.get("search_period", 0)):
        search = ds.isel(search_period=i)
        share = float(search["search_unseen"])
        unseen = f", about {share:.1%} of them to one that isn't known" if share == share else ""
        yield (
            f"{period_text(int(search['search_period']), 'limit cycles')}: "
            f"{int(search['search_converged'])} of {ds.attrs.get('starts', '?')} starts led to an "
            f"orbit{unseen}; deflation found {int(search['search_deflated'])} more"
        )


# -- rows ------------------------------------------------------------------------------------------
def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each orbit. Notes tell the share that the search may have missed."""
    real, imag = (ds[f"orbit_multiplier_{part}"].values for part in ("real", "imag"))
    columns = [
        _periods(ds),
        words("stability", ds["orbit_stability"].values),
        number("largest |multiplier|", _largest(np.hypot(real, imag)), ".6g"),
        quantity(f"peak |{states_of(ds)[0]}|", ds["orbit_peak"].values, unit_of(ds["orbit_peak"])),
        words("contacts", ds["orbit_itinerary"].values),
        words("starts", ds["orbit_found"].values),
    ]
    return [table(title, columns, [f"{one}." for one in _searches(ds)])]


def _periods(ds: xr.Dataset) -> Column:
    """Periods: forcing periods, or seconds for limit cycles."""
    if "orbit_cycle" in ds:
        return quantity("period", ds["orbit_cycle"].values, "s")
    return words("period", [period_text(int(n)) for n in ds["orbit_period"].values])


def _largest(sizes: np.ndarray) -> np.ndarray:
    """Largest number of each row; NaN for a row without numbers."""
    return np.where(np.isnan(sizes).all(axis=1), np.nan, np.fmax.reduce(sizes, axis=1, initial=0))


KIND = ResultKind(
    "sl.periodic_orbits or sl.edge_orbit", VARIABLES, ("orbit_type", "orbit_stable"), account, rows
)
