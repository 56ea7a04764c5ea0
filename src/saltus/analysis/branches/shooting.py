"""The equations of periodic orbits: each of their points must be a whole period from the next, with
the contact sequence left to the flow.

The unknowns are all points of the orbit and the parameters that are followed, so an orbit of n
periods is n short shots in place of a long one. Derivatives come from the tangent flow of the
parametric system (system/parametric.py), jumps at contacts included. An orbit of a system without
forcing has its period among the unknowns and a condition on its phase: across the flow at the last
accepted point. Ascher, Mattheij & Russell, Numerical Solution of Boundary Value Problems (1995),
chapter 4.
"""

from __future__ import annotations

import copy
from collections.abc import Sequence

import numpy as np

from saltus.analysis.branches.parametric_map import parametric_map
from saltus.analysis.closed.field_zeros import field_of
from saltus.analysis.closed.shooting import less_next
from saltus.analysis.solve.floquet import across, multipliers
from saltus.flow.methods import Method
from saltus.flow.request import Schedule
from saltus.flow.stops import on_allowed_sides
from saltus.system import System
from saltus.system.parametric import parametric

#: Samples of a limit cycle in which the nearest to a point is looked for.
SAMPLES = 400
#: Steps that locate it.
LOCATED = 3
#: Radius of a limit cycle that is small, in units of the scale.
SMALL = 0.3
#: A guess so many roundings beyond a rigid stop, 2e-7 of the size of the states, lies on it: orbits
#: that rest on a stop at a whole period are found from guesses on either side.
GUESSED = 1e9


class PeriodicOrbits:
    """Curves of periodic orbits of n periods over one parameter; a ``CurveEquations``.

    Unknowns z: the n points, one after the other; the time from one to the next [s] in a system
    without forcing; the parameters [SI].

    Parameters
    ----------
    system : System
        Its equations and values; the same for all curves.
    names : sequence of str
        The parameters that are followed.
    n : int
        Forcing periods of the orbits; parts of equal time in a system without forcing.
    scale : float64[k, z]
        Units of the unknowns.
    symmetric : bool
        Whether mirror images of orbits are orbits: see system/symmetry.py.
    """

    def __init__(
        self,
        system: System,
        names: Sequence[str],
        n: int,
        scale: np.ndarray,
        method: Method,
        threads: int | None = None,
        symmetric: bool = False,
    ) -> None:
        self.symmetric = symmetric
        self.system, self.names, self.n, self.scale = system, tuple(names), n, scale
        self.size, self.free = len(system.states), system.forced_at is None
        self.parametric = parametric(system, self.names)
        first = self.names.index(system.forced_at) if system.forced_at in self.names else 0
        self._order = np.array(sorted(range(len(names) + self.free), key=lambda i: i != first))
        self._turns = system.period({system.forced_at: 1.0}) if system.forced_at else 1.0
        few = method.suited_to(1)  # tangents make many states: wide lanes don't pay
        self.map = parametric_map(system, self.parametric, few, threads)
        self.phase = np.full((len(scale), 2, self.size), np.nan)  # point and direction
        self._stops = any(
            guard.law is not None and guard.law.kind == "impact" for guard in system.guards
        )
        self._next = (np.arange(n) + 1) % n  # the point that follows each

    @property
    def width(self) -> int:
        """Number of unknowns."""
        return self.n * self.size + len(self.names) + self.free

    # -- unknowns ----------------------------------------------------------------------------------
    def points(self, z: np.ndarray) -> np.ndarray:
        """The points of orbits float64[..., z], float64[..., n, D]."""
        return z[..., : self.n * self.size].reshape(*z.shape[:-1], self.n, self.size)

    def values(self, z: np.ndarray) -> np.ndarray:
        """The parameters of orbits float64[..., z], float64[..., names]."""
        return z[..., self.n * self.size + self.free :]

    def period(self, z: np.ndarray) -> np.ndarray:
        """The period of orbits float64[..., z] [s], all n parts of it, float64[...]."""
        if self.free:
            return np.asarray(self.n * z[..., self.n * self.size])
        where = self.system.forced_at
        if where in self.names:
            return np.asarray(self.n * self._turns / self.values(z)[..., self.names.index(where)])
        return np.full(z.shape[:-1], self.n * self.system.period())

    def parameter_states(self, others: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Initial values of the states of the parametric system beside the points, from the
        unknowns beside the points float64[r, e]; the derivative of each with respect to its
        unknown, both float64[r, e]; and the number of that unknown, int64[e].
        """
        slopes = np.ones(others.shape)
        if self.system.forced_at not in self.names:
            return others, slopes, self._order
        values, frequency = others[:, self._order], others[:, self._order[0]]
        values[:, 0] = self._turns / frequency
        slopes[:, 0] = -values[:, 0] / frequency
        return values, slopes, self._order

    def starts(self, z: np.ndarray) -> np.ndarray:
        """The points as states of the parametric system, float64[r, n, E]."""
        return self._with_parameters(z, self.parameter_states(z[:, self.n * self.size :])[0])

    def _with_parameters(self, z: np.ndarray, carried: np.ndarray) -> np.ndarray:
        states = np.empty((len(z), self.n, self.size + carried.shape[1]))
        states[..., : self.size], states[..., self.size :] = self.points(z), carried[:, None]
        return states

    # -- equations ---------------------------------------------------------------------------------
    def evaluate(self, z: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See :class:`saltus.analysis.branches.equations.CurveEquations`."""
        r, n, size = len(z), self.n, self.size
        carried, slopes, order = self.parameter_states(z[:, n * size :])
        points, start = self.points(z), self._with_parameters(z, carried).reshape(r * n, -1)
        if self._stops:
            start, _ = on_allowed_sides(
                self.map.system,
                start,
                self.map.parameters,
                0.0,
                np.broadcast_to(self.map.period, r * n),
                GUESSED,
            )
        ends, matrices = self.map.tangent(start, 1)
        ends = ends[:, :size].reshape(r, n, size)
        matrices = matrices[:, :size].reshape(r, n, size, -1)
        derivative = np.empty((r, n, size, z.shape[1]))
        derivative[..., : n * size] = less_next(matrices[..., :size]).reshape(r, n, size, n * size)
        derivative[..., n * size + order] = matrices[..., size:] * slopes[:, None, None]
        unit = self.scale[rows]
        each = unit[:, : n * size].reshape(r, n, size)
        residual = ((ends - points[:, self._next]) / each).reshape(r, -1)
        derivative /= each[..., None]
        derivative = derivative.reshape(r, n * size, -1) * unit[:, None]
        if not self.free:
            return residual, derivative
        at, along = self.phase[rows, 0], self.phase[rows, 1]
        where = ((z[:, :size] - at) / unit[:, :size] * along).sum(axis=1)
        row = np.zeros((r, 1, z.shape[1]))
        row[:, 0, :size] = along
        return np.append(residual, where[:, None], axis=1), np.append(derivative, row, axis=1)

    def accepted(self, z: np.ndarray, rows: np.ndarray) -> None:
        """See :class:`saltus.analysis.branches.equations.CurveEquations`."""
        if self.free:
            self.phase[rows, 0] = z[:, : self.size]
            self.phase[rows, 1] = self._flow(z) / self.scale[rows, : self.size]
            self.phase[rows, 1] /= np.linalg.norm(self.phase[rows, 1], axis=1)[:, None]

    def near(self, z: np.ndarray, rows: np.ndarray) -> PeriodicOrbits:
        """The equations whose row i is curve rows[i], int64[r], with the condition on its phase at
        the orbit float64[r, z].
        """
        other = copy.copy(self)
        other.scale, other.phase = self.scale[rows], self.phase[rows].copy()
        other.accepted(z, np.arange(len(rows)))
        return other

    def beside(self, z: np.ndarray, point: np.ndarray, row: int) -> float:
        """Distance of a point float64[D] from the limit cycle z, in units of the scale."""
        start = self.starts(z[None])[:, 0]
        unit = self.scale[row, : self.size]
        run = self.map.run(start, self.n, Schedule.even(self.n, SAMPLES)).samples[0]
        apart = np.abs((run[:, : self.size] - point) / unit).max(axis=1)
        place = float(np.argmin(apart)) / SAMPLES
        for _ in range(LOCATED):
            count, share = int(place // 1), place % 1
            schedule = Schedule(np.array([count]), np.array([share]))
            state = self.map.run(start, self.n, schedule).samples[0, 0, : self.size]
            ahead = z.copy()
            ahead[: self.size] = state
            rate = self._flow(ahead[None])[0] * z[self.n * self.size]
            way, along = (point - state) / unit, rate / unit
            place = (place + float(way @ along) / float(along @ along)) % self.n
        return float(np.abs(way).max())

    def turned(self, z: np.ndarray, before: np.ndarray) -> bool:
        """True if a small limit cycle has passed an equilibrium since the one before, so that its
        flow is reversed.
        """
        rates = self._flow(np.stack([z, before])) / self.scale[0, : self.size]
        return bool(rates[0] @ rates[1] < 0.0 and self.radius(before) < SMALL)

    def radius(self, z: np.ndarray) -> float:
        """Radius that the limit cycle float64[z] would have if it were a circle, in units of the
        scale.
        """
        rates = self._flow(z[None])[0] / self.scale[0, : self.size]
        return float(np.linalg.norm(rates) * self.period(z) / (2.0 * np.pi))

    def _flow(self, z: np.ndarray) -> np.ndarray:
        """Rates at the first points, float64[r, D]."""
        values = {
            name: np.full(len(z), value) for name, value in self.system.values.items()
        } | dict(zip(self.names, self.values(z).T, strict=True))
        return field_of(self.system, z[:, : self.size], values)

    def alike(self, z: np.ndarray, rows: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """The same orbits from each of their points on, float64[r, n, z]."""
        points = self.points(z)
        shifts = (np.arange(self.n)[:, None] + np.arange(self.n)) % self.n
        rolled = points[:, shifts].reshape(len(z), self.n, self.n * self.size)
        others = np.repeat(z[:, None, self.n * self.size :], self.n, axis=1)
        return np.concatenate([rolled, others], axis=2)

    def mirrored(self, z: np.ndarray) -> np.ndarray:
        """The mirror images -x(t + T/2) of orbits float64[r, z]; of limit cycles -x(t)."""
        points = self.points(z)
        if not self.free:
            starts = self.starts(z).reshape(len(z) * self.n, -1)
            half = Schedule(np.zeros(1, np.int64), np.full(1, 0.5))
            seen = self.map.run(starts, 1, half).samples[:, 0, : self.size]
            points = seen.reshape(points.shape)
        others = z[:, self.n * self.size :]
        return np.concatenate([-points.reshape(len(z), -1), others], axis=1)

    # -- what an orbit is --------------------------------------------------------------------------
    def segments(self, derivative: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """The tangent map of each period from derivatives of the equations, float64[r, n, D, D]."""
        size, unit = self.size, self.scale[rows]
        result = np.empty((len(rows), self.n, size, size))
        for i in range(self.n):
            part = slice(i * size, (i + 1) * size)
            result[:, i] = derivative[:, part, part] * unit[:, part, None] / unit[:, None, part]
        return result + np.eye(size) if self.n == 1 else result

    def multipliers(self, z: np.ndarray, derivative: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Floquet multipliers of orbits float64[r, z], the largest first, without the trivial one
        of a system without forcing; complex128[r, D] or [r, D - 1].
        """
        segments = self.segments(derivative, rows)
        if self.free:
            wholes = [np.linalg.multi_dot([*one[::-1], np.eye(self.size)]) for one in segments]
            parts = [across(*one) for one in zip(wholes, self._flow(z), strict=True)]
            segments = np.array(parts).reshape(len(rows), 1, self.size - 1, self.size - 1)
        return multipliers(segments)
