"""Maps in small chunks with few scouts, for tests of what happens between chunks."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from saltus.analysis.basins import pipeline


@contextmanager
def small_maps(chunk: int) -> Iterator[None]:
    """Within, a chunk has so many cells."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pipeline, "CHUNK", chunk)
        patch.setattr(pipeline, "SCOUTS", 256)
        patch.setattr(pipeline, "CHECKED", 64)
        yield
