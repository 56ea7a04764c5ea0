"""What a run has to say, as a table: a row for each trajectory."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from saltus.analysis.motion.settled import settled
from saltus.errors import ParameterError
from saltus.kernels.status import STATUS
from saltus.results.dataset.schema import end_name, period_text, states_of
from saltus.results.wording import ended_early, unit_of
from saltus.study.table import TextTable, left_out, quantity, table, varied, words

if TYPE_CHECKING:
    import xarray as xr


def run_table(title: str, run: xr.Dataset) -> TextTable:
    """A row for each trajectory: status, contacts, grazes, steps, state at the end and, for a
    forced system, its response.

    Parameters
    ----------
    title : str
        Goes above the table.
    run : Dataset
        What ``simulate`` returned.
    """
    batch = run if "trajectory" in run.dims else run.expand_dims("trajectory")
    counts = [
        name
        for name in ("events", "grazes", "grazes_unresolved", "steps")
        if name == "events" or name == "steps" or batch[name].any()
    ]
    responses, total = response_texts(run), batch.sizes["trajectory"]
    columns = [
        words("", range(total), "trajectory"),
        *(varied(run, run["trajectory"].values) if "trajectory" in run.dims else []),
    ]
    columns.append(words("status", batch["status"].values.astype(str)))
    columns += [
        words({"events": "contacts"}.get(name, name.replace("_", " ")), batch[name].values)
        for name in counts
    ]
    columns += [
        quantity(
            f"{name} at the end",
            batch[end_name(name)].values,
            unit_of(batch[name]),
            5,
        )
        for name in states_of(run)
    ]
    columns += [words("response", responses)] * bool(responses)
    return table(title, columns, _notes(batch))


def response_texts(run: xr.Dataset) -> list[str]:
    """``T``, ``3T`` or ``not periodic within 48T`` for each trajectory; empty for an unforced
    system or too few samples.
    """
    try:
        found = settled(run)
    except ParameterError:
        return []
    none = f"not periodic within {found.attrs['longest_period']}T"
    return [period_text(int(n), none) for n in np.atleast_1d(found["response_period"].values)]


def _notes(batch: xr.Dataset) -> tuple[str, ...]:
    total, sentences = batch.sizes["trajectory"], dict(STATUS.values())
    early = [
        f"{count} of {total} {word}: {sentences.get(word, '')}."
        for word, count in ended_early(batch).items()
    ]
    return (*left_out(total, "trajectories"), *early)
