"""Eigenvalues and eigenvectors of the matrix of a contact state."""

from __future__ import annotations

import numpy as np

#: Rounding of an eigenvalue, in units of the largest.
ROUNDING = 64 * 2.220446049250313e-16
#: Eigenvalues, eigenvectors, and the inverse of these.
Eigen = tuple[np.ndarray, np.ndarray, np.ndarray]
#: Rounds in which the modes of a structure are corrected for its damping; each leaves a share of
#: the error as large as the damping ratio.
MOST_ROUNDS = 24
#: Least frequency of a mode over the largest, and over its own rate, for these rounds.
SLOWEST, UNDAMPED = 1e-6, 1e-2
#: Least ((C_ii l + K_ii + l^2) over the larger of its terms by which an entry of an eigenvector is
#: made anew.
CLEAR = 1e-2
#: Most that the product of eigenvectors and their inverse differs from 1 before it is corrected.
MOST_ERROR = 1e-9


def half_of(matrix: np.ndarray) -> Eigen:
    """One of each pair of eigenvalues, ascending by size, their eigenvectors, and the rows of the
    inverse.
    """
    found = _of_structure(matrix)
    return one_of_each_pair(eigen_of(matrix)) if found is None else found


def slots_of(values: np.ndarray) -> np.ndarray:
    """Indices of one of each pair of complex eigenvalues and of all real ones, ascending by
    size.
    """
    kept = np.flatnonzero(values.imag >= 0)
    return kept[np.argsort(np.abs(values[kept]), kind="stable")]


def one_of_each_pair(eigen: Eigen) -> Eigen:
    """Half of what :func:`eigen_of` gives: the other modes are the conjugates of these."""
    values, vectors, inverse = eigen
    slots = slots_of(values)
    return values[slots], vectors[:, slots], inverse[slots]


def both_of_each_pair(half: Eigen) -> Eigen:
    """All modes of those that :func:`one_of_each_pair` keeps."""
    values, _, inverse = half
    pairs = np.flatnonzero(values.imag > 0)
    return (
        np.concatenate([values, values[pairs].conj()]),
        vectors_of_each_pair(half),
        np.concatenate([inverse, inverse[pairs].conj()]),
    )


def vectors_of_each_pair(half: Eigen) -> np.ndarray:
    """All eigenvectors of those that :func:`one_of_each_pair` keeps."""
    values, vectors, _ = half
    return np.concatenate([vectors, vectors[:, values.imag > 0].conj()], axis=1)


def eigen_of(matrix: np.ndarray) -> Eigen:
    """Eigenvalues, eigenvectors and the inverse of these, large where they coincide."""
    values, vectors = np.linalg.eig(matrix)
    inverse = _real_inverse(values, vectors)
    if inverse is not None:
        return values, vectors, inverse
    size = np.maximum(np.abs(vectors).max(axis=1, keepdims=True), ROUNDING)
    left, parts, right = np.linalg.svd(vectors / size)
    least = np.maximum(parts, ROUNDING * parts[0])
    return values, vectors, (right.conj().T / least) @ left.conj().T / size.T


def _real_inverse(values: np.ndarray, vectors: np.ndarray) -> np.ndarray | None:
    """The inverse of eigenvectors of a real matrix, computed by their real and imaginary parts,
    four times as cheap; None if they nearly coincide.
    """
    pairs = np.flatnonzero(values.imag > 0)  # LAPACK has the conjugate behind each
    parts = vectors.real.copy()
    parts[:, pairs + 1] = vectors[:, pairs].imag
    try:
        back = np.linalg.inv(parts)
    except np.linalg.LinAlgError:
        return None
    # of columns that are 1 at most
    losses = np.abs(parts).max(axis=0, initial=0.0) * np.abs(back).max(axis=1, initial=0.0)
    if not losses.max(initial=0.0) < 1 / ROUNDING:
        return None
    back += back @ (np.eye(len(parts)) - parts @ back)
    inverse = back.astype(complex)
    inverse[pairs] = (back[pairs] - 1j * back[pairs + 1]) / 2
    inverse[pairs + 1] = inverse[pairs].conj()
    return inverse


# -- structures --------------------------------------------------------------------------------
def _of_structure(matrix: np.ndarray) -> Eigen | None:
    """The same of ``x'' = -K x - C x'`` with symmetric matrices and light damping, ten times as
    cheap: eigenvectors of K are corrected for C, and give the inverse too. None for others.

    With K and C in the basis of those eigenvectors, ``(l^2 + C_ii l + K_ii) u_i = -sum (l C_ik +
    K_ik) u_k`` over the other k: fixed-point iteration from the i-th unit vector, for all modes at
    once. What rounding has left of K beside its diagonal is corrected as well, so that low modes
    are as exact as high ones.
    """
    size = len(matrix) // 2
    stiffness, damping = -matrix[size:, :size], -matrix[size:, size:]
    if (
        not size
        or len(matrix) != 2 * size
        or matrix[:size, :size].any()
        or (matrix[:size, size:] != np.eye(size)).any()
        or not _is_symmetric(stiffness)
        or not _is_symmetric(damping)
    ):
        return None
    _, basis = np.linalg.eigh(stiffness)
    found = _damped(basis.T @ stiffness @ basis, basis.T @ damping @ basis)
    if found is None:
        return None
    values, within = found
    shapes = _refined(stiffness, damping, values, basis @ within)
    vectors = np.concatenate([shapes, shapes * values])
    inverse = np.concatenate([shapes * values + damping @ shapes, shapes])
    inverse = (inverse / (inverse * vectors).sum(axis=0)).T
    # of real and imaginary parts: V L + conj(V L) = 1
    parts = np.concatenate([vectors.real, vectors.imag], axis=1)
    back = np.concatenate([2 * inverse.real, -2 * inverse.imag])
    error = np.eye(2 * size) - parts @ back
    if not np.abs(error).max(initial=0.0) <= MOST_ERROR:
        return None
    back += back @ error
    inverse = (back[:size] - 1j * back[size:]) / 2
    order = np.argsort(np.abs(values), kind="stable")
    return values[order], vectors[:, order], inverse[order]


def _refined(
    stiffness: np.ndarray, damping: np.ndarray, values: np.ndarray, shapes: np.ndarray
) -> np.ndarray:
    """Eigenvectors whose small entries are as exact as large ones: each entry is what its row of
    the equations makes of the others, where that isn't nearly 0/0.
    """
    own, rate = np.diag(stiffness)[:, None], np.diag(damping)[:, None]
    beside = np.concatenate([stiffness, damping]) - np.concatenate(
        [np.diag(own[:, 0]), np.diag(rate[:, 0])]
    )
    held, lost = (beside @ shapes.view(float)).view(complex).reshape(2, *shapes.shape)
    divisor = own + values * (values + rate)
    clear = np.abs(divisor) > CLEAR * np.maximum(own, np.abs(values) ** 2)
    return np.where(clear, -(held + values * lost) / np.where(clear, divisor, 1.0), shapes)


def shared_of(matrix: np.ndarray, modes: Eigen) -> tuple[np.ndarray, np.ndarray] | None:
    """Factors s of the left vectors s (l u + C u, u) of modes (u, l u), complex128[M], and the
    damping, float64[M], if it couples no coordinates and all modes are of this form; else None.
    """
    values, vectors, inverse = modes
    size = len(values)
    if len(vectors) != 2 * size or not np.array_equal(vectors[:size] * values, vectors[size:]):
        return None
    damping = -matrix[size:, size:]
    rate = np.diag(damping).copy()
    left = np.concatenate([vectors[size:] + rate[:, None] * vectors[:size], vectors[:size]]).T
    scale = 1.0 / (left * vectors.T).sum(axis=1)
    wrong = np.abs(left * scale[:, None] - inverse).max(axis=1)
    alike = wrong <= MOST_ERROR * np.abs(inverse).max(axis=1)
    return (scale, rate) if alike.all() and (damping == np.diag(rate)).all() else None


def _is_symmetric(matrix: np.ndarray) -> bool:
    """True if a matrix is symmetric to rounding of the terms of each entry: in one of energy these
    are no larger than the root of the two entries on the diagonal.
    """
    size = np.sqrt(np.abs(np.diag(matrix)))
    return bool((np.abs(matrix - matrix.T) <= ROUNDING * np.outer(size, size)).all())


def _damped(stiffness: np.ndarray, damping: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Eigenvalues with positive imaginary part, and eigenvectors, for matrices that are nearly
    diagonal; None if they aren't found.
    """
    size = len(stiffness)
    own, rate = np.diag(stiffness), np.diag(damping)
    beside = np.concatenate([stiffness - np.diag(own), damping - np.diag(rate)])
    within = np.eye(size, dtype=complex)
    with np.errstate(all="ignore"):
        weight = np.sqrt(np.maximum(own[:, None] / own, 1.0))
        for _ in range(MOST_ROUNDS):
            held, lost = (beside @ within.view(float)).view(complex).reshape(2, size, size)
            half = (rate + np.diag(lost)) / 2
            root = np.sqrt(half**2 - own - np.diag(held))
            values = np.where(root.imag > 0, root, -root) - half
            if not _is_clear(values):
                return None
            pushed = held + values * lost
            new = np.where(
                pushed == 0, 0, pushed / (-own[:, None] - values * (values + rate[:, None]))
            )
            np.fill_diagonal(new, 1.0)
            change = (np.abs(new - within) * weight).max()
            within = new
            if change <= ROUNDING / 8:
                return values, within
    return None


def _is_clear(values: np.ndarray) -> bool:
    """True if all modes vibrate."""
    sizes = np.abs(values)
    return bool((values.imag > UNDAMPED * sizes).all() and sizes.min() > SLOWEST * sizes.max())
