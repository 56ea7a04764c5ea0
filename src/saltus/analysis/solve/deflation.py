"""Zeros that are known already are taken out of systems of equations.

The residual times m(x) = prod (1 + 1/|x - z|^2) over the known zeros z grows without bound at each
of them; its Newton step is the plain one times 1/(1 - d log m), by the formula of Sherman and
Morrison, so that no matrix changes. Farrell, Birkisson & Funke, SIAM J. Sci. Comput. 37 (2015)
A2026-A2045.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from saltus.analysis.solve.tolerances import SAME

#: Known zeros, float64[m, d]; or of zeros that aren't isolated, such as a limit cycle from each of
#: its points on, what gives the nearest of each kind to float64[k, d]: float64[k, m, d].
Known = np.ndarray | Callable[[np.ndarray], np.ndarray]


def weight(x: np.ndarray, scale: np.ndarray, known: Known | None) -> np.ndarray:
    """m(x), float64[k]."""
    if known is None:
        return np.ones(len(x))
    _, square = _apart(x, scale, known)
    return np.asarray(np.exp(np.minimum(np.log1p(1.0 / square).sum(axis=1), 600.0)))


def stretch(x: np.ndarray, step: np.ndarray, scale: np.ndarray, known: Known | None) -> np.ndarray:
    """What the step of the deflated residual is of the plain one, float64[k]."""
    if known is None:
        return np.ones(len(x))
    apart, square = _apart(x, scale, known)
    along = np.einsum("kmd,kd->km", apart, step) / x.shape[1]
    slope = -(2.0 * along / (square * (square + 1.0))).sum(axis=1)
    with np.errstate(divide="ignore"):
        return np.asarray(np.clip(1.0 / (1.0 - slope), -1e6, 1e6))


def is_new(x: np.ndarray, scale: np.ndarray, known: Known | None) -> np.ndarray:
    """True where float64[k, d] is none of the known zeros, bool[k]."""
    if known is None:
        return np.ones(len(x), bool)
    return np.asarray((_apart(x, scale, known)[1] > SAME**2).all(axis=1))


def _apart(x: np.ndarray, scale: np.ndarray, known: Known) -> tuple[np.ndarray, np.ndarray]:
    """Differences float64[k, m, d] to the known zeros, and their mean squares float64[k, m], in
    units of the scale.
    """
    zeros = known(x) if callable(known) else known[None]
    apart = (x[:, None] - zeros) / scale[:, None]
    return apart, np.maximum(np.einsum("kmd,kmd->km", apart, apart) / x.shape[1], 1e-300)
