"""`backbone`: frequency of free undamped vibration over its amplitude."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.branches.arclength import Arc, correct, follow
from saltus.analysis.branches.backbone_table import Orbits, backbone_dataset
from saltus.analysis.branches.branch_table import numbers_of
from saltus.analysis.branches.forced_vibration import Forcing, QuadratureOrbits, small_vibration
from saltus.analysis.branches.free_harmonics import BesideFamily, begun
from saltus.analysis.branches.free_vibration import (
    LONGEST,
    FreeOrbits,
    equilibrium_near_zero,
    free_system,
    linear_mode,
)
from saltus.analysis.branches.special_points import zeros
from saltus.analysis.harmonics.balance import HarmonicBalance, check_backbone
from saltus.analysis.inputs.given import Range, Value
from saltus.analysis.inputs.outputs import outputs_of
from saltus.analysis.inputs.starts import at_values, check_system
from saltus.analysis.inputs.verb import verb
from saltus.errors import ParameterError, UnitError, must_be, shown
from saltus.flow.counts import whole
from saltus.flow.methods import Method, exact_method
from saltus.flow.progress import reporting
from saltus.language.derivatives import gradient
from saltus.language.evaluate import evaluate
from saltus.system import System
from saltus.system.modes import sides
from saltus.system.quantity import formula_of, unit_of
from saltus.units import to_si

#: Vibrations begin at this share of the smallest amplitude.
BEFORE = 0.9
#: A state whose amplitude is a smaller share of the largest rests.
NODE = 1e-9
#: Shortest period, as a share of that of small vibrations.
SHORTEST = 1e-3
#: Distance behind its last step at which the end of a range may lie, in units of the scale.
BEHIND = 0.02


@verb
def backbone(
    system: System,
    amplitude: Range,
    *,
    state: str | None = None,
    mode: int = 1,
    phase: str = "free",
    force: str = "force",
    values: Mapping[str, Value] | None = None,
    points: int = 400,
    method: Method | None = None,
    by: HarmonicBalance | None = None,
    threads: int | None = None,
    progress: bool | Callable[[float], None] | None = None,
) -> xr.Dataset:
    """The backbone of the resonances over their amplitude: free vibrations without damping
    (nonlinear normal modes), or forced ones in phase quadrature, damping included.

    1. Free vibrations: parameters that are zero are taken out of the equations; what then still
       forces or damps is refused. Orbits come in families then, and one of the equations that close
       them follows from the others. A fictitious damping is one more unknown, which makes them
       independent; it vanishes on the family.
    2. In quadrature the forcing frequency and the amplitude of the force are unknowns, such that
       the mean of displacement times force over a period is zero: the displacement's first harmonic
       lags a harmonic force by a quarter of the period.
    3. The chosen mode of small vibrations about the equilibrium gives the first orbit, below the
       smallest amplitude, as there the equations are linear unless a contact is near.
    4. Newton's method closes it, and the family is followed by pseudo-arclength continuation until
       it exceeds the largest amplitude; frequency and amplitude may both turn back on the way.
    5. The first and the last point are moved along the family to exactly the amplitudes asked for.

    Parameters
    ----------
    system : System
        With displacements and velocities.
    amplitude : (low, high)
        Range of the largest magnitude of ``state``: numbers [SI], or texts with a unit.
    state : str, optional
        A state, or of free vibrations an output; default the first state. A velocity reaches beyond
        an amplitude that rigid stops bound.
    mode : int
        Which mode of small vibrations to begin with, the slowest first, from 1.
    phase : {"free", "quadrature"}
        Free vibrations, or forced ones in quadrature.
    force : str
        In quadrature: the parameter that is the amplitude of the force.
    values : mapping
        Values of parameters: the force and all that damps are to be zero, such as ``{"force": 0,
        "damping_ratio": 0}``; ``{"restitution": 1}`` for impacts.
    points : int
        Most points.
    method : Method
        Default :class:`saltus.Taylor`, or :class:`saltus.Modal` from eight states on where
        it serves; another one must be exact.
    by : HarmonicBalance, optional
        Motions of a few harmonics in place of exact ones, each held against the exact one of its
        size.
    threads : int, optional
        Default all processors.
    progress : bool or callable
        Default: a bar on the terminal if the work lasts more than two seconds.

    Returns
    -------
    Dataset
        Dims ``point``, ``output`` (the states and outputs), ``multiplier``.
        ``backbone_frequency`` [Hz], ``point_period`` [s], ``point_output_peak`` and so on of each
        output, ``point_<state>`` where the vibration passes its rest (in quadrature: at whole
        forcing periods),
        ``point_itinerary``, ``point_stable``, multipliers, and ``fictitious_damping`` [1/s], which
        is rounding; in quadrature ``point_<parameter>`` of the frequency and the force. The first
        and the last point have the amplitudes asked for; attribute ``end`` says ``points`` or
        ``lost`` otherwise.

    Raises
    ------
    ParameterError, UnitError
        If an argument can't be used, time or damping is left in the equations of free vibrations,
        or small vibrations don't lead to the smallest amplitude.

    References
    ----------
    Kerschen et al., Mech. Syst. Signal Process. 23 (2009) 170-194; Munoz-Almaraz et al., Physica D
    181 (2003) 1-38; Peeters et al., Mech. Syst. Signal Process. 25 (2011) 1227-1247 (quadrature).

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
    method, system = exact_method(method, system, "sl.backbone"), at_values(system, values)
    state = system.states[0] if state is None else state
    low, high = _range(unit_of(system, state), amplitude)
    measured = outputs_of(system).names.index(state)
    if phase == "quadrature" and state not in system.states:
        raise ParameterError(
            lambda say: f"{say.key('state')} is a state in quadrature, and {state!r} is an output."
        )
    points, mode = whole(points, "points", 2), whole(mode, "mode", 1)
    if phase not in ("free", "quadrature"):
        raise ParameterError(
            lambda say: f'{say.key("phase")} is "free" or "quadrature", not {shown(phase)}.'
        )
    about = Forcing.of(system, force, state) if phase == "quadrature" else None
    if by is not None:
        check_backbone(by, system)
    with reporting(progress) as show:
        start: tuple[System, Orbits, np.ndarray] = (
            _free_start(system, (low, high), mode, state, method, threads)
            if about is None
            else _forced_start(system, about, (low, high), mode, measured, method, threads)
        )
        moving, orbits, z = start
        if by is not None and not isinstance(orbits, BesideFamily):
            orbits, z = begun(orbits, by.count, z)
        peak = _Peak(moving, orbits, method, measured)
        whole_z, end = _family(orbits, z, peak, (low, high), points, show)
        # not "mode": SciPy's netCDF-3 keeps its own there, and neither writes nor reads such a file
        attrs = {"vibration_mode": mode, "amplitude_of": state, "end": end, "phase": phase}
        return backbone_dataset(system, moving, orbits, whole_z, method, attrs)


def _free_start(
    system: System,
    limits: tuple[float, float],
    mode: int,
    state: str,
    method: Method,
    threads: int | None,
) -> tuple[System, FreeOrbits, np.ndarray]:
    """The undamped system, the equations of its vibrations, and a small one float64[1, z]."""
    low, high = limits
    free, name = free_system(system)
    equilibrium = equilibrium_near_zero(free)
    period, shape, column = linear_mode(free, equilibrium, mode)
    slopes = _slopes(free, state, equilibrium)
    sizes, size = _relative(shape, slopes, state, mode), np.abs(slopes @ shape)
    scale = np.array([[*high * sizes, period, 1 / period]])
    orbits = FreeOrbits(free, name, scale, method, equilibrium, column, threads)
    begin, largest = (
        equilibrium + BEFORE * low * shape.real / size,
        np.argmax(np.abs(slopes * shape)),
    )
    _, swing = orbits.first_return(begin, LONGEST * period)
    begin = (
        equilibrium
        + (begin - equilibrium) * BEFORE * low * np.abs(shape[largest]) / size / swing[largest]
    )
    z = np.array([[*begin, orbits.first_return(begin, LONGEST * period)[0], 0.0]])
    if not np.isfinite(z).all():
        raise ParameterError(
            lambda say: (
                f"small vibrations of {system.name} in mode {mode} don't return to where they "
                "began: choose a smaller amplitude to begin with, or another "
                f"{say.key('mode')}."
            )
        )
    return free, orbits, z


def _forced_start(
    system: System,
    force: Forcing,
    limits: tuple[float, float],
    mode: int,
    measured: int,
    method: Method,
    threads: int | None,
) -> tuple[System, QuadratureOrbits, np.ndarray]:
    """The system, the equations of its vibrations in quadrature, and a small one float64[1, z]."""
    low, high = limits
    equilibrium, shape, z = small_vibration(system, force, mode, measured, BEFORE * low, method)
    own = z[-2:]
    slopes = np.eye(len(shape))[measured]
    sizes = high * _relative(shape, slopes, system.states[measured], mode)
    scale = np.array([[*sizes, own[0], own[1] * high / (BEFORE * low)]])
    drive = np.abs(force.harmonics(system, own[0])[force.row])
    unit = sizes[force.displacement] * drive * system.period({str(system.forced_at): own[0]})
    orbits = QuadratureOrbits(system, force, scale, unit, equilibrium, method, threads)
    return system, orbits, z[None]


def _slopes(system: System, name: str, rest: np.ndarray) -> np.ndarray:
    """Derivatives of a state or an output with respect to the states, where the system rests,
    float64[D].
    """
    formula, guards = formula_of(system, name)
    about: dict[str, Any] = {
        "states": dict(zip(system.states, rest, strict=True)), "values": system.values,
    }  # fmt: skip
    bits = sides(system, 0.0, rest)
    for guard in guards[len(bits) :]:
        bits.append(evaluate([guard.gap], **about, bits=bits)[0] > 0)
    return np.array(evaluate(gradient(formula, system.states), **about, bits=bits), float)


def _relative(shape: np.ndarray, slopes: np.ndarray, name: str, mode: int) -> np.ndarray:
    """Amplitudes of the states in units of that of a state or an output with these slopes; of those
    at rest the largest.
    """
    sizes, size = np.abs(shape), np.abs(slopes @ shape)
    if not size > NODE * sizes.max() * np.linalg.norm(slopes):
        raise ParameterError(
            lambda say: f"{name} is at rest in mode {mode}. Choose another {say.key('state')}."
        )
    sizes = np.where(sizes > NODE * sizes.max(), sizes, sizes.max()) / size
    return np.asarray(sizes)


def _range(unit: str, given: Any) -> tuple[float, float]:
    """The amplitudes [SI]."""
    try:
        low, high = (to_si(end, unit, "amplitude") for end in given)
    except UnitError:
        raise
    except (TypeError, ValueError):
        raise must_be("amplitude", '(low, high), such as ("0.1 mm", "5 mm")', given) from None
    if not 0 < low < high < np.inf:
        raise ParameterError(f"amplitude must ascend from above zero, not {shown(given)}.")
    return low, high


class _Peak:
    """Largest magnitude of a state of orbits float64[r, z]."""

    def __init__(self, moving: System, orbits: Orbits, method: Method, state: int) -> None:
        self.moving, self.orbits, self.method, self.state = moving, orbits, method, state

    def __call__(self, z: np.ndarray) -> np.ndarray:
        pairs = [(self.orbits, one) for one in z]
        numbers = numbers_of(self.moving, pairs, outputs_of(self.moving, None), self.method)
        return np.asarray(numbers.peak[:, self.state])


def _family(
    orbits: Orbits,
    z: np.ndarray,
    peak: _Peak,
    limits: tuple[float, float],
    points: int,
    progress: Callable[[float], None] | None,
) -> tuple[np.ndarray, str]:
    """The orbits between two amplitudes, these included, and why they end."""
    along, reached = np.zeros(z.shape), 0.0
    states = slice(0, orbits.size)
    along[0, states] = (z[0, states] - orbits.rest) / orbits.scale[0, states]
    along /= np.linalg.norm(along)
    z = correct(orbits, z, along, np.zeros(1, np.int64)).z

    def ends(curve: Arc) -> str:
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
            lambda say: (
                f"the amplitude of free vibrations of {orbits.system.name} goes from "
                f"{sizes[0]:.4g} to {sizes.max():.4g}: {say.key('amplitude')} must begin between."
            )
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
