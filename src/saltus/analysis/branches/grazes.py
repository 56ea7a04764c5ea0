"""Grazes and corners: the orbits of a branch at which a contact appears or vanishes, or two
contacts come at once and change their order.

A graze is the orbit without the contact that touches the boundary: R = 0, g(y(t)) = 0 and
g'(y(t)) = 0 in the orbit, the parameter and the time t, with the legs of the orbit (legs.py) in R.
All of it is smooth, whatever the contact does to a motion that meets it, so Newton's method finds
it to rounding. At a corner a leg lasts no time.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from saltus.analysis.branches.legs import Legs
from saltus.analysis.solve.newton import newton
from saltus.language.derivatives import gradient, time_derivative
from saltus.language.evaluate import evaluate
from saltus.language.expression import Expr, add, mul
from saltus.system import System
from saltus.system.leg import frozen

#: Places along a leg at which its gap is looked at for a first guess.
LOOKS = 200


@dataclass(frozen=True)
class ContactChange:
    """An orbit at which a contact sequence changes.

    Attributes
    ----------
    kind : str
        ``graze`` or ``corner``.
    guards : tuple of int
        The guard that is grazed; the two that are met at once.
    phase : float
        When, in periods since the orbit's first point.
    legs : Legs
        The orbit's equations, without the contact that grazes.
    z : float64[z]
        The orbit in them.
    place : int
        The leg on which it happens.
    state : float64[D]
        There.
    slope : float64[z]
        Derivative of the gap that grazes with respect to the orbit; of a corner, of the time
        between the contacts.
    derivative : float64[.., z]
        Of the orbit's equations.
    """

    kind: str
    guards: tuple[int, ...]
    phase: float
    legs: Legs
    z: np.ndarray
    place: int
    state: np.ndarray
    slope: np.ndarray
    derivative: np.ndarray

    @cached_property
    def multipliers(self) -> np.ndarray:
        """Floquet multipliers of the orbit, complex128[D]."""
        row = np.zeros(1, np.int64)
        return np.asarray(self.legs.multipliers(self.z[None], self.derivative[None], row)[0])

    @cached_property
    def orbit(self) -> np.ndarray:
        """The orbit by its points at whole periods, float64[z]."""
        return np.asarray(self.legs.orbit(self.z[None])[0])


class Gap:
    """A gap in one mode, its rate along the flow, and their derivatives."""

    def __init__(self, legs: Legs, guard: int, mode: int) -> None:
        self._system, self._size = legs.orbits.parametric.system, legs.size
        system, self.side = self._system, 1 if mode >> guard & 1 else -1
        self._entries = _entries(system, guard, mode)

    def at(self, time: np.ndarray, states: np.ndarray) -> np.ndarray:
        """The gap, its derivatives with respect to states and time, and those of its rate, at times
        float64[k] in states float64[k, E]: float64[k, 2, E + 2].
        """
        named = dict(zip(self._system.states, states.T, strict=True))
        values = evaluate(self._entries, t=time, states=named, values=self._system.values)
        columns = np.empty((len(time), len(values)))
        for column, value in zip(columns.T, values, strict=True):
            column[:] = value
        return columns.reshape(len(time), 2, -1)


@lru_cache(maxsize=128)
def _entries(system: System, guard: int, mode: int) -> tuple[Expr, ...]:
    """A gap in one mode and its rate, each with its derivatives."""
    gap, *rates = frozen(system, (system.guards[guard].gap, *system.field), mode)
    rate: Expr = time_derivative(gap)
    for slope, speed in zip(gradient(gap, system.states), rates, strict=True):
        rate = add(rate, mul(slope, speed))
    return tuple(
        entry
        for one in (gap, rate)
        for entry in (one, *gradient(one, system.states), time_derivative(one))
    )


def graze(legs: Legs, z: np.ndarray, guard: int, phase: float) -> ContactChange | None:
    """The orbit that touches a boundary, by Newton's method from another one.

    Parameters
    ----------
    legs : Legs
        The orbit's equations, without the contact that grazes.
    z : float64[z]
        An orbit near it.
    guard : int
        The boundary.
    phase : float
        About when, in periods since the orbit's first point.
    """
    place = legs.leg_at(z, phase)
    gap = Gap(legs, guard, legs.mode_of(place))
    begins = legs.nodes(z[None])[0][0, place]
    phase = nearest_turn(legs, z, place, gap, (phase - begins) % legs.n) + begins
    row, scale = np.zeros(1, np.int64), np.append(legs.scale[0], 1.0)
    state, slope = np.empty(legs.size), np.empty(len(z))

    def equations(u: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        (residual, by_z), states, value, slopes = touching(legs, place, gap, u, row)
        state[:], slope[:] = states[0], slopes[0, 0, :-1]
        whole = np.zeros((1, len(scale), len(scale)))
        whole[:, :-2, :-1], whole[:, -2:] = by_z, slopes * scale
        unit = np.abs(whole[:, -2:]).max(axis=2)
        whole[:, -2:] /= unit[..., None]
        return np.concatenate([residual, value / unit], axis=1), whole

    legs.accepted(z[None], row)
    found = newton(equations, np.append(z, phase)[None], scale[None])
    if not found.found[0]:
        return None
    z, phase = found.z[0, :-1], float(found.z[0, -1]) % legs.n  # the last step was rounding
    derivative = found.derivative[0, :-2, :-1]
    return ContactChange("graze", (guard,), phase, legs, z, place, state, slope, derivative)


def touch(
    legs: Legs, place: int, gap: Gap, u: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The state on a leg at a time, the gap there and its rate, and their derivatives with respect
    to the orbit and the time: float64[k, D], float64[k, 2], float64[k, 2, z + 1].
    """
    return touching(legs, place, gap, u, np.zeros(len(u), np.int64))[1:]


def touching(
    legs: Legs, place: int, gap: Gap, u: np.ndarray, rows: np.ndarray
) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray, np.ndarray, np.ndarray]:
    """Results of :meth:`Legs.evaluate` and of :func:`touch` for orbits float64[k, z + 1], whose
    last entry is a time: all flights are computed in one call.
    """
    z, when, size = u[:, :-1], u[:, -1], legs.size
    first, _, others = legs.nodes(z)
    at, until = legs.at(z), when[:, None] - first[:, [place]]
    spans = np.concatenate([legs.spans(first), until], axis=1)
    state, by_z, by_time = legs.along(z, at, spans, [place])
    closed = legs.closed(z, rows, at, state[:, :-1], by_z[:, :-1], by_time[:, :-1])
    state, by_z, by_time = state[:, -1], by_z[:, -1], by_time[:, -1]
    carried, slopes, order = legs.orbits.parameter_states(others)
    found = gap.at(when * legs.unit, np.concatenate([state, carried], axis=1))
    value, normal, by_clock = found[..., 0], found[..., 1:-1], found[..., -1] * legs.unit
    entries = normal[..., :size] @ by_z
    entries[..., legs.count * (size + 1) + order] += normal[..., size:] * slopes[:, None]
    last = (normal[..., :size] @ by_time[..., None])[..., 0] + by_clock
    return closed, state, value, np.concatenate([entries, last[..., None]], axis=2)


def nearest_turn(legs: Legs, z: np.ndarray, place: int, gap: Gap, since: float) -> float:
    """Time after a contact [periods] at which the motion turns away from the boundary: the one
    nearest to the time ``since``, or ``since`` itself if there is none.
    """
    first, _, others = legs.nodes(z[None])
    spans, state = legs.flight(z, place, LOOKS)
    carried = np.repeat(legs.orbits.parameter_states(others)[0], len(spans), axis=0)
    found = gap.at((first[0, place] + spans) * legs.unit, np.concatenate([state, carried], axis=1))
    rate = found[:, 1, 0] * gap.side
    turns = np.flatnonzero((rate[:-1] <= 0) & (rate[1:] > 0))
    if not len(turns):
        return since
    middle = spans[turns] + (spans[1] - spans[0]) * rate[turns] / (rate[turns] - rate[turns + 1])
    return float(middle[np.abs(middle - since).argmin()])


def corner(legs: Legs, z: np.ndarray, place: int) -> ContactChange | None:
    """The orbit that meets two boundaries at once, by Newton's method from another one.

    Parameters
    ----------
    legs : Legs
        The orbit's equations.
    z : float64[z]
        An orbit near it.
    place : int
        The leg that vanishes.
    """
    row, after = np.zeros(1, np.int64), (place + 1) % legs.count
    width = legs.size + 1

    def equations(u: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        residual, derivative = legs.evaluate(u, row)
        last = np.zeros((1, 1, u.shape[1]))
        last[0, 0, after * width] += 1.0
        last[0, 0, place * width] -= 1.0
        span = legs.spans(legs.nodes(u)[0])[:, [place]]
        return np.append(residual, span, axis=1), np.append(derivative, last, axis=1)

    found = newton(equations, z[None], legs.scale)
    if not found.found[0]:
        return None
    u = found.z
    guards = (legs.contacts[place].guard, legs.contacts[after].guard)
    phase = float(legs.nodes(u)[0][0, place]) % legs.n
    slope = np.zeros(len(z))
    slope[after * width], slope[place * width] = 1.0, -1.0
    state = legs.nodes(u)[1][0, place]
    derivative = found.derivative[0, :-1]
    return ContactChange("corner", guards, phase, legs, u[0], place, state, slope, derivative)
