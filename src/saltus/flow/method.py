"""The base of every method: a small option object that names a compiled flow and gives it its
numbers.
"""

from __future__ import annotations

import functools
import inspect
import math
import sys
from collections.abc import Mapping
from dataclasses import fields
from typing import Any, ClassVar, TypeVar

import numpy as np

from saltus.codegen.module import Flow
from saltus.errors import ParameterError, must_be, nearest, shown
from saltus.system import System
from saltus.system.tangent import tangent_system

#: Default step budget per period; a healthy trajectory takes ten to a hundred steps.
STEPS_PER_PERIOD = 10_000
#: Least step budget of a trajectory.
STEPS_AT_LEAST = 1_000_000


def step_budget(given: int | None, periods: float) -> float:
    """The step budget of a trajectory over ``periods``: the given one, or the default."""
    return (
        float(given)
        if given is not None
        else STEPS_AT_LEAST + STEPS_PER_PERIOD * math.ceil(periods)
    )


def check_positive(name: str, value: Any) -> None:
    """Raise ParameterError for an option that isn't a positive number."""
    if (
        isinstance(value, bool | np.timedelta64)
        or not isinstance(value, int | float | np.integer | np.floating)
        or not 0 < value <= sys.float_info.max
    ):
        raise must_be(name, "a positive number", value)


_M = TypeVar("_M")
#: Options of ode45 by their names in MATLAB.
_MATLAB: Mapping[str, str] = {"reltol": "rtol", "abstol": "atol", "events": "events"}


def explain_unknown_options(cls: type[_M]) -> type[_M]:
    """Raise a clear error for options that a method, or another small option object, doesn't
    have.
    """
    signature, made = inspect.signature(cls), cls.__init__

    @functools.wraps(made)
    def init(self: _M, *args: Any, **kwargs: Any) -> None:
        known = signature.parameters
        for word in kwargs:
            if word not in known:
                own = _MATLAB.get(word.lower())
                raise ParameterError(
                    f"sl.{cls.__name__} has no option {shown(word)}. "
                    f"{f'Write {own}=.' if own in known else nearest(word, known)}"
                )
        if len(args) > len(known):
            raise ParameterError(
                f"sl.{cls.__name__} takes "
                f"{', '.join(f'{name}=' for name in known)}, not {len(args)} "
                f"values in a row."
            )
        try:
            signature.bind(*args, **kwargs)
        except TypeError as error:
            raise ParameterError(
                f"sl.{cls.__name__}: {error}. Write sl.{cls.__name__}"
                f"({', '.join(f'{name}=...' for name in list(known)[:2])})."
            ) from None
        made(self, *args, **kwargs)

    cls.__init__ = init  # type: ignore[assignment, method-assign]
    return cls


class Method:
    """Interface of every method to the engine."""

    #: Column of the numbers that holds the budget of events.
    EVENT_BUDGET: ClassVar[int] = -1

    @property
    def name(self) -> str:
        """Name as users write it."""
        return type(self).__name__

    def options(self) -> dict[str, Any]:
        """The options, for provenance."""
        return {f.name: getattr(self, f.name) for f in fields(self)}  # type: ignore[arg-type]

    def kernels(self, system: System) -> Flow:
        """The compiled module of this method for a system."""
        raise NotImplementedError

    def numbers(self, periods: float) -> np.ndarray:
        """The options as the kernel reads them, for a run of ``periods``."""
        raise NotImplementedError

    def check_forcing(self, period: float) -> None:
        """Raise ParameterError if the steps are too long for a forcing of this period [s]."""

    def due(self, periods: Any) -> Any:  # noqa: ARG002
        """Least progress in :data:`saltus.flow.pace.LONG_CHECK_STEPS` steps, in periods, for one or
        float64[n] lengths of a run; None if there is a budget of steps.
        """
        return None

    def serving(self, system: System) -> Method:  # noqa: ARG002  (most methods serve all)
        """The method that moves a system: this one, or the one that stands in for it."""
        return self

    def tangents(
        self, system: System, names: tuple[str, ...] = (), directions: int | None = None
    ) -> System | None:
        """The system whose flow carries the derivative of the state with respect to the state at
        the start, and to some parameters, or along a number of directions; None if it carries
        others only.
        """
        if names or directions is not None or system.is_steep:
            return None
        return tangent_system(system)

    def suited_to(self, count: int) -> Method:  # noqa: ARG002  (unused by most methods)
        """The fastest variant of the method for ``count`` trajectories; its results are the same to
        the bit.
        """
        return self

    @property
    def label(self) -> str:
        """The method in a few words: its name, and the options that differ from the defaults."""
        usual = {f.name: f.default for f in fields(self)}  # type: ignore[arg-type]
        own = {name: value for name, value in self.options().items() if value != usual[name]}
        listed = ", ".join(
            f"{name}={f'{value:g}' if isinstance(value, float) else value}"
            for name, value in own.items()
        )
        return f"{self.name} ({listed})" if listed else self.name

    @property
    def records_contacts(self) -> bool:
        """True if contacts are located, so that they can be counted."""
        return True

    @property
    def records_tangents(self) -> bool:
        """True if the records of contacts hold the derivatives that the flow carries."""
        return True

    @property
    def noise(self) -> float:
        """Mismatch of a periodic orbit, relative to the range of the states, that the errors of
        this method explain.
        """
        raise NotImplementedError

    @property
    def fixed(self) -> bool:
        """True if the steps have one length, so that nothing keeps errors from growing."""
        return False

    @property
    def exact(self) -> bool:
        """True if the errors are rounding, so that Newton's method closes orbits."""
        return False

    def noise_of(self, scale: np.ndarray) -> np.ndarray:
        """The noise, float64[k], where the states of k motions have the ranges float64[k, D]."""
        return np.full(len(scale), self.noise)

    def companion(self) -> Method:
        """A more exact method: contact times differ from this method's by about their errors."""
        raise NotImplementedError
