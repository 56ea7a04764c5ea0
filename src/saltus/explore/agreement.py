"""The starts that two methods lead to the same attractor: two maps, compared as sl.compare does."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.basins.compare import compare
from saltus.analysis.basins.pipeline import BasinPlan
from saltus.errors import listed
from saltus.explore.frames import Emit
from saltus.explore.map import KeptMap, KeptMaps
from saltus.results.wording import kind_texts

#: Share of the starts after which progress is told anew.
_STEP = 0.005


def agree(
    first: BasinPlan,
    second: BasinPlan,
    grown: Callable[[BasinPlan, Emit], KeptMap],
    maps: KeptMaps,
    emit: Emit,
) -> None:
    """Emit the agreement of two maps: ``agreement`` for each grid of the second map that is whole,
    coarse to fine, the last one of all starts; between them ``agreement-progress``.

    Parameters
    ----------
    first, second : BasinPlan
        One map by two methods.
    grown : callable
        Grows a map, ``grown(plan, emit)``, and returns it; what is known isn't computed again.
    maps : KeptMaps
        Where it grows.
    emit : callable
        Takes heads, and the array ``agreement`` int8[k]: that of the starts whose indices along
        both axes are multiples of ``level``, coded as by :func:`saltus.compare`.
    """
    methods = [first.method.name, second.method.name]
    reference = grown(first, _progress(first, emit)).dataset
    assert reference is not None  # a map that has grown is finished

    def tell(ds: xr.Dataset, stride: int, done: bool) -> None:
        every = dict.fromkeys(first.axes, slice(None, None, stride))
        found = compare(reference.isel(every), ds.isel(every))
        head = {
            "kind": "agreement", "done": done, "level": stride, "methods": methods,
            "values": dict(first.system.values), "words": _words(found, methods),
        }  # fmt: skip
        emit(head, {"agreement": found["agreement"].values.ravel()})

    def hear(head: Mapping[str, Any], _: Mapping[str, np.ndarray]) -> None:
        kept = maps.get(second)
        if head["kind"] == "map-level" and head["of"] is not None and kept is not None:
            part = kept.result.of(np.arange(second.cells))  # a copy: its Dataset changes it
            tell(second.dataset(part, kept.found), head["of"], False)
        progress(head, {})

    progress = _progress(second, emit)
    kept = grown(second, hear)
    assert kept.dataset is not None
    tell(kept.dataset, 1, True)


def _progress(plan: BasinPlan, emit: Emit) -> Emit:
    """A function that takes the answers of a map, and tells how far it is."""
    last = 0.0

    def hear(head: Mapping[str, Any], _: Mapping[str, np.ndarray]) -> None:
        nonlocal last
        if head["kind"] == "map-piece" and head["known"] > last + _STEP * plan.cells:
            last = head["known"]
            about = {"method": plan.method.name, "known": head["known"], "of": plan.cells}
            emit({"kind": "agreement-progress", "done": False, **about}, {})

    return hear


def _words(ds: xr.Dataset, methods: list[str]) -> list[str]:
    """Sentences on an agreement: its share, and attractors that one of the methods misses."""
    share, low, high = (ds.attrs[name] for name in ("agreement", "agreement_low", "agreement_high"))
    if not ds.attrs["settled_cells"]:
        return ["No start settles by both methods."]
    said = [
        f"{100 * share:.3g} % of the starts that settle by {methods[0]} and {methods[1]} lead to "
        f"the same attractor ({100 * low:.3g} to {100 * high:.3g} %)."
    ]
    names = np.array(kind_texts(ds, "match_"))
    for other, method in (("b", methods[0]), ("a", methods[1])):
        alone = names[ds[f"match_{other}"].values < 0].tolist()
        if alone:
            said.append(f"By {method} alone: {listed(alone)}.")
    return said
