"""Largest exponents of trajectories of a flow from neighbours on them, which are compared in all
states and the phase of the forcing.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from saltus.analysis.lyapunov.algorithm import Algorithm
from saltus.analysis.lyapunov.qr import GOOD
from saltus.analysis.recorded.wolf import NOTHING, Growing, default_search, measure, replaced
from saltus.analysis.statistics import CONFIDENCE, RUNNING
from saltus.flow.maps import Stroboscope
from saltus.flow.request import Schedule
from saltus.flow.room import check_room
from saltus.kernels import status as st

#: Samples of a block: dense enough that neighbours on an orbit lie within the widest distance.
SAMPLES = 32
#: Most numbers in the samples of a group of trajectories: 128 MB.
GROUP = 16_000_000


class NeighbourExponents(Algorithm):
    """Largest Lyapunov exponents by the method of Wolf et al."""

    algorithm = "Wolf et al. (1985), fixed evolution time"

    def __init__(self, map_: Stroboscope, start: np.ndarray, *blocks: Any):
        super().__init__(map_, start, *blocks)
        self._found = [NOTHING] * len(start)
        self._status = np.full(len(start), st.NOT_COMPUTED)

    def run(self, progress: Callable[[float], None] | None = None) -> None:
        """Compute all, in groups."""
        k, size = self._start.shape
        check_room(
            self._periods * SAMPLES * (16.0 * size + 32.0),
            f"{SAMPLES} samples in each of {self._periods} periods",
            lambda say: f"Give fewer {say.key('periods')}.",
        )
        schedule = Schedule.even(self._periods, SAMPLES, first=self._transient)
        step = max(GROUP // (self._periods * SAMPLES * size), 1)
        for first in range(0, k, step):
            rows = np.arange(first, min(first + step, k))
            outcome = self.map.rows(rows).run(
                self._start[rows], self._transient + self._periods, schedule
            )
            for i, states in zip(rows, outcome.samples, strict=True):
                if outcome.status[i - first] in GOOD:
                    self._found[i] = self._measure(states, float(self.map.period[i]))
                self._status[i] = outcome.status[i - first]
                if progress:
                    progress((i + 1) / k)

    def _measure(self, states: np.ndarray, period: float) -> Growing:
        wide = np.ptp(states, axis=0)
        points = states[:, wide > 0] / wide[wide > 0]
        if self._every is None:
            angle = 2 * math.pi * (np.arange(len(states)) % SAMPLES) / SAMPLES
            points = np.concatenate(
                [points, 0.5 * np.stack([np.cos(angle), np.sin(angle)], axis=1)], axis=1
            )
        return measure(points, period / SAMPLES, default_search(points, SAMPLES, SAMPLES))

    def columns(self, factor: np.ndarray) -> dict[str, Any]:
        """The columns of the result; exponents, which are per second, are converted to those of a
        block times a factor.
        """
        per_second = factor * self.map.period
        k = len(self._found)
        mean, error, half = (
            self._each(name, per_second)[:, None] for name in ("exponent", "error", "half_width")
        )
        times, running, running_half = (np.full((k, RUNNING), np.nan) for _ in range(3))
        for i, one in enumerate(self._found):
            m = len(one.ends)
            times[i, :m], running[i, :m], running_half[i, :m] = (
                one.ends,
                one.running * per_second[i],
                one.running_half * per_second[i],
            )
        return {
            "kind": [one.kind for one in self._found],
            "response_period": np.zeros(k, np.int64),
            "lyapunov_exponent": mean,
            "lyapunov_error": error,
            "lyapunov_low": mean - half,
            "lyapunov_high": mean + half,
            "independent_batches": [one.batches for one in self._found],
            "block_time": self.map.period,
            "status": [st.STATUS[code][0] for code in self._status.tolist()],
            "running_time": times,
            "running_exponent": running[:, None],
            "running_low": (running - running_half)[:, None],
            "running_high": (running + running_half)[:, None],
            **replaced(self._found),
        }

    def _each(self, name: str, factor: np.ndarray) -> np.ndarray:
        values: np.ndarray = np.array([getattr(one, name) for one in self._found]) * factor
        return values

    def settings(self) -> dict[str, Any]:
        """The settings, as attributes of the result."""
        return {
            "algorithm": self.algorithm,
            "convention": "largest exponent of the flow, its phase included",
            "confidence": CONFIDENCE,
            "periods": self._periods,
            "transient": self._transient,
            "samples_per_block": SAMPLES,
        }
