"""Seeds of branches: the periodic responses, attractors and equilibria that were found."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import xarray as xr

from saltus.analysis.branches.switching import Seed
from saltus.analysis.closed.all_equilibria import all_equilibria
from saltus.analysis.closed.cycles import ZERO, units
from saltus.analysis.closed.measures import measure
from saltus.analysis.closed.motions import ClosedMotions
from saltus.analysis.inputs.orbits import NAMES, PREFIX, check_equations
from saltus.errors import ParameterError, shown
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.results.dataset import schema
from saltus.system import System

#: Values of a parameter at which equilibria are looked for.
RESTING_VALUES = 3
#: Random starts at each of these values.
RESTING_STARTS = 64
#: Least range that counts of a state, as a part of the largest of those with its unit. High modes
#: of a structure have tiny amplitudes, whose phases turn many times along a branch: they would set
#: the length of its steps.
LEAST_SHARE = 0.1
#: An equilibrium so near to zero is there, in units of the starts.
NOTHING = 1e-8


def seeds_of(system: System, name: str, found: xr.Dataset) -> list[Seed]:
    """The periodic orbits of a Dataset as seeds of branches over the parameter ``name``.

    Raises
    ------
    ParameterError
        If the Dataset is of another system or kind, or over another parameter.
    """
    kind = schema.kind_of(found)
    if kind == schema.EQUILIBRIA:
        return []
    if kind not in PREFIX:
        raise ParameterError(
            "start= takes what sl.frequency_response, sl.bifurcation_diagram, sl.attractors, "
            f"sl.basins or sl.periodic_orbits returned, or starts, not {shown(found)[:60]}."
        )
    check_equations(system, found)
    prefix = PREFIX[kind]
    values = _values(system, name, found, prefix, kind)
    points = np.stack([found[NAMES[prefix](state)].values for state in system.states], axis=2)
    times = found.get(f"{prefix}_cycle")
    cycles = np.full(len(values), np.nan) if times is None else times.values
    periods = np.where(cycles > 0, 1, found[f"{prefix}_period"].values)
    if f"{prefix}_multiplier_real" in found:
        real, imaginary = (found[f"{prefix}_multiplier_{part}"].values for part in ("real", "imag"))
        motions = ClosedMotions(periods, points, real + 1j * imaginary, cycles, cycles)
        periods = np.where(motions.neutral, 0, periods)  # no single curve leads on from there
    return list(seeds_at(system, points, periods, cycles, values))


def _own_value(system: System, name: str, found: xr.Dataset) -> float:
    """The value of a parameter at which orbits were found.

    Raises
    ------
    ParameterError
        If the others aren't those of the system.
    """
    own = json.loads(found.attrs.get("parameters", "{}"))
    for other, value in system.values.items():
        if other != name and own.get(other, value) != value:
            raise ParameterError(
                f"start= holds orbits at {other} = {own[other]:g}, but the system that is followed "
                f"has {other} = {value:g}. Find them for this one, or give it that value."
            )
    return float(own.get(name, system.values[name]))


def _values(system: System, name: str, found: xr.Dataset, prefix: str, kind: str) -> np.ndarray:
    """The values of a parameter at what a Dataset holds: its own, else that of them all."""
    own = f"{prefix}_{name}" if kind != schema.RESPONSES else schema.response_name(name)
    values = found[own].values if own in found else np.full(found.sizes[prefix], np.nan)
    return np.where(np.isfinite(values), values, _own_value(system, name, found))


def equilibrium_seeds(system: System, name: str, found: xr.Dataset) -> list[Seed]:
    """The equilibria of a Dataset, off boundaries, as seeds of branches over ``name``."""
    kind = schema.kind_of(found)
    names: Callable[[str], str] = schema.equilibrium_name
    if kind == schema.EQUILIBRIA:
        prefix = "equilibrium"
        resting = (found["equilibrium_place"] == "region") & (found["equilibrium_dimension"] == 0)
    else:
        prefix = PREFIX[kind]
        names = NAMES[prefix]
        if f"{prefix}_type" not in found:
            return []
        resting = found[f"{prefix}_type"] == "equilibrium"
    values = _values(system, name, found, prefix, kind)
    columns = [found[names(one)].values.reshape(len(values), -1)[:, 0] for one in system.states]
    places, here = np.stack(columns, axis=1), resting.values
    return equilibria_at(places[here], values[here])


def equilibria_at(
    places: np.ndarray, values: np.ndarray, starts: np.ndarray | None = None
) -> list[Seed]:
    """Seeds at equilibria float64[k, D] of the parameter's values float64[k]; their common unit is
    their size, or where it is nothing beside that of starts float64[s, D], theirs.
    """
    unit = np.abs(places).max(axis=0, initial=0.0)
    if starts is not None:
        usual = np.abs(starts).max(axis=0, initial=0.0)
        unit = np.where(unit > NOTHING * usual, unit, usual)
    unit = np.where(unit > ZERO, unit, 1.0)
    return [Seed(one[None], np.array([v]), unit) for one, v in zip(places, values, strict=True)]


def equilibria_between(
    system: System, name: str, limits: tuple[float, float], starts: np.ndarray
) -> list[Seed]:
    """Seeds at the equilibria that Newton's method finds at some values of the parameter, from
    starts float64[s, D] and random ones of many sizes.
    """
    random = np.random.default_rng(0).uniform(-1.0, 1.0, (RESTING_STARTS, len(system.states)))
    begin = np.concatenate([starts, np.sign(random) * 10.0 ** (8.0 * np.abs(random) - 4.0)])
    unit = np.abs(starts).max(axis=0, initial=0.0)
    unit = np.where(unit > 0, unit, 1.0)
    places, values = list[np.ndarray](), list[float]()
    for value in np.linspace(*limits, RESTING_VALUES + 2)[1:-1]:
        try:
            found = all_equilibria(system.with_values(**{name: float(value)}), begin, unit)
        except ParameterError:  # too many modes
            return []
        equilibria = [one.state for one in found if one.place == "region" and not one.dimension]
        places += equilibria
        values += [float(value)] * len(equilibria)
    return equilibria_at(np.reshape(places, (-1, len(system.states))), np.array(values), starts)


def seeds_at(
    system: System, points: np.ndarray, periods: np.ndarray, times: np.ndarray, values: np.ndarray
) -> Iterator[Seed]:
    """Seeds of those that repeat, the shortest first; equilibria are none."""
    for i in np.argsort(periods, kind="stable"):
        n = int(periods[i])
        mine = points[i][np.isfinite(points[i]).all(axis=1)]
        if n < 1 or not len(mine):
            continue
        if system.forced_at is None:
            if not times[i] > 0:
                continue
            yield Seed(mine[:1], np.array([times[i], values[i]]), _ranges(mine))
        elif len(mine) >= n:
            yield Seed(mine[:n], values[i : i + 1], np.full(points.shape[2], np.nan))


def _ranges(points: np.ndarray) -> np.ndarray:
    """Range of each state, its size where it rests."""
    return units(points.max(axis=0), points.min(axis=0))


def scaled(system: System, name: str, seeds: list[Seed], method: Method) -> list[Seed]:
    """The seeds with the ranges of their states over the whole motion, where they aren't known; of
    states with one unit the largest range counts for the others to LEAST_SHARE.
    """
    unknown = [i for i, seed in enumerate(seeds) if not np.isfinite(seed.scale).all()]
    if not unknown:
        return seeds
    rows = np.tile(np.array(list(system.values.values())), (len(unknown), 1))
    rows[:, list(system.values).index(name)] = [seeds[i].others[-1] for i in unknown]
    starts = np.array([seeds[i].points[0] for i in unknown])
    periods = np.array([len(seeds[i].points) for i in unknown])
    numbers = measure(Stroboscope(system, method, rows), starts, periods)
    result = list(seeds)
    for place, i in enumerate(unknown):
        scale = units(numbers.maximum[place], numbers.minimum[place])
        scale = np.where(np.isfinite(scale), scale, 1.0)
        result[i] = replace(seeds[i], scale=_with_least(system, scale))
    return result


def _with_least(system: System, scale: np.ndarray) -> np.ndarray:
    """Ranges of the states, none smaller than LEAST_SHARE of the largest one with its unit."""
    units_of = np.array([system.state_unit(name) for name in system.states])
    alike = (units_of[:, None] == units_of) & (units_of != "")
    largest: np.ndarray = np.where(alike, scale, 0.0).max(axis=1)
    return np.asarray(np.maximum(scale, LEAST_SHARE * largest))
