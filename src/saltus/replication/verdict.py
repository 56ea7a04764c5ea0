"""Claims and verdicts: what a paper says, the checks that this comes down to, and what follows when they pass or fail."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import xarray as xr

HOLDS, IN_PART, FAILS, UNDECIDED = "holds", "holds in part", "does not hold", "not decidable"
#: All verdicts, best first.
VERDICTS = (HOLDS, IN_PART, FAILS, UNDECIDED)
#: How the checks of any claim make its verdict; the report prints it.
RULE_OF_ALL = (
    "A claim holds if all of its checks pass, doesn't hold if none does, and holds in part if some do, or if some pass and others can't be "
    "decided. It is not decidable if no check can be decided."
)

Data = Mapping[str, "xr.Dataset"]


@dataclass(frozen=True)
class Check:
    """One statement that the data decide.

    Attributes
    ----------
    text : str
        What must be so, in words, with the numbers that decide it.
    passed : bool or None
        Whether it is so; None if the data can't tell.
    """

    text: str
    passed: bool | None


@dataclass(frozen=True)
class Finding:
    """What a judge found.

    Attributes
    ----------
    own : str
        What the paper's own settings give here.
    exact : str
        What exact arithmetic gives.
    checks : tuple of Check
        They make the verdict.
    sure : str
        How sure that is: starts, intervals, error estimates.
    why : str
        Where we differ from the paper: which setting might explain it. Where nothing is decided: why not.
    """

    own: str
    exact: str
    checks: tuple[Check, ...]
    sure: str
    why: str = ""

    @property
    def verdict(self) -> str:
        """The verdict that the checks make."""
        return verdict_of(self.checks)


@dataclass(frozen=True)
class Claim:
    """A statement of the paper, and how it is judged.

    Attributes
    ----------
    id : str
        Short name, also its anchor in the report.
    figure : str
        The figure that shows it.
    says : str
        The claim.
    where : str
        Where the paper says so.
    rule : str
        The rule of the judge, in words.
    needs : tuple of str
        Names of the jobs whose Datasets the judge takes.
    judge : callable
        From Datasets to a :class:`Finding`.
    """

    id: str
    figure: str
    says: str
    where: str
    rule: str
    needs: tuple[str, ...]
    judge: Callable[[Data], Finding]


def verdict_of(checks: Sequence[Check]) -> str:
    """The verdict that some checks make; see :data:`RULE_OF_ALL`."""
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
        "not known", "not known", (Check("The data are there, and the rule can be applied to them.", None),), "Nothing is known.", why
    )
