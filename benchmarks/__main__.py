"""Run all benchmarks that the documentation shows: `python -m benchmarks`. Takes some ten minutes;
leave the machine alone meanwhile.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
#: Folder from which the page of comparisons reads its numbers.
FOLDER = "docs/comparison"
#: One after the other: two at a time would time each other.
BENCHMARKS = (
    "benchmarks/startup.py",
    "benchmarks/compile.py",
    "benchmarks/flow.py",
    "benchmarks/contacts.py",
    "benchmarks/basins.py",
)


def main() -> int:
    """Run each in a process of its own; return the number of failures."""
    commands = [[sys.executable, name, "--write", FOLDER] for name in BENCHMARKS]
    return sum(
        subprocess.run(command, cwd=ROOT, check=False).returncode != 0 for command in commands
    )


if __name__ == "__main__":
    sys.exit(main())
