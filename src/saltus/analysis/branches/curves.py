"""Curves of bifurcations in two parameters, in both directions from a bifurcation."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from saltus.analysis.branches.arclength import Curve, follow, tangents
from saltus.analysis.branches.codimension_two import CodimensionTwo, find, multipliers
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.branches.singular_orbits import COSINES, SingularOrbits


@dataclass
class BifurcationCurve:
    """A curve of bifurcations of one kind.

    Attributes
    ----------
    orbits : SingularOrbits
        The equations.
    z : float64[p, z]
        Its points.
    length : float64[p]
        Arclength from its first point, in units of the scale.
    multipliers : complex128[p, D]
        Floquet multipliers, without a trivial one.
    ends : (str, str)
        Why it ends at its first and at its last point: see :class:`Curve`; ``resonance_1_1`` and
        ``resonance_1_2`` where the multipliers of a torus meet.
    special : list of CodimensionTwo
        In its order.
    """

    orbits: SingularOrbits
    z: np.ndarray
    length: np.ndarray
    multipliers: np.ndarray
    ends: tuple[str, str]
    special: list[CodimensionTwo] = field(default_factory=list)

    @property
    def values(self) -> np.ndarray:
        """The two parameters, float64[p, 2]."""
        return self.orbits.orbits.values(self.z[:, : self.orbits.orbits.width])


def trace_curve(
    orbits: PeriodicOrbits,
    kind: str,
    start: np.ndarray,
    multiplier: complex,
    limits: Sequence[tuple[float, float]],
    points: int,
    progress: Callable[[float], None] | None = None,
) -> BifurcationCurve | None:
    """The curve through a bifurcation; None if none is found there.

    Parameters
    ----------
    orbits : PeriodicOrbits
        Over the two parameters; its two rows have the same scale.
    kind : str
        Of the bifurcation.
    start : float64[z]
        The orbit there.
    multiplier : complex
        The one on the unit circle.
    limits : two (float, float)
        Ranges of the parameters.
    points : int
        Most points in each direction.
    progress : callable, optional
        Called with the share of them that was reached.
    """
    singular, rows = SingularOrbits(orbits, kind), np.arange(2)
    both = np.repeat(start[None], 2, axis=0)
    orbits.accepted(both, rows)
    if singular.torus:
        cosine = np.clip(multiplier.real / abs(multiplier), *COSINES)
        both = np.append(both, np.full((2, 1), cosine), axis=1)
    singular.begin(both, rows)
    derivative = singular.evaluate(both[:1], rows[:1])[1]
    if not np.isfinite(derivative).all():
        return None
    along = tangents(derivative, np.ones((1, both.shape[1])))[0]
    bounds = dict(zip(singular.parameters, limits, strict=True))
    if singular.torus:
        bounds[orbits.width] = COSINES

    reached = 0

    def watch(curve: Curve) -> str:
        nonlocal reached
        reached = max(reached, len(curve.z))
        if progress is not None:
            progress(min(reached / points, 1.0))
        return ""

    curves = follow(
        singular, both, np.stack([along, -along]), bounds, points, ends=watch, group=0 * rows
    )
    if not curves[0].z or not curves[1].z:
        return None
    return _joined(singular, curves)


def _joined(singular: SingularOrbits, curves: list[Curve]) -> BifurcationCurve:
    """One curve from those in both directions."""
    ahead, back = curves
    closed = [row for row, curve in enumerate(curves) if curve.end == "closed"]
    if closed:
        whole, ends = curves[closed[0]], ("closed", "closed")
    else:
        whole = Curve(
            back.z[:0:-1] + ahead.z,
            [-tangent for tangent in back.tangent[:0:-1]] + ahead.tangent,
            back.derivative[:0:-1] + ahead.derivative,
            [-length for length in back.length[:0:-1]] + ahead.length,
        )
        ends = (_end(singular, back), _end(singular, ahead))
    z, tangent, derivative = (np.array(part) for part in (whole.z, whole.tangent, whole.derivative))
    length = np.array(whole.length) - whole.length[0]
    own = multipliers(singular, z, derivative, np.zeros(len(z), np.int64))
    special = find(singular, 0, z, tangent, derivative)
    return BifurcationCurve(singular, z, length, own, ends, special)


def _end(singular: SingularOrbits, curve: Curve) -> str:
    """Why a curve ends."""
    if not singular.torus or curve.end != "range":
        return curve.end
    cosine = curve.z[-1][-1]
    if cosine >= COSINES[1]:
        return "resonance_1_1"
    return "resonance_1_2" if cosine <= COSINES[0] else curve.end
