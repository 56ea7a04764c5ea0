"""The claims of a paper as tables, to print and to process further."""

from __future__ import annotations

from typing import TYPE_CHECKING

from saltus.replication.verdict import VERDICTS
from saltus.results.table import TextTable

if TYPE_CHECKING:
    from saltus.replication.outcome import Replication


def verdict_table(result: Replication) -> TextTable:
    """A row for each claim: figure, claim, verdict."""
    rows = tuple(
        (claim.figure, claim.id, claim.says, finding.verdict) for claim, finding in result.findings
    )
    return TextTable(
        _title(result), ("fig.", "claim", "what the paper says", "verdict"), rows, (_count(result),)
    )


def claims_table(result: Replication) -> TextTable:
    """A row for each claim, with both answers: that of the paper's own settings, and that of exact
    arithmetic.
    """
    columns = (
        "figure",
        "claim",
        "what the paper says",
        "where",
        "its own settings give here",
        "exact arithmetic gives",
        "verdict",
    )
    rows = tuple(
        (
            claim.figure,
            claim.id,
            claim.says,
            claim.where,
            finding.own,
            finding.exact,
            finding.verdict,
        )
        for claim, finding in result.findings
    )
    return TextTable(_title(result), columns, rows, (_count(result),))


def _title(result: Replication) -> str:
    return f"Claims of {result.paper.name}{', a quick run' if result.quick else ''}"


def _count(result: Replication) -> str:
    counts = [
        (one, sum(finding.verdict == one for _, finding in result.findings)) for one in VERDICTS
    ]
    return f"{', '.join(f'{count} {one}' for one, count in counts if count)}."
