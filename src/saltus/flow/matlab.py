"""Methods that follow the published rules of MATLAB's solvers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from saltus.codegen.module import Flow, steps_module
from saltus.errors import ParameterError, shown
from saltus.flow.counts import whole
from saltus.flow.method import Method, check_positive, explain_unknown_options, step_budget
from saltus.flow.taylor import Taylor
from saltus.system.system import System

_PARAMETERS = """
    Parameters
    ----------
    rtol, atol : float
        RelTol [-] and AbsTol [unit of each state]; the defaults are MATLAB's.
    events : {"locate", "ignore"}
        ``"locate"``: integration stops at each contact and starts afresh, as with MATLAB's Events
        option. ``"ignore"``: contacts are stepped over and the right-hand side picks its side from
        the state, as without it; impacts and jumps of the state happen at the end of the step that
        has passed their boundary.
    max_steps, max_events : int, optional
        Budgets of one trajectory. Default: 10 000 steps per period and a million more; 10 million
        contacts.
"""
_M = TypeVar("_M", bound="Matlab")


@dataclass(frozen=True)
class Matlab(Method):
    """Options and numbers that MATLAB's solvers have in common."""

    rtol: float = 1e-3
    atol: float = 1e-6
    events: str = "locate"
    max_steps: int | None = None
    max_events: int = 10_000_000

    def __post_init__(self) -> None:
        check_positive("rtol", self.rtol)
        check_positive("atol", self.atol)
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
        """The compiled method."""
        return steps_module(system, self.name)

    def numbers(self, periods: float) -> np.ndarray:
        """RelTol, AbsTol, whether contacts are located, step budget, event budget."""
        return np.array(
            [
                self.rtol,
                self.atol,
                float(self.events == "locate"),
                step_budget(self.max_steps, periods),
                float(self.max_events),
            ]
        )

    @property
    def label(self) -> str:
        """Such as ``ode45 located (0.0001, 1e-07)``, ``ode45 not located (0.0001, 1e-07)``."""
        return (
            f"{self.name.lower()} {'' if self.events == 'locate' else 'not '}located "
            f"({self.rtol:g}, {self.atol:g})"
        )

    @property
    def records_contacts(self) -> bool:
        """Only if they are located."""
        return self.events == "locate"

    @property
    def noise(self) -> float:
        """Errors over some periods: the map isn't even continuous where step counts change, and
        contacts stepped over cost more.
        """
        return min((5.0 if self.events == "locate" else 20.0) * self._error(), 0.01)

    def _error(self) -> float:
        """Errors as a multiple of those of ode45: how they depend on RelTol. Measured on a forced
        oscillator over three turns [RelTol]: ode45 2, ode23 18, ode113 9, ode15s 8 RelTol^(-1/6).
        """
        return self.rtol

    def noise_of(self, scale: np.ndarray) -> np.ndarray:
        """The same, with the errors that AbsTol allows to small states."""
        return self.noise * np.maximum(1.0, self.atol / (self.rtol * scale)).max(axis=1)

    def companion(self) -> Taylor:
        """The Taylor flow, which is exact compared with these methods."""
        return Taylor()


def _documented(cls: type[_M]) -> type[_M]:
    """The options, which all have in common, in the docstring before the references."""
    first, rule, rest = (cls.__doc__ or "").partition("\n    References\n")
    cls.__doc__ = first + _PARAMETERS + rule + rest
    return explain_unknown_options(cls)


@_documented
@dataclass(frozen=True)
class ODE45(Matlab):
    """MATLAB's ode45 with odezero, digit for digit, for comparison with published results.

    References
    ----------
    Dormand & Prince, J. Comput. Appl. Math. 6 (1980) 19-26; Shampine & Reichelt, SIAM J. Sci.
    Comput. 18 (1997) 1-22.
    """


@_documented
@dataclass(frozen=True)
class ODE23(Matlab):
    """MATLAB's ode23 with odezero, re-implemented from the published rules: order 3, for loose
    tolerances.

    References
    ----------
    Bogacki & Shampine, Appl. Math. Lett. 2 (1989) 321-325; Shampine & Reichelt, SIAM J. Sci.
    Comput. 18 (1997) 1-22.
    """

    def _error(self) -> float:
        return 8.0 * self.rtol


@_documented
@dataclass(frozen=True)
class ODE113(Matlab):
    """MATLAB's ode113 with odezero, re-implemented from the published rules: Adams formulas of
    orders 1 to 13, for tight tolerances and costly equations. Starts at order 1 at every contact.

    References
    ----------
    Shampine & Gordon, Computer Solution of Ordinary Differential Equations (1975); Shampine &
    Reichelt, SIAM J. Sci. Comput. 18 (1997) 1-22.
    """

    def _error(self) -> float:
        return 4.0 * self.rtol


@_documented
@dataclass(frozen=True)
class ODE15s(Matlab):
    """MATLAB's ode15s with odezero, re-implemented from the published rules, for stiff systems:
    numerical differentiation formulas of orders 1 to 5, with the Jacobian derived from the
    equation. Starts at order 1 at every contact.

    References
    ----------
    Shampine & Reichelt, SIAM J. Sci. Comput. 18 (1997) 1-22.
    """

    def _error(self) -> float:
        return float(4.0 * self.rtol ** (5 / 6))
