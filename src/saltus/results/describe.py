"""`describe`: the content of a result in a few lines."""

from __future__ import annotations

import json
from collections.abc import Iterable

import xarray as xr

from saltus.errors import counted
from saltus.results.dataset.reader import reader
from saltus.results.dataset.schema import KINDS, NAMES, check, kind_of
from saltus.units import from_si

#: Lines of a result that a notebook shows above its variables.
_LINES = 8
#: Values of parameters that are told: all of the published systems, whose longest list it is.
_VALUES = 13


@reader
def describe(ds: xr.Dataset) -> str:
    """Describe the content and the origin of a result in a few lines.

    Parameters
    ----------
    ds : Dataset
        Result of any function of saltus, or of :func:`~saltus.results.load`.

    Returns
    -------
    str
        System, parameters (of many the drives and the stops first), method, extent, contacts,
        status and hash, a line each; of attractors and basins what was found.

    Raises
    ------
    ParameterError
        If ``ds`` is no result of saltus.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> run = sl.simulate(rig, start=("1 mm", 0), periods=10)
    >>> print(sl.describe(run).splitlines()[0][:37])
    delangre: mass = 3 kg, damping_ratio
    """
    check(ds, caller="describe", kinds=NAMES)
    lines = [f"{ds.attrs.get('system', 'system without a name')}: {_parameters(ds)}"]
    if "method" in ds.attrs:
        lines.append(
            f"method   {ds.attrs['method']}{_options(ds)}, saltus "
            f"{ds.attrs.get('saltus_version', 'unknown')}"
        )
        if note := ds.attrs.get("method_note"):
            lines.append(f"         {note}")
    lines += KINDS[kind_of(ds)].account(ds)
    return "\n".join([*lines, f"hash     {ds.attrs.get('result_hash', 'none')[:16]}"])


def headline(ds: xr.Dataset) -> str:
    """Content of a result in one line or a few, such as ``delangre: 60 T, 162 contacts, ok, no
    unresolved graze``; ``""`` for a Dataset that isn't a result.
    """
    if not kind_of(ds):
        return ""
    name, kind = ds.attrs.get("system", "system without a name"), KINDS[kind_of(ds)]
    if kind.headline is not None:
        return f"{name}: {kind.headline(ds)}"
    lines = kind.account(ds)
    more = [f"and {len(lines) - _LINES} lines more: sl.describe"] if len(lines) > _LINES else []
    return "\n".join([name, *lines[:_LINES], *more])


def _parameters(ds: xr.Dataset) -> str:
    """The values of the parameters, of many the drives, the gaps and the stiffnesses first."""
    units = json.loads(ds.attrs.get("units", "{}"))
    values = json.loads(ds.attrs.get("parameters", "{}"))
    varied = [f"{name} varies" for name in json.loads(ds.attrs.get("varied_parameters", "[]"))]
    told = list(values) if len(values) <= _VALUES else _told_first(values)[:_VALUES]
    more = len(values) - len(told)
    return ", ".join(
        [f"{name} = {from_si(values[name], units.get(name, ''))}" for name in told]
        + varied
        + ([f"and {counted(more, 'parameter')} more"] if more else [])
    )


def _told_first(names: Iterable[str]) -> list[str]:
    """Names of parameters, those of drives before those of stops, whose gaps come first."""
    stops = tuple(name.removesuffix("gap") for name in names if name.endswith("_gap"))
    kinds = ("gap", "stiffness", "restitution")

    def rank(name: str) -> int:
        stop = next((one for one in stops if name.startswith(one)), "")
        kind = name.removeprefix(stop)
        return 0 if not stop else 1 + kinds.index(kind) if kind in kinds else 1 + len(kinds)

    return sorted(names, key=rank)


def _options(ds: xr.Dataset) -> str:
    options = json.loads(ds.attrs.get("method_options", "{}"))
    return f"({', '.join(f'{name}={value}' for name, value in options.items())})" if options else ""
