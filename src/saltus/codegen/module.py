"""The compiled flows of a system; with the JIT off the same templates as plain Python."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from importlib import resources
from types import ModuleType
from typing import Any, Protocol

import numpy as np

from saltus.announce import working
from saltus.codegen import machine, tableaux, templates
from saltus.codegen.head import Constant, Head
from saltus.codegen.interface import (
    ADAMS,
    BALANCE,
    CAPTURE,
    FIXED_STEP,
    HARMONICS,
    MODAL,
    NDF,
    PAIR,
    TAYLOR,
    WAVES,
    Interface,
)
from saltus.codegen.kernels import Kernels
from saltus.codegen.rates_head import rates_head
from saltus.codegen.taylor_head import taylor_head
from saltus.contact.guards import expressions_of
from saltus.errors import TraceError
from saltus.language.expression import walk
from saltus.system import System
from saltus.system.quantity import acting_guards

#: Modes that a step of the modal flow holds in a lane each, and waves that their search does.
MODAL_LANES, WAVE_LANES = (templates.BITCODE[name][1] for name in ("modal", "waves"))
#: Text above the templates when they run as plain Python.
_PREAMBLE = """
import math
import numpy as np
from saltus.kernels.lanes import *
from saltus.kernels.marks import entry, inner, kernel
from saltus.kernels.trigonometry import sincos, turned
"""


class Flow(Protocol):
    """The part of a compiled flow that the engine needs."""

    #: Columns of `carry`; most records of one step.
    CARRY: int
    STEP_RECORDS: int

    def workspace(self) -> tuple[np.ndarray, ...]:
        """The work arrays of one call; one set for each thread."""

    def propagate(self, *values: Any) -> int:
        """Move the trajectories of a batch (kernels/batch.py)."""

    def bound(self, *values: Any) -> Callable[[], int]:
        """A repeatable call of :meth:`propagate` with these arrays, on this thread."""


def jit_disabled() -> bool:
    """True if ``SALTUS_DISABLE_JIT=1`` asks for plain Python: slow, for debuggers and for the
    coverage of the kernels.
    """
    return os.environ.get("SALTUS_DISABLE_JIT", "0") not in ("", "0")


def lane_width() -> int:
    """Trajectories in the lanes of a step: two instructions' worth, since one works while the other
    waits.

    Measured on the rig [µs a period]: AVX-512 with 8 and 16 lanes 1.27, 1.16; AVX2 with 4, 8, 16
    lanes 2.06, 1.87, 2.05; without fused multiply-add 2 and 4 lanes 17.7, 23.8. NEON has registers
    of 2, so 4 lanes; nobody has measured it.
    """
    register = machine.register_width()
    arm = machine.target().triple.startswith(("aarch64", "arm64"))
    return 2 * register if register > 2 or arm else register


@lru_cache(maxsize=256)
def taylor_module(system: System, order: int, lanes: int) -> Flow:
    """The compiled Taylor flow of a system. Parameters are arguments: new values
    never recompile.
    """
    title = f"{system.name}, Taylor order {order}, {lanes} lanes"
    with working(lambda: f"compiling {_sized(system)}"):
        head = _printed(system, lambda: taylor_head(system, order, lanes))
        return _flow(TAYLOR, f"taylor_{lanes}", head, title, f"{_described(system)} for Taylor")


#: Templates, bitcode, and numbers of each other method, by name.
_STEPS: dict[str, tuple[Interface, str, Mapping[str, Constant]]] = {
    "ODE45": (PAIR, "pair", tableaux.DORMAND_PRINCE),
    "ODE23": (PAIR, "pair", tableaux.BOGACKI_SHAMPINE),
    "ODE113": (ADAMS, "adams", tableaux.ADAMS),
    "ODE15s": (NDF, "ndf", tableaux.NDF),
    "RK4": (FIXED_STEP, "fixed_step", tableaux.CLASSICAL),
}


@lru_cache(maxsize=256)
def steps_module(system: System, method: str) -> Flow:
    """The compiled flow of a system by a method that runs one trajectory after the other."""
    interface, template, numbers = _STEPS[method]
    jacobian, title = "jacobian" in interface.functions, f"{system.name}, {method}"
    with working(lambda: f"compiling {_sized(system)}"):
        head = _printed(system, lambda: rates_head(system, numbers, jacobian))
        return _flow(interface, template, head, title, f"{_described(system)} for {method}")


def _printed(system: System, head: Callable[[], Head]) -> Head:
    """The functions of an equation. Raises TraceError for one whose operations are nested deeper
    than Python follows.
    """
    try:
        return head()
    except RecursionError:
        raise TraceError(
            f"{system.name}: hundreds of operations stand within one another in an expression of "
            f"its equation, more than can be compiled. "
            "Multiply in pairs, ((a*b)*(c*d))*..., or give a curve by sl.table."
        ) from None


@lru_cache(maxsize=1)
def capture_module() -> Any:
    """The compiled test of capture, the same for all systems."""
    return _flow(CAPTURE, "capture", Head({}, ""), "capture", "the test of capture")


@lru_cache(maxsize=1)
def harmonics_module() -> Any:
    """The compiled search for the zeros of Fourier series, the same for all systems."""
    return _flow(HARMONICS, "harmonics", Head({}, ""), "harmonics", "the zeros of Fourier series")


@lru_cache(maxsize=256)
def balance_module(functions: str, name: str) -> Any:
    """The compiled equations of harmonic balance, of the forces that
    :func:`saltus.codegen.forces_head.forces_text` prints of a system of some name.
    """
    with working(lambda: f"compiling {name} for harmonic balance"):
        head = Head({}, functions)
        return _flow(
            BALANCE, "balance", head, f"{name}, harmonic balance", f"{name} for harmonic balance"
        )


@lru_cache(maxsize=1)
def modal_module() -> Any:
    """The compiled modal flow, the same for all systems."""
    head = Head({"LANES": MODAL_LANES}, "")
    return _flow(MODAL, "modal", head, "modal", "the modal flow")


@lru_cache(maxsize=1)
def waves_module() -> Any:
    """The compiled search for the turning points of sums of waves, the same for all systems."""
    return _flow(WAVES, "waves", Head({"LANES": WAVE_LANES}, ""), "waves", "turns of waves")


def _described(system: System) -> str:
    """The compiled system in words for the user who waits: a verb that extends the equation says
    so.
    """
    if system.tangent_of is not None:
        return f"the tangent flow of {system.name}"
    return (
        f"{system.name} with a surface"
        if len(acting_guards(system)) < len(system.guards)
        else system.name
    )


def _sized(system: System) -> str:
    """The compiled system in words, with its size."""
    operations = sum(1 for _ in walk(*system.field, *expressions_of(system.guards)))
    return f"{_described(system)} ({len(system.guards)} boundaries, {operations} operations)"


def _flow(interface: Interface, template: str, head: Head, title: str, what: str) -> Flow:
    return (
        _interpreted(interface, head)
        if jit_disabled()
        else Kernels(interface, template, head, title, what)
    )


def _interpreted(interface: Interface, head: Head) -> ModuleType:
    """Head and templates as plain Python, each template under its own file name, so that coverage
    and debuggers see it.
    """
    module = ModuleType(f"saltus_{interface.entry}")
    exec(compile(_PREAMBLE + head.text, "<generated head>", "exec"), module.__dict__)
    for name in filter(None, (interface.layout, *interface.templates)):
        path = str(resources.files("saltus.kernels").joinpath(f"{name}.py"))
        exec(compile(templates.text(name), path, "exec"), module.__dict__)
    module.__dict__["propagate"] = propagate = module.__dict__[interface.entry]
    module.__dict__["bound"] = partial(partial, propagate)
    return module
