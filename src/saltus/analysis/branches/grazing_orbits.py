"""The equations of orbits that graze a boundary, in two parameters: those of the orbit without the
contact, leg by leg (legs.py), and that its gap touches zero, g = 0 and g' = 0, at a time that is
one of the unknowns.

All of it is smooth, whatever the contact does to a motion that meets it. What it does is seen
behind the graze: a motion that would pass the boundary by a depth d returns after a period with a
gap that the contact has changed by ``s sqrt(d)``. The coefficient s vanishes at a *resonant graze*,
and everywhere if the equations are continuous at the boundary. di Bernardo, Budd, Champneys &
Kowalczyk, Piecewise-smooth Dynamical Systems (2008), chapters 6 and 7; Kowalczyk et al., Int. J.
Bifurcation Chaos 16 (2006) 601 (points of codimension two).
"""

from __future__ import annotations

import numpy as np

from saltus.analysis.branches.contact_sequences import sequences, shift, without
from saltus.analysis.branches.grazes import ContactChange, Gap, nearest_turn, touch, touching
from saltus.analysis.branches.legs import Legs, product
from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.analysis.solve.newton import newton
from saltus.language.derivatives import gradient
from saltus.language.evaluate import evaluate
from saltus.system.leg import frozen

#: Contacts slower than this share of the largest speed, or of that which the acceleration at the
#: graze makes in a period, are grazes: rounding makes them come and go.
SLOW = 1e-4
#: Contacts with its boundary at most so long before or after a graze are the graze, in periods.
TOUCHES = 1e-3
#: Farthest that a second graze lies from the last orbit before it, in units of the scale.
NEAR = 0.1
#: A change of the field at a boundary by a smaller share of it is rounding.
CONTINUOUS = 1e-9


class GrazingOrbits:
    """Curves of orbits that graze one boundary; a ``CurveEquations``.

    Unknowns z: those of :class:`Legs` over two parameters, without the contact that grazes, and the
    time at which the boundary is touched, in periods since the orbit's first point.

    Parameters
    ----------
    legs : Legs
        The equations of the orbits, without the contact that grazes.
    guard, place : int
        The boundary, and the leg on which it is touched.
    """

    kind = "graze"

    def __init__(self, legs: Legs, guard: int, place: int) -> None:
        self.legs, self.guard, self.place = legs, guard, place
        self.gap = Gap(legs, guard, legs.mode_of(place))
        one = np.ones((len(legs.scale), 1))
        self.scale = np.append(legs.scale, one, axis=1)
        self._law = _Law(legs, guard, legs.mode_of(place), self.gap.side)

    @classmethod
    def of(
        cls, orbits: PeriodicOrbits, z: np.ndarray, guard: int, phase: float
    ) -> tuple[GrazingOrbits, np.ndarray] | None:
        """The equations of a graze and its unknowns; None if its orbit isn't made of legs.

        Parameters
        ----------
        orbits : PeriodicOrbits
            Over the two parameters.
        z : float64[z]
            The orbit.
        guard, phase : int, float
            The boundary that it grazes, and when, in periods since its first point.
        """
        sequence = sequences(orbits, z[None])[0]
        if sequence is None or not sequence.flies:
            return None
        n = orbits.n
        apart = np.abs((sequence.phase - phase + 0.5 * n) % n - 0.5 * n)
        slow = SLOW * np.abs(sequence.velocity).max(initial=0.0)
        grazing = [
            i
            for i, one in enumerate(sequence.contacts)
            if (one.guard == guard and apart[i] < TOUCHES) or abs(sequence.velocity[i]) < slow
        ]
        legs, z = Legs.of(orbits, without(sequence, grazing), z, orbits.scale[0])
        place = legs.leg_at(z, phase)
        first = legs.nodes(z[None])[0][0, place]
        legs = legs.near(np.stack([z, z]), np.zeros(2, np.int64))
        return cls(legs, guard, place), np.append(z, first + (phase - first) % n)

    @property
    def parameters(self) -> tuple[int, int]:
        """Columns of the two parameters."""
        return self.legs.width - 2, self.legs.width - 1

    @property
    def bounds(self) -> dict[int, tuple[float, float]]:
        """Ranges of unknowns beside the parameters: none."""
        return {}

    @property
    def itinerary(self) -> str:
        """The contacts of the orbits, without the graze."""
        guards = self.legs.orbits.system.guards
        return " ".join(
            f"{guards[one.guard].name}{'+' if one.direction > 0 else '-'}"
            for one in self.legs.contacts
        )

    def orbit(self, z: np.ndarray) -> np.ndarray:
        """Orbits float64[r, z] by their points at whole periods, and the parameters."""
        return self.legs.orbit(z[:, :-1])

    def at(self, row: int, z: np.ndarray) -> GrazingOrbits:
        """The same equations with a row for each point float64[r, z] of a curve."""
        legs = self.legs.near(z[:, :-1], np.full(len(z), row))
        return GrazingOrbits(legs, self.guard, self.place)

    # -- equations ---------------------------------------------------------------------------------
    def evaluate(self, z: np.ndarray, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See :class:`saltus.analysis.branches.equations.CurveEquations`."""
        (residual, derivative), _, value, slopes = touching(
            self.legs, self.place, self.gap, z, rows
        )
        slopes = slopes * self.scale[rows][:, None]
        unit = np.abs(slopes).max(axis=2)
        column = np.zeros((*derivative.shape[:2], 1))
        whole = np.concatenate([derivative, column], axis=2)
        return (
            np.concatenate([residual, value / unit], axis=1),
            np.concatenate([whole, slopes / unit[..., None]], axis=1),
        )

    def begin(self, z: np.ndarray, rows: np.ndarray) -> None:
        """Take the first points float64[r, z] of the curves."""
        self.accepted(z, rows)

    def accepted(self, z: np.ndarray, rows: np.ndarray) -> None:
        """See :class:`saltus.analysis.branches.equations.CurveEquations`."""
        self.legs.accepted(z[:, :-1], rows)

    def alike(self, z: np.ndarray, rows: np.ndarray) -> np.ndarray:  # noqa: ARG002
        """See :class:`saltus.analysis.branches.equations.CurveEquations`."""
        return z[:, None]

    def multipliers(self, z: np.ndarray, derivative: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Floquet multipliers of the orbits without the contact, complex128[r, D]."""
        return self.legs.multipliers(z[:, :-1], derivative[:, :-2, :-1], rows)

    # -- where it ends -----------------------------------------------------------------------------
    def why_virtual(self, z: np.ndarray) -> str:
        """Reason why the free flow doesn't make an orbit float64[z]; empty if it does."""
        legs = self.legs
        _, _, slopes = touch(legs, self.place, self.gap, z[None])
        rise = slopes[0, 1, -1] * self.gap.side / legs.unit  # of the gap, along the motion
        if rise <= 0:
            return "degenerate_graze"
        phase = legs.nodes(z[None, :-1])[0]
        spans = legs.spans(phase)[0]
        since = z[-1] - phase[0, self.place]
        if legs.contacts and not (spans.min() > 0 and 0 < since < spans[self.place]):
            return "graze_corner"
        if legs.contacts and legs.speeds(z[None, :-1]).min() <= 0:
            return "contacts_change"
        return "" if self._others(z) == [] else "contacts_change"

    def _others(self, z: np.ndarray) -> list[tuple[int, float]] | None:
        """Guards that the free flow meets beside the contacts of an orbit float64[z], and when;
        None if it doesn't meet these.
        """
        legs = self.legs
        free = sequences(legs.orbits, self.orbit(z[None]))[0]
        if free is None:
            return None
        rise = touch(legs, self.place, self.gap, z[None])[2][0, 1, -1]
        keep = without(free, list(np.flatnonzero(np.abs(free.velocity) < SLOW * abs(rise))))
        sequence = legs.sequence_at(z[:-1])
        if (not keep.contacts and not legs.contacts) or shift(sequence, keep, legs.n) is not None:
            return []
        known = sequence.phase % legs.n
        return [
            (one.guard, float(when))
            for one, when in zip(keep.contacts, keep.phase, strict=True)
            if not len(known) or np.abs((when - known + 0.5) % 1.0 - 0.5).min() > TOUCHES
        ]

    def double(self, z: np.ndarray, beyond: np.ndarray) -> np.ndarray | None:
        """The orbit that grazes a second time, next to float64[z] and to another one beyond, which
        meets another boundary; None if none is found.
        """
        legs, others = self.legs, self._others(beyond)
        if not others:
            return None
        guard, phase = others[0]
        place = legs.leg_at(beyond[:-1], phase)
        gap, first = Gap(legs, guard, legs.mode_of(place)), legs.nodes(beyond[None, :-1])[0][0]
        since = (phase - first[place]) % legs.n
        since = nearest_turn(legs, beyond[:-1], place, gap, since)
        row, scale = np.zeros(1, np.int64), np.append(self.scale[0], 1.0)

        def equations(u: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
            residual, derivative = self.evaluate(u[:, :-1], row)
            _, value, slopes = touch(legs, place, gap, np.delete(u, -2, axis=1))
            slopes = np.insert(slopes, -1, 0.0, axis=2) * scale
            unit = np.abs(slopes).max(axis=2)
            whole = np.concatenate([derivative, np.zeros((1, derivative.shape[1], 1))], axis=2)
            return (
                np.append(residual, value / unit, axis=1),
                np.append(whole, slopes / unit[..., None], axis=1),
            )

        found = newton(equations, np.append(z, first[place] + since)[None], scale[None])
        near = np.abs((found.z[0, :-1] - z) / self.scale[0]).max() < NEAR
        return found.z[0, :-1] if found.found[0] and near else None

    # -- normal form -------------------------------------------------------------------------------
    def is_smooth(self, event: ContactChange) -> bool:
        """True if a graze has no square root, since the force begins at zero."""
        carried = self.legs.orbits.parameter_states(self.legs.nodes(event.z[None])[2])[0]
        full, when = np.append(event.state, carried[0]), event.phase * self.legs.unit
        return self._law.is_continuous(np.array([when]), full[None])

    def coefficients(self, z: np.ndarray) -> np.ndarray:
        """The coefficients s of the square root at points float64[r, z], float64[r]."""
        legs, place = self.legs, self.place
        state, _, slopes = touch(legs, place, self.gap, z)
        rise = slopes[:, 1, -1] * self.gap.side / legs.unit
        _, _, others = legs.nodes(z[:, :-1])
        carried = legs.orbits.parameter_states(others)[0]
        when = z[:, -1] * legs.unit
        full = np.concatenate([state, carried], axis=1)
        normals = self.gap.at(when, full)[..., 1 : 1 + legs.size]
        kick = self._law.kick(when, full, normals, rise)
        with np.errstate(invalid="ignore"):
            unit = np.sqrt(2.0 * rise)
        later = np.einsum("rij,rj->ri", returned(legs, z[:, :-1], place, z[:, -1], state), kick)
        slope = np.einsum("ri,ri->r", normals[:, 0], later) * self.gap.side
        return np.asarray(slope * unit + 0.0)


def returned(
    legs: Legs, z: np.ndarray, place: int, when: np.ndarray, state: np.ndarray
) -> np.ndarray:
    """The tangent map of orbits float64[r, z] from a place on a leg, at times float64[r] in periods
    and states float64[r, D], to itself, all periods later, float64[r, D, D].
    """
    size, rows = legs.size, np.zeros(len(z), np.int64)
    at, (phase, _, others) = legs.at(z), legs.nodes(z)
    first, after, span = phase.copy(), at.after.copy(), np.zeros_like(phase)
    first[:, place], after[:, place], span[:, place] = when, state, legs.n
    if legs.contacts:
        span[:, place] = legs.spans(phase)[:, place] - (when - phase[:, place])
    onwards = legs.flights.fly(after, others, first, span)[1][:, place, :, :size]
    if not legs.contacts:
        return onwards
    span = np.zeros_like(phase)
    span[:, place] = when - phase[:, place]
    by_z = legs.along(z, at, span)[1][:, place]
    derivative, here = legs.evaluate(z, rows)[1], place * (size + 1)
    result = np.empty((len(z), size, size))
    for i in range(len(z)):
        segments = legs.segments(at, derivative[i], i, 0)
        around = [segments[(place + 1 + j) % legs.count] for j in range(legs.count - 1)]
        through = by_z[i, :, here + 1 : here + 1 + size]
        back = legs.behind(at, i, place, through, by_z[i, :, here])
        result[i] = back @ product(np.array([np.eye(size), *around])) @ onwards[i]
    return result


def sqrt_coefficient(event: ContactChange) -> float:
    """The coefficient of the square root at an event, see above; NaN unless it is a graze."""
    if event.kind != "graze":
        return np.nan
    orbits = GrazingOrbits(event.legs, event.guards[0], event.place)
    if orbits.is_smooth(event):
        return 0.0
    first = event.legs.nodes(event.z[None])[0][0, event.place]
    when = first + (event.phase - first) % event.legs.n
    return float(orbits.coefficients(np.append(event.z, when)[None])[0])


class _Law:
    """Effect of a boundary on a motion that meets it slowly.

    An impact changes the state at once, and a crossing by the other field for as long as the
    motion is on the other side; both by an amount in proportion to the speed.
    """

    def __init__(self, legs: Legs, guard: int, mode: int, side: int) -> None:
        self._system, self._size = legs.orbits.parametric.system, legs.size
        system, self._side = self._system, side
        law, fields = system.guards[guard].law, system.field[: self._size]
        self.impact = law is not None and bool(law.reset)
        self.known = law is None or (law.kind == "impact" and law.side == side)
        states = system.states[: self._size]
        if self.impact and law is not None:
            after = frozen(system, law.reset[: self._size], mode)
            self._entries = [one for entry in after for one in gradient(entry, states)]
        else:
            here = frozen(system, fields, mode)
            self._entries = [*here, *frozen(system, fields, mode ^ (1 << guard))]

    def kick(
        self, time: np.ndarray, states: np.ndarray, normals: np.ndarray, rise: np.ndarray
    ) -> np.ndarray:
        """Change of the state, float64[r, D], over the speed at which the boundary is met.

        Parameters
        ----------
        time, states
            Where it is grazed, float64[r] and float64[r, E].
        normals : float64[r, 2, D]
            Derivatives of the gap and of its rate with respect to the state.
        rise : float64[r]
            Second derivative of the distance from the boundary along the motion.
        """
        size, r = self._size, len(time)
        if not self.known:
            return np.full((r, size), np.nan)
        columns = self._columns(time, states)
        if self.impact:
            jump = columns.reshape(r, size, size) - np.eye(size)
            along = normals[:, 1] / (normals[:, 1] ** 2).sum(axis=1)[:, None]
            return np.asarray(-self._side * np.einsum("rij,rj->ri", jump, along))
        change = self._change(columns)
        faster, beyond = np.einsum("rki,ri->kr", normals, change) * self._side
        beyond = np.where(faster == 0, rise + beyond, np.nan)  # else the speed itself changes
        with np.errstate(divide="ignore", invalid="ignore"):
            kick = change * (2.0 / beyond)[:, None]
        return np.where(beyond[:, None] > 0, kick, np.nan)

    def is_continuous(self, time: np.ndarray, states: np.ndarray) -> bool:
        """True if there is no impact and no rate changes at the boundary, at times float64[r] in
        states float64[r, E].
        """
        return not self.impact and not self._change(self._columns(time, states)).any()

    def _change(self, columns: np.ndarray) -> np.ndarray:
        """By how much the rates differ beyond the boundary, float64[r, D]."""
        here, beyond = np.split(columns, 2, axis=1)
        change = beyond - here
        small = np.abs(change) <= CONTINUOUS * np.abs(here).max(axis=1)[:, None]
        return np.where(small, 0.0, change)

    def _columns(self, time: np.ndarray, states: np.ndarray) -> np.ndarray:
        """The entries, float64[r, ...]."""
        named = dict(zip(self._system.states, states.T, strict=True))
        values = evaluate(self._entries, t=time, states=named, values=self._system.values)
        return np.stack(np.broadcast_arrays(time, *values)[1:], axis=-1)
