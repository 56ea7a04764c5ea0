"""`compare_methods`: one analysis by several methods, with their differences, errors and costs."""

from __future__ import annotations

import functools
import inspect
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.basins.basins import basins
from saltus.analysis.basins.compare import compare
from saltus.analysis.basins.pipeline import PERIODS
from saltus.analysis.dataset_parts import provenance
from saltus.analysis.inputs.starts import check_system
from saltus.analysis.inputs.verb import check_call, verb
from saltus.analysis.methods.method_errors import (
    SAME_AT_LEAST,
    cell_agreement,
    one_period_errors,
    orbit_distances,
    response_noise,
    state_distances,
)
from saltus.analysis.motion.simulate import simulate
from saltus.analysis.responses.bifurcation_diagram import bifurcation_diagram
from saltus.analysis.responses.frequency_response import frequency_response
from saltus.errors import ParameterError, among, shown
from saltus.flow.counts import whole
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import ODE45, Method, check_method
from saltus.interrupt import Interrupted
from saltus.intervals import wilson
from saltus.kernels import status as st
from saltus.results import Subject, build
from saltus.results.dataset.attractors import basin_meanings
from saltus.results.dataset.schema import (
    BASINS,
    METHODS,
    TRAJECTORY,
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
    "simulate": simulate,
}
#: Most work on one motion of a response or a map: steps times states, in all of its periods.
#: MATLAB's ode45 does some 3 million a second.
WORK = 2e8


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

    Runs over a span, :func:`saltus.simulate`, are compared sample by sample. They are what to
    compare of a structure of many modes: its highest mode sets the steps of all methods but
    :class:`saltus.Modal`, and responses take thousands of periods. A method that would take more
    than 2e8 steps times states for ``periods`` of one motion, a minute or so, is refused there.

    Parameters
    ----------
    system : System
        Equations, contacts and values.
    analysis : function or str
        :func:`saltus.frequency_response`, :func:`saltus.bifurcation_diagram`,
        :func:`saltus.basins` or :func:`saltus.simulate`.
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
        ``basin`` in the numbers of the reference, and ``agrees``. For runs, over the time (and
        trajectories): ``orbit_distance`` from the reference's state, the largest of all states in
        units of the range of each in the run; ``agrees``, whether that is below 1e-3 (-1 where a
        run has ended); ``method_contacts``.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used, or a method would take too long.
    Interrupted
        On Ctrl-C; its ``partial`` is the comparison of the methods that are done, the reference and
        at least one other.

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
    known, done = computed or {}, list[tuple[Method, xr.Dataset, float]]()
    if name == "simulate":
        arguments = {"time_errors": "local", **arguments}
    else:
        usual = inspect.signature(_ANALYSES[name]).parameters["periods"].default
        periods = arguments.get("periods", usual)
        for method in everything:
            if method.label not in known:
                _check_work(system, method, PERIODS if periods is None else periods)
    try:
        for method in everything:
            done.append(
                (method, known[method.label], np.nan)
                if method.label in known
                else _timed(system, name, method, {**arguments, "progress": progress})
            )
        return _compared(system, name, done, arguments.get("threads"))
    except KeyboardInterrupt:
        if len(done) < 2:  # the results of single methods are no comparison
            raise Interrupted from None
        part = functools.partial(_compared, system, name, done, arguments.get("threads"))
        raise Interrupted(part) from None


def _check_work(system: System, method: Method, periods: Any) -> None:
    """Raise ParameterError if a method takes too many steps for a motion of so many periods."""
    states = len(system.states)
    map_ = Stroboscope(system, method, every=1.0 if system.forced_at is None else None)
    counters = map_.run(np.zeros((1, states)), 1).counters[0]
    steps = max(int(counters[st.STEPS] + counters[st.REJECTED]), 1)
    most = int(WORK / (steps * states))
    if whole(periods, "periods") > most:
        raise ParameterError(
            f"{method.label} takes {steps} steps of {states} states for a period of "
            f"{system.name}: too many for {periods} periods of a motion. ",
            lambda say: f"Give {say.key(periods=most)} or less, " if most else "",
            "or compare runs over a span: sl.compare_methods(system, sl.simulate, [...], "
            "periods=10).",
        )


def _compared(
    system: System,
    name: str,
    done: Sequence[tuple[Method, xr.Dataset, float]],
    threads: int | None,
) -> xr.Dataset:
    """The comparison of the methods that are done, the reference first."""
    everything, results, costs = (list(column) for column in zip(*done, strict=True))
    if name == "simulate":
        parts, columns = _of_runs(results)
    else:
        columns = {}
        parts = (
            _of_basins(results)
            if name == "basins"
            else _of_responses(system, everything, results, threads)
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
            **columns,
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
    states, kind = states_of(base), kind_of(base)
    if kind == TRAJECTORY:
        dims = tuple(map(str, base[states[0]].dims))
    else:
        dims = axes_of(base) if kind == BASINS else parameters_of(base)
    shown = next(name for name in ("peak", attractor_name(states[0]), states[0]) if name in base)
    first = base[shown].attrs.get("units", "")
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
) -> tuple[Method, xr.Dataset, float]:
    """A method, the analysis by it, and its processor time [s] without that of compiling."""
    map_, start = (
        Stroboscope(system, method, every=1.0 if system.forced_at is None else None),
        np.zeros((1, len(system.states))),
    )
    if name != "simulate":
        map_.tangent(start, 1)
    map_.run(start, 1)
    begin = time.process_time()
    ds = _ANALYSES[name](system, method=method, **arguments)
    return method, ds, time.process_time() - begin


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


def _of_runs(
    results: list[xr.Dataset],
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Fields over (method, time) or (method, trajectory, time); columns of the methods."""
    apart = np.stack([state_distances(results[0], ds) for ds in results])
    agrees = np.where(np.isfinite(apart), apart < SAME_AT_LEAST, -1).astype(np.int8)
    contacts = np.array([int(ds["events"].sum()) for ds in results])
    return {"orbit_distance": apart, "agrees": agrees}, {"method_contacts": contacts}


def _of_basins(results: list[xr.Dataset]) -> dict[str, np.ndarray]:
    """Fields over (method, states...)."""
    exact = results[0]
    both = [compare(exact, ds) for ds in results]
    return {
        "basin": np.stack([ds["basin_b"].values for ds in both]),
        "agrees": np.stack([ds["agreement"].values for ds in both]),
    }
