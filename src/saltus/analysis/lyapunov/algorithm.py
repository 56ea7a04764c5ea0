"""Interface of every algorithm for the exponents of trajectories of a flow."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from saltus.flow.maps import Stroboscope


class Algorithm:
    """The exponents of k trajectories, computed by :meth:`run`; what isn't computed yet is NaN.

    Parameters
    ----------
    map_ : Stroboscope
        The flow, with a row for each trajectory.
    start : float64[k, D]
        Starts.
    periods, transient : int
        Blocks that count, and blocks before them.
    every : float or None
        Time of a block, for a system without forcing [s].
    """

    def __init__(
        self,
        map_: Stroboscope,
        start: np.ndarray,
        periods: int,
        transient: int,
        every: float | None,
    ):
        self.map, self._start, self._every = map_, start, every
        self._periods, self._transient = periods, transient

    def run(self, progress: Callable[[float], None] | None = None) -> None:
        """Compute all, in groups."""
        raise NotImplementedError

    def columns(self, factor: np.ndarray) -> dict[str, Any]:
        """The columns of the result; exponents, per block, times a factor for each trajectory."""
        raise NotImplementedError

    def settings(self) -> dict[str, Any]:
        """The settings, as attributes of the result."""
        raise NotImplementedError
