"""Exponents of many trajectories of a flow, computed in groups to bound the memory, as columns of a
result.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from saltus.analysis.closed.field_zeros import autonomous, find_equilibria
from saltus.analysis.closed.measures import measure
from saltus.analysis.closed.motions import ClosedMotion
from saltus.analysis.lyapunov.algorithm import Algorithm
from saltus.analysis.lyapunov.qr import AT_REST, GOOD, SEGMENT
from saltus.analysis.lyapunov.segments import TangentFlow
from saltus.analysis.lyapunov.spectrum import Spectrum, spectrum
from saltus.analysis.solve.tolerances import SAME
from saltus.analysis.statistics import CONFIDENCE, running_ends
from saltus.flow.maps import Stroboscope
from saltus.kernels import status as st
from saltus.results.dataset.kinds import Kind

#: Most numbers in the tangents of one segment of a group: 32 MB, with some copies.
GROUP = 4_000_000
#: Most growth rates of a group: 80 MB, with some copies.
RATES = 10_000_000
#: Share of the range of a gap below which an orbit that misses or overshoots its boundary is near a
#: graze. Exponents belong to infinitesimal deviations, but a gap is known, and a deviation seen, to
#: a thousandth of the motion at best. So near a boundary nobody can tell the side of the graze, and
#: on the other side the exponents differ. A motion that never repeats comes arbitrarily close to
#: every boundary that it meets, so only its grazes count.
NEAR_GRAZE = 1e-3
#: The two conventions of a forced system.
FORCED = (
    "lyapunov_exponent: of the stroboscopic map; flow_lyapunov_exponent: of the flow, with a "
    "zero for the phase of the forcing"
)


class Exponents(Algorithm):
    """Lyapunov exponents by the variational equations."""

    algorithm = "variational equations with saltation, QR method"

    def __init__(self, map_: Stroboscope, start: np.ndarray, periods: int, *blocks: Any, most: int):
        super().__init__(map_, start, periods, *blocks)
        self._ends, self._most = running_ends(periods), most
        k, size, m = len(start), most, len(self._ends)
        nan = np.full
        self._mean, self._error, self._half = (nan((k, size), np.nan) for _ in range(3))
        self._running, self._running_half = (nan((k, size, m), np.nan) for _ in range(2))
        self._volume, self._margin = nan(k, np.nan), nan(k, np.inf)
        self._kind, self._period, self._batches = (
            nan(k, "unclear", dtype=object),
            nan(k, 0),
            nan(k, 0),
        )
        self._status, self._near, self._grazes, self._unresolved = (
            nan(k, st.NOT_COMPUTED),
            nan(k, 0),
            nan(k, 0),
            nan(k, 0),
        )

    def run(self, progress: Callable[[float], None] | None = None) -> None:
        """Compute all, in groups."""
        k, size = self._start.shape
        held = SEGMENT * size * (size + 1 if self._most == size else 1)
        step = max(min(GROUP // held, RATES // (self._periods * self._most)), 1)
        for first in range(0, k, step):
            rows = np.arange(first, min(first + step, k))

            def show(share: float, first: int = first, count: int = len(rows)) -> None:
                if progress:
                    progress((first + share * count) / k)

            flow = TangentFlow(self.map.rows(rows))
            found = spectrum(
                flow,
                self._start[rows],
                self._periods,
                self._transient,
                self._every is None,
                show,
                self._most,
            )
            if self._every is not None and autonomous(self.map.system):
                _of_equilibria(found, flow, self._start[rows], self._every)
            self._keep(rows, flow, found)

    def _keep(self, rows: np.ndarray, flow: TangentFlow, found: Spectrum) -> None:
        """Write the results of a group to their rows."""
        segment = found.growth.segment
        self._mean[rows], self._error[rows], self._half[rows] = (
            found.exponents,
            found.errors,
            found.half_width,
        )
        self._running[rows], self._running_half[rows] = found.running.mean, found.running.half_width
        self._volume[rows], self._batches[rows], self._kind[rows] = (
            found.volume,
            found.batches,
            found.kinds,
        )
        self._period[rows] = [
            orbit.period if orbit and kind == Kind.PERIODIC.word else 0
            for orbit, kind in zip(found.orbits, found.kinds, strict=True)
        ]
        self._status[rows] = segment.status
        self._grazes[rows], self._unresolved[rows], self._margin[rows] = (
            segment.grazes,
            segment.unresolved,
            segment.margin,
        )
        for i, orbit in enumerate(found.orbits):
            if orbit is not None:
                self._of_orbit(rows[i], flow.rows(np.array([i])), orbit)
        self._near[rows] |= (self._grazes[rows] > 0) | (self._unresolved[rows] > 0)

    def _of_orbit(self, row: int, flow: TangentFlow, orbit: ClosedMotion) -> None:
        """Replace grazes and margin by those of the orbit alone, without the way to it."""
        segment = flow.advance(orbit.points[:1], orbit.period)
        self._grazes[row], self._unresolved[row] = segment.grazes[0], segment.unresolved[0]
        numbers = measure(flow.map, orbit.points[:1], np.array([orbit.period]))
        self._margin[row] = numbers.margin[0]
        self._near[row] = numbers.margin[0] < NEAR_GRAZE * numbers.span[0]

    def columns(self, factor: np.ndarray) -> dict[str, Any]:
        """The columns of the result; exponents times a factor for each trajectory, float64[k]."""
        scale, running_scale = factor[:, None], factor[:, None, None]
        mean, half = self._mean * scale, self._half * scale
        running, running_half = self._running * running_scale, self._running_half * running_scale
        lost = ~np.isin(self._status, GOOD)
        mean[lost], half[lost] = np.nan, np.nan
        every = self._most == self._start.shape[1]
        flow = _with_phase(mean) if self._every is None else mean
        return {
            "kind": self._kind.astype(str),
            "response_period": self._period,
            "lyapunov_exponent": mean,
            "lyapunov_error": np.where(np.isnan(mean), np.nan, self._error * scale),
            "lyapunov_low": mean - half,
            "lyapunov_high": mean + half,
            "flow_lyapunov_exponent": flow if every else flow[:, : self._most],
            **({"exponent_sum": mean.sum(axis=1)} if every else {}),
            "mean_divergence": self._volume * factor,
            "independent_batches": self._batches,
            "near_graze": self._near,
            "grazes": self._grazes,
            "grazes_unresolved": self._unresolved,
            "smallest_gap_margin": self._margin,
            "block_time": self.map.period,
            "status": [st.STATUS[code][0] for code in self._status.tolist()],
            "running_time": self.map.period[:, None] * self._ends,
            "running_exponent": running,
            "running_low": running - running_half,
            "running_high": running + running_half,
        }

    def settings(self) -> dict[str, Any]:
        """The settings, as attributes of the result."""
        return {
            "algorithm": self.algorithm,
            "convention": FORCED if self._every is None else "both are the exponents of the flow",
            "confidence": CONFIDENCE,
            "periods": self._periods,
            "transient": self._transient,
        }


def _of_equilibria(found: Spectrum, flow: TangentFlow, start: np.ndarray, every: float) -> None:
    """Replace the exponents of motions that have come to an equilibrium by the real parts of the
    eigenvalues of the Jacobian, exact but for rounding.

    Means of growth converge slowly: those of a pair of complex eigenvalues oscillate about its real
    part.
    """
    iterates = found.growth.segment.points
    state, extent = (
        iterates[:, -1],
        np.ptp(np.concatenate([start[:, None], iterates], axis=1), axis=1),
    )
    # replaces the range of a state that was at rest all the time
    widest = extent.max(axis=1, keepdims=True)
    scale = np.where(
        extent > AT_REST * widest, extent, np.where((widest > 0) & np.isfinite(widest), widest, 1.0)
    )
    still = find_equilibria(flow.map, state, scale)
    with np.errstate(invalid="ignore"):
        attracts = (still.multipliers.real < 0).all(axis=1)
        near = (np.abs(state - still.points[:, 0]) <= SAME * scale).all(axis=1)
    arrived = np.flatnonzero(attracts & near & np.isin(found.growth.segment.status, GOOD))
    rounding = 64 * np.finfo(float).eps
    for i in arrived:
        eigenvalues = still.multipliers[i]
        found.exponents[i] = eigenvalues.real[: found.exponents.shape[1]] * every
        found.errors[i] = found.half_width[i] = rounding * np.abs(eigenvalues).max() * every
        found.batches[i], found.kinds[i] = 0, Kind.EQUILIBRIUM.word
        found.volume[i] = flow.rows(np.array([i])).divergences(still.points[[i], :1])[0][0, 0]


def _with_phase(exponents: np.ndarray) -> np.ndarray:
    """Exponents float64[k, D] and the zero of the phase, in descending order."""
    zero = np.where(np.isnan(exponents[:, :1]), np.nan, 0.0)
    return -np.sort(-np.concatenate([exponents, zero], axis=1), axis=1)
