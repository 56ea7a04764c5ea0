"""Bifurcations along a branch: where they are, to the last digits, and whether they explain every
change of stability.

Each kind is the zero of a function of the orbit alone; a zero between two points of a branch is
found by a bracketing method in arclength, at orbits that are closed by Newton's method, so it is
the solution of the defining system and no interpolation; a fold by Newton's method on that system.
Chandrupatla, Adv. Eng. Softw. 28 (1997) 145.
Kuznetsov, Elements of Applied Bifurcation Theory (2004), chapter 10.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from scipy.optimize import elementwise

from saltus.analysis.branches.arclength import correct, tangents
from saltus.analysis.branches.equations import OrbitEquations
from saltus.analysis.branches.events import Event
from saltus.analysis.solve.linear import solutions, solved
from saltus.analysis.solve.newton import newton
from saltus.flow.polynomials import between

#: Tests in the order in which they are made.
KINDS = ("fold", "branch_point", "period_doubling", "neimark_sacker")
#: The first of them that asks for multipliers.
BY_MULTIPLIERS = 2
#: A pair of multipliers whose imaginary part is smaller than this share of its size is real: two
#: real ones whose product is one are no bifurcation.
COMPLEX = 1e-7
#: Distance of a multiplier from the unit circle within which it isn't counted.
ON_CIRCLE = 1e-9
#: Length of the last step of Newton's method at a branch point, in units of the scale.
CONVERGED = 1e-11
#: Distance of two derivatives whose difference is their slope, in units of the scale.
ASIDE = 1e-5
#: Steps of Newton's method towards a fold, at most.
MOST_STEPS = 8
#: A point nearer than this to the next place that is tried foretells the point there better than
#: the cubic through the ends of the step, as a share of its length.
BESIDE = 0.02
#: Closeness of a zero of a test, and of one from where Newton's method leads to a branch point: the
#: root of a determinant is nearly a jump there, which takes a bisection. Shares of the place.
CLOSE, NEARBY = 1e-14, 1e-2
#: Farthest that a branch point lies from where it was seen, in units of the scale.
FARTHEST = 0.3


def tests(
    tangent: np.ndarray, derivative: np.ndarray, multipliers: np.ndarray, column: int
) -> np.ndarray:
    """The functions whose zeros are the bifurcations KINDS, float64[4, p], from points of curves.

    Parameters
    ----------
    tangent : float64[p, m + 1]
        Unit tangents along the curve.
    derivative : float64[p, m, m + 1]
        Of the equations.
    multipliers : complex128[p, D]
        Without a trivial one.
    column : int
        The unknown that is the parameter.
    """
    whole = np.concatenate([derivative, tangent[:, None]], axis=1)
    sign, size = np.linalg.slogdet(whole)
    width = whole.shape[1]
    ones = np.ones(len(multipliers))
    pairs = ones.copy()
    count = multipliers.shape[1]
    for i in range(count):
        for j in range(i + 1, count):
            pairs = pairs * (multipliers[:, i] * multipliers[:, j] - 1.0)
    return np.stack(
        [
            tangent[:, column],
            sign * np.exp(size / width),
            np.prod(1.0 + multipliers, axis=1).real,
            pairs.real if count > 1 else ones,
        ]
    )


class _Steps:
    """Steps along curves, over each of which a test vanishes.

    Parameters
    ----------
    orbits, rows, z, tangent, kind
        See :func:`locate`.
    """

    def __init__(
        self, orbits: OrbitEquations, rows: np.ndarray, z: np.ndarray, tangent: np.ndarray,
        kind: np.ndarray,
    ) -> None:  # fmt: skip
        self.scale, self.kind, self.column = orbits.scale[rows], kind, z.shape[2] - 1
        self.step, self.z = (z[:, 1] - z[:, 0]) / self.scale, z[:, 0]
        self.orbits, self.rows = orbits.near(self.z, rows), np.arange(len(rows))
        self.tangent, beyond = tangent.swapaxes(0, 1)
        self.length = self.along(self.step)
        # slopes by the share of the step along the first tangent
        self.first = self.length[:, None] * self.tangent
        self.last = (self.length / self.along(beyond))[:, None] * beyond
        #: the latest point that was tested of each
        self.known: dict[int, Event] = {}

    def along(self, way: np.ndarray, which: np.ndarray | None = None) -> np.ndarray:
        """The part of ways float64[r, m + 1] along the first tangents."""
        tangent = self.tangent if which is None else self.tangent[which]
        return np.asarray(np.einsum("ei,ei->e", way, tangent))

    def ahead(self, share: np.ndarray, which: np.ndarray) -> np.ndarray:
        """Points on the cubics through the ends of steps int64[r], at shares of them."""
        step, first, last = self.step[which], self.first[which], self.last[which]
        far = between(np.zeros_like(step), step, first, last, share[:, None])
        return np.asarray(self.z[which] + far * self.scale[which])

    def at(self, flat: np.ndarray, which: np.ndarray) -> np.ndarray:
        """The tests of steps int64[r] at lengths float64[r] along the first tangents."""
        guess = self.ahead(flat / self.length[which], which)
        for i, one in enumerate(which.tolist()):
            if (near := self.known.get(one)) is None:
                continue
            far = flat[i] - (near.z - self.z[one]) / self.scale[one] @ self.tangent[one]
            if abs(far) < BESIDE * self.length[one]:
                way = near.tangent / (near.tangent @ self.tangent[one])
                guess[i] = near.z + far * way * self.scale[one]
        return self.tested(guess, which)

    def tested(self, guess: np.ndarray, which: np.ndarray) -> np.ndarray:
        """The tests of steps int64[r] at the orbits across the first tangents from guesses, NaN
        where there is none.
        """
        mine, orbits = self.rows[which], self.orbits
        point = correct(orbits, guess, self.tangent[which], mine)
        derivative = np.where(point.found[:, None, None], point.derivative, 0.0)
        direction = tangents(derivative, self.tangent[which])
        values = np.full(len(which), np.nan)
        asks = self.kind[which] >= BY_MULTIPLIERS
        for some in (np.flatnonzero(point.found & asks), np.flatnonzero(point.found & ~asks)):
            if len(some):
                multipliers = (
                    orbits.multipliers(point.z[some], derivative[some], mine[some])
                    if asks[some[0]]
                    else np.zeros((len(some), 0), complex)
                )
                each = tests(direction[some], derivative[some], multipliers, self.column)
                values[some] = each[self.kind[which[some]], np.arange(len(some))]
        for i in np.flatnonzero(point.found).tolist():
            name, none = KINDS[self.kind[which[i]]], np.zeros(0)
            self.known[int(which[i])] = Event(
                name, -1, point.z[i], none, direction[i], derivative[i]
            )
        return values

    def folds(self) -> tuple[np.ndarray, np.ndarray]:
        """The steps in which Newton's method finds a fold, which is tested, int64[r], and where."""
        which = np.flatnonzero(self.kind == KINDS.index("fold"))
        share = _turn(*(one[which, self.column] for one in (self.step, self.first, self.last)))
        z, good = _folds(
            self.orbits, self.ahead(share, which), self.tangent[which], self.rows[which]
        )
        far = self.along((z - self.z[which]) / self.scale[which], which)
        good &= (far >= 0) & (far <= self.length[which])
        self.tested(z[good], which[good])
        return which[good], far[good]


def locate(
    orbits: OrbitEquations,
    rows: np.ndarray,
    z: np.ndarray,
    tangent: np.ndarray,
    kind: np.ndarray,
    values: np.ndarray,
) -> list[Event | None]:
    """The zeros of tests between points and the next ones.

    Parameters
    ----------
    orbits : OrbitEquations
        The equations.
    rows : int64[e]
        Which of its curves.
    z, tangent : float64[e, 2, m + 1]
        The points before and behind.
    kind : int64[e]
        Which test.
    values : float64[e, 2]
        Its values there.
    """
    if not len(rows):
        return []
    steps, roots = _Steps(orbits, rows, z, tangent, kind), np.full(len(rows), np.nan)
    which, places = steps.folds()
    roots[which] = places
    crossed = kind == KINDS.index("branch_point")

    def bracket(which: np.ndarray, close: float) -> None:
        roots[which] = zeros(
            lambda flat, some: steps.at(flat, which[some]),
            steps.length[which],
            values[which],
            close,
        )

    bracket(np.flatnonzero(np.isnan(roots) & ~crossed), CLOSE)
    bracket(np.flatnonzero(crossed), NEARBY)
    result: list[Event | None] = [None] * len(rows)
    known, near = steps.known, steps.orbits
    found = [i for i in sorted(known) if np.isfinite(roots[i])]
    if found:
        ends, matrices = (
            np.array([getattr(known[i], one) for i in found]) for one in ("z", "derivative")
        )
        each = near.multipliers(ends, matrices, steps.rows[found])
        for place, multipliers in zip(found, each, strict=True):
            result[place] = replace(known[place], multipliers=multipliers)

    def crossing(i: int) -> Event | None:
        guess = z[i, 0] + 0.5 * steps.first[i] * steps.scale[i]
        return _branch_point(near, i, known[i].z if i in known else guess, tangent[i, 0])

    for i in np.flatnonzero(crossed).tolist():
        result[i] = crossing(i)
        if result[i] is None:
            bracket(np.array([i]), CLOSE)
            result[i] = crossing(i)
    return result


def _turn(rise: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """The share of a step at which a cubic turns back, from its rise and its slopes at the ends,
    which have different signs; a half where rounding has given them the same.
    """
    bend, twist = 3.0 * rise - 2.0 * first - last, first + last - 2.0 * rise
    square = bend**2 - 3.0 * twist * first
    share = -first / (bend - np.sign(first) * np.sqrt(np.maximum(square, 0.0)))
    return np.where(square >= 0.0, share, 0.5)


def _folds(
    orbits: OrbitEquations, guess: np.ndarray, along: np.ndarray, rows: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The folds near points float64[r, m + 1] of curves int64[r], and where one was found, bool[r].

    Newton's method on ``F = 0, g = 0``: g is the last entry of the null vector v of the derivative
    J whose product with ``along`` is one. Its derivative is -w'(dJ/dv), where w solves the adjoint
    equations, so that J a short way along v is all that is needed besides. Kuznetsov, section
    10.2.1.
    """
    if not len(rows):
        return guess, np.zeros(0, bool)

    def equations(z: np.ndarray, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        mine = rows[which]
        residual, derivative = orbits.evaluate(z, mine)
        whole = np.concatenate([derivative, along[which, None]], axis=1)
        last = np.zeros(z.shape)
        last[:, -1] = 1.0
        null, adjoint = solved(whole, last), solved(whole.swapaxes(1, 2), last)
        beside = orbits.evaluate(z + ASIDE * null * orbits.scale[mine], mine)[1]
        bend = np.einsum("rm,rmi->ri", adjoint[:, :-1], derivative - beside) / ASIDE
        rows_of_all = np.concatenate([derivative, bend[:, None]], axis=1)
        return np.append(residual, null[:, -1:], axis=1), rows_of_all

    found = newton(
        equations, guess, orbits.scale[rows], enough=CONVERGED, foresee=True, max_steps=MOST_STEPS
    )
    return found.z, found.found


def zeros(
    at: Callable[[np.ndarray, np.ndarray], np.ndarray],
    length: np.ndarray,
    ends: np.ndarray | None = None,
    close: float = CLOSE,
) -> np.ndarray:
    """Places at which functions of a distance vanish between 0 and float64[e], NaN where none is
    found: ``at`` gives their values at float64[r] for the functions int64[r], and is called at the
    zeros last. ``ends``: their values at 0 and there float64[e, 2], if they are known. ``close``:
    how close the places are, as a share of them.
    """
    if not len(length):
        return length
    which = np.arange(len(length))

    def values(step: np.ndarray, event: np.ndarray) -> np.ndarray:
        flat, some = step.ravel(), event.astype(np.int64).ravel()
        if ends is None:
            return at(flat, some).reshape(step.shape)
        found = np.where(flat == 0, ends[some, 0], ends[some, 1])
        inside = np.flatnonzero((flat != 0) & (flat != length[some]))
        if len(inside):
            found[inside] = at(flat[inside], some[inside])
        return np.asarray(found.reshape(step.shape))

    root = elementwise.find_root(
        values,
        (np.zeros(len(length)), length),
        args=(which.astype(float),),
        tolerances={"xrtol": close, "xatol": 1e-15, "fatol": 0.0, "frtol": 0.0},
        maxiter=60,
    )
    at(root.x, which)
    return np.asarray(root.x)


def _branch_point(
    orbits: OrbitEquations, row: int, start: np.ndarray, along: np.ndarray
) -> Event | None:
    """The point near another at which two branches cross; None if none is found.

    There the null vectors of the derivative J span a plane, and Newton's method on F alone fails;
    on ``F + b w = 0, g = 0`` it doesn't: w is the left null vector at the start, and g the two
    numbers with ``J v + g w = 0`` for the vectors v that span the plane, as they are given by those
    that do at the start. As for :func:`_folds`, J a short way along both is all that is needed
    besides. Govaerts, Numerical Methods for Bifurcations of Dynamical Equilibria (2000), section
    4.1; Kuznetsov, section 10.5.2.
    """
    unit, one = orbits.scale[row], np.array([row])
    size = len(start)
    _, derivative = orbits.evaluate(start[None], one)
    if not np.isfinite(derivative).all():
        return None
    left, _, right = np.linalg.svd(derivative[0])
    border = np.zeros((size + 1, size + 1))
    border[: size - 1, size], border[size - 1 :, :size] = left[:, -1], right[-2:]

    def equations(x: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        z, b, whole, last = x[0, :size], x[0, size], border.copy(), np.eye(size + 1)[:, -2:]
        ends, matrices = orbits.evaluate(z[None], one)
        whole[: size - 1, :size] = matrices[0]
        plane, adjoint = (solutions(each[None], last[None])[0] for each in (whole, whole.T))
        along_both = z + ASIDE * plane[:size].T * unit
        beside = orbits.evaluate(along_both, np.repeat(one, 2))[1] - matrices
        rows_of_all = border.copy()
        rows_of_all[: size - 1, :size] = matrices[0]
        rows_of_all[size - 1 :, :size] = -adjoint[: size - 1, -1] @ beside / ASIDE
        return np.concatenate([ends[0] + b * left[:, -1], plane[size]])[None], rows_of_all[None]

    zeros = newton(
        equations,
        np.append(start, 0.0)[None],
        np.append(unit, 1.0)[None],
        enough=CONVERGED,
        longest_step=np.inf,
    )
    z = zeros.z[0, :size]
    if not zeros.found[0]:
        return None
    if np.linalg.norm((z - start) / unit) > FARTHEST:
        return None
    derivative = orbits.evaluate(z[None], one)[1]
    spans = np.linalg.svd(derivative[0])[2][-2:]
    direction = spans.T @ (spans @ along)
    direction /= np.linalg.norm(direction)
    multipliers = orbits.multipliers(z[None], derivative, one)[0]
    return Event("branch_point", -1, z, multipliers, direction, derivative[0])


def outside(multipliers: np.ndarray) -> np.ndarray:
    """Number of multipliers outside the unit circle: beyond +1, beyond -1, and in complex pairs,
    int64[p, 3].
    """
    size, real = np.abs(multipliers), np.abs(multipliers.imag) <= COMPLEX * np.abs(multipliers)
    far = size > 1.0 + ON_CIRCLE
    return np.stack(
        [
            (far & real & (multipliers.real > 0)).sum(axis=1),
            (far & real & (multipliers.real < 0)).sum(axis=1),
            (far & ~real).sum(axis=1),
        ],
        axis=1,
    )


def unstable(
    multipliers: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray],
    z: np.ndarray,
    derivative: np.ndarray,
    rows: np.ndarray,
) -> np.ndarray:
    """True for orbits float64[r, z] that don't attract, bool[r]; ``multipliers``: those of
    equations.
    """
    return np.asarray(outside(multipliers(z, derivative, rows)).any(axis=1))
