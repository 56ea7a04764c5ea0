"""Whole numbers that users give, checked in one place."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from saltus.errors import must_be

#: The largest count that means anything here: at a million periods a second, 1e12 take eleven days.
MOST = 10**12


def whole(value: Any, name: str, least: int = 1, most: int = MOST) -> int:
    """A whole number. Raises ParameterError for anything else, or one below ``least`` or above
    ``most``.
    """
    number = isinstance(value, int | float | np.integer | np.floating) and not isinstance(
        value, bool | np.timedelta64
    )
    if (
        not number
        or (not isinstance(value, int) and not math.isfinite(value))
        or value != int(value)
        or value < least
    ):
        raise must_be(name, f"a whole number of at least {least}{_and_most(most)}", value)
    if value > most:
        raise must_be(name, f"at most {_power(most)}", value)
    return int(value)


def _and_most(most: int) -> str:
    return "" if most >= MOST else f" and at most {most}"


def _power(most: int) -> str:
    return "1e12" if most == MOST else str(most)
