"""Arrays in, Dataset out, for steady responses over one or two parameters.

An analysis that knows its responses calls::

    responses_dataset(
        states=system.states, units=system.units, axes={"frequency": values},          # one or two parameters, n values each
        starts=Starts(states={"x": x, "v": v}),                                        # or Starts(directions=["up"])
        response_of=response_of,                                                       # int (n, s) or (n1, n2, s); -1 to -4: none
        responses=Responses(attractors=table, place=place, branch=branch),             # m of them; place: int (m, 1) or (m, 2)
        events=Events({"frequency": f}, kind, branch),                                 # may be left out
        guards=Guards(names, states, boundaries),                                      # may be left out; pictures show the gaps
        gap_unit=gap_unit(system), attrs=provenance(...) | {...},
    )

A bifurcation diagram adds ``Responses(samples=[(n, D), ...])`` and ``sample="turning_points"``.

``rms``, ``peak``, ``type``, ``period`` and ``contacts_per_period`` of every (value, start) follow from ``response_of``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import xarray as xr

from saltus.errors import ParameterError, shown
from saltus.results.dataset import schema
from saltus.results.dataset.assemble import Guards
from saltus.results.dataset.basins import AttractorTable
from saltus.results.dataset.builder import Builder
from saltus.results.dataset.finish import array_variable
from saltus.results.dataset.kinds import WITHOUT_WORDS, Kind

#: What a bifurcation diagram may show of each response.
SAMPLES = {
    "turning_points": "where the velocity is zero",
    "stroboscope": "at whole forcing periods",
    "contacts": "at the contacts",
}  # fmt: skip


# -- what the caller hands over ------------------------------------------------------------------------------------------------
@dataclass(frozen=True)
class Starts:
    """The starts that were followed at every value of the parameters, s of them.

    Attributes
    ----------
    states : mapping of str to array, shape (s,)
        Each state at the starts [its unit]; of a sweep the first start, if it is known.
    directions : sequence of str, length s
        ``up`` or ``down`` for a sweep, which takes each value's end as the next one's start; empty without sweeps.
    """

    states: Mapping[str, np.ndarray] = field(default_factory=dict)
    directions: Sequence[str] = ()

    def __len__(self) -> int:
        return len(self.directions) or (len(next(iter(self.states.values()))) if self.states else 0)


@dataclass(frozen=True)
class OutputNumbers:
    """What is read off m responses, of K outputs each.

    Attributes
    ----------
    names, units : sequence of str, length K
        The outputs, and their units; ``""`` where one isn't known.
    numbers : mapping of str to array, shape (m, K)
        By the name of the variable without ``output_``.
    """

    names: Sequence[str]
    units: Sequence[str]
    numbers: Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Responses:
    """All different steady responses at all values of the parameters, m of them.

    Attributes
    ----------
    attractors : AttractorTable, length m
        What is known of each; ``contacts`` as there, in one period of the response. Its ``fractions`` are shares of the starts at the
        response's own value.
    place : array of int, shape (m, A)
        Index of the response's value on each of the A axes.
    branch : array of int, shape (m,)
        The same number where the same orbit was followed from value to value.
    samples : sequence of array, shape (n, D) each, optional
        Sampled states of a bifurcation diagram [units of the states]; n may differ between responses.
    outputs : OutputNumbers, optional
        What is read off each.
    """

    attractors: AttractorTable
    place: np.ndarray
    branch: np.ndarray
    samples: Sequence[np.ndarray] | None = None
    outputs: OutputNumbers | None = None


@dataclass(frozen=True)
class Events:
    """What happens to branches between neighbouring values, e of them.

    Attributes
    ----------
    values : mapping of str to array, shape (e,)
        Each parameter where it happens [SI].
    kind : sequence of str, length e
        ``graze``, ``period_doubling``, ``fold``, ``chaos``, ...
    branch : array of int, shape (e,)
        Branch to which it happens.
    """

    values: Mapping[str, np.ndarray]
    kind: Sequence[str]
    branch: np.ndarray


# -- assembly ------------------------------------------------------------------------------------------------------------------
def responses_dataset(
    *,
    states: Sequence[str],
    units: Mapping[str, str],
    axes: Mapping[str, np.ndarray],
    starts: Starts,
    response_of: np.ndarray,
    responses: Responses,
    events: Events | None = None,
    guards: Guards | None = None,
    sample: str = "",
    gap_unit: str = "",
    attrs: Mapping[str, Any] | None = None,
) -> xr.Dataset:
    """Assemble what ``frequency_response`` and ``bifurcation_diagram`` return.

    Parameters
    ----------
    states : sequence of str
        Names, in the order of the system.
    units : mapping of str to str
        Units of states and parameters; missing ones are unknown.
    axes : mapping of str to array, shape (n,) each
        The one or two parameters and their values [SI].
    starts : Starts
        The starts, s of them.
    response_of : array of int, shape (n, s) or (n1, n2, s)
        Response to which each start leads at each value; -1 escaped, -2 unconverged, -3 failed, -4 not computed.
    responses : Responses
        The responses, in the order of their numbers.
    events : Events, optional
        What happens to the branches.
    guards : Guards, optional
        The guards; boundaries of the shape (guard,), or (guard, n) and (guard, n1, n2) where a parameter of the axes moves them.
    sample : str
        What ``responses.samples`` holds: a key of :data:`SAMPLES`. Kept as the attribute ``sample``.
    gap_unit : str
        Unit of the guards' gaps.
    attrs : mapping, optional
        Provenance and trust numbers; values that are neither text nor number become JSON text.

    Returns
    -------
    Dataset
        Dims: the parameters, ``start``, ``response``, ``multiplier``, ``phase``, ``event`` (no entries where nothing happens);
        ``guard`` and ``sample`` if there are guards and samples.

    Raises
    ------
    ParameterError
        If there are no axes or more than two, the shapes don't fit, or a parameter has the name of something else in the result.
    """
    build = _Builder(schema.RESPONSES, states, units, gap_unit)
    dims = build.put_axes(axes)
    build.put_starts(starts)
    response_of = np.asarray(response_of)
    expected = (*map(len, axes.values()), len(starts))
    if response_of.shape != expected:
        raise ParameterError(f"response_of has the shape {response_of.shape}; the axes and the starts need {expected}.")
    build.put_grid(response_of, responses.attractors, (*dims, "start"))
    build.put_responses(responses, {name: np.asarray(values, dtype=float) for name, values in axes.items()})
    if responses.outputs is not None:
        build.put_outputs(responses.outputs)
    if responses.samples is not None:
        if sample not in SAMPLES:
            raise ParameterError(f"sample={shown(sample)}. Known: {', '.join(SAMPLES)}.")
        build.put_points(responses.samples, ("response", "sample"), schema.sample_name, SAMPLES[sample])
    if len(responses.attractors):  # without responses nothing can happen to them, and netCDF-3 has room for one empty dim only
        build.put_events(events or Events({name: np.zeros(0) for name in axes}, [], np.zeros(0, np.int64)))
    if guards is not None and len(guards.names):
        build.put_guards(guards, dims)
    return build.dataset({**(attrs or {}), **({"sample": sample} if sample else {})})


class _Builder(Builder):
    """A builder that knows the parts of these results."""

    def put_axes(self, axes: Mapping[str, np.ndarray]) -> tuple[str, ...]:
        """Add the parameters; returns their names."""
        if len(axes) not in (1, 2):
            raise ParameterError(f"responses are computed over one or two parameters, not over {', '.join(axes) or 'none'}.")
        for name, values in axes.items():
            if name in {*self.table, "phase", "multiplier", "sample", *self.states}:
                raise ParameterError(f"the parameter {name!r} has the name of something else in the result. Rename it in the system.")
            self.coords[name] = array_variable((name,), np.asarray(values, dtype=float), self._labels(name))
        return tuple(axes)

    def _labels(self, name: str) -> dict[str, str]:
        return {"units": self.units.get(name, ""), "long_name": name.replace("_", " ")}

    def put_starts(self, starts: Starts) -> None:
        """Add the starts: their numbers, states, directions."""
        self.put("start", np.arange(len(starts)), coord=True)
        if starts.directions:
            self.put("start_direction", list(starts.directions), coord=True)
        for name, values in starts.states.items():
            attrs = {"units": self.units.get(name, ""), "long_name": f"{name} at the start"}
            self.coords[schema.start_name(name)] = array_variable(("start",), np.asarray(values, dtype=float), attrs)

    def put_grid(self, response_of: np.ndarray, table: AttractorTable, dims: tuple[str, ...]) -> None:
        """Add what each start leads to: the number of the response, and its columns looked up."""
        self.put_flags("response_of", response_of, WITHOUT_WORDS, dims)
        nothing = {"rms": np.nan, "peak": np.nan, "contacts_per_period": np.nan, "period": 0}
        columns = {"rms": table.rms, "peak": table.peak, "contacts_per_period": _per_period(table), "period": table.period}
        for name, column in columns.items():
            self.put(name, np.append(column, nothing[name])[np.where(response_of < 0, len(table), response_of)], dims=dims)
        words = np.array([WITHOUT_WORDS[code] for code in range(min(Kind), 0)] + list(table.kind), dtype=np.str_)
        self.put("type", words[response_of - min(Kind)], dims=dims)

    def put_responses(self, responses: Responses, axes: Mapping[str, np.ndarray]) -> None:
        """Add what is known of each response."""
        table = responses.attractors
        real, imag = table.multiplier_parts(len(self.states))
        columns = {
            "branch": responses.branch, "type": list(table.kind), "period": table.period, "contacts": _per_period(table),
            "peak": table.peak, "rms": table.rms, "margin": table.margin, "multiplier_real": real, "multiplier_imag": imag,
            "exponent": table.exponent, "exponent_error": table.exponent_error, **table.unforced(len(self.states)),
        }  # fmt: skip
        self.put("response", np.arange(len(table)), coord=True)
        place = np.asarray(responses.place, dtype=np.int64).reshape(len(table), len(axes))
        for (name, values), index in zip(axes.items(), place.T, strict=True):
            self.data[schema.response_name(name)] = array_variable(("response",), values[index], self._labels(name))
        for name, column in columns.items():
            self.put(f"response_{name}", column)
        if table.fractions is not None:
            for end, column in zip(("", "_low", "_high"), table.fractions, strict=True):
                self.put(f"response_share{end}", column)
        self.put_points(table.points, ("response", "phase"), schema.response_name, table.points_when)

    def put_outputs(self, outputs: OutputNumbers) -> None:
        """Add what is read off each response; the units of outputs differ, so they stand in a variable of their own."""
        self.put("output", list(outputs.names), coord=True)
        self.put("output_units", list(outputs.units), coord=True)
        shared = outputs.units[0] if len(set(outputs.units)) == 1 else ""
        for name, values in outputs.numbers.items():
            spec = self.table[f"output_{name}"]
            labels = {"units": shared if spec.units == "<output>" else spec.units, "long_name": spec.long_name}
            self.data[f"output_{name}"] = array_variable(spec.dims, np.asarray(values, dtype=float), labels)

    def put_events(self, events: Events) -> None:
        """Add what happens to the branches."""
        self.put("event", np.arange(len(events.kind)), coord=True)
        self.put("event_kind", list(events.kind))
        self.put("event_branch", events.branch)
        for name, values in events.values.items():
            self.data[schema.event_name(name)] = array_variable(("event",), np.asarray(values, dtype=float), self._labels(name))

    def put_guards(self, guards: Guards, dims: tuple[str, ...]) -> None:
        """Add the guards; boundaries have the dims of the parameters where these move them."""
        self.put("guard", list(guards.names), coord=True)
        self.put("guard_state", [state or "" for state in guards.states])
        self.put("guard_units", guards.units_among(self.units))
        labels = {"units": self.gap_unit, "long_name": self.table["guard_boundary"].long_name}
        boundaries = np.asarray(guards.boundaries, dtype=float)
        self.data["guard_boundary"] = array_variable(("guard", *dims)[: boundaries.ndim], boundaries, labels)


def _per_period(table: AttractorTable) -> np.ndarray:
    """Contacts in a forcing period; in a cycle, where nothing forces it."""
    return np.asarray(table.contacts, dtype=float) / np.maximum(np.asarray(table.period), 1)
