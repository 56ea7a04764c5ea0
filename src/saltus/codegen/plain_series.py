"""The Taylor series of a system in plain NumPy: the generated text that a flow compiles, run on arrays of any width."""

from __future__ import annotations

import hashlib
import math
from functools import lru_cache
from importlib import resources
from types import ModuleType

import numpy as np

from saltus.codegen.taylor_head import taylor_head
from saltus.kernels import lanes, trigonometry
from saltus.system.system import System


def series_module(system: System, order: int) -> ModuleType:
    """Jets and step length of a system, as its Taylor flow compiles them.

    It is for what looks at a motion that a flow has computed already. Nothing is compiled, so a new function costs no time.
    """
    return _plain(taylor_head(system, order, 1))


@lru_cache(maxsize=64)
def _plain(head: str) -> ModuleType:
    """A head and the templates of a step as a Python module, its lanes whole arrays."""
    module = ModuleType(f"saltus_series_{hashlib.sha256(head.encode()).hexdigest()[:32]}")
    names = module.__dict__
    names |= {name: value for name, value in vars(lanes).items() if callable(value) and not name.startswith("_")}
    names |= dict.fromkeys(("kernel", "inner"), lambda function: function)
    names |= {"math": math, "np": np, "sincos": getattr(trigonometry.sincos, "py_func", trigonometry.sincos), "turned": trigonometry.turned}
    for name, text in (
        ("<generated head>", head),
        *((name, _template(name)) for name in ("clocks.py", "taylor_layout.py", "taylor_step.py")),
    ):
        exec(compile(text, name, "exec"), names)
    names["SINGULAR"], names["NSINGULAR"] = names["NSINGULAR"], 0  # rows of `side`; no term is left out of these series
    names["splat"] = lambda value, width: value  # noqa: ARG005  (NumPy spreads a number over any width)
    return module


def _template(name: str) -> str:
    return resources.files("saltus.kernels").joinpath(name).read_text()
