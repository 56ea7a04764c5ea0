"""Motions of many starts or values in chunks, for a store."""

from __future__ import annotations

import functools
from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from saltus.analysis.inputs.starts import trajectories
from saltus.analysis.motion.motion_arrays import AskedMotion, asked_motion
from saltus.analysis.motion.simulate import simulation
from saltus.analysis.outcome_messages import warn
from saltus.flow import engine
from saltus.flow.request import Outcome
from saltus.interrupt import Interrupted
from saltus.results.store.division import Division

if TYPE_CHECKING:
    import xarray as xr

    from saltus.flow.methods import Method
    from saltus.results.store.store import Store
    from saltus.system import System

#: Trajectories of a chunk: they fill the lanes some times, and enough chunks are left for many
#: processors.
TOGETHER = 64


@dataclass(frozen=True)
class DividedRows(Division):
    """The chunks of a question on trajectories that know nothing of each other.

    Attributes
    ----------
    system : System
        Equations and values.
    method : Method
        The method of integration.
    arguments : mapping
        Those of the verb, as users write them: expressions aren't plain data.
    count, together : int
        Trajectories, and those in one chunk.
    """

    system: System
    method: Method | None
    arguments: Mapping[str, Any]
    count: int
    together: int

    @property
    def shape(self) -> tuple[int, ...]:
        """Trajectories."""
        return (self.count,)

    @property
    def cells(self) -> int:
        """Trajectories in one chunk."""
        return self.together

    @classmethod
    def of(cls, system: System, method: Method | None, arguments: Mapping[str, Any]) -> Self | str:
        """The chunks of a question; the reason why a single motion has none."""
        count = trajectories(arguments["start"], arguments["values"])
        if count == 1:
            return "is a single motion"
        return cls(system, method, arguments, count, TOGETHER)

    def __getstate__(self) -> dict[str, Any]:
        """The parts that go to other processes: all but what was read of the arguments."""
        return {name: value for name, value in vars(self).items() if name != "asked"}

    def rows(self, index: int) -> slice:
        """The trajectories of a chunk."""
        begin = index * self.cells
        return slice(begin, min(begin + self.cells, self.count))

    def stored(self, store: Store) -> list[Mapping[str, np.ndarray] | None]:
        """The arrays of all chunks; None for one that is missing."""
        return [store.read(i) if done else None for i, done in enumerate(store.done().tolist())]

    @functools.cached_property
    @abstractmethod
    def asked(self) -> Any:
        """The arguments, read and checked."""


@dataclass(frozen=True)
class DividedMotions(DividedRows):
    """The chunks of :func:`saltus.simulate`. All of them take samples up to the last end."""

    @functools.cached_property
    def asked(self) -> AskedMotion:
        """The arguments, read and checked."""
        return asked_motion(self.system, method=self.method, **self.arguments)

    @property
    def kept(self) -> str:  # type: ignore[override]
        """The times at which a condition ends the trajectories, where samples depend on them."""
        return "ends" if self.arguments.get("until") and not self.asked.given else ""

    def share(self, threads: int | None) -> list[float]:
        """The times at which the trajectories end [s]."""
        asked = self.asked
        assert asked.end is not None
        times = asked.end.times(asked.method, asked.group, asked.length, threads, None)
        return [float(one) for one in times]

    def prepare(self) -> None:
        """Compile the flow, and the one that measures its errors."""
        asked = self.asked
        system = asked.flown.origin
        for method in (asked.method, asked.method.companion()):
            method.serving(system).suited_to(self.cells).kernels(system)

    def chunk(self, index: int, shared: Any) -> dict[str, np.ndarray]:
        """Move the trajectories of one chunk."""
        outcome, errors = self._planned(shared).rows(self.rows(index)).run(1, None)
        return outcome.arrays() | {"contact_errors": errors}

    def finish(
        self,
        store: Store,
        shared: Any,
        threads: int | None = None,  # noqa: ARG002
        progress: Callable[[float], None] | None = None,  # noqa: ARG002
    ) -> xr.Dataset:
        """The Dataset of all motions."""
        asked = self._planned(shared)
        stored = self.stored(store)
        outcome = Outcome.joined([self._part(asked, *one) for one in enumerate(stored)])
        errors = [np.zeros(0), *(one["contact_errors"] for one in stored if one is not None)]
        result = functools.partial(simulation, asked, outcome, np.concatenate(errors))
        if not outcome.complete:
            raise Interrupted(result)
        ds = result()
        if asked.end is not None:
            asked.end.warn_of_starts()
        warn(ds, asked.length, self.system)
        return ds

    def _part(
        self, asked: AskedMotion, index: int, values: Mapping[str, np.ndarray] | None
    ) -> Outcome:
        """The outcome of a chunk."""
        if values is not None:
            return Outcome.of_arrays(values)
        mine = asked.rows(self.rows(index))
        return engine.not_run(mine.flown, mine.method, mine.request)

    def _planned(self, shared: Any) -> AskedMotion:
        """The motions with all their samples."""
        return self.asked.until(np.array(shared)) if self.kept else self.asked
