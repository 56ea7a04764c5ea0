"""Methods: small option objects that name a compiled flow and hand it its numbers."""

from __future__ import annotations

import functools
import inspect
import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np

from saltus.codegen.module import Flow, lane_width, ode45_module, taylor_module
from saltus.errors import ParameterError, nearest, shown
from saltus.flow.counts import whole
from saltus.flow.pace import CHECK_STEPS, LONG_CHECK_STEPS
from saltus.system.system import System

#: Steps that a trajectory may take for each of its periods; a healthy one takes ten to a hundred.
STEPS_PER_PERIOD = 10_000
#: Steps that any trajectory may take.
STEPS_AT_LEAST = 1_000_000
#: Trajectories of a small batch, and its lanes: one and the three copies that measure its errors.
#: 16 lanes take twice as long (0028).
SMALL_BATCH = 4
#: Share of its span that LONG_CHECK_STEPS steps must bring: a trajectory of 1e9 steps, minutes,
#: runs to its end.
SLOWEST_SHARE = 1e-3


def _step_budget(given: int | None, periods: float) -> float:
    return (
        float(given)
        if given is not None
        else STEPS_AT_LEAST + STEPS_PER_PERIOD * math.ceil(periods)
    )


def _check_positive(name: str, value: Any) -> None:
    if (
        isinstance(value, bool | np.timedelta64)
        or not isinstance(value, int | float | np.integer | np.floating)
        or not 0 < value <= sys.float_info.max
    ):
        raise ParameterError(f"{name} must be a positive number, not {shown(value)}.")


_M = TypeVar("_M", bound="Method")
#: Names of ode45's options here.
_MATLAB: Mapping[str, str] = {"reltol": "rtol", "abstol": "atol", "events": "events"}


def _explain_unknown_options(cls: type[_M]) -> type[_M]:
    """Raise a clear error for options that a method doesn't have."""
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
        made(self, *args, **kwargs)

    cls.__init__ = init  # type: ignore[assignment, method-assign]
    return cls


class Method:
    """What every method offers to the engine."""

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

    def due(self, periods: float) -> float | None:  # noqa: ARG002
        """Least progress in :data:`saltus.flow.pace.LONG_CHECK_STEPS` steps, in periods; None if
        there is a budget of steps.
        """
        return None

    def suited_to(self, count: int) -> Method:  # noqa: ARG002  (unused by most methods)
        """The fastest variant of the method for ``count`` trajectories; its results are the same to
        the bit.
        """
        return self

    @property
    def records_contacts(self) -> bool:
        """Whether contacts are located, so that there is something to count."""
        return True

    @property
    def noise(self) -> float:
        """Mismatch of a periodic orbit, relative to the range of the states, that this method's own
        errors explain.
        """
        raise NotImplementedError

    @property
    def exact(self) -> bool:
        """Whether its errors are rounding, so that Newton's method closes its orbits."""
        return False

    def noise_of(self, scale: np.ndarray) -> np.ndarray:
        """The noise, float64[k], where the states of k motions have the ranges float64[k, D]."""
        return np.full(len(scale), self.noise)

    def companion(self) -> Method:
        """A more exact method: the distance of its contact times from this one's measures their
        errors.
        """
        raise NotImplementedError


@_explain_unknown_options
@dataclass(frozen=True)
class Taylor(Method):
    """Taylor series, contacts located on the gap's own polynomial: machine precision, no contact
    missed. The default.

    Parameters
    ----------
    order : int
        Order of the series, 6 to 40. 20 is where the rig's cost is flattest (benchmarks/flow.py):
        higher orders take fewer steps, but every contact ends a step anyway.
    tolerance : float
        Size of the last two terms of a step relative to the leading ones [-]. The default, 2**-56,
        leaves rounding only, over any number of periods; 2**-46 leaves 3e-15 m of error on the rig
        after five periods and takes a quarter less time.
    lanes : int, optional
        Trajectories moved at once: 2, 4, 8 or 16. Default: what suits the processor, and a short
        run of few. Results don't depend on it.
    max_steps, max_events : int, optional
        Budgets of one trajectory; beyond them it stops with status ``budget_steps`` or
        ``budget_events``. Default: any number of steps as long as each million brings it a
        thousandth of the run further, or 100 periods, and it doesn't stand still; 10 million
        contacts.

    References
    ----------
    Jorba & Zou, Experimental Mathematics 14 (2005) 99-117.
    """

    order: int = 20
    tolerance: float = 2.0**-56
    lanes: int | None = None
    max_steps: int | None = None
    max_events: int = 10_000_000

    def __post_init__(self) -> None:
        whole(self.order, "order", 6, 40)
        _check_positive("tolerance", self.tolerance)
        if self.lanes is not None and (
            not isinstance(self.lanes, int) or self.lanes not in (2, 4, 8, 16)
        ):
            raise ParameterError(f"lanes must be 2, 4, 8 or 16, not {shown(self.lanes)}.")
        if self.max_steps is not None:
            whole(self.max_steps, "max_steps")
        whole(self.max_events, "max_events")

    def kernels(self, system: System) -> Flow:
        """The compiled Taylor flow."""
        return taylor_module(system, self.order, self.lanes or lane_width())

    def suited_to(self, count: int) -> Taylor:
        """With few lanes for few trajectories, unless the user has chosen."""
        return (
            replace(self, lanes=min(SMALL_BATCH, lane_width()))
            if self.lanes is None and count <= SMALL_BATCH
            else self
        )

    def numbers(self, periods: float) -> np.ndarray:
        """log2 of the tolerance, steps between two checks of the pace, event budget, least progress
        between two checks [periods].
        """
        due = self.due(periods)
        steps, least = (
            (CHECK_STEPS, due * CHECK_STEPS / LONG_CHECK_STEPS)
            if due is not None
            else (self.max_steps or 0, math.inf)
        )
        return np.array([math.log2(self.tolerance), float(steps), float(self.max_events), least])

    def due(self, periods: float) -> float | None:
        """See :class:`Method`."""
        return (
            min(SLOWEST_SHARE * periods, LONG_CHECK_STEPS / STEPS_PER_PERIOD)
            if self.max_steps is None
            else None
        )

    @property
    def noise(self) -> float:
        """Truncation and rounding over some periods."""
        return max(100.0 * self.tolerance, 1e-12)

    @property
    def exact(self) -> bool:
        """Yes."""
        return True

    def companion(self) -> Taylor:
        """The same series with steps an eighth shorter, which leaves a twentieth of the truncation;
        the same compiled kernel.
        """
        return Taylor(
            self.order, self.tolerance * 2.0**-4, self.lanes, self.max_steps, self.max_events
        )


@_explain_unknown_options
@dataclass(frozen=True)
class ODE45(Method):
    """MATLAB's ode45 with odezero, digit for digit, for comparison with published results.

    Parameters
    ----------
    rtol, atol : float
        RelTol [-] and AbsTol [unit of each state]; the defaults are MATLAB's.
    events : {"locate", "ignore"}
        ``"locate"``: integration stops at each contact and starts afresh, as with MATLAB's Events
        option. ``"ignore"``: contacts are stepped over and the right-hand side picks its side from
        the state, as without it.
    max_steps, max_events : int, optional
        Budgets of one trajectory. Default: 10 000 steps per period and a million more; 10 million
        contacts.

    References
    ----------
    Dormand & Prince, J. Comput. Appl. Math. 6 (1980) 19-26; Shampine & Reichelt, SIAM J. Sci.
    Comput. 18 (1997) 1-22.
    """

    rtol: float = 1e-3
    atol: float = 1e-6
    events: str = "locate"
    max_steps: int | None = None
    max_events: int = 10_000_000

    def __post_init__(self) -> None:
        _check_positive("rtol", self.rtol)
        _check_positive("atol", self.atol)
        if self.rtol < 100 * np.finfo(float).eps:
            raise ParameterError(
                f"rtol must be at least {100 * np.finfo(float).eps:.3g}, as in "
                f"MATLAB, not {self.rtol}."
            )
        if not isinstance(self.events, str) or self.events not in ("locate", "ignore"):
            raise ParameterError(f'events must be "locate" or "ignore", not {shown(self.events)}.')
        if self.max_steps is not None:
            whole(self.max_steps, "max_steps")
        whole(self.max_events, "max_events")

    def kernels(self, system: System) -> Flow:
        """The compiled ode45."""
        return ode45_module(system)

    def numbers(self, periods: float) -> np.ndarray:
        """RelTol, AbsTol, whether contacts are located, step budget, event budget."""
        locate = 1.0 if self.events == "locate" else 0.0
        return np.array(
            [
                self.rtol,
                self.atol,
                locate,
                _step_budget(self.max_steps, periods),
                float(self.max_events),
            ]
        )

    @property
    def records_contacts(self) -> bool:
        """Only if they are located."""
        return self.events == "locate"

    @property
    def noise(self) -> float:
        """ode45's errors over some periods: its map isn't even continuous where step counts change,
        and contacts stepped over cost more.
        """
        return min((5.0 if self.events == "locate" else 20.0) * self.rtol, 0.01)

    def noise_of(self, scale: np.ndarray) -> np.ndarray:
        """The same, with the errors that AbsTol allows to small states."""
        return self.noise * np.maximum(1.0, self.atol / (self.rtol * scale)).max(axis=1)

    def companion(self) -> Taylor:
        """The Taylor flow, which is exact compared with ode45."""
        return Taylor()


def check_method(method: Any) -> Method:
    """The method itself, the default for None. Raises ParameterError for anything
    that isn't one.
    """
    if method is None:
        return Taylor()
    if not isinstance(method, Method):
        what = method.__name__ + " itself" if isinstance(method, type) else shown(method)
        raise ParameterError(
            f"method must be such as sl.Taylor() or sl.ODE45(rtol=1e-4, atol=1e-7), not {what}."
        )
    return method
