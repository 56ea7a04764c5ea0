"""Predictions for a measured history: motions from one start, and their derivatives with
respect to the unknowns.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from saltus.analysis.derivatives.carried import CarriedDerivatives, Places
from saltus.analysis.derivatives.readings import Readings
from saltus.analysis.fits.measurement import Measurement
from saltus.analysis.fits.unknowns import Unknowns
from saltus.analysis.inputs.spans import Span, span
from saltus.analysis.inputs.starts import Ensemble, ensemble
from saltus.analysis.motion.sample_times import SampleTimes, at_times
from saltus.errors import ParameterError
from saltus.flow import engine
from saltus.flow.methods import Method
from saltus.flow.taylor import Taylor
from saltus.system import System
from saltus.units import to_si


@dataclass
class Motions:
    """Motions of a system at the times of a measurement.

    Attributes
    ----------
    system, method, measured, unknowns, threads
        As given to the fit.
    start : float64[D]
        [SI], but for the states whose starts are free.
    t_start : float
        [s], unless it is free: then the measured times count from it.
    flows : int
        Motions computed so far.
    """

    system: System
    method: Method
    measured: Measurement
    unknowns: Unknowns
    start: np.ndarray
    t_start: float
    threads: int | None = None
    flows: int = 0
    least_step: float = 1e-8
    _flow: CarriedDerivatives = field(init=False)
    _places: list[int] = field(init=False)

    def __post_init__(self) -> None:
        names = self.unknowns.names
        parameters = tuple(name for name in names if name in self.system.values)
        self._flow = CarriedDerivatives(self.system, self.method, parameters)
        columns = (*(f"{name}(0)" for name in self.system.states), *parameters, "t_start")
        self._places = [columns.index(name) for name in names]

    @classmethod
    def of(
        cls, system: System, method: Method, measured: Measurement, unknowns: Unknowns,
        start: Any, t_start: Any, threads: int | None,
    ) -> Motions:  # fmt: skip
        """The motions of a user's start.

        Raises
        ------
        ParameterError, UnitError
            If the start isn't one start, or the measurement begins before it.
        """
        group = ensemble(system, start, None)
        if group.batch:
            raise ParameterError("a fit takes one start. Give one number for each state.")
        begin, floats = to_si(t_start, "s", "t_start"), "t_start" in unknowns.names
        if floats and begin != 0.0:
            raise ParameterError("t_start is free and given too. Leave one of them out.")
        if measured.at[0] < begin or not measured.at[-1] > begin:
            raise ParameterError(
                f"the measurement is from {measured.at[0]:.9g} s to {measured.at[-1]:.9g} s, and "
                f"the motion starts at {begin:.9g} s. Let it start before the first sample, by "
                "t_start."
            )
        return cls(system, method, measured, unknowns, group.start[0], begin, threads)

    def beginning(self, count: int) -> Motions:
        """Those at the first samples of the measurement."""
        return replace(self, measured=self.measured.beginning(count), flows=0)

    def plain(self, values: np.ndarray) -> np.ndarray:
        """Measured outputs of the motions of n sets of values float64[n, p], float64[n, M, K]; NaN
        behind the end of one that ended early.
        """
        names = self.unknowns.names
        if "t_start" in names or self.system.forced_at in names:  # times of their own
            parts = [self._plain(one[None]) for one in values]
            return np.concatenate(parts)
        return self._plain(values)

    def with_derivatives(self, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Measured outputs of the motion of values float64[p], float64[M, K], and their derivatives
        with respect to these, float64[M, K, p].
        """
        group, length, plan = self._asked(values[None])
        assert plan.given is not None
        time = np.append(length.t_start, plan.given)  # the start tells in which mode it begins
        request = self._flow.request(group, length, at_times(length, 0, time))
        request = replace(request, record_from=None)
        outcome = engine.run(self._flow.flown, self.method.suited_to(1), request, 1)
        self.flows += 1
        at = self._flow.samples(outcome, group, length, time[None], slice(None))
        if self._flow.lost(at):
            self.method = Taylor()
            self._flow = CarriedDerivatives(self.system, self.method, self._flow.names)
            return self.with_derivatives(values)
        read = Readings(system=self.system, flow=self._flow, group=group)
        slopes = read.slopes(at)
        slopes = np.concatenate([slopes, self._by_t_start(read, at, slopes)[..., None]], axis=-1)
        mine = self.measured.columns
        return read.values(at)[1:, mine], slopes[1:, mine][..., self._places]

    # -- parts -------------------------------------------------------------------------------------
    def _asked(self, values: np.ndarray) -> tuple[Ensemble, Span, SampleTimes]:
        """Trajectories, their length and their samples."""
        n, system = len(values), self.system
        start, begin = np.tile(self.start, (n, 1)), self.t_start
        columns = np.tile(list(system.values.values()), (n, 1)).reshape(n, -1)
        for name, column in zip(self.unknowns.names, values.T, strict=True):
            if name in system.values:
                columns[:, list(system.values).index(name)] = column
            elif name == "t_start":
                begin = float(column[0])
            else:
                start[:, system.states.index(name.removesuffix("(0)"))] = column
        group = Ensemble(start, columns if n > 1 else columns[:1], {}, n > 1)
        since = begin if "t_start" in self.unknowns.names else 0.0
        time = self.measured.at + since
        length = span(system, group, None, float(time[-1]), begin)
        return group, length, at_times(length, 0, time)

    def _plain(self, values: np.ndarray) -> np.ndarray:
        group, length, plan = self._asked(values)
        request = replace(plan.request(group, length, len(self.system.states)), record_from=None)
        method = self.method.suited_to(group.size)
        outcome = engine.run(self.system, method, request, self.threads)
        self.flows += group.size
        assert plan.given is not None
        shape = outcome.samples.shape
        at = Places(
            np.tile(plan.given, shape[0]),
            outcome.samples.reshape(-1, shape[2]),
            np.zeros((0, 0, 0)),
            outcome.sample_mode.ravel(),
            np.repeat(np.arange(shape[0]), shape[1]),
        )
        read = Readings(system=self.system, flow=self._flow, group=group)
        return read.values(at).reshape(*shape[:2], -1)[..., self.measured.columns]

    def _by_t_start(self, read: Readings, at: Places, slopes: np.ndarray) -> np.ndarray:
        """Derivatives of what is read by the time at which the motion starts, at one time since
        then: float64[m, K]; the first place is the start.
        """
        if "t_start" not in self.unknowns.names:
            return np.zeros(slopes.shape[:2])
        size = len(self.system.states)
        still = replace(at, slopes=np.zeros_like(at.slopes))
        along = read.slopes(still, np.ones((len(at.time), at.slopes.shape[2])))[..., 0]
        return np.asarray(along - slopes[..., :size] @ self._flow.rates(at, read.group)[0])
