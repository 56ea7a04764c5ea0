"""Taylor series of motions, and of functions of them, from the nodes at which a flow knows the
states.

The series are those that the flow itself steps by: :mod:`saltus.codegen` writes them, NumPy
evaluates them for thousands of places at once, and nothing is compiled.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import ModuleType, SimpleNamespace

import numpy as np

from saltus.codegen.clocks import table_data
from saltus.codegen.plain_series import series_module
from saltus.flow import polynomials
from saltus.flow.maps import Stroboscope
from saltus.flow.set_aside import Boundaries
from saltus.kernels.isolation import ROUNDING
from saltus.system import System

#: Order of the series.
ORDER = 20
#: log2 of their tolerance: truncation is rounding.
LOG2_TOLERANCE = -50.0
#: Most pieces between two nodes; more mean a pole.
MOST_PIECES = 1000
#: A boundary nearer than this to the start of a piece is the boundary it starts at [lengths of the
#: piece].
START_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Pieces:
    """k motions in p pieces, by motion and time.

    Attributes
    ----------
    motion : int64[p]
        The motion that a piece belongs to.
    period : int64[p]
        Whole forcing periods before it, and
    phase : float64[p]
        the time after them at which it begins [s].
    length : float64[p]
        Its duration [s].
    terms : float64[n + 1, q, p]
        Polynomials on [0, 1] of the q quantities [their units].
    noise : float64[q, p]
        Rounding error of each quantity's terms.
    """

    motion: np.ndarray
    period: np.ndarray
    phase: np.ndarray
    length: np.ndarray
    terms: np.ndarray
    noise: np.ndarray

    def rows(self, which: np.ndarray) -> Pieces:
        """The pieces of these indices."""
        return Pieces(*(getattr(self, name)[..., which] for name in self.__dataclass_fields__))


@dataclass(frozen=True)
class Nodes:
    """Nodes, at which the states of motions are known: sorted by motion and time; each lasts until
    the next.
    """

    motion: np.ndarray
    period: np.ndarray
    phase: np.ndarray
    length: np.ndarray
    state: np.ndarray
    mode: np.ndarray

    def rows(self, which: np.ndarray | slice) -> Nodes:
        """The nodes of these indices."""
        return Nodes(*(getattr(self, name)[which] for name in self.__dataclass_fields__))


class MotionSeries:
    """Taylor series of a map's states, of some quantities (the last guards of ``watched``) and of
    its gaps.
    """

    def __init__(self, map_: Stroboscope, watched: System, guards: int):
        self._map, self._guards, self._own = map_, guards, len(map_.system.guards)
        self._asked = np.r_[guards : len(watched.guards), 0 : self._own]
        self._module: ModuleType = series_module(watched, ORDER)
        k, module = len(map_), self._module
        self._tables = table_data(watched)
        self._constants, self._turns = (
            np.zeros((max(module.NCONST, 1), k)),
            np.zeros((module.CLOCK_ROWS, k)),
        )
        self._drifts = np.zeros(k, bool)
        for i, row in enumerate(map_.parameters):
            module.constants(row, self._constants, i)
            self._drifts[i] = module.turns(row, 0.0, map_.period[i], 0, i, self._turns)

    def none(self) -> Pieces:
        """An empty set of pieces."""
        numbers, reals = np.zeros(0, np.int64), np.zeros(0)
        size = self._module.NSTATES + len(self._asked)
        return Pieces(
            numbers, numbers, reals, reals, np.zeros((ORDER + 1, size, 0)), np.zeros((size, 0))
        )

    def of(self, nodes: Nodes, cubic: bool) -> list[Pieces]:
        """The pieces that begin at the nodes and fill the time to the next; for cubics one piece a
        node with the lowest terms.
        """
        result, state, left = [], nodes.state.T.copy(), nodes.length.copy()
        # -1: no term is left out
        side = np.full((self._module.NGUARDS + self._module.SINGULAR, len(left)), -1.0)
        side[: self._guards] = np.where(
            (nodes.mode[None] >> np.arange(self._guards)[:, None]) & 1 == 1, 1.0, -1.0
        )
        new = np.ones(len(left), bool)
        for _ in range(MOST_PIECES):
            work, h = self._step(nodes, state, side, new)
            h, flips = (
                (left, np.zeros_like(side, bool))
                if cubic
                else self._until_own_boundary(work, np.minimum(h, left))
            )
            result.append(self._piece(nodes, work, h))
            powers = h ** np.arange(ORDER + 1)[:, None]
            state = np.stack(
                [
                    (self._rows(work, i * (ORDER + 1)) * powers).sum(axis=0)
                    for i in range(len(state))
                ]
            )
            left = np.where(h < left, left - h, 0.0)
            going = (left > 0.0) & np.isfinite(state).all(axis=0) & (not cubic)
            if not going.any():
                break
            nodes = replace(nodes, phase=nodes.phase + h).rows(going)
            side[self._module.NGUARDS :] = -1.0
            state, side, left = state[:, going], np.where(flips, -side, side)[:, going], left[going]
            new = np.zeros(len(left), bool)
        return result

    def _step(
        self, nodes: Nodes, state: np.ndarray, side: np.ndarray, new: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """All terms at the nodes, and the lengths they hold for. At new nodes the sides of the
        quantities' own guards are found first.
        """
        module, motion = self._module, nodes.motion
        constants, (clock, room) = self._constants[:, motion], self._clock(nodes)
        work = np.zeros((module.ROWS, len(motion)))
        boundaries = Boundaries(module, state, side, constants, clock)
        with np.errstate(all="ignore"):
            aside = boundaries.jets(work)
            for guard in range(self._own, self._guards):
                terms = self._gap(work, guard)
                terms[0] = np.where(np.abs(terms[0]) <= self._noise(work, guard), 0.0, terms[0])
                side[guard] = np.where(
                    new, np.where(polynomials.leading_signs(terms)[0] < 0.0, -1.0, 1.0), side[guard]
                )
            if self._own < self._guards:
                aside |= boundaries.jets(work)
            h = module.step_length(work, LOG2_TOLERANCE)
            if module.PROBED:
                h = self._probed(nodes, side, constants, clock, work, h)
            h = boundaries.shortened(work, np.minimum(h, np.minimum(room, nodes.length)), aside)
        return work, h

    def _clock(self, nodes: Nodes) -> tuple[np.ndarray, np.ndarray]:
        """Phase, time at phase zero, the phases of all harmonics there, the state of the clocks;
        and the time to the next break of a clock.
        """
        module, motion = self._module, nodes.motion
        clock = self._turns[:, motion]
        clock[module.TAU], clock[module.BASE] = nodes.phase, nodes.period * self._map.period[motion]
        for i in np.flatnonzero(self._drifts[motion]):
            row = motion[i]
            module.turns(
                self._map.parameters[row],
                0.0,
                self._map.period[row],
                int(nodes.period[i]),
                i,
                clock,
            )
        room = np.full(len(motion), np.inf)
        if module.NCLOCKS:
            numbers, held = (
                np.zeros((module.NUMBERS + 1) * module.NCLOCKS),
                np.zeros(module.HELD * module.NCLOCKS),
            )
            for at, who in enumerate(motion.tolist()):
                period, count = self._map.period[who], int(nodes.period[at])
                module.place_clocks(
                    self._map.parameters[who], 0.0, period, count, numbers, self._tables
                )
                room[at] = (
                    module.set_clocks(
                        nodes.phase[at], count * period, numbers, self._tables, False, held
                    )
                    - nodes.phase[at]
                )
                clock[module.CLOCK_ROW :, at] = held
        return clock, room

    def _probed(
        self,
        nodes: Nodes,
        side: np.ndarray,
        constants: np.ndarray,
        clock: np.ndarray,
        work: np.ndarray,
        h: np.ndarray,
    ) -> np.ndarray:
        """Shorten steps to where the right-hand side agrees with the series: a term may be
        negligible at the node, and not after it.
        """
        module, width = self._module, len(h)
        period = self._map.period[nodes.motion]
        lanes = SimpleNamespace(
            work=work,
            side=side,
            c=constants,
            clock=clock,
            probe_y=np.zeros((module.NSTATES, width)),
            probe_clock=np.zeros_like(clock),
            probe_rate=np.zeros((3 * module.NSTATES, width)),
        )
        result: np.ndarray = module.probed(
            lanes, np.minimum(h, module.LONGEST_SHARE * period), LOG2_TOLERANCE
        )
        return result

    def _until_own_boundary(self, work: np.ndarray, h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Lengths up to the first boundary of the quantities' own, and the guards float64[guards,
        n] that change there.
        """
        flips = np.zeros((self._module.NGUARDS + self._module.SINGULAR, len(h)), bool)
        for guard in range(self._own, self._guards):
            which, root = polynomials.sign_changes(
                self._gap(work, guard) * h ** np.arange(ORDER + 1)[:, None]
            )
            which, root = which[root > START_TOLERANCE], root[root > START_TOLERANCE]
            which, first = np.unique(which, return_index=True)
            sooner = np.ones(len(h))
            sooner[which] = root[first]
            nearer = sooner < 1.0
            flips[:, nearer] = False
            flips[guard, nearer] = True
            h = np.where(nearer, sooner * h, h)
        return h, flips

    @staticmethod
    def _rows(work: np.ndarray, first: int) -> np.ndarray:
        return work[first : first + ORDER + 1]

    def _gap(self, work: np.ndarray, guard: int) -> np.ndarray:
        """Terms of the gap of a guard, or of a quantity."""
        module = self._module
        terms: np.ndarray = module.GUARD_SIGN[guard] * self._rows(work, module.GUARD_ROW[guard])
        terms[0] = work[module.GAP_ROW + guard]
        return terms

    def _noise(self, work: np.ndarray, guard: int) -> np.ndarray:
        noise: np.ndarray = ROUNDING * work[self._module.SCALE_ROW + guard]
        return noise

    def _piece(self, nodes: Nodes, work: np.ndarray, h: np.ndarray) -> Pieces:
        """The pieces of states, quantities and gaps, over lengths h."""
        states = [self._rows(work, i * (ORDER + 1)) for i in range(self._module.NSTATES)]
        terms = np.stack([*states, *(self._gap(work, guard) for guard in self._asked)], axis=1)
        terms *= (h ** np.arange(ORDER + 1)[:, None])[:, None]
        noise = np.stack(
            [
                *(ROUNDING * np.abs(one[0]) for one in states),
                *(self._noise(work, guard) for guard in self._asked),
            ]
        )
        return Pieces(nodes.motion, nodes.period, nodes.phase, h, terms, noise)
