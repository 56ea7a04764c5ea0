"""The equations of orbits at a bifurcation, in two parameters: those of the orbit, and that their
tangent map has a multiplier mu = 1 (fold), -1 (period doubling) or exp(i theta) (torus).

With the blocks of the shots in a matrix A(mu) that is singular where mu is a multiplier, the
solution g of ``A v + b g = 0, c'v = 1`` is a smooth function that vanishes there, and
``w'A + h c' = 0, w'b = 1`` gives its derivative ``-w' dA v``: the second derivative of the flow
along v alone, from the exact tangent flow at two points beside the orbit. Govaerts, Numerical
Methods for Bifurcations of Dynamical Equilibria (2000), chapters 3 and 4; Kuznetsov, Elements of
Applied Bifurcation Theory (2004), section 10.3.
"""

from __future__ import annotations

import numpy as np

from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.solve.linear import solved

#: Multiplier of each kind that is followed; a torus has its own.
MULTIPLIER = {"fold": 1.0, "period_doubling": -1.0, "neimark_sacker": None}
#: Distance of the orbits whose difference is a second derivative, in units of the scale.
BESIDE = 1e-5
#: Cosines of the angle of the multipliers of a torus: the ends are resonances 1:1 and 1:2.
COSINES = (-1.0 + 1e-9, 1.0 - 1e-9)


class SingularOrbits:
    """Curves of bifurcations of one kind; a ``CurveEquations``.

    Unknowns z: those of :class:`PeriodicOrbits` over two parameters, and for a torus the cosine of
    the angle of its multipliers.

    Parameters
    ----------
    orbits : PeriodicOrbits
        Over the two parameters.
    kind : str
        A key of MULTIPLIER.
    """

    def __init__(self, orbits: PeriodicOrbits, kind: str) -> None:
        self.orbits, self.kind, self.beside = orbits, kind, BESIDE
        self.multiplier = MULTIPLIER[kind]
        one = np.ones((len(orbits.scale), 1))
        self.scale = orbits.scale if self.torus is False else np.append(orbits.scale, one, axis=1)
        size = orbits.n * orbits.size
        #: Rows and columns of the orbit's derivative in A.
        self.size = size + orbits.free if kind == "fold" else size
        self._border = np.full((2, len(orbits.scale), self.size), np.nan)  # b, c
        self._latest = self._border.copy()

    @property
    def torus(self) -> bool:
        """True if the multipliers are a complex pair."""
        return self.multiplier is None

    @classmethod
    def of(
        cls, orbits: PeriodicOrbits, kind: str, z: np.ndarray, multiplier: complex
    ) -> tuple[SingularOrbits, np.ndarray]:
        """The equations of a bifurcation and its unknowns, from an orbit float64[z] and its
        multiplier on the unit circle.
        """
        result = cls(orbits, kind)
        cosine = np.clip(multiplier.real / abs(multiplier), *COSINES)
        return result, np.append(z, cosine) if result.torus else z

    @property
    def bounds(self) -> dict[int, tuple[float, float]]:
        """Ranges of unknowns beside the parameters, by their columns."""
        return {self.orbits.width: COSINES} if self.torus else {}

    @property
    def parameters(self) -> tuple[int, int]:
        """Columns of the two parameters."""
        return self.orbits.width - 2, self.orbits.width - 1

    def begin(self, z: np.ndarray, rows: np.ndarray) -> None:
        """Take the first points float64[r, z] of the curves; the null vectors there are borders."""
        self.orbits.accepted(z[:, : self.orbits.width], rows)
        _, derivative = self.orbits.evaluate(z[:, : self.orbits.width], rows)
        right, left = self.null_vectors(z, derivative)
        self._border[:, rows] = _real(left), _real(right)

    def at(self, row: int, z: np.ndarray) -> SingularOrbits:
        """The same equations with a row for each point float64[r, z] of a curve."""
        orbits = self.orbits.near(z[:, : self.orbits.width], np.full(len(z), row))
        result = SingularOrbits(orbits, self.kind)
        result.begin(z, np.arange(len(z)))
        return result

    def null_vectors(self, z: np.ndarray, derivative: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit vectors v and w with A v = 0 and w'A = 0, [r, size] each, at orbits."""
        whole = np.where(np.isfinite(derivative), derivative, 0.0)
        left, _, right = np.linalg.svd(self._matrix(whole, self._multipliers(z)))
        return right[:, -1].conj(), left[:, :, -1].conj()

    def _multipliers(self, z: np.ndarray) -> np.ndarray:
        if not self.torus:
            return np.full(len(z), self.multiplier)
        cosine = z[:, -1]
        return cosine + 1j * np.sqrt(np.maximum(1.0 - cosine**2, 0.0))

    def _matrix(self, derivative: np.ndarray, mu: np.ndarray) -> np.ndarray:
        """A(mu) from derivatives of the orbits' equations. The points have one scale, so that the
        blocks of the next point are -1.
        """
        matrix = derivative[:, : self.size, : self.size].astype(mu.dtype)
        size, n = self.orbits.size, self.orbits.n
        last, first = np.arange(size) + (n - 1) * size, np.arange(size)
        matrix[:, last, first] += (1.0 - mu)[:, None]
        return matrix

    def orbit(self, z: np.ndarray) -> np.ndarray:
        """The orbits of points float64[r, z], in the unknowns of :class:`PeriodicOrbits`."""
        return z[:, : self.orbits.width]

    def multipliers(self, z: np.ndarray, derivative: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Floquet multipliers at points float64[r, z], complex128[r, D]."""
        width = self.orbits.width
        return self.orbits.multipliers(z[:, :width], derivative[:, :, :width], rows)

    # -- equations ---------------------------------------------------------------------------------
    def evaluate(self, z: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See :class:`saltus.analysis.branches.equations.CurveEquations`."""
        width, size = self.orbits.width, self.size
        residual, derivative = self.orbits.evaluate(z[:, :width], rows)
        mu = self._multipliers(z)
        matrix = self._matrix(derivative, mu)
        b, c = self._border[:, rows]
        v, g = self._bordered(matrix, b, c)
        w, _ = self._bordered(np.swapaxes(matrix, 1, 2), c, b)
        self._latest[:, rows] = _real(w), _real(v)
        slope = self._slopes(z[:, :width], rows, v, w)
        if not self.torus:
            whole = np.concatenate([derivative, -slope[:, None]], axis=1)
            return np.append(residual, g[:, None], axis=1), whole
        sine, cosine = mu.imag, mu.real
        n, points = self.orbits.n, self.orbits.size
        by_mu = (w[:, (n - 1) * points : size] * v[:, :points]).sum(axis=1)
        by_cosine = by_mu * (-1j * mu / sine)
        column = np.zeros((len(z), derivative.shape[1], 1))
        odd = by_cosine.imag / sine + g.imag * cosine / sine**3
        pair = np.stack([g.real, g.imag / sine], axis=1)
        two = np.stack(
            [
                np.append(-slope.real, by_cosine.real[:, None], axis=1),
                np.append(-slope.imag / sine[:, None], odd[:, None], axis=1),
            ],
            axis=1,
        )
        whole = np.concatenate([np.concatenate([derivative, column], axis=2), two], axis=1)
        return np.concatenate([residual, pair], axis=1), whole

    def _bordered(
        self, matrix: np.ndarray, b: np.ndarray, c: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """The solutions of ``A v + b g = 0, c'v = 1``."""
        r, size = b.shape
        whole = np.zeros((r, size + 1, size + 1), matrix.dtype)
        whole[:, :size, :size], whole[:, :size, size], whole[:, size, :size] = matrix, b, c
        right = np.zeros((r, size + 1), matrix.dtype)
        right[:, size] = 1.0
        found = solved(whole, right)
        return found[:, :size], found[:, size]

    def _slopes(self, z: np.ndarray, rows: np.ndarray, v: np.ndarray, w: np.ndarray) -> np.ndarray:
        """w'(d derivative / ds) of all unknowns along v, [r, z]."""
        parts = [
            np.einsum("ri,riz->rz", w, self.bend(z, rows, part)[:, : self.size])
            for part in ((v.real, v.imag) if self.torus else (v,))
        ]
        slopes: np.ndarray = parts[0] + 1j * parts[1] if self.torus else parts[0]
        return slopes

    def bend(self, z: np.ndarray, rows: np.ndarray, along: np.ndarray) -> np.ndarray:
        """The change of the orbits' derivative along float64[r, k] of the first unknowns, in units
        of the scale, float64[r, m, z].
        """
        size = np.linalg.norm(along, axis=1)
        share = self.beside / np.where(size > 0, size, 1.0)
        step = np.zeros_like(z)
        step[:, : along.shape[1]] = (
            share[:, None] * along * self.orbits.scale[rows][:, : along.shape[1]]
        )
        beside = np.concatenate([z + step, z - step])
        _, derivative = self.orbits.evaluate(beside, np.concatenate([rows, rows]))
        ahead, behind = np.split(derivative, 2)
        bend: np.ndarray = (ahead - behind) / (2 * share)[:, None, None]
        return bend

    def accepted(self, z: np.ndarray, rows: np.ndarray) -> None:
        """See :class:`saltus.analysis.branches.equations.CurveEquations`."""
        self.orbits.accepted(z[:, : self.orbits.width], rows)
        good = np.isfinite(self._latest[:, rows]).all(axis=(0, 2))
        self._border[:, rows[good]] = self._latest[:, rows[good]]

    def alike(self, z: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """See :class:`saltus.analysis.branches.equations.CurveEquations`."""
        width = self.orbits.width
        same = self.orbits.alike(z[:, :width], rows)
        others = np.repeat(z[:, None, width:], same.shape[1], axis=1)
        return np.concatenate([same, others], axis=2)


def _real(vectors: np.ndarray) -> np.ndarray:
    """Real unit vectors [r, k] that aren't across vectors: those themselves, or the largest real
    part that a turn of the phase gives them.
    """
    if np.iscomplexobj(vectors):
        phase = np.angle((vectors * vectors).sum(axis=1)) / 2
        vectors = (vectors * np.exp(-1j * phase)[:, None]).real
    unit: np.ndarray = vectors / np.linalg.norm(vectors, axis=1)[:, None]
    return unit
