"""What steady responses have to say, as tables: a row for each branch and each event; over two
parameters for each kind of motion.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.results.dataset.kinds import OPEN, Kind, sentences
from saltus.results.dataset.schema import (
    parameters_of,
    point_name,
    response_name,
    states_of,
)
from saltus.results.wording import kind_texts, unit_of
from saltus.study.answers.branches import events
from saltus.study.table import ROWS, Column, TextTable, interval, number, quantity, table, words
from saltus.units import from_si

if TYPE_CHECKING:
    import xarray as xr


def tables(title: str, ds: xr.Dataset) -> list[TextTable]:
    """The tables of responses: branches, and events if there are any; over two parameters kinds of
    motion.
    """
    if len(parameters_of(ds)) == 2:
        return [_kinds(title, ds)]
    if not ds.sizes.get("event"):
        return [_branches(title, ds)]
    return [_branches(title, ds), events(f"{title}: bifurcations", ds)]


# -- one parameter ---------------------------------------------------------------------------------
def _branches(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each branch in the order in which they begin; on the screen the longest ones if
    there are many.
    """
    (axis,) = parameters_of(ds)
    branch = ds["response_branch"].values
    numbers, sizes = np.unique(branch, return_counts=True)
    shown = np.sort(np.argsort(-sizes, kind="stable")[:ROWS]).tolist()
    each = [ds.isel(response=np.flatnonzero(branch == number)) for number in numbers]
    tops = [int(np.nan_to_num(one["response_rms"].values, nan=-math.inf).argmax()) for one in each]
    first, along = states_of(ds)[0], axis.replace("_", " ")
    values, (unit, size, gap) = (
        response_name(axis),
        (unit_of(ds[name]) for name in (axis, "response_rms", "response_margin")),
    )

    def ends(name: str, pick: Callable[[np.ndarray], Any]) -> list[float]:
        return [float(pick(one[name].values)) for one in each]

    extents = [
        _extent(ds, int(number), one[values].values)
        for number, one in zip(numbers, each, strict=True)
    ]

    def at_top(name: str) -> list[float]:
        return [float(one[name].values[top]) for one, top in zip(each, tops, strict=True)]

    columns = [
        words("branch", numbers),
        words("type", [_types(one) for one in each]),
        words("values", sizes),
        quantity(f"{along} from", [low for low, _ in extents], unit, 5),
        quantity("to", [high for _, high in extents], unit, 5, name=f"{along} to"),
        interval(
            "contacts in T",
            ends("response_contacts", _least),
            ends("response_contacts", _most),
            "{:.3g}".format,
        ),
        quantity(f"largest rms of {first}", at_top("response_rms"), size),
        quantity("at", at_top(values), unit, 5, name=f"{along} at the largest rms"),
        quantity(f"peak |{first}|", ends("response_peak", _most), size),
        quantity("to a graze", ends("response_margin", _least), gap, 3),
        number("largest exponent", ends("response_exponent", _most), ".4g", "1/s"),
    ]
    return table(title, columns, _notes(ds, len(numbers) - len(shown)), shown)


def _extent(ds: xr.Dataset, branch: int, values: np.ndarray) -> tuple[float, float]:
    """Least and largest value of the parameter on a branch: of its responses, and as far as it was
    followed.
    """
    if "point_branch" in ds:
        followed = ds[point_name(parameters_of(ds)[0])].values[ds["point_branch"].values == branch]
        values = np.concatenate([values, followed])
    return float(values.min()), float(values.max())


def _least(values: np.ndarray) -> float:
    """The least of the numbers that are there; NaN of none."""
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


def _notes(ds: xr.Dataset, more: int) -> tuple[str, ...]:
    of = ds["response_of"].values
    notes = [
        f"{ds.sizes['response']} different responses from {of.size} starts at "
        f"{math.prod(of.shape[:-1])} values."
    ]
    if more:
        notes.append(f"{more} shorter branches are in the file.")
    left = int((ds["response_type"].values == Kind.NOT_REPEATING.word).sum())
    if left:
        notes.append(f"{left} responses {OPEN}")
    return (*notes, *sentences(of))


# -- two parameters --------------------------------------------------------------------------------
def _kinds(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each kind of motion: on how much of the map it is, and where."""
    of = ds["response_of"].values
    names = np.array(kind_texts(ds, "response_"), dtype=np.str_)
    cells = np.append(names, "")[np.where(of < 0, len(names), of)]
    kinds = sorted(set(names.tolist()), key=lambda kind: (len(kind), kind))
    columns = [
        words("type", kinds),
        Column(
            "share",
            lambda i: f"{100 * shares[i]:.2f} %",
            {"share": (shares := [float((cells == kind).mean()) for kind in kinds])},
        ),
    ]
    for dim, axis in enumerate(parameters_of(ds)):
        values, unit = ds[axis].values, unit_of(ds[axis])
        where = [values[np.nonzero((cells == kind).any(axis=-1))[dim]] for kind in kinds]
        low, high = ([of(found) for found in where] for of in (_least, _most))
        columns.append(
            interval(axis.replace("_", " "), low, high, partial(from_si, unit=unit, digits=4), unit)
        )
    return table(title, columns, _notes(ds, 0))
