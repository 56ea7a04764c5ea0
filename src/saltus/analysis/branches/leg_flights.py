"""Flights from one contact to the next, each in one mode without boundaries (system/leg.py), with
their derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from saltus.analysis.branches.shooting import PeriodicOrbits
from saltus.flow.maps import Stroboscope
from saltus.flow.request import Schedule
from saltus.system.leg import leg

#: Legs that last less take a detour, in periods.
BRIEF = 1e-3
#: Time that the detour takes, in periods.
DETOUR = 1e-2


class LegFlights:
    """The flights of an orbit's legs.

    Parameters
    ----------
    orbits : PeriodicOrbits
        The equations with the contact sequence left to the flow.
    modes : list of int
        The mode of each leg, as bits.
    """

    def __init__(self, orbits: PeriodicOrbits, modes: list[int]) -> None:
        self._orbits, self._modes, self._size = orbits, modes, orbits.size
        self._unit = float(orbits.map.period[0])
        system, method, threads = orbits.parametric.system, orbits.map.method, orbits.map.threads
        self._maps = {
            mode: Stroboscope(leg(system, mode), method, every=1.0, threads=threads)
            for mode in set(modes)
        }

    def fly(
        self,
        after: np.ndarray,
        others: np.ndarray,
        phase: np.ndarray,
        span: np.ndarray,
        legs: Sequence[int] | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Legs from states float64[r, m, D] behind each contact, at times and for times float64[r,
        m] in periods; ``legs`` says which they are, if not all in their order.

        Returns
        -------
        float64[r, m, D], float64[r, m, D, E + 2]
            Their ends, and the derivatives with respect to the states of the parametric system, the
            time and the span [periods].
        """
        start = self.states(after, others, phase, span)
        modes = self._modes if legs is None else [self._modes[i] for i in legs]
        ends, matrices = self.ends(start, np.tile(modes, (len(after), 1)))
        matrices[..., -2:] *= self._unit
        return ends, matrices

    def ends(self, start: np.ndarray, modes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ends float64[r, m, D] of legs from states float64[r, m, E + 2] in modes int64[r, m], and
        their derivatives float64[r, m, D, E + 2].
        """
        ends = np.empty((*modes.shape, self._size))
        matrices = np.empty((*ends.shape, start.shape[2]))
        for mode, map_ in self._maps.items():
            mine = modes == mode
            if mine.any():
                end, matrix = self._flown(map_, start[mine])
                ends[mine], matrices[mine] = end[:, : self._size], matrix[:, : self._size]
        return ends, matrices

    def _flown(self, map_: Stroboscope, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Ends of legs float64[k, E + 2] and their tangent maps. One that lasts next to no time
        goes back first and then forth: all of its rates would be next to nothing.
        """
        span, away = start[:, -1], DETOUR * self._unit
        short = np.flatnonzero((np.abs(span) < BRIEF * self._unit) & (span != 0))
        if not len(short):
            return map_.tangent(start, 1)
        first = start.copy()
        first[short, -1] = -away
        end, matrix = map_.tangent(first, 1)
        onwards = end[short]
        onwards[:, -2:] = start[short, -2:] + np.array([-away, away])
        there, second = map_.tangent(onwards, 1)
        back = matrix[short]
        back[:, :-1, -1] = 0.0  # the time it goes back is the same for all
        there[:, -2:] = start[short, -2:]
        end[short], matrix[short] = there, second @ back
        return end, matrix

    def states(
        self, after: np.ndarray, others: np.ndarray, phase: np.ndarray, span: np.ndarray
    ) -> np.ndarray:
        """States of legs, float64[r, m, E + 2]."""
        carried = np.repeat(
            self._orbits.parameter_states(others)[0][:, None], after.shape[1], axis=1
        )
        times = np.stack([phase, span], axis=2) * self._unit
        return np.concatenate([after, carried, times], axis=2)

    def samples(self, start: np.ndarray, place: int, count: int) -> np.ndarray:
        """States of a leg from float64[1, E + 2] at ``count`` equal steps of its time,
        float64[count + 1, D].
        """
        map_, schedule = self._maps[self._modes[place]], Schedule.even(1, count, beyond=1)
        states: np.ndarray = map_.tangent_samples(start, 1, schedule)[0, :, : self._size]
        return states
