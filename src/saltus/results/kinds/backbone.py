"""Result of ``backbone``: the free vibrations that resonances follow."""

from __future__ import annotations

import xarray as xr

from saltus.results.dataset.schema import ResultKind
from saltus.results.dataset.variable import Variable
from saltus.results.kinds import branches
from saltus.results.table import TextTable, number, quantity, spread, table, words

_POINT = ("point",)
#: Reasons for which a backbone may end before the amplitude asked for.
_ENDS = ("points", "lost")

#: Variables of the result of ``backbone``. ``<first>``: the unit of the first state; ``<output>``:
#: that in ``output_units``.
VARIABLES = {
    "point": Variable(_POINT, "1", "point of the backbone", "i8", coord=True),
    "backbone_frequency": Variable(_POINT, "Hz", "frequency of the vibration"),
    "point_period": Variable(_POINT, "s", "period of the orbit"),
    "point_stable": Variable(_POINT, "1", "whether the vibration is stable", "i1"),
    **{
        f"point_{name}": branches.VARIABLES[f"point_{name}"]
        for name in ("itinerary", "multiplier_real", "multiplier_imag")
    },
    "fictitious_damping": Variable(_POINT, "1/s", "damping that closes the orbit: rounding"),
    "point_<parameter>": Variable(_POINT, "<parameter>", "<parameter> in quadrature"),
    "point_<state>": Variable(_POINT, "<state>", "<state> <when>"),
    "output": Variable(("output",), "", "output: a state", "str", coord=True),
    "output_units": branches.VARIABLES["output_units"],
    **{
        f"point_output_{name}": branches.VARIABLES[f"point_output_{name}"]
        for name in ("maximum", "minimum", "peak", "rms")
    },
    **{
        name: branches.VARIABLES[name]
        for name in (
            "harmonic",
            "point_error",
            "point_output_error",
            "point_harmonic_real",
            "point_harmonic_imag",
        )
    },
}


def account(ds: xr.Dataset) -> list[str]:
    """Lines on the ends of the backbone, and on the share of it that is stable."""
    frequency, name = ds["backbone_frequency"].values, ds.attrs["amplitude_of"]
    one = ds.sel(output=name)
    peak, unit = one["point_output_peak"].values, one["output_units"].item()
    phase = " in quadrature" if ds.attrs["phase"] == "quadrature" else ""
    return [
        f"found    mode {ds.attrs['vibration_mode']}{phase} at {len(peak)} points, "
        f"{frequency[0]:.8g} Hz at |{name}| {peak[0]:.4g} {unit} to {frequency[-1]:.8g} Hz at "
        f"{peak[-1]:.4g} {unit}".rstrip(),
        f"ends     {ds.attrs['end']}, {ds['point_stable'].values.mean():.0%} of it stable",
    ]


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each point; on the screen some of them."""
    state, count = ds.attrs["amplitude_of"], ds.sizes["point"]
    one = ds.sel(output=state)
    columns = [
        quantity(f"peak |{state}|", one["point_output_peak"].values, one["output_units"].item(), 6),
        quantity("frequency", ds["backbone_frequency"].values, "Hz", branches.DIGITS),
        words("stable", ["yes" if stable else "no" for stable in ds["point_stable"].values]),
        words("contacts", ds["point_itinerary"].values),
    ]
    if "fictitious_damping" in ds:
        columns.append(number("fictitious damping", ds["fictitious_damping"].values, ".1e", "1/s"))
    end = ds.attrs["end"]
    lost = (f"It ends before the amplitude asked for: {end}.",) if end in _ENDS else ()
    return [table(title, columns, (f"{count} points.", *lost), spread(count))]


KIND = ResultKind(
    "sl.backbone", VARIABLES, ("backbone_frequency", "point_output_peak"), account, rows
)
