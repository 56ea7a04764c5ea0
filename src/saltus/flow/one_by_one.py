"""Common parts of the methods that move one trajectory after the other: all but Taylor's."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from saltus.codegen.module import Flow, steps_module
from saltus.errors import must_be
from saltus.flow.counts import whole
from saltus.flow.method import Method, step_budget
from saltus.flow.taylor import Taylor
from saltus.system import System


class OneByOne(Method):
    """A method with the kernels of kernels/stepping/trajectory.py."""

    #: Ways of crossing a boundary, ``"ignore"`` among them.
    EVENTS: ClassVar[tuple[str, ...]]
    events: str
    max_steps: int | None
    max_events: int

    def _check_common(self) -> None:
        """Raise ParameterError for an unknown way of crossing, or a bad step budget."""
        if not isinstance(self.events, str) or self.events not in self.EVENTS:
            ways = ", ".join(f'"{way}"' for way in self.EVENTS)
            raise must_be("events", f"one of {ways}", self.events)
        if self.max_steps is not None:
            whole(self.max_steps, "max_steps")
        whole(self.max_events, "max_events")

    def _own_numbers(self) -> tuple[float, float, float]:
        """Two numbers of the method's own, and its way of crossing: 0 locates nothing."""
        raise NotImplementedError

    def kernels(self, system: System) -> Flow:
        """The compiled method."""
        return steps_module(system, self.name)

    def numbers(self, periods: float) -> np.ndarray:
        """The method's own numbers, step budget, event budget."""
        budget = step_budget(self.max_steps, periods)
        return np.array([*self._own_numbers(), budget, float(self.max_events)])

    @property
    def records_contacts(self) -> bool:
        """True if contacts are located."""
        return self.events != "ignore"

    def companion(self) -> Taylor:
        """The Taylor flow, which is exact compared with these methods."""
        return Taylor()
