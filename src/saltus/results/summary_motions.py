"""What sections, spectra, impact statistics, energy balances, settled responses and widths say in a
few lines, for ``describe``.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import xarray as xr

from saltus.errors import counted
from saltus.results.dataset.schema import (
    BACKBONE,
    BRANCHES,
    CURVE,
    ENERGY,
    EQUILIBRIA,
    IMPACTS,
    MODES,
    ORBITS,
    SECTION,
    SETTLED,
    SPECTRUM,
    WIDTHS,
    equilibrium_name,
    event_name,
    kind_text,
    period_text,
    point_name,
    states_of,
)
from saltus.results.wording import unit_of

#: Largest lines of a spectrum that are listed.
_LINES = 5
#: Orbits that get a line of their own.
_ORBITS = 12


def _section(ds: xr.Dataset) -> list[str]:
    directions = {0: "both ways", 1: "upwards", -1: "downwards"}[int(ds.attrs["direction"])]
    return [
        f"surface  {ds.attrs['surface']}, {directions}",
        f"found    {ds.sizes['crossing']} crossings, {int(ds['tangencies'].sum())} tangencies, "
        f"{int(ds['contacts'].sum())} contacts",
    ]


def _spectrum(ds: xr.Dataset) -> list[str]:
    one = ds.isel(trajectory=0) if "trajectory" in ds.dims else ds
    frequency = one["frequency"].values
    lines = [
        f"extent   {len(frequency)} lines up to {frequency[-1]:g} Hz, window {one['window'].item()}"
    ]
    for name in states_of(ds):
        amplitude, unit = one[f"{name}_amplitude"].values, unit_of(one[f"{name}_amplitude"])
        largest = np.argsort(amplitude)[::-1][:_LINES]
        lines.append(
            f"  {name}: "
            + ", ".join(
                f"{amplitude[i]:.4g} {unit}".rstrip() + f" at {frequency[i]:.6g} Hz"
                for i in largest
            )
        )
    return lines


def _impacts(ds: xr.Dataset) -> list[str]:
    lines = [f"found    {ds.sizes['contact']} contacts"]
    for i, name in enumerate(ds["guard"].values.tolist()):
        one = ds.isel(guard=i)
        rate, speed, share = (
            float(one[key].mean())
            for key in ("contacts_per_second", "speed_mean", "share_in_contact")
        )
        unit = unit_of(one["speed_mean"])
        lines.append(
            f"  {name}: {rate:.4g} a second, at {speed:.4g} {unit}".rstrip() + f" on average, "
            f"in contact {share:.2%} of the time"
        )
    return lines


def _energy(ds: xr.Dataset) -> list[str]:
    count = ds["residual"].shape[-1]
    parts = {
        "supplied": "supplied",
        "dissipated": "dissipated",
        "friction": "taken by friction",
        "impacts": "taken by impacts",
    }
    means = [
        f"{float(ds[name].mean()):.6g} J {words}" for name, words in parts.items() if name in ds
    ]
    return [
        f"extent   {count} intervals",
        f"found    {', '.join(means[:-1])} and {means[-1]} in each on average",
        f"balance  off by {float(ds['imbalance'].max()):.1e} of the energy turned over",
    ]


def _settled(ds: xr.Dataset) -> list[str]:
    found, counts = np.unique(ds["response_period"].values, return_counts=True)
    each = [f"{count} {period_text(int(n))}" for n, count in zip(found, counts, strict=True)]
    return [f"found    {', '.join(each)}"]


def _widths(ds: xr.Dataset) -> list[str]:
    width, unit = float(ds["equal_width"]), ds["equal_width"].attrs["units"]
    found = (
        "at none of the widths"
        if np.isnan(width)
        else f"at a width of {width:.3g} {unit}".rstrip()
        + f", {float(ds['equal_steps_per_period']):.3g} steps a period"
    )
    return [
        f"contacts error {float(ds['method_error']):.2g} of a period, "
        f"{float(ds['method_steps_per_period']):.3g} steps",
        f"equal    {found}",
    ]


def _modes(ds: xr.Dataset) -> list[str]:
    frequency, share = ds["frequency"].values, ds["flexibility_share"].values
    lines = [f"found    {len(frequency)} modes of {ds.sizes['degree']} degrees of freedom"]
    lines += [f"extent   {frequency[0]:.4g} to {frequency[-1]:.4g} Hz"]
    for place, one in zip(ds["place"].values.tolist(), share.tolist(), strict=True):
        lines.append(f"  {place}: {one:.2%} of the static flexibility")
    return lines


def _equilibria(ds: xr.Dataset) -> list[str]:
    lines = [f"found    {counted(ds.sizes['equilibrium'], 'equilibrium')}"]
    for i in range(ds.sizes["equilibrium"]):
        one = ds.isel(equilibrium=i)
        states = [one[equilibrium_name(name)] for name in states_of(ds)]
        at = ", ".join(
            f"{name} = {float(value):.4g} {unit_of(value)}".rstrip()
            for name, value in zip(states_of(ds), states, strict=True)
        )
        kind = one["equilibrium_type"].item().replace("_", "-")
        stable = "stable" if one["equilibrium_stable"] else "unstable"
        word = kind if kind in ("center", "degenerate", "undecided") else f"{stable} {kind}"
        contacts = one["equilibrium_contacts"].item()
        on = "held at" if one["equilibrium_place"].item() == "pseudo" else "on the boundary"
        where = f", {on} {contacts}" if contacts else ""
        lines.append(f"  {i}: {word} at {at}{where}")
    return lines


def _branches(ds: xr.Dataset) -> list[str]:
    name = ds.attrs["parameter"]
    unit = unit_of(ds[point_name(name)])
    closed, stable = ds["branch_closed"].values, ds["point_stable"].values
    lines = [
        f"found    {counted(ds.sizes['branch'], 'branch')}, {int(closed.sum())} of "
        f"them closed, {ds.sizes['point']} points"
        + (f", {stable.mean():.0%} of them stable" if len(stable) else ""),
    ]
    at, kind, of = (ds[one].values for one in (event_name(name), "event_kind", "event_branch"))
    for i, periods in enumerate(ds["branch_periods"].values.tolist()):
        mine = ds[point_name(name)].values[ds["point_branch"].values == i]
        text = ", ".join(
            f"{word.replace('_', ' ')} {value:.10g}"
            for word, value in zip(kind[of == i], at[of == i], strict=True)
        )
        extent = f"{mine.min():.6g} to {mine.max():.6g} {unit}".rstrip()
        ends = ", closed" if closed[i] else _stopped(ds.isel(branch=i), mine[[0, -1]])
        what = ds["branch_kind"].values[i]
        what = period_text(periods) if what == "periodic" else what.replace("_", " ")
        lines.append(f"  {i}: {what} from {extent}{ends}{text and '; ' + text}")
    for i, count in enumerate(ds["branch_unexplained"].values.tolist()):
        if count:
            changes = counted(count, "change")
            lines.append(
                f"unsure   {changes} of stability unexplained on branch {i}: a narrower range of "
                f"{name} gives shorter steps"
            )
    return lines


def _stopped(branch: xr.Dataset, ends: np.ndarray) -> str:
    """Where a branch ends within the range though it goes on."""
    words = {
        "points": "stopped by points=",
        "lost": "lost",
        "held": "ends where the chatter before a held contact changes",
    }
    text = ""
    for side, last in zip(("begin", "end"), ends, strict=True):
        why = branch[f"branch_{side}"].item()
        if why == "accumulates":
            limit = float(branch[f"branch_{side}_limit"])
            places = max(0, -math.floor(math.log10(abs(last - limit))))  # see ladders.STEADY
            text += f", its grazes accumulate at {limit:.{places}f}"
        elif why in words:
            text += f", {words[why]} at {last:.6g}"
    return text


def _curve(ds: xr.Dataset) -> list[str]:
    names = ds.attrs["parameter_x"], ds.attrs["parameter_y"]
    spans = [
        f"{name} {ds[point_name(name)].values.min():.6g} to {ds[point_name(name)].values.max():.6g}"
        f" {unit_of(ds[point_name(name)])}".rstrip()
        for name in names
    ]
    what = ds.attrs["bifurcation"].replace("_", " ")
    lines = [
        f"found    {what} of {period_text(ds.attrs['periods'])} at {ds.sizes['point']} points, "
        + ", ".join(spans)
    ]
    for i, kind in enumerate(ds["codim2_kind"].values):
        at = ", ".join(f"{name} {float(ds[f'codim2_{name}'][i]):.10g}" for name in names)
        lines.append(f"  {kind.replace('_', ' ')} at {at}")
    return lines


def _backbone(ds: xr.Dataset) -> list[str]:
    frequency, name = ds["backbone_frequency"].values, ds.attrs["amplitude_of"]
    one = ds.sel(output=name)
    peak, unit = one["point_output_peak"].values, one["output_units"].item()
    phase = " in quadrature" if ds.attrs["phase"] == "quadrature" else ""
    return [
        f"found    mode {ds.attrs['mode']}{phase} at {len(peak)} points, {frequency[0]:.8g} Hz at "
        f"|{name}| {peak[0]:.4g} {unit} to {frequency[-1]:.8g} Hz at {peak[-1]:.4g} "
        f"{unit}".rstrip(),
        f"ends     {ds.attrs['end']}, {ds['point_stable'].values.mean():.0%} of it stable",
    ]


#: For each kind, what writes its lines.
def _orbits(ds: xr.Dataset) -> list[str]:
    """A line on each orbit, and what the search says of those that it missed."""
    unit = unit_of(ds["orbit_peak"])
    stable = int((ds["orbit_stable"].values == 1).sum())
    lines = [f"found    {counted(ds.sizes['orbit'], 'orbit')}, {stable} of them stable"]
    for i in range(min(ds.sizes["orbit"], _ORBITS)):
        one = ds.isel(orbit=i)
        size = f"peak {float(one['orbit_peak']):.4g} {unit}".rstrip()
        real, imag = (
            float(np.ravel(one[f"orbit_multiplier_{part}"].values)[0]) for part in ("real", "imag")
        )
        cycle = f" of {float(one['orbit_cycle']):.8g} s" if "orbit_cycle" in one else ""
        lines.append(
            f"  {i}: {kind_text(str(one['orbit_type'].item()), int(one['orbit_period']))}{cycle}, "
            f"{one['orbit_stability'].item()}, {size}, "
            f"largest multiplier {np.hypot(real, imag):.4g}"
        )
    if ds.sizes["orbit"] > _ORBITS:
        lines.append(f"  and {ds.sizes['orbit'] - _ORBITS} more")
    for i in range(ds.sizes.get("search_period", 0)):
        one = ds.isel(search_period=i)
        share = float(one["search_unseen"])
        unseen = f", about {share:.1%} of them to one that isn't known" if share == share else ""
        lines.append(
            f"search   {period_text(int(one['search_period']), 'limit cycles')}: "
            f"{int(one['search_converged'])} of {ds.attrs.get('starts', '?')} starts led to an "
            f"orbit{unseen}; deflation found {int(one['search_deflated'])} more"
        )
    if "search_given_up" in ds and (dropped := int(ds["search_given_up"].max())):
        lines.append(
            f"given up {counted(dropped, 'start')}: the motion took more steps or contacts than "
            f"allowed. Start nearer to where the system moves, or allow more: "
            f"method=sl.Taylor(max_steps=..., max_events=...); impacts written as impact(...) in "
            f"place of jump(...) come to rest"
        )
    return lines


WRITERS: dict[str, Callable[[xr.Dataset], list[str]]] = {
    SECTION: _section,
    SPECTRUM: _spectrum,
    IMPACTS: _impacts,
    ENERGY: _energy,
    SETTLED: _settled,
    WIDTHS: _widths,
    MODES: _modes,
    ORBITS: _orbits,
    EQUILIBRIA: _equilibria,
    BRANCHES: _branches,
    CURVE: _curve,
    BACKBONE: _backbone,
}
