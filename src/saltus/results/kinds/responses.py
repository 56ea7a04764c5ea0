"""Result of ``frequency_response`` and ``bifurcation_diagram``: all steady responses."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

from saltus.errors import counted
from saltus.results.dataset.attractors import rows_as
from saltus.results.dataset.kinds import (
    LATE,
    LONGER_RESPONSE,
    OPEN,
    WITHOUT_WORDS,
    Kind,
    sentences,
)
from saltus.results.dataset.schema import (
    ResultKind,
    first_size,
    parameters_of,
    point_name,
    response_name,
)
from saltus.results.dataset.variable import GUARDS, OUTPUT, Variable, of_outputs
from saltus.results.kinds import branches
from saltus.results.kinds.attractors import families, missed, settled, untyped
from saltus.results.table import ROWS, Column, TextTable, interval, number, quantity, table, words
from saltus.results.wording import LINES, header, kind_texts, plain, span, tally, unit_of
from saltus.units import from_si, titled

#: Dims of numbers of a start at a place of the grid.
_GRID = ("...", "start")
_RESPONSE = ("response",)

#: Variables of the results of ``frequency_response`` and ``bifurcation_diagram``. ``<first>``: the
#: unit of the first state; ``<margin>``: that of its gaps; ``<output>``: that of the output, in
#: ``output_units``.
VARIABLES = {
    "<parameter>": Variable(("<parameter>",), "<parameter>", "<parameter>", coord=True),
    "response_of": Variable(
        _GRID, "1", "response that the start leads to", "i4", flags=WITHOUT_WORDS
    ),
    "rms": Variable(_GRID, "<first>", "root mean square of the first state in the response"),
    "peak": Variable(_GRID, "<first>", "largest magnitude of the first state in the response"),
    "type": Variable(_GRID, "", "kind of motion, or what became of the start", "str"),
    "period": Variable(
        _GRID, "1", "period of the response in forcing periods, 0 if it doesn't repeat", "i4"
    ),
    "contacts_per_period": Variable(_GRID, "1", "contacts of the response in a forcing period"),
    "start": Variable(("start",), "1", "start", "i8", coord=True),
    "start_direction": Variable(
        ("start",), "", "direction in which the parameter is swept", "str", coord=True
    ),
    "start_<state>": Variable(("start",), "<state>", "<state> at the start", coord=True),
    "response": Variable(_RESPONSE, "1", "response", "i8", coord=True),
    "response_<parameter>": Variable(_RESPONSE, "<parameter>", "<parameter>"),
    "response_branch": Variable(
        _RESPONSE, "1", "branch: orbits that go over into each other", "i8"
    ),
    **{
        name.replace("fraction", "share"): row
        for name, row in rows_as("response", without=("itinerary", "scatter")).items()
    },
    "response_contacts": Variable(_RESPONSE, "1", "contacts in a forcing period"),
    **OUTPUT,
    **of_outputs("response"),
    "sample_<state>": Variable(("response", "sample"), "<state>", "<state> <sampled>"),
    **branches.VARIABLES,
    "guard_boundary": replace(GUARDS["guard_boundary"], dims=("guard", "...?")),
}


# -- account ---------------------------------------------------------------------------------------
def account(ds: xr.Dataset) -> list[str]:
    """Lines on branches, kinds of motion and events, and on the fate of the starts."""
    starts, labels = ds.sizes["start"], ds["response_of"]
    lines = [
        f"{span(ds, parameters_of(ds), 'values')}, {counted(starts, 'start')} at each",
        _found(ds),
    ]
    if ds.sizes.get("event"):
        lines.append(f"events   {_tally(ds['event_kind'].values.tolist())}")
    lines += _ends(ds)
    if left := _count_of(ds, Kind.NOT_REPEATING):
        lines.append(f"open     {counted(left, 'response')} {OPEN}")
    if long := _count_of(ds, Kind.LONG_PERIODIC):
        lines.append(f"long     {counted(long, 'response')} {LATE}")
    lines += _chaotic(ds)
    lines += [
        settled(labels),
        *families(ds, "response"),
        *untyped(labels, Kind.UNCONVERGED, Kind.FAILED, longer=LONGER_RESPONSE),
    ]
    return lines + [f"missed   {one}" for one in missed(starts, " at each")]


def _found(ds: xr.Dataset) -> str:
    """Line on the number of responses, their branches and their kinds."""
    kinds = kind_texts(ds, "response_")
    found = f"found    {counted(len(kinds), 'response')}"
    if len(parameters_of(ds)) == 1:
        found += f" on {counted(np.unique(ds['response_branch'].values).size, 'branch')}"
    return f"{found}: {_tally(kinds)}" if kinds else found


def _ends(ds: xr.Dataset) -> list[str]:
    """Lines on branches whose ends aren't known."""
    lines = []
    if text := ds.attrs.get("branches_refused"):
        lines.append(f"unsure   branches are matched by where responses lie: {text}")
    if left := ds.attrs.get("responses_not_followed"):
        lines.append(
            f"stopped  the branches of {counted(int(left), 'response')} weren't followed: they "
            "repeat after many periods, or others took all the work; a narrower range follows more"
        )
    if "branch_end" not in ds:
        return lines
    ends = tally(np.concatenate([ds["branch_begin"].values, ds["branch_end"].values]))
    if "lost" in ends:
        lines.append(
            f"unsure   {counted(ends['lost'], 'end')} of branches where no more orbits were found: "
            "a narrower range gives shorter steps"
        )
    if "points" in ends:
        lines.append(
            f"stopped  {counted(ends['points'], 'end')} of branches that go on, after 1000 points "
            "or all the work: a narrower range follows them farther, if their orbits don't grow "
            "without bound"
        )
    return lines


def _tally(kinds: list[str]) -> str:
    """``212 T, 31 3T``, the most frequent first."""
    found = sorted(tally(kinds).items(), key=lambda one: -one[1])
    more = f" and {len(found) - LINES} other kinds" if len(found) > LINES else ""
    return plain(", ".join(f"{n} {word}" for word, n in found[:LINES])) + more


def _chaotic(ds: xr.Dataset) -> list[str]:
    """Line on responses that are chaotic as far as is known."""
    left = _count_of(ds, Kind.CHAOTIC)
    if not left or "periods" not in ds.attrs:
        return []
    least = ds.attrs.get("periods_watched", ds.attrs["periods"])
    return [
        f"unsure   {counted(left, 'response')} chaotic for as long as watched, at least {least} "
        "periods: chaos that ends later looks the same, and a larger periods= watches for longer"
    ]


def _count_of(ds: xr.Dataset, kind: Kind) -> int:
    """Count the responses of a kind."""
    return int((ds["response_type"].values == kind.word).sum())


# -- rows ------------------------------------------------------------------------------------------
def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """Branches, and the events on them; over two parameters kinds of motion."""
    if len(parameters_of(ds)) == 2:
        return [_kinds(title, ds)]
    return [_branches(title, ds), *branches.events(title, ds)]


def _branches(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each branch in the order in which they begin; on the screen the longest ones if
    there are many.
    """
    (axis,) = parameters_of(ds)
    branch = ds["response_branch"].values
    numbers, sizes = np.unique(branch, return_counts=True)
    shown = np.sort(np.argsort(-sizes, kind="stable")[:ROWS]).tolist()
    each = [ds.isel(response=np.flatnonzero(branch == number)) for number in numbers]
    sizes_of = {
        name: [first_size(one, f"response_{name}", f"output_{name}")[1] for one in each]
        for name in ("rms", "peak")
    }
    tops = [int(np.nan_to_num(rms.values, nan=-math.inf).argmax()) for rms in sizes_of["rms"]]
    first, rms = first_size(ds, "response_rms", "output_rms")
    along, values, size = plain(axis), response_name(axis), unit_of(rms)
    unit, gap = (unit_of(ds[name]) for name in (axis, "response_margin"))

    def ends(name: str, pick: Callable[[np.ndarray], Any]) -> list[float]:
        return [float(pick(responses[name].values)) for responses in each]

    def at_top(name: str) -> list[float]:
        return [
            float(responses[name].values[top]) for responses, top in zip(each, tops, strict=True)
        ]

    extents = [
        _extent(ds, int(number), responses[values].values)
        for number, responses in zip(numbers, each, strict=True)
    ]
    fewest, most = (ends("response_contacts", pick) for pick in (_least, _most))
    columns = [
        words("branch", numbers),
        words("type", [_types(responses) for responses in each]),
        words("values", sizes),
        quantity(f"{along} from", [low for low, _ in extents], unit, 5),
        quantity("to", [high for _, high in extents], unit, 5, name=f"{along} to"),
        interval("contacts in T", fewest, most, "{:.3g}".format),
        quantity(
            f"largest rms of {first}",
            [float(one.values[top]) for one, top in zip(sizes_of["rms"], tops, strict=True)],
            size,
        ),
        quantity("at", at_top(values), unit, 5, name=f"{along} at the largest rms"),
        quantity(f"peak |{first}|", [_most(one.values) for one in sizes_of["peak"]], size),
        quantity("to a graze", ends("response_margin", _least), gap, 3),
        number("largest exponent", ends("response_exponent", _most), ".4g", "1/s"),
    ]
    return table(title, columns, _notes(ds, len(numbers) - len(shown)), shown)


def _extent(ds: xr.Dataset, branch: int, values: np.ndarray) -> tuple[float, float]:
    """Least and largest value of the parameter on a branch: of its responses, and of its points if
    it was followed.
    """
    if "point_branch" in ds:
        followed = ds[point_name(parameters_of(ds)[0])].values[ds["point_branch"].values == branch]
        values = np.concatenate([values, followed])
    return float(values.min()), float(values.max())


def _least(values: np.ndarray) -> float:
    """Least of the finite numbers; NaN if there are none."""
    return (
        float(values[~np.isnan(values)].min(initial=math.inf))
        if not np.isnan(values).all()
        else math.nan
    )


def _most(values: np.ndarray) -> float:
    return -_least(-values)


def _types(ds: xr.Dataset) -> str:
    """``T``, or ``T, 2T`` where a branch changes its kind."""
    return ", ".join(dict.fromkeys(kind_texts(ds, "response_")))


def _notes(ds: xr.Dataset, more: int = 0) -> tuple[str, ...]:
    labels = ds["response_of"].values
    notes = [
        f"{ds.sizes['response']} different responses from {labels.size} starts at "
        f"{math.prod(labels.shape[:-1])} values."
    ]
    if more:
        notes.append(f"{more} shorter branches are in the file.")
    if left := _count_of(ds, Kind.NOT_REPEATING):
        notes.append(f"{left} responses {OPEN}")
    if long := _count_of(ds, Kind.LONG_PERIODIC):
        notes.append(f"{long} responses {LATE}")
    return (*notes, *sentences(labels))


def _kinds(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each kind of motion: its share of the map, and its ranges of the parameters."""
    labels = ds["response_of"].values
    names = np.array(kind_texts(ds, "response_"), dtype=np.str_)
    cells = np.append(names, "")[np.where(labels < 0, len(names), labels)]
    kinds = sorted(set(names.tolist()), key=lambda kind: (len(kind), kind))
    shares = [float((cells == kind).mean()) for kind in kinds]
    columns = [
        words("type", kinds),
        Column("share", lambda i: f"{100 * shares[i]:.2f} %", {"share": shares}),
    ]
    for dim, axis in enumerate(parameters_of(ds)):
        values, unit = ds[axis].values, unit_of(ds[axis])
        where = [values[np.nonzero((cells == kind).any(axis=-1))[dim]] for kind in kinds]
        low, high = ([pick(found) for found in where] for pick in (_least, _most))
        columns.append(
            interval(plain(axis), low, high, partial(from_si, unit=unit, digits=4), unit)
        )
    return table(title, columns, _notes(ds))


# -- all of it -------------------------------------------------------------------------------------
def sheets(ds: xr.Dataset) -> dict[str, Mapping[str, np.ndarray]]:
    """A row for each response: its parameters, branch, kind, size, stability, and the numbers of
    each output; a row for what happens to a branch.
    """
    first = ["response", *(response_name(name) for name in parameters_of(ds))]
    order = {name: i for i, name in enumerate(first)}
    mine = sorted(_along(ds, "response"), key=lambda name: order.get(name, len(first)))
    happens = _along(ds, "event") if ds.sizes.get("event") else []
    return {
        "events": _titled(ds, happens, "event_"),
        "": _titled(ds, mine, "response_") | _outputs(ds),
    }


def _along(ds: xr.Dataset, dim: str) -> list[str]:
    """Variables that have a number for each response, or for each event."""
    return [str(name) for name in ds.variables if ds[name].dims == (dim,)]


def _titled(ds: xr.Dataset, names: list[str], prefix: str) -> dict[str, np.ndarray]:
    """Variables under headers that carry the units, and no prefix."""
    return {header(ds, name).removeprefix(prefix): ds[name].values for name in names}


def _outputs(ds: xr.Dataset) -> dict[str, np.ndarray]:
    """A column for each number of each output: ``stop force amplitude [N]``."""
    columns = {}
    for i, output in enumerate(ds["output"].values.tolist() if "output" in ds else []):
        for name in (str(name) for name in ds.data_vars if ds[name].dims == ("response", "output")):
            unit = "rad" if name == "output_phase" else ds["output_units"].values[i]
            above = f"{output} {plain(name.removeprefix('output_'))}"
            columns[titled(above, unit)] = ds[name].values[:, i]
    return columns


KIND = ResultKind(
    "sl.frequency_response or sl.bifurcation_diagram",
    VARIABLES,
    ("response_of", "response_type", "response_branch"),
    account,
    rows,
    sheets=sheets,
)
