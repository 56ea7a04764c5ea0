"""Runge-Kutta steps of a fixed length, with the ways of crossing a boundary that the literature
uses.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from saltus.errors import ParameterError
from saltus.flow.method import check_positive, explain_unknown_options
from saltus.flow.one_by_one import OneByOne
from saltus.units import to_si

#: Least steps in a forcing period: fewer miss changes of the forcing.
STEPS_PER_FORCING = 10


@explain_unknown_options
@dataclass(frozen=True)
class RK4(OneByOne):
    """The classical Runge-Kutta method in steps of one length, as literature on contacts uses it.

    Parameters
    ----------
    step : float | str
        Length of a step [s], at most a tenth of the forcing's period. The last step before the end,
        and before a break of the forcing, is shorter. A motion that only errors of too long steps
        let grow ends with status ``nonfinite``.
    events : {"ignore", "henon", "inverse", "bisect"}
        ``"ignore"``: the right-hand side picks its side from the state at every stage; the order
        falls to 2 where a force bends, to 1 where it jumps. An impact or a jump of the state then
        happens at the first node past its boundary: order 1. The others keep the side of a contact
        until a step lands on its boundary, then start afresh, and keep the order. ``"henon"``: one
        step back from the start of the step that crossed, with the gap in place of time.
        ``"inverse"``: time as a cubic of the gap through both ends of that step, twice.
        ``"bisect"``: the step is halved until it ends just beyond the boundary. Where a gap turns
        about within the step that crossed, the first two end with status ``turned``; at an impact,
        also where its rate more than doubles in the step.
    tolerance : float
        Bracket of a contact after ``"bisect"``, as a share of a step [-].
    max_steps, max_events : int, optional
        Budgets of one trajectory. Default: 10 000 steps per period and a million more; 10 million
        contacts.

    References
    ----------
    Kutta, Z. Math. Phys. 46 (1901) 435-453; Henon, Physica D 5 (1982) 412-414.
    """

    #: In the order of kernels/stepping/landing.py.
    EVENTS: ClassVar[tuple[str, ...]] = ("ignore", "henon", "inverse", "bisect")

    step: float | str
    events: str = "bisect"
    tolerance: float = 2.0**-40
    max_steps: int | None = None
    max_events: int = 10_000_000

    def __post_init__(self) -> None:
        if isinstance(self.step, str):
            object.__setattr__(self, "step", to_si(self.step, "s", "step"))
        check_positive("step", self.step)
        check_positive("tolerance", self.tolerance)
        if self.tolerance >= 1:
            raise ParameterError(f"tolerance is a share of a step, below 1, not {self.tolerance}.")
        self._check_common()

    def _own_numbers(self) -> tuple[float, float, float]:
        """Length of a step, tolerance, the way of crossing."""
        return float(self.step), self.tolerance, float(self.EVENTS.index(self.events))

    @property
    def fixed(self) -> bool:
        """True: the steps have one length."""
        return True

    def check_forcing(self, period: float) -> None:
        """Raise ParameterError for fewer than :data:`STEPS_PER_FORCING` steps in a period [s]."""
        longest = period / STEPS_PER_FORCING
        if float(self.step) > longest * (1 + 1e-9):
            raise ParameterError(
                lambda say: (
                    f"RK4's step of {float(self.step):g} s is longer than a tenth of the "
                    f"forcing's period of {period:g} s: too long to follow it. Take at most "
                    f"RK4({longest:.3g}), or {say.method('Taylor')}, which finds its steps itself."
                )
            )

    @property
    def label(self) -> str:
        """A label such as ``RK4 henon (0.001)``."""
        return f"{self.name} {self.events} ({float(self.step):g})"

    @property
    def noise(self) -> float:
        """The assumed error: nothing measures the errors of fixed steps."""
        return 1e-3 if self.records_contacts else 0.01
