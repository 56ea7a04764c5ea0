"""The unknowns of a fit: parameters and starts between bounds."""

from __future__ import annotations

import functools
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.analysis.inputs.starts import range_of
from saltus.errors import ParameterError, among, shown, unknown
from saltus.system import System
from saltus.units import to_si

#: Positive bounds this many times apart are filled evenly in the logarithm.
WIDE = 10.0
#: Least distance of a start of a search from the bounds, in their width.
INSIDE = 1e-6


@dataclass(frozen=True)
class Unknowns:
    """The p unknowns of a fit. A search moves shares of their ranges, 0 to 1.

    Attributes
    ----------
    names : tuple of str
        Parameters, starts as ``x(0)``, and ``t_start``.
    units : tuple of str
    low, high : float64[p]
        Bounds [SI].
    wide : bool[p]
        Whether a share is one of the logarithm.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    low: np.ndarray
    high: np.ndarray
    wide: np.ndarray

    def __len__(self) -> int:
        return len(self.names)

    @classmethod
    def of(cls, system: System, free: Any) -> Unknowns:
        """The unknowns of a user's ``free``.

        Raises
        ------
        ParameterError, UnitError
            If a name isn't known, or bounds aren't two ascending numbers.
        """
        if not isinstance(free, Mapping) or not free:
            raise ParameterError(
                lambda say: (
                    f"free must be unknowns with their bounds, such as "
                    f"{say.key(free={'gap': ('0.1 mm', '2 mm')})}, not {shown(free)}."
                )
            )
        starts = {f"{name}(0)": system.units[name] for name in system.states}
        known = (*system.values, *starts, "t_start")
        ends = []
        for name, bounds in free.items():
            if not among(name, known):
                raise unknown(f"{system.name} has no parameter or start", name, known)
            if name in system.values:
                ends.append(range_of(system, name, bounds))
            else:
                ends.append(_bounds(name, bounds, starts.get(name, "s")))
        low, high = np.array(ends).T
        with np.errstate(divide="ignore", invalid="ignore"):
            wide = (low > 0) & (high / low >= WIDE)
        units = tuple(system.units.get(n, starts.get(n, "s")) for n in free)
        return cls(tuple(free), units, low, high, wide)

    @functools.cached_property
    def _ends(self) -> tuple[np.ndarray, np.ndarray]:
        """Bounds on the scales on which shares are even, float64[p] each."""
        logs = (np.log(np.where(self.wide, one, 1.0)) for one in (self.low, self.high))
        low, high = (
            np.where(self.wide, log, one)
            for log, one in zip(logs, (self.low, self.high), strict=True)
        )
        return low, high

    def values(self, shares: np.ndarray) -> np.ndarray:
        """Values [SI] of shares, float64[..., p]."""
        low, high = self._ends
        even = low + shares * (high - low)
        return np.asarray(np.where(self.wide, np.exp(np.where(self.wide, even, 0.0)), even))

    def widths(self, values: np.ndarray) -> np.ndarray:
        """Derivatives of the values by their shares, float64[..., p] [SI]."""
        low, high = self._ends
        return np.asarray((high - low) * np.where(self.wide, values, 1.0))

    def shares(self, values: np.ndarray) -> np.ndarray:
        """Shares of values [SI] between the bounds, float64[..., p]."""
        low, high = self._ends
        even = np.where(self.wide, np.log(np.where(self.wide, values, 1.0)), values)
        return np.asarray((even - low) / (high - low))

    def scattered(self, count: int, seed: int) -> np.ndarray:
        """Shares that fill the ranges evenly: a scrambled Sobol sequence, float64[count, p]."""
        from scipy.stats import qmc

        with warnings.catch_warnings():  # a count that is no power of two is less even, no more
            warnings.simplefilter("ignore")
            drawn = qmc.Sobol(len(self), rng=np.random.default_rng(seed)).random(count)
        return np.asarray(np.clip(drawn, INSIDE, 1.0 - INSIDE))


def _bounds(name: str, bounds: Any, unit: str) -> tuple[float, float]:
    """Bounds of a start [SI]."""
    if not isinstance(bounds, list | tuple | np.ndarray) or len(bounds) != 2:
        raise ParameterError(f"the bounds of {name} must be (low, high), not {shown(bounds)}.")
    low, high = (to_si(end, unit, name) for end in bounds)
    if not low < high:
        raise ParameterError(f"the bounds of {name} must ascend, not {shown(bounds)}.")
    return low, high
