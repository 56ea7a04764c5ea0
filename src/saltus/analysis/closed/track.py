"""A periodic orbit, limit cycle or equilibrium followed to other parameter values, in few steps.

Newton's method begins at the motion of the old values. Where it fails, or goes too far or too
slowly to be sure of the same motion, it takes half the way first, then goes on along the secant.
Allgower & Georg, Introduction to Numerical Continuation Methods (2003), chapter 6: a step is good
where the second step of Newton's method is much shorter than the first. A branch with all that
happens on it is :func:`saltus.branches`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from saltus.analysis.closed.all_orbits import Orbits
from saltus.analysis.closed.cycles import ASIDE, find_cycles
from saltus.analysis.closed.field_zeros import autonomous, find_equilibria
from saltus.analysis.closed.motions import ClosedMotion, ClosedMotions
from saltus.analysis.closed.periodic_orbits import exact_method
from saltus.analysis.solve.newton import newton
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.flow.request import Schedule
from saltus.system import System
from saltus.units import from_si

#: Shortest step, as a share of the way between the values.
SHORTEST = 1.0 / 1024
#: Most tries of Newton's method, failed ones included.
MOST_TRIES = 80
#: Largest second step of Newton's method, in first ones.
CONTRACTS = 0.3
#: Steps of Newton's method: at this contraction six reach rounding.
STEPS = 8
#: Farthest that a point goes in one step, in units of the range of the motion.
FARTHEST = 0.3
#: A motion folds where its multipliers foresee it within so many of the steps that failed.
FORESEEN_STEPS = 8.0
#: Samples of a motion from which its ranges are taken, a forcing period.
SAMPLES = 32


@dataclass(frozen=True)
class Tracked:
    """A motion that was followed to other values.

    Attributes
    ----------
    motion : ClosedMotion
        At the new values; where it was lost the last one on the way.
    stable : bool
        Whether it attracts.
    values : mapping of str to float
        The parameter values of ``motion`` [SI].
    lost : str
        Where it was lost, such as ``folded between 17.81 Hz and 17.82 Hz``; "" if it wasn't.
    """

    motion: ClosedMotion
    stable: bool
    values: Mapping[str, float]
    lost: str = ""


def track(
    system: System,
    motion: ClosedMotion,
    before: Mapping[str, float],
    values: Mapping[str, float],
    method: Method | None = None,
) -> Tracked:
    """Follow a closed motion from some parameter values to others, stable or not.

    Takes some milliseconds where one step does, as under a slider, and MOST_TRIES tries of
    Newton's method at most.

    Parameters
    ----------
    system : System
        The equations.
    motion : ClosedMotion
        At the values ``before``: of a forced system by its points at whole periods, of another one
        a limit cycle (``time`` above 0) or an equilibrium.
    before, values : mapping of str to float
        Where it stands, and where it is wanted [SI]; parameters that aren't named have the
        system's values.
    method : Method
        One whose errors are rounding; default :class:`saltus.Taylor`, or :class:`saltus.Modal`
        where it serves.

    Returns
    -------
    Tracked

    Raises
    ------
    ParameterError, UnitError
        If values or method can't be used.
    """
    method = exact_method(method, system)
    start, end = (system.with_values(**one) for one in (before, values))
    way = _Way(start, end, method, motion)
    at, step, tries = 0.0, 1.0, 0
    while at < 1.0:
        tries += 1
        step = min(step, 1.0 - at)
        if way.go_to(at + step):
            at, step = (1.0 if at + step >= 1.0 else at + step), 2.0 * step
        elif step <= SHORTEST or tries >= MOST_TRIES:
            return replace(way.here(), lost=way.loss(at, at + step))
        else:
            step *= 0.5
    return way.here()


@dataclass(frozen=True)
class _OnTheWay:
    """The motion at a share of the way: its points as they are solved for, its period [s]."""

    at: float
    motion: ClosedMotions
    points: np.ndarray
    time: float


class _Way:
    """The way from one system to another one that differs in values alone."""

    def __init__(self, start: System, end: System, method: Method, motion: ClosedMotion) -> None:
        self._start, self._end, self._method = start, end, method
        self._forced = not autonomous(start)
        time = math.nan if self._forced else (motion.time if motion.time > 0 else 0.0)
        whole = ClosedMotions.none(1, motion.points.shape[1])
        whole.period[0], whole.points[0, : motion.period] = motion.period, motion.points
        whole.multipliers[0], whole.mismatch[0], whole.time[0] = (
            motion.multipliers,
            motion.mismatch,
            time,
        )
        self._places = [_OnTheWay(0.0, whole, motion.points, time)]

    def here(self) -> Tracked:
        """The motion that was reached last."""
        last = self._places[-1]
        values = self._system(last.at).values
        return Tracked(last.motion[0], bool(last.motion.stable[0]), dict(values))

    def _system(self, at: float) -> System:
        if at in (0.0, 1.0):
            return self._end if at else self._start
        one, other = self._start.values, self._end.values
        changed = {
            name: value + at * (other[name] - value)
            for name, value in one.items()
            if other[name] != value
        }
        return self._start.with_values(**changed)

    def go_to(self, at: float) -> bool:
        """Close the motion at a share of the way; False if it can't be sure to be the same."""
        last, system = self._places[-1], self._system(at)
        points, time = last.points, last.time
        if len(self._places) > 1:  # along the secant
            older = self._places[-2]
            ahead = (at - last.at) / (last.at - older.at)
            points, time = (
                points + ahead * (points - older.points),
                time + ahead * (time - older.time),
            )
        found = (self._orbit if self._forced else self._unforced)(system, points, time, at)
        if found is None:
            return False
        self._places.append(found)
        return True

    def _orbit(
        self, system: System, points: np.ndarray, time: float, at: float
    ) -> _OnTheWay | None:
        map_ = Stroboscope(system, self._method, threads=1)
        scale = _ranges(map_, points)
        guess = Orbits(map_, scale).guess(points[None])
        zeros = newton(guess, guess.unknowns, guess.units, longest_step=FARTHEST, max_steps=STEPS)
        moved = np.abs((zeros.z - guess.unknowns) / guess.units).max()
        if not zeros.found[0] or zeros.contraction[0] > CONTRACTS or moved > FARTHEST:
            return None
        closed = guess.at(zeros.z)
        one = Orbits(map_, scale).motion(closed)
        if one is None:
            return None
        motion = ClosedMotions.none(1, points.shape[1])
        motion.period[0], motion.points[0, : one.period] = one.period, one.points
        motion.multipliers[0], motion.mismatch[0] = one.multipliers, one.mismatch
        return _OnTheWay(at, motion, closed.points[0], time)

    def _unforced(
        self, system: System, points: np.ndarray, time: float, at: float
    ) -> _OnTheWay | None:
        map_ = Stroboscope(system, self._method, every=time or 1.0, threads=1)
        sizes = np.abs(points).max(axis=0)
        scale = np.ptp(points, axis=0) if time > 0 else sizes
        scale = np.where(scale > 0, scale, max(float(sizes.max()), 1.0))[None]
        if time > 0:
            aside = points[ASIDE][None]
            motion, moved = find_cycles(map_, aside, np.array([time]), scale)
        else:
            motion = find_equilibria(map_, points[:1], scale)
            moved = np.abs((motion.points[:, 0] - points[:1]) / scale).max(axis=1)
        same = motion.period[0] > 0 and moved[0] <= FARTHEST
        if not same or (time > 0 and abs(motion.time[0] / time - 1.0) > FARTHEST):
            return None
        return _OnTheWay(at, motion, motion[0].points, float(motion.time[0]))

    # -- where it is lost --------------------------------------------------------------------------
    def loss(self, at: float, beyond: float) -> str:
        """A few words on a motion that was followed to one share of the way, and not to another."""
        one, other = (self._system(share).values for share in (at, beyond))
        moved = [name for name, value in one.items() if other[name] != value]
        places = [
            " and ".join(
                _text(self._start, name, end[name], abs(other[name] - one[name]))
                for end in (one, other)
            )
            for name in moved
        ]
        where = ", ".join(
            text if len(moved) == 1 else f"{name} {text}"
            for name, text in zip(moved, places, strict=True)
        )
        return f"{'folded' if self._folds(beyond - at) else 'lost'} between {where}"

    def _folds(self, step: float) -> bool:
        """True where the square of det(M - 1), M the monodromy matrix, or of the determinant of the
        Jacobian, vanishes within a few of the failed steps: beside a fold it is linear.
        """
        if len(self._places) < 3:
            return False
        older, last = self._places[-2:]
        with np.errstate(divide="ignore"):
            falls = np.log(_from_fold(last)).sum() - np.log(_from_fold(older)).sum()
        square = math.exp(2.0 * min(falls, 0.0))
        return square < 1.0 and square / (1.0 - square) * (last.at - older.at) <= (
            FORESEEN_STEPS * step
        )


def _from_fold(place: _OnTheWay) -> np.ndarray:
    """Distances of the multipliers from 1, or of the eigenvalues from 0."""
    motion = place.motion[0]
    rests = place.time == 0
    return np.asarray(np.abs(motion.multipliers if rests else motion.transverse - 1.0))


def _text(system: System, name: str, value: float, apart: float) -> str:
    """A value with its unit, to a tenth of what tells two of them apart."""
    digits = 2 + math.ceil(math.log10(max(abs(value), apart) / apart)) if apart > 0 else 6
    return from_si(value, system.units.get(name, ""), digits)


def _ranges(map_: Stroboscope, points: np.ndarray) -> np.ndarray:
    """Range of each state over an orbit, float64[D]; 1 for one that doesn't move."""
    seen = map_.run(points, 1, Schedule.even(1, SAMPLES)).samples.reshape(-1, points.shape[1])
    seen = np.concatenate([seen[np.isfinite(seen).all(axis=1)], points])
    wide = np.ptp(seen, axis=0)
    return np.where(wide > 0, wide, 1.0)
