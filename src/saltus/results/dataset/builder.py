"""Arrays under the names, dims, units and types of the schema: what assembles a Dataset of any kind that is about attractors."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.errors import ParameterError
from saltus.results.dataset import schema
from saltus.results.dataset.finish import Once, array_variable, finish
from saltus.results.dataset.variable import Variable


class Builder:
    """Collects the variables of one Dataset by the table of its kind."""

    def __init__(self, kind: str, states: Sequence[str], units: Mapping[str, str], gap_unit: str = "") -> None:
        self.kind, self.states, self.units, self.gap_unit = kind, tuple(states), units, gap_unit
        self.table = schema.TABLES[kind]
        self.data, self.coords = Once(), Once()

    def put(self, name: str, values: Any, *, dims: tuple[str, ...] = (), coord: bool = False, **attrs: Any) -> None:
        """Add a variable of the table; ``dims`` are those that the table leaves open."""
        spec = self.table[name]
        array = np.asarray(values, dtype={"str": np.str_}.get(spec.dtype, spec.dtype))
        if array.dtype.kind == "i" and not np.array_equal(array, values):
            raise ParameterError(f"{name} holds {np.max(np.abs(values))}, which {array.dtype} can't. Split the work into smaller parts.")
        labels = {"units": self._unit(spec), "long_name": spec.long_name, **attrs}
        (self.coords if coord else self.data)[name] = array_variable((*dims, *spec.dims), array, labels)

    def put_flags(self, name: str, values: Any, meanings: Mapping[int, str], dims: tuple[str, ...]) -> None:
        """Add a variable of codes, with their meanings as the CF conventions write them."""
        codes = np.array(sorted(meanings), dtype=self.table[name].dtype)
        self.put(name, values, dims=dims, flag_values=codes, flag_meanings=" ".join(meanings[int(code)] for code in codes))

    def put_points(self, points: Sequence[np.ndarray], dims: tuple[str, str], name_of: Callable[[str], str], when: str) -> None:
        """Add a variable a state: rows of unequal length, padded with NaN to the longest.

        The longest is taken as one at least: netCDF-3 has room for one empty dim only.
        """
        longest = max(map(len, points), default=0) or 1
        padded = np.full((len(points), longest, len(self.states)), np.nan)
        for row, one in zip(padded, points, strict=True):
            row[: len(one)] = one
        for i, name in enumerate(self.states):
            attrs = {"units": self.units.get(name, ""), "long_name": f"{name} {when}"}
            self.data[name_of(name)] = array_variable(dims, padded[:, :, i], attrs)

    def _unit(self, spec: Variable) -> str:
        """The unit of the table, with what follows the system filled in."""
        return {"<first>": self.units.get(self.states[0], ""), "<gap>": self.gap_unit}.get(spec.units, spec.units)

    def dataset(self, attrs: Mapping[str, Any]) -> xr.Dataset:
        """The Dataset, with the hash of its numbers."""
        own = {"saltus_result": self.kind, "schema_version": schema.VERSION, "states": " ".join(self.states)}
        return finish(self.data, self.coords, {**attrs, **own})
