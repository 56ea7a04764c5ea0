"""The equations of equilibria of a system without forcing over one parameter, each curve in one
mode: a side of every boundary.

The field of a mode is smooth, and so are its equilibria over the parameter up to the boundaries of
the mode, beyond which they are virtual. Kuznetsov, Elements of Applied Bifurcation Theory (2004),
section 10.2; di Bernardo, Budd, Champneys & Kowalczyk, Piecewise-smooth Dynamical Systems (2008),
chapter 5.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np

from saltus.analysis.solve.newton import leading_first
from saltus.contact.guards import is_hold
from saltus.language.derivatives import gradient
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr
from saltus.system import System, margin_gaps
from saltus.system.parametric import parametric

#: Largest real part whose exponential is taken, in units of the rates.
STEEP = 50.0
#: Rates at an equilibrium count as no smaller than this share of those where its curve begins.
SLOWEST = 1e-3


class EquilibriumCurves:
    """Curves of equilibria over one parameter; a ``CurveEquations``, and what a branch asks
    of the equations of its orbits.

    Unknowns z: the state, and the parameter [SI]. The mode of a curve is that of the first point
    which is accepted.

    Parameters
    ----------
    system : System
        Without forcing; its equations and values are those of all curves.
    name : str
        The parameter that is followed.
    scale : float64[k, D + 1]
        Units of the unknowns.
    """

    def __init__(self, system: System, name: str, scale: np.ndarray) -> None:
        self.system, self.names, self.scale = system, (name,), scale
        self.n, self.size, self.free = 1, len(system.states), False
        self._whole = parametric(system, self.names).system
        size = self.size
        self._columns = [*range(size), len(self._whole.states) - 1]
        self._field = self._whole.field[:size]
        self._slopes = [row[i] for row in self._whole.jacobian[:size] for i in self._columns]
        self.modes = np.zeros((len(scale), len(system.guards)), bool)
        self._weight = np.full((len(scale), size), np.nan)
        self._least_rate = 0.0

    @property
    def width(self) -> int:
        """Number of unknowns."""
        return self.size + 1

    # -- unknowns ----------------------------------------------------------------------------------
    def points(self, z: np.ndarray) -> np.ndarray:
        """The states of equilibria float64[..., z], float64[..., 1, D]."""
        return z[..., None, : self.size]

    def values(self, z: np.ndarray) -> np.ndarray:
        """The parameter of equilibria float64[..., z], float64[..., 1]."""
        return z[..., self.size :]

    def period(self, z: np.ndarray) -> np.ndarray:
        """A time in which nothing moves away from equilibria float64[..., z] [s], float64[...]."""
        whole = z.reshape(-1, self.width)
        rates = np.linalg.norm(self.jacobian(whole, self.sides(whole)), axis=(1, 2))
        return np.asarray(1.0 / np.maximum(rates, self._least_rate)).reshape(z.shape[:-1])

    # -- numbers -----------------------------------------------------------------------------------
    def _at(self, entries: Sequence[Expr], z: np.ndarray, modes: np.ndarray) -> np.ndarray:
        """Expressions of the parametric system at float64[r, z] in modes bool[r, guards],
        float64[r, len(entries)].
        """
        states = {name: np.ones(len(z)) for name in self._whole.states}
        for column, values in zip(self._columns, z.T, strict=True):
            states[self._whole.states[column]] = values
        found = evaluate(entries, states=states, values=self._whole.values, bits=list(modes.T))
        return np.stack([np.broadcast_to(one, len(z)) for one in found], axis=1).astype(float)

    def jacobian(self, z: np.ndarray, modes: np.ndarray) -> np.ndarray:
        """Derivatives of the rates with respect to the unknowns, float64[r, D, D + 1]."""
        return self._at(self._slopes, z, modes).reshape(len(z), self.size, self.width)

    def sides(self, z: np.ndarray) -> np.ndarray:
        """The modes in which float64[r, z] lie, bool[r, guards]."""
        modes = np.zeros((len(z), len(self.system.guards)), bool)
        for number, guard in enumerate(self._whole.guards):
            if not is_hold(guard):
                modes[:, number] = self._at([guard.gap], z, modes)[:, 0] > 0
        return modes

    def gaps(self, z: np.ndarray, row: int) -> tuple[np.ndarray, np.ndarray]:
        """Gaps of all guards at float64[z], float64[guards], and their derivatives with respect to
        the unknowns in units of the scale, float64[guards, z].
        """
        modes, guards = self.modes[[row]], self._whole.guards
        if not guards:
            return np.zeros(0), np.zeros((0, self.width))
        values = self._at([guard.gap for guard in guards], z[None], modes)[0]
        slopes = [one[i] for one in self._whole.guard_gradients for i in self._columns]
        entries = self._at(slopes, z[None], modes)[0].reshape(len(guards), -1)
        return values, entries * self.scale[row]

    def margin(self, z: np.ndarray) -> float:
        """Distance of float64[z] to the nearest boundary; inf without one."""
        free = [self._whole.guards[number].gap for number in margin_gaps(self.system)[0]]
        gaps = self._at(free, z[None], self.sides(z[None]))[0] if free else np.zeros(0)
        return float(np.abs(gaps).min(initial=np.inf))

    def derivatives(self, z: np.ndarray, row: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """First, second and third derivatives of the rates at float64[z] with respect to the
        states, in units of the scale: float64[D, D], [D, D, D] and [D, D, D, D].
        """
        unit = self.scale[row, : self.size]
        entries: list[Expr] = list(self._field)
        weight, found = 1.0 / unit, []
        for _ in range(3):
            entries = [one for entry in entries for one in gradient(entry, self.system.states)]
            weight = weight[..., None] * unit
            numbers = self._at(entries, z[None], self.modes[[row]])
            found.append(numbers.reshape(weight.shape) * weight)
        return found[0], found[1], found[2]

    # -- equations ---------------------------------------------------------------------------------
    def evaluate(self, z: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See :class:`saltus.analysis.branches.equations.CurveEquations`; each rate is divided by
        its largest derivative where the curve begins.
        """
        modes, weight = self.modes[rows], self._weight[rows]
        derivative = self.jacobian(z, modes) * self.scale[rows][:, None]
        residual = self._at(self._field, z, modes)
        return residual / weight, derivative / weight[:, :, None]

    def accepted(self, z: np.ndarray, rows: np.ndarray) -> None:
        """See :class:`saltus.analysis.branches.equations.CurveEquations`."""
        new = np.isnan(self._weight[rows, 0])
        if new.any():
            z, rows = z[new], rows[new]
            self.modes[rows] = self.sides(z)
            slopes = self.jacobian(z, self.modes[rows])
            rates = float(np.linalg.norm(slopes, axis=(1, 2)).max())
            self._least_rate = max(self._least_rate, SLOWEST * (rates or 1.0))
            largest = np.abs(slopes * self.scale[rows][:, None]).max(axis=2)
            self._weight[rows] = np.where(largest > 0, largest, 1.0)

    def near(self, z: np.ndarray, rows: np.ndarray) -> EquilibriumCurves:  # noqa: ARG002
        """The equations whose row i is curve rows[i], int64[r]."""
        other = copy.copy(self)
        other.scale, other.modes = self.scale[rows], self.modes[rows].copy()
        other._weight = self._weight[rows]
        return other

    def across(self, z: np.ndarray, row: int, guard: int) -> EquilibriumCurves:
        """The equations of the mode beyond a boundary, in one row, at float64[z]."""
        other = self.near(z[None], np.array([row]))
        other.modes[0, guard] = not other.modes[0, guard]
        return other

    def alike(self, z: np.ndarray, rows: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """The same equilibria, float64[r, 1, z]."""
        return z[:, None]

    # -- stability ---------------------------------------------------------------------------------
    def eigenvalues(self, z: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Of the Jacobian at equilibria float64[r, z] [1/s], the largest real part first,
        complex128[r, D].
        """
        matrices = self.jacobian(z, self.modes[rows])[:, :, : self.size]
        values = leading_first(matrices)
        order = np.lexsort((-values.imag, -values.real), axis=1)
        return np.take_along_axis(values, order, axis=1)

    def multipliers(self, z: np.ndarray, derivative: np.ndarray, rows: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """Those of the linear flow over :meth:`period`: exponentials of the eigenvalues, of which
        as many lie outside the unit circle as eigenvalues to the right of the imaginary axis;
        complex128[r, D].
        """
        exponents = self.eigenvalues(z, rows) * self.period(z)[:, None]
        multipliers: np.ndarray = np.exp(np.minimum(exponents.real, STEEP) + 1j * exponents.imag)
        return multipliers
