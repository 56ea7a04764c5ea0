"""Result of ``fit``: unknowns of a system from a measurement."""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.errors import counted
from saltus.results.dataset.schema import ResultKind
from saltus.results.dataset.variable import OUTPUT, Variable
from saltus.results.table import Column, TextTable, table, words
from saltus.units import from_si

_OF = ("unknown",)
_SAMPLE = ("sample", "output")
#: Misfits up to so many times that of the best valley are near.
NEAR = 2.0
#: A combination is of the unknowns with this share of it at least.
TAKES_PART = 0.1

#: Variables of the result of ``fit``. ``<unknown>``: the unit in ``unknown_units``; ``<output>``:
#: that in ``output_units``; ``<at>``: that of the time, or of the parameter that was varied.
VARIABLES = {
    "unknown": Variable(_OF, "", "unknown: a parameter or a start", "str", coord=True),
    "unknown_units": Variable(_OF, "", "unit of the unknown", "str", coord=True),
    "value": Variable(_OF, "<unknown>", "value"),
    "standard_error": Variable(_OF, "<unknown>", "standard error of the value"),
    "low": Variable(_OF, "<unknown>", "lower bound"),
    "high": Variable(_OF, "<unknown>", "upper bound"),
    "at_bound": Variable(_OF, "1", "whether the value lies at a bound", "i1"),
    "correlation": Variable((*_OF, "with"), "1", "correlation of the errors"),
    "combination_share": Variable(
        ("combination", "unknown"), "1", "direction in widths of the bounds, that known worst first"
    ),
    "combination_error": Variable(
        ("combination",), "1", "standard error along the direction, in widths of the bounds"
    ),
    "identifiable": Variable(
        ("combination",), "1", "whether the data tell more of it than the bounds do", "i1"
    ),
    "valley_value": Variable(("valley", "unknown"), "<unknown>", "value in the valley"),
    "valley_misfit": Variable(("valley",), "1", "misfit in the valley"),
    "valley_descents": Variable(("valley",), "1", "descents that ended in the valley", "i8"),
    "at": Variable(("sample",), "<at>", "<along>", coord=True),
    **OUTPUT,
    "measured": Variable(_SAMPLE, "<output>", "measured"),
    "fitted": Variable(_SAMPLE, "<output>", "what the equations say"),
    "residual": Variable(_SAMPLE, "<output>", "measured less fitted"),
    "noise": Variable(("output",), "<output>", "standard deviation of the noise"),
    "residual_correlation": Variable(("output",), "1", "correlation of neighbouring residuals"),
    "misfit": Variable(
        (), "1", "root mean square of the residuals, in standard deviations of the noise"
    ),
    "windows": Variable((), "1", "parts of the history, each with a start of its own", "i8"),
    "flows": Variable((), "1", "motions computed", "i8"),
}


def account(ds: xr.Dataset) -> list[str]:
    """Values with their errors, what the data leave open, and how sure it is that there is no
    better valley.
    """
    return [
        f"extent   {counted(ds.sizes['unknown'], 'unknown')}, {_count(ds)} measured values of "
        f"{', '.join(ds['output'].values)}, {ds['flows'].item()} motions",
        *_labelled("values", [_value(ds, i) for i in range(ds.sizes["unknown"])]),
        *_labelled("noise", _noise(ds)),
        *_labelled("data", _identified(ds)),
        *_labelled("valleys", _valleys(ds)),
    ]


def _labelled(label: str, lines: list[str]) -> list[str]:
    return [f"{label if i == 0 else '':<9}{line}" for i, line in enumerate(lines)]


def _count(ds: xr.Dataset) -> int:
    return int(np.isfinite(ds["measured"].values).sum())


def _value(ds: xr.Dataset, i: int) -> str:
    """An unknown with its standard error in a line."""
    one = ds.isel(unknown=i)
    name, unit, error = str(one["unknown"].item()), str(one["unknown_units"].item()), 0.0
    error = float(one["standard_error"])
    if not np.isfinite(error):
        return f"{name} = {from_si(float(one['value']), unit)}, which the data don't fix"
    digits = _digits(float(one["value"]), error)
    text = (
        f"{name} = {from_si(float(one['value']), unit, digits)}, standard error "
        f"{from_si(error, unit, 2)}"
    )
    return text + (", at a bound: widen the bounds" if one["at_bound"] else "")


def _digits(value: float, error: float) -> int:
    """Digits of a value that its error leaves, and one more."""
    if not (error > 0 and value):
        return 8
    return int(np.clip(2 + np.floor(np.log10(abs(value))) - np.floor(np.log10(error)), 2, 12))


def _noise(ds: xr.Dataset) -> list[str]:
    """Sentences on the noise, and on residuals that are no noise."""
    given = ds.attrs["noise_from"] == "given"
    each = ", ".join(
        f"{from_si(float(noise), str(unit), 3)} of {name}"
        for name, unit, noise in zip(
            ds["output"].values, ds["output_units"].values, ds["noise"].values, strict=True
        )
    )
    lines = [f"{each}, {'as given' if given else 'estimated from the residuals'}"]
    misfit = float(ds["misfit"])
    if ds.attrs["residuals"] == "larger":
        lines.append(
            f"The residuals are {misfit:.3g} times as large: the equations don't describe the data "
            "to within the noise, and the standard errors are too small."
        )
    elif ds.attrs["residuals"] == "alike":
        lines.append(
            "Neighbouring residuals follow each other: they aren't noise alone, and the standard "
            "errors are too small."
        )
    return lines


def _identified(ds: xr.Dataset) -> list[str]:
    """Sentences on the combinations that the data don't fix."""
    open_ = np.flatnonzero(ds["identifiable"].values == 0)
    if not len(open_):
        return ["They fix every unknown."]
    names = ds["unknown"].values
    lines = []
    for shares in ds["combination_share"].values[open_]:
        part = np.flatnonzero(np.abs(shares) >= TAKES_PART * np.abs(shares).max())
        text = " with ".join(
            f"{shares[i]:+.2g} {names[i]}" if len(part) > 1 else str(names[i])
            for i in part[np.argsort(-np.abs(shares[part]), kind="stable")]
        )
        more = ", changed together in these shares of their ranges" if len(part) > 1 else ""
        lines.append(f"They don't fix {text}{more}: within the bounds all is alike to them.")
    return lines


def _valleys(ds: xr.Dataset) -> list[str]:
    """Sentences on the descents and where they ended."""
    ended, misfit = ds["valley_descents"].values, ds["valley_misfit"].values
    lines, windows = [], int(ds["windows"])
    if windows > 1:
        lines.append(
            f"The motion is too sensitive to be followed from its start: it was fitted through "
            f"{windows} windows, each of which starts where the one before ends, to a millionth of "
            "the states."
        )
    if ended.sum():
        near = int(ended[1:][misfit[1:] <= NEAR * misfit[0]].sum())
        lines.append(
            f"{ended[0]} of {counted(int(ended.sum()), 'descent')} ended at these values"
            + (f", {near} elsewhere with a misfit below {NEAR:g} times as large" if near else "")
            + "."
        )
        if ended[0] == 1 and ended.sum() > 1:
            lines.append("No other descent confirms them: take more starts.")
    if ds.attrs["ended"] == "budget":
        lines.append("The budget of motions ended the search: these are the best values so far.")
    return lines or ["The search was stopped: these are the best values so far."]


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each unknown."""
    units = [str(unit) for unit in ds["unknown_units"].values]
    names = ds["unknown"].values
    columns = [
        words("unknown", names),
        *(
            _mixed(heading, ds[name].values, units, digits)
            for heading, name, digits in (
                ("value", "value", 7),
                ("standard error", "standard_error", 3),
                ("from", "low", 4),
                ("to", "high", 4),
            )
        ),
    ]
    return [table(title, columns, [*_noise(ds), *_identified(ds), *_valleys(ds)])]


def _mixed(heading: str, values: np.ndarray, units: list[str], digits: int) -> Column:
    """A column of numbers each with its own unit."""
    return Column(
        heading,
        lambda i: from_si(float(values[i]), units[i], digits),
        {f"{heading} [SI]": values.tolist()},
    )


KIND = ResultKind("sl.fit", VARIABLES, ("value", "standard_error", "fitted"), account, rows)
