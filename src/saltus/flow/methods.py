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

#: Every method, as people write it.
METHODS: Mapping[str, type[Method]] = {
    one.__name__: one for one in (Taylor, Modal, RK4, ODE23, ODE45, ODE113, ODE15s)
}


def check_method(method: Any) -> Method:
    """Return the method, or the default for None. Raises ParameterError for anything that isn't a
    method.
    """
    if method is None:
        return Taylor()
    if not isinstance(method, Method):
        what = method.__name__ + " itself" if isinstance(method, type) else shown(method)
        raise ParameterError(
            f"method must be such as sl.Taylor() or sl.ODE45(rtol=1e-4, atol=1e-7), not {what}."
        )
    return method


def exact_method(method: Any, asked: str) -> Method:
    """Return the method for ``asked``, a verb that closes orbits by Newton's method. Raises
    ParameterError for methods with errors beyond rounding.
    """
    checked = check_method(method)
    if not checked.exact:
        raise ParameterError(
            lambda say: say.either(f"{asked} needs", "needs"),
            f" a method whose errors are rounding, not {checked.name}: Newton's method doesn't "
            "close its orbits. ",
            lambda say: f"Leave {say.key('method')} out.",
        )
    return checked
