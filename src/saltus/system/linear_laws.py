"""Laws of contact that a linear flow carries: impacts and rest at rigid stops, and friction that
sticks, by numbers.

At an impact of guard g the closing velocity ``w = n_g z + ...`` becomes ``-e w``: the state changes
by ``-(1 + e) w p_g``, so ``z -> R z + r`` with ``R = I - (1 + e) p_g n_g``. A contact at rest keeps
its gap and its closing velocity at zero, until the acceleration with which it would close without
its own force changes its sign.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import qr

from saltus.contact.guards import is_hold
from saltus.language import expression as ex
from saltus.language.evaluate import evaluate
from saltus.system.linear import SAME, LinearPiece, LinearSystem
from saltus.system.system import System

#: Least pivot of the constraints of held contacts, relative to their largest: those below it follow
#: from the others.
INDEPENDENT = 1e-10


@dataclass(frozen=True)
class Impacts:
    """Laws of all gaps for one set of parameter values; zeros for those without one.

    Attributes
    ----------
    closing : LinearPiece
        The closing velocities; of a friction the velocity of sliding.
    push : float64[gaps, N]
        Change of the state by which the closing velocity becomes one more.
    restitution : float64[gaps]
        Coefficients of restitution; of a friction 1 if its largest force at rest is that in motion,
        so that nothing jumps at its release, else 0.
    """

    closing: LinearPiece
    push: np.ndarray
    restitution: np.ndarray


@dataclass(frozen=True)
class Constrained:
    """The states that some held contacts allow: ``z = base @ (1, drives) + spread @ z[kept]``.

    Attributes
    ----------
    kept : int64[M]
        States that are free to move.
    spread : float64[N, M]
        What all states are for them.
    base : float64[N, 1 + drives]
        What the others are beside that, zero for those that are kept; drives and courses.
    """

    kept: np.ndarray
    spread: np.ndarray
    base: np.ndarray

    def reduced(self, piece: LinearPiece) -> LinearPiece:
        """The equations of the states that are kept."""
        loads = rows_of(piece)[:, len(self.spread) :] + piece.matrix @ self.base
        loads = loads[self.kept]
        return LinearPiece(piece.matrix[self.kept] @ self.spread, loads[:, 0], loads[:, 1:])

    def seen(self, gaps: LinearPiece) -> LinearPiece:
        """Gaps as functions of the states that are kept."""
        loads = rows_of(gaps)[:, len(self.spread) :] + gaps.matrix @ self.base
        return LinearPiece(gaps.matrix @ self.spread, loads[:, 0], loads[:, 1:])

    def put(self, states: np.ndarray, drives: np.ndarray) -> np.ndarray:
        """States float64[m, N] that these contacts hold, for the free ones of some states and the
        drives float64[m, D] there.
        """
        loads = np.column_stack([np.ones(len(states)), drives])
        found: np.ndarray = states[:, self.kept] @ self.spread.T + loads @ self.base.T
        return found

    def levelled(self, gaps: LinearPiece) -> LinearPiece:
        """Gaps as functions of all states, but for those that held contacts keep at a level: these
        are the level alone, without the rounding of terms that cancel.
        """
        n, at = len(self.spread), len(self.kept)
        found = rows_of(self.seen(gaps))
        sizes = np.abs(gaps.matrix) @ np.abs(np.column_stack([self.spread, self.base]))
        sizes[:, at:] += np.abs(rows_of(gaps)[:, n:])
        found[np.abs(found) <= SAME * sizes] = 0.0
        level: np.ndarray = ~np.any(np.delete(found, at, axis=1), axis=1)
        rows = np.where(level[:, None], 0.0, rows_of(gaps))
        rows[level, n] = found[level, at]
        return LinearPiece(rows[:, :n], rows[:, n], rows[:, n + 1 :])


def impacts_of(linear: LinearSystem, values: Mapping[str, float]) -> Impacts:
    """The laws of a system by numbers."""
    guards, n, count = linear.system.guards, len(linear.states), len(linear.own_gaps)
    constraints = [ex.constant(0.0)] * count
    push, restitution = np.zeros((count, n)), np.zeros(count)
    for one in linear.sticking:
        constraints[one.guard] = guards[one.guard].gap
        normal = linear.pieces_of([guards[one.guard].gap], values).matrix[0]
        push[one.guard] = normal / (normal @ normal)
        if not ex.varies(one.limit):
            restitution[one.guard] = float(evaluate([one.limit], values=values)[0] <= 1 + SAME)
    for g, guard in enumerate(guards):
        law = guard.law
        if law is None or law.constraint is None or law.restitution is None:
            continue
        constraints[g] = law.constraint
        normal = linear.pieces_of([law.constraint], values).matrix[0]
        settled = linear.pieces_of(law.settled[:n], values).matrix
        push[g] = (np.eye(n) - settled) @ normal / (normal @ normal)
        restitution[g] = float(evaluate([law.restitution], values=values)[0])
    closing = linear.pieces_of(constraints, values)
    return Impacts(closing, push, restitution)


def constrained(
    system: System, mode: int, gaps: LinearPiece, impacts: Impacts, stays: Sequence[int] = ()
) -> Constrained:
    """The states that the contacts held in a mode (bits) allow, and memories that stay at the
    boundaries of some guards.
    """
    n = gaps.matrix.shape[1]
    held = [
        g.law.partner for i, g in enumerate(system.guards) if g.law and is_hold(g) and mode >> i & 1
    ]
    rows = np.vstack([rows_of(gaps)[[*held, *stays]], rows_of(impacts.closing)[held]])
    if not len(rows):
        return Constrained(np.arange(n), np.eye(n), np.zeros((n, rows.shape[1] - n)))
    pivots = np.sort(_independent(rows[:, :n]))
    rows = rows[np.sort(_independent(rows[:, :n].T))]
    kept = np.setdiff1d(np.arange(n), pivots)
    spread, base = np.zeros((n, len(kept))), np.zeros((n, rows.shape[1] - n))
    spread[kept, np.arange(len(kept))] = 1.0
    spread[pivots] = -np.linalg.solve(rows[:, pivots], rows[:, kept])
    base[pivots] = -np.linalg.solve(rows[:, pivots], rows[:, n:])
    return Constrained(kept, spread, base)


def rows_of(piece: LinearPiece) -> np.ndarray:
    """Coefficients of the states, the constant, those of the drives: float64[rows, N + 1 + D]."""
    return np.column_stack([piece.matrix, piece.constant, piece.driven])


def _independent(matrix: np.ndarray) -> np.ndarray:
    """Columns of a matrix on which all others depend."""
    _, upper, order = qr(matrix, mode="economic", pivoting=True)
    size = np.abs(np.diag(upper))
    found: np.ndarray = order[: len(size)][size > INDEPENDENT * size[0]]
    return found
