"""What results that aren't runs say in a few lines: the part of ``describe`` that knows them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from saltus.errors import counted
from saltus.results.dataset.kinds import LONGER, OPEN, Kind
from saltus.results.dataset.schema import (
    AGREEMENT,
    BASINS,
    EXPONENTS,
    RESPONSES,
    axes_of,
    kind_of,
    kind_text,
    parameters_of,
    states_of,
)
from saltus.results.summary_motions import WRITERS
from saltus.results.wording import kind_texts, tally, unit_of

#: Attractors that get a line of their own; the others are counted.
_LINES = 12
#: Trust numbers of a map, and what they are called in the text.
_TRUST = {
    "basin_entropy": "basin entropy",
    "boundary_basin_entropy": "on the boundary",
    "uncertainty_exponent": "uncertainty exponent",
}


def summary(ds: xr.Dataset) -> list[str]:
    """Lines on the extent and the content of a result that isn't a run."""
    if kind_of(ds) in WRITERS:
        return WRITERS[kind_of(ds)](ds)
    if kind_of(ds) == RESPONSES:
        return [
            f"extent   {_span(ds, parameters_of(ds), 'values')}, "
            f"{counted(ds.sizes['start'], 'start')} at each",
            *_responses(ds),
            *_untyped(ds["response_of"], Kind.UNCONVERGED, Kind.FAILED),
            *_missed(ds.sizes["start"], " at each"),
        ]
    if kind_of(ds) == AGREEMENT:
        return [f"extent   {_axes(ds)}", *_agreement(ds)]
    if kind_of(ds) == EXPONENTS:
        return _exponents(ds)
    lines = [f"extent   {_axes(ds)}" if kind_of(ds) == BASINS else f"extent   {_starts(ds)}"]
    lines += _attractors(ds)
    if "basin" in ds:
        lines.append(f"settled  {_unsettled(ds['basin'])}")
        words = own_errors(ds.attrs) if (ds["basin"].values == Kind.UNCONVERGED).any() else ""
        lines += [f"noise    {words}"] if words else []
        lines += _untyped(ds["basin"], Kind.UNCONVERGED)
        lines += _missed(int((ds["basin"].values != Kind.NOT_COMPUTED).sum()))
    trust = [f"{words} {ds.attrs[name]:.3g}" for name, words in _TRUST.items() if name in ds.attrs]
    return lines + ([f"trust    {', '.join(trust)}"] if trust else [])


def _missed(starts: int, where: str = "") -> list[str]:
    """A line on what so many starts may have missed: by the rule of three a basin above 3/N of
    their box is met with 95 %. Hanley & Lippman-Hand, J. Am. Med. Assoc. 249 (1983) 1743.
    """
    if not starts:
        return []
    size = f" with a basin below {300 / starts:.2g} % of where they lie" if starts > 3 else ""
    return [f"missed   {counted(starts, 'start')}{where}: other attractors{size} may be missed"]


def _untyped(labels: xr.DataArray, *codes: Kind) -> list[str]:
    """A line on starts whose motion has no type: those with one of some codes."""
    return [f"untyped  {LONGER}"] if np.isin(labels.values, codes).any() else []


def own_errors(attrs: Mapping[Any, Any]) -> str:
    """What errors of a method have to do with starts that never settled, in a sentence or two; ""
    for one whose errors are rounding.
    """
    method = str(attrs.get("method", ""))
    if method != "RK4" and not method.startswith("ODE"):
        return ""
    name, knob = (method, "step") if method == "RK4" else (method.lower(), "rtol")
    if "unconverged_exactly" not in attrs:
        return (
            f"Errors of {name} itself can keep a motion from settling. A smaller {knob}, or "
            "Taylor, tells."
        )
    if not attrs["unconverged_exactly"]:
        return "By exact integration from where they stand they settle to no orbit either."
    return (
        f"Errors of {name} itself keep them from having a type: exact integration from where they "
        "stand settles to "
        f"{attrs['unconverged_exactly']}, and {name} strays from there by up to "
        f"{float(attrs['unconverged_stray']):.0%} of the range of a "
        f"state. Take a smaller {knob}, or Taylor."
    )


def _axes(ds: xr.Dataset) -> str:
    return _span(ds, axes_of(ds), "starts")


def _span(ds: xr.Dataset, names: tuple[str, ...], what: str) -> str:
    """How many there are along each coordinate, and from where to where they reach."""
    parts = []
    for name in names:
        values, unit = ds[name].values, unit_of(ds[name])
        parts.append(
            f"{name} from {values.min():g} to {values.max():g} {unit}".rstrip()
            if values.size
            else f"{name} empty"
        )
    return f"{' x '.join(str(ds.sizes[name]) for name in names)} {what}, {', '.join(parts)}"


def _starts(ds: xr.Dataset) -> str:
    return (
        f"{ds.sizes['trajectory']} starts"
        if "trajectory" in ds.dims
        else ("attractors without their starts")
    )


def _attractors(ds: xr.Dataset) -> list[str]:
    count = ds.sizes["attractor"]
    unit = unit_of(ds["attractor_peak"])
    words = []
    for i in range(count):
        one = ds.isel(attractor=i)
        period = int(one["attractor_period"])
        kind = str(one["attractor_type"].item())
        name = f"{kind} {period}T" if kind == "periodic" else kind_text(kind, period)
        if kind == "limit_cycle" and "attractor_cycle" in one:
            cycle = float(one["attractor_cycle"])
            name += f", period {cycle:.4g} s, {1 / cycle:.4g} Hz"
        size = f"peak {float(one['attractor_peak']):.4g} {unit}".rstrip()
        if kind == Kind.NOISY_PERIODIC.word:
            size += f", scatter {float(one['attractor_scatter']):.2g} {unit}".rstrip()
        words.append(f"{name}, {size}")
    lines = [f"found    {counted(count, 'attractor')}"]
    for i, text in enumerate(words[:_LINES]):
        one = ds.isel(attractor=i)
        through = _through(one) if words.count(text) > 1 else ""
        share = (
            f", {float(one['attractor_fraction']):.2%} of the starts"
            if "attractor_fraction" in one
            else ""
        )
        lines.append(f"  {i}: {text}{through}{share}")
    return lines + _more(count)


def _more(count: int) -> list[str]:
    """A line on those that have none of their own."""
    return [f"  and {count - _LINES} more"] if count > _LINES else []


def _through(one: xr.Dataset) -> str:
    """The first point that an attractor is known by: it tells mirror images apart, whose sizes are
    the same.
    """
    names = [name for name in states_of(one) if f"attractor_{name}" in one]
    points = {name: float(np.ravel(one[f"attractor_{name}"].values)[0]) for name in names}
    units = {name: unit_of(one[f"attractor_{name}"]) for name in names}
    place = ", ".join(
        f"{name} = {value:.4g} {units[name]}".rstrip()
        for name, value in points.items()
        if np.isfinite(value)
    )
    return f", through {place}" if place else ""


def _unsettled(basin: xr.DataArray) -> str:
    """How many starts lead to an attractor, and what became of the others."""
    meanings = _meanings(basin)
    codes, counts = np.unique(basin.values, return_counts=True)
    others = [
        f"{count} {meanings[int(code)]}"
        for code, count in zip(codes, counts, strict=True)
        if code < 0
    ]
    return ", ".join([f"{int(counts[codes >= 0].sum())} of {basin.size} starts", *others])


def _responses(ds: xr.Dataset) -> list[str]:
    """What was found: branches, kinds of motion, events; and what became of the starts."""
    kinds = kind_texts(ds, "response_")
    found = f"found    {counted(len(kinds), 'response')}"
    if len(parameters_of(ds)) == 1:
        found += f" on {counted(np.unique(ds['response_branch'].values).size, 'branch')}"
    lines = [f"{found}: {_tally(kinds)}" if kinds else found]
    if ds.sizes.get("event"):
        lines.append(f"events   {_tally(ds['event_kind'].values.tolist())}")
    if text := ds.attrs.get("branches_refused"):
        lines.append(f"unsure   branches are matched by where responses lie: {text}")
    if "branch_end" in ds:
        ends = np.concatenate([ds["branch_begin"].values, ds["branch_end"].values])
        if lost := int((ends == "lost").sum()):
            lines.append(
                f"unsure   {counted(lost, 'end')} of branches where no more orbits were found: "
                "a narrower range gives shorter steps"
            )
        if stopped := int((ends == "points").sum()):
            lines.append(
                f"stopped  {counted(stopped, 'end')} of branches that go on, after 1000 points: "
                "their orbits may grow without bound"
            )
    left = int((ds["response_type"].values == Kind.NOT_REPEATING.word).sum())
    if left:
        lines.append(f"open     {counted(left, 'response')} {OPEN}")
    return [*lines, f"settled  {_unsettled(ds['response_of'])}"]


def _tally(words: list[str]) -> str:
    """``212 T, 31 3T``, the most frequent first."""
    found = sorted(tally(words).items(), key=lambda one: -one[1])
    more = f" and {len(found) - _LINES} other kinds" if len(found) > _LINES else ""
    return ", ".join(f"{n} {word}" for word, n in found[:_LINES]).replace("_", " ") + more


def _exponents(ds: xr.Dataset) -> list[str]:
    """A line on each trajectory: the kind of motion, and its exponents with the half-width of the
    95 % interval of the largest.
    """
    count, unit = ds.sizes["trajectory"], unit_of(ds["lyapunov_exponent"])
    lines = [f"measured {ds.attrs.get('algorithm', 'unknown')}, {counted(count, 'trajectory')}"]
    for i in range(min(count, _LINES)):
        one = ds.isel(trajectory=i)
        values = ", ".join(f"{value:.6g}" for value in one["lyapunov_exponent"].values)
        first = float(one["lyapunov_exponent"][0])
        width = float(one["lyapunov_high"][0]) - first if np.isfinite(first) else 0.0
        graze = ", near a graze" if "near_graze" in one and int(one["near_graze"]) else ""
        kind = kind_text(str(one["kind"].item()), int(one["response_period"]))
        lines.append(f"  {i}: {kind}, {values} {unit}, the first +- {width:.1e}{graze}")
    lines += _more(count)
    if (ds["kind"].values == "unclear").any():
        lines.append(f"untyped  {LONGER}")
    if np.isneginf(ds["lyapunov_exponent"].values).any():
        lines.append("-inf     where a contact sticks or rests, nothing is left of a deviation")
    return lines


def _agreement(ds: xr.Dataset) -> list[str]:
    meanings = _meanings(ds["agreement"])
    counts = {
        meanings[code]: int((ds["agreement"].values == code).sum())
        for code in sorted(meanings, reverse=True)
    }
    a, b = ds["match_a"].values, ds["match_b"].values
    alone = f"{int((b < 0).sum())} only in the first map, {int((a < 0).sum())} only in the second"
    share = ds.attrs.get("agreement", np.nan)
    return [
        f"maps     {ds.attrs.get('method_a', 'unknown')} and {ds.attrs.get('method_b', 'unknown')}",
        f"agree    {share:.2%} of the settled starts "
        f"({', '.join(f'{count} {word}' for word, count in counts.items())})",
        f"matched  {int(((a >= 0) & (b >= 0)).sum())} attractors, {alone}",
    ]


def _meanings(variable: xr.DataArray) -> Mapping[int, str]:
    """Code to word, from the attributes of the variable."""
    words = variable.attrs["flag_meanings"].split()
    return dict(zip(np.asarray(variable.attrs["flag_values"]).tolist(), words, strict=True))
