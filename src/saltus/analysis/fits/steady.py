"""Predictions for measured responses: the steady responses that sweeps lead to, and their
derivatives with respect to the unknowns.

An orbit x0 = P(x0, p) moves with the parameters by dx0/dp = (1 - dP/dx0)^-1 dP/dp; both stand in
the columns of one flow over the orbit. Parker & Chua, Practical Numerical Algorithms for Chaotic
Systems (1989), chapter 5.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from saltus.analysis.attractors.grid import grid_of
from saltus.analysis.attractors.grid_responses import find
from saltus.analysis.derivatives.carried import CarriedDerivatives
from saltus.analysis.derivatives.columns import Columns, Turning
from saltus.analysis.derivatives.readings import Readings
from saltus.analysis.derivatives.sensitivity_table import SensitivityRun
from saltus.analysis.fits.measurement import Measurement
from saltus.analysis.fits.sizes import LONGEST, OrbitParts, Size
from saltus.analysis.fits.unknowns import Unknowns
from saltus.analysis.inputs.outputs import outputs_of
from saltus.analysis.inputs.spans import span
from saltus.analysis.inputs.starts import Ensemble
from saltus.analysis.motion.sample_times import NO_SAMPLES, at_times
from saltus.analysis.solve.linear import moves
from saltus.errors import ParameterError
from saltus.flow.methods import Method
from saltus.flow.taylor import Taylor
from saltus.interrupt import Interrupted
from saltus.system import System

#: Forcing periods after which a sweep goes on from a motion that hasn't settled.
PERIODS = 500
#: Longest step of a sweep, in its range: a longer one may jump off a branch.
STEP = 1 / 16
#: The sweeps that responses are looked for by.
SWEEPS = ("sweep_up", "sweep_down")


@dataclass
class SteadyResponses:
    """Steady responses of a system at the frequencies of a measurement. A measured point counts to
    the response of the nearest size.

    Attributes
    ----------
    system, method, measured, unknowns, threads
        As given to the fit.
    size : str
        What was measured of each response.
    flows : int
        Responses computed so far.
    """

    system: System
    method: Method
    measured: Measurement
    unknowns: Unknowns
    size: Size
    threads: int | None = None
    flows: int = 0
    least_step: float = 1e-5
    start: np.ndarray = field(init=False)
    t_start: float = 0.0
    _flow: CarriedDerivatives = field(init=False)

    def __post_init__(self) -> None:
        strange = [name for name in self.unknowns.names if name not in self.system.values]
        if strange or self.system.forced_at in self.unknowns.names:
            name = strange[0] if strange else self.system.forced_at
            raise ParameterError(
                f"{name} can't be free where responses over the frequency were measured: they "
                "forget their starts. Free other parameters."
            )
        self.start = np.zeros(len(self.system.states))
        self._flow = CarriedDerivatives(self.system, self.method, self.unknowns.names)

    def beginning(self, count: int) -> SteadyResponses:
        """Responses have no beginning."""
        raise NotImplementedError

    def plain(self, values: np.ndarray) -> np.ndarray:
        """Sizes of n sets of values float64[n, p], float64[n, M, K]; NaN where no response
        repeats.
        """
        return np.stack([self._nearest(self._at(one))[0] for one in values])

    def with_derivatives(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Sizes for values float64[p], float64[M, K], and their derivatives float64[M, K, p]."""
        system = self._at(values)
        fitted, chosen, orbits = self._nearest(system)
        slopes = np.full((*fitted.shape, len(values)), np.nan)
        for period in sorted({len(one) for _, one in orbits}):
            mine = [i for i, (_, one) in enumerate(orbits) if len(one) == period]
            by = self._slopes(system, [orbits[i] for i in mine], period)
            for place, i in enumerate(mine):
                rows, columns = np.nonzero(chosen == i)
                slopes[rows, columns] = by[place, columns]
        return fitted, slopes

    # -- parts -------------------------------------------------------------------------------------
    def _at(self, values: np.ndarray) -> System:
        return self.system.with_values(
            **dict(zip(self.unknowns.names, values.tolist(), strict=True))
        )

    def _nearest(
        self, system: System
    ) -> tuple[np.ndarray, np.ndarray, list[tuple[float, np.ndarray]]]:
        """For each measured point the nearest size, float64[M, K], its orbit int64[M, K], -1 for
        none, and all orbits: frequency and points float64[n, D].
        """
        name = str(system.forced_at)
        places, place_of = _sweep(self.measured.at)
        fitted = np.full(self.measured.values.shape, np.nan)
        chosen = np.full(fitted.shape, -1)
        orbits: list[tuple[float, np.ndarray]] = []
        for sweep in SWEEPS if len(places) > 1 else (None,):
            grid = grid_of(system, {name: places}, sweep, None, None, 1, None)
            found = find(grid, self.method, PERIODS, self.threads, None, outputs_of(system))
            if not found.complete:
                raise Interrupted
            self.flows += len(places)
            sizes = found.numbers.by_name()[self.size][:, self.measured.columns]
            for i in np.flatnonzero(found.period > 0).tolist():
                off = np.abs(sizes[i] - self.measured.values) < np.abs(
                    np.where(np.isfinite(fitted), fitted - self.measured.values, np.inf)
                )
                nearer = (place_of == found.place[i])[:, None] & off
                fitted[nearer] = np.broadcast_to(sizes[i], fitted.shape)[nearer]
                chosen[nearer] = len(orbits)
                orbits.append((float(places[found.place[i]]), found.points(i)))
        return fitted, chosen, orbits

    def _slopes(
        self, system: System, orbits: list[tuple[float, np.ndarray]], period: int
    ) -> np.ndarray:
        """Derivatives of the sizes of k orbits of some forcing periods, float64[k, K, p]."""
        name, size = str(system.forced_at), len(system.states)
        frequency = np.array([one for one, _ in orbits])
        columns = np.tile(list(system.values.values()), (len(orbits), 1))
        columns[:, list(system.values).index(name)] = frequency
        start = np.array([points[0] for _, points in orbits])
        group = Ensemble(start, columns, {name: frequency}, True)
        length, flow = span(system, group, period, None, 0.0), self._flow
        run = SensitivityRun(
            system=self.system, flow=flow, group=group, method=self.method, length=length,
            plan=NO_SAMPLES, turning=Turning(system, {}, []), closed=None,
            asked=Columns.of(system, self.unknowns.names),
        )  # fmt: skip
        again, request = partial(run.fly, threads=1), flow.request(group, length, NO_SAMPLES)
        outcome = run.fly(request, self.threads)
        there = flow.ends(outcome, group, length)
        if flow.lost(there):
            self.method = Taylor()
            self._flow = CarriedDerivatives(self.system, self.method, flow.names)
            return self._slopes(system, orbits, period)
        end = there.slopes
        moved = moves(end[..., :size] - np.eye(size), end[..., size:])
        weights = np.concatenate([moved, np.tile(np.eye(end.shape[2] - size), (len(end), 1, 1))], 1)
        before, _ = flow.contacts(outcome, group, length, again)
        late = run.contact_times(before, outcome.contacts)
        found = []
        for i, whose in enumerate(weights):
            mine = before.trajectory == i
            parts = OrbitParts.of(
                before.time[mine],
                late[mine] @ whose,
                period * length.period[i],
                LONGEST * length.period[i],
            )
            times, nodes = np.unique(parts.times, return_inverse=True)
            one = Ensemble(start[[i]], columns[[i]], {}, True)
            around = span(system, one, period, None, 0.0)
            asked = flow.request(one, around, at_times(around, 0, times))
            flown = again(replace(asked, record_from=None))
            at = flow.samples(flown, one, around, times[None], slice(None))
            read = Readings(system=self.system, flow=flow, group=one)
            mine = self.measured.columns
            y, by = read.values(at)[nodes][:, mine], (read.slopes(at) @ whose)[nodes][:, mine]
            found.append(parts.slopes(self.size, y, by, 2.0 * np.pi / length.period[i]))
        return np.stack(found)


def _sweep(at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Places of a sweep in steps that are short enough, and where the measured ones are there."""
    own = np.unique(at)
    parts = np.ceil(np.diff(own) / (STEP * np.ptp(own) or 1.0) * (1.0 - 1e-9)).astype(int)
    between = [
        np.linspace(low, high, count, endpoint=False)
        for low, high, count in zip(own[:-1], own[1:], parts, strict=True)
    ]
    places = np.concatenate([*between, own[-1:]])
    return places, np.searchsorted(places, at)
