"""The record of a benchmark, as a file that the documentation shows: numbers, machine, date,
versions, and the command that made it.
"""

from __future__ import annotations

import argparse
import datetime
import importlib.metadata
import json
import shlex
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

from saltus.cli.doctor import processor
from saltus.codegen.module import lane_width

#: Packages whose versions matter to a measurement.
PACKAGES = ("saltus", "numpy", "llvmlite", "numba", "scipy", "heyoka", "pynamicalsys")


def options_of(
    name: str, description: str | None, repeats: int, what: str
) -> argparse.ArgumentParser:
    """The command line that benchmarks share: the number of repeats of ``what``, and the folder for
    ``<name>.json``.
    """
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=repeats, help=what)
    parser.add_argument(
        "--write", type=Path, metavar="FOLDER", help=f"keep the tables there as {name}.json"
    )
    return parser


@dataclass(frozen=True)
class Column:
    """A column: its heading with the unit, and the format of its numbers (``""`` for text)."""

    heading: str
    form: str = ""


@dataclass(frozen=True)
class Table:
    """A table of numbers; None where there is none."""

    title: str
    columns: Sequence[Column]
    rows: Sequence[Sequence[str | float | None]]


@dataclass
class Record:
    """All that one benchmark measured in one run.

    Attributes
    ----------
    name : str
        Of the benchmark, and of its file.
    setting : str
        A sentence on what was computed and how it was timed.
    tables : list of Table
        The numbers.
    left_out : list of str
        Rivals that weren't there.
    """

    name: str
    setting: str
    tables: list[Table] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)

    def write(self, folder: Path) -> Path:
        """Write ``<name>.json`` to a folder; return the file."""
        made = {
            "command": shlex.join(
                ["python", f"benchmarks/{Path(sys.argv[0]).name}", *sys.argv[1:]]
            ),
            "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
            "machine": machine(),
            "python": ".".join(map(str, sys.version_info[:3])),
            "versions": {name: _version(name) for name in PACKAGES if _version(name)},
        }
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / f"{self.name}.json"
        file.write_text(
            json.dumps({**asdict(self), **made}, indent=1, ensure_ascii=False) + "\n",
            encoding="utf-8",
        )
        return file


def machine() -> str:
    """The processor, and how many lanes an equation has on it."""
    return f"{processor()}, {lane_width()} lanes"


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return ""
