"""All benchmarks that the documentation shows, one after the other: `python -m benchmarks`. Takes some ten minutes; leave the machine alone."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
#: Where the page that compares finds its numbers.
FOLDER = HERE.parent / "docs" / "comparison"
#: One after the other: two at a time would time each other.
BENCHMARKS = ("flow.py", "basins.py")


def main() -> int:
    """Run each in a process of its own; returns how many failed."""
    return sum(subprocess.run([sys.executable, HERE / name, "--write", FOLDER], check=False).returncode != 0 for name in BENCHMARKS)


if __name__ == "__main__":
    sys.exit(main())
