"""Attractors and labels as plain data, which a store keeps to the last bit. Reading runs no
code.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from saltus.analysis.attractors.aperiodic import SampledMotion
from saltus.analysis.attractors.attractor_set import AttractorSet
from saltus.analysis.attractors.noisy import Noisy
from saltus.analysis.basins.labels import Settling
from saltus.analysis.closed.capture import Neighbourhoods
from saltus.analysis.closed.motions import ClosedMotion
from saltus.errors import SaltusError

#: Data of each cell, besides its final state.
CELL: dict[str, Any] = {
    "label": np.int16,
    "periods": np.int32,
    "status": np.int8,
    "unresolved": np.int16,
}


def found_data(found: AttractorSet) -> dict[str, Any]:
    """Attractors as numbers, texts, lists and dicts."""
    return {
        "orbits": [_orbit_data(orbit) for orbit in found.orbits],
        "unstable": [_orbit_data(orbit) for orbit in found.unstable],
        "sampled": [_sampled_data(one) for one in found.sampled],
        "near": {
            "centres": found.near.centres.tolist(),
            "weights": found.near.weights.tolist(),
            "owners": found.near.owners.tolist(),
        },
    }


def found_from(data: Mapping[str, Any], size: int) -> AttractorSet:
    """Attractors from :func:`found_data`'s result, of a system with this number of states.

    Raises
    ------
    SaltusError
        If the data are something else: machine code reads them, and doesn't ask.
    """
    try:
        found = _found(data, size)
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError, RecursionError):
        found = None
    if found is None or not _holds_together(found, size):
        raise SaltusError(
            "the attractors that were kept aren't such as saltus writes: somebody "
            "changed them. Take them from a copy."
        )
    return found


def _holds_together(found: AttractorSet, size: int) -> bool:
    """True if the sizes agree, and all numbers are in the range of the items they refer to."""
    near, orbits = (
        found.near,
        [
            *found.orbits,
            *found.unstable,
            *(one.orbit for one in found.sampled if isinstance(one, Noisy)),
        ],
    )
    return (
        len(near.centres) == len(near.weights) == len(near.owners)
        and bool(np.isfinite(near.centres).all() and np.isfinite(near.weights).all())
        and bool(((near.owners >= 0) & (near.owners < len(found))).all())
        and all(len(one.points) > 0 and one.multipliers.shape == (size,) for one in orbits)
        and all(len(one.points) > 0 and one.scale.shape == (size,) for one in found.sampled)
        and all(
            one.size.shape == one.scatter.shape == (size,)
            for one in found.sampled
            if isinstance(one, Noisy)
        )
    )


def _found(data: Mapping[str, Any], size: int) -> AttractorSet:
    near = data["near"]
    return AttractorSet(
        Neighbourhoods(
            _array(near["centres"], size),
            _array(near["weights"], size, size),
            np.array(near["owners"], np.int64),
        ),
        [_orbit_from(one, size) for one in data["orbits"]],
        [_sampled_from(one, size) for one in data["sampled"]],
        [_orbit_from(one, size) for one in data["unstable"]],
    )


def _orbit_data(orbit: ClosedMotion) -> dict[str, Any]:
    values = orbit.multipliers
    return {
        "points": orbit.points.tolist(),
        "mismatch": orbit.mismatch,
        "multipliers": [[float(value.real), float(value.imag)] for value in values],
    }


def _orbit_from(data: Mapping[str, Any], size: int) -> ClosedMotion:
    values = np.array([complex(real, imaginary) for real, imaginary in data["multipliers"]])
    return ClosedMotion(_array(data["points"], size), values, float(data["mismatch"]))


def _sampled_data(attractor: SampledMotion) -> dict[str, Any]:
    data = {
        "kind": attractor.kind,
        "exponent": attractor.exponent,
        "error": attractor.exponent_error,
        "points": attractor.points.tolist(),
        "scale": attractor.scale.tolist(),
    }
    if not isinstance(attractor, Noisy):
        return data
    return data | {
        "orbit": _orbit_data(attractor.orbit),
        "size": attractor.size.tolist(),
        "scatter": attractor.scatter.tolist(),
        "stray": attractor.stray,
    }


def _sampled_from(data: Mapping[str, Any], size: int) -> SampledMotion:
    plain = (
        str(data["kind"]),
        float(data["exponent"]),
        float(data["error"]),
        _array(data["points"], size),
        np.array(data["scale"], float),
    )
    if "orbit" not in data:
        return SampledMotion(*plain)
    widths = np.array(data["size"], float), np.array(data["scatter"], float)
    return Noisy(*plain, _orbit_from(data["orbit"], size), *widths, float(data["stray"]))


def _array(rows: Any, *tail: int) -> np.ndarray:
    return np.ascontiguousarray(np.array(rows, float).reshape(-1, *tail))


def cell_types(states: tuple[str, ...]) -> dict[str, Any]:
    """Name and type of the data of each cell."""
    return {**CELL, **{f"end_{name}": np.float64 for name in states}}


def settling_arrays(part: Settling, states: tuple[str, ...]) -> dict[str, np.ndarray]:
    """The arrays of some cells, in the types of :func:`cell_types`."""
    most = np.iinfo(CELL["unresolved"]).max
    columns = {name: getattr(part, name) for name in CELL} | {
        "unresolved": np.minimum(part.unresolved, most)
    }
    return {name: columns[name].astype(kind) for name, kind in CELL.items()} | {
        f"end_{name}": np.ascontiguousarray(part.end[:, i]) for i, name in enumerate(states)
    }


def settling_from(arrays: Mapping[str, np.ndarray], states: tuple[str, ...]) -> Settling:
    """Outcomes of cells from :func:`settling_arrays`' result."""
    columns = {name: arrays[name].astype(np.int64) for name in CELL}
    return Settling(
        columns["label"],
        columns["periods"],
        columns["status"],
        columns["unresolved"],
        np.stack([arrays[f"end_{name}"] for name in states], axis=1),
    )
