"""Type of every result: an xarray.Dataset that refuses to build the product of its tables."""

from __future__ import annotations

import html
import math
from collections.abc import Callable, Hashable, Iterable, Mapping, Sequence
from typing import Any, ClassVar

import xarray as xr

from saltus.errors import ParameterError

_CONTACTS = "Write run.contact_time, or sl.contacts(run) for a table."
#: Names that other programs use for parts of a result, and the names used here.
_ELSEWHERE = {
    "t": "Write run.time.",
    **dict.fromkeys(("y", "ys", "u"), "Each state has its name: run.x, or run['x'].values."),
    **dict.fromkeys(("te", "t_events", "ye", "y_events", "ie", "events_time"), _CONTACTS),
    **dict.fromkeys(("success", "message"), "Write run.status, or sl.describe(run)."),
    **dict.fromkeys(("sol", "interp_at"), "Write run.x.interp(time=[...])."),
}


class Result(xr.Dataset):
    """A Dataset in every respect but one: what would make the product of all its dims is refused.

    A result holds several tables: a run has samples, contacts and guards, a map cells and
    attractors. ``to_dataframe`` of a Dataset makes a row for every combination of them, which for
    an ordinary run is more than a computer can hold. Of variables that are one table, ``run[["x",
    "v"]]``, it makes what it always makes. See docs/decisions/0021.
    """

    __slots__ = ()

    #: Its content in a few lines; ``saltus.results`` sets it, which knows what each kind says.
    _headline: ClassVar[Callable[[xr.Dataset], str]] = str

    def _repr_html_(self) -> str:
        """Text for a notebook: the content in a few lines, then the table of xarray."""
        try:
            text = type(self)._headline(self)
        except Exception:  # of a Dataset that somebody has changed since, xarray shows what is left
            text = ""
        top = f"<pre>{html.escape(text)}</pre>" if text else ""
        return top + str(super()._repr_html_())

    @classmethod
    def of(
        cls,
        variables: dict[str, xr.Variable],
        coords: Iterable[str],
        indexes: Mapping[str, xr.Index],
        attrs: dict[str, Any],
    ) -> Result:
        """Dataset of variables that fit each other and belong to nobody else.

        xarray's own constructor aligns, merges and copies them first, which for the thirty of a run
        takes as long as its hash. That two of them give a dim two lengths is found here too.

        Parameters
        ----------
        variables : dict of str to xarray.Variable
            All of them; those with an index as that made them.
        coords : iterable of str
            The names of those that are coordinates.
        indexes : mapping of str to xarray.Index
            By the name of their coordinate.
        attrs : dict
            Attributes of the Dataset.

        Raises
        ------
        ValueError
            If a dim has two lengths.
        """
        return cls._construct_direct(variables, set(coords), attrs=attrs, indexes=dict(indexes))

    def __getattr__(self, name: str) -> Any:
        try:
            return super().__getattr__(name)
        except AttributeError as error:
            if (words := _ELSEWHERE.get(name)) is None:
                raise
            raise AttributeError(f"{error}. {words}") from None

    def to_dataframe(self, dim_order: Sequence[Hashable] | None = None) -> Any:
        """A pandas.DataFrame with a row for each point of the dims, as for any Dataset; refused for
        several tables.

        Raises
        ------
        ParameterError
            If the variables are more than one table. It says how to choose one.
        """
        self._refuse_product("to_dataframe")
        return super().to_dataframe(dim_order)

    def to_dask_dataframe(
        self, dim_order: Sequence[Hashable] | None = None, set_index: bool = False
    ) -> Any:
        """As :meth:`to_dataframe`, for dask."""
        self._refuse_product("to_dask_dataframe")
        return super().to_dask_dataframe(dim_order, set_index)

    def to_dataarray(
        self, dim: Hashable = "variable", name: Hashable | None = None
    ) -> xr.DataArray:
        """One array of all variables, as for any Dataset; refused for several tables."""
        self._refuse_product("to_dataarray")
        return super().to_dataarray(dim, name)

    def _refuse_product(self, caller: str) -> None:
        """Raise ParameterError unless one variable has all dims."""
        dims = set(self.dims)
        if not dims or any(set(variable.dims) == dims for variable in self.variables.values()):
            return
        tables: dict[tuple[Hashable, ...], list[str]] = {}
        for name, variable in self.data_vars.items():
            if variable.dims:
                tables.setdefault(variable.dims, []).append(str(name))
        some, name = (
            ", ".join(map(repr, next(iter(tables.values()), [])[:2])),
            "run" if "contact" in dims else "ds",
        )
        empty = [str(name) for name, size in self.sizes.items() if size == 0]
        product = (
            f"multiply its tables ({' and '.join(map(_dims, tables))}) to "
            f"{math.prod(self.sizes.values())} rows"
        )
        lost = (
            f"lose its tables ({' and '.join(map(_dims, tables))}), because there is no "
            f"{' and no '.join(empty)}"
        )
        tables_of_run = "sl.samples(run), sl.contacts(run) or " if name == "run" else ""
        raise ParameterError(
            f"{caller} of this result would {lost if empty else product}. "
            f"Take one: {tables_of_run}{name}[[{some}]].{caller}()."
        )


def _dims(dims: tuple[Hashable, ...]) -> str:
    return " x ".join(map(str, dims))
