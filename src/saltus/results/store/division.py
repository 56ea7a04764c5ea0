"""The way in which long work divides into independent chunks, which a store keeps."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import xarray as xr

    from saltus.results.store.store import Store


class Division(ABC):
    """Work in independent chunks. It goes to other processes and machines as plain data.

    A chunk is a pure function of the work and of what all chunks share, so that neither who
    computes it nor how often changes a bit.
    """

    #: Name under which the store keeps what all chunks share; empty if they share nothing.
    kept: str = ""

    @property
    @abstractmethod
    def shape(self) -> tuple[int, ...]:
        """Size of the grid of cells along each dim."""

    @property
    @abstractmethod
    def cells(self) -> int:
        """Cells of one chunk."""

    @property
    def arrays(self) -> Mapping[str, Any] | None:
        """Name and type of what is kept of each cell; None where chunks differ in size."""
        return None

    def share(self, threads: int | None) -> Any:  # noqa: ARG002
        """Compute what all chunks share, as plain values."""
        return None

    def shared_from(self, data: Any) -> Any:
        """Data that all chunks share, from :meth:`share`'s result."""
        return data

    @abstractmethod
    def prepare(self) -> None:
        """Compile what chunks need, so that neither threads nor processes compile it."""

    @abstractmethod
    def chunk(self, index: int, shared: Any) -> Mapping[str, np.ndarray]:
        """Compute one chunk, on one thread."""

    @abstractmethod
    def finish(
        self,
        store: Store,
        shared: Any,
        threads: int | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> xr.Dataset:
        """Put the chunks together. Raises StoreError if one is missing."""

    def estimate(self, shared: Any, processors: int) -> str:  # noqa: ARG002
        """Sentence on time, memory and disk space of large work; empty if nothing is known."""
        return ""
