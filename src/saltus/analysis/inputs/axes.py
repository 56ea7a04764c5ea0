"""Values along an axis from a user's argument: a tuple is a range, a list or array holds the
values. All verbs share this rule.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from saltus.errors import ParameterError, among, shown, unknown
from saltus.flow.counts import MOST, whole

#: Spacings of a range, by name.
SCALES = ("linear", "log")
#: Most values along one axis; a longer range is refused before it fills memory.
MOST_VALUES = 100_000_000


def along(
    name: str,
    given: Any,
    number: Callable[[Any], float],
    what: str,
    example: Mapping[str, Any],
    least: int = 1,
) -> np.ndarray:
    """Values along an axis [SI], in the order in which they are written.

    Parameters
    ----------
    name : str
        The parameter or state.
    given : tuple, list or array
        ``(first, last, number)`` or ``(first, last, number, "log")``, ends included; or a list or
        array of the values.
    number : callable
        One value [SI] from a number or a text with a unit.
    what : str
        Words for the values in messages: ``"values"``, ``"starts"``.
    example : mapping
        An argument, and a range as one would write it.
    least : int
        Least number of values of a range.

    Raises
    ------
    ParameterError, UnitError
        If it is neither, a value isn't finite, the number isn't whole, or a log scale doesn't begin
        above zero.
    """
    if not isinstance(given, tuple):
        return _listed(name, given, number, what, example)
    if len(given) not in (3, 4):
        raise ParameterError(
            lambda say: (
                f"{name} = {shown(given)} must be a range (first, last, number of {what}), "
                f"such as {say.key(**example)}. A tuple is a range; a list holds the {what} "
                f"themselves: {shown(list(given))}."
            )
        )
    first, last, count, *rest = given
    scale = rest[0] if rest else "linear"
    if not among(scale, SCALES):
        raise unknown(f"the scale of {name} is", scale, SCALES)
    count = whole(count, f"the number of {what} along {name}", least)
    if count > MOST_VALUES:
        raise ParameterError(
            f"{count} {what} along {name} are more than {MOST_VALUES:.0e}. Take a coarser grid."
        )
    low, high = number(first), number(last)
    if scale == "log" and min(low, high) <= 0:
        raise ParameterError(
            f"{name} from {first} to {last} can't have a log scale: give ends above zero."
        )
    return np.geomspace(low, high, count) if scale == "log" else np.linspace(low, high, count)


def count_along(given: Any) -> int:
    """Number of values that :func:`along` makes of an argument, counted before they are made. 1 for
    a single value, and for arguments that it refuses.
    """
    if isinstance(given, tuple):
        count = given[2] if len(given) in (3, 4) else 1
        number = isinstance(count, int | float | np.integer | np.floating)
        number = number and not isinstance(count, np.timedelta64)
        return int(count) if number and 1 <= count <= MOST else 1
    return max(len(given), 1) if not isinstance(given, str) and axes_of(given) == 1 else 1


def axes_of(given: Any) -> int:
    """Number of axes of lists or an array; -1 for lists of unequal length, and for anything that
    can't become an array.
    """
    try:
        return np.ndim(given)
    except (TypeError, ValueError):
        return -1


def _listed(
    name: str, given: Any, number: Callable[[Any], float], what: str, example: Mapping[str, Any]
) -> np.ndarray:
    """The values of a list or array, each a number or a text with a unit."""
    if (
        isinstance(given, str | bytes | dict | set | frozenset)
        or not hasattr(given, "__len__")
        or axes_of(given) != 1
    ):
        raise ParameterError(
            lambda say: (
                f"{name} = {shown(given)} must be a range (first, last, number of {what}), "
                f"such as {say.key(**example)}, or a list or array of {what}."
            )
        )
    values = np.asarray(given)
    if values.dtype.kind in "fiu":
        values = values.astype(float)
        where = np.flatnonzero(~np.isfinite(values))
        if len(where):
            raise ParameterError(
                f"{name} is {values[where[0]]} at index {where[0]}. Give finite {what}."
            )
        for value in (values.min(), values.max()) if len(values) else ():
            number(float(value))  # checks the limits that the name implies
        return values
    items = list(given)
    if (
        len(items) in (3, 4)
        and all(isinstance(one, str) for one in items[:2])
        and not isinstance(items[2], str)
    ):
        raise ParameterError(
            f"{name} = {shown(items)} is a list, which holds the {what} themselves, but "
            f"{shown(items[2])} has no unit. A range is a tuple: "
            f"{name}={shown(tuple(items))}."
        )
    return np.array([number(value) for value in items], float)
