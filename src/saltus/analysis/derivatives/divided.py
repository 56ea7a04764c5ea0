"""Derivatives of many motions in chunks, for a store."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from saltus.analysis.derivatives.sensitivity import sensitivity_run, warn_of_limits
from saltus.analysis.derivatives.sensitivity_table import (
    SensitivityRun,
    sensitivity_dataset,
    sensitivity_rows,
)
from saltus.analysis.motion.divided import DividedRows
from saltus.analysis.outcome_messages import warn
from saltus.errors import ParameterError
from saltus.flow import engine
from saltus.interrupt import Interrupted
from saltus.sentences import Word

if TYPE_CHECKING:
    import xarray as xr

    from saltus.results.store.store import Store


@dataclass(frozen=True)
class DividedSensitivity(DividedRows):
    """The chunks of :func:`saltus.sensitivity` from starts."""

    @functools.cached_property
    def asked(self) -> SensitivityRun:
        """The arguments, read and checked."""
        return sensitivity_run(self.system, method=self.method, **self.arguments)

    def prepare(self) -> None:
        """Compile the flow that carries the derivatives."""
        flown, method = self.asked.flow.flown, self.asked.method.suited_to(self.cells)
        method.serving(flown.origin).kernels(flown.origin)

    def chunk(self, index: int, shared: None) -> dict[str, np.ndarray]:  # noqa: ARG002
        """The derivatives of the trajectories of one chunk.

        Raises
        ------
        ParameterError
            Where modes of one go together. :func:`saltus.sensitivity` then takes another method for
            all trajectories: no chunk may do so for its own.
        """
        run = self.asked.rows(self.rows(index))
        outcome = run.fly(run.request, 1)
        if run.flow.lost(run.flow.ends(outcome, run.group, run.length)):
            raise ParameterError(
                f"modes of {self.system.name} go together (rigid bodies, or a resonance): Modal "
                "then has no derivatives with respect to parameters. ",
                lambda say: f"Give {say.key(method=Word(say.method('Taylor')))}.",
            )
        return sensitivity_rows(run, outcome)

    def finish(
        self,
        store: Store,
        shared: None,  # noqa: ARG002
        threads: int | None = None,  # noqa: ARG002
        progress: Callable[[float], None] | None = None,  # noqa: ARG002
    ) -> xr.Dataset:
        """The Dataset of all motions."""
        stored = self.stored(store)
        parts = [self._part(*one) for one in enumerate(stored)]
        rows = {name: np.concatenate([one[name] for one in parts]) for name in parts[0]}
        counts = [len(one["contact_trajectory"]) for one in parts]
        rows["contact_trajectory"] += np.repeat(self.cells * np.arange(len(parts)), counts)
        result = functools.partial(sensitivity_dataset, self.asked, rows)
        if any(one is None for one in stored):
            raise Interrupted(result)
        ds = result()
        warn(ds, self.asked.length, self.system)
        warn_of_limits(self.system, ds)
        return ds

    def _part(
        self, index: int, values: Mapping[str, np.ndarray] | None
    ) -> Mapping[str, np.ndarray]:
        """The rows of a chunk; of one that is missing rows of NaN."""
        if values is not None:
            return values
        run = self.asked.rows(self.rows(index))
        none = engine.not_run(run.flow.flown, run.method, run.request)
        return sensitivity_rows(run, replace(none, complete=True))
