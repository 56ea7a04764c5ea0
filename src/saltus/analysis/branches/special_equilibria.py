"""Where an equilibrium changes with a parameter: Hopf points, folds, and boundary equilibria, by
Newton's method on their defining systems.

The derivatives of these systems are those of the expressions themselves, so the points are as exact
as the equations. Kuznetsov, Elements of Applied Bifurcation Theory (2004), sections 5.4 and 10.2;
di Bernardo, Budd, Champneys & Kowalczyk, Piecewise-smooth Dynamical Systems (2008), chapter 5.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from saltus.analysis.solve.newton import newton
from saltus.language import assuming, dot, total
from saltus.language import expression as ex
from saltus.language.derivatives import gradient
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr
from saltus.system import System
from saltus.system.modes import sides

#: Longest step of Newton's method, in units of the unknowns' sizes.
LONGEST_STEP = 1e3


@dataclass(frozen=True)
class SpecialEquilibrium:
    """An equilibrium at which something changes.

    Attributes
    ----------
    value : float
        Of the parameter [SI].
    state : float64[D]
        Where it is.
    frequency : float
        Of a Hopf point, the angular frequency of the cycle born there [rad/s]; else NaN.
    coefficient : float
        Of a Hopf point, its first Lyapunov coefficient, for an eigenvector of unit length in units
        of the scale: below zero a stable cycle is born (supercritical), above zero an unstable one.
        Else NaN.
    """

    value: float
    state: np.ndarray
    frequency: float = np.nan
    coefficient: float = np.nan


def hopf_point(
    system: System, parameter: str, near: np.ndarray, scale: np.ndarray | None = None
) -> SpecialEquilibrium | None:
    """The Hopf point near the values of a system: a pair of eigenvalues crosses the imaginary axis
    as one parameter changes.

    Parameters
    ----------
    system : System
        Without forcing; the parameter has a value near that of the point.
    parameter : str
        What changes.
    near : float64[D]
        A state near the equilibrium; its mode is that of the point.
    scale : float64[D], optional
        Size of each state; default 1.

    Returns
    -------
    SpecialEquilibrium or None
        None where Newton's method finds none, or there is no pair to begin with.
    """
    work = _Smooth(system, parameter, near, scale)
    begin = work.pair()
    if begin is None:
        return None
    size, vector, frequency = len(near), *begin
    real, imag = ([_unknown(f"{part}{i}") for i in range(size)] for part in ("real", "imag"))
    omega = _unknown("omega")
    along = [
        ex.sub(ex.mul(float(one.real), b), ex.mul(float(one.imag), a))
        for one, a, b in zip(vector, real, imag, strict=True)
    ]
    length = total([ex.mul(one, one) for one in (*real, *imag)])
    entries = [
        *work.field,
        *(ex.add(work.turned(row, real), ex.mul(omega, imag[row])) for row in range(size)),
        *(ex.sub(work.turned(row, imag), ex.mul(omega, real[row])) for row in range(size)),
        ex.sub(length, 1.0),
        total(along),
    ]
    found = work.solve(
        entries,
        [*(one.payload for one in (*real, *imag)), "omega"],
        np.concatenate([vector.real, vector.imag, [frequency]]),
    )
    if found is None:
        return None
    state, value, more = found
    turns, vector = abs(float(more[-1])), more[:size] + 1j * more[size : 2 * size]
    if more[-1] < 0:
        vector = vector.conj()
    coefficient = work.first_lyapunov(state, value, vector, turns)
    return SpecialEquilibrium(value, state, turns, coefficient)


def fold_point(
    system: System, parameter: str, near: np.ndarray, scale: np.ndarray | None = None
) -> SpecialEquilibrium | None:
    """The fold near the values of a system: two equilibria of one mode meet, and an eigenvalue is
    zero. Parameters and returns as :func:`hopf_point`.
    """
    work = _Smooth(system, parameter, near, scale)
    vector = work.slowest()
    if vector is None:
        return None
    names = [f"along{i}" for i in range(len(near))]
    along = [_unknown(name) for name in names]
    length = total([ex.mul(one, one) for one in along])
    entries = [
        *work.field,
        *(work.turned(row, along) for row in range(len(near))),
        ex.sub(length, 1.0),
    ]
    found = work.solve(entries, names, vector)
    return None if found is None else SpecialEquilibrium(found[1], found[0])


def boundary_equilibrium(
    system: System,
    parameter: str,
    guard: int,
    near: np.ndarray,
    scale: np.ndarray | None = None,
) -> SpecialEquilibrium | None:
    """Where an equilibrium of the mode of a state meets the boundary of a guard. Other parameters
    and returns as :func:`hopf_point`.
    """
    work = _Smooth(system, parameter, near, scale)
    found = work.solve([*work.field, work.here(system.guards[guard].gap)], [], np.zeros(0))
    return None if found is None else SpecialEquilibrium(found[1], found[0])


def _unknown(name: str) -> Expr:
    return ex.state(name)


class _Smooth:
    """The equations of one mode, with a parameter among the unknowns; vectors are in units of the
    scale.
    """

    def __init__(
        self, system: System, parameter: str, near: np.ndarray, scale: np.ndarray | None
    ) -> None:
        self.system, self.parameter = system, parameter
        self.near = np.asarray(near, float)
        self.scale = np.ones(len(self.near)) if scale is None else np.asarray(scale, float)
        self.mode = tuple(bool(side) for side in sides(system, 0.0, self.near))
        self.field = tuple(self.here(entry) for entry in system.field)
        self.slopes = [gradient(entry, system.states) for entry in self.field]

    def here(self, entry: Expr) -> Expr:
        """An expression in this mode, the parameter an unknown."""
        for number, side in enumerate(self.mode):
            entry = assuming(entry, number, side)
        return ex.substituted(entry, {ex.parameter(self.parameter): _unknown(self.parameter)})

    def turned(self, row: int, vector: Sequence[Expr]) -> Expr:
        """A row of the scaled Jacobian times a vector."""
        ratios = self.scale / self.scale[row]
        return dot(
            self.slopes[row], [ex.mul(float(a), b) for a, b in zip(ratios, vector, strict=True)]
        )

    # -- numbers -----------------------------------------------------------------------------------
    def at(self, entries: Sequence[Expr], names: Sequence[str], unknowns: np.ndarray) -> np.ndarray:
        """Expressions at float64[k, u] of the unknowns, float64[k, len(entries)]."""
        known = dict(zip(names, unknowns.T, strict=True))
        columns = evaluate(entries, states=known, values=self.system.values, bits=self.mode)
        return np.stack([np.broadcast_to(one, len(unknowns)) for one in columns], axis=1).astype(
            float
        )

    def solve(
        self, entries: Sequence[Expr], names: Sequence[str], begin: np.ndarray
    ) -> tuple[np.ndarray, float, np.ndarray] | None:
        """State, value of the parameter and other unknowns at which expressions vanish, from those
        of the system; None where Newton's method finds nothing.
        """
        value = self.system.values[self.parameter]
        every = [*self.system.states, self.parameter, *names]
        start = np.concatenate([self.near, [value], begin])[None]
        size = np.concatenate([self.scale, [abs(value) or 1.0], np.maximum(np.abs(begin), 1.0)])
        slopes = [one for entry in entries for one in gradient(entry, every)]

        def equations(z: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            derivative = self.at(slopes, every, z).reshape(len(z), len(entries), -1) * size
            largest = np.abs(derivative).max(axis=2)
            largest = np.where(largest > 0, largest, 1.0)
            return self.at(entries, every, z) / largest, derivative / largest[:, :, None]

        zeros = newton(equations, start, size[None], longest_step=LONGEST_STEP)
        z = zeros.z
        if not zeros.found[0]:
            return None
        states = len(self.near)
        return z[0, :states], float(z[0, states]), z[0, states + 1 :]

    def _numbers(self, entries: Sequence[Expr], state: np.ndarray, value: float) -> np.ndarray:
        names = [*self.system.states, self.parameter]
        numbers: np.ndarray = self.at(entries, names, np.append(state, value)[None])[0]
        return numbers

    def _matrix(self, state: np.ndarray, value: float) -> np.ndarray:
        """The scaled Jacobian."""
        flat = self._numbers([one for row in self.slopes for one in row], state, value)
        scaled: np.ndarray = flat.reshape(len(state), -1) * self.scale / self.scale[:, None]
        return scaled

    # -- first guesses -----------------------------------------------------------------------------
    def _spectrum(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Eigenvalues and vectors at the equilibrium near the state, which is taken from now on."""
        value = self.system.values[self.parameter]
        fixed = ex.sub(_unknown(self.parameter), value)
        found = self.solve([*self.field, fixed], [], np.zeros(0))
        if found is not None:
            self.near = found[0]
        matrix = self._matrix(self.near, value)
        return None if not np.isfinite(matrix).all() else np.linalg.eig(matrix)

    def pair(self) -> tuple[np.ndarray, float] | None:
        """Eigenvector complex128[D] and frequency of the pair nearest to the imaginary axis."""
        found = self._spectrum()
        if found is None or not (found[0].imag > 0).any():
            return None
        values, vectors = found
        best = int(np.argmin(np.where(values.imag > 0, np.abs(values.real), np.inf)))
        return vectors[:, best] / np.linalg.norm(vectors[:, best]), float(values[best].imag)

    def slowest(self) -> np.ndarray | None:
        """The direction that the Jacobian shortens most."""
        self._spectrum()
        matrix = self._matrix(self.near, self.system.values[self.parameter])
        return np.linalg.svd(matrix)[2][-1] if np.isfinite(matrix).all() else None

    # -- criticality -------------------------------------------------------------------------------
    def first_lyapunov(self, state: np.ndarray, value: float, q: np.ndarray, omega: float) -> float:
        """The first Lyapunov coefficient; Kuznetsov (2004), equation (5.62)."""
        size = len(state)
        second = [gradient(one, self.system.states) for row in self.slopes for one in row]
        third = [gradient(one, self.system.states) for row in second for one in row]
        scale = self.scale
        two = self._numbers([one for row in second for one in row], state, value)
        three = self._numbers([one for row in third for one in row], state, value)
        two = two.reshape(3 * (size,)) * scale[:, None] * scale / scale[:, None, None]
        three = three.reshape(4 * (size,)) * scale[:, None, None] * scale[:, None] * scale
        three = three / scale[:, None, None, None]
        matrix = self._matrix(state, value)
        values, vectors = np.linalg.eig(matrix.T)
        p = vectors[:, np.argmin(np.abs(values + 1j * omega))]
        p = p / np.vdot(q, p)  # <p, q> = 1, and vdot conjugates its first argument
        both = np.einsum("ijk,j,k->i", two, q, q.conj())
        twice = np.einsum("ijk,j,k->i", two, q, q)
        still = np.linalg.solve(matrix, both)
        turning = np.linalg.solve(2j * omega * np.eye(size) - matrix, twice)
        sum_of = (
            np.einsum("ijkl,j,k,l->i", three, q, q, q.conj())
            - 2.0 * np.einsum("ijk,j,k->i", two, q, still)
            + np.einsum("ijk,j,k->i", two, q.conj(), turning)
        )
        return float((np.vdot(p, sum_of)).real / (2.0 * omega))
