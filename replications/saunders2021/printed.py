"""What the paper prints in Table 2."""

from __future__ import annotations

from pathlib import Path

from saltus.study.answers.printed import rows


def contacts() -> list[tuple[str, int, float]]:
    """Marker, index of the contact in the run, and printed time [s] of each row of Table 2."""
    path = Path(__file__).parent / "table2.csv"
    lines = rows(path.read_bytes(), path, ("marker", "event_number", "time_s"))
    return [
        (line.text("marker"), line.whole("event_number") - 1, line.number("time_s"))
        for line in lines
    ]
