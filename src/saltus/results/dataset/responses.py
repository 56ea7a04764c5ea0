"""Variables of responses, many of which attractors have too."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.results.dataset.attractors import ENDS, AttractorTable, padded
from saltus.results.dataset.kinds import WITHOUT_WORDS, Kind

#: Samples of each response that a bifurcation diagram may show.
SAMPLES = {
    "turning_points": "where the velocity is zero",
    "stroboscope": "at whole forcing periods",
    "contacts": "at the contacts",
}


def grid_values(response_of: np.ndarray, table: AttractorTable) -> dict[str, np.ndarray]:
    """Variables of the grid: the response that each start leads to at each value, and the columns
    of that response.

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
    """Variables of the responses.

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
    """Contacts in a forcing period, or in a cycle of an unforced system."""
    contacts = np.asarray(table.contacts, dtype=float)
    rates: np.ndarray = contacts / np.maximum(np.asarray(table.period), 1)
    return rates
