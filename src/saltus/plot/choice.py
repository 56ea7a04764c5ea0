"""Which pictures there are of each kind of result."""

from __future__ import annotations

import xarray as xr

from saltus.results.dataset.schema import kind_of, parameters_of

#: The functions of saltus.plot that draw each kind of result, the usual one first.
PICTURES: dict[str, tuple[str, ...]] = {
    "trajectory": ("history", "phase"),
    "stroboscope": ("phase",),
    "basins": ("basins",),
    "agreement": ("agreement",),
    "responses": ("frequency_response", "bifurcation_diagram", "type_map"),
    "section": ("section",),
    "spectrum": ("spectrum",),
    "impacts": ("impacts",),
    "energy": ("energy",),
    "methods": ("methods",),
    "exponents": ("exponents",),
    "branches": ("branches",),
    "orbits": ("periodic_orbits",),
    "bifurcation_curve": ("bifurcation_curves",),
    "backbone": ("backbone",),
}


def default_kind(ds: xr.Dataset) -> str:
    """The picture that fits a result; ``""`` if there is none."""
    if kind_of(ds) == "responses":
        if len(parameters_of(ds)) == 2:
            return "type_map"
        return "bifurcation_diagram" if "sample" in ds.dims else "frequency_response"
    return next(iter(PICTURES.get(kind_of(ds), ())), "")
