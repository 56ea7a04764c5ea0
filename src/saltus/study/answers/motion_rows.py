"""What sections, spectra, impact statistics and energy balances have to say, as tables: a row for
each crossing, line, guard, interval.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from saltus.results.dataset.schema import states_of
from saltus.results.wording import ended_early, unit_of
from saltus.study.table import (
    ROWS,
    Column,
    TextTable,
    left_out,
    number,
    quantity,
    table,
    varied,
    with_error,
    words,
)

if TYPE_CHECKING:
    import xarray as xr


def section_table(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each crossing, sorted by trajectory and time."""
    columns = (
        _of_trajectory(ds, ds["crossing_trajectory"].values) if "trajectory" in ds.dims else []
    )
    columns.append(number("time", ds["crossing_time"].values, ".10g", "s"))
    if "crossing_phase" in ds and np.isfinite(ds["crossing_phase"].values).any():
        columns.append(number("phase of the forcing", ds["crossing_phase"].values, ".8f"))
    columns += [quantity(name, ds[name].values, unit_of(ds[name]), 8) for name in states_of(ds)]
    columns.append(
        Column(
            "direction",
            lambda i: "up" if up[i] > 0 else "down",
            {"direction": (up := ds["crossing_direction"].values.tolist())},
        )
    )
    columns.append(words("kind", ds["crossing_kind"].values.astype(str)))
    totals = {name: int(ds[name].sum()) for name in ("crossings", "tangencies", "contacts")}
    notes = [
        f"Surface {ds.attrs['surface']}: "
        f"{', '.join(f'{count} {name}' for name, count in totals.items())}."
    ]
    return table(
        title, columns, [*notes, *left_out(ds.sizes["crossing"], "crossings"), *_failed(ds)]
    )


def spectrum_table(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each line; on the screen the largest ones of the first state, in the order of the
    file.
    """
    first = f"{states_of(ds)[0]}_amplitude"
    like, dims = ds[first], _dims(ds[first])
    columns = (
        _of_trajectory(ds, _flat(ds["trajectory"], like, dims)) if "trajectory" in like.dims else []
    )
    columns.append(number("frequency", _flat(ds["frequency"], like, dims), ".8g", "Hz"))
    if "order" in ds.variables:
        columns.append(number("order", _flat(ds["order"], like, dims), ".6g"))
    for name in states_of(ds):
        amplitude, phase = ds[f"{name}_amplitude"], ds[f"{name}_phase"]
        columns.append(
            quantity(f"amplitude of {name}", _flat(amplitude, like, dims), unit_of(amplitude), 6)
        )
        columns.append(number(f"phase of {name}", _flat(phase, like, dims), ".4f", "rad"))
    size = _flat(like, like, dims)
    largest = np.argsort(-np.nan_to_num(size, nan=-1.0), kind="stable")
    real = np.any(
        [_flat(_above_rounding(ds[f"{name}_amplitude"]), like, dims) for name in states_of(ds)],
        axis=0,
    )
    shown = (
        np.sort([row for row in largest[:ROWS] if real[row] or np.isnan(size[row])])
        .astype(int)
        .tolist()
    )
    windows = sorted(set(np.atleast_1d(ds["window"].values).astype(str).tolist()))
    periods = sorted(set(np.atleast_1d(ds["response_period"].values).tolist()))
    responses = ", ".join(f"{n}T" if n else "not periodic within the samples" for n in periods)
    notes = [
        f"Window {', '.join(windows)}; response {responses}. An amplitude is that of the "
        f"cosine; frequency 0 is the mean."
    ]
    if rest := size.size - len(shown):
        noise = int(np.count_nonzero(~real & ~np.isnan(size)))
        notes.append(
            f"{rest} more lines are in the file"
            + (f", {noise} of them no larger than rounding errors can be." if noise else ".")
        )
    return table(title, columns, [*notes, *_failed(ds)], shown)


def _above_rounding(amplitude: xr.DataArray) -> xr.DataArray:
    """Which lines are larger than what rounding alone can make: eps for each of the log2(N) stages
    of the transform of N samples, of the root of the sum of all squares (N. J. Higham, Accuracy and
    Stability of Numerical Algorithms, 2nd ed., theorem 24.2).
    """
    along = str(amplitude.dims[-1])
    stages = np.log2(2 * amplitude.sizes[along])
    rounding = 2 * np.finfo(float).eps * stages * np.sqrt((amplitude**2).sum(along))
    above: xr.DataArray = amplitude > rounding
    return above


def impact_table(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each guard, of each trajectory."""
    like, dims = ds["contacts"], _dims(ds["contacts"])

    def flat(name: str) -> np.ndarray:
        return _flat(ds[name], like, dims)

    speed = unit_of(ds["speed_mean"])
    columns = _of_trajectory(ds, flat("trajectory")) if "trajectory" in like.dims else []
    columns += [words("guard", flat("guard").astype(str)), words("contacts", flat("contacts"))]
    rates = [
        ("contacts per second", "contacts_per_second", "1/s"),
        ("contacts per period", "contacts_per_period", ""),
    ]
    columns += [
        with_error(label, flat(name), flat(f"{name}_error"), unit=unit)
        for label, name, unit in rates
        if name in ds
    ]
    columns.append(
        with_error("mean speed", flat("speed_mean"), flat("speed_mean_error"), unit=speed)
    )
    columns += [
        quantity(label, flat(name), speed)
        for label, name in (("rms speed", "speed_rms"), ("largest speed", "speed_max"))
    ]
    columns.append(
        with_error("mean duration", flat("duration_mean"), flat("duration_mean_error"), unit="s")
    )
    columns.append(quantity("longest", flat("duration_max"), "s", name="longest duration"))
    columns.append(
        with_error(
            "share of the time in contact", flat("share_in_contact"), flat("share_in_contact_error")
        )
    )
    notes = ["± is the standard error by the means of blocks."]
    return table(
        title, columns, [*notes, *left_out(like.size, "guards and trajectories"), *_failed(ds)]
    )


def energy_table(title: str, ds: xr.Dataset) -> TextTable:
    """A row for each interval, of each trajectory."""
    like, dims = ds["residual"], _dims(ds["residual"])
    along = str(like.dims[-1])
    columns = (
        _of_trajectory(ds, _flat(ds["trajectory"], like, dims)) if "trajectory" in like.dims else []
    )
    columns.append(
        number(along, _flat(ds[along], like, dims), ".8g", "s" if along == "time" else "")
    )
    labels = {
        "supplied": "supplied",
        "dissipated": "dissipated",
        "friction": "friction",
        "impacts": "impacts",
        "change": "change",
        "energy": "stored at the end",
        "residual": "residual",
    }
    columns += [
        quantity(label, _flat(ds[name], like, dims), "J", 6)
        for name, label in labels.items()
        if name in ds
    ]
    worst = float(np.nanmax(np.atleast_1d(ds["imbalance"].values), initial=0.0))
    notes = [
        f"residual = supplied - all that is taken - change of the stored energy; at most "
        f"{worst:.1e} of the largest of them."
    ]
    return table(title, columns, [*notes, *left_out(like.size, "intervals"), *_failed(ds)])


#: By the name of the table in the study file.
TABLES: dict[str, Callable[[str, xr.Dataset], TextTable]] = {
    "poincare": section_table, "spectrum": spectrum_table, "impacts": impact_table,
    "energy": energy_table,
}  # fmt: skip


def _of_trajectory(ds: xr.Dataset, rows: np.ndarray) -> list[Column]:
    """Which trajectory a row is of, and the parameters that set it apart."""
    return [words("trajectory", rows), *varied(ds, rows)]


def _dims(values: xr.DataArray) -> Sequence[Any]:
    """Dims in the order of the rows: trajectory by trajectory."""
    return sorted(values.dims, key=lambda dim: dim != "trajectory")


def _flat(values: xr.DataArray, like: xr.DataArray, dims: Sequence[Any]) -> np.ndarray:
    """Values as a column: one for each of ``like``."""
    return np.asarray(values.broadcast_like(like).transpose(*dims).values).ravel()


def _failed(ds: xr.Dataset) -> list[str]:
    """A note on trajectories that ended early."""
    return [f"{count} of the motions: {word}." for word, count in ended_early(ds).items()]
