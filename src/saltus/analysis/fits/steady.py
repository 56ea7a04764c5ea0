"""Predictions for measured responses: the steady responses that sweeps lead to, and their
derivatives with respect to the unknowns.

An orbit x0 = P(x0, p) moves with the parameters by dx0/dp = (1 - dP/dx0)^-1 dP/dp; both stand in
the columns of one flow over the orbit. Parker & Chua, Practical Numerical Algorithms for Chaotic
Systems (1989), chapter 5.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from saltus.analysis.attractors.grid import grid_of
from saltus.analysis.attractors.grid_responses import find
from saltus.analysis.derivatives.carried import CarriedDerivatives
from saltus.analysis.derivatives.readings import Readings
from saltus.analysis.fits.measurement import Measurement
from saltus.analysis.fits.unknowns import Unknowns
from saltus.analysis.inputs.outputs import outputs_of
from saltus.analysis.inputs.spans import span
from saltus.analysis.inputs.starts import Ensemble
from saltus.analysis.motion.sample_times import planned
from saltus.analysis.solve.linear import moves
from saltus.errors import ParameterError
from saltus.flow import engine
from saltus.flow.methods import Method
from saltus.interrupt import Interrupted
from saltus.system import System

Size = Literal["amplitude", "rms", "peak"]
#: Samples of a forcing period from which sizes are taken: they err by its square, 1e-5.
SAMPLES = 512
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
            sizes, by = self._sizes(system, [orbits[i] for i in mine], period)
            for place, i in enumerate(mine):
                rows, columns = np.nonzero(chosen == i)
                fitted[rows, columns] = sizes[place, columns]
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

    def _sizes(
        self, system: System, orbits: list[tuple[float, np.ndarray]], period: int
    ) -> tuple[np.ndarray, np.ndarray]:
        """Sizes of k orbits of some forcing periods, float64[k, K], and their derivatives
        float64[k, K, p].
        """
        name, size = str(system.forced_at), len(system.states)
        frequency = np.array([one for one, _ in orbits])
        columns = np.tile(list(system.values.values()), (len(orbits), 1))
        columns[:, list(system.values).index(name)] = frequency
        start = np.array([points[0] for _, points in orbits])
        group = Ensemble(start, columns, {name: frequency}, True)
        length = span(system, group, period, None, 0.0)
        plan = planned(system, group, length, SAMPLES, None, 2 * len(self._flow.flown.states))
        request = replace(self._flow.request(group, length, plan), record_from=None)
        method = self.method.suited_to(group.size)
        outcome = engine.run(self._flow.flown, method, request, self.threads)
        time, _ = plan.of_result(outcome, length, True)
        time = np.broadcast_to(time, (group.size, time.shape[-1]))
        at = self._flow.samples(outcome, group, length, time, plan.reached(outcome))
        read = Readings(system=self.system, flow=self._flow, group=group)
        values = read.values(at).reshape(*time.shape, -1)
        slopes = read.slopes(at).reshape(*values.shape, -1)
        end = slopes[:, -1, :size]
        moved = moves(end[..., :size] - np.eye(size), end[..., size:])
        along = slopes[..., size:] + np.einsum("ktod,kdp->ktop", slopes[..., :size], moved)
        mine = self.measured.columns
        return _size_of(self.size, values[:, :-1, mine], along[:, :-1, mine])


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


def _size_of(size: Size, y: np.ndarray, by: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Size of samples float64[k, t, K] over whole periods, and its derivatives, of those of the
    samples float64[k, t, K, p].
    """
    if size == "amplitude":
        turn = np.exp(-2j * np.pi * np.arange(y.shape[1]) / SAMPLES) * 2.0 / y.shape[1]
        whole, moved = np.einsum("kto,t->ko", y, turn), np.einsum("ktop,t->kop", by, turn)
        amplitude = np.abs(whole)
        return amplitude, (np.conj(whole)[..., None] * moved).real / amplitude[..., None]
    if size == "rms":
        rms = np.sqrt((y**2).mean(axis=1))
        return rms, (y[..., None] * by).mean(axis=1) / rms[..., None]
    place = np.abs(y).argmax(axis=1)[:, None]
    peak = np.take_along_axis(y, place, 1)[:, 0]
    moved = np.take_along_axis(by, place[..., None], 1)[:, 0]
    return np.abs(peak), np.sign(peak)[..., None] * moved
