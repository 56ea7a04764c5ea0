"""Verdicts: rules that compare a number of a claim with its limit, and the verdict of several
checks.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

HOLDS, IN_PART, FAILS, UNDECIDED = "holds", "holds in part", "does not hold", "not decidable"
#: All verdicts, best first.
VERDICTS = (HOLDS, IN_PART, FAILS, UNDECIDED)
#: The rule from checks to a verdict, which the report prints.
RULE_OF_ALL = (
    "A claim holds if all of its checks pass, doesn't hold if none does, and holds in part if some "
    "do, or if some pass and others can't be "
    "decided. It is not decidable if no check can be decided."
)

#: Rules of a check: functions of a quantity and the limit.
RULES: dict[str, Callable[[Any, Any], bool]] = {
    "below": lambda value, limit: value < limit,
    "at_most": lambda value, limit: value <= limit,
    "above": lambda value, limit: value > limit,
    "at_least": lambda value, limit: value >= limit,
    "equals": lambda value, limit: value == limit,
    "differs": lambda value, limit: value != limit,
    "between": lambda value, ends: ends[0] <= value <= ends[1],
    "inside": lambda value, ends: ends[0] < value < ends[1],
    "near": lambda value, limit: abs(value / limit[0] - 1) < limit[1],
    "same_set": lambda values, limit: sorted(values) == sorted(limit),
    "contains": lambda values, limit: set(limit) <= set(values),
    "is": lambda value, limit: bool(value) is limit,
}


@dataclass(frozen=True)
class Check:
    """One statement that the data decide.

    Attributes
    ----------
    text : str
        The statement in words, with the numbers that decide it.
    passed : bool or None
        Whether it is so; None if the data can't tell.
    """

    text: str
    passed: bool | None


@dataclass(frozen=True)
class Finding:
    """The finding on a claim.

    Attributes
    ----------
    own : str
        Answer of the paper's own settings here.
    exact : str
        Answer of exact arithmetic.
    checks : tuple of Check
        They make the verdict.
    sure : str
        Certainty of that: starts, intervals, error estimates.
    why : str
        Where we differ from the paper: which setting might explain it. Where nothing is decided:
        why not.
    """

    own: str
    exact: str
    checks: tuple[Check, ...]
    sure: str
    why: str = ""

    @property
    def verdict(self) -> str:
        """The verdict of the checks."""
        return verdict_of(self.checks)


def passed(row: Mapping[str, Any], quantities: Mapping[str, Any]) -> bool | None:
    """Apply the rule of a check.

    Parameters
    ----------
    row : mapping
        ``of``: name of a quantity. One of :data:`RULES`: the limit, or the name of the quantity
        that is the limit. Without a rule the quantity itself says whether it is so. ``given``: name
        of a quantity that must be true for the data to decide.
    quantities : mapping
        Readings of the data, by name.

    Returns
    -------
    bool or None
        None where the quantity isn't known (None, NaN) or the data don't decide.
    """
    if "given" in row and not quantities[row["given"]]:
        return None
    value = quantities[row["of"]]
    (rule,) = [name for name in row if name in RULES] or ["is"]
    limit = row.get(rule, True)
    if isinstance(limit, str):
        limit = quantities[limit]
    return None if _unknown(value) or _unknown(limit) else bool(RULES[rule](value, limit))


def _unknown(value: Any) -> bool:
    return value is None or (isinstance(value, float) and math.isnan(value))


def verdict_of(checks: Sequence[Check]) -> str:
    """The verdict of some checks; see :data:`RULE_OF_ALL`."""
    passed = [check.passed for check in checks]
    decided = [one for one in passed if one is not None]
    if not decided:
        return UNDECIDED
    if all(decided):
        return HOLDS if len(decided) == len(passed) else IN_PART
    return IN_PART if any(decided) else FAILS


def undecided(why: str) -> Finding:
    """The finding on a claim that couldn't be judged."""
    return Finding(
        "not known",
        "not known",
        (Check("The data are there, and the rule can be applied to them.", None),),
        "Nothing is known.",
        why,
    )
