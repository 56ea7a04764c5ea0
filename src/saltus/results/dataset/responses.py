"""The table of what ``frequency_response`` and ``bifurcation_diagram`` return, and what of it
follows from the responses.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from saltus.results.dataset.attractors import ENDS, AttractorTable, padded
from saltus.results.dataset.branches import BRANCHES_VARIABLES
from saltus.results.dataset.kinds import WITHOUT_WORDS, Kind
from saltus.results.dataset.variable import GUARDS, Variable

#: What a bifurcation diagram may show of each response.
SAMPLES = {
    "turning_points": "where the velocity is zero",
    "stroboscope": "at whole forcing periods",
    "contacts": "at the contacts",
}  # fmt: skip

#: What belongs to a start at one place of the grid.
_GRID = ("...", "start")
_RESPONSE = ("response",)
_MULTIPLIER = ("response", "multiplier")
_OUTPUT = ("response", "output")

#: Variables of what ``frequency_response`` and ``bifurcation_diagram`` return. ``<first>``: the
#: unit of the first state; ``<gap>``: that of the gaps; ``<output>``: that in ``output_units``,
#: which an output has of its own.
RESPONSES_VARIABLES = {
    "<parameter>": Variable(("<parameter>",), "<parameter>", "<parameter>", coord=True),
    "response_of": Variable(
        _GRID, "1", "response that the start leads to", "i4", flags=WITHOUT_WORDS
    ),
    "rms": Variable(_GRID, "<first>", "root mean square of the first state in the response"),
    "peak": Variable(_GRID, "<first>", "largest magnitude of the first state in the response"),
    "type": Variable(_GRID, "", "kind of motion, or what became of the start", "str"),
    "period": Variable(
        _GRID, "1", "period of the response in forcing periods, 0 if it doesn't repeat", "i4"
    ),
    "contacts_per_period": Variable(_GRID, "1", "contacts of the response in a forcing period"),
    "start": Variable(("start",), "1", "start", "i8", coord=True),
    "start_direction": Variable(
        ("start",), "", "direction in which the parameter is swept", "str", coord=True
    ),
    "start_<state>": Variable(("start",), "<state>", "<state> at the start", coord=True),
    "response": Variable(_RESPONSE, "1", "response", "i8", coord=True),
    "response_<parameter>": Variable(_RESPONSE, "<parameter>", "<parameter>"),
    "response_branch": Variable(
        _RESPONSE, "1", "branch: orbits that go over into each other", "i8"
    ),
    "response_type": Variable(_RESPONSE, "", "kind of motion", "str"),
    "response_period": Variable(
        _RESPONSE, "1", "period in forcing periods, 0 if it doesn't repeat", "i8"
    ),
    "response_contacts": Variable(_RESPONSE, "1", "contacts in a forcing period"),
    "response_peak": Variable(_RESPONSE, "<first>", "largest magnitude of the first state"),
    "response_rms": Variable(_RESPONSE, "<first>", "root mean square of the first state"),
    "response_margin": Variable(
        _RESPONSE, "<gap>", "smallest distance by which the orbit misses or overshoots a boundary"
    ),
    "response_multiplier_real": Variable(_MULTIPLIER, "1", "Floquet multiplier, real part"),
    "response_multiplier_imag": Variable(_MULTIPLIER, "1", "Floquet multiplier, imaginary part"),
    "response_cycle": Variable(_RESPONSE, "s", "period of a limit cycle"),
    "response_eigenvalue_real": Variable(
        _MULTIPLIER, "1/s", "eigenvalue of the Jacobian of an equilibrium, real part"
    ),
    "response_eigenvalue_imag": Variable(
        _MULTIPLIER, "1/s", "eigenvalue of the Jacobian of an equilibrium, imaginary part"
    ),
    "response_exponent": Variable(_RESPONSE, "1/s", "largest Lyapunov exponent"),
    "response_exponent_error": Variable(_RESPONSE, "1/s", "error of the largest Lyapunov exponent"),
    "response_share": Variable(_RESPONSE, "1", "share of the starts"),
    "response_share_low": Variable(
        _RESPONSE, "1", "share of the starts, lower end of the 95 % interval"
    ),
    "response_share_high": Variable(
        _RESPONSE, "1", "share of the starts, upper end of the 95 % interval"
    ),
    "response_<state>": Variable(("response", "phase"), "<state>", "<state> <when>"),
    "output": Variable(
        ("output",), "", "output: a state, or a function of the motion", "str", coord=True
    ),
    "output_units": Variable(("output",), "", "unit of the output", "str", coord=True),
    "output_maximum": Variable(_OUTPUT, "<output>", "largest value"),
    "output_minimum": Variable(_OUTPUT, "<output>", "smallest value"),
    "output_peak": Variable(_OUTPUT, "<output>", "largest magnitude"),
    "output_peak_to_peak": Variable(_OUTPUT, "<output>", "largest less smallest value"),
    "output_mean": Variable(_OUTPUT, "<output>", "mean"),
    "output_rms": Variable(_OUTPUT, "<output>", "root mean square about zero"),
    "output_rms_about_mean": Variable(_OUTPUT, "<output>", "root mean square about the mean"),
    "output_amplitude": Variable(
        _OUTPUT,
        "<output>",
        "amplitude A of the first harmonic A cos(2 pi f t + phase), f the forcing frequency",
    ),
    "output_phase": Variable(
        _OUTPUT,
        "rad",
        "phase of the first harmonic A cos(2 pi f t + phase), t the time of the equations",
    ),
    "sample_<state>": Variable(("response", "sample"), "<state>", "<state> <sampled>"),
    **{
        name: row
        for name, row in BRANCHES_VARIABLES.items()
        if name not in ("output", "output_units")
    },
    **GUARDS,
    "guard_boundary": replace(GUARDS["guard_boundary"], dims=("guard", "...?")),
}


def grid_values(response_of: np.ndarray, table: AttractorTable) -> dict[str, np.ndarray]:
    """What each start leads to at each value: the number of the response, and its columns looked
    up.

    Parameters
    ----------
    response_of : array of int, shape (n..., s)
        Response to which each start leads at each value; -1 escaped, -2 unconverged, -3 failed, -4
        not computed.
    table : AttractorTable
        The responses, in the order of their numbers.
    """
    at = np.where(response_of < 0, len(table), response_of)
    columns = {
        "rms": table.rms,
        "peak": table.peak,
        "contacts_per_period": _per_period(table),
        "period": table.period,
    }
    found = {
        name: np.append(column, 0 if name == "period" else np.nan)[at]
        for name, column in columns.items()
    }
    words = np.array(
        [WITHOUT_WORDS[code] for code in range(min(Kind), 0)] + list(table.kind), dtype=np.str_
    )
    return {"response_of": response_of, **found, "type": words[response_of - min(Kind)]}


def response_values(
    table: AttractorTable, branch: np.ndarray, parameters: dict[str, np.ndarray], size: int
) -> dict[str, Any]:
    """What is known of each response.

    Parameters
    ----------
    table : AttractorTable
        m responses; ``contacts`` as there, in one period of the response. Its ``fractions`` are
        shares of the starts at its own value.
    branch : array of int, shape (m,)
        The same number where the same orbit was followed from value to value.
    parameters : mapping of str to array, shape (m,)
        The parameters at each response.
    size : int
        Number of the states.
    """
    columns = {"branch": branch, **table.columns(size), "contacts": _per_period(table)}
    found = {"response": np.arange(len(table)), "response_<parameter>": parameters}
    found |= {f"response_{name}": column for name, column in columns.items() if name != "itinerary"}
    if table.fractions is not None:
        found |= dict(zip((f"response_share{end}" for end in ENDS), table.fractions, strict=True))
    return found | {"response_<state>": padded(table.points, size)}


def _per_period(table: AttractorTable) -> np.ndarray:
    """Contacts in a forcing period; in a cycle, where nothing forces it."""
    contacts = np.asarray(table.contacts, dtype=float)
    rates: np.ndarray = contacts / np.maximum(np.asarray(table.period), 1)
    return rates
