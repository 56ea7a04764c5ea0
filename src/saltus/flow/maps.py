"""Maps, of which orbits, attractors, responses and exponents are computed: the stroboscope of a
flow, or any function of states.
"""

from __future__ import annotations

import copy
import functools
import threading
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from saltus.errors import ParameterError, must_be
from saltus.flow import engine
from saltus.flow.flight import Flight
from saltus.flow.methods import Method
from saltus.flow.request import Outcome, Request, Schedule
from saltus.flow.shots import Shots
from saltus.kernels import status as st
from saltus.sentences import Dialect
from saltus.system import System, check_values

#: Step of differences, relative to the range of a state. Errors of rounding and of the fourth order
#: are both about 1e-11 where a contact is a hundredth as deep as the motion is wide.
STEP = 2e-5
#: Samples of the mode in each period, where contacts aren't located.
MODE_SAMPLES = 32
#: Noise of a method relative to a motion, over that relative to a box of starts. Measured for ode45
#: at (1e-4, 1e-7) on the rig's responses: returns scatter by 0.05 to 2 % of their range with
#: location, by 0.3 to 4 % without.
BOX_PER_MOTION = 10.0
#: A mismatch beyond this share of a motion's range is no noise.
MAX_NOISE = 0.03
#: Up to this number of starts one thread moves them, and the overhead around the kernel counts.
FEW = 64
#: Most short runs (by thread, starts and periods) whose arrays a map keeps.
KEPT = 64


class Travel(Protocol):
    """Trajectories of a map that can be advanced; see :class:`saltus.flow.flight.Flight`."""

    age: int

    def __len__(self) -> int: ...

    @property
    def state(self) -> np.ndarray:
        """States now, float64[k, D]."""

    @property
    def going(self) -> np.ndarray:
        """True where a trajectory can go on, bool[k]."""

    @property
    def status(self) -> np.ndarray:
        """Status codes, int64[k]."""

    @property
    def unresolved(self) -> np.ndarray:
        """Grazes too shallow to be certain, int64[k]."""

    def advance(self, periods: int, last: int | None = None) -> np.ndarray:
        """States at the next iterates, float64[k, periods, D]; NaN beyond an age of ``last``."""

    def add(self, other: Any) -> None:
        """Take in the trajectories of another travel of the same map, behind these."""

    def keep(self, wanted: np.ndarray) -> None:
        """Keep only the wanted trajectories, bool[k]."""


def no_period(say: Dialect) -> str:
    """End of the message for a system without forcing."""
    return (
        f"has no forcing period: give {say.key('every')}, the time between two samples of the "
        f"motion, such as {say.key(every='0.1 s')}, about one rotation. Answers don't depend on it."
    )


def forced(say: Dialect) -> str:
    """End of the message where a time is given for a forced one."""
    return f"is forced: it is sampled once a forcing period. Leave {say.key('every')} out."


class Map(Protocol):
    """A map of states to states. k points, D states.

    A map has one row of parameter values for all points, or a row for each of them: row i of all
    arrays then belongs to row i.

    Attributes
    ----------
    states : tuple of str
        Their names.
    period : float64[1 or k]
        Time of one iterate [s]; 1 for a map without time.
    """

    states: tuple[str, ...]
    period: np.ndarray

    @property
    def noise(self) -> float:
        """Mismatch of a closed orbit that the map's own errors explain, relative to the range of a
        box of starts.
        """

    @property
    def exact(self) -> bool:
        """True if the map's errors are rounding, so that Newton's method closes orbits."""

    @property
    def exact_map(self) -> Map | None:
        """The map without its errors, for a map that isn't exact; None for an exact one."""

    def noise_of(self, scale: np.ndarray) -> np.ndarray:
        """The noise relative to the ranges float64[m, D] of motions, float64[m]."""

    def rows(self, which: np.ndarray) -> Map:
        """The map of some of the rows: int64[m], with repeats if wanted, or bool[k]. A single row
        is repeated for each of them.
        """

    def launch(self, start: np.ndarray, longest: float) -> Travel:
        """Launch trajectories from float64[k, D], to be advanced by ``longest`` iterates at
        most.
        """

    def tangent(
        self, start: np.ndarray, count: np.ndarray | int, directions: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """Ends float64[k, D] of ``count`` iterates, and the derivative times ``directions``
        (default: identity) float64[k, D, D].
        """

    def sequences(self, start: np.ndarray, count: int) -> tuple[np.ndarray, list[np.ndarray]]:
        """End states after ``count`` iterates, and for each start the contacts on the way: guard
        and direction in one number.
        """


class Stroboscope:
    """The states of a flow at whole forcing periods, as a map.

    Parameters
    ----------
    system : System
        Equations and values.
    method : Method
        The method of integration.
    parameters : float64[k, P], optional
        Values in the order of ``system.values``: one row for all points, or a row for each.
        Default: those of the system.
    every : float or float64[k], optional
        Time between two samples [s]: for systems without forcing.
    threads : int, optional
        Threads for everything but :meth:`launch`.
    """

    def __init__(
        self,
        system: System,
        method: Method,
        parameters: np.ndarray | None = None,
        every: float | np.ndarray | None = None,
        threads: int | None = None,
    ):
        if (every is None) == (system.forced_at is None):
            raise ParameterError(f"{system.name} ", no_period if every is None else forced)
        if every is not None and not (np.isfinite(every) & (np.asarray(every) > 0)).all():
            raise must_be("every", "a positive time", every)
        self.system, self.method, self.states, self.threads = system, method, system.states, threads
        self.parameters = np.atleast_2d(
            np.array(list(system.values.values()) if parameters is None else parameters, float)
        )
        check_values(system, self.values)
        period = system.period(self.values) if every is None else every
        self.period = np.broadcast_to(np.asarray(period, float), len(self)).copy()

    def __len__(self) -> int:
        return len(self.parameters)

    @property
    def values(self) -> Mapping[str, np.ndarray]:
        """Parameter values by name, float64[k] each."""
        return dict(zip(self.system.values, self.parameters.T, strict=True))

    @property
    def noise(self) -> float:
        """See :class:`Map`."""
        return self.method.noise

    @property
    def exact(self) -> bool:
        """See :class:`Map`."""
        return self.method.exact

    @functools.cached_property
    def exact_map(self) -> Stroboscope | None:
        """See :class:`Map`."""
        return None if self.exact else self.by(self.method.companion())

    def noise_of(self, scale: np.ndarray) -> np.ndarray:
        """See :class:`Map`."""
        return np.minimum(BOX_PER_MOTION * self.method.noise_of(scale), MAX_NOISE)

    def by(self, method: Method) -> Stroboscope:
        """The same rows by another method."""
        return self._with(method=method)

    def rows(self, which: np.ndarray, threads: int | None = None) -> Stroboscope:
        """See :class:`Map`; with other threads if they are given."""
        index = np.flatnonzero(which) if which.dtype == bool else which
        index = np.zeros_like(index) if len(self) == 1 else index
        return self._with(
            parameters=self.parameters[index],
            period=self.period[index],
            threads=threads or self.threads,
        )

    def with_parameters(self, parameters: np.ndarray, which: np.ndarray) -> Stroboscope:
        """The rows int64[m] with other parameter values float64[m, P] and the same time of an
        iterate, whatever the forcing's period is.
        """
        return self._with(parameters=parameters, period=self.period[which])

    def with_period(self, time: np.ndarray) -> Stroboscope:
        """The same rows with other times between two samples [s], float64[k]: for systems without
        forcing.
        """
        return self._with(period=np.array(time, float))

    def of_system(self, system: System) -> Stroboscope:
        """The same rows and periods for another system with the same parameters."""
        return self._with(system=system, states=system.states)

    def _with(self, **changed: object) -> Stroboscope:
        other = copy.copy(self)  # the checked arguments don't change
        for derived in ("exact_map", "_tangent_maps", "_shots"):
            other.__dict__.pop(derived, None)
        other.__dict__.update(changed)
        return other

    def launch(self, start: np.ndarray, longest: float) -> Flight:
        """See :class:`Map`. On one thread."""
        return Flight(
            self.system,
            self.method,
            start,
            self.parameters,
            np.broadcast_to(self.period, len(start)).copy(),
            longest,
        )

    def run(
        self,
        start: np.ndarray,
        periods: np.ndarray | int,
        schedule: Schedule | None = None,
        record: int | None = None,
    ) -> Outcome:
        """Integrate over ``periods`` each, with samples at a schedule and the contacts from period
        ``record`` on.
        """
        request = Request.periods(
            start,
            self.parameters,
            self.period,
            periods,
            schedule=schedule or Schedule.none(),
            record_from=record,
        )
        return engine.run(self.system, self.method, request, self.threads)

    def ends(self, start: np.ndarray, count: np.ndarray | int) -> tuple[np.ndarray, np.ndarray]:
        """States float64[k, D] after ``count`` periods, and the status of each, int64[k]: the same
        as :meth:`run` gives, with less overhead for few starts.
        """
        k, periods = len(start), count if isinstance(count, int) else int(np.max(count, initial=0))
        if k > FEW or self.method.fixed:
            outcome = self.run(start, count)
            return outcome.state, outcome.status
        key = threading.get_ident(), k, periods
        shots = self._shots.get(key)
        if shots is None:
            if len(self._shots) >= KEPT:
                self._shots.clear()
            period = np.broadcast_to(self.period, k)
            shots = Shots(self.system, self.method, self.parameters, period, periods)
            self._shots[key] = shots
        return shots.run(start, count)

    @functools.cached_property
    def _shots(self) -> dict[tuple[int, int, int], Shots]:
        """Arrays of short runs made before, by thread, number of starts and periods."""
        return {}

    def tangent(
        self, start: np.ndarray, count: np.ndarray | int, directions: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        """See :class:`Map`."""
        if self._tangent_map(()) is None:
            return self._by_differences(start, count, directions)
        return self._tangent_ends(start, count, directions, ())

    def tangent_by(
        self, start: np.ndarray, count: np.ndarray | int, names: tuple[str, ...]
    ) -> tuple[np.ndarray, np.ndarray] | None:
        """The result of :meth:`tangent`, with a column more for each of some parameters, float64[k,
        D, D + names]: at the same times, whatever the forcing's period is. NaN where a flow can't
        carry such a column; None if it never can.
        """
        if self._tangent_map(names) is None:
            return None
        return self._tangent_ends(start, count, None, names)

    def _tangent_ends(
        self,
        start: np.ndarray,
        count: np.ndarray | int,
        directions: np.ndarray | None,
        names: tuple[str, ...],
    ) -> tuple[np.ndarray, np.ndarray]:
        """Ends and derivatives by the flow that carries them."""
        map_, (k, size) = self._tangent_map(names), start.shape
        assert map_ is not None
        state, status = map_.ends(_with_tangent(start, directions, len(names)), count)
        stopped = (status != st.OK) & (status != st.GRAZE_UNRESOLVED)
        if stopped.any():
            state[stopped] = np.nan
        return state[:, :size], state[:, size:].reshape(k, size, size + len(names))

    def _by_differences(
        self, start: np.ndarray, count: np.ndarray | int, directions: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray]:
        """The result of :meth:`tangent` by central differences of fourth order (Abramowitz and
        Stegun, 25.3.6). Their steps are relative to the range of each state over an iterate. The
        flow is smooth where its equations are steep: how a motion leaves a boundary depends on its
        speed.
        """
        k, size = start.shape
        way = np.broadcast_to(np.eye(size) if directions is None else directions, (k, size, size))
        seen = self.run(start, 1, Schedule.even(1, MODE_SAMPLES)).samples
        ranges = np.where(np.isfinite(seen), np.abs(seen), 0.0).max(axis=1, initial=0.0)
        ranges[ranges == 0.0] = 1.0
        with np.errstate(divide="ignore"):
            step = STEP / (np.abs(way) / ranges[..., None]).max(axis=1)  # of each direction
        step[~np.isfinite(step)] = 0.0
        shifts = step[..., None] * np.array([-2.0, -1.0, 1.0, 2.0])
        points = start[:, None, None] + shifts[..., None] * np.swapaxes(way, 1, 2)[:, :, None]
        each = np.repeat(np.arange(k), 4 * size)
        counts = np.broadcast_to(count, k)
        outcomes = [
            self.run(start, counts),
            self.rows(each).run(points.reshape(-1, size), counts[each]),
        ]
        for outcome in outcomes:
            stopped = (outcome.status != st.OK) & (outcome.status != st.GRAZE_UNRESOLVED)
            outcome.state[stopped] = np.nan
        ends = outcomes[1].state.reshape(k, size, 4, size)
        slopes = np.einsum("s,kjsi->kij", np.array([1.0, -8.0, 8.0, -1.0]) / 12.0, ends)
        still = step[:, None] == 0.0
        return outcomes[0].state, np.where(still, 0.0, slopes / np.where(still, 1.0, step[:, None]))

    def images(
        self, start: np.ndarray, count: np.ndarray | int, directions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Ends float64[k, D] of ``count`` periods, and the derivative times directions float64[k,
        D, m], float64[k, D, m]: where the flow carries few columns, at the cost of these.
        """
        map_, (k, size) = self._tangent_map((), directions.shape[2]), start.shape
        if map_ is None:
            end, derivative = self.tangent(start, count)
            return end, np.asarray(derivative @ directions)
        state, status = map_.ends(np.hstack([start, directions.reshape(k, -1)]), count)
        state[(status != st.OK) & (status != st.GRAZE_UNRESOLVED)] = np.nan
        return state[:, :size], state[:, size:].reshape(directions.shape)

    def carries(self, directions: int) -> bool:
        """True where the flow carries the derivative along so few directions at their cost."""
        return self._tangent_map((), directions) is not None

    def tangent_samples(
        self, start: np.ndarray, count: np.ndarray | int, schedule: Schedule
    ) -> np.ndarray:
        """States at the times of a schedule, float64[k, M, D], by the flow that :meth:`tangent`
        runs, so that no other flow is compiled.
        """
        map_ = self._tangent_map(())
        assert map_ is not None
        outcome = map_.run(_with_tangent(start, None), count, schedule)
        return outcome.samples[:, :, : start.shape[1]]

    def _tangent_map(
        self, names: tuple[str, ...], directions: int | None = None
    ) -> Stroboscope | None:
        """The same rows of the system with its tangents, and the derivatives with respect to some
        parameters, or along some directions only; None if no flow carries these.
        """
        key = names, directions
        if key not in self._tangent_maps:
            system = self.method.tangents(self.system, names, directions)
            self._tangent_maps[key] = None if system is None else self.of_system(system)
        return self._tangent_maps[key]

    @functools.cached_property
    def _tangent_maps(self) -> dict[tuple[tuple[str, ...], int | None], Stroboscope | None]:
        """Maps of the system with its tangents made before, by parameters and directions."""
        return {}

    def sequences(self, start: np.ndarray, count: int) -> tuple[np.ndarray, list[np.ndarray]]:
        """See :class:`Map`."""
        # without located contacts, the sequence of modes seen in the samples stands for them
        if not self.method.records_contacts:
            outcome = self.run(start, count, Schedule.even(count, MODE_SAMPLES))
            return outcome.state, [
                row[np.flatnonzero(np.diff(row, prepend=-1))] for row in outcome.sample_mode
            ]
        outcome = self.run(start, count, record=0)
        contacts = outcome.contacts.rows(~outcome.contacts.chatters)
        codes = np.ravel_multi_index(
            (contacts.kind, contacts.direction + 1, contacts.guard),
            (len(st.CONTACT_KIND), 3, 2**31),
        )
        return outcome.state, np.split(codes, contacts.begins(len(start))[1:-1])


def _with_tangent(
    start: np.ndarray, directions: np.ndarray | None, parameters: int = 0
) -> np.ndarray:
    """States of the system with its tangents, float64[k, D + D (D + parameters)]."""
    k, size = start.shape
    columns = np.zeros((k, size, size + parameters))
    columns[..., :size] = np.eye(size) if directions is None else directions
    return np.hstack([start, columns.reshape(k, size * (size + parameters))])
