"""The contracts that equations of branches fulfil: of a curve, and of a curve of orbits."""

from __future__ import annotations

from typing import Protocol

import numpy as np


class CurveEquations(Protocol):
    """m equations F(z) = 0 in m + 1 unknowns, for k curves.

    Attributes
    ----------
    scale : float64[k, m + 1]
        Unit of each unknown.
    """

    scale: np.ndarray

    def evaluate(self, z: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """F float64[r, m] and its derivative float64[r, m, m + 1], both in units of the scale, at
        float64[r, m + 1] of the curves int64[r]; NaN where there is none.
        """

    def accepted(self, z: np.ndarray, rows: np.ndarray) -> None:
        """Points float64[r, m + 1] of the curves int64[r] were accepted."""

    def alike(self, z: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Other unknowns that mean the same points float64[r, m + 1], float64[r, s, m + 1]; the
        first are these. The last unknown of them all is the same.
        """


class OrbitEquations(CurveEquations, Protocol):
    """Equations of closed motions over one parameter, the last unknown.

    Attributes
    ----------
    n, size : int
        Parts of equal time of a motion, and the states.
    free : bool
        Whether its period is among the unknowns.
    """

    n: int
    size: int
    free: bool

    def near(self, z: np.ndarray, rows: np.ndarray) -> OrbitEquations:
        """The equations whose row i is curve rows[i], int64[r], with the condition on its phase at
        the motion float64[r, z].
        """

    def points(self, z: np.ndarray) -> np.ndarray:
        """The points of motions float64[r, z], float64[r, n, D]."""

    def multipliers(self, z: np.ndarray, derivative: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Floquet multipliers of motions float64[r, z], the largest first, without a trivial one,
        complex128[r, D] or [r, D - 1].
        """
