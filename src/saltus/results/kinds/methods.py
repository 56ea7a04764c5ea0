"""Result of ``compare_methods``: an analysis by several methods, side by side."""

from __future__ import annotations

from dataclasses import replace

import xarray as xr

from saltus.results.dataset.schema import ResultKind
from saltus.results.dataset.variable import Variable
from saltus.results.kinds import responses
from saltus.results.kinds.agreement import AGREEING
from saltus.results.table import Column, TextTable, interval, number, quantity, table, words

#: Dims of numbers of a method at a place of the grid; of a start there if they differ by start.
_FIELD = ("method", "...", "start?")

#: Variables of the result of ``compare_methods``, besides the coordinates of the analysis.
VARIABLES = {
    "method": Variable(("method",), "", "method, the reference first", "str", coord=True),
    "method_cpu_seconds": Variable(
        ("method",), "s", "processor time, all threads, without compiling"
    ),
    "method_agreement": Variable(
        ("method",), "1", "share of the settled starts with the reference's answer"
    ),
    "method_agreement_low": Variable(("method",), "1", "the same, lower end of the 95 % interval"),
    "method_agreement_high": Variable(("method",), "1", "the same, upper end of the 95 % interval"),
    "method_contacts": Variable(("method",), "1", "contacts of a run", "i8"),
    **{name: responses.VARIABLES[name] for name in ("start", "start_direction")},
    **{
        name: replace(responses.VARIABLES[name], dims=_FIELD)
        for name in ("rms", "peak", "type", "period")
    },
    "basin": Variable(_FIELD, "1", "attractor, in the numbers of the reference", "i2"),
    "agrees": Variable(
        _FIELD, "1", "whether the start has the reference's answer", "i1", flags=AGREEING
    ),
    "known": Variable(
        _FIELD,
        "1",
        "whether the reference has this response at that value, from any start",
        "i1",
        flags=AGREEING,
    ),
    "orbit_distance": Variable(
        _FIELD, "1", "distance from the reference's response or state, in units of its size"
    ),
    "step_error": Variable(
        _FIELD,
        "1",
        "largest error of one forcing period from the reference's responses, in units "
        "of the motion's range",
    ),
    "step_error_rms": Variable(
        _FIELD, "1", "root mean square error of one forcing period, in units of the motion's range"
    ),
    "steps_per_period": Variable(_FIELD, "1", "steps tried in one forcing period"),
}


def account(ds: xr.Dataset) -> list[str]:
    """A line on each method: its agreement with the reference, and its cost."""
    names = ds["method"].values.tolist()
    of = "of the samples" if "method_contacts" in ds else "of the settled starts"
    lines = [f"found    {ds.attrs.get('analysis', 'an analysis')} by {len(names)} methods"]
    for i, name in enumerate(names):
        one = ds.isel(method=i)
        share, cost = float(one["method_agreement"]), float(one["method_cpu_seconds"])
        agrees = f"{share:.2%} {of} as by the reference" if i else "the reference"
        lines.append(f"  {name}: {agrees}, {cost:.3g} s of processor time")
    return lines


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each method, the reference first."""
    low, high = (ds[f"method_agreement_{end}"].values for end in ("low", "high"))
    columns: list[Column] = [
        words("method", ds["method"].values),
        number("agreement", ds["method_agreement"].values, ".2%"),
        interval("95 % interval", low, high, "{:.2%}".format),
        quantity("processor time", ds["method_cpu_seconds"].values, "s"),
    ]
    note = "Agreement: share of the settled starts with the answer of the first method."
    return [table(title, columns, (note,))]


KIND = ResultKind("sl.compare_methods", VARIABLES, ("method", "agrees"), account, rows)
