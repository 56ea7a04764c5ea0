"""The threads of linear algebra: one while a verb runs.

OpenBLAS and MKL begin a thread a core for each product or decomposition. Ours run beside them,
their matrices are small, and they wait for one another: the frequency response of 40 modes takes
70 s with them and 50 s without (docs/decisions/0105).
"""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

_HELD = threading.Lock()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Within, the linear algebra of the process takes one thread. Afterwards it has its own number
    again.

    The number belongs to the process. Of verbs on several threads the first one holds it, and gives
    back what it found; one that began meanwhile leaves it alone.
    """
    if not _HELD.acquire(blocking=False):
        yield
        return
    try:
        with _libraries("scipy.linalg" in sys.modules).limit(limits=1, user_api="blas"):
            yield
    finally:
        _HELD.release()


@cache
def _libraries(_with_scipy: bool) -> Any:
    """The libraries of linear algebra that are loaded: NumPy's, and SciPy's, which has its own."""
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()
