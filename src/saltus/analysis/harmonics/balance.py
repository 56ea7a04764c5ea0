"""`HarmonicBalance`: the option that asks for truncated Fourier series in place of exact orbits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from saltus.contact.guards import is_hold
from saltus.errors import ParameterError, must_be
from saltus.flow.counts import whole
from saltus.flow.method import explain_unknown_options
from saltus.language import expression as ex
from saltus.system import System
from saltus.system.quantity import is_remembered

#: Most harmonics: matrices have three times as many rows a signal.
MOST = 500
#: Numbers of harmonics that "auto" tries.
TRIED = (5, 11, 23, 47, 95)


@explain_unknown_options
@dataclass(frozen=True)
class HarmonicBalance:
    """Periodic motions as Fourier series of a few harmonics, for ``by=`` of
    :func:`saltus.branches`.

    The equations of motion are fulfilled in the mean over a period, against each harmonic that is
    kept. The only error is that of the truncation: the instants at which the truncated motion meets
    a contact are located to rounding, and forces are integrated between them, not sampled. How far
    the motion is from the exact orbit is told for each point of a branch.

    Parameters
    ----------
    harmonics : int or "auto"
        Number of harmonics of the fundamental frequency, besides the mean. ``"auto"``: branches are
        followed with 5, 11, 23, ... until no point is farther from its exact orbit than
        ``accuracy``, or with 95; the attribute ``harmonics`` of the result is the last number.
    periods : int, optional
        Forcing periods in a period of the fundamental, more than one for subharmonic motions.
        Default: those of each orbit that a branch begins with.
    accuracy : float
        For ``"auto"``: largest ``point_error`` [1].

    Raises
    ------
    ParameterError
        If a number isn't whole, or too large.

    References
    ----------
    Krack & Gross, Harmonic Balance for Nonlinear Vibration Problems (2019).

    Examples
    --------
    >>> import saltus as sl
    >>> stop = sl.models.soft_stop()
    >>> found = sl.branches(stop, {"frequency": (1.4, 1.6)}, (0, 0), at=1, by=sl.HarmonicBalance(5))
    >>> found.attrs["harmonics"]
    5
    """

    harmonics: int | str
    periods: int | None = None
    accuracy: float = 0.01

    def __post_init__(self) -> None:
        if self.harmonics != "auto":
            if not isinstance(self.harmonics, int | np.integer) or self.harmonics > MOST:
                raise must_be(
                    "harmonics", f'a whole number up to {MOST}, or "auto"', self.harmonics
                )
            whole(self.harmonics, "harmonics", 1)
        if not isinstance(self.accuracy, int | float) or not self.accuracy > 0:
            raise must_be("accuracy", "a positive number", self.accuracy)
        if self.periods is not None:
            whole(self.periods, "periods", 1)

    @property
    def count(self) -> int:
        """Number of harmonics, where it is given."""
        return int(self.harmonics)

    @property
    def tries(self) -> list[HarmonicBalance]:
        """The options with the numbers of harmonics that are tried in turn."""
        counts = TRIED if self.harmonics == "auto" else (self.count,)
        return [replace(self, harmonics=one) for one in counts]


def check_balanced(by: Any, system: System) -> None:
    """Raise a ParameterError for a system whose motions aren't balanced by harmonics, or an option
    that is none.
    """
    _check(by)
    unforced = "it has no forcing, and the period of what repeats isn't known"
    _refuse(system, _reason_against_laws(system) if system.forced_at else unforced)


def check_backbone(by: Any, system: System) -> None:
    """The same of backbones."""
    _check(by)
    if by.harmonics == "auto":
        raise ParameterError(
            lambda say: (
                f"of a backbone give the number of {say.key('harmonics')}: {say.key(harmonics=9)}."
            )
        )
    _refuse(system, _reason_against_laws(system))


def _check(by: Any) -> None:
    if not isinstance(by, HarmonicBalance):
        raise must_be("by", "sl.HarmonicBalance(...), such as sl.HarmonicBalance(9)", by)


def _refuse(system: System, reason: str) -> None:
    if reason:
        raise ParameterError(
            f"harmonic balance doesn't serve {system.name}: {reason}. Leave out ",
            lambda say: f"{say.key('by')}: exact orbits are followed then.",
        )


def _reason_against_laws(system: System) -> str:
    """The reason why the motions of a system aren't balanced; empty if they are."""
    for guard in system.guards:
        if guard.law is not None and guard.law.kind == "impact":
            return (
                f"at the rigid stop {guard.name!r} velocities jump, which a sum of harmonics "
                "doesn't; a stop with a stiffness is balanced"
            )
        if guard.law is not None and guard.law.kind == "jump":
            return f"at {guard.name!r} its state jumps, which a sum of harmonics doesn't"
    if system.made:
        return "an element of it has a memory: what it remembers is no sum of harmonics"
    if any(map(is_remembered, system.states)):
        return "it holds past values"
    gaps = [guard.gap for guard in system.guards if not is_hold(guard)]
    for node in ex.walk(*system.field, *gaps):
        clock = node.op in ("mod", "table")
        asked = node.op == "select" and any(
            ex.varies(one.gap) for one in ex.relations_in(node.payload)
        )
        if clock or asked:
            return "it switches at instants that the time alone decides"
    return ""
