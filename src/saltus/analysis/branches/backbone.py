"""`backbone`: frequency of free undamped vibration over its amplitude."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.branches.arclength import Curve, correct, follow
from saltus.analysis.branches.branch_table import numbers_of, stacked
from saltus.analysis.branches.free_vibration import (
    FreeOrbits,
    free_system,
    linear_mode,
    place_of_rest,
)
from saltus.analysis.branches.special_points import zeros
from saltus.analysis.dataset_parts import provenance, subject
from saltus.analysis.outputs import outputs_of
from saltus.analysis.starts import check_system, single
from saltus.analysis.verb import verb
from saltus.errors import ParameterError, UnitError, among, nearest, shown
from saltus.flow.counts import whole
from saltus.flow.methods import Method, check_method
from saltus.flow.progress import reporting
from saltus.results import build
from saltus.results.dataset import schema
from saltus.system.system import System
from saltus.units import to_si

#: Vibrations begin at this share of the smallest amplitude.
BEFORE = 0.9
#: Largest fictitious damping, in units of the frequency, that is rounding.
CONSERVED = 1e-7
#: A vibration is stable if no multiplier is larger than this.
STABLE = 1.0 + 1e-6
#: A state whose amplitude is a smaller share of the largest rests.
NODE = 1e-9
#: Periods of small vibrations within which a motion returns: where it rests on a contact, small
#: vibrations to its other side are slower.
LONGEST = 12.0
#: Shortest period, as a share of that of small vibrations.
SHORTEST = 1e-3
#: How far behind its last step the end of a range may lie, in units of the scale.
BEHIND = 0.02


@verb
def backbone(
    system: System,
    amplitude: Any,
    *,
    state: str | None = None,
    mode: int = 1,
    values: Mapping[str, Any] | None = None,
    points: int = 400,
    method: Method | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """Free vibrations without damping over their amplitude: the backbone of the resonances, or a
    nonlinear normal mode.

    The family of periodic orbits is followed by pseudo-arclength from small vibrations about rest.
    Parameters that are zero are taken out of the equations; what then still forces or damps is
    refused.

    Parameters
    ----------
    system : System
        With displacements and velocities.
    amplitude : (low, high)
        Range of the largest magnitude of ``state``: numbers [SI], or texts with a unit.
    state : str, optional
        Default the first state. A velocity reaches beyond an amplitude that rigid stops bound.
    mode : int
        Which mode of small vibrations to begin with, the slowest first, from 1.
    values : mapping
        Values of parameters: the force and all that damps are to be zero, such as ``{"force": 0,
        "damping_ratio": 0}``; ``{"restitution": 1}`` for impacts.
    points : int
        Most points.
    method : Method
        Default :class:`saltus.Taylor`; another one must be exact.
    threads : int, optional
        Default all processors.
    progress : bool or callable
        Default: a bar on the terminal if the work lasts more than two seconds.

    Returns
    -------
    Dataset
        Dims ``point``, ``output`` (the states), ``multiplier``. ``backbone_frequency`` [Hz],
        ``point_period`` [s], ``point_output_peak`` and so on of each state, ``point_<state>`` where
        the vibration passes its rest, ``point_itinerary``, ``point_stable``, multipliers, and
        ``fictitious_damping`` [1/s], which is rounding. The first and the last point have the
        amplitudes asked for; attribute ``end`` says ``points`` or ``lost`` otherwise.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used, time or damping is left in the equations, or small vibrations
        don't lead to the smallest amplitude.

    References
    ----------
    Kerschen et al., Mech. Syst. Signal Process. 23 (2009) 170-194; Munoz-Almaraz et al., Physica D
    181 (2003) 1-38.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a")
    >>> free = {"force": 0, "damping_ratio": 0}
    >>> spine = sl.backbone(rig, ("0.1 mm", "2 mm"), values=free)
    >>> f"{spine.backbone_frequency.values[-1]:.9f} Hz"
    '11.420668320 Hz'
    """
    check_system(system)
    method = check_method(method)
    if not method.exact:
        raise ParameterError(
            f"sl.backbone needs a method whose errors are rounding, not {method.name}. Leave "
            "method= out."
        )
    for name, value in (values or {}).items():
        single(system, name, value)
    system = system.with_values(**(values or {}))
    state = system.states[0] if state is None else state
    if not among(state, system.states):
        raise ParameterError(
            f"{system.name} has no state {shown(state)}. {nearest(state, system.states)}"
        )
    low, high = _range(system, state, amplitude)
    points, mode = whole(points, "points", 2), whole(mode, "mode", 1)
    free, name = free_system(system)
    with reporting(progress) as show:
        rest = place_of_rest(free)
        period, shape, column = linear_mode(free, rest, mode)
        measured = system.states.index(state)
        sizes = np.abs(shape)
        if not sizes[measured] > NODE * sizes.max():
            raise ParameterError(f"{state} is at rest in mode {mode}. Choose another state=.")
        sizes = np.where(sizes > NODE * sizes.max(), sizes, sizes.max()) / sizes[measured]
        scale = np.array([[*high * sizes, period, 1 / period]])
        orbits = FreeOrbits(free, name, scale, method, rest, column, threads)
        begin = rest + BEFORE * low * shape.real / np.abs(shape[measured])
        _, swing = orbits.first_return(begin, LONGEST * period)
        begin = rest + (begin - rest) * BEFORE * low / swing[measured]
        z = np.array([[*begin, orbits.first_return(begin, LONGEST * period)[0], 0.0]])
        if not np.isfinite(z).all():
            raise ParameterError(
                f"small vibrations of {system.name} in mode {mode} don't return to where they "
                "began: choose a smaller amplitude to begin with, or another mode=."
            )
        peak = _Peak(free, orbits, method, measured)
        whole_z, end = _family(orbits, z, peak, (low, high), points, show)
        return _table(system, free, orbits, whole_z, method, end, state, mode)


def _range(system: System, state: str, given: Any) -> tuple[float, float]:
    """The amplitudes [SI]."""
    unit = system.units.get(state, "")
    try:
        low, high = (to_si(end, unit, "amplitude") for end in given)
    except UnitError:
        raise
    except (TypeError, ValueError):
        raise ParameterError(
            f'amplitude= must be (low, high), such as ("0.1 mm", "5 mm"), not {shown(given)}.'
        ) from None
    if not 0 < low < high < np.inf:
        raise ParameterError(f"amplitude= must ascend from above zero, not {shown(given)}.")
    return low, high


class _Peak:
    """Largest magnitude of a state of orbits float64[r, z]."""

    def __init__(self, free: System, orbits: FreeOrbits, method: Method, state: int) -> None:
        self.free, self.orbits, self.method, self.state = free, orbits, method, state

    def __call__(self, z: np.ndarray) -> np.ndarray:
        pairs = [(self.orbits, one) for one in z]
        numbers = numbers_of(self.free, pairs, outputs_of(self.free, None), self.method)
        return np.asarray(numbers.peak[:, self.state])


def _family(
    orbits: FreeOrbits,
    z: np.ndarray,
    peak: _Peak,
    limits: tuple[float, float],
    points: int,
    progress: Callable[[float], None] | None,
) -> tuple[np.ndarray, str]:
    """The orbits between two amplitudes, these included, and why they end."""
    along, reached = np.zeros(z.shape), 0.0
    states = slice(0, orbits.size)
    along[0, states] = (z[0, states] - orbits.phase[0, 0]) / orbits.scale[0, states]
    along /= np.linalg.norm(along)
    z = correct(orbits, z, along, np.zeros(1, np.int64)).z

    def ends(curve: Curve) -> str:
        nonlocal reached
        size = float(peak(curve.z[-1][None])[0])
        reached = max(reached, min(size / limits[1], 1.0))
        if progress is not None:
            progress(reached)
        return "range" if size > limits[1] else ""

    (curve,) = follow(
        orbits, z, along, {orbits.size: (SHORTEST * z[0, -2], np.inf)}, points, ends=ends
    )
    if len(curve.z) < 2:
        raise ParameterError(
            f"no periodic vibration of {orbits.system.name} was found below the smallest "
            "amplitude: begin with a smaller one."
        )
    found, tangent = np.array(curve.z), np.array(curve.tangent)
    sizes = peak(found)
    if not sizes[0] < limits[0] <= sizes.max():
        raise ParameterError(
            f"the amplitude of free vibrations of {orbits.system.name} goes from {sizes[0]:.4g} to "
            f"{sizes.max():.4g}: amplitude= must begin between."
        )
    first = int(np.argmax(sizes >= limits[0]))
    step = (found[first] - found[first - 1]) / orbits.scale[0] @ tangent[first - 1]
    last = curve.end == "range"
    begin, wanted = np.array([first - 1, len(found) - 1]), np.array(limits)
    exact: dict[int, np.ndarray] = {}

    def at(flat: np.ndarray, which: np.ndarray) -> np.ndarray:
        mine = begin[which]
        guess = found[mine] + flat[:, None] * tangent[mine] * orbits.scale
        point = correct(orbits, guess, tangent[mine], 0 * which)
        exact.update({int(i): one for i, one in zip(which, point.z, strict=True)})
        return np.where(point.found, peak(point.z) - wanted[which], np.nan)

    places = zeros(at, np.array([step, BEHIND])[: 1 + last])
    rows = [exact[0], *found[first:]] if np.isfinite(places[0]) else [*found[first:]]
    if last and np.isfinite(places[1]):
        rows.append(exact[1])
    return np.array(rows), curve.end


def _table(
    system: System,
    free: System,
    orbits: FreeOrbits,
    z: np.ndarray,
    method: Method,
    end: str,
    state: str,
    mode: int,
) -> xr.Dataset:
    """The Dataset of a family."""
    period, damping = orbits.period(z), z[:, -1]
    if np.abs(damping * period).max() > CONSERVED:
        raise ParameterError(
            f"{system.name} doesn't conserve energy: its vibrations need a damping of "
            f"{damping[np.argmax(np.abs(damping))]:.3g} /s to close. Set what damps to zero by "
            'values=, and the restitution of impacts to 1: values={"damping": 0, "restitution": 1}.'
        )
    outputs = outputs_of(free, None)
    numbers = numbers_of(free, [(orbits, one) for one in z], outputs, method)
    rows = np.zeros(len(z), np.int64)
    own = stacked([orbits.multipliers(z, orbits.evaluate(z, rows)[1], rows)], orbits.size)
    by_name = numbers.by_name()
    data: dict[str, Any] = {
        "point": np.arange(len(z)),
        "backbone_frequency": 1 / period,
        "point_period": period,
        "point_stable": np.nanmax(np.abs(own), axis=1) < STABLE,
        "point_itinerary": list(numbers.itinerary),
        "point_multiplier_real": own.real,
        "point_multiplier_imag": own.imag,
        "fictitious_damping": damping,
        "point_<state>": orbits.points(z)[:, 0],
        "output": list(outputs.names),
        "output_units": list(outputs.units),
        **{
            f"point_output_{key}": by_name[key] for key in ("maximum", "minimum", "peak", "rms")
        },
    }  # fmt: skip
    attrs = provenance(system, method, system.values) | {
        "mode": mode, "amplitude_of": state, "end": end,
    }  # fmt: skip
    unit = outputs.units[0] if len(set(outputs.units)) == 1 else ""
    return build(schema.BACKBONE, subject(system, attrs), data, words={"<output>": unit})
