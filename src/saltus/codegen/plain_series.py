"""The Taylor series of a system in plain NumPy: the generated text that a flow compiles, run on
arrays of any width.
"""

from __future__ import annotations

import hashlib
import math
from functools import lru_cache
from types import ModuleType

import numpy as np

from saltus.codegen import templates
from saltus.codegen.taylor_head import taylor_head
from saltus.kernels import lanes, marks, trigonometry
from saltus.system import System


@lru_cache(maxsize=256)
def series_module(system: System, order: int) -> ModuleType:
    """Jets and step length of a system, as its Taylor flow compiles them: the same for all values.

    It evaluates a motion that a flow has computed. Nothing is compiled, so a new function costs no
    time.
    """
    return _plain(taylor_head(system, order, 1).text)


@lru_cache(maxsize=256)
def _plain(head: str) -> ModuleType:
    """A head and the templates of a step as a Python module, with whole arrays for lanes."""
    module = ModuleType(f"saltus_series_{hashlib.sha256(head.encode()).hexdigest()[:32]}")
    names = module.__dict__
    names |= {
        name: value
        for name, value in vars(lanes).items()
        if callable(value) and not name.startswith("_")
    }
    names |= {"kernel": marks.kernel, "inner": marks.inner, "math": math, "np": np}
    names |= {"sincos": trigonometry.sincos, "turned": trigonometry.turned}
    exec(compile(head, "<generated head>", "exec"), names)
    for name in ("taylor/layout", "clocks", "taylor/step"):
        exec(templates.layout_code(name), names)
    # rows of `side`; no term is left out of these series
    names["SINGULAR"], names["NSINGULAR"] = names["NSINGULAR"], 0
    names["splat"] = lambda value, width: value  # noqa: ARG005  (NumPy spreads a number over any width)
    return module
