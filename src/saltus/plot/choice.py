"""Pictures of each kind of result."""

from __future__ import annotations

import xarray as xr

from saltus.results.dataset import schema
from saltus.results.dataset.schema import kind_of, parameters_of

#: The kinds of result that each picture draws; of the pictures of one kind the usual one is first.
TAKES: dict[str, tuple[str, ...]] = {
    "history": (schema.TRAJECTORY,),
    "phase": (schema.TRAJECTORY, schema.STROBOSCOPE),
    "basins": (schema.BASINS,),
    "gallery": (schema.BASINS, schema.ATTRACTORS),
    "agreement": (schema.AGREEMENT,),
    "frequency_response": (schema.RESPONSES,),
    "bifurcation_diagram": (schema.RESPONSES,),
    "type_map": (schema.RESPONSES,),
    "amplitude_map": (schema.RESPONSES,),
    "shares": (schema.RESPONSES,),
    "section": (schema.SECTION,),
    "spectrum": (schema.SPECTRUM,),
    "impacts": (schema.IMPACTS,),
    "contact_forces": (schema.IMPACTS,),
    "energy": (schema.ENERGY,),
    "sensitivity": (schema.SENSITIVITY,),
    "scatter": (schema.SCATTER,),
    "corner": (schema.SCATTER,),
    "fit": (schema.FIT,),
    "methods": (schema.METHODS,),
    "exponents": (schema.EXPONENTS,),
    "branches": (schema.BRANCHES,),
    "periodic_orbits": (schema.ORBITS,),
    "bifurcation_curves": (schema.CURVE,),
    "backbone": (schema.BACKBONE,),
}
#: Pictures that take more than one result.
_OF_SEVERAL = ("gallery",)


def pictures_of(kind: str) -> tuple[str, ...]:
    """Names of the pictures that take one result of this kind, the usual one first."""
    return tuple(name for name, kinds in TAKES.items() if kind in kinds and name not in _OF_SEVERAL)


def default_kind(ds: xr.Dataset) -> str:
    """Name of the usual picture of a result; ``""`` if there is none."""
    if kind_of(ds) == schema.RESPONSES:
        if len(parameters_of(ds)) == 2:
            return "type_map"
        return "bifurcation_diagram" if "sample" in ds.dims else "frequency_response"
    return next(iter(pictures_of(kind_of(ds))), "")
