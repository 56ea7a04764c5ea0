"""The compiled equations of harmonic balance (kernels/harmonics), with the arrays of a call."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.analysis.harmonics.pieces import Intervals
from saltus.analysis.harmonics.series import ROOM
from saltus.flow import polynomials

#: Most nodes of a rule, and the step from one rule to the next, as in kernels/harmonics/sums.py.
MOST_NODES, RULE_STEP = 96, 4


@dataclass(frozen=True)
class LinearSide:
    """The linear side of the equations ``own X - L W = 0``, at a rate of the angle.

    Attributes
    ----------
    own : float64[c (2H + 1)]
    response, by_rate : float64[2, H + 1, c, m]
        Amplitudes of responses to the forces, real and imaginary parts, and their derivatives by
        the rate, times the rate.
    turning : float64[e, u]
        Derivatives of the states that don't move by the unknowns beside the signals.
    factor : float
        Of the rates of the equations.
    timed : bool
        Whether that is the first state that doesn't move.
    """

    own: np.ndarray
    response: np.ndarray
    by_rate: np.ndarray
    turning: np.ndarray
    factor: float
    timed: bool


class Sums:
    """Forces along motions of c signals of H harmonics, integrated, and the equations that they
    stand in.

    Parameters
    ----------
    kernel
        See :func:`saltus.codegen.module.balance_module`.
    shape : tuple of int
        c, H, the number of states that don't move, and of unknowns beside the signals.
    moving : sequence of (int, int)
        Of each state that moves, the signal that it is a derivative of, and how often.
    known : sequence of (int, int)
        Of each slope the force and the state, those by moving states first.
    count : int
        Number of forces.
    jumping : bool[guards]
        Boundaries at which a force may jump.
    numbers : int64[g]
        Boundaries that are cut at, those with linear gaps first.
    linear, most : int
        Number of these, and highest harmonic of all gaps.
    parameters : float64[p]
    degree, bent : int
        See :meth:`saltus.analysis.harmonics.pieces.Intervals.nodes`.
    """

    def __init__(
        self, kernel: Any, shape: tuple[int, int, int, int], moving: Sequence[tuple[int, int]],
        known: Sequence[tuple[int, int]], count: int, jumping: np.ndarray, numbers: np.ndarray,
        linear: int, most: int, parameters: np.ndarray, degree: int, bent: int,
    ) -> None:  # fmt: skip
        c, harmonics, constants, unknowns = shape
        width, states, gaps = 2 * harmonics + 1, len(moving), len(numbers)
        size, entries = c * width, count + len(known)
        columns, both = 1 + size + constants, (2, harmonics + 1, c, count)
        self._kernel = kernel
        self._sizes, self._numbers = np.array([degree, bent, -1, 0]), np.zeros(4)
        place, weigh = _rules()
        self._given = [
            self._sizes, self._numbers, np.zeros((c, width)), np.zeros(constants), parameters,
            np.zeros(constants), np.zeros((constants, unknowns)), np.zeros(size), np.zeros(both),
            np.zeros(both), *_whole(moving), *_whole(known), jumping.astype(np.int64), numbers,
            np.zeros(linear), np.zeros((linear, states)), place, weigh,
        ]  # fmt: skip
        self.residual, self.derivative = np.zeros(size), np.zeros((size, size + unknowns))
        #: Coefficients of the forces and their derivatives; see :class:`.forces.Coefficients`.
        self.whole = np.zeros((count, width, columns))
        self._found = [
            self.residual, self.derivative, self.whole, np.zeros((states, width)),
            np.zeros((gaps, 2 * most + 1)), np.zeros(2 * most + 1), np.zeros(gaps - linear),
            np.zeros((entries, 2 * width - 1)), np.zeros((width, width)),
            np.zeros(2 * width - 1), np.zeros(states + constants), np.zeros(entries),
            np.zeros((2, entries)), np.zeros(len(jumping) * (states + constants)),
            np.zeros(columns), np.zeros((2, columns)), np.zeros(2),
        ]  # fmt: skip
        self._make_room(ROOM * gaps * (2 * most + 2))

    def _make_room(self, room: int) -> None:
        """Arrays for some instants, and the intervals between."""
        more = room + 1
        self._instants = np.zeros(more, np.int64), np.zeros(more), np.zeros(more)
        self._both = np.zeros((2, more), np.int64)
        self._between = np.zeros(more), np.zeros(more), np.zeros(more, np.int64)
        self._call = self._kernel.bound(
            *self._given, *self._instants, self._both, *self._between, *self._found
        )

    def take(
        self, signals: np.ndarray, constants: np.ndarray, rate: float, rate_by: np.ndarray,
        pace: float, linear: LinearSide | None, gaps: tuple[np.ndarray, np.ndarray] | None,
        intervals: Intervals | None,
    ) -> None:  # fmt: skip
        """Compute :attr:`whole`, and :attr:`residual` and :attr:`derivative`, along a motion: by
        the levels and slopes of its gaps, or between known instants.
        """
        given = self._given
        self._numbers[:] = rate, pace, 1.0, 0.0
        given[2][:], given[3][:], given[5][:] = signals, constants, rate_by
        if linear is None:
            given[8][:] = given[9][:] = 0.0
        else:
            given[6][:], given[7][:] = linear.turning, linear.own
            given[8][:], given[9][:] = linear.response, linear.by_rate
            self._numbers[2:] = linear.factor, linear.timed
        if gaps is not None:
            given[16][:], given[17][:] = gaps
        self._sizes[2:] = (-1, 0) if intervals is None else self._cut_at(intervals)
        with np.errstate(all="ignore"):  # as compiled, with the JIT off
            self._call()

    def _cut_at(self, intervals: Intervals) -> tuple[int, int]:
        """Take known instants, and the intervals between; how many of both."""
        instants, count = intervals.instants, len(intervals.begin)
        known = len(instants.angle)
        if max(known, count) >= len(self._between[0]):
            self._make_room(2 * max(known, count))
        for mine, one in zip(
            self._instants, (instants.guard, instants.angle, instants.slope), strict=True
        ):
            mine[:known] = one
        self._both[:, :known] = [_modes(one) for one in (instants.before, instants.behind)]
        begin, length, mode = self._between
        begin[:count], length[:count] = intervals.begin, intervals.length
        mode[:count] = _modes(intervals.bits)
        return known, count


def _modes(bits: np.ndarray) -> np.ndarray:
    """Sides bool[n, guards] as bits of whole numbers, int64[n]."""
    return np.asarray(bits @ (1 << np.arange(bits.shape[1], dtype=np.int64)), np.int64)


def _whole(pairs: Sequence[tuple[int, int]]) -> list[np.ndarray]:
    """The first ones of pairs, and the second ones, int64[n] each."""
    found = np.reshape(np.array(pairs, np.int64), (-1, 2)).T
    return [np.ascontiguousarray(one) for one in found]


@functools.lru_cache(maxsize=1)
def _rules() -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights of the rules of 4, 8, ... nodes, one behind the other."""
    counts = range(RULE_STEP, MOST_NODES + 1, RULE_STEP)
    place, weight = zip(*(polynomials.gauss(count) for count in counts), strict=True)
    return np.concatenate(place), np.concatenate(weight)
