"""Many polynomials on [0, 1] at once: values, integrals, and every change of sign.

A polynomial is a column of ``terms`` float64[n + 1, p]: ``sum(terms[k] * x**k)``. Roots are
isolated by the sign variations of Bernstein coefficients, halving the interval while there are more
than one: only pairs closer than rounding are missed. (Lane & Riesenfeld, BIT 21 (1981);
kernels/isolation.py does the same for one polynomial inside the flow.)
"""

from __future__ import annotations

import functools
import math

import numpy as np

#: Most halvings; the roots left in such an interval count as one.
DEEPEST = 40
#: Most Newton steps and bisections of an isolated root.
MOST_STEPS = 80
#: A step that changes a root by less is the last.
CONVERGED = 4e-16


def value(terms: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Value of each polynomial at its own x: terms float64[n + 1, ..., p], x float64[p];
    float64[..., p].
    """
    total: np.ndarray = terms[-1]
    for term in terms[-2::-1]:
        total = total * x
        total += term
    return total


def derivative(terms: np.ndarray) -> np.ndarray:
    """Terms of the derivatives, float64[n, ..., p]."""
    return terms[1:] * np.arange(1, len(terms)).reshape(-1, *(1,) * (terms.ndim - 1))


def leading_signs(terms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sign of each polynomial just after 0 and just before 1, float64[p] each; 0 for one that is
    zero everywhere.
    """
    after, before = np.zeros(terms.shape[1]), np.zeros(terms.shape[1])
    way = 1.0
    for _ in range(len(terms)):
        after = np.where(after == 0.0, np.sign(terms[0]), after)
        before = np.where(before == 0.0, way * np.sign(terms.sum(axis=0)), before)
        if len(terms) == 1 or (after.all() and before.all()):
            break
        terms, way = derivative(terms), -way
    return after, before


def sign_changes(terms: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Locate the changes of sign of polynomials inside (0, 1).

    Returns
    -------
    which : int64[r]
        The polynomial, ascending.
    place : float64[r]
        Places of the zeros, ascending for each polynomial.
    """
    coefficients = bernstein(len(terms) - 1) @ terms
    which = np.arange(terms.shape[1])
    low, high = np.zeros(len(which)), np.ones(len(which))
    found: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    for level in range(DEEPEST + 1):
        changes = (np.diff(coefficients > 0.0, axis=0)).sum(axis=0)
        done = (changes == 1) | (changes > 1) & (level == DEEPEST)
        found.append((which[done], low[done], high[done]))
        more = changes > 1
        if level == DEEPEST or not more.any():
            break
        coefficients = np.concatenate(_halves(coefficients[:, more]), axis=1)
        middle = 0.5 * (low[more] + high[more])
        which = np.tile(which[more], 2)
        low, high = np.concatenate([low[more], middle]), np.concatenate([middle, high[more]])
    which, low, high = (np.concatenate(part) for part in zip(*found, strict=True))
    place = _refined(terms[:, which], low, high)
    order = np.lexsort((place, which))
    return which[order], place[order]


@functools.cache
def bernstein(degree: int) -> np.ndarray:
    """The matrix float64[n + 1, n + 1] from terms to Bernstein coefficients on [0, 1]."""
    return np.array(
        [
            [math.comb(i, k) / math.comb(degree, k) for k in range(degree + 1)]
            for i in range(degree + 1)
        ]
    )


def _halves(coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Bernstein coefficients on both halves of the interval (de Casteljau)."""
    left, right = np.empty_like(coefficients), coefficients.copy()
    left[0] = right[0]
    for level in range(1, len(right)):
        right[: len(right) - level] = 0.5 * (
            right[: len(right) - level] + right[1 : len(right) - level + 1]
        )
        left[level] = right[0]
    return left, right


def _refined(terms: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The root of each polynomial between low and high, by Newton's method inside a shrinking
    bracket.
    """
    rates = derivative(terms)
    root: np.ndarray = 0.5 * (low + high)
    rises, which = value(terms, high) > value(terms, low), np.arange(len(root))
    for _ in range(MOST_STEPS):
        x = root[which]
        residual = value(terms, x)
        below = (residual < 0.0) == rises
        low, high = np.where(below, x, low), np.where(below, high, x)
        with np.errstate(all="ignore"):
            new = x - residual / value(rates, x)
        new = np.where((new >= low) & (new <= high), new, 0.5 * (low + high))
        root[which] = np.where(residual == 0.0, x, new)
        on = (np.abs(new - x) > CONVERGED) & (residual != 0.0)
        if not on.any():
            break
        if not on.all():
            which, low, high, rises = which[on], low[on], high[on], rises[on]
            terms, rates = terms[:, on], rates[:, on]
    return root


def hermite(a: np.ndarray, b: np.ndarray, da: np.ndarray, db: np.ndarray) -> np.ndarray:
    """Terms of the cubics with the values a, b and the slopes da, db at 0 and 1,
    float64[4, ...].
    """
    return np.stack([a, da, *_bends(a, b, da, db)])


def between(
    a: np.ndarray, b: np.ndarray, da: np.ndarray, db: np.ndarray, share: np.ndarray
) -> np.ndarray:
    """The cubics of :func:`hermite` at a share of the way."""
    bend, twist = _bends(a, b, da, db)
    return np.asarray(a + share * (da + share * (bend + share * twist)))


def _bends(
    a: np.ndarray, b: np.ndarray, da: np.ndarray, db: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    return 3.0 * (b - a) - 2.0 * da - db, 2.0 * (a - b) + da + db


@functools.cache
def gauss(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes in (0, 1) and weights of Gauss's rule, float64[count] each: exact up to degree 2 count
    - 1.
    """
    places, weights = np.polynomial.legendre.leggauss(count)
    return 0.5 * (places + 1.0), 0.5 * weights
