"""Matrices of a structure, dense or sparse: their checks and factorisations."""

from __future__ import annotations

from typing import Any

import numpy as np

from saltus.errors import ParameterError, must_be

#: Largest asymmetry of a symmetric matrix, as a share of its largest entry: rounding of a sum.
ASYMMETRY = 1e-10
#: Most degrees of freedom of sparse matrices.
MOST_DEGREES = 10_000_000


def is_sparse(matrix: Any) -> bool:
    """True if this is a SciPy sparse matrix or array."""
    return hasattr(matrix, "tocsr") and hasattr(matrix, "nnz")


def checked(matrix: Any, name: str, size: int | None = None, symmetric: bool = False) -> Any:
    """A matrix as float64, dense or CSR as it was given.

    Raises
    ------
    ParameterError
        If it isn't a square matrix of finite real numbers, of another size than the mass matrix, or
        not symmetric where it must be.
    """
    if is_sparse(matrix):
        if max(matrix.shape) > MOST_DEGREES:
            raise ParameterError(
                f"{name} has the shape {matrix.shape}, and at most {MOST_DEGREES} degrees of "
                f"freedom can be reduced."
            )
        square: Any = matrix.tocsr()
        entries = square.data
    else:
        try:
            square = entries = np.asarray(matrix)
        except ValueError:  # rows of different lengths
            raise must_be(name, "a square matrix", matrix) from None
    if entries.dtype.kind not in "fiu":
        raise ParameterError(f"{name} must hold real numbers, not {entries.dtype}.")
    if square.ndim != 2 or square.shape[0] != square.shape[1] or not square.shape[0]:
        ratio = " Of a ratio write damping_ratio=." if name == "damping" and not square.ndim else ""
        raise ParameterError(f"{name} must be a square matrix; its shape is {square.shape}.{ratio}")
    if size is not None and len_of(square) != size:
        raise ParameterError(
            f"{name} is {square.shape[0]} x {square.shape[0]}, but mass is {size} x {size}."
        )
    if not np.isfinite(entries).all():
        _refuse_strange(square, name)
    square = square.astype(np.float64)
    if symmetric:
        _check_symmetric(square, name)
    return square


def _refuse_strange(matrix: Any, name: str) -> None:
    """Raise a ParameterError that says where the first number is that isn't finite."""
    from scipy.sparse import find

    rows, columns, entries = find(matrix)
    strange = np.flatnonzero(~np.isfinite(entries))
    i, j = min((int(rows[k]), int(columns[k])) for k in strange)
    raise ParameterError(
        f"{name}[{i}, {j}] = {matrix[i, j]:g} isn't finite"
        + (f", and {len(strange) - 1} more aren't." if len(strange) > 1 else ".")
    )


def _check_symmetric(matrix: Any, name: str) -> None:
    from scipy.sparse import tril

    apart = abs(matrix - matrix.T)
    if apart.max() > ASYMMETRY * abs(matrix).max():
        place = apart.argmax()
        i, j = (int(k) for k in np.unravel_index(int(place), matrix.shape))
        half = any(abs(tril(one, -1)).max() == 0 for one in (matrix, matrix.T))
        raise ParameterError(
            f"{name} must be symmetric, but {name}[{i}, {j}] = {matrix[i, j]:g} and "
            f"{name}[{j}, {i}] = {matrix[j, i]:g}."
            + half
            * f" It holds one triangle: give {name} + {name}.T - diag({name})."
        )


def len_of(matrix: Any) -> int:
    """Number of rows."""
    return int(matrix.shape[0])


def dense(matrix: Any) -> np.ndarray:
    """A matrix as an array."""
    return matrix.toarray() if is_sparse(matrix) else np.asarray(matrix)


def inverse_of_mass(mass: Any) -> np.ndarray:
    """The inverse of a mass matrix by Cholesky's factors, symmetric; float64[n, n].

    Raises
    ------
    ParameterError
        If it isn't positive definite.
    """
    full = dense(mass)
    diagonal = np.diag(full)
    check_positive(diagonal.min() > 0, full)
    if np.count_nonzero(full) == len(full):
        return np.diag(1.0 / diagonal)
    from scipy.linalg import LinAlgError, cho_factor, cho_solve

    try:
        factor = cho_factor(full, lower=True)
    except LinAlgError:
        check_positive(False, full)
    inverse = cho_solve(factor, np.eye(len(full)))
    return np.asarray((inverse + inverse.T) / 2)


def check_positive(holds: bool, mass: np.ndarray) -> None:
    """Raise a ParameterError for a mass matrix that isn't positive definite."""
    if not holds:
        smallest = float(np.linalg.eigvalsh(mass)[0])
        light = not mass.any(axis=1).all()
        raise ParameterError(
            f"mass must be positive definite, but its smallest eigenvalue is {smallest:.3g}."
            + light
            * " Degrees of freedom without mass, rows of zeros, follow the others with modes=."
        )
