"""Compare the verdicts of two runs of a replication: two claims.csv, claim by claim.

Usage: ``python benchmarks/verdicts.py BEFORE.csv AFTER.csv``. Ends with 1 if a verdict differs, or
a claim is missing.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

#: Columns with the readings of the data.
READINGS = ("its own settings give here", "exact arithmetic gives")


def claims(file: Path) -> dict[str, dict[str, str]]:
    """The rows of a claims.csv, by claim."""
    with file.open(encoding="utf-8", newline="") as lines:
        return {
            row["claim"]: row
            for row in csv.DictReader(line for line in lines if not line.startswith("#"))
        }


def main(before: dict[str, dict[str, str]], after: dict[str, dict[str, str]]) -> int:
    """Print the differences; return the number of different verdicts."""
    wrong, read = 0, 0
    for name in dict.fromkeys([*before, *after]):
        old, new = (rows.get(name, {"verdict": "no such claim"}) for rows in (before, after))
        if old["verdict"] != new["verdict"]:
            wrong += 1
            print(f"{name}: {old['verdict']} -> {new['verdict']}")
        changed = [column for column in READINGS if old.get(column) != new.get(column)]
        read += bool(changed)
        for column in changed:
            print(f"{name}, {column}:\n    {old.get(column)}\n    {new.get(column)}")
    print(
        f"{len(before)} and {len(after)} claims: {wrong} verdicts differ, {read} are read "
        f"differently."
    )
    return wrong


if __name__ == "__main__":
    sys.exit(main(*(claims(Path(name)) for name in sys.argv[1:3])) > 0)
