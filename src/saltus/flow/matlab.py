"""Methods that follow the published rules of MATLAB's solvers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, TypeVar

import numpy as np

from saltus.errors import ParameterError
from saltus.flow.method import check_positive, explain_unknown_options
from saltus.flow.one_by_one import OneByOne

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
class Matlab(OneByOne):
    """Options and numbers that MATLAB's solvers have in common."""

    EVENTS: ClassVar[tuple[str, ...]] = ("ignore", "locate")

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
        self._check_common()

    def _own_numbers(self) -> tuple[float, float, float]:
        """RelTol, AbsTol, and 1 if contacts are located."""
        return self.rtol, self.atol, float(self.EVENTS.index(self.events))

    @property
    def label(self) -> str:
        """A label such as ``ode45 located (0.0001, 1e-07)``, ``ode45 not located
        (0.0001, 1e-07)``.
        """
        return (
            f"{self.name.lower()} {'' if self.events == 'locate' else 'not '}located "
            f"({self.rtol:g}, {self.atol:g})"
        )

    @property
    def noise(self) -> float:
        """Errors over some periods. The map isn't even continuous where step counts change, and
        contacts stepped over cost more.
        """
        return min((5.0 if self.events == "locate" else 20.0) * self._error(), 0.01)

    def _error(self) -> float:
        """Errors as a multiple of those of ode45, by RelTol. Measured on a forced oscillator over
        three turns [RelTol]: ode45 2, ode23 18, ode113 9, ode15s 8 RelTol^(-1/6).
        """
        return self.rtol

    def noise_of(self, scale: np.ndarray) -> np.ndarray:
        """The noise of these motions, with the errors that AbsTol allows to small states."""
        factor = np.maximum(1.0, self.atol / (self.rtol * scale)).max(axis=1)
        noise: np.ndarray = self.noise * factor
        return noise


def _documented(cls: type[_M]) -> type[_M]:
    """Insert the common options into the docstring, before the references."""
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
