"""Result of ``impact_statistics``: number, speeds, durations, forces and impulses of contacts."""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.results.dataset.schema import ResultKind
from saltus.results.dataset.variable import ENDINGS, GUARDS, SHARED, Variable
from saltus.results.table import (
    Column,
    TextTable,
    flat,
    left_out,
    of_trajectory,
    quantity,
    table,
    with_error,
    words,
)
from saltus.results.wording import failed, sized, unit_of

_CONTACT = ("contact",)
_GUARD = ("trajectory", "guard")

#: Variables of the result of ``impact_statistics``.
VARIABLES = {
    "contact_time": Variable(_CONTACT, "s", "time at which the contact begins"),
    "contact_guard": Variable(_CONTACT, "", "guard that was met", "str"),
    "contact_speed": Variable(_CONTACT, "<gap rate>", "speed at which the contact begins"),
    "contact_exit_speed": Variable(_CONTACT, "<gap rate>", "speed at which it ends"),
    "contact_duration": Variable(
        _CONTACT, "s", "time from the beginning of the contact to its end"
    ),
    "contact_impacts": Variable(
        _CONTACT, "1", "impacts that were met in the contact, one by one", "i8"
    ),
    "contact_impulse_of_impacts": Variable(
        _CONTACT, "<impulse>", "impulse of the impacts of the contact, without that at rest"
    ),
    "touchdown_<state>": Variable(_CONTACT, "<state>", "<state> where the contact begins"),
    "contact_impulse": Variable(_CONTACT, "<impulse>", "impulse of the contact force"),
    "contact_peak_force": Variable(
        _CONTACT, "<force>", "force of the largest magnitude in the contact, with its sign"
    ),
    "contact_depth": Variable(
        _CONTACT, "<gap>", "largest distance beyond the boundary in the contact"
    ),
    "contact_trajectory": Variable(_CONTACT, "1", "trajectory that the contact belongs to", "i8"),
    "contact_side": Variable(("guard",), "1", "sign of the gap in contact", "i1"),
    "contacts": Variable(_GUARD, "1", "contacts that begin", "i8"),
    "contacts_per_second": Variable(_GUARD, "1/s", "contacts per second"),
    "contacts_per_second_error": Variable(
        _GUARD, "1/s", "standard error of the contacts per second"
    ),
    "contacts_per_period": Variable(_GUARD, "1", "contacts per forcing period"),
    "contacts_per_period_error": Variable(
        _GUARD, "1", "standard error of the contacts per forcing period"
    ),
    "speed_mean": Variable(_GUARD, "<gap rate>", "mean speed at contact"),
    "speed_mean_error": Variable(
        _GUARD, "<gap rate>", "standard error of the mean speed at contact"
    ),
    "speed_rms": Variable(_GUARD, "<gap rate>", "root mean square of the speed at contact"),
    "speed_max": Variable(_GUARD, "<gap rate>", "largest speed at contact"),
    "speed_histogram": Variable(
        ("trajectory", "guard", "speed_bin"), "1", "contacts in each bin of speed", "i8"
    ),
    "speed_low": Variable(("speed_bin",), "<gap rate>", "lower edge of the bin", coord=True),
    "speed_high": Variable(("speed_bin",), "<gap rate>", "upper edge of the bin", coord=True),
    "duration_mean": Variable(_GUARD, "s", "mean duration of contact"),
    "duration_mean_error": Variable(_GUARD, "s", "standard error of the mean duration of contact"),
    "duration_min": Variable(_GUARD, "s", "shortest contact"),
    "duration_max": Variable(_GUARD, "s", "longest contact"),
    "share_in_contact": Variable(_GUARD, "1", "share of the time in contact"),
    "share_in_contact_error": Variable(
        _GUARD, "1", "standard error of the share of the time in contact"
    ),
    "peak_force": Variable(_GUARD, "<force>", "largest magnitude of the force of a contact"),
    "impulse_mean": Variable(_GUARD, "<impulse>", "mean impulse of a contact"),
    "impulse_mean_error": Variable(
        _GUARD, "<impulse>", "standard error of the mean impulse of a contact"
    ),
    "impulse_max": Variable(_GUARD, "<impulse>", "largest magnitude of the impulse of a contact"),
    **ENDINGS,
    **GUARDS,
    **SHARED,
}


def account(ds: xr.Dataset) -> list[str]:
    """A line on each guard."""
    lines = [f"found    {ds.sizes['contact']} contacts"]
    for i, name in enumerate(ds["guard"].values.tolist()):
        one = ds.isel(guard=i)
        rate, share = (
            float(one[key].mean()) for key in ("contacts_per_second", "share_in_contact")
        )
        mean = one["speed_mean"].mean(keep_attrs=True)
        speed = f" at {sized(mean)} on average," if np.isfinite(mean) else ""
        lines.append(
            f"  {name}: {rate:.4g} a second,{speed} in contact {share:.2%} of the time{_peak(one)}"
        )
    return lines


def _peak(one: xr.Dataset) -> str:
    """The largest force of a guard in words; "" if it isn't known."""
    if "peak_force" not in one or not np.isfinite(one["peak_force"].values).any():
        return ""
    return f", peak force {sized(one['peak_force'].max(keep_attrs=True))}"


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each guard, of each trajectory."""
    like, speed = ds["contacts"], unit_of(ds["speed_mean"])

    def column(name: str) -> np.ndarray:
        return flat(ds[name], like)

    def measured(heading: str, name: str, unit: str = "") -> Column:
        return with_error(heading, column(name), column(f"{name}_error"), unit=unit)

    columns = of_trajectory(ds, like=like)
    columns += [words("guard", column("guard").astype(str)), words("contacts", column("contacts"))]
    columns.append(measured("contacts per second", "contacts_per_second", "1/s"))
    if "contacts_per_period" in ds:
        columns.append(measured("contacts per period", "contacts_per_period"))
    columns += [
        measured("mean speed", "speed_mean", speed),
        quantity("rms speed", column("speed_rms"), speed),
        quantity("largest speed", column("speed_max"), speed),
        measured("mean duration", "duration_mean", "s"),
        quantity("longest", column("duration_max"), "s", name="longest duration"),
        measured("share of the time in contact", "share_in_contact"),
    ]
    if "peak_force" in ds:
        columns.append(quantity("peak force", column("peak_force"), unit_of(ds["peak_force"])))
    if "impulse_max" in ds:
        columns.append(
            quantity("largest impulse", column("impulse_max"), unit_of(ds["impulse_max"]))
        )
    notes = ["± is the standard error by the means of blocks."]
    notes += left_out(like.size, "guards and trajectories")
    return [table(title, columns, [*notes, *failed(ds)])]


KIND = ResultKind(
    "sl.impact_statistics",
    VARIABLES,
    ("contact_speed", "contacts_per_second", "status"),
    account,
    rows,
)
