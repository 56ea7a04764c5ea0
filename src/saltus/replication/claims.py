"""Claims as rows: a statement of a paper, the quantities that decide it, the rules with their
limits, and the sentences about the outcome.
"""

from __future__ import annotations

import string
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING, Any

from saltus.plot.cells import share_text
from saltus.replication.verdict import Check, Finding, passed
from saltus.results.dataset.schema import period_text

if TYPE_CHECKING:
    import xarray as xr

Data = Mapping[str, "xr.Dataset"]
#: Quantities that a claim reads from the data: numbers, texts, truth values, and lists of such
#: tables.
Quantities = Mapping[str, Any]

#: Quantities that every claim has.
ALWAYS, NEVER = "always", "never"
#: Formats of quantities in sentences, besides Python's own: ``{part:share}``.
FORMATS: dict[str, Callable[[Any], str]] = {
    "share": lambda value: share_text(float(value)),
    "period": lambda value: period_text(int(value)),
    "um": lambda value: f"{1e6 * value:.3g} µm",
    "mm": lambda value: f"{1e3 * value:.3f} mm",
    "power": lambda value: power(value),
    "alpha": lambda value: f"{value:.2f}" if value == value else "not measurable",
}


def power(value: float) -> str:
    """A stiffness as papers print it: ``2.55e4``."""
    if value != value:
        return "nowhere"
    mantissa, exponent = f"{value:.2e}".split("e")
    return f"{float(mantissa):g}e{int(exponent)}"


class _Words(string.Formatter):
    """``str.format`` with :data:`FORMATS`; the parts of a list are joined by commas."""

    def format_field(self, value: Any, spec: str) -> str:
        if isinstance(value, list | tuple):
            return ", ".join(self.format_field(one, spec) for one in value) or "none"
        return FORMATS[spec](value) if spec in FORMATS else format(value, spec)


def filled(template: str, quantities: Quantities) -> str:
    """The sentence with the quantities inserted."""
    return _Words().vformat(template, (), quantities)


def _each(row: Mapping[str, Any], quantities: Quantities) -> Iterator[Quantities]:
    """The quantities of a row: all of them, or once for each table of the list in ``each``."""
    yield from (
        ({**quantities, **one} for one in quantities[row["each"]])
        if "each" in row
        else (quantities,)
    )


@dataclass(frozen=True)
class Row:
    """The judging part of a claim's row in a table.

    Attributes
    ----------
    read : callable
        From the Datasets to quantities.
    checks : sequence of mapping
        Each with ``text``, ``of``, and a rule with its limit; see
        :func:`saltus.replication.verdict.passed`. ``each`` names a list of tables: then there is a
        check for each of them.
    own, exact, sure : str
        Sentences; see :class:`saltus.replication.verdict.Finding`.
    why : tuple of mapping
        ``text``, told ``when`` this quantity is true, or ``unless`` it is; the first that applies.
    lines : mapping of str to mapping
        Further texts for the sentences: ``text`` for ``each`` table of a list, joined by ``; ``.
    """

    read: Callable[[Data], Quantities]
    checks: Sequence[Mapping[str, Any]]
    own: str
    exact: str
    sure: str
    why: tuple[Mapping[str, Any], ...] = ()
    lines: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    def judge(self, data: Data) -> Finding:
        """Read the data, apply the rules, and word the finding."""
        found = {ALWAYS: True, NEVER: False, **self.read(data)}
        for name, line in self.lines.items():
            found[name] = line.get("between", "; ").join(
                filled(line["text"], one) for one in _each(line, found)
            )
        checks = chain.from_iterable(
            ((row, one) for one in _each(row, found)) for row in self.checks
        )
        why = (
            row["text"]
            for row in self.why
            if found[row.get("when", ALWAYS)] and not found[row.get("unless", NEVER)]
        )
        return Finding(
            filled(self.own, found),
            filled(self.exact, found),
            tuple(Check(filled(row["text"], one), passed(row, one)) for row, one in checks),
            filled(self.sure, found),
            filled(next(why, ""), found),
        )
