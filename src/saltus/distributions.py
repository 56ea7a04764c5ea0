"""Distributions of uncertain parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from saltus.errors import ParameterError, must_be, shown
from saltus.units import from_si, to_si


@dataclass(frozen=True)
class Distribution:
    """Distribution of the values of a parameter; made by :func:`normal` and its like.

    Attributes
    ----------
    kind : str
        ``normal``, ``uniform``, ``lognormal``, ``triangular``, ``truncated`` or ``distribution``.
    given : tuple
        Its numbers, in the order of the function that made it [SI, or text with a unit].
    inner : Distribution or frozen distribution of scipy.stats, optional
        What is truncated, or has a unit given to it.
    """

    kind: str
    given: tuple[Any, ...]
    inner: Any = None

    def values(self, shares: np.ndarray, unit: str, name: str) -> np.ndarray:
        """Values of a parameter [SI] below which shares float64[n] of all its values lie.

        Parameters
        ----------
        shares : float64[n]
            Between 0 and 1.
        unit : str
            Coherent SI unit of the parameter.
        name : str
            Its name, for messages.

        Raises
        ------
        ParameterError, UnitError
            If its numbers don't fit the parameter, or each other.
        """
        numbers = self._numbers(unit, name)
        if self.kind == "truncated":
            low, high = (self.inner.share(one, unit, name) for one in numbers)
            if not low < high:
                raise ParameterError(
                    f"no value of {name} lies in the range that its distribution is truncated to."
                )
            found = self.inner.values(low + (high - low) * shares, unit, name)
            return np.asarray(np.clip(found, numbers[0], numbers[1]), float)
        frozen, factor = self._frozen(numbers)
        return np.asarray(factor * frozen.ppf(shares), float)

    def share(self, value: float, unit: str, name: str) -> float:
        """Share of all values that lie below a value [SI]."""
        numbers = self._numbers(unit, name)
        if self.kind == "truncated":
            low, high, here = (self.inner.share(one, unit, name) for one in (*numbers, value))
            return float(np.clip((here - low) / (high - low), 0.0, 1.0))
        frozen, factor = self._frozen(numbers)
        return float(frozen.cdf(value / factor))

    def text(self, unit: str, name: str) -> str:
        """It as it is written, numbers in a unit that suits them: ``normal(0.4 mm, 0.02 mm)``."""
        parts = [
            from_si(one, "" if self.kind == "lognormal" and i else unit)
            for i, one in enumerate(self._numbers(unit, name))
            if math.isfinite(one) and self.kind != "distribution"
        ]
        if self.kind == "truncated":
            parts.insert(0, self.inner.text(unit, name))
        elif self.kind == "distribution":
            parts.insert(0, str(self.inner.dist.name))
        return f"{self.kind}({', '.join(parts)})"

    def _numbers(self, unit: str, name: str) -> tuple[float, ...]:
        """Its numbers [SI], checked."""
        if self.kind == "distribution":
            (own,) = self.given
            return (1.0 if own is None else to_si(f"1 {own}", unit, name),)
        units = (unit, "") if self.kind == "lognormal" else (unit,) * len(self.given)
        ends = (-math.inf, math.inf)
        found = tuple(
            ends[i] if one is None else to_si(one, its, f"{self.kind} distribution of {name}")
            for i, (one, its) in enumerate(zip(self.given, units, strict=True))
        )
        good, rule = {
            "normal": (found[-1] > 0, "a standard deviation above 0"),
            "lognormal": (found[0] > 0 and found[-1] > 1, "a median above 0 and a factor above 1"),
            "triangular": (
                found[0] <= found[1 % len(found)] <= found[-1] and found[0] < found[-1],
                "low, most likely and high value in this order",
            ),
        }.get(self.kind, (found[0] < found[-1], "a low value below the high one"))
        if not good:
            given = ", ".join(shown(one) for one in self.given)
            raise ParameterError(f"{self.kind}({given}) for {name} isn't one: it takes {rule}.")
        return found

    def _frozen(self, numbers: tuple[float, ...]) -> tuple[Any, float]:
        """A frozen distribution of scipy.stats, and the factor of its values."""
        if self.kind == "distribution":
            return self.inner, numbers[0]
        from scipy import stats

        first, last = numbers[0], numbers[-1]
        if self.kind == "normal":
            return stats.norm(first, last), 1.0
        if self.kind == "lognormal":
            return stats.lognorm(math.log(last), scale=first), 1.0
        if self.kind == "uniform":
            return stats.uniform(first, last - first), 1.0
        return stats.triang((numbers[1] - first) / (last - first), first, last - first), 1.0


def normal(mean: float | str, deviation: float | str) -> Distribution:
    """Normal distribution of an uncertain parameter.

    Parameters
    ----------
    mean, deviation : float or str
        Mean and standard deviation [SI, or text with a unit]; the deviation is above 0. A normal
        distribution has tails without end: :func:`truncated` cuts them.

    Returns
    -------
    Distribution

    Raises
    ------
    ParameterError, UnitError
        If a value can't be read, once the parameter is known: by :func:`saltus.scatter`.

    Examples
    --------
    >>> import saltus as sl
    >>> sl.normal("0.4 mm", "0.02 mm").text("m", "gap")
    'normal(0.4 mm, 0.02 mm)'
    """
    return Distribution("normal", (mean, deviation))


def uniform(low: float | str, high: float | str) -> Distribution:
    """Uniform distribution of an uncertain parameter: a tolerance of which no more is known.

    Parameters
    ----------
    low, high : float or str
        Its ends [SI, or text with a unit].

    Returns
    -------
    Distribution

    Raises
    ------
    ParameterError, UnitError
        If a value can't be read, once the parameter is known: by :func:`saltus.scatter`.

    Examples
    --------
    >>> import saltus as sl
    >>> sl.uniform("0.3 mm", "0.5 mm").text("m", "gap")
    'uniform(0.3 mm, 0.5 mm)'
    """
    return Distribution("uniform", (low, high))


def lognormal(median: float | str, factor: float) -> Distribution:
    """Lognormal distribution of an uncertain parameter: known but for a factor, never negative.

    Parameters
    ----------
    median : float or str
        Half of all values lie below [SI, or text with a unit], > 0.
    factor : float
        Two thirds of all values lie between median/factor and median*factor, > 1: exp(sigma).

    Returns
    -------
    Distribution

    Raises
    ------
    ParameterError, UnitError
        If a value can't be read, once the parameter is known: by :func:`saltus.scatter`.

    Examples
    --------
    >>> import saltus as sl
    >>> sl.lognormal("2 N", 1.3).text("N", "force")
    'lognormal(2 N, 1.3)'
    """
    return Distribution("lognormal", (median, factor))


def triangular(low: float | str, likely: float | str, high: float | str) -> Distribution:
    """Triangular distribution of an uncertain parameter.

    Parameters
    ----------
    low, likely, high : float or str
        Its ends, and its most likely value between them [SI, or text with a unit].

    Returns
    -------
    Distribution

    Raises
    ------
    ParameterError, UnitError
        If a value can't be read, once the parameter is known: by :func:`saltus.scatter`.

    Examples
    --------
    >>> import saltus as sl
    >>> sl.triangular("1 N", "2 N", "4 N").text("N", "force")
    'triangular(1 N, 2 N, 4 N)'
    """
    return Distribution("triangular", (low, likely, high))


def truncated(
    distribution: Distribution, low: float | str | None = None, high: float | str | None = None
) -> Distribution:
    """A distribution without the values outside a range, such as parts that inspection rejects.

    Parameters
    ----------
    distribution : Distribution
        What :func:`normal` or its like returns.
    low, high : float or str, optional
        Ends of what is left [SI, or text with a unit]; default none.

    Returns
    -------
    Distribution

    Raises
    ------
    ParameterError
        If it is no distribution.

    Examples
    --------
    >>> import saltus as sl
    >>> sl.truncated(sl.normal("0.4 mm", "0.02 mm"), low="0.35 mm").text("m", "gap")
    'truncated(normal(0.4 mm, 0.02 mm), 0.35 mm)'
    """
    if not isinstance(distribution, Distribution):
        raise must_be("distribution", 'one, such as sl.normal("0.4 mm", "0.02 mm")', distribution)
    return Distribution("truncated", (low, high), distribution)


def distribution(frozen: Any, unit: str | None = None) -> Distribution:
    """A frozen distribution of scipy.stats for an uncertain parameter.

    Parameters
    ----------
    frozen : frozen distribution
        Such as ``scipy.stats.beta(2, 5)``; continuous.
    unit : str, optional
        Unit of its values; default SI.

    Returns
    -------
    Distribution

    Raises
    ------
    ParameterError
        If it isn't a frozen continuous distribution.

    Examples
    --------
    >>> import saltus as sl
    >>> from scipy import stats
    >>> sl.distribution(stats.beta(2, 5), "mm").text("m", "gap")
    'distribution(beta)'
    """
    if not all(hasattr(frozen, name) for name in ("ppf", "cdf", "pdf", "dist")):
        raise must_be("frozen", "a frozen distribution, such as scipy.stats.beta(2, 5)", frozen)
    return Distribution("distribution", (unit,), frozen)
