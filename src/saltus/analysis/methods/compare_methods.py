"""`compare_methods`: one analysis by several methods, with their differences, errors and costs."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.basins.basins import basins
from saltus.analysis.basins.compare import compare
from saltus.analysis.dataset_parts import provenance
from saltus.analysis.inputs.starts import check_system
from saltus.analysis.inputs.verb import check_call, verb
from saltus.analysis.methods.method_errors import (
    cell_agreement,
    one_period_errors,
    orbit_distances,
    response_noise,
)
from saltus.analysis.responses.bifurcation_diagram import bifurcation_diagram
from saltus.analysis.responses.frequency_response import frequency_response
from saltus.errors import ParameterError, among, shown
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import ODE45, Method, check_method
from saltus.interrupt import Interrupted
from saltus.intervals import wilson
from saltus.results import Subject, build
from saltus.results.dataset.attractors import basin_meanings
from saltus.results.dataset.schema import (
    BASINS,
    METHODS,
    attractor_name,
    axes_of,
    kind_of,
    parameters_of,
    states_of,
)
from saltus.system import System

#: The methods of Saunders et al. (2021): ode45 with and without event location.
USUAL = (ODE45(rtol=1e-4, atol=1e-7), ODE45(rtol=1e-4, atol=1e-7, events="ignore"))
_ANALYSES: dict[str, Callable[..., xr.Dataset]] = {
    "basins": basins,
    "bifurcation_diagram": bifurcation_diagram,
    "frequency_response": frequency_response,
}


@verb
def compare_methods(
    system: System,
    analysis: Callable[..., xr.Dataset] | str,
    methods: Sequence[Method] = USUAL,
    *,
    reference: Method | None = None,
    computed: Mapping[str, xr.Dataset] | None = None,
    progress: bool | Callable[[float], None] | None = None,
    **arguments: Any,
) -> xr.Dataset:
    """Run one analysis by several methods and an exact one, and compare: changed results, errors
    and costs.

    Parameters
    ----------
    system : System
        Equations, contacts and values.
    analysis : function or str
        :func:`saltus.frequency_response`, :func:`saltus.bifurcation_diagram` or
        :func:`saltus.basins`.
    methods : sequence of Method
        The methods compared; default ode45 at (1e-4, 1e-7) with and without event location.
    reference : Method
        The exact method; default :class:`saltus.Taylor`, or :class:`saltus.Modal` from eight states
        on where it serves: exact but for rounding.
    computed : mapping of str to Dataset, optional
        Results that exist already, by the ``label`` of their method; they aren't computed again,
        and their cost stays unknown.
    progress : bool or callable
        As for the analysis; each method is one bar.
    **arguments
        Those of the analysis.

    Returns
    -------
    Dataset
        Dim ``method`` (labels; the reference first): ``method_cpu_seconds`` (all threads, without
        compiling), ``method_agreement``, the share of starts with the same answer as the reference,
        and its 95 % interval. For responses also, over the parameters and ``start``: ``rms``,
        ``peak``, ``period``, ``type``, ``agrees`` (1, 0, -1 where one of both didn't settle),
        ``known`` (whether the reference has this response at that value, from any start),
        ``orbit_distance`` (units of the response's size); over the parameters: ``step_error`` and
        ``step_error_rms``, the error of one forcing period started on the reference's own responses
        (units of the motion's range; NaN where the method doesn't get through it), and
        ``steps_per_period``. For basins, over both states:
        ``basin`` in the numbers of the reference, and ``agrees``.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> methods = [sl.ODE45(rtol=1e-6, atol=1e-9)]
    >>> frequency = ["16 Hz", "17 Hz"]
    >>> table = sl.compare_methods(rig, sl.frequency_response, methods, frequency=frequency)
    >>> table["method_agreement"].values.tolist()
    [1.0, 1.0]
    """
    check_system(system)
    name: Any = analysis if isinstance(analysis, str) else getattr(analysis, "__name__", analysis)
    if not among(name, _ANALYSES):
        raise ParameterError(
            f"methods are compared by {', '.join(sorted(_ANALYSES))}, not by {shown(name)}."
        )
    if "method" in arguments:
        raise ParameterError("give the methods as methods=[...]; method= is for a single analysis.")
    everything = list(dict.fromkeys(check_method(one, system) for one in (reference, *methods)))
    if len(everything) < 2:
        raise ParameterError(
            "there is nothing to compare: give at least one method beside the reference."
        )
    check_call(_ANALYSES[name], system, method=everything[0], **arguments, progress=progress)
    results, costs = [], []
    for method in everything:
        known = (computed or {}).get(method.label)
        ds, cost = (
            _timed(system, name, method, {**arguments, "progress": progress})
            if known is None
            else (known, np.nan)
        )
        results.append(ds)
        costs.append(cost)
    parts = (
        _of_basins(results)
        if name == "basins"
        else _of_responses(system, everything, results, arguments.get("threads"))
    )
    agreeing, differing = (
        np.array([int((part == code).sum()) for part in parts["agrees"]], float) for code in (1, 0)
    )
    settled = np.where(agreeing + differing > 0, agreeing + differing, np.nan)
    low, high = wilson(agreeing, settled)
    return methods_dataset(
        base=results[0],
        labels=[method.label for method in everything],
        columns={
            "method_cpu_seconds": np.array(costs),
            "method_agreement": agreeing / settled,
            "method_agreement_low": low,
            "method_agreement_high": high,
        },
        fields=parts,
        attrs=provenance(system, everything[0], system.values) | {"analysis": name},
    )


def methods_dataset(
    base: xr.Dataset,
    labels: list[str],
    columns: Mapping[str, np.ndarray],
    fields: Mapping[str, np.ndarray],
    attrs: Mapping[str, Any],
) -> xr.Dataset:
    """The Dataset of one analysis by several methods.

    Parameters
    ----------
    base : Dataset
        The analysis by the reference: its coordinates, parameters or states, and starts.
    labels : list of str, length k
        A name for each method, the reference first.
    columns, fields : mapping of str to array, shape (k,) or (k, n...)
        What belongs to a method, and what to a method and a place of the grid, with or without the
        dim ``start``.
    attrs : mapping
        Provenance.
    """
    states, dims = (
        states_of(base),
        axes_of(base) if kind_of(base) == BASINS else parameters_of(base),
    )
    first = base["peak" if "peak" in base else attractor_name(states[0])].attrs.get("units", "")
    labelled = (
        {"basin": basin_meanings(int(fields["basin"].max(initial=-1)) + 1)}
        if "basin" in fields
        else {}
    )
    carried = {
        str(name): base[name].variable
        for name in base.coords
        if set(base[name].dims) <= {*dims, "start"}
    }
    values = {"method": labels, **columns, **fields}
    return build(
        METHODS,
        Subject(states, {states[0]: first}, attrs),
        values,
        grid=dims,
        flags=labelled,
        carried=carried,
    )


def _timed(
    system: System, name: str, method: Method, arguments: Mapping[str, Any]
) -> tuple[xr.Dataset, float]:
    """The analysis by one method, and its processor time [s] without that of compiling."""
    map_, start = (
        Stroboscope(system, method, every=1.0 if system.forced_at is None else None),
        np.zeros((1, len(system.states))),
    )
    map_.tangent(start, 1)
    map_.run(start, 1)
    begin = time.process_time()
    try:
        ds = _ANALYSES[name](system, method=method, **arguments)
    except Interrupted:
        raise Interrupted from None  # the results of single methods are no comparison
    return ds, time.process_time() - begin


def _of_responses(
    system: System, methods: list[Method], results: list[xr.Dataset], threads: int | None
) -> dict[str, np.ndarray]:
    """Fields over (method, parameters..., start), and over (method, parameters...)."""
    exact = results[0]
    fields: dict[str, list[np.ndarray]] = {name: [] for name in ("rms", "peak", "period", "type")}
    fields |= {
        name: []
        for name in (
            "agrees",
            "known",
            "orbit_distance",
            "step_error",
            "step_error_rms",
            "steps_per_period",
        )
    }
    for method, ds in zip(methods, results, strict=True):
        for name in ("rms", "peak", "period", "type"):
            fields[name].append(ds[name].values)
        noise = response_noise(system, method, exact)
        distance, nearest = orbit_distances(exact, ds)
        fields["orbit_distance"].append(distance)
        fields["agrees"].append(cell_agreement(exact, ds, distance, noise))
        fields["known"].append(cell_agreement(exact, ds, nearest, noise))
        for name, values in one_period_errors(system, methods[0], method, exact, threads).items():
            fields[name].append(values)
    return {name: np.stack(parts) for name, parts in fields.items()}


def _of_basins(results: list[xr.Dataset]) -> dict[str, np.ndarray]:
    """Fields over (method, states...)."""
    exact = results[0]
    both = [compare(exact, ds) for ds in results]
    return {
        "basin": np.stack([ds["basin_b"].values for ds in both]),
        "agrees": np.stack([ds["agreement"].values for ds in both]),
    }
