"""Points of codimension two on curves of bifurcations, each the zero of a function along it.

On a curve of folds with null vectors v and w, the tangent in the plane of the parameters p is
across ``w'F_p``: each of its components vanishes where the curve has an extremum in the other
parameter, and the ratio of the two where the fold is a cusp. Multipliers that are 1 or -1 besides
the critical one are zeros of symmetric functions of all. A period doubling is degenerate where the
cubic coefficient of its normal form vanishes. Kuznetsov, Elements of Applied Bifurcation Theory
(2004), chapter 9.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from saltus.analysis.branches.arclength import correct, tangents
from saltus.analysis.branches.events import Event
from saltus.analysis.branches.grazing_orbits import GrazingOrbits
from saltus.analysis.branches.singular_orbits import SingularOrbits
from saltus.analysis.branches.special_points import zeros

Equations = SingularOrbits | GrazingOrbits
#: Distance h of the orbits whose differences are third derivatives, in units of the scale: rounding
#: makes an error of 4e-16/h^2, and what the difference leaves out one of h^4/90.
WIDE = 5e-3
#: Share of the largest value of a test below which a change of its sign is rounding.
ROUNDING = 1e-7
#: The multiplier at a cusp is 1 to so much; it is a simple one.
SIMPLE = 1e-8
#: Kinds on the curves of each bifurcation, in the order of the tests; an extremum of folds is
#: ``isola_birth`` or ``branches_join``.
KINDS = {
    "fold": ("extremum", "extremum", "cusp", "resonance_1_1", "fold_flip"),
    "period_doubling": (
        "extremum", "extremum", "resonance_1_2", "fold_flip", "degenerate_doubling",
    ),
    "neimark_sacker": (
        "extremum", "extremum", "resonance_1_3", "resonance_1_4", "fold_neimark_sacker",
        "flip_neimark_sacker",
    ),
    "graze": ("extremum", "extremum", "fold_graze", "flip_graze", "resonant_graze"),
}  # fmt: skip


def tests(
    orbits: Equations,
    rows: np.ndarray,
    z: np.ndarray,
    tangent: np.ndarray,
    derivative: np.ndarray,
    multipliers: np.ndarray,
    side: np.ndarray | None,
) -> tuple[np.ndarray, np.ndarray]:
    """The functions whose zeros are KINDS, float64[tests, p], and the null vectors v and w
    float64[p, 2, size].

    Parameters
    ----------
    orbits : SingularOrbits
        The equations.
    rows : int64[p]
        Which curve each point is of.
    z, tangent, derivative, multipliers
        Of the points.
    side : float64[p, 2, size] or None
        Null vectors on whose side those of the points shall be; None: each on that of the one
        before.
    """
    one, two = orbits.parameters
    if isinstance(orbits, GrazingOrbits):
        products = [
            np.prod(1.0 - multipliers, axis=1).real,
            np.prod(1.0 + multipliers, axis=1).real,
        ]
        along = tangent[:, one], tangent[:, two]
        return np.stack([*along, *products, orbits.coefficients(z)]), np.zeros((len(z), 0))
    mine = derivative[:, : orbits.orbits.n * orbits.orbits.size + orbits.orbits.free]
    along = tangent[:, one], tangent[:, two]
    double = [np.prod(1.0 - multipliers, axis=1).real, np.prod(1.0 + multipliers, axis=1).real]
    if orbits.torus:
        return np.stack([*along, z[:, -1] + 0.5, z[:, -1], *double]), np.zeros((len(z), 0))
    both = np.stack(orbits.null_vectors(z, mine), axis=1)
    both = _same_side(both, side)
    v, w = both[:, 0], both[:, 1]
    more = _derivative_at(multipliers, float(orbits.multiplier or 0.0))
    if orbits.kind == "period_doubling":
        return np.stack([*along, more, double[0], _cubic(orbits, rows, z, mine, v, w)]), both
    slopes = [np.einsum("pi,pi->p", w, mine[:, : orbits.size, column]) for column in (one, two)]
    cusp = along[1] * slopes[0] - along[0] * slopes[1]
    return np.stack([slopes[1], slopes[0], cusp, more, double[1]]), both


def _same_side(vectors: np.ndarray, side: np.ndarray | None) -> np.ndarray:
    """Vectors float64[p, 2, size] on the side of others, or each on that of the one before."""
    if side is not None:
        signs = np.where((vectors * side).sum(axis=2) < 0, -1.0, 1.0)
    else:
        signs = np.ones(vectors.shape[:2])
        signs[1:] = np.where((vectors[1:] * vectors[:-1]).sum(axis=2) < 0, -1.0, 1.0)
        signs = np.cumprod(signs, axis=0)
    return np.asarray(vectors * signs[:, :, None])


def _derivative_at(multipliers: np.ndarray, mu: float) -> np.ndarray:
    """The derivative of the characteristic polynomial: zero where ``mu`` is a double root."""
    factors = mu - multipliers
    parts = [np.prod(np.delete(factors, i, axis=1), axis=1) for i in range(multipliers.shape[1])]
    return np.asarray(np.sum(parts, axis=0).real)


def _cubic(
    orbits: SingularOrbits,
    rows: np.ndarray,
    z: np.ndarray,
    derivative: np.ndarray,
    v: np.ndarray,
    w: np.ndarray,
) -> np.ndarray:
    """The cubic coefficient ``w'(C(v,v,v)/6 + B(v,h))``, ``F_x h = -B(v,v)/2``, of the normal form
    of a period doubling: its sign says on which side orbits of twice the period are born.
    """
    size, width = orbits.size, orbits.orbits.width
    unit = orbits.orbits.scale[rows]
    step = np.zeros((len(z), width))
    step[:, :size] = v * unit[:, :size]
    places = (-2, -1, 1, 2)
    beside = np.concatenate([z[:, :width] + WIDE * place * step for place in places])
    _, matrices = orbits.orbits.evaluate(beside, np.tile(rows, len(places)))
    far_behind, behind, ahead, far_ahead = np.split(matrices, len(places))
    bend = (8.0 * (ahead - behind) - (far_ahead - far_behind)) / (12.0 * WIDE)
    second = (
        16.0 * (ahead + behind) - (far_ahead + far_behind) - 30.0 * derivative[:, :, :width]
    ) / (12.0 * WIDE**2)
    whole = derivative.shape[1]
    right = -0.5 * np.einsum("pij,pj->pi", bend[:, :, :size], v)
    h = np.linalg.solve(derivative[:, :, :whole], right[:, :, None])[:, :, 0]
    terms = np.einsum("pij,pj->pi", second[:, :size, :size], v) / 6.0
    terms += np.einsum("pij,pj->pi", bend[:, :size, :whole], h)
    return np.asarray((w * terms).sum(axis=1))


def find(
    orbits: Equations,
    row: int,
    z: np.ndarray,
    tangent: np.ndarray,
    derivative: np.ndarray,
) -> list[Event]:
    """All points of codimension two on a curve float64[p, z], in its order."""
    rows = np.full(len(z), row)
    multipliers = orbits.multipliers(z, derivative, rows)
    values, sides = tests(orbits, rows, z, tangent, derivative, multipliers, None)
    which, after = np.nonzero(_crosses(values))
    if not len(which):
        return []
    found: dict[int, Event] = {}
    names, local = KINDS[orbits.kind], orbits.at(row, z[after])

    def at(flat: np.ndarray, event: np.ndarray) -> np.ndarray:
        begin = after[event]
        guess = z[begin] + flat[:, None] * tangent[begin] * orbits.scale[row]
        point = correct(local, guess, tangent[begin], event)
        result, good = np.full(len(flat), np.nan), np.flatnonzero(point.found)
        if not len(good):
            return result
        way = tangents(point.derivative[good], tangent[begin[good]])
        multipliers = local.multipliers(point.z[good], point.derivative[good], event[good])
        tested, _ = tests(
            local,
            event[good],
            point.z[good],
            way,
            point.derivative[good],
            multipliers,
            sides[begin[good]],
        )
        result[good] = tested[which[event[good]], np.arange(len(good))]
        for place, i in enumerate(good):
            kind = int(which[event[i]])
            extreme = kind if kind < 2 else -1
            found[int(event[i])] = Event(
                names[kind], int(begin[i]), point.z[i], multipliers[place], extremum=extreme
            )
        return result

    step = (z[after + 1] - z[after]) / orbits.scale[row]
    places = zeros(at, np.einsum("ki,ki->k", step, tangent[after]))
    found = {i: point for i, point in found.items() if np.isfinite(places[i]) and _resolved(point)}
    order = sorted(found, key=lambda i: (found[i].after, _ahead(z, tangent, orbits, row, found[i])))
    return [_named(orbits, row, found[i]) for i in order]


def _resolved(point: Event) -> bool:
    """False if a point is a cusp that is only rounding. Next to a graze of a rigid stop the map
    bends without bound, and its derivatives are noise.
    """
    if point.kind != "cusp":
        return True
    return bool(np.abs(point.multipliers - 1.0).min() < SIMPLE)


def _crosses(values: np.ndarray) -> np.ndarray:
    """Between which points tests float64[tests, p] change their sign by more than rounding."""
    size = np.abs(values)
    largest = size.max(axis=1, keepdims=True)
    largest[:2] = largest[:2].max()  # of one vector
    ends = np.maximum(size[:, 1:], size[:, :-1])
    crosses: np.ndarray = (values[:, 1:] * values[:, :-1] < 0) & (ends > ROUNDING * largest)
    return crosses


def _ahead(z: np.ndarray, tangent: np.ndarray, orbits: Equations, row: int, point: Event) -> float:
    step = (point.z - z[point.after]) / orbits.scale[row]
    return float(step @ tangent[point.after])


def _named(orbits: Equations, row: int, point: Event) -> Event:
    """An extremum of folds by what happens to the branches over the other parameter.

    There they cross at a point, F restricted to both null directions is a quadratic form, and the
    branches next to it are closed curves around the point if it is definite.
    """
    if not isinstance(orbits, SingularOrbits) or orbits.kind != "fold" or point.kind != "extremum":
        return point
    size, width = orbits.size, orbits.orbits.width
    one = np.array([row])
    other = orbits.parameters[1 - point.extremum]
    columns = [*range(size), other]
    z = point.z[None, :width]
    _, derivative = orbits.orbits.evaluate(z, one)
    left, _, right = np.linalg.svd(derivative[0][:, columns])
    w, spans = left[:, -1], np.zeros((2, width))
    spans[:, columns] = right[-2:]
    bends = [orbits.bend(z, one, span[None])[0] for span in spans]
    form = np.array([[w @ bend @ span for span in spans] for bend in bends])
    return replace(point, kind="isola_birth" if np.linalg.det(form) > 0 else "branches_join")
