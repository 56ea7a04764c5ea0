"""Curves of bifurcations in two parameters, in both directions from a bifurcation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from saltus.analysis.branches.arclength import Arc, both_sides, follow, tangents
from saltus.analysis.branches.codimension_two import Equations, find
from saltus.analysis.branches.events import Event
from saltus.analysis.branches.grazing_orbits import GrazingOrbits
from saltus.analysis.branches.singular_orbits import COSINES, SingularOrbits


@dataclass
class BifurcationCurve:
    """A curve of bifurcations of one kind.

    Attributes
    ----------
    equations : SingularOrbits or GrazingOrbits
        Its equations.
    z : float64[p, z]
        Its points.
    length : float64[p]
        Arclength from its first point, in units of the scale.
    multipliers : complex128[p, D]
        Floquet multipliers, without a trivial one.
    ends : (str, str)
        Why it ends at its first and at its last point: see :class:`Arc`; ``resonance_1_1`` and
        ``resonance_1_2`` where the multipliers of a torus meet; of a graze also
        ``double_graze``, ``graze_corner`` and ``degenerate_graze``, and ``contacts_change``.
    special : list of Event
        In its order.
    complete : bool
        False if Ctrl-C ended it: its ends are ``interrupted``, or its special points aren't known.
    """

    equations: Equations
    z: np.ndarray
    length: np.ndarray
    multipliers: np.ndarray
    ends: tuple[str, str]
    special: list[Event] = field(default_factory=list)
    complete: bool = True


def trace_curve(
    equations: Equations,
    start: np.ndarray,
    limits: Sequence[tuple[float, float]],
    points: int,
    progress: Callable[[float], None] | None = None,
) -> BifurcationCurve | None:
    """The curve through a bifurcation; None if none is found there. On Ctrl-C what is known of it,
    with ``complete`` False.

    Parameters
    ----------
    equations : SingularOrbits or GrazingOrbits
        Over the two parameters; its two rows have the same scale.
    start : float64[z]
        The bifurcation.
    limits : two (float, float)
        Ranges of the parameters.
    points : int
        Most points in each direction.
    progress : callable, optional
        Called with the share of them that was reached.
    """
    rows = np.arange(2)
    both = np.repeat(start[None], 2, axis=0)
    equations.begin(both, rows)
    derivative = equations.evaluate(both[:1], rows[:1])[1]
    if not np.isfinite(derivative).all():
        return None
    along = tangents(derivative, np.ones((1, both.shape[1])))[0]
    bounds = {**dict(zip(equations.parameters, limits, strict=True)), **equations.bounds}
    beyond: dict[int, np.ndarray] = {}
    reached = 0

    def watch(curve: Arc) -> str:
        nonlocal reached
        reached = max(reached, len(curve.z))
        if progress is not None:
            progress(min(reached / points, 1.0))
        why = equations.why_virtual(curve.z[-1]) if isinstance(equations, GrazingOrbits) else ""
        if why:
            beyond[id(curve)] = curve.z[-1]
        return why

    curves: list[Arc] = []
    try:
        follow(
            equations,
            both,
            np.stack([along, -along]),
            bounds,
            points,
            ends=watch,
            group=0 * rows,
            curves=curves,
        )
    except KeyboardInterrupt:
        if not all(curve.z for curve in curves) or not curves:
            raise
        for curve in curves:
            curve.end = curve.end or "interrupted"
        return _joined(equations, curves, complete=False)
    if not curves[0].z or not curves[1].z:
        return None
    if isinstance(equations, GrazingOrbits):
        for curve in curves:
            if curve.end == "contacts_change":
                _end_at_double(equations, curve, beyond[id(curve)])
    return _joined(equations, curves)


def _end_at_double(equations: GrazingOrbits, curve: Arc, beyond: np.ndarray) -> None:
    """End a curve of grazes at the second graze behind its last point, if that is why it ends."""
    z = equations.double(curve.z[-1], beyond)
    if z is None:
        return
    derivative = equations.evaluate(z[None], np.zeros(1, np.int64))[1]
    apart = np.linalg.norm((z - curve.z[-1]) / equations.scale[0])
    curve.tangent.append(tangents(derivative, curve.tangent[-1][None])[0])
    curve.z.append(z)
    curve.derivative.append(derivative[0])
    curve.length.append(curve.length[-1] + float(apart))
    curve.end = "double_graze"


def _joined(equations: Equations, curves: list[Arc], complete: bool = True) -> BifurcationCurve:
    """One curve from those in both directions; its special points are looked for if these are
    ``complete``.
    """
    for curve in curves:
        curve.end = _end(equations, curve)
    (whole, *back), ends = both_sides(curves)
    whole = whole.behind(back[0]) if back else whole
    z, tangent, derivative = (np.array(part) for part in (whole.z, whole.tangent, whole.derivative))
    length = np.array(whole.length) - whole.length[0]
    multipliers = equations.multipliers(z, derivative, np.zeros(len(z), np.int64))
    special: list[Event] = []
    try:
        special = find(equations, 0, z, tangent, derivative) if complete else []
    except KeyboardInterrupt:
        complete = False
    doubles = [
        Event("double_graze", place, z[place], multipliers[place])
        for place, end in zip((0, len(z) - 1), ends, strict=True)
        if end == "double_graze"
    ]
    special = sorted([*special, *doubles], key=lambda point: point.after)
    return BifurcationCurve(equations, z, length, multipliers, ends, special, complete)


def _end(equations: Equations, curve: Arc) -> str:
    """Reason why a curve ends."""
    if not isinstance(equations, SingularOrbits) or not equations.torus or curve.end != "range":
        return curve.end
    cosine = curve.z[-1][-1]
    if cosine >= COSINES[1]:
        return "resonance_1_1"
    return "resonance_1_2" if cosine <= COSINES[0] else curve.end
