"""What the paper prints in Table 2."""

from __future__ import annotations

from saltus.replication.papers import folder_of
from saltus.study.questions.printed import cell, rows


def contacts() -> list[tuple[str, int, float]]:
    """Marker, index of the contact in the run, and printed time [s] of each row of Table 2."""
    path = folder_of("saunders2021") / "table2.csv"
    lines = rows(path, ("marker", "event_number", "time_s"))
    return [(line["marker"], int(cell(line, "event_number", path)) - 1, cell(line, "time_s", path)) for line in lines]
