"""Result of ``branches``: orbits over a parameter, stable or not, and their bifurcations."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import xarray as xr

from saltus.errors import counted
from saltus.results.dataset.schema import (
    ResultKind,
    event_name,
    first_size,
    period_text,
    point_name,
    states_of,
    told_of,
)
from saltus.results.dataset.variable import GUARDS, OUTPUT, SQRT_COEFFICIENT, Variable, of_outputs
from saltus.results.table import ROWS, TextTable, quantity, table, words
from saltus.results.wording import plain, unit_of

_POINT = ("point",)
_MULTIPLIER = ("point", "multiplier")
_BRANCH = ("branch",)
_EVENT = ("event",)
#: Digits of the parameter at a bifurcation.
DIGITS = 10

#: Variables of the result of ``branches``. ``<first>``: the unit of the first state; ``<margin>``:
#: that of the gaps; ``<varied>``: that of the parameter; ``<output>``: that of the output, in
#: ``output_units``.
VARIABLES = {
    "point": Variable(_POINT, "1", "point of a branch", "i8", coord=True),
    "point_branch": Variable(_POINT, "1", "branch that the point lies on", "i8"),
    "point_<parameter>": Variable(_POINT, "<parameter>", "<parameter>"),
    "point_arclength": Variable(
        _POINT, "1", "length of the branch from its first point, in ranges of its unknowns"
    ),
    "point_stable": Variable(_POINT, "1", "whether the orbit attracts", "i1"),
    "point_unstable_multipliers": Variable(
        _POINT,
        "1",
        "Floquet multipliers outside the unit circle; eigenvalues of positive real part",
        "i4",
    ),
    "point_period": Variable(_POINT, "s", "period of the orbit; NaN of an equilibrium"),
    "point_peak": Variable(_POINT, "<first>", "largest magnitude of the first state"),
    "point_rms": Variable(_POINT, "<first>", "root mean square of the first state"),
    "point_contacts": Variable(_POINT, "1", "contacts in one period of the orbit"),
    "point_itinerary": Variable(
        _POINT, "", "guards met, with + where the gap becomes positive, in the order of time", "str"
    ),
    "point_margin": Variable(
        _POINT, "<margin>", "smallest distance by which the orbit misses or overshoots a boundary"
    ),
    "point_multiplier_real": Variable(_MULTIPLIER, "1", "Floquet multiplier, real part"),
    "point_multiplier_imag": Variable(_MULTIPLIER, "1", "Floquet multiplier, imaginary part"),
    "point_eigenvalue_real": Variable(
        _MULTIPLIER, "1/s", "eigenvalue of an equilibrium, real part"
    ),
    "point_eigenvalue_imag": Variable(
        _MULTIPLIER, "1/s", "eigenvalue of an equilibrium, imaginary part"
    ),
    "point_<state>": Variable(("point", "orbit_point"), "<state>", "<state> <when>"),
    **OUTPUT,
    **of_outputs("point", "point_"),
    "harmonic": Variable(
        ("harmonic",), "1", "multiple of the frequency of the orbit", "i8", coord=True
    ),
    "point_error": Variable(
        _POINT,
        "1",
        "of harmonic balance: largest distance of a state, of a structure of a sensor, from that "
        "of the exact orbit, over its range; NaN where none is near",
    ),
    "point_output_error": Variable(
        ("point", "output"),
        "<output>",
        "of harmonic balance: largest distance from that of the exact orbit",
    ),
    "point_harmonic_real": Variable(
        ("point", "output", "harmonic"),
        "<output>",
        "of harmonic balance: amplitude c of Re(c exp(2 pi i k f t)), real part; NaN behind "
        "the last harmonic of a branch",
    ),
    "point_harmonic_imag": Variable(
        ("point", "output", "harmonic"),
        "<output>",
        "of harmonic balance: amplitude c of Re(c exp(2 pi i k f t)), imaginary part; NaN behind "
        "the last harmonic of a branch",
    ),
    "branch": Variable(_BRANCH, "1", "branch", "i8", coord=True),
    "branch_kind": Variable(
        _BRANCH, "", "what lies on it: periodic, limit_cycle, equilibrium", "str"
    ),
    "branch_periods": Variable(
        _BRANCH,
        "1",
        "period of its orbits in forcing periods; without forcing 1, of equilibria 0",
        "i8",
    ),
    "branch_closed": Variable(_BRANCH, "1", "whether it returns to where it began", "i1"),
    "branch_parent": Variable(
        _BRANCH, "1", "branch that it leaves at its first point, -1 if none", "i8"
    ),
    "branch_twin": Variable(
        _BRANCH, "1", "whether its mirror image is a branch of its own, which isn't listed", "i1"
    ),
    "branch_begin": Variable(_BRANCH, "", "why it ends at its first point", "str"),
    "branch_end": Variable(_BRANCH, "", "why it ends at its last point", "str"),
    "branch_begin_limit": Variable(
        _BRANCH, "<varied>", "parameter at which its grazes accumulate beyond its first point"
    ),
    "branch_end_limit": Variable(
        _BRANCH, "<varied>", "parameter at which its grazes accumulate beyond its last point"
    ),
    "branch_unexplained": Variable(
        _BRANCH, "1", "changes of stability that its events don't explain", "i8"
    ),
    "event": Variable(_EVENT, "1", "event", "i8", coord=True),
    "event_kind": Variable(_EVENT, "", "bifurcation", "str"),
    "event_guard": Variable(
        _EVENT, "", "guard that is grazed, or guards that are met at once", "str"
    ),
    "event_phase": Variable(
        _EVENT, "1", "when it is grazed, in forcing periods since the orbit's first point"
    ),
    "event_outcome": Variable(
        _EVENT,
        "",
        "how a branch goes on behind a graze or a boundary; what is born at a Hopf point",
        "str",
    ),
    "event_sqrt_coefficient": Variable(_EVENT, "<root gap>", SQRT_COEFFICIENT),
    "event_branch": Variable(_EVENT, "1", "branch on which it lies", "i8"),
    "event_point": Variable(_EVENT, "1", "point of the branch that comes before it", "i8"),
    "event_<parameter>": Variable(_EVENT, "<parameter>", "<parameter>"),
    "event_peak": Variable(_EVENT, "<first>", "largest magnitude of the first state"),
    "event_rms": Variable(_EVENT, "<first>", "root mean square of the first state"),
    "event_multiplier_real": Variable(
        ("event", "multiplier"), "1", "Floquet multiplier, real part"
    ),
    "event_multiplier_imag": Variable(
        ("event", "multiplier"), "1", "Floquet multiplier, imaginary part"
    ),
    "event_eigenvalue_real": Variable(
        ("event", "multiplier"), "1/s", "eigenvalue of an equilibrium, real part"
    ),
    "event_eigenvalue_imag": Variable(
        ("event", "multiplier"), "1/s", "eigenvalue of an equilibrium, imaginary part"
    ),
    "event_<state>": Variable(("event", "orbit_point"), "<state>", "<state> <when>"),
    **GUARDS,
}


#: Reasons for which following stops within the range though the branch goes on, in words.
_STOPPED = {
    "points": "stopped by points=",
    "lost": "lost",
    "interrupted": "interrupted",
    "held": "ends where the chatter before a held contact changes",
}


# -- account ---------------------------------------------------------------------------------------
def account(ds: xr.Dataset) -> list[str]:
    """A line on each branch with its events, and a line on each branch with unexplained changes of
    stability.
    """
    stable = ds["point_stable"].values
    lines = [
        f"found    {counted(ds.sizes['branch'], 'branch')}, {int(ds['branch_closed'].sum())} of "
        f"them closed, {ds.sizes['point']} points"
        + (f", {stable.mean():.0%} of them stable" if len(stable) else ""),
    ]
    lines += [f"  {i}: {_one(ds, i)}" for i in range(ds.sizes["branch"])]
    if (left := ds.attrs.get("orbits_not_followed")) is not None:
        lines.append(
            f"stopped  all the work was done: branches end early, {counted(int(left), 'orbit')} "
            "weren't followed. A narrower range or a larger points= follows more"
        )
    lines += _truncated(ds)
    return lines + [f"unsure   {one}" for one in _unexplained(ds)]


def _truncated(ds: xr.Dataset) -> list[str]:
    """Distances of motions of a few harmonics from exact orbits; nothing of exact ones."""
    if "point_error" not in ds:
        return []
    off = ds["point_error"].values
    known = off[np.isfinite(off)]
    words = f"at most {known.max():.2g} of their range from exact orbits" if len(known) else ""
    lost = f"{counted(len(off) - len(known), 'point')} with no exact orbit near"
    told = [one for one in (words, lost if len(known) < len(off) else "") if one]
    return [f"balance  {counted(int(ds.attrs['harmonics']), 'harmonic')}, {', '.join(told)}"]


def _unexplained(ds: xr.Dataset) -> Iterator[str]:
    """Changes of stability that the events of a branch don't explain."""
    for i, count in enumerate(ds["branch_unexplained"].values.tolist()):
        if count:
            yield (
                f"{counted(count, 'change')} of stability unexplained on branch {i}: a narrower "
                f"range of {ds.attrs['parameter']} gives shorter steps"
            )


def _one(ds: xr.Dataset, i: int) -> str:
    """Kind, extent, ends and events of a branch."""
    name, branch = ds.attrs["parameter"], ds.isel(branch=i)
    points, events = ds[point_name(name)], ds[event_name(name)]
    mine = points.values[ds["point_branch"].values == i]
    here = ds["event_branch"].values == i
    text = ", ".join(
        f"{plain(word)} {value:.10g}"
        for word, value in zip(ds["event_kind"].values[here], events.values[here], strict=True)
    )
    extent = f"{mine.min():.6g} to {mine.max():.6g} {unit_of(points)}".rstrip()
    ends = ", closed" if branch["branch_closed"] else _stopped(branch, mine[[0, -1]])
    kind = str(branch["branch_kind"].item())
    what = period_text(int(branch["branch_periods"])) if kind == "periodic" else plain(kind)
    return f"{what} from {extent}{ends}{text and '; ' + text}"


def _stopped(branch: xr.Dataset, ends: np.ndarray) -> str:
    """Describe the ends of a branch at which following stopped within the range, though the branch
    goes on.
    """
    text = ""
    for side, last in zip(("begin", "end"), ends, strict=True):
        why = branch[f"branch_{side}"].item()
        if why == "accumulates":
            limit = float(branch[f"branch_{side}_limit"])
            places = max(0, -math.floor(math.log10(abs(last - limit))))  # see ladders.STEADY
            text += f", its grazes accumulate at {limit:.{places}f}"
        elif why in _STOPPED:
            text += f", {_STOPPED[why]} at {last:.6g}"
    return text


# -- rows ------------------------------------------------------------------------------------------
def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """Branches, and the bifurcations on them."""
    return [_branches(title, ds), *events(title, ds)]


def _branches(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each branch; on the screen the longest ones if there are many."""
    name, branch_of = ds.attrs["parameter"], ds["point_branch"].values
    values, unit = ds[point_name(name)].values, unit_of(ds[point_name(name)])
    stable = ds["point_stable"].values
    first, peak = first_size(ds, "point_peak", "point_output_peak")
    numbers = ds["branch"].values
    mine = [np.flatnonzero(branch_of == number) for number in numbers]
    along = plain(name)
    columns = [
        words("branch", numbers),
        words("period", [period_text(int(n)) for n in ds["branch_periods"].values]),
        quantity(f"{along} from", [values[i].min() for i in mine], unit, 6),
        quantity("to", [values[i].max() for i in mine], unit, 6, name=f"{along} to"),
        words("closed", ["yes" if one else "no" for one in ds["branch_closed"].values]),
        words("stable orbits", [f"{100 * stable[i].mean():.0f} %" for i in mine]),
        quantity(f"largest |{first}|", [peak.values[i].max() for i in mine], unit_of(peak)),
        words("bifurcations", [int((ds["event_branch"].values == i).sum()) for i in numbers]),
    ]
    notes = [f"{counted(len(branch_of), 'orbit')} on {counted(len(numbers), 'branch')}."]
    notes += [f"{one}." for one in _unexplained(ds)]
    shown = np.sort(np.argsort([-len(i) for i in mine], kind="stable")[:ROWS]).tolist()
    return table(title, columns, tuple(notes), shown)


def events(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each bifurcation, in the order of the parameter; no table where there is none."""
    if not ds.sizes.get("event"):
        return []
    at = ds[event_name(ds.attrs["parameter"])]
    order = np.argsort(at.values, kind="stable")
    peak, first = ds["event_peak"], states_of(ds)[0]
    columns = [
        quantity(plain(ds.attrs["parameter"]), at.values[order], unit_of(at), DIGITS),
        words("branch", ds["event_branch"].values[order]),
        words("what happens", [plain(kind) for kind in ds["event_kind"].values[order]]),
    ]
    if first in told_of(ds):
        columns.append(quantity(f"peak |{first}|", peak.values[order], unit_of(peak)))
    return [table(f"{title}: bifurcations", columns)]


KIND = ResultKind(
    "sl.branches", VARIABLES, ("point_branch", "point_stable", "branch_periods"), account, rows
)
