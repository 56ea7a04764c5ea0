"""Arrays in, a Dataset out: every result is built here, by the table of its kind.

Everything that goes in is an array of NumPy. Of anything else xarray asks whether an array is one
of dask, pint, cupy or sparse, and imports for it those that are installed: dask.array alone takes
0.4 s.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property, lru_cache
from typing import Any

import numpy as np
import pandas as pd  # type: ignore[import-untyped]
import xarray as xr

from saltus.errors import ParameterError
from saltus.results.dataset import schema
from saltus.results.dataset.result import Result
from saltus.results.dataset.variable import Variable
from saltus.results.provenance import hash_of, to_json

_TWICE = (
    "{!r} would stand for two things in the result. Rename the state, or the parameter, of "
    "this name."
)
#: Other names for names of a system that the tables use already.
_NAMES = {
    "contact_<state>": schema.contact_name, "contact_<state>_before": schema.before_name,
    "attractor_<state>": schema.attractor_name,
    "start_<state>": schema.start_name, "orbit_<state>": schema.orbit_name,
    "response_<state>": schema.response_name, "response_<parameter>": schema.response_name,
    "equilibrium_<state>": schema.equilibrium_name,
    "event_<parameter>": schema.event_name, "event_<state>": schema.event_name,
    "point_<parameter>": schema.point_name, "point_<state>": schema.point_name,
}  # fmt: skip


#: Attributes of results of systems with outputs: their names, and whether they come first.
_ABOUT_OUTPUTS = ("outputs", "outputs_first")
#: Doubles of a line of the processor's cache; doubles that are brought together at once.
NUMBERS_OF_A_LINE, BLOCK = 8, 32768


# -- what the caller hands over --------------------------------------------------------------------
@dataclass(frozen=True)
class Guards:
    """The guards of a system.

    Attributes
    ----------
    names : sequence of str
        Name of each guard; its place is its bit in the mode.
    states : sequence of str or None
        State that the guard bounds, where its gap is that state minus a value.
    boundaries : array, shape (guard,) or (guard, ...)
        That value [unit of the state], NaN where there is none. With the trajectories, or the grid,
        where it differs between them.
    units : sequence of str
        Coherent SI unit of each gap, ``""`` where it isn't known; empty for those of the states.
    """

    names: Sequence[str]
    states: Sequence[str | None]
    boundaries: np.ndarray
    units: Sequence[str] = ()

    def units_among(self, states: Mapping[str, str]) -> list[str]:
        """Unit of each gap, given those of the states."""
        return list(self.units) or [states.get(state, "") if state else "" for state in self.states]

    def first(self, count: int) -> Guards:
        """Their number."""
        return Guards(
            self.names[:count], self.states[:count], self.boundaries[:count], self.units[:count]
        )

    def values(self, states: Mapping[str, str]) -> dict[str, Any]:
        """Their variables, given the units of the states."""
        return {
            "guard": list(self.names),
            "guard_state": [state or "" for state in self.states],
            "guard_units": self.units_among(states),
            "guard_boundary": self.boundaries,
        }


@dataclass(frozen=True)
class Subject:
    """Subject of a result: a system, and its trajectories if there are any.

    Attributes
    ----------
    states : sequence of str
        Names, in the order of the system; none for a recorded series.
    outputs : sequence of str
        Names of the outputs of the system.
    outputs_first : bool
        Whether they stand before the states where one is shown.
    units : mapping of str to str
        Units of states and parameters; missing ones are unknown.
    attrs : mapping
        Provenance (:func:`saltus.results.provenance.attributes`) and settings; what is neither text
        nor number becomes JSON text.
    guards : Guards, optional
        Kept where the table of the kind has them.
    gap_unit : str
        Unit of the gaps, where no guards are given.
    margin_unit : str
        Unit of margins to the next graze; default that of the gaps.
    varied : mapping of str to array, shape (trajectory,)
        Parameters that differ between trajectories [SI].
    forcing_period : float or array, shape (trajectory,), optional
        One for all, which becomes an attribute, or one each [s].
    batch : bool
        Whether to keep the dim ``trajectory``.
    """

    states: Sequence[str]
    units: Mapping[str, str] = field(default_factory=dict)
    attrs: Mapping[str, Any] = field(default_factory=dict)
    guards: Guards | None = None
    gap_unit: str = ""
    varied: Mapping[str, Any] = field(default_factory=dict)
    forcing_period: float | np.ndarray | None = None
    batch: bool = True
    outputs: Sequence[str] = ()
    outputs_first: bool = False
    margin_unit: str = ""


def subject_of(
    ds: xr.Dataset,
    names: Sequence[str],
    attrs: Mapping[str, Any],
    batch: bool = True,
    varied: Mapping[str, Any] | None = None,
    forcing_period: Any = None,
) -> Subject:
    """The subject of a result that is made of another one, with some of its states and outputs."""
    states = [name for name in names if name in schema.states_of(ds)]
    known = [name for name in (*names, *(varied or {})) if name in ds]
    return Subject(
        states=states,
        units={name: ds[name].attrs.get("units", "") for name in known},
        attrs=attrs,
        varied=varied or {},
        forcing_period=forcing_period,
        batch=batch,
        outputs=[name for name in names if name not in states],
        outputs_first=bool(ds.attrs.get("outputs_first")),
    )


def build(
    kind: str,
    subject: Subject,
    values: Mapping[str, Any] | Iterable[tuple[str, Any]],
    *,
    grid: Sequence[str] = (),
    along: Mapping[str, str] | None = None,
    words: Mapping[str, str] | None = None,
    flags: Mapping[str, Mapping[int, str]] | None = None,
    carried: Mapping[str, xr.Variable] | None = None,
) -> Result:
    """The Dataset of a kind.

    Parameters
    ----------
    kind : str
        One of :data:`saltus.results.dataset.schema.NAMES`.
    subject : Subject
        Its system and trajectories.
    values : mapping of str to array, or its items
        Variables in the order of the result, under their names in the table and with all dims that
        it names: with ``trajectory`` also where that is dropped. A row for all states or parameters
        takes a mapping by their names; for all states, and for the outputs behind them, an array
        whose last axis is the state will do.
    grid : sequence of str
        Dims that ``...`` stands for.
    along : mapping of str to str, optional
        Dims in place of those of the table.
    words : mapping of str to str, optional
        Values of the names in angle brackets in the units and long names of the table.
    flags : mapping of str to mapping of int to str, optional
        Meanings of the codes in a variable, where they follow the result.
    carried : mapping of str to xarray.Variable, optional
        Coordinates that are taken over from another result.

    Raises
    ------
    ParameterError
        If a state or a parameter has the name of something else in the result, or a number is too
        large for its variable.
    """
    work = _Building(kind, subject, tuple(grid), along or {}, words or {}, flags or {})
    work.coords |= {name: one.copy(deep=False) for name, one in (carried or {}).items()}
    given = list(values.items() if isinstance(values, Mapping) else values)
    if subject.guards is not None and "guard" in work.table:
        given += subject.guards.values(subject.units).items()
    attrs = {
        **subject.attrs,
        "saltus_result": kind,
        "schema_version": schema.VERSION,
        "states": " ".join(subject.states),
    }
    attrs = {name: one for name, one in attrs.items() if name not in _ABOUT_OUTPUTS}
    if subject.outputs:
        attrs |= {"outputs": list(subject.outputs), "outputs_first": int(subject.outputs_first)}
    period = subject.forcing_period
    if period is not None and subject.batch and np.ndim(period):
        given.append(("forcing_period", period))
    elif period is not None:
        attrs["forcing_period_s"] = float(np.ravel(period)[0])
    if subject.varied:
        given.append(("<parameter>", subject.varied))
    for name, value in given:
        work.take(name, value)
    return finish(work.data, work.coords, attrs)


# -- assembly --------------------------------------------------------------------------------------
class _Building:
    """Variables of a Dataset under construction."""

    def __init__(
        self,
        kind: str,
        subject: Subject,
        grid: tuple[str, ...],
        along: Mapping[str, str],
        words: Mapping[str, str],
        flags: Mapping[str, Any],
    ) -> None:
        self.table, self.subject, self.grid, self.along, self.flags = (
            schema.KINDS[kind].variables,
            subject,
            grid,
            along,
            flags,
        )
        gap = subject.gap_unit or _common(
            subject.guards.units_among(subject.units) if subject.guards else ()
        )
        first = subject.units.get(subject.states[0], "") if subject.states else ""
        self.words = {
            "<gap>": gap,
            "<margin>": subject.margin_unit or gap,
            "<gap rate>": schema.rate_unit(gap),
            "<root gap>": schema.root_unit(gap),
            "<first>": first,
            "<output>": "",
            **words,
        }
        self.data: dict[str, xr.Variable] = {}
        self.coords: dict[str, xr.Variable] = {}

    def take(self, row: str, values: Any) -> None:
        """Add the variable of a row; for a row that stands for all states or parameters, add one
        variable each.
        """
        spec = self.table[row]
        if "<" not in row:
            if self.subject.batch or not row.endswith("trajectory"):
                self._put(row, spec, values)
            return
        what = "state" if "<state>" in row else "parameter"
        of_each = (
            values.items()
            if isinstance(values, Mapping)
            else zip(
                self._outputs(np.shape(values)[-1]),
                last_axis_first(np.asarray(values)),
                strict=True,
            )
        )
        for name, given in of_each:
            if row == f"<{what}>" and name in self._reserved:
                rename = (
                    "Rename the state in the system."
                    if what == "state"
                    else ("Rename it in the system.")
                )
                raise ParameterError(
                    f"the {what} {name!r} has the name of something else in the result. {rename}"
                )
            own = _NAMES[row](name) if row in _NAMES else row.replace(f"<{what}>", name)
            text = name if what == "state" else name.replace("_", " ")
            self._put(
                own, spec, given, {f"<{what}>": (name, self.subject.units.get(name, ""), text)}
            )

    def _outputs(self, count: int) -> Sequence[str]:
        """The states, or the states and the outputs: that many."""
        states = self.subject.states
        return states if count == len(states) else (*states, *self.subject.outputs)

    @cached_property
    def _reserved(self) -> set[str]:
        """Names of the table, and of its dims."""
        return {
            *self.table,
            *(dim.rstrip("?") for spec in self.table.values() for dim in spec.dims),
        }

    def _put(
        self,
        name: str,
        spec: Variable,
        values: Any,
        of: Mapping[str, tuple[str, str, str]] | None = None,
    ) -> None:
        if name in self.data or name in self.coords:
            raise ParameterError(_TWICE.format(name))
        array = _array(name, spec, values)
        dims = self._dims(spec.dims, of, array.ndim)
        if len(dims) != array.ndim:
            raise ValueError(f"{name} has {array.ndim} axes; its dims are {dims}")
        if not self.subject.batch and "trajectory" in dims:
            array, dims = _only(array, dims)
        units, long_name = spec.units, spec.long_name
        for token, (_, unit, text) in (of or {}).items():
            units, long_name = unit if units == token else units, long_name.replace(token, text)
        for token, word in self.words.items() if "<" in long_name else ():
            long_name = long_name.replace(token, word)
        attrs: dict[str, Any] = {"units": self.words.get(units, units), "long_name": long_name}
        meanings = self.flags.get(name) or spec.flags
        if meanings:
            codes = sorted(meanings)
            attrs |= {
                "flag_values": np.array(codes, array.dtype),
                "flag_meanings": " ".join(meanings[code] for code in codes),
            }
        (self.coords if spec.coord else self.data)[name] = array_variable(dims, array, attrs)

    def _dims(
        self, dims: tuple[str, ...], of: Mapping[str, tuple[str, str, str]] | None, count: int
    ) -> tuple[str, ...]:
        """The dims of a row for an array with this number of axes."""
        if _is_plain(dims) and not self.along:
            return dims
        found = tuple(self._named(dims, of))
        for dim in [dim for dim in found if dim.endswith("?")][::-1]:
            if len(found) > count:
                found = tuple(one for one in found if one != dim)
        return tuple(dim.rstrip("?") for dim in found)

    def _named(
        self, dims: tuple[str, ...], of: Mapping[str, tuple[str, str, str]] | None
    ) -> Iterator[str]:
        for dim in dims:
            if dim.startswith("..."):
                yield from (one + dim[3:] for one in self.grid)
            else:
                yield of[dim][0] if of and dim in of else self.along.get(dim, dim)


@cache
def _is_plain(dims: tuple[str, ...]) -> bool:
    """True where these dims are the same in every result of the kind."""
    return not any(dim[0] in ".<" or dim[-1] == "?" for dim in dims)


def last_axis_first(values: np.ndarray) -> np.ndarray:
    """Values with their last axis first. Where no two numbers of one entry share a line of the
    processor's cache, they are brought together, by blocks: else whoever reads an entry fetches all
    of them.
    """
    count, found = values.shape[-1], np.moveaxis(values, -1, 0)
    if count <= NUMBERS_OF_A_LINE:
        return found
    rows = values.reshape(-1, count)
    together = np.empty((count, len(rows)), values.dtype)
    block = max(BLOCK // count, NUMBERS_OF_A_LINE)
    for begin in range(0, len(rows), block):
        together[:, begin : begin + block] = rows[begin : begin + block].T
    return together.reshape(found.shape)


def _array(name: str, spec: Variable, values: Any) -> np.ndarray:
    """Convert values to the type of the table."""
    if spec.clipped:
        values = np.minimum(values, np.iinfo(spec.dtype).max)
    array = np.asarray(values, dtype=np.str_ if spec.dtype == "str" else spec.dtype)
    if (
        array.dtype.kind == "i"
        and getattr(values, "dtype", None) != array.dtype
        and not np.array_equal(array, values)
    ):
        raise ParameterError(
            f"{name} holds {np.max(np.abs(values))}, which {array.dtype} can't. "
            f"Split the work into smaller parts."
        )
    return array


def _only(array: np.ndarray, dims: tuple[str, ...]) -> tuple[np.ndarray, tuple[str, ...]]:
    """Drop the dim ``trajectory`` of an array with one trajectory."""
    axis = dims.index("trajectory")
    if array.shape[axis] != 1:
        raise ParameterError(
            f"a Dataset without the dim trajectory holds one trajectory, not "
            f"{array.shape[axis]}. Pass batch=True."
        )
    return np.asarray(array[(slice(None),) * axis + (0,)]), (*dims[:axis], *dims[axis + 1 :])


def _common(units: Iterable[str]) -> str:
    """Return the unit that all share, else ``""``."""
    found = set(units)
    return found.pop() if len(found) == 1 else ""


def array_variable(
    dims: tuple[str, ...], values: np.ndarray, attrs: Mapping[str, Any]
) -> xr.Variable:
    """A variable that holds this very array."""
    return xr.Variable(dims, values, attrs, fastpath=True)


def finish(
    data: dict[str, xr.Variable], coords: dict[str, xr.Variable], attrs: Mapping[str, Any]
) -> Result:
    """The Dataset of these variables; attributes that are neither text nor number
    become JSON text.
    """
    plain = {
        key: value if isinstance(value, str | int | float) else to_json(value)
        for key, value in attrs.items()
    }
    variables = data | coords
    plain["result_hash"] = hash_of(
        {name: (one.dims, one.values) for name, one in variables.items()}
    )
    indexes = {
        name: _index(name, one.values) for name, one in coords.items() if one.dims == (name,)
    }
    for name, index in indexes.items():
        variables |= index.create_variables({name: variables[name]})
    return Result.of(variables, coords, indexes, plain)


def _index(name: str, values: np.ndarray) -> xr.indexes.PandasIndex:
    """Index of a coordinate. Numbers aren't copied."""
    if values.dtype.kind == "U":
        return _text_index(name, values.dtype, tuple(values.tolist()))
    return xr.indexes.PandasIndex(pd.Index(values, copy=False, name=name), name, values.dtype)


# the names of guards are the same in every run, and take longer to index than all numbers
@lru_cache(maxsize=256)
def _text_index(name: str, dtype: np.dtype, words: tuple[str, ...]) -> xr.indexes.PandasIndex:
    return xr.indexes.PandasIndex(pd.Index(np.array(words, dtype), name=name), name, dtype)
