"""Result of ``spectrum``: motions by frequency."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr

from saltus.results.dataset.schema import ResultKind, period_text, told_of
from saltus.results.dataset.variable import SHARED, STATUS, Variable
from saltus.results.table import (
    ROWS,
    TextTable,
    flat,
    number,
    of_trajectory,
    quantity,
    table,
)
from saltus.results.wording import failed, sized, unit_of

#: Largest lines of a spectrum that an account lists.
_LARGEST = 5
#: Period of the response of a motion.
RESPONSE_PERIOD = Variable(
    ("trajectory",), "1", "period of the response in forcing periods, 0 if none was found", "i8"
)

#: Variables of the result of ``spectrum``. If forcing periods differ between trajectories their dim
#: is ``order``, not ``frequency``.
VARIABLES = {
    "frequency": Variable(("trajectory?", "frequency"), "Hz", "frequency", coord=True),
    "order": Variable(
        ("frequency",), "1", "frequency in units of the forcing frequency", coord=True
    ),
    "<state>_amplitude": Variable(("trajectory", "frequency"), "<state>", "amplitude of <state>"),
    "<state>_phase": Variable(("trajectory", "frequency"), "rad", "phase of <state>"),
    "window": Variable(("trajectory",), "", "window", "str"),
    "noise_bandwidth": Variable(
        ("trajectory",), "1", "equivalent noise bandwidth of the window, in lines"
    ),
    "response_period": RESPONSE_PERIOD,
    "status": STATUS,
    **SHARED,
}


def account(ds: xr.Dataset) -> list[str]:
    """The largest lines of each state and output, of the first trajectory."""
    run = ds.isel(trajectory=0) if "trajectory" in ds.dims else ds
    frequency = run["frequency"].values
    lines = [
        f"extent   {len(frequency)} lines up to {frequency[-1]:g} Hz, window {run['window'].item()}"
    ]
    for name in told_of(ds):
        amplitude = run[f"{name}_amplitude"]
        largest = np.argsort(amplitude.values)[::-1][:_LARGEST]
        told = [f"{sized(amplitude[i])} at {frequency[i]:.6g} Hz" for i in largest]
        lines.append(f"  {name}: {', '.join(told)}")
    return lines


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each line; on the screen the largest ones of the first state or output, in the
    order of the file.
    """
    amplitudes = [ds[f"{name}_amplitude"] for name in told_of(ds)]
    like = amplitudes[0]
    columns = of_trajectory(ds, like=like)
    columns.append(number("frequency", flat(ds["frequency"], like), ".8g", "Hz"))
    if "order" in ds.variables:
        columns.append(number("order", flat(ds["order"], like), ".6g"))
    for name, amplitude in zip(told_of(ds), amplitudes, strict=True):
        columns += [
            quantity(f"amplitude of {name}", flat(amplitude, like), unit_of(amplitude), 6),
            number(f"phase of {name}", flat(ds[f"{name}_phase"], like), ".4f", "rad"),
        ]
    size = flat(like, like)
    real = np.any([flat(_above_rounding(one), like) for one in amplitudes], axis=0)
    largest = np.argsort(-np.nan_to_num(size, nan=-1.0), kind="stable")[:ROWS]
    shown = sorted(int(row) for row in largest if real[row] or np.isnan(size[row]))
    notes = [
        f"Window {', '.join(_different(ds['window'].astype(str)))}; response "
        f"{', '.join(period_text(n, _NONE) for n in _different(ds['response_period']))}. "
        f"An amplitude is that of the cosine; frequency 0 is the mean."
    ]
    if rest := size.size - len(shown):
        noise = int(np.count_nonzero(~real & ~np.isnan(size)))
        notes.append(
            f"{rest} more lines are in the file"
            + (f", {noise} of them no larger than rounding errors can be." if noise else ".")
        )
    return [table(title, columns, [*notes, *failed(ds)], shown)]


#: Word for the period of a motion whose period wasn't found.
_NONE = "not periodic within the samples"


def _different(values: xr.DataArray) -> list[Any]:
    return sorted(set(np.atleast_1d(values.values).tolist()))


def _above_rounding(amplitude: xr.DataArray) -> xr.DataArray:
    """True for lines larger than rounding errors. The bound is eps for each of the log2(N) stages
    of the transform of N samples, times the root of the sum of all squares (N. J. Higham, Accuracy
    and Stability of Numerical Algorithms, 2nd ed., theorem 24.2).
    """
    along = str(amplitude.dims[-1])
    stages = np.log2(2 * amplitude.sizes[along])
    rounding = 2 * np.finfo(float).eps * stages * np.sqrt((amplitude**2).sum(along))
    above: xr.DataArray = amplitude > rounding
    return above


KIND = ResultKind("sl.spectrum", VARIABLES, ("frequency", "window"), account, rows)
