"""Sweeps: a sine whose frequency runs from one value to another."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.errors import ParameterError, UnitError, must_be, shown
from saltus.language.compositions import where
from saltus.language.expression import Expr, Operand, with_own_unit
from saltus.language.functions import exp, log, sin
from saltus.units import coherent_unit, to_si

_TURN = 2 * math.pi
#: The unit of a logarithmic rate: octaves per time.
_OCTAVES = re.compile(r"\boct(aves?)?\b")


@dataclass(frozen=True)
class Sweep:
    """A sine of variable frequency, made by :func:`sweep`: in an equation, a function of the time.

    Attributes
    ----------
    first, last : Expr or float
        Frequencies at its ends [Hz].
    rate : Expr or float
        Rate of change of the frequency [Hz/s], or of its logarithm to base 2 [1/s]; it has the sign
        of the change.
    octaves : bool
        Whether the frequency changes by octaves.
    amplitude : Expr or float
        Its amplitude [SI].
    unit : str
        Coherent SI unit of its values, ``""`` if none was given.
    """

    first: Any
    last: Any
    rate: Any
    octaves: bool = False
    amplitude: Any = 1.0
    unit: str = ""

    @property
    def duration(self) -> Any:
        """Time from one frequency to the other [s]."""
        if self.octaves:
            return log(self.last / self.first) / (math.log(2) * self.rate)
        return (self.last - self.first) / self.rate

    def turns(self, t: Any) -> Any:
        """The turns from time 0 to ``t``: the integral of the frequency over the time."""
        end = self.duration
        within = where(t < end, t, end)
        if self.octaves:
            growth = math.log(2) * self.rate
            swept = self.first * (exp(growth * within) - 1.0) / growth
        else:
            swept = (self.first + 0.5 * self.rate * within) * within
        return swept + self.last * (t - within)

    def __call__(self, t: Any) -> Any:
        """The value [SI] at a time, which may be a number or an array of numbers.

        Raises
        ------
        TraceError
            If it is looked up at a state.
        """
        if isinstance(t, Expr) or not np.ndim(t):
            return self.amplitude * with_own_unit(lambda: sin(_TURN * self.turns(t)))
        found = [self(one) for one in np.ravel(t).tolist()]
        return np.reshape(found, np.shape(t))


def sweep(
    first: Operand | str,
    last: Operand | str,
    rate: Operand | str,
    *,
    amplitude: Operand | str = 1.0,
) -> Sweep:
    """A sine that sweeps through frequencies: ``run_up = sl.sweep("5 Hz", "50 Hz", "1 Hz/s")``, and
    in the equation ``force*run_up(t)``.

    Parameters
    ----------
    first, last : Expr, float or str
        Frequency at time 0, and that at which the sweep ends [Hz]. From then on it stays there.
    rate : Expr, float or str
        How quickly the frequency changes, > 0: ``"1 Hz/s"``, ``"30 Hz/min"``, or ``"1 oct/min"``
        for a logarithmic sweep. A number is in Hz/s.
    amplitude : Expr, float or str
        Amplitude [any unit].

    Returns
    -------
    Sweep
        A function of the time, ``amplitude*sin(2*pi*turns)``, where the turns are the integral of
        the frequency. Its ``duration`` [s] is the time from one frequency to the other.

    Raises
    ------
    ParameterError
        If a frequency or a rate isn't positive, or both frequencies are the same.
    UnitError
        If a unit doesn't fit.

    Examples
    --------
    >>> run_up = sweep("5 Hz", "50 Hz", "1 Hz/s", amplitude="2 m/s^2")
    >>> run_up.duration, run_up.turns(45.0)
    (45.0, 1237.5)
    >>> sweep("5 Hz", "40 Hz", "1 oct/min").duration
    180.0
    """
    octaves = isinstance(rate, str) and _OCTAVES.search(rate) is not None
    if octaves:
        try:
            pace = _positive("rate", _OCTAVES.sub("1", str(rate)), "1/s")
        except UnitError:
            raise UnitError(
                f"rate = {shown(rate)} is no rate of octaves. Write it like '1 oct/min'."
            ) from None
    else:
        pace = _positive("rate", rate, "Hz/s")
    begin, end = _positive("first", first, "Hz"), _positive("last", last, "Hz")
    unit = ""
    if isinstance(amplitude, str):
        unit = coherent_unit(amplitude, "amplitude")
        amplitude = to_si(amplitude, unit, "amplitude")
    elif not isinstance(amplitude, Expr):
        amplitude = to_si(amplitude, "1", "amplitude")
    if not isinstance(begin, Expr) and not isinstance(end, Expr):
        if begin == end:
            raise ParameterError(
                f"a sweep from {begin:g} to {end:g} Hz has no change of frequency: write "
                f"sin(2*pi*frequency*t)."
            )
        pace = pace if end > begin else -pace
    return Sweep(begin, end, pace, octaves, amplitude, unit)


def _positive(name: str, given: Any, unit: str) -> Any:
    """A traced value as it is, anything else in SI. Raises ParameterError unless it is positive."""
    if isinstance(given, Expr):
        return given
    found = to_si(given, unit, name)
    if not found > 0:
        raise must_be(name, f"more than 0 {unit}", given)
    return found
