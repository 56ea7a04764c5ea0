"""Taylor series, the default method."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from saltus.codegen.module import Flow, lane_width, taylor_module
from saltus.errors import must_be
from saltus.flow.counts import whole
from saltus.flow.method import STEPS_PER_PERIOD, Method, check_positive, explain_unknown_options
from saltus.flow.pace import CHECK_STEPS, LONG_CHECK_STEPS
from saltus.system import System

#: Most trajectories of a small batch, and its lanes: one trajectory and the three copies that
#: measure its errors. 16 lanes take twice as long (0028).
SMALL_BATCH = 4
#: Share of its span that LONG_CHECK_STEPS steps must bring: a trajectory of 1e9 steps, minutes of
#: work, runs to its end.
SLOWEST_SHARE = 1e-3
#: Largest tolerance with which Newton's method closes the rig's orbits; 1e-8 loses some, 1e-6 all.
EXACT = 1e-10


@explain_unknown_options
@dataclass(frozen=True)
class Taylor(Method):
    """Taylor series, contacts located on the gap's own polynomial: machine precision, no contact
    missed. The default.

    Parameters
    ----------
    order : int
        Order of the series, 6 to 40. 20 is where the rig's cost is flattest (benchmarks/flow.py):
        higher orders take fewer steps, but every contact ends a step anyway.
    tolerance : float
        Size of the last two terms of a step relative to the leading ones [-]. The default, 2**-56,
        leaves rounding only, over any number of periods; 2**-46 leaves 3e-15 m of error on the rig
        after five periods and takes a quarter less time. Beyond 1e-10 orbits are means of their
        returns, as with ode45, and branches are refused.
    lanes : int, optional
        Trajectories moved at once: 2, 4, 8 or 16. Default: what suits the processor, and a short
        run of few. Results don't depend on it.
    max_steps, max_events : int, optional
        Budgets of one trajectory; beyond them it stops with status ``budget_steps`` or
        ``budget_events``. Default: any number of steps as long as each million brings it a
        thousandth of the run further, or 100 periods, and it doesn't stand still; 10 million
        contacts.

    References
    ----------
    Jorba & Zou, Experimental Mathematics 14 (2005) 99-117.
    """

    EVENT_BUDGET: ClassVar[int] = 2

    order: int = 20
    tolerance: float = 2.0**-56
    lanes: int | None = None
    max_steps: int | None = None
    max_events: int = 10_000_000

    def __post_init__(self) -> None:
        whole(self.order, "order", 6, 40)
        check_positive("tolerance", self.tolerance)
        if self.lanes is not None and (
            not isinstance(self.lanes, int) or self.lanes not in (2, 4, 8, 16)
        ):
            raise must_be("lanes", "2, 4, 8 or 16", self.lanes)
        if self.max_steps is not None:
            whole(self.max_steps, "max_steps")
        whole(self.max_events, "max_events")

    def kernels(self, system: System) -> Flow:
        """The compiled Taylor flow."""
        return taylor_module(system, self.order, self.lanes or lane_width())

    def suited_to(self, count: int) -> Taylor:
        """The method with few lanes for few trajectories, unless the user has chosen the lanes."""
        return (
            replace(self, lanes=min(SMALL_BATCH, lane_width()))
            if self.lanes is None and count <= 2 * SMALL_BATCH
            else self
        )

    def numbers(self, periods: float) -> np.ndarray:
        """log2 of the tolerance, steps between two checks of the pace, event budget, least progress
        between two checks [periods].
        """
        due = self.due(periods)
        steps, least = (
            (CHECK_STEPS, due * CHECK_STEPS / LONG_CHECK_STEPS)
            if due is not None
            else (self.max_steps or 0, math.inf)
        )
        return np.array([math.log2(self.tolerance), float(steps), float(self.max_events), least])

    def due(self, periods: Any) -> Any:
        """See :class:`Method`."""
        return (
            np.minimum(SLOWEST_SHARE * periods, LONG_CHECK_STEPS / STEPS_PER_PERIOD)
            if self.max_steps is None
            else None
        )

    @property
    def noise(self) -> float:
        """Truncation and rounding over some periods."""
        return max(100.0 * self.tolerance, 1e-12)

    @property
    def exact(self) -> bool:
        """True where the errors are rounding, or so small that Newton's method closes orbits: a
        step's length jumps where its order of truncation does, and the map with it.
        """
        return self.tolerance <= EXACT

    def companion(self) -> Taylor:
        """The same series with steps an eighth shorter, which leave a twentieth of the truncation,
        or the default tolerance where its own isn't exact; it uses the same compiled kernel.
        """
        finer = self.tolerance * 2.0**-4 if self.exact else Taylor.tolerance
        return replace(self, tolerance=finer)
