"""`join`: the results of several jobs, as one result."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.errors import ParameterError, must_be
from saltus.results.dataset import schema
from saltus.results.dataset.build import array_variable, finish
from saltus.results.files.load import load

#: Kinds of results that are rows of trajectories, which know nothing of each other.
_ROWS = (schema.TRAJECTORY, schema.SENSITIVITY)
#: Dims along which results are put one behind the other.
_ALONG = ("trajectory", "contact")
#: Attributes that each part has of its own.
_OWN = ("result_hash", "study", "title", "study_identity", "forcing_period_s")


def join(*results: xr.Dataset | str | os.PathLike[str]) -> xr.Dataset:
    """Join the results of several jobs, each of some trajectories, into the result of one.

    Parameters
    ----------
    *results : Dataset, str or path
        Results of :func:`saltus.simulate` or :func:`saltus.sensitivity`, for several starts or
        values each, or files of them, in the order in which their trajectories are to stand. Where
        forcing frequencies differ, they differ within each.

    Returns
    -------
    Dataset
        Of the same kind. Along ``trajectory`` the trajectories of all, numbered anew; along
        ``contact`` their contacts, with ``contact_trajectory`` to match. All bits are those of the
        parts.

    Raises
    ------
    ParameterError
        If results don't belong together: it names what differs.
    ResultFileError
        If a file is missing or damaged.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> jobs = [sl.simulate(rig, {"x": x, "v": 0}, periods=2) for x in (["0 mm", "1 mm"], ["2 mm"])]
    >>> sl.join(*jobs)["trajectory"].values.tolist()
    [0, 1, 2]
    """
    parts = [load(one) if isinstance(one, str | os.PathLike) else one for one in results]
    for one in parts:
        if not isinstance(one, xr.Dataset):
            raise must_be("results", "results of saltus or files of them", one)
    _check(parts)
    joined = {str(name): _joined(str(name), parts) for name in parts[0].variables}
    coords = {name: joined.pop(name) for name in map(str, parts[0].coords)}
    attrs = {
        name: value
        for name, value in parts[0].attrs.items()
        if all(one.attrs.get(name) == value for one in parts)
    }
    return finish(joined, coords, attrs)


def _check(parts: Sequence[xr.Dataset]) -> None:
    """Raise ParameterError unless these results belong together."""
    if not parts:
        raise ParameterError("there is nothing to join. Give two results or more.")
    kinds = [schema.kind_of(one) for one in parts]
    for number, (kind, one) in enumerate(zip(kinds, parts, strict=True), 1):
        if kind not in _ROWS:
            raise ParameterError(
                f"result {number} is of {schema.KINDS[kind].makers}, whose parts know of each "
                "other: it can't be joined. Run a study with --shard in every job, in one folder."
            )
        if kind != kinds[0]:
            raise ParameterError(
                f"result {number} is of {schema.KINDS[kind].makers}, result 1 of "
                f"{schema.KINDS[kinds[0]].makers}. Join results of one kind."
            )
        if "trajectory" not in one.dims:
            raise ParameterError(
                f"result {number} is a single trajectory. Give its job a list of one start or "
                "value, so that it knows what it is a row of."
            )
        differs = _differing(parts[0], one)
        if differs:
            raise ParameterError(f"result {number} doesn't belong to result 1: {differs}.")


def _differing(first: xr.Dataset, other: xr.Dataset) -> str:
    """The difference of two results besides their trajectories; empty for nothing."""
    for name in sorted({*first.attrs, *other.attrs}.difference(_OWN)):
        mine, theirs = (_plain(one.attrs.get(name)) for one in (first, other))
        if mine == theirs:
            continue
        if isinstance(mine, dict) and isinstance(theirs, dict):
            name, mine, theirs = next(
                (key, mine.get(key), theirs.get(key))
                for key in sorted({*mine, *theirs})
                if mine.get(key) != theirs.get(key)
            )
        return f"{name} is {theirs}, not {mine}"
    for name in sorted({str(one) for one in (*first.variables, *other.variables)}):
        if name not in first.variables or name not in other.variables:
            return f"only one of them has {name}"
        mine, theirs = first[name], other[name]
        if mine.dims != theirs.dims:
            return f"{name} has the dims {theirs.dims}, not {mine.dims}"
        along = next((one for one in _ALONG if one in mine.dims), None)
        shapes = [
            one.isel({along: slice(0, 0)}).shape if along else one.shape for one in (mine, theirs)
        ]
        if shapes[0] != shapes[1]:
            return f"{name} has other lengths"
        if along is None and not mine.equals(theirs):
            return f"{name} has other values"
    return ""


def _plain(value: Any) -> Any:
    """An attribute; what its JSON text holds if it is one."""
    try:
        return json.loads(value) if isinstance(value, str) else value
    except json.JSONDecodeError:
        return value


def _joined(name: str, parts: Sequence[xr.Dataset]) -> xr.Variable:
    """One variable of all results."""
    first = parts[0].variables[name]
    along = next((one for one in _ALONG if one in first.dims), None)
    values = np.asarray(first.values)
    if along is not None:
        columns = [np.asarray(one.variables[name].values) for one in parts]
        if name in ("trajectory", "contact_trajectory"):
            sizes = [one.sizes["trajectory"] for one in parts]
            begins = np.cumsum([0, *sizes[:-1]])
            columns = [column + begin for column, begin in zip(columns, begins, strict=True)]
        values = np.concatenate(columns, axis=first.dims.index(along))
    return array_variable(tuple(map(str, first.dims)), values, first.attrs)
