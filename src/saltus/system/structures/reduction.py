"""Modes of a structure, and the flexibility lost by keeping only some of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np

from saltus.errors import ParameterError
from saltus.system.structures.matrices import check_positive, dense, len_of

#: Most degrees of freedom of a structure whose modes are all computed, as dense matrices.
MOST_DENSE = 1500
#: A frequency below this share of the next is that of a rigid body.
RIGID = 1e-7
#: Least square of the share of a static deflection that the modes, and others, miss.
INDEPENDENT = 1e-18
#: Most restarts of Lanczos' method, of which five do for a membrane of 1e5 degrees of freedom.
MOST_RESTARTS = 30
#: Roundings of the largest term that an eigenvalue may be off.
_FEW = 16


@dataclass(frozen=True)
class Modes:
    """The lowest modes of n degrees of freedom.

    Attributes
    ----------
    angular : float64[k]
        Angular natural frequencies [rad/s], ascending.
    shapes : float64[n, k]
        Mode shapes, one each column, of unit modal mass.
    """

    angular: np.ndarray
    shapes: np.ndarray

    def lowest(self, count: int) -> Modes:
        """The lowest ``count`` modes."""
        return Modes(self.angular[:count], self.shapes[:, :count])


def modes_of(mass: Any, stiffness: Any, count: int) -> Modes:
    """The lowest modes, or all of a structure that is small enough to be dense. Degrees of freedom
    without mass follow the others statically.

    Raises
    ------
    ParameterError
        If the mass matrix of the others isn't positive definite (of large ones the diagonal), they
        are fewer than ``count``, the stiffness matrix has a negative eigenvalue, or the modes
        aren't found in :data:`MOST_RESTARTS`.
    """
    heavy = np.ravel(abs(mass).sum(axis=1)) > 0
    number = int(heavy.sum())
    if not number:
        raise ParameterError("all entries of mass are zero. Give the mass matrix.")
    if number < count:
        light = len(heavy) - number
        raise ParameterError(
            f"{light} of {len(heavy)} degrees of freedom have no mass, so there are {number} "
            f"modes: give modes=, at most {number}. Those without mass then follow the others."
        )
    if len_of(mass) <= MOST_DENSE or count > len_of(mass) // 2:
        squares, shapes = _all(dense(mass), dense(stiffness), heavy)
    else:
        squares, shapes = _lowest(mass, stiffness, count)
    noise = _rounding(stiffness, shapes)
    if (squares < -np.maximum(noise, 1e-9 * abs(squares).max())).any():
        _refuse_negative(f"a negative eigenvalue, {squares[0]:.3g} 1/s^2 with respect to mass")
    squares = np.where(np.abs(squares) <= noise, 0.0, squares)
    signs = np.sign(shapes[np.abs(shapes).argmax(axis=0), np.arange(shapes.shape[1])])
    return Modes(np.sqrt(np.maximum(squares, 0.0)), shapes * signs)


def _all(mass: np.ndarray, stiffness: np.ndarray, heavy: np.ndarray) -> tuple[Any, np.ndarray]:
    """All eigenpairs of the degrees of freedom that have mass, and what these leave to the others:
    their static deflections (Guyan, AIAA J. 3 (1965) 380, which without mass is exact).
    """
    from scipy.linalg import LinAlgError, cho_factor, cho_solve, eigh

    light = ~heavy
    follow = np.zeros((len(mass), int(heavy.sum())))
    follow[heavy] = np.eye(follow.shape[1])
    if light.any():
        try:
            held = cho_factor(stiffness[np.ix_(light, light)])
        except LinAlgError:
            _refuse_loose()
        follow[light] = -cho_solve(held, stiffness[np.ix_(light, heavy)])
        stiffness = follow.T @ stiffness @ follow
        stiffness = (stiffness + stiffness.T) / 2
    mass = mass[np.ix_(heavy, heavy)]
    try:
        squares, shapes = eigh(stiffness, mass)
    except LinAlgError:
        check_positive(False, mass)
    return squares, follow @ shapes if light.any() else shapes


def _refuse_loose() -> NoReturn:
    raise ParameterError(
        "some degrees of freedom have no mass, and the stiffness alone doesn't hold them, so they "
        "don't follow the others. Take them out of the matrices."
    )


def _refuse_negative(what: str) -> None:
    raise ParameterError(f"stiffness has {what}: its modes don't vibrate. Leave modes= out.")


def _rounding(stiffness: Any, shapes: np.ndarray) -> np.ndarray:
    """Rounding of the square of each angular frequency: a smaller one is that of a rigid body."""
    sizes = (np.abs(shapes) * (abs(stiffness) @ np.abs(shapes))).sum(axis=0)
    return np.asarray(_FEW * np.finfo(float).eps * sizes)


def _lowest(mass: Any, stiffness: Any, count: int) -> tuple[np.ndarray, np.ndarray]:
    """The lowest eigenpairs of large matrices, by Lanczos' method about a shift below zero, which
    rigid-body modes don't disturb.

    By Sylvester's law of inertia the pivots of the shifted matrix have the signs of its
    eigenvalues, of which Lanczos' method sees only those near the shift.
    """
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import ArpackNoConvergence, LinearOperator, eigsh

    diagonal = mass.diagonal()
    if (diagonal < 0).any():
        i = int(diagonal.argmin())
        raise ParameterError(
            f"mass must be positive definite, but mass[{i}, {i}] = {diagonal[i]:.3g}."
        )
    shift = -1e-3 * abs(stiffness.diagonal()).max() / diagonal.max() / len_of(mass)
    try:
        factors = _factors(stiffness - shift * mass)
    except RuntimeError:  # a pivot is zero, which a shifted stiffness with mass has none of
        _refuse_loose()
    negative = int((factors.U.diagonal() < 0).sum())
    if negative:
        _refuse_negative(f"{negative} negative eigenvalue{'s' * (negative > 1)}")
    inverse = LinearOperator(mass.shape, matvec=factors.solve, dtype=np.float64)
    start = np.random.default_rng(0).normal(size=len_of(mass))
    try:
        squares, shapes = eigsh(
            csc_matrix(stiffness), k=count, M=csc_matrix(mass), sigma=shift, v0=start,
            OPinv=inverse, maxiter=MOST_RESTARTS,
        )  # fmt: skip
    except ArpackNoConvergence as found:
        raise ParameterError(
            f"Lanczos' method found {len(found.eigenvalues)} of the {count} lowest modes in "
            f"{MOST_RESTARTS} restarts: their frequencies lie too close together. Are mass and "
            f"stiffness swapped? The mass comes first, sl.structure(mass, stiffness, ...)."
        ) from None
    order = np.argsort(squares)
    return squares[order], shapes[:, order]


def _factors(matrix: Any) -> Any:
    """Sparse factors of a symmetric positive definite matrix, whose pivots are its diagonal's."""
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import splu

    return splu(
        csc_matrix(matrix), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )


def with_residuals(kept: Modes, mass: Any, stiffness: Any, forces: Sequence[np.ndarray]) -> Modes:
    """Modes, and behind them the static deflections that they miss under some forces, as shapes of
    unit modal mass that no force of inertia or stiffness joins with each other or the modes.

    Raises
    ------
    ParameterError
        If the stiffness matrix is singular: a rigid body moves.
    """
    from scipy.linalg import eigh

    if kept.angular.min() <= RIGID * kept.angular.max():
        raise ParameterError(
            "residual=True needs the static deflection under a force, and a rigid body moves "
            "here. Leave it out."
        )
    pushed = np.stack(forces, axis=1)
    pushed = pushed / np.abs(pushed).max(axis=0)
    missed = _factors(stiffness).solve(pushed)
    size = np.sqrt((missed * (mass @ missed)).sum(axis=0))
    for _ in range(2):
        missed -= kept.shapes @ (kept.shapes.T @ (mass @ missed))
    within = missed.T @ (mass @ missed)
    within /= np.outer(size, size)
    share, ways = np.linalg.eigh(within)  # forces may push alike, or as the modes do already
    span = (missed / size) @ ways[:, share > INDEPENDENT]
    if not span.shape[1]:
        return kept
    span /= np.sqrt((span * (mass @ span)).sum(axis=0))
    squares, turned = eigh(span.T @ (stiffness @ span), span.T @ (mass @ span))
    angular = np.concatenate([kept.angular, np.sqrt(squares)])
    return Modes(angular, np.concatenate([kept.shapes, span @ turned], axis=1))


def flexibility(
    stiffness: Any, modes: Modes, count: int, at: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Static deflection under unit forces, and the part of it that the lowest modes miss.

    Parameters
    ----------
    stiffness : matrix
        Dense or sparse [N/m].
    modes : Modes
        All of them, or those that are kept.
    count : int
        Number of modes kept.
    at : float64[m, n]
        Directions of the forces.

    Returns
    -------
    total : float64[m]
        Deflection along each force [m/N]; inf where a rigid body moves.
    residual : float64[m]
        The part that the other modes would carry.
    """
    first, kept = int((modes.angular <= RIGID * modes.angular.max()).sum()), modes.lowest(count)
    parts = (at @ kept.shapes[:, first:]) ** 2 / kept.angular[first:] ** 2
    moves = np.abs(at @ kept.shapes[:, :first]).max(axis=1, initial=0.0) > RIGID
    if modes.shapes.shape[1] == modes.shapes.shape[0]:
        others = modes.shapes[:, max(count, first) :]
        residual = ((at @ others) ** 2 / modes.angular[max(count, first) :] ** 2).sum(axis=1)
    elif first:
        residual = np.full(len(at), np.nan)  # the others aren't known, and K has no inverse
    else:
        whole = np.einsum("mn,nm->m", at, _factors(stiffness).solve(at.T))
        residual = whole - parts.sum(axis=1)
    total = np.where(moves, np.inf, parts.sum(axis=1) + residual)
    return total, residual


def modal_damping(damping: Any, modes: Modes, count: int) -> np.ndarray:
    """A damping matrix in the coordinates of the kept modes, float64[k, k]."""
    shapes = modes.shapes[:, :count]
    full = shapes.T @ (damping @ shapes)
    # what is left off the diagonal of proportional damping is rounding, and costs a product each
    rounding = np.abs(shapes).T @ (abs(damping) @ np.abs(shapes)) * (8 * len(shapes) * 2.0**-52)
    return np.where(np.abs(full) <= rounding, 0.0, full)
