"""The tables of this paper: Table 2, and the exponents of every attractor."""

from __future__ import annotations

import csv

import numpy as np

from saltus.replication.papers import Numbers, folder_of
from saltus.replication.verdict import Data
from saltus.study.table import TextTable


def table2(data: Data) -> TextTable:
    """The paper's five contacts: printed, by our ode45, exact."""
    run, exact = data["fig2/ode45"], data["fig2/exact"]
    boundary = dict(zip(run["guard"].values.tolist(), run["guard_boundary"].values.tolist(), strict=True))
    path = folder_of("saunders2021") / "table2.csv"
    lines = csv.DictReader(line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#"))
    rows = []
    for letter, line in zip("ABCDE", lines, strict=False):
        number = int(line["event_number"]) - 1
        ours, printed, true = float(run["contact_time"][number]), float(line["time_s"]), float(exact["contact_time"][number])
        rest = abs(float(run["contact_x"][number]) - boundary[str(run["contact_guard"].values[number])])
        rows.append(
            (letter, f"{printed:.16f}", f"{ours:.16f}", f"{ours - printed:.1e}", f"{true:.16f}", f"{ours - true:.2e}", f"{rest:.2e}")
        )
    columns = ("", "printed [s]", "our ode45 [s]", "difference [s]", "exact [s]", "ode45 − exact [s]", "|x − j| [m]")
    worst = np.abs(run["contact_time"].values - exact["contact_time"].values[: run.sizes["contact"]]).max()
    note = f"All {run.sizes['contact']} contacts of the run: the largest error of ode45's times is {worst:.2e} s."
    return TextTable("Table 2: contacts A to E", columns, tuple(rows), (note,))


TABLES = (Numbers("2", "table2", ("fig2/ode45", "fig2/exact"), table2),)
