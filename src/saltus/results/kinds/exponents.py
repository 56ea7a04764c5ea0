"""Result of ``lyapunov`` and ``wolf``: Lyapunov exponents of motions."""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.errors import counted
from saltus.results.dataset.kinds import LONGER, Kind
from saltus.results.dataset.schema import ResultKind, kind_text
from saltus.results.dataset.variable import MINIMA, STATUS, TRAJECTORY_NUMBER, VARIED, Variable
from saltus.results.table import (
    TextTable,
    interval,
    left_out,
    number,
    of_trajectory,
    table,
    words,
)
from saltus.results.wording import LINES, more, unit_of

_EACH = ("trajectory",)
#: Meaning of the values of ``near_graze``.
NEAR = {0: "clear_of_grazes", 1: "near_graze"}
#: Exponents that get a column of their own.
COLUMNS = 4
#: Sum of the exponents, and the mean divergence that it must equal.
_SUMS = {"sum": "exponent_sum", "mean divergence": "mean_divergence"}

#: Variables of the results of ``lyapunov`` and ``wolf``: exponents in descending order, and running
#: means. ``<rate>``: the unit that was asked for, such as ``bit/period``.
VARIABLES = {
    **TRAJECTORY_NUMBER,
    "kind": Variable(_EACH, "", "kind of motion", "str"),
    "response_period": Variable(
        _EACH, "1", "period in forcing periods, 0 if it doesn't repeat", "i8"
    ),
    "lyapunov_exponent": Variable(("trajectory", "exponent"), "<rate>", "Lyapunov exponent"),
    "lyapunov_error": Variable(
        ("trajectory", "exponent"), "<rate>", "standard error of the Lyapunov exponent"
    ),
    "lyapunov_low": Variable(
        ("trajectory", "exponent"), "<rate>", "Lyapunov exponent, lower end of the 95 % interval"
    ),
    "lyapunov_high": Variable(
        ("trajectory", "exponent"), "<rate>", "Lyapunov exponent, upper end of the 95 % interval"
    ),
    "flow_lyapunov_exponent": Variable(
        ("trajectory", "flow_exponent"),
        "<rate>",
        "Lyapunov exponent of the flow, its phase included",
    ),
    "exponent_sum": Variable(_EACH, "<rate>", "sum of the Lyapunov exponents"),
    "mean_divergence": Variable(_EACH, "<rate>", "mean rate at which volumes grow"),
    "independent_batches": Variable(
        _EACH, "1", "batches that the error of the largest exponent comes from", "i8"
    ),
    "near_graze": Variable(
        _EACH, "1", "whether the motion grazes a boundary, or nearly so", "i1", flags=NEAR
    ),
    "grazes": Variable(_EACH, "1", "grazes after the transient", "i8"),
    "grazes_unresolved": Variable(
        _EACH, "1", "grazes shallower than the local error, after the transient", "i8"
    ),
    "smallest_gap_margin": MINIMA["smallest_gap_margin"],
    "block_time": Variable(
        _EACH, "s", "time of a block: the forcing period, or the time between two samples"
    ),
    "status": STATUS,
    "replacements": Variable(_EACH, "1", "replacements of the neighbour", "i8"),
    "replaced_distance": Variable(
        _EACH, "1", "mean distance at replacement, as a share of the range of the motion"
    ),
    "replaced_angle": Variable(_EACH, "rad", "mean angle between old and new neighbour"),
    "running_time": Variable(("trajectory", "running"), "s", "time since the end of the transient"),
    "running_exponent": Variable(
        ("trajectory", "exponent", "running"), "<rate>", "Lyapunov exponent so far"
    ),
    "running_low": Variable(
        ("trajectory", "exponent", "running"),
        "<rate>",
        "Lyapunov exponent so far, lower end of the 95 % interval",
    ),
    "running_high": Variable(
        ("trajectory", "exponent", "running"),
        "<rate>",
        "Lyapunov exponent so far, upper end of the 95 % interval",
    ),
    **VARIED,
}


def account(ds: xr.Dataset) -> list[str]:
    """A line on each trajectory: the kind of motion, and its exponents with the half-width of the
    95 % interval of the largest.
    """
    count, unit = ds.sizes["trajectory"], unit_of(ds["lyapunov_exponent"])
    lines = [f"measured {ds.attrs.get('algorithm', 'unknown')}, {counted(count, 'trajectory')}"]
    for i, (kind, graze) in enumerate(zip(_kinds(ds)[:LINES], _grazes(ds), strict=False)):
        exponents = ds["lyapunov_exponent"].values[i]
        first = float(exponents[0])
        width = float(ds["lyapunov_high"].values[i, 0]) - first if np.isfinite(first) else 0.0
        values = ", ".join(f"{value:.6g}" for value in exponents)
        lines.append(
            f"  {i}: {kind}, {values} {unit}, the first +- {width:.1e}{graze and f', {graze}'}"
        )
    lines += more(count)
    lines += _doubts(ds)
    if np.isneginf(ds["lyapunov_exponent"].values).any():
        lines.append("-inf     where a contact sticks or rests, nothing is left of a deviation")
    return lines


def _doubts(ds: xr.Dataset) -> list[str]:
    """Lines on what the time of measurement leaves open."""
    kinds, lines = ds["kind"].values, []
    watched = int(ds.attrs.get("transient", 0)) + int(ds.attrs.get("periods", 0))
    if (kinds == "unclear").any():
        lines.append(
            f"untyped  a motion may not have settled in {watched} blocks: a longer transient= and "
            "more periods= tell more"
        )
        lines.append(f"untyped  {LONGER}")
    if (kinds == Kind.CHAOTIC.word).any() and watched:
        lines.append(
            f"unsure   chaotic for as long as it was watched, {watched} blocks: chaos that ends "
            "later looks the same"
        )
    return lines


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each trajectory: kind of motion, exponents, interval of the largest, their sum,
    mean divergence.
    """
    exponents, unit = ds["lyapunov_exponent"].values, unit_of(ds["lyapunov_exponent"])
    low, high = (ds[name].values[:, 0] for name in ("lyapunov_low", "lyapunov_high"))
    columns = [
        *of_trajectory(ds, heading=""),
        words("motion", _kinds(ds)),
        *(
            number(f"exponent {k + 1}", exponents[:, k], ".6g", unit)
            for k in range(min(ds.sizes["exponent"], COLUMNS))
        ),
        interval("95 % interval of the largest", low, high, "{:.6g}".format, unit),
    ]
    if _has_sums(ds):
        columns += [number(label, ds[name].values, ".6g", unit) for label, name in _SUMS.items()]
    columns.append(words("", _grazes(ds), "near a graze"))
    return [table(title, columns, _notes(ds))]


def _kinds(ds: xr.Dataset) -> list[str]:
    """The kind of each motion in a word."""
    return [
        kind_text(str(kind), int(n))
        for kind, n in zip(ds["kind"].values, ds["response_period"].values, strict=True)
    ]


def _grazes(ds: xr.Dataset) -> list[str]:
    """``near a graze`` for each motion near one, else ``""``."""
    if "near_graze" not in ds:
        return [""] * ds.sizes["trajectory"]
    return ["near a graze" if one else "" for one in ds["near_graze"].values]


def _has_sums(ds: xr.Dataset) -> bool:
    """True where the sum of the exponents has a mean divergence that it must equal."""
    return "mean_divergence" in ds and ds.sizes["exponent"] > 1


def _notes(ds: xr.Dataset) -> tuple[str, ...]:
    notes = left_out(ds.sizes["trajectory"], "motions")
    if any(_grazes(ds)):
        notes.append(
            "Near a graze finite deviations don't grow as infinitesimal ones do: the "
            "exponents say little there."
        )
    if _has_sums(ds):
        notes.append(
            "The sum of the exponents and the mean divergence, found without the tangent, "
            "must agree."
        )
    return tuple(notes)


KIND = ResultKind(
    "sl.lyapunov or sl.wolf", VARIABLES, ("lyapunov_exponent", "running_exponent"), account, rows
)
