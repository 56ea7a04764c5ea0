"""Floquet multipliers of an orbit from the tangent maps of its parts."""

from __future__ import annotations

import numpy as np

from saltus.analysis.solve.newton import leading_first


def across(matrix: np.ndarray, flow: np.ndarray, there: np.ndarray | None = None) -> np.ndarray:
    """A tangent map float64[D, D] across the flow, float64[D - 1, D - 1].

    ``flow`` is that at the start, ``there`` that at the end, if it is another one.
    """
    ahead = _frame(flow if there is None else there)
    return np.asarray(ahead.T @ matrix @ _frame(flow))


def _frame(flow: np.ndarray) -> np.ndarray:
    """Unit vectors across the flow, float64[D, D - 1]."""
    whole = np.linalg.qr(np.concatenate([flow[:, None], np.eye(len(flow))], axis=1))[0]
    return np.asarray(whole[:, 1 : len(flow)])


def nontrivial(segments: np.ndarray, flows: np.ndarray) -> np.ndarray:
    """Floquet multipliers of a limit cycle without the 1 along it, the largest first.

    Parameters
    ----------
    segments : float64[n, D, D]
        The tangent map of each of its parts.
    flows : float64[n, D]
        The rates where they begin.

    Returns
    -------
    complex128[D - 1]
        A motion of one state that jumps has nothing across it: a single 0.
    """
    if segments.shape[1] == 1:
        return np.zeros(1, complex)
    ahead = np.roll(flows, -1, axis=0)
    parts = [across(*one) for one in zip(segments, flows, ahead, strict=True)]
    found: np.ndarray = multipliers(np.array(parts)[None])[0]
    return found


def multipliers(segments: np.ndarray) -> np.ndarray:
    """Floquet multipliers of float64[r, n, D, D], the largest first, complex128[r, D]; NaN where a
    segment isn't finite.

    Eigenvalues of the cyclic block matrix are their n-th roots: the product isn't multiplied out,
    so that small ones keep their digits. Kressner, Numerical Methods for General and Structured
    Eigenvalue Problems (2005), section 3.
    """
    r, n, size = segments.shape[:3]
    if n == 1:
        return leading_first(segments[:, 0])
    good = np.isfinite(segments).all(axis=(1, 2, 3))
    cyclic = np.zeros((np.count_nonzero(good), n, size, n, size))
    for i in range(n):
        cyclic[:, (i + 1) % n, :, i] = segments[good, i]
    roots = np.linalg.eigvals(cyclic.reshape(len(cyclic), n * size, n * size))
    result = np.full((r, size), np.nan + 0j)
    result[good] = _grouped(roots**n, n)
    return result


def _grouped(powers: np.ndarray, n: int) -> np.ndarray:
    """One of each n equal values of complex128[r, n D], the largest first."""
    means, left = [], np.ones(powers.shape, bool)
    while left[:1].any():
        first = np.where(left, np.abs(powers), -1.0).argmax(axis=1)[:, None]
        apart = np.abs(powers - np.take_along_axis(powers, first, axis=1))
        nearest = np.argsort(np.where(left, apart, np.inf), axis=1, kind="stable")[:, :n]
        means.append(np.take_along_axis(powers, nearest, axis=1).mean(axis=1))
        np.put_along_axis(left, nearest, False, axis=1)
    values = np.array(means, complex).reshape(-1, len(powers)).T
    real = np.abs(values.imag) <= 1e-9 * np.abs(values)
    values = np.where(real, values.real, values)
    order = np.lexsort((-values.imag, -np.round(np.abs(values), 12)), axis=1)
    return np.take_along_axis(values, order, axis=1)
