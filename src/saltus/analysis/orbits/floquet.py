"""Floquet multipliers of an orbit from the tangent maps of its parts."""

from __future__ import annotations

import numpy as np

from saltus.analysis.orbits.newton import leading_first


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
    return multipliers(np.array([across(*one) for one in zip(segments, flows, ahead, strict=True)]))


def multipliers(segments: np.ndarray) -> np.ndarray:
    """Floquet multipliers of float64[n, D, D], the largest first, complex128[D].

    Eigenvalues of the cyclic block matrix are their n-th roots: the product isn't multiplied out,
    so that small ones keep their digits. Kressner, Numerical Methods for General and Structured
    Eigenvalue Problems (2005), section 3.
    """
    n, size = segments.shape[:2]
    if n == 1:
        return leading_first(segments)[0]
    if not np.isfinite(segments).all():
        return np.full(size, np.nan + 0j)
    cyclic = np.zeros((n * size, n * size))
    for i in range(n):
        j = (i + 1) % n
        cyclic[j * size : (j + 1) * size, i * size : (i + 1) * size] = segments[i]
    roots = np.linalg.eigvals(cyclic)
    powers = roots**n
    order = np.argsort(-np.abs(powers))
    return _grouped(powers[order], n)


def _grouped(powers: np.ndarray, n: int) -> np.ndarray:
    """One of each n equal values."""
    left, result = list(powers), []
    while left:
        first = left[0]
        nearest = sorted(range(len(left)), key=lambda i: abs(left[i] - first))[:n]
        mean = np.mean([left[i] for i in nearest])
        result.append(mean if abs(mean.imag) > 1e-9 * abs(mean) else complex(mean.real))
        left = [value for i, value in enumerate(left) if i not in set(nearest)]
    values = np.array(result)
    return values[np.lexsort((-values.imag, -np.round(np.abs(values), 12)))]
