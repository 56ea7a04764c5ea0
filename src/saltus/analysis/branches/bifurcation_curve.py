"""`bifurcation_curve`: where an orbit bifurcates, over two parameters."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.branches.branch_table import numbers_of, stacked
from saltus.analysis.branches.codimension_two import Equations
from saltus.analysis.branches.curves import BifurcationCurve, trace_curve
from saltus.analysis.branches.grazing_orbits import GrazingOrbits
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.branches.singular_orbits import MULTIPLIER, SingularOrbits
from saltus.analysis.closed.cycles import units
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.inputs.given import Range
from saltus.analysis.inputs.outputs import states_alone
from saltus.analysis.inputs.starts import check_system, range_of
from saltus.analysis.inputs.verb import verb
from saltus.errors import ParameterError, nearest, shown
from saltus.flow.counts import whole
from saltus.flow.methods import Method, exact_method
from saltus.flow.progress import reporting, stage
from saltus.interrupt import Interrupted
from saltus.results import build
from saltus.results.dataset import schema
from saltus.results.dataset.attractors import padded
from saltus.results.dataset.schema import event_name, point_name
from saltus.sentences import Word
from saltus.system import System
from saltus.system.leg import MOST_STATES, has_legs

#: Most points in each direction, of systems of FEW_STATES states at most.
POINTS, FEW_STATES = 400, 20
#: Share of the progress bar at which the curve has been followed.
TRACED = 0.8


@verb
def bifurcation_curve(
    system: System,
    event: xr.Dataset,
    vary: Mapping[str, Range],
    *,
    points: int | None = None,
    method: Method | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """A bifurcation of periodic orbits followed over two parameters, in both directions.

    1. The event gives the orbit, the parameters and the critical multiplier, or the boundary that
       is grazed, to begin with.
    2. The equations of the orbit are extended by those of the bifurcation, so that each point is
       one to rounding: for folds, period doublings and Neimark-Sacker bifurcations one that
       vanishes where the tangent map has that multiplier; for grazes, that gap and rate are zero at
       an instant of the orbit.
    3. Their solutions are followed by pseudo-arclength continuation over both parameters at once,
       since curves turn back in either of them. They end where they leave the range, close, or run
       out of ``points``, or where a curve of this kind ends.
    4. Test functions along the curve change sign at points of codimension two, which are located:
       cusps, resonances, degenerate doublings, and the extrema of a curve of folds, at which closed
       branches (isolas) are born or join another branch.
    5. On a curve of grazes these are the points where the orbit folds or doubles, where a second
       boundary is touched, and where the square root that an impact brings vanishes. The contact
       that grazes is left out of the equations, which keeps them smooth.

    Parameters
    ----------
    system : System
        Of which the branches were followed.
    event : Dataset
        A bifurcation that :func:`saltus.branches` found: ``branches.sel(event=0)``. Parameters that
        aren't in ``vary`` keep its values.
    vary : mapping
        Two parameters and their ranges, such as ``{"frequency": ("4 Hz", "30 Hz"), "force": ("0.1
        N", "8 N")}``.
    points : int, optional
        Most points in each direction. It bounds the work: a point takes some fifteen runs over the
        orbit's period with all derivatives. Default 400, of more than 20 states as many fewer: 100
        of forty modes. A curve that they end has ``points`` for its ``begin`` or ``end``.
    method : Method
        Default :class:`saltus.Taylor`, or :class:`saltus.Modal` from eight states on where
        it serves; another one must be exact.
    threads : int, optional
        Default all processors.
    progress : bool or callable
        Default: a bar on the terminal if the work lasts more than two seconds.

    Returns
    -------
    Dataset
        Dims ``point``, ``codim2``, ``multiplier``, ``phase``. On point: ``point_<parameter>`` of
        both, ``point_period`` [s], ``point_peak`` and ``point_rms`` of the first state,
        ``point_itinerary`` (without the graze), ``point_margin``, ``point_sqrt_coefficient`` (of
        grazes: what the gap changes by when the orbit returns, over the square root of the depth by
        which a motion would pass the boundary; 0 at a continuous force), multipliers (of a limit
        cycle without the trivial one), the states at whole forcing periods, ``point_arclength``. On
        codim2: ``codim2_kind`` (``cusp``, ``isola_birth``, ``branches_join``, ``extremum``,
        ``resonance_1_1`` to ``resonance_1_4``, ``fold_flip``, ``degenerate_doubling``,
        ``fold_neimark_sacker``, ``flip_neimark_sacker``, ``fold_graze``, ``flip_graze``,
        ``resonant_graze``, ``double_graze``), ``codim2_extremum`` (the parameter that has one),
        both parameters, multipliers and states. Attributes ``bifurcation``, ``parameter_x``,
        ``parameter_y``, ``begin`` and ``end`` (why it ends: ``range``, ``closed``, ``points``,
        ``lost``, ``interrupted``, or an event), ``periods``, ``guard`` (grazed).

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used, the bifurcation isn't one that can be followed, or the
        equations are others than those of the event.
    Interrupted
        On Ctrl-C; its ``partial`` is the Dataset of the curve so far, its points of codimension two
        not yet looked for.

    References
    ----------
    Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria (2000); Kuznetsov, Elements
    of Applied Bifurcation Theory (2004), chapters 9 and 10; Detroux et al., Comput. Methods Appl.
    Mech. Engrg. 296 (2015) 18 (isolas at extrema of folds); di Bernardo, Budd, Champneys &
    Kowalczyk, Piecewise-smooth Dynamical Systems (2008), chapter 7 (grazes).

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> found = sl.branches(rig, {"frequency": ("15 Hz", "18 Hz")}, {"x": "5 mm", "v": 0}, at=3)
    >>> vary = {"frequency": ("8 Hz", "20 Hz"), "force": ("0.5 N", "5 N")}
    >>> fold = sl.bifurcation_curve(rig, found.sel(event=0), vary)
    >>> fold.attrs["bifurcation"], fold.attrs["end"]
    ('fold', 'range')
    """
    check_system(system)
    method = exact_method(method, system, "sl.bifurcation_curve")
    names, limits = _ranges(system, vary)
    most = min(POINTS, POINTS * FEW_STATES // len(system.states))
    points = most if points is None else whole(points, "points", 2)
    start = event_orbit(system, event)
    for name, (low, high) in zip(names, limits, strict=True):
        if not low <= start.system.values[name] <= high:
            raise ParameterError(
                f"the event lies at {name} = {start.system.values[name]:.6g}, outside the range "
                f"({low:g}, {high:g}) in ",
                lambda say: f"{say.key('vary')}.",
            )
    with reporting(progress) as show:
        orbits, z = orbits_over(start, names, limits, method, threads)
        equations, z = equations_at(start, orbits, z)
        curve = trace_curve(equations, z, limits, points, stage(show, 0.0, TRACED))
        if curve is None:
            raise ParameterError(
                f"no {start.kind.replace('_', ' ')} was found at the event: it may lie on a graze, "
                "or the event is of other equations."
            )
        part = functools.partial(_table, start, names, limits, orbits, curve, method)
        try:
            if curve.complete:
                return part()
        except KeyboardInterrupt:
            pass
        raise Interrupted(part)


@dataclass(frozen=True)
class EventOrbit:
    """The orbit of an event, the system with its values, and how far the states of orbits spread
    along its branch; the guard that is grazed, -1 if none is, and when.
    """

    system: System
    kind: str
    orbit: np.ndarray
    period: float
    multiplier: complex
    spread: np.ndarray
    guard: int
    phase: float


def _ranges(system: System, vary: Any) -> tuple[tuple[str, str], list[tuple[float, float]]]:
    """Both parameters and their ranges [SI]."""
    if not isinstance(vary, Mapping) or len(vary) != 2:
        one, two = [*system.values, "name", "other"][:2]
        raise ParameterError(
            lambda say: (
                f"{say.either('sl.bifurcation_curve varies', 'varies')} two parameters: "
                f"{say.key(vary=dict.fromkeys((one, two), (Word('low'), Word('high'))))}, not "
                f"{shown(vary)}."
            )
        )
    one, two = vary
    return (one, two), [range_of(system, name, ends) for name, ends in vary.items()]


def event_orbit(system: System, event: Any) -> EventOrbit:
    """The event, checked."""
    if not isinstance(event, xr.Dataset) or schema.kind_of(event) != schema.BRANCHES:
        raise ParameterError(
            "event must be one of what sl.branches returned: branches.sel(event=0), not "
            f"{shown(event)[:60]}."
        )
    if "event" in event.dims:
        if event.sizes["event"] != 1:
            raise ParameterError(
                f"these branches have {event.sizes['event']} events. Choose one: "
                "branches.sel(event=0)."
            )
        event = event.isel(event=0)
    if event.attrs.get("fingerprint") != system.fingerprint():
        raise ParameterError(
            f"the event is of {event.attrs.get('system')}, whose equations are others than those "
            f"of {system.name}."
        )
    kind = str(event["event_kind"].item())
    if kind not in (*MULTIPLIER, "graze"):
        advice = nearest(kind, (*MULTIPLIER, "graze"))
        raise ParameterError(
            f"a {kind.replace('_', ' ')} can't be followed in two parameters. {advice}"
        )
    guards = [guard.name for guard in system.guards]
    guard = guards.index(str(event["event_guard"].item())) if kind == "graze" else -1
    name = event.attrs["parameter"]
    known = json.loads(event.attrs["parameters"])
    values = {**known, name: float(event[event_name(name)])}
    orbit = np.stack([event[event_name(state)].values for state in system.states], axis=1)
    multipliers = event["event_multiplier_real"].values + 1j * event["event_multiplier_imag"].values
    pairs = multipliers[np.abs(multipliers.imag) > 0]
    multiplier = pairs[np.argmin(np.abs(np.abs(pairs) - 1.0))] if len(pairs) else 1.0 + 0j
    period = float(event["point_period"].values[int(event["event_point"])])
    mine = event["point_branch"].values == int(event["event_branch"])
    along = [event[point_name(state)].values[mine] for state in system.states]
    spread = np.array([np.nanmax(one) - np.nanmin(one) for one in along])
    orbit = orbit[np.isfinite(orbit).all(axis=1)]
    return EventOrbit(
        system.with_values(**values),
        kind,
        orbit,
        period,
        multiplier,
        spread,
        guard,
        float(event["event_phase"]),
    )


def orbits_over(
    start: EventOrbit,
    names: tuple[str, str],
    limits: list[tuple[float, float]],
    method: Method,
    threads: int | None,
) -> tuple[PeriodicOrbits, np.ndarray]:
    """The orbits over two parameters, and the unknowns of the event."""
    system, n = start.system, len(start.orbit)
    period = [start.period / n] if system.forced_at is None else []
    values = [system.values[name] for name in names]
    z = np.array([*start.orbit.ravel(), *period, *values])
    bare = PeriodicOrbits(system, names, n, np.ones((2, len(z))), method, threads)
    numbers = numbers_of(system, [(bare, z)], states_alone(system), method)
    states = np.fmax(units(numbers.maximum[0], numbers.minimum[0]), start.spread)
    spans = [high - low for low, high in limits]
    scale = np.array([*np.tile(np.where(np.isfinite(states), states, 1.0), n), *period, *spans])
    bare.scale = np.stack([scale, scale])
    return bare, z


def equations_at(
    start: EventOrbit, orbits: PeriodicOrbits, z: np.ndarray
) -> tuple[Equations, np.ndarray]:
    """The equations of the bifurcation, and their unknowns."""
    if start.kind != "graze":
        return SingularOrbits.of(orbits, start.kind, z, start.multiplier)
    if not has_legs(orbits.parametric.system):
        raise ParameterError(
            f"{start.system.name} switches at instants, has a remainder or a table of time, or "
            f"more than {MOST_STATES - 2} states: its grazes can't be followed in two parameters."
        )
    found = GrazingOrbits.of(orbits, z, start.guard, start.phase)
    if found is None:
        raise ParameterError(
            "the orbit at the event has a contact that is held: a graze of orbits that stick, rest "
            "or slide can't be followed in two parameters. Choose another event."
        )
    return found


def _table(
    start: EventOrbit,
    names: tuple[str, str],
    limits: list[tuple[float, float]],
    orbits: PeriodicOrbits,
    curve: BifurcationCurve,
    method: Method,
) -> xr.Dataset:
    """The Dataset of a curve."""
    system, size, special, count = (
        start.system,
        len(start.system.states),
        curve.special,
        len(curve.z),
    )
    every = curve.equations.orbit(np.array([*curve.z, *(point.z for point in special)]))
    numbers = numbers_of(system, [(orbits, z) for z in every[:count]], states_alone(system), method)
    states = padded([orbits.points(z) for z in every], size)
    grazes = curve.equations if isinstance(curve.equations, GrazingOrbits) else None
    values = orbits.values(every)
    multipliers = stacked(
        [curve.multipliers, *(point.multipliers[None] for point in special)], size
    )
    data: dict[str, Any] = {
        "point": np.arange(count),
        "point_<parameter>": {name: values[:count, i] for i, name in enumerate(names)},
        "point_arclength": curve.length,
        "point_period": orbits.period(every[:count]),
        "point_peak": numbers.peak[:, 0],
        "point_rms": numbers.rms[:, 0],
        "point_itinerary": ([grazes.itinerary] * count if grazes else list(numbers.itinerary)),
        "point_margin": numbers.margin,
        "point_sqrt_coefficient": (
            grazes.coefficients(curve.z) if grazes else np.full(count, np.nan)
        ),
        "point_multiplier_real": multipliers[:count].real,
        "point_multiplier_imag": multipliers[:count].imag,
        "point_<state>": states[:count],
        "codim2": np.arange(len(special)),
        "codim2_kind": [point.kind for point in special],
        "codim2_point": np.array([point.after for point in special], np.int64),
        "codim2_extremum": ["" if p.extremum < 0 else names[p.extremum] for p in special],
        "codim2_<parameter>": {name: values[count:, i] for i, name in enumerate(names)},
        "codim2_multiplier_real": multipliers[count:].real,
        "codim2_multiplier_imag": multipliers[count:].imag,
        "codim2_<state>": states[count:],
    }
    fixed = {key: value for key, value in system.values.items() if key not in names}
    attrs = provenance(system, method, fixed, names) | {
        "bifurcation": start.kind,
        "periods": orbits.n,
        "begin": curve.ends[0],
        "end": curve.ends[1],
        "guard": system.guards[start.guard].name if grazes else "",
    }
    for axis, name, (low, high) in zip("xy", names, limits, strict=True):
        attrs |= {f"parameter_{axis}": name, f"{axis}_low": low, f"{axis}_high": high}
    when = "at whole forcing periods" if system.forced_at else "in equal steps of time"
    return build(schema.CURVE, subject(system, attrs), data, words={"<when>": when})
