"""Equilibria of systems without forcing: where the field vanishes, by Newton's method on the field
itself, and where they capture.

Stability is that of the linear part: the eigenvalues of the Jacobian, which are the exponents. An
equilibrium captures inside an ellipsoid (x - c)'P(x - c) <= r^2, P from the Lyapunov equation of
the Jacobian, in which the field was seen to point inwards at points on many shells: a check at
points, not a proof. Khalil, Nonlinear Systems (2002), chapter 4.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

from saltus.analysis.closed.capture import RADII, SAFETY, sphere
from saltus.analysis.closed.motions import ClosedMotions
from saltus.analysis.solve.newton import newton
from saltus.analysis.solve.tolerances import DECAYED
from saltus.flow.maps import Stroboscope
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr, depends_on
from saltus.system import System

#: Longest step of Newton's method, in units of the scale: the field of a motion that has escaped
#: points anywhere.
FARTHEST_STEP = 1e6
#: Share of the norm of the Jacobian that a real part must lie below zero: more than rounding.
MARGINAL = 1e-10
#: A constraint that is zero to so small a share of its terms is held.
HELD = 2.0**-46
#: Shells inside the largest one at which the field is looked at.
SHELLS = 0.5 ** np.arange(0.0, 12.0)


def autonomous(system: System) -> bool:
    """True where nothing in the equations and contacts depends on time: equilibria and limit cycles
    may exist.
    """
    everything = (*system.field, *(guard.gap for guard in system.guards))
    return system.forced_at is None and not any(
        depends_on(entry, ("time",)) for entry in everything
    )


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


def find_equilibria(map_: Stroboscope, start: np.ndarray, scale: np.ndarray) -> ClosedMotions:
    """The equilibria near states float64[k, D] at the parameter values of each row, each a motion
    of one point and of time 0; float64[k, D] is the range of each state.
    """
    system, values, result = map_.system, map_.values, ClosedMotions.none(*start.shape)
    scale = np.maximum(scale, DECAYED)

    def equations(x: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        mine, unit = {name: column[rows] for name, column in values.items()}, scale[rows]
        derivative = jacobian_of(system, x, mine) * unit[:, None, :] / unit[:, :, None]
        return field_of(system, x, mine) / unit, derivative

    zeros = newton(equations, start, scale, longest_step=FARTHEST_STEP)
    found = zeros.found
    result.period[found], result.time[found], result.points[found, 0] = 1, 0.0, zeros.z[found]
    for i, matrix in _jacobians(map_, result):
        eigenvalues = np.linalg.eigvals(matrix)
        result.multipliers[i] = eigenvalues[np.lexsort((-eigenvalues.imag, -eigenvalues.real))]
    return result


def _jacobians(map_: Stroboscope, equilibria: ClosedMotions) -> Iterator[tuple[int, np.ndarray]]:
    """The Jacobian at each equilibrium where it is known, and its row."""
    rows = np.flatnonzero(equilibria.period)
    matrices = jacobian_of(map_.system, equilibria.points[rows, 0], map_.rows(rows).values)
    for row, matrix in zip(rows.tolist(), matrices, strict=True):
        if np.isfinite(matrix).all():
            yield row, matrix


def captured(
    map_: Stroboscope, equilibria: ClosedMotions, state: np.ndarray, scale: np.ndarray
) -> np.ndarray:
    """True where a state of float64[k, D] lies where its equilibrium is known to capture, bool[k];
    float64[k, D] is the range of each state.
    """
    result, scale = np.zeros(len(state), bool), np.maximum(scale, DECAYED)
    for i, matrix in _jacobians(map_, equilibria):
        if equilibria.multipliers[i, 0].real < -MARGINAL * np.linalg.norm(matrix, 2):
            values, place = map_.rows(np.array([i])).values, equilibria.points[i, 0]
            reach = _reach(map_.system, values, place, matrix, scale[i])
            result[i] = np.linalg.norm(reach @ (state[i] - place)) <= 1.0
    return result


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
