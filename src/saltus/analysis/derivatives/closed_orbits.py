"""Derivatives of periodic orbits and their multipliers with respect to parameters.

An orbit x = P(x, p) moves by dx/dp = (1 - dP/dx)^-1 dP/dp, with both derivatives from the flow that
carries them over one period; its multipliers are those of dP/dx. Those of a limit cycle need its
period as one more unknown, and move across the flow at the first point. Parker & Chua, Practical
Numerical Algorithms for Chaotic Systems (1989), chapter 5.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from saltus.analysis.derivatives.carried import HELD, CarriedDerivatives, Places
from saltus.analysis.inputs.spans import Span, span
from saltus.analysis.inputs.starts import Ensemble
from saltus.analysis.motion.sample_times import NO_SAMPLES
from saltus.analysis.solve.floquet import across, multipliers
from saltus.analysis.solve.linear import moves
from saltus.errors import ParameterError, SaltusWarning
from saltus.flow.request import Outcome, Request
from saltus.kernels import status as st
from saltus.system import System
from saltus.system.modes import field

#: Newton's steps that close what is nearly an orbit, and the shortest of them, in its size.
STEPS, SHORTEST = 8, 1e-12
#: Distance by which orbits may miss closing, and that which is rounding, in their size.
CLOSED, ROUNDED = 1e-8, 1e-14
#: Step of the differences that give derivatives of multipliers, in the parameter, and the weights
#: of fourth order (Abramowitz and Stegun, 25.3.6).
STEP, SHIFTS = 5e-5, np.array([-2.0, -1.0, 1.0, 2.0])
WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / 12.0

#: Statuses of motions that came to the end of their period.
ENDED = (st.OK, st.GRAZE_UNRESOLVED)
#: Distance of a multiplier from 1 at which an orbit lies at a fold, and at which it is one of a
#: family: others lie beside it at the same values.
FOLD, FAMILY = 1e-6, 1e-12
#: Speed of an impact, in that of a swing of its state, at which a rigid stop is grazed: the changes
#: for which derivatives hold, a millionth here, are as its square.
GRAZE = 1e-3


@dataclass(frozen=True)
class ClosedOrbits:
    """Orbits of n trajectories, and their derivatives with respect to P parameters.

    Attributes
    ----------
    group : Ensemble
        Their first points and their values.
    length : Span
        A period of each.
    weights : float64[n, D + P, P]
        What a column of derivatives with respect to starts and parameters counts for in one with
        respect to a parameter alone, with the start on the orbit; NaN for one of a family.
    period_slope : float64[n, P]
        Derivative of the period.
    multipliers : complex128[n, m]
        The largest first; of a limit cycle without the trivial one.
    multiplier_slope : complex128[n, m, P]
        Their derivatives, by differences of the exact multipliers along the orbit's own motion.
    """

    group: Ensemble
    length: Span
    weights: np.ndarray
    period_slope: np.ndarray
    multipliers: np.ndarray
    multiplier_slope: np.ndarray


def closed_orbits(
    flow: CarriedDerivatives, group: Ensemble, length: Span, run: Callable[[Request], Outcome]
) -> ClosedOrbits:
    """The orbits near first points and periods, closed by Newton's method.

    Raises
    ------
    ParameterError
        If a motion doesn't close, or ends before its period does.
    """
    shots = _Shots(flow, run)
    n = group.size
    for _ in range(STEPS):
        end = shots.ends(group, length)
        miss, unit = end.states - group.start, shots.unit(group, length)
        step, late = shots.moved(end, group, length, miss[..., None])
        step[(np.abs(miss) <= ROUNDED * unit).all(axis=1)] = 0.0  # it may be one of a family
        if not (np.abs(step[..., 0]) > SHORTEST * unit).any():
            break
        values = flow.parameters(group, np.arange(n))
        group = Ensemble.of(group.start + step[..., 0], values, group.batch)
        length = length if shots.forced else Span.of_cycles(length.period + late[:, 0])
    if not (np.abs(miss) <= CLOSED * unit).all():
        raise ParameterError(
            "a motion of start= doesn't close after its period: it is no periodic orbit of these "
            "equations, or so unstable that rounding moves it away."
        )
    own = shots.multipliers(end, group)
    moves, late = shots.moved(end, group, length, shots.by_parameters(end, group))
    moves[near_one(own) <= FAMILY] = np.nan
    count = len(flow.names)
    weights = np.concatenate([moves, np.broadcast_to(np.eye(count), (n, count, count))], axis=1)
    late = late if not shots.forced else shots.period_slope(end, group)
    slopes = np.stack(
        [
            shots.beside(group, length, own, moves[..., c], late[:, c], name)
            for c, name in enumerate(flow.names)
        ],
        axis=2,
    )
    return ClosedOrbits(group, length, weights, late, own, slopes)


def near_one(multipliers: np.ndarray) -> np.ndarray:
    """Distance from 1 of the multiplier that is nearest to it, float64[n]."""
    return np.asarray(np.abs(multipliers - 1.0).min(axis=1, initial=np.inf))


@dataclass(frozen=True)
class _Shots:
    """Runs of a flow over one period."""

    flow: CarriedDerivatives
    run: Callable[[Request], Outcome]

    @property
    def forced(self) -> bool:
        return self.flow.system.forced_at is not None

    def ends(self, group: Ensemble, length: Span) -> Places:
        """The ends of a period, NaN of what has no start. Raises ParameterError if another motion
        ends before.
        """
        outcome = self.run(self.flow.request(group, length, NO_SAMPLES))
        known = np.isfinite(group.start).all(axis=1)
        if (stopped := known & ~np.isin(outcome.status, ENDED)).any():
            word, meaning = st.STATUS[int(outcome.status[stopped][0])][:2]
            raise ParameterError(
                f"a motion beside the orbit ends before its period does, {word}: {meaning}. There "
                "the orbit has no derivatives that can be computed; sl.simulate shows its motion."
            )
        return self.flow.ends(outcome, group, length)

    def rates(self, group: Ensemble) -> np.ndarray:
        """Rates at the first points, float64[n, D]."""
        values = self.flow.parameters(group, np.arange(group.size))
        return field(self.flow.system, np.zeros(group.size), group.start.T, values).T

    def unit(self, group: Ensemble, length: Span) -> np.ndarray:
        """Size of the motion of each state, float64[n, D]."""
        turn = length.period[:, None] / (2.0 * np.pi)
        return np.asarray(np.maximum(np.abs(group.start), np.abs(self.rates(group)) * turn))

    def period_slope(self, end: Places, group: Ensemble) -> np.ndarray:
        """Derivative of the period of forced orbits, float64[n, P]."""
        slope, where = np.zeros((group.size, len(self.flow.names))), self.flow.system.forced_at
        if where in self.flow.names:
            frequency = self.flow.parameters(group, end.trajectory)[where]
            slope[:, self.flow.names.index(where)] = -end.time / frequency
        return slope

    def by_parameters(self, end: Places, group: Ensemble) -> np.ndarray:
        """Derivatives of the state after one period, whose end moves too, float64[n, D, P]."""
        late = self.period_slope(end, group)[:, None]
        parts = end.slopes[..., group.start.shape[1] :]
        return np.asarray(parts + self.flow.rates(end, group)[..., None] * late)

    def moved(
        self, end: Places, group: Ensemble, length: Span, by: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """By how much first points float64[n, D, c] and periods float64[n, c] move where the ends
        move by float64[n, D, c].
        """
        n, size, count = by.shape
        matrix, late = end.slopes[..., :size] - np.eye(size), np.zeros((n, count))
        if self.forced:
            return moves(matrix, by), late
        ahead, there = self.rates(group), self.flow.rates(end, group)
        unit = length.period[:, None]  # the period is an unknown in periods
        matrix = np.concatenate([matrix, (there * unit)[..., None]], axis=2)
        row = np.pad(ahead, ((0, 0), (0, 1)))[:, None]
        found = moves(
            np.concatenate([matrix, row], axis=1), np.concatenate([by, late[:, None]], axis=1)
        )
        return found[:, :size], found[:, size] * unit

    def multipliers(self, end: Places, group: Ensemble) -> np.ndarray:
        """Floquet multipliers, complex128[n, m]."""
        matrices = end.slopes[..., : group.start.shape[1]]
        if not self.forced:
            flows = self.rates(group)
            matrices = np.array([across(*one) for one in zip(matrices, flows, strict=True)])
        return multipliers(matrices[:, None])

    def beside(
        self,
        group: Ensemble,
        length: Span,
        own: np.ndarray,
        move: np.ndarray,
        late: np.ndarray,
        name: str,
    ) -> np.ndarray:
        """Derivatives of multipliers complex128[n, m] by one parameter, as the orbit moves."""
        n = group.size
        each = np.repeat(np.arange(n), len(SHIFTS))
        values = self.flow.parameters(group, each)
        step = STEP * np.where(values[name] == 0.0, 1.0, np.abs(values[name]))
        shift = np.tile(SHIFTS, n) * step
        values[name] = values[name] + shift
        others = Ensemble.of(group.start[each] + shift[:, None] * move[each], values, True)
        periods = int(length.count[0])
        spans = (
            span(self.flow.system, others, periods, None, 0.0)
            if self.forced
            else Span.of_cycles(length.period[each] + shift * late[each])
        )
        found = self.multipliers(self.ends(others, spans), others)
        nearest = np.abs(found[:, None] - own[each][:, :, None]).argmin(axis=2)
        found = np.take_along_axis(found, nearest, axis=1).reshape(n, len(SHIFTS), -1)
        slopes: np.ndarray = np.einsum("s,nsm->nm", WEIGHTS, found)
        return slopes / step.reshape(n, -1)[:, :1]


# -- what is said ----------------------------------------------------------------------------------
def check_orbits(
    names: Sequence[str],
    parameters: Sequence[str],
    periods: Any,
    t_end: Any,
    t_start: Any,
    values: Any,
) -> None:
    """Raise a ParameterError for what periodic orbits have of their own."""
    given = {"periods": periods, "t_end": t_end, "t_start": t_start or None, "values": values}
    wrong = [name for name, value in given.items() if value not in (None, "0 s")]
    if wrong:
        raise ParameterError(
            lambda say: (
                f"periodic orbits have a period and values of their own. Leave {say.key(wrong[0])} "
                "out."
            )
        )
    if len(parameters) < len(names):
        raise ParameterError(
            "a periodic orbit has no start of its own: its derivatives are with respect to "
            "parameters. Leave the starts out of to."
        )


def warn_of_orbits(system: System, result: xr.Dataset, closed: ClosedOrbits) -> None:
    """Say so where derivatives of orbits are infinite, or nearly: at a fold, or at a graze of a
    rigid stop.
    """
    shortest = float(closed.length.period.min())
    near = near_one(closed.multipliers)
    if (near <= FAMILY).any():
        warnings.warn(
            SaltusWarning(
                "a multiplier is 1: the orbit is one of a family, whose orbits lie beside each "
                "other at the same values, as where a play or a slider stays where it is. Which of "
                "them it becomes at other values depends on the past: it has no derivatives, they "
                "are NaN."
            ),
            stacklevel=4,
        )
    elif (near < FOLD).any():
        warnings.warn(
            SaltusWarning(
                f"a multiplier is within {near.min():.1g} of 1: at a fold the derivatives of an "
                "orbit are infinite, so near to it they hold for no change of use. The fold's own "
                "place has derivatives: sl.event_sensitivity."
            ),
            stacklevel=4,
        )
    guards, names = result["contact_guard"].values, result["contact_kind"].values
    for one in system.guards:
        rigid = one.law is not None and one.law.kind == "impact"
        met = guards == one.name
        if not rigid or one.state not in result["output"] or np.isin(names, HELD).any():
            continue
        swing = np.ptp(result["value"].sel(output=one.state).values)
        slow = np.abs(result["contact_velocity"].values[met]) < GRAZE * swing * np.pi / shortest
        if slow.any():
            warnings.warn(
                SaltusWarning(
                    f"the orbit nearly grazes {one.name}. At the graze of a rigid stop the slope "
                    "is infinite on the side with contact, as one over the root of the distance: "
                    "these derivatives hold for very small changes, and for none on the other side."
                ),
                stacklevel=4,
            )
