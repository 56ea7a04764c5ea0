"""The tables of this paper: Table 2, and the Lyapunov exponents of every attractor by two
algorithms.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from saltus.replication.claims import Data
from saltus.results.dataset.schema import kind_text
from saltus.results.table import TextTable
from saltus.study.answers.compare import residuals

from . import printed
from .draw_attractors import trios
from .looks import LOOKS

#: A wider interval of an exponent says nothing [1/s].
WIDEST = 100.0


def table2(data: Data) -> TextTable:
    """The paper's five contacts: printed, by our ode45, exact."""
    run, exact = data["fig2/ode45"], data["fig2/exact"]
    rest = residuals(run)
    rows = []
    for letter, number, time in printed.contacts():
        ours, true = float(run["contact_time"][number]), float(exact["contact_time"][number])
        rows.append(
            (
                letter,
                f"{time:.16f}",
                f"{ours:.16f}",
                f"{ours - time:.1e}",
                f"{true:.16f}",
                f"{ours - true:.2e}",
                f"{rest[number]:.2e}",
            )
        )
    columns = (
        "",
        "printed [s]",
        "our ode45 [s]",
        "difference [s]",
        "exact [s]",
        "ode45 − exact [s]",
        "|x − j| [m]",
    )
    shared = min(run.sizes["contact"], exact.sizes["contact"])
    worst = np.abs(
        run["contact_time"].values[:shared] - exact["contact_time"].values[:shared]
    ).max()
    note = (
        f"{run.sizes['contact']} contacts by ode45, {exact.sizes['contact']} exact: the "
        f"largest "
        f"error of ode45's times is {worst:.2e} s."
    )
    return TextTable("Table 2: contacts A to E", columns, tuple(rows), (note,))


def exponents(data: Data, of: str, setting: str) -> TextTable:
    """A row for each attractor and way of integrating: exponents by the variational equations and
    by Wolf's algorithm.
    """
    rows = []
    for trio in trios(data, of, setting):
        name = kind_text(trio.kind, trio.period)
        for look in LOOKS:
            number = trio.number[look.end]
            if number < 0:
                rows.append((name, look.label, "not found", "", ""))
            else:
                found, wolf = (
                    data[f"{of}/{setting}, {look.end}, {by}"].isel(trajectory=number)
                    for by in ("variational", "wolf")
                )
                second = f"{float(found['lyapunov_exponent'][1]):.3f}"
                rows.append((name, look.label, _interval(found), second, _interval(wolf)))
            name = ""
    columns = (
        "attractor",
        "integrated",
        "largest, variational [1/s]",
        "second",
        "largest, Wolf [1/s]",
    )
    notes = (
        "In brackets: 95 % intervals. Variational: exponents of the stroboscopic map along the "
        "motion that was integrated; −0.942 is −ζω, which every "
        "orbit with complex multipliers has. Wolf: of the flow, whose largest exponent is zero for "
        "an orbit, for its phase.",
        "Wolf's algorithm follows neighbours on the recorded motion. Where ode45 scatters about an "
        "orbit it reads the scatter as divergence; and long "
        "orbits, whose points lie close together, are hard for it even without.",
    )
    return TextTable(
        f"Largest Lyapunov exponents, Kc = {setting.replace(' per ', '/')}",
        columns,
        tuple(rows),
        notes,
    )


def _interval(one: xr.Dataset) -> str:
    value, low, high = (float(one[f"lyapunov_{part}"][0]) for part in ("exponent", "low", "high"))
    told = [f"{round(number, 3) + 0.0:.3f}" for number in (value, low, high)]
    return f"{told[0]} [{told[1]}, {told[2]}]" if high - low < WIDEST else f"{told[0]} [unknown]"
