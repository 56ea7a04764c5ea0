"""Equilibria of systems without forcing: where the field vanishes, by Newton's method on the field
itself, and where they capture.

Stability is that of the linear part: the eigenvalues of the Jacobian, which are the exponents. An
equilibrium captures inside an ellipsoid (x - c)'P(x - c) <= r^2, P from the Lyapunov equation of
the Jacobian, in which the field was seen to point inwards at points on many shells: a check at
points, not a proof. Khalil, Nonlinear Systems (2002), chapter 4.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

from saltus.analysis.closed.capture import RADII, SAFETY, sphere
from saltus.analysis.closed.orbits import OrbitBatch
from saltus.analysis.solve.newton import newton
from saltus.flow.maps import Stroboscope
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr, depends_on
from saltus.system import System

#: Longest step of Newton's method, in units of the scale: the field of a motion that has escaped
#: points anywhere.
FARTHEST_STEP = 1e6
#: Least range of a state that goes on decaying: the square of less is no number.
DECAYED = 1e-150
#: Share of the norm of the Jacobian that a real part must lie below zero: more than rounding.
MARGINAL = 1e-10
#: A constraint that is zero to so small a share of its terms is held.
HELD = 2.0**-46
#: Shells inside the largest one at which the field is looked at.
SHELLS = 0.5 ** np.arange(0.0, 12.0)


def autonomous(system: System) -> bool:
    """Whether nothing in the equations and contacts depends on time, so that equilibria and limit
    cycles may be asked for.
    """
    everything = (*system.field, *(guard.gap for guard in system.guards))
    return system.forced_at is None and not any(
        depends_on(entry, ("time",)) for entry in everything
    )


@dataclass
class Equilibria:
    """What Newton's method found from k states; NaN where it found nothing.

    Attributes
    ----------
    place : float64[k, D]
        Where the field vanishes.
    eigenvalues : complex128[k, D]
        Of the Jacobian there [1/s], the largest real part first.
    reach : float64[k, D, D]
        W with |W (x - place)| <= 1 where it is known to capture; NaN where it isn't stable.
    """

    place: np.ndarray
    eigenvalues: np.ndarray
    reach: np.ndarray

    @property
    def stable(self) -> np.ndarray:
        """Which attract, bool[k]."""
        stable: np.ndarray = np.isfinite(self.reach).all(axis=(1, 2))
        return stable

    @property
    def orbits(self) -> OrbitBatch:
        """They as orbits of one point and of time 0."""
        found = np.isfinite(self.place).all(axis=1)
        result = OrbitBatch.none(*self.place.shape)
        result.period[found], result.time[found] = 1, 0.0
        result.points[:, 0], result.multipliers[:] = self.place, self.eigenvalues
        return result

    def holds(self, states: np.ndarray) -> np.ndarray:
        """Which of states float64[k, D] lie where their equilibrium captures, bool[k]."""
        with np.errstate(invalid="ignore"):
            inside: np.ndarray = (
                np.linalg.norm(np.einsum("kij,kj->ki", self.reach, states - self.place), axis=1)
                <= 1.0
            )
            return inside


def field_of(system: System, states: np.ndarray, values: Mapping[str, np.ndarray]) -> np.ndarray:
    """Rates float64[k, D] at states float64[k, D], with parameter values float64[k] (or one)."""
    return _evaluated(system, system.field, states, values)


def jacobian_of(system: System, states: np.ndarray, values: Mapping[str, np.ndarray]) -> np.ndarray:
    """Derivative of the rates float64[k, D, D]; on a boundary that of the side where its gap isn't
    positive.
    """
    size = len(system.states)
    return _evaluated(
        system, tuple(entry for row in system.jacobian for entry in row), states, values
    ).reshape(len(states), size, size)


def _modes(
    system: System, states: np.ndarray, values: Mapping[str, np.ndarray]
) -> list[np.ndarray]:
    """Sides of the guards at states float64[k, D], and which contacts are held there: those whose
    constraint is zero but for rounding, and whose force is within its limit.
    """
    named = dict(zip(system.states, states.T, strict=True))
    bits = [np.zeros(len(states), bool)] * len(system.guards)

    def at(*entries: Expr) -> np.ndarray:
        found = evaluate(entries, states=named, values=values, bits=bits)
        return np.stack([np.broadcast_to(one, len(states)) for one in found])

    def vanishes(entry: Expr, gradient: Iterable[Expr]) -> np.ndarray:
        value, *slopes = at(entry, *gradient)
        size = sum(np.abs(slope * y) for slope, y in zip(slopes, states.T, strict=True))
        zero: np.ndarray = np.abs(value) <= HELD * size
        return zero

    for number, guard in enumerate(system.guards):
        if guard.law is None or guard.law.kind != "hold":
            bits[number] = at(guard.gap)[0] > 0
    for number, guard in enumerate(system.guards):
        if guard.law is None or guard.law.kind != "hold":
            continue
        owner = guard.law.partner
        law = system.guards[owner].law
        assert law is not None
        assert law.constraint is not None
        held = vanishes(law.constraint, law.normal)
        if law.kind == "impact":
            held &= vanishes(system.guards[owner].gap, system.guard_gradients[owner])
        bits[number] = held & (at(guard.gap)[0] > 0)
    return bits


def _evaluated(
    system: System, entries: tuple[Expr, ...], states: np.ndarray, values: Mapping[str, np.ndarray]
) -> np.ndarray:
    named = dict(zip(system.states, states.T, strict=True))
    bits = _modes(system, states, values)
    with np.errstate(all="ignore"):
        columns = evaluate(entries, states=named, values=values, bits=bits)
    return np.stack(
        [np.broadcast_to(np.asarray(column, float), len(states)) for column in columns], axis=1
    )


def find_equilibria(
    map_: Stroboscope, start: np.ndarray, scale: np.ndarray, captures: bool = True
) -> Equilibria:
    """The equilibria near states float64[k, D] at the parameter values of each row; float64[k, D]
    is the range of each state.

    ``captures``: whether to ask where they capture.
    """
    system, values = map_.system, map_.values
    scale = np.maximum(scale, DECAYED)

    def equations(x: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        mine, unit = {name: column[rows] for name, column in values.items()}, scale[rows]
        derivative = jacobian_of(system, x, mine) * unit[:, None, :] / unit[:, :, None]
        return field_of(system, x, mine) / unit, derivative

    zeros = newton(equations, start, scale, longest_step=FARTHEST_STEP)
    x, found = zeros.z, zeros.found
    place = np.where(found[:, None], x, np.nan)
    eigenvalues = np.full(x.shape, np.nan + 0j)
    reach = np.full((*x.shape, x.shape[1]), np.nan)
    rows = np.flatnonzero(found)
    for i, matrix in zip(
        rows, jacobian_of(system, x[rows], {n: v[rows] for n, v in values.items()}), strict=True
    ):
        if np.isfinite(matrix).all():
            own = np.linalg.eigvals(matrix)
            eigenvalues[i] = own[np.lexsort((-own.imag, -own.real))]
            if captures and eigenvalues[i, 0].real < -MARGINAL * np.linalg.norm(matrix, 2):
                reach[i] = _reach(
                    system, {n: v[[i]] for n, v in values.items()}, x[i], matrix, scale[i]
                )
    return Equilibria(place, eigenvalues, reach)


def _reach(
    system: System,
    values: Mapping[str, np.ndarray],
    place: np.ndarray,
    matrix: np.ndarray,
    scale: np.ndarray,
) -> np.ndarray:
    """W of the largest ellipsoid, of those tried, at whose shells the field points inwards; NaN if
    there is none.
    """
    scaled = matrix * scale / scale[:, None]
    slowest = -float(np.linalg.eigvals(scaled).real.max())
    # contracts at half the slowest rate: fast directions don't flatten it
    shifted = scaled + 0.5 * slowest * np.eye(len(scale))
    try:
        form = solve_continuous_lyapunov(
            shifted.T, -np.eye(len(scale)) * max(slowest, np.finfo(float).tiny)
        )
        root = np.linalg.cholesky(0.5 * (form + form.T)).T
    except (np.linalg.LinAlgError, ValueError):
        return np.full(matrix.shape, np.nan)
    # |root y| >= |y|: inside, no state is farther than the radius
    root = root / np.linalg.norm(root, -2)
    steps = (SHELLS[:, None, None] * (sphere(len(scale)) @ np.linalg.inv(root).T)).reshape(
        -1, len(scale)
    )
    for radius in RADII:
        states = place + radius * steps * scale
        inward = np.einsum(
            "ki,ki->k",
            (states - place) / scale @ (root.T @ root),
            field_of(system, states, values) / scale,
        )
        if (inward < 0).all():
            return np.asarray(SAFETY * root / radius / scale)
    return np.full(matrix.shape, np.nan)
