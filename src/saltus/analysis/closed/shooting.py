"""The equations of closed motions: each of some points leads to the next one, the last to the
first.

An orbit of a map has its points as unknowns (multiple shooting): each goes one iterate, so that
what an unstable orbit does to an error in n of them stands in no equation. A limit cycle is an
orbit whose period is one more unknown; one more equation keeps each step of Newton's method across
the flow at the first point. An equilibrium has no period: there the field vanishes
(field_zeros.py). Parker & Chua, Practical Numerical Algorithms for Chaotic Systems (1989), chapter
5; Ascher, Mattheij & Russell, Numerical Solution of Boundary Value Problems (1995), chapter 4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from saltus.analysis.closed.field_zeros import field_of
from saltus.analysis.solve.deflation import Known
from saltus.analysis.solve.newton import newton
from saltus.analysis.solve.tolerances import SAME
from saltus.flow.maps import Map, Stroboscope

#: Numbers in the matrices that are solved at a time: 64 MB of them.
HELD = 2**23


@dataclass(frozen=True)
class Shooting:
    """Guesses of k closed motions by n points of D states each, and the equations near them: an
    :data:`saltus.analysis.solve.newton.Equations`.

    The unknowns of each are its points, one after the other, and its period, if that is unknown.

    Attributes
    ----------
    map_ : Map
        Of a limit cycle a flow without forcing.
    row : int64[k]
        The row of the map that each belongs to.
    points : float64[k, n, D]
        Where they are.
    scale : float64[k, D]
        Range of each state.
    iterates : int64[k] or 1
        From one point of an orbit to the next.
    time : float64[k], optional
        Period of each limit cycle [s]: unknown. None of orbits of a map.
    longest : float
        Longest period looked for [s]; the equations end at twice as much.
    farthest : float
        So far from the guess they end too, in units of the scale: a motion may run away there.
        Both of limit cycles only.
    """

    map_: Map
    row: np.ndarray
    points: np.ndarray
    scale: np.ndarray
    iterates: np.ndarray | int = 1
    time: np.ndarray | None = None
    longest: float = np.inf
    farthest: float = np.inf

    def __len__(self) -> int:
        return len(self.points)

    def rows(self, which: np.ndarray) -> Shooting:
        """Those of some rows, int64[m] or bool[k]."""
        return replace(
            self,
            row=self.row[which],
            points=self.points[which],
            scale=self.scale[which],
            iterates=self.iterates if isinstance(self.iterates, int) else self.iterates[which],
            time=None if self.time is None else self.time[which],
        )

    @classmethod
    def joined(cls, parts: Sequence[Shooting]) -> Shooting:
        """Those of several, of one map and one number of points."""
        times = [part.time for part in parts if part.time is not None]
        return replace(
            parts[0],
            row=np.concatenate([part.row for part in parts]),
            points=np.concatenate([part.points for part in parts]),
            scale=np.concatenate([part.scale for part in parts]),
            time=np.concatenate(times) if times else None,
        )

    # -- unknowns ----------------------------------------------------------------------------------
    @property
    def width(self) -> int:
        """Number of the unknowns that are points."""
        return int(np.prod(self.points.shape[1:]))

    @property
    def unknowns(self) -> np.ndarray:
        """The guesses, float64[k, z]."""
        return self._with_time(self.points.reshape(len(self), self.width))

    @property
    def units(self) -> np.ndarray:
        """The unit of each unknown, float64[k, z]."""
        return self._with_time(np.tile(self.scale, self.points.shape[1]))

    def _with_time(self, columns: np.ndarray) -> np.ndarray:
        return columns if self.time is None else np.append(columns, self.time[:, None], axis=1)

    def at(self, z: np.ndarray) -> Shooting:
        """The motions that unknowns float64[k, z] stand for."""
        points, time = z[:, : self.width].reshape(-1, *self.points.shape[1:]), z[:, self.width :]
        return replace(self, points=points, time=None if self.time is None else time[:, 0])

    # -- equations ---------------------------------------------------------------------------------
    def __call__(self, z: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Residuals float64[r, z] and derivatives float64[r, z, z] of the rows int64[r] at
        float64[r, z], in units of the unknowns.
        """
        guess = self.rows(rows)
        if guess.time is None:
            residual, derivative, _ = guess.at(z).shots()
            return residual, derivative
        time, shape = z[:, -1], guess.points.shape
        away = np.abs((z - guess.unknowns) / guess.units)[:, :-1].max(axis=1)
        ahead = (time > 0) & (time < 2.0 * self.longest) & (away < self.farthest)
        there = guess.at(np.where(ahead[:, None], z, guess.unknowns))
        gaps, matrix, ends = there.shots()
        residual = np.append(gaps, np.zeros((len(z), 1)), axis=1)
        residual[~ahead] = np.nan
        unit = guess.time[:, None, None] / guess.scale[:, None]
        derivative = np.zeros((len(z), z.shape[1], z.shape[1]))
        derivative[:, :-1, :-1] = matrix
        derivative[:, :-1, -1] = (there.rates(ends) * unit / shape[1]).reshape(gaps.shape)
        derivative[:, -1, : shape[2]] = (there.rates(there.points[:, :1]) * unit)[:, 0]
        return residual, derivative

    def shots(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Differences of images from the next points, float64[k, n D], the derivative with respect
        to the points, float64[k, n D, n D], both in units of the scale, and the images, float64[k,
        n, D].
        """
        k, n, size = self.points.shape
        end, matrix = self.parts().tangent(self.points.reshape(-1, size), self.iterates)
        end, unit = end.reshape(self.points.shape), self.scale[:, None]
        residual = (end - np.roll(self.points, -1, axis=1)) / unit
        matrix = matrix.reshape(k, n, size, size) * unit[..., None, :] / unit[..., None]
        return residual.reshape(k, n * size), less_next(matrix), end

    def parts(self) -> Map:
        """The map from each point to the next, k n rows."""
        n = self.points.shape[1]
        map_ = self.map_.rows(np.repeat(self.row, n))
        if self.time is None:
            return map_
        assert isinstance(map_, Stroboscope)
        return map_.with_period(np.repeat(self.time / n, n))

    def rates(self, states: np.ndarray) -> np.ndarray:
        """Rates at states float64[k, m, D] of a flow."""
        assert isinstance(self.map_, Stroboscope)
        values = self.map_.rows(np.repeat(self.row, states.shape[1])).values
        return field_of(self.map_.system, states.reshape(-1, states.shape[2]), values).reshape(
            states.shape
        )


def less_next(matrices: np.ndarray) -> np.ndarray:
    """The derivative of images less the next points, from those of the images float64[k, n, D, D]:
    float64[k, n D, n D].
    """
    k, n, size = matrices.shape[:3]
    derivative = np.zeros((k, n * size, n * size))
    for i in range(n):
        own = slice(i * size, (i + 1) * size)
        derivative[:, own, own] = matrices[:, i]
    row = np.arange(n * size)
    derivative[:, row, (row + size) % (n * size)] -= 1.0
    return derivative


def close(
    guess: Shooting, known: Known | None = None, max_steps: int | None = None
) -> tuple[np.ndarray, Shooting]:
    """The closed motions that Newton's method finds, ``known`` ones deflated, and the guess that
    led to each, int64[m].
    """
    start, units, found = guess.unknowns, guess.units, np.zeros(len(guess), bool)
    z, width = start.copy(), start.shape[1]
    step = max(1, HELD // (width * max(width, len(known) if isinstance(known, np.ndarray) else 0)))
    for first in range(0, len(guess), step):
        part = np.arange(first, min(first + step, len(guess)))
        zeros = newton(
            guess.rows(part),
            start[part],
            units[part],
            damped=True,
            known=known,
            max_steps=max_steps,
        )
        z[part], found[part] = zeros.z, zeros.found
    if guess.time is not None:
        found &= (z[:, -1] > 0) & (z[:, -1] <= guess.longest * (1.0 + SAME))
    index = np.flatnonzero(found)
    return index, guess.rows(index).at(z[index])
