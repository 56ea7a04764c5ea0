"""What steady responses have to say, as tables: a row for each branch and each event; over two parameters for each kind of motion."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from saltus.results.schema import NO_BASIN, event_name, kind_text, parameters_of, response_name, states_of
from saltus.study.table import ROWS, TextTable
from saltus.units import from_si

if TYPE_CHECKING:
    import xarray as xr


def tables(title: str, ds: xr.Dataset) -> list[TextTable]:
    """The tables of responses: branches, and events if there are any; over two parameters kinds of motion."""
    if len(parameters_of(ds)) == 2:
        return [_kinds(title, ds)]
    return [_branches(title, ds), *([_events(title, ds)] if ds.sizes.get("event") else [])]


# -- one parameter -------------------------------------------------------------------------------------------------------------
def _branches(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each branch, the longest ones if there are many, in the order in which they begin."""
    (axis,) = parameters_of(ds)
    branch = ds["response_branch"].values
    numbers, sizes = np.unique(branch, return_counts=True)
    shown = np.sort(numbers[np.argsort(-sizes, kind="stable")[:ROWS]])
    unit = ds[axis].attrs.get("units", "")
    rows = tuple(_branch_row(int(number), ds.isel(response=np.flatnonzero(branch == number)), axis, unit) for number in shown)
    first = states_of(ds)[0]
    columns = ("branch", "type", "values", f"{axis.replace('_', ' ')} from", "to", "contacts in T", f"largest rms of {first}", "at",
               f"peak |{first}|", "to a graze", "largest exponent [1/s]")  # fmt: skip
    return TextTable(title, columns, rows, _notes(ds, len(numbers) - len(shown)))


def _branch_row(number: int, one: xr.Dataset, axis: str, unit: str) -> tuple[str, ...]:
    values, rms = one[response_name(axis)].values, one["response_rms"]
    top = int(np.nan_to_num(rms.values, nan=-math.inf).argmax())
    size = rms.attrs.get("units", "")
    return (
        str(number), _types(one), str(one.sizes["response"]), from_si(float(values.min()), unit, 5), from_si(float(values.max()), unit, 5),
        _span(one["response_contacts"].values), from_si(float(rms[top]), size, 4), from_si(float(values[top]), unit, 5),
        from_si(float(one["response_peak"].max()), size, 4),
        from_si(float(one["response_margin"].min()), one["response_margin"].attrs.get("units", ""), 3),
        f"{float(one['response_exponent'].max()):.4g}",
    )  # fmt: skip


def _types(ds: xr.Dataset) -> str:
    """``T``, or ``T, 2T`` where a branch changes its kind."""
    pairs = zip(ds["response_type"].values.tolist(), ds["response_period"].values.tolist(), strict=True)
    return ", ".join(dict.fromkeys(kind_text(kind, n) for kind, n in pairs))


def _span(values: np.ndarray) -> str:
    """``4``, or ``2 to 4``."""
    finite = values[np.isfinite(values)]
    if not finite.size:
        return "-"
    ends = [f"{value:.3g}" for value in (finite.min(), finite.max())]
    return " to ".join(dict.fromkeys(ends))


def _notes(ds: xr.Dataset, more: int) -> tuple[str, ...]:
    of = ds["response_of"].values
    notes = [f"{ds.sizes['response']} different responses from {of.size} starts at {math.prod(of.shape[:-1])} values."]
    if more:
        notes.append(f"{more} shorter branches are in the file.")
    unsettled = {word.replace("_", " "): int((of == code).sum()) for code, word in NO_BASIN.items()}
    notes += [f"Starts {word}: {count}." for word, count in unsettled.items() if count]
    return tuple(notes)


def _events(title: str, ds: xr.Dataset) -> TextTable:
    """A row for what happens to a branch between two values."""
    (axis,) = parameters_of(ds)
    unit = ds[axis].attrs.get("units", "")
    columns = (axis.replace("_", " "), "branch", "what happens")
    found = list(zip(ds[event_name(axis)].values, ds["event_branch"].values, ds["event_kind"].values.tolist(), strict=True))
    found.sort(key=lambda one: (one[0], one[1]))
    rows = tuple((from_si(float(value), unit, 5), str(branch), kind.replace("_", " ")) for value, branch, kind in found[:ROWS])
    notes = ("Each lies between two neighbouring values.",)
    return TextTable(f"{title}: on the way", columns, rows, notes + ((f"{len(found) - ROWS} more are in the file.",) * (len(found) > ROWS)))


# -- two parameters ------------------------------------------------------------------------------------------------------------
def _kinds(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each kind of motion: on how much of the map it is, and where."""
    of = ds["response_of"].values
    pairs = zip(ds["response_type"].values.tolist(), ds["response_period"].values.tolist(), strict=True)
    names = np.array([kind_text(kind, n) for kind, n in pairs], dtype=np.str_)
    cells = np.append(names, "")[np.where(of < 0, len(names), of)]
    rows = []
    for kind in sorted(set(names.tolist()), key=lambda kind: (len(kind), kind)):
        places = np.nonzero((cells == kind).any(axis=-1))
        spans = []
        for axis, index in zip(parameters_of(ds), places, strict=True):
            values, unit = ds[axis].values[index], ds[axis].attrs.get("units", "")
            spans.append(f"{from_si(float(values.min()), unit, 4)} to {from_si(float(values.max()), unit, 4)}" if index.size else "-")
        rows.append((kind, f"{100 * float((cells == kind).mean()):.2f} %", *spans))
    return TextTable(title, ("type", "share", *(axis.replace("_", " ") for axis in parameters_of(ds))), tuple(rows), _notes(ds, 0))
