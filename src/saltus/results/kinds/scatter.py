"""Result of ``scatter``: sets of uncertain values, their motions, and statistics."""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.errors import counted
from saltus.results.dataset.kinds import WITHOUT_WORDS
from saltus.results.dataset.schema import ResultKind, kind_text
from saltus.results.dataset.variable import Variable
from saltus.results.table import Column, TextTable, interval, left_out, number, table, words
from saltus.units import from_si

_NUMBER = ("set", "start", "outcome")
_QUANTILE = ("quantile", "start", "outcome")
_REACHED = ("start", "response")
_INDEX = ("start", "outcome", "uncertain")
_ENDS = (("low", "lower end of the 95 % interval"), ("high", "upper end of the 95 % interval"))
#: Codes of starts that reach no response.
CODES = {**WITHOUT_WORDS, -5: "other"}


def _with_ends(
    name: str, dims: tuple[str, ...], units: str, text: str, stem: str = ""
) -> dict[str, Variable]:
    """A variable, and the ends of its interval."""
    ends = {
        f"{stem or name}_{end}": Variable(dims, units, f"{words} of: {text}")
        for end, words in _ENDS
    }
    return {name: Variable(dims, units, text), **ends}


#: Variables of the result of ``scatter``; ``<output>``: the unit in ``outcome_units``;
#: ``<uncertain>``: that in ``uncertain_units``.
VARIABLES = {
    "set": Variable(("set",), "1", "set of values", "i8", coord=True),
    "set_status": Variable(("set",), "", "computed, not_computed or refused", "str"),
    "uncertain": Variable(("uncertain",), "", "uncertain parameter", "str", coord=True),
    "uncertain_units": Variable(("uncertain",), "", "unit of it", "str", coord=True),
    "uncertain_distribution": Variable(("uncertain",), "", "its distribution", "str"),
    "value": Variable(("set", "uncertain"), "<uncertain>", "value of the parameter in the set"),
    "start": Variable(("start",), "1", "start", "i8", coord=True),
    "start_<state>": Variable(("start",), "<state>", "<state> at the start", coord=True),
    "outcome": Variable(("outcome",), "", "number of a motion", "str", coord=True),
    "outcome_units": Variable(("outcome",), "", "unit of it", "str", coord=True),
    "number": Variable(_NUMBER, "<output>", "number in the set"),
    "quantile": Variable(("quantile",), "1", "share of the sets below", coord=True),
    **_with_ends("quantile_of", _QUANTILE, "<output>", "quantile of the number", "quantile"),
    "response": Variable(("response",), "1", "response", "i8", coord=True),
    "response_type": Variable(("response",), "", "kind of motion", "str"),
    "response_period": Variable(("response",), "1", "n of an nT", "i8"),
    "response_followed": Variable(
        ("response",), "1", "1 where it was followed to every set, 0 where its kind tells it", "i1"
    ),
    "response_of": Variable(
        ("set", "start"), "1", "response that the start reaches, or a code", "i8", flags=CODES
    ),
    "exists": Variable(("set", "response"), "1", "1 where the response exists and attracts", "i1"),
    **_with_ends("probability_exists", ("response",), "1", "share of sets in which it exists"),
    **_with_ends("probability_reached", _REACHED, "1", "share of sets where the start reaches it"),
    "response_quantile": Variable(
        ("response", "quantile", "outcome"), "<output>", "quantile where this response is reached"
    ),
    **_with_ends("first_index", _INDEX, "1", "share of the variance by this parameter alone"),
    **_with_ends("total_index", _INDEX, "1", "share of the variance that needs this parameter"),
}  # fmt: skip


def account(ds: xr.Dataset) -> list[str]:
    """Extent, responses with their probabilities, and the spread of the first outcomes."""
    status = ds["set_status"].values
    told = ", ".join(
        f"{int((status == word).sum())} {word.replace('_', ' ')}" for word in np.unique(status)
    )
    uncertain = ", ".join(
        f"{name} {text}"
        for name, text in zip(
            ds["uncertain"].values, ds["uncertain_distribution"].values, strict=True
        )
    )
    lines = [f"extent   {counted(ds.sizes['set'], 'set')}: {told}", f"drawn    {uncertain}"]
    for k in range(ds.sizes.get("response", 0)):
        one = ds.isel(response=k)
        middle = float(one["response_quantile"].isel(outcome=0).sel(quantile=0.5))
        size = from_si(middle, str(one["outcome_units"].values[0]), 4)
        about = f", median {one['outcome'].values[0]} {size}" if np.isfinite(middle) else ""
        exists = _share(one, "probability_exists")
        reached = _share(one.isel(start=0), "probability_reached")
        lines.append(
            f"response {named(one)}{about}: exists in {exists} of the sets, "
            f"the first start reaches it in {reached}"
        )
    return lines


def named(one: xr.Dataset) -> str:
    """A response in a word: ``3T``, ``chaotic``."""
    return kind_text(str(one["response_type"].item()), int(one["response_period"]))


def _share(one: xr.Dataset, name: str) -> str:
    low, high = (100 * float(one[f"{name}_{end}"]) for end in ("low", "high"))
    return f"{100 * float(one[name]):.3g} % ({low:.3g} to {high:.3g} %)"


def rows(title: str, ds: xr.Dataset) -> list[TextTable]:
    """A row for each start and outcome, and one for each response and start."""
    starts, outcomes = ds.sizes["start"], ds.sizes["outcome"]
    start, outcome = (one.ravel() for one in np.indices((starts, outcomes)))
    units = ds["outcome_units"].values[outcome]
    columns = [
        *([words("start", ds["start"].values[start])] if starts > 1 else []),
        words("outcome", ds["outcome"].values[outcome]),
        words("unit", units),
        *(
            _sized(f"{100 * float(q):g} %", ds["quantile_of"].values[k, start, outcome], units)
            for k, q in enumerate(ds["quantile"].values)
        ),
    ]
    for word in ("first", "total") if "first_index" in ds else ():
        for k, name in enumerate(ds["uncertain"].values):
            found = ds[f"{word}_index"].values[start, outcome, k]
            columns.append(number(f"{word} index of {name}", found, ".3f"))
    status = ds["set_status"].values
    notes = [
        f"{int((status == word).sum())} sets were {word.replace('_', ' ')}: they are left out."
        for word in ("refused", "not_computed")
        if (status == word).any()
    ]
    tables = [table(title, columns, [*notes, *left_out(starts * outcomes, "outcomes")])]
    if ds.sizes.get("response", 0):
        response, start = (one.ravel() for one in np.indices((ds.sizes["response"], starts)))
        called = [named(ds.isel(response=k)) for k in response]
        columns = [words("response", called), words("number", response), words("start", start)]
        for heading, name, index in (
            ("exists", "probability_exists", (response,)),
            ("reached", "probability_reached", (start, response)),
        ):
            columns.append(number(heading, ds[name].values[index], ".4f"))
            low, high = (ds[f"{name}_{end}"].values[index] for end in ("low", "high"))
            columns.append(interval(f"{heading}, 95 %", low, high, lambda one: f"{one:.4f}"))
        more = left_out(len(response), "rows")
        tables.append(table(f"{title}: probabilities", columns, more))
    return tables


def _sized(heading: str, values: np.ndarray, units: np.ndarray) -> Column:
    """Numbers, each with a unit of its own."""
    found = [float(one) for one in values]
    return Column(
        heading,
        lambda i: "-" if np.isnan(found[i]) else from_si(found[i], str(units[i]), 5),
        {heading: found},
    )


KIND = ResultKind("sl.scatter", VARIABLES, ("value", "number", "set_status"), account, rows)
