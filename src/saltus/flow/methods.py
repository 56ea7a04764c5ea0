"""The methods, by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from saltus.errors import ParameterError, shown
from saltus.flow.fixed_step import RK4
from saltus.flow.matlab import ODE23, ODE45, ODE113, ODE15s
from saltus.flow.method import Method
from saltus.flow.modal import Modal
from saltus.flow.taylor import Taylor
from saltus.system import System
from saltus.system.linearity import linear_pieces

__all__ = [
    "METHODS",
    "ODE23",
    "ODE45",
    "ODE113",
    "RK4",
    "Method",
    "Modal",
    "ODE15s",
    "Taylor",
    "check_method",
]

#: States from which on the modal flow is the default where it serves a system: it is faster than
#: Taylor's method from some three modes on.
MANY_STATES = 8
#: Every method, as people write it.
METHODS: Mapping[str, type[Method]] = {
    one.__name__: one for one in (Taylor, Modal, RK4, ODE23, ODE45, ODE113, ODE15s)
}


def check_method(method: Any, system: Any) -> Method:
    """Return the method, or the default of a system for None. Raises ParameterError for anything
    that isn't a method.
    """
    if method is None:
        return default_method(system) if isinstance(system, System) else Taylor()
    if not isinstance(method, Method):
        what = method.__name__ + " itself" if isinstance(method, type) else shown(method)
        balance = " Harmonic balance is by=." if "HarmonicBalance" in what else ""
        raise ParameterError(
            f"method must be such as sl.Taylor() or sl.ODE45(rtol=1e-4, atol=1e-7), not {what}."
            f"{balance}"
        )
    return method


def default_method(system: System) -> Method:
    """The modal flow for systems that it serves and that have many states, Taylor's for others."""
    many = len(system.states) >= MANY_STATES
    return Modal() if many and Modal().serving(system.origin) == Modal() else Taylor()


def exact_method(method: Any, system: Any, asked: str) -> Method:
    """Return the method for ``asked``, a verb that closes orbits by Newton's method. Raises
    ParameterError for methods with errors beyond rounding.
    """
    checked = check_method(method, system)
    if not checked.exact:
        raise ParameterError(
            lambda say: say.either(f"{asked} needs", "needs"),
            f" a method whose errors are rounding, not {checked.label}: Newton's method doesn't "
            "close its orbits. ",
            lambda say: f"Leave {say.key('method')} out.",
        )
    return checked


def note_on(method: Method, system: System) -> str:
    """The flow that moves a system, and why, where the name of the method doesn't say so: the modal
    flow is asked for, or would be the default, and doesn't serve the system. Else ``""``.
    """
    asked = isinstance(method, Modal)
    if not (asked or (isinstance(method, Taylor) and len(system.states) >= MANY_STATES)):
        return ""
    found = linear_pieces(system.origin)
    if not isinstance(found, str):
        return ""
    return f"moved by Taylor: {found}" if asked else f"not by Modal: {found}"
