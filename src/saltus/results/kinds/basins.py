"""Result of ``basins``: the attractor that each start of a grid leads to."""

from __future__ import annotations

import xarray as xr

from saltus.results.dataset.attractors import ATTRACTOR_VARIABLES
from saltus.results.dataset.schema import ResultKind, axes_of
from saltus.results.dataset.variable import OUTPUT, Variable, of_outputs
from saltus.results.kinds.attractors import found, rows
from saltus.results.wording import span

#: The two states that a map is drawn over.
AXES = {"<state>": Variable(("<state>",), "<state>", "<state> at the start", coord=True)}
#: Trust numbers of a map, and their names in the text.
_TRUST = {
    "basin_entropy": "basin entropy",
    "boundary_basin_entropy": "on the boundary",
    "uncertainty_exponent": "uncertainty exponent",
}

#: Variables of the result of ``basins``.
VARIABLES = {
    **AXES,
    "basin": Variable(("...",), "1", "attractor", "i2"),
    "periods_to_settle": Variable(
        ("...",), "1", "forcing periods until it had settled, -1 if it hadn't", "i4"
    ),
    "status": Variable(("...",), "1", "how the trajectory ended", "i1"),
    "grazes_unresolved": Variable(
        ("...",), "1", "grazes shallower than the local error", "i2", clipped=True
    ),
    **ATTRACTOR_VARIABLES,
    **OUTPUT,
    **of_outputs("attractor", "attractor_"),
}


def account(ds: xr.Dataset) -> list[str]:
    """Lines on the grid, the attractors, and the trust in the numbers."""
    trust = [f"{words} {ds.attrs[name]:.3g}" for name, words in _TRUST.items() if name in ds.attrs]
    lines = [span(ds, axes_of(ds), "starts"), *found(ds)]
    return lines + ([f"trust    {', '.join(trust)}"] if trust else [])


KIND = ResultKind("sl.basins", VARIABLES, ("basin", "status", "attractor_type"), account, rows)
