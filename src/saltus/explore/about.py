"""The first answer to a page: names, units, ranges and colours of a system."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from saltus.analysis.basins.labels import OPEN
from saltus.explore.frames import Answer
from saltus.explore.opening import STEPS, Opening, choices, first_quantity
from saltus.flow.methods import METHODS
from saltus.flow.modal import Modal
from saltus.kernels import status as st
from saltus.models import describe
from saltus.plot.palette import hues, shades
from saltus.plot.unsettled import AGREEMENT, UNSETTLED, Unsettled
from saltus.results.dataset.kinds import Kind
from saltus.system import System, gap_units
from saltus.units import from_si, to_si

#: Hues, and shades of each, that a page is sent.
HUES, SHADES = 24, 13
#: Codes of starts that no attractor holds, and their words; an own one of what is under way.
CODES: Mapping[int, Unsettled] = {
    **{code: UNSETTLED[code] for code in (Kind.ESCAPED, Kind.UNCONVERGED, Kind.FAILED)},
    OPEN: Unsettled("not settled yet", "#8C8C8C"),
}


def about_answer(opening: Opening) -> Answer:
    """The system of an explorer, and what is to be shown first."""
    system = opening.system
    colors = hues(HUES)
    about_ranges = {**opening.box, **opening.axes}
    largest = {name: max(map(abs, ends)) for name, ends in about_ranges.items()}
    first = system.outputs.names if system.outputs.first else tuple(opening.axes)
    first = tuple(dict.fromkeys((first_quantity(system), *first)))
    units = [system.units[name] for name in system.states]
    quantities = [
        {"name": name, "unit": unit, "kind": "state", "shown": shown_as(unit, largest.get(name))}
        for name, unit in zip(system.states, units, strict=True)
    ] + [
        {"name": name, "unit": unit, "kind": "output", "shown": shown_as(unit, largest.get(name))}
        for name, unit in zip(system.outputs.names, system.outputs.units, strict=True)
    ]
    return {
        "kind": "about",
        "system": {
            "name": system.name,
            "description": system.description,
            "source": system.source,
            "text": repr(system),
        },
        "forced": system.forced_at is not None,
        "forced_at": system.forced_at,
        "turn": opening.turn,
        "method": opening.method.name,
        "methods": methods_of(system),
        "quantities": quantities,
        "parameters": [_parameter(opening, name) for name in system.values],
        "guards": [
            {"name": guard.name, "quantity": guard.state, "unit": unit}
            for guard, unit in zip(system.guards, gap_units(system), strict=True)
        ],
        "axes": {name: list(ends) for name, ends in opening.axes.items()},
        "at": dict(opening.at),
        "size": list(opening.size),
        "choices": choices(system),
        "ranges": {
            name: list(ends) for name, ends in about_ranges.items() if name in choices(system)
        },
        "panels": {
            "history": list(first)[:4],
            "phase": list(opening.axes),
            "response": opening.responses,
        },
        "start": opening.start,
        "view": dict(opening.view),
        "results": [
            {"name": stem, "kind": str(ds.attrs.get("saltus_result", ""))}
            for stem, ds in opening.results.items()
        ],
        "hues": _bytes(colors),
        "hue_shades": _bytes(shades(colors, SHADES)),
        "codes": {str(int(code)): one.label for code, one in CODES.items()},
        "code_colors": _colours(CODES),
        "agreement_colors": _colours(AGREEMENT),
        "contact_kinds": [st.CONTACT_KIND[i] for i in range(len(st.CONTACT_KIND))],
        "words": [],
        "models": None,
    }, {}


def models_answer() -> Answer:
    """The models of saltus, where no system was named."""
    models = [{"name": name, "words": words} for name, words in describe().items()]
    return {"kind": "about", "system": None, "models": models, "words": []}, {}


def methods_of(system: System) -> list[str]:
    """Names of the methods that move a system."""
    modal = Modal().serving(system.origin) == Modal()
    return [name for name in METHODS if name != "Modal" or modal]


def shown_as(unit: str, largest: float | None = None) -> dict[str, Any]:
    """The unit in which numbers of a size read best, and the factor from SI to it."""
    text = from_si(largest or 1.0, unit, 3)
    name = text.partition(" ")[2]
    if not name:
        return {"unit": "" if unit == "1" else unit, "factor": 1.0}
    return {"unit": name, "factor": float(f"{1.0 / to_si(f'1 {name}', unit, name):.12g}")}


def _parameter(opening: Opening, name: str) -> dict[str, Any]:
    system = opening.system
    (low, high), value = opening.ranges[name], system.values[name]
    positive = "mass" in name or name == system.forced_at
    return {
        "name": name,
        "unit": system.units[name],
        "shown": shown_as(system.units[name], max(abs(low), abs(high), abs(value))),
        "value": value,
        "low": low,
        "high": high,
        "step": (high - low) / STEPS,
        "scale": "log" if low > 0 and high / low > 20 else "linear",
        "least": 0.0 if positive else None,
        "most": None,
    }


def _colours(looks: Mapping[int, Unsettled]) -> dict[str, list[int]]:
    return {str(int(code)): list(bytes.fromhex(one.color[1:])) for code, one in looks.items()}


def _bytes(colors: np.ndarray) -> list[Any]:
    return list((np.asarray(colors) * 255).round().astype(int).tolist())
