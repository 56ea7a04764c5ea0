"""From branches to their Dataset: the numbers of every orbit on them."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.branches.branch import Branch
from saltus.analysis.branches.equilibrium_curves import EquilibriumCurves
from saltus.analysis.branches.harmonic_branches import balanced
from saltus.analysis.branches.resolution import resolve
from saltus.analysis.branches.same_branch import has_twin
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.branches.special_points import outside
from saltus.analysis.closed.measures import Measures, measure, unknown
from saltus.analysis.dataset_parts import guards_over, provenance, subject
from saltus.analysis.harmonics.balance import HarmonicBalance
from saltus.analysis.harmonics.equations import HarmonicOrbits
from saltus.analysis.harmonics.sizes import measured
from saltus.analysis.inputs.outputs import Outputs
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.flow.request import Schedule
from saltus.results import build
from saltus.results.dataset import schema
from saltus.results.dataset.attractors import padded
from saltus.system import System

Orbits = PeriodicOrbits | EquilibriumCurves | HarmonicOrbits
#: Samples of a period by which branches are resolved.
SAMPLES = 64
#: Multipliers nearer to the unit circle than this don't count as inside: the orbit may not attract.
MARGINAL = 1e-9


def table_of(
    system: System,
    name: str,
    limits: tuple[float, float],
    branches: Sequence[Branch],
    outputs: Outputs,
    method: Method,
    by: HarmonicBalance | None = None,
) -> xr.Dataset:
    """The Dataset of branches over a parameter."""
    values = values_of(system, name, branches, outputs, method)
    values |= {"output": list(outputs.names), "output_units": list(outputs.units)}
    if by is not None:
        values |= balanced(branches, outputs, by.count)
    fixed = {key: value for key, value in system.values.items() if key != name}
    attrs = provenance(system, method, fixed, (name,)) | attributes_of(name, limits, branches)
    attrs |= {} if by is None else {"harmonics": by.count}
    unit = outputs.units[0] if len(set(outputs.units)) == 1 else ""
    when = "at whole forcing periods" if system.forced_at else "in equal steps of time"
    about = subject(system, attrs, guards_over(system, system.values, ()))
    words = {"<when>": when, "<output>": unit, "<varied>": system.units[name]}
    return build(schema.BRANCHES, about, values, words=words)


def attributes_of(
    name: str, limits: tuple[float, float], branches: Sequence[Branch]
) -> dict[str, Any]:
    """Attributes of a Dataset of branches: the parameter's name, its range, and the number of
    changes that are not explained.
    """
    return {
        "parameter": name,
        "parameter_low": limits[0],
        "parameter_high": limits[1],
        "unexplained_changes": sum(len(branch.unexplained) for branch in branches),
    }


def values_of(
    system: System, name: str, branches: Sequence[Branch], outputs: Outputs, method: Method
) -> dict[str, Any]:
    """The variables on the dims ``point``, ``branch`` and ``event``."""
    size = len(system.states)
    resolve(branches, functools.partial(_sampled_peaks, system, method))
    counts = [len(branch.z) for branch in branches]
    points = [(branch, z) for branch in branches for z in branch.z]
    events = [(number, event) for number, branch in enumerate(branches) for event in branch.events]
    at_events = [(branches[number], event.z) for number, event in events]
    every = numbers_of(system, _with_equations([*points, *at_events]), outputs, method)
    numbers, event_numbers = every.rows(slice(len(points))), every.rows(slice(len(points), None))
    begins = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    multipliers = stacked([branch.multipliers for branch in branches], size)
    event_multipliers = stacked([event.multipliers[None] for _, event in events], size)
    at_rest = np.array([isinstance(branch.orbits, EquilibriumCurves) for branch, _ in points], bool)
    event_at_rest = np.array(
        [isinstance(branch.orbits, EquilibriumCurves) for branch, _ in at_events], bool
    )
    eigenvalues = _eigenvalues(points, size)
    event_eigenvalues = _eigenvalues(at_events, size)
    periods = np.array([_periods(branch.orbits) for branch, _ in points], np.int64)
    states = padded([branch.orbits.points(z) for branch, z in [*points, *at_events]], size)
    return {
        "point": np.arange(len(points)),
        "point_branch": np.repeat(np.arange(len(branches)), counts),
        "point_<parameter>": {name: _parameter(points)},
        "point_arclength": np.concatenate([b.length for b in branches] or [np.zeros(0)]),
        "point_stable": _attracts(multipliers),
        "point_unstable_multipliers": outside(multipliers).sum(axis=1),
        "point_period": np.array(
            [
                np.nan if rest else float(branch.orbits.period(z))
                for (branch, z), rest in zip(points, at_rest, strict=True)
            ],
            float,
        ),
        "point_peak": numbers.peak[:, 0],
        "point_rms": numbers.rms[:, 0],
        "point_contacts": numbers.contacts * (1 if system.forced_at is None else periods),
        "point_itinerary": list(numbers.itinerary),
        "point_margin": numbers.margin,
        **_complex("point_multiplier", np.where(at_rest[:, None], np.nan, multipliers)),
        **_complex("point_eigenvalue", eigenvalues),
        "point_<state>": states[: len(points)],
        **{f"point_output_{key}": column for key, column in numbers.by_name().items()},
        **_branches(branches),
        "event": np.arange(len(events)),
        "event_kind": [event.kind for _, event in events],
        "event_guard": [" + ".join(system.guards[i].name for i in e.guards) for _, e in events],
        "event_phase": np.array([event.phase for _, event in events]),
        "event_outcome": [event.outcome for _, event in events],
        "event_sqrt_coefficient": np.array([event.sqrt_coefficient for _, event in events], float),
        "event_branch": np.array([number for number, _ in events], np.int64),
        "event_point": np.array([begins[i] + event.after for i, event in events], np.int64),
        "event_<parameter>": {name: _parameter(at_events)},
        "event_peak": event_numbers.peak[:, 0],
        "event_rms": event_numbers.rms[:, 0],
        **_complex("event_multiplier", np.where(event_at_rest[:, None], np.nan, event_multipliers)),
        **_complex("event_eigenvalue", event_eigenvalues),
        "event_<state>": states[len(points) :],
    }


def _attracts(multipliers: np.ndarray) -> np.ndarray:
    """True where all multipliers complex128[p, D] lie inside the unit circle, and some are known,
    bool[p].
    """
    inside = np.nanmax(np.abs(multipliers), axis=1, initial=0.0) < 1.0 - MARGINAL
    return np.asarray(inside & ~np.isnan(multipliers).all(axis=1))


def _periods(orbits: Orbits) -> int:
    """Forcing periods of orbits."""
    return orbits.periods if isinstance(orbits, HarmonicOrbits) else orbits.n


def _parameter(points: Sequence[tuple[Branch, np.ndarray]]) -> np.ndarray:
    """The parameter at points of branches [SI]."""
    return np.array([branch.orbits.values(z)[-1] for branch, z in points], float)


def _complex(name: str, values: np.ndarray) -> dict[str, np.ndarray]:
    """Real and imaginary parts, both NaN where there is none."""
    none = np.isnan(values)
    return {
        f"{name}_real": np.where(none, np.nan, values.real),
        f"{name}_imag": np.where(none, np.nan, values.imag),
    }


def _eigenvalues(points: Sequence[tuple[Branch, np.ndarray]], size: int) -> np.ndarray:
    """Eigenvalues of equilibria [1/s], NaN of orbits, complex128[.., size]."""
    result = np.full((len(points), size), np.nan + 0j)
    for row, (branch, z) in zip(result, points, strict=True):
        if isinstance(branch.orbits, EquilibriumCurves):
            row[:] = branch.orbits.eigenvalues(z[None], np.array([branch.row]))[0]
    return result


def _kind(branch: Branch) -> str:
    """Kind of the orbits on a branch: ``equilibrium``, ``limit_cycle`` or ``periodic``."""
    if isinstance(branch.orbits, EquilibriumCurves):
        return "equilibrium"
    return "limit_cycle" if branch.orbits.free else "periodic"


def _branches(branches: Sequence[Branch]) -> dict[str, Any]:
    """Variables with one entry for each branch, such as its kind, its parent and its ends."""
    return {
        "branch": np.arange(len(branches)),
        "branch_kind": [_kind(branch) for branch in branches],
        "branch_periods": np.array(
            [
                0 if isinstance(one.orbits, EquilibriumCurves) else _periods(one.orbits)
                for one in branches
            ],
            np.int64,
        ),
        "branch_closed": np.array([branch.closed for branch in branches], bool),
        "branch_parent": np.array(
            [-1 if branch.parent is None else branch.parent[0] for branch in branches], np.int64
        ),
        "branch_twin": np.array([has_twin(branch) for branch in branches], bool),
        "branch_begin": [branch.ends[0] for branch in branches],
        "branch_end": [branch.ends[1] for branch in branches],
        "branch_begin_limit": np.array([branch.limits[0] for branch in branches], float),
        "branch_end_limit": np.array([branch.limits[1] for branch in branches], float),
        "branch_unexplained": np.array([len(b.unexplained) for b in branches], np.int64),
    }


def _sampled_peaks(system: System, method: Method, branch: Branch, z: np.ndarray) -> np.ndarray:
    """Largest magnitude of the first state of orbits float64[r, z] of a branch, nearly: at samples,
    to say where more orbits are needed.
    """
    if isinstance(branch.orbits, EquilibriumCurves):
        return np.asarray(np.abs(z[:, 0]))
    if isinstance(branch.orbits, HarmonicOrbits):
        return np.array([np.abs(branch.orbits.samples(one)[:, 0]).max() for one in z])
    n = branch.orbits.n if system.forced_at is not None else 1
    map_ = _map_of(system, method, [(branch.orbits, one) for one in z])
    starts = branch.orbits.points(z)[:, 0]
    samples = map_.run(starts, n, Schedule.even(n, SAMPLES)).samples
    return np.asarray(np.abs(samples[:, :, 0]).max(axis=1))


def _map_of(
    system: System, method: Method, points: Sequence[tuple[Orbits, np.ndarray]]
) -> Stroboscope:
    """A map for each orbit: over its forcing period, or its own period."""
    rows = np.tile(np.array(list(system.values.values())), (len(points), 1))
    for row, (orbits, z) in zip(rows, points, strict=True):
        row[[list(system.values).index(name) for name in orbits.names]] = orbits.values(z)
    if system.forced_at is not None:
        return Stroboscope(system, method, rows)
    times = np.array([float(orbits.period(z)) for orbits, z in points])
    return Stroboscope(system, method, rows, every=times)


def _with_equations(
    points: Sequence[tuple[Branch, np.ndarray]],
) -> list[tuple[Orbits, np.ndarray]]:
    return [(branch.orbits, z) for branch, z in points]


def numbers_of(
    system: System,
    points: Sequence[tuple[Orbits, np.ndarray]],
    outputs: Outputs,
    method: Method,
) -> Measures:
    """The numbers of orbits, each with its unknowns: extremes, means, contacts and margins."""
    truncated = [i for i, (orbits, _) in enumerate(points) if isinstance(orbits, HarmonicOrbits)]
    if truncated:
        numbers = unknown(len(points), len(system.states), len(outputs))
        for i in truncated:
            orbits, z = points[i]
            assert isinstance(orbits, HarmonicOrbits)
            numbers.put(np.array([i]), measured(orbits, z[None], outputs))
        return numbers
    starts = np.array([orbits.points(z)[0] for orbits, z in points])
    starts = starts.reshape(len(points), len(system.states))
    if not len(points):
        return unknown(0, starts.shape[1], len(outputs))
    periods = np.array([orbits.n for orbits, _ in points], np.int64)
    periods = periods if system.forced_at is not None else np.ones_like(periods)
    numbers = measure(_map_of(system, method, points), starts, periods, outputs=outputs)
    for i, (orbits, z) in enumerate(points):
        if isinstance(orbits, EquilibriumCurves):
            numbers.margin[i], numbers.contacts[i] = orbits.margin(z), 0.0
            numbers.itinerary[i] = ""
    return numbers


def stacked(parts: Sequence[np.ndarray], size: int) -> np.ndarray:
    """Multipliers in one table complex128[.., size], NaN where a trivial one was left out."""
    whole = np.full((sum(map(len, parts)), size), np.nan + 0j)
    first = 0
    for part in parts:
        whole[first : first + len(part), : part.shape[1]] = part
        first += len(part)
    return whole
