"""Tables of a run for pandas: one row a sample, one row a contact."""

from __future__ import annotations

from typing import TYPE_CHECKING

import xarray as xr

from saltus.results.dataset.reader import reader
from saltus.results.dataset.schema import STROBOSCOPE, TRAJECTORY, check
from saltus.results.kinds.trajectory import Columns, contact_columns, sample_columns

if TYPE_CHECKING:
    import pandas as pd  # type: ignore[import-untyped]


@reader
def contacts(run: xr.Dataset) -> pd.DataFrame:
    """The contacts of a run, one row each.

    Parameters
    ----------
    run : Dataset
        Result of ``simulate``.

    Returns
    -------
    pandas.DataFrame
        In the order of trajectory and time, with the columns ``trajectory`` (of a batch: its
        number), ``time`` and ``time_error`` [s], ``guard`` (name of the boundary that was met),
        ``direction`` (+1 where the gap becomes positive, -1 where it becomes negative),
        ``velocity`` (rate of the gap: the speed of the impact and its sign), ``kind``
        (``crossing``, ``graze``, ``graze_unresolved``), ``mode_before`` and ``mode_after`` (bit i
        is set where gap i is positive), ``steps``, and each state at the contact under its name
        (``state_NAME`` where that is taken). SI; ``frame.attrs["units"]`` has the unit of each
        column.

    Raises
    ------
    ParameterError
        If ``run`` is something else.

    Examples
    --------
    >>> import saltus as sl
    >>> run = sl.simulate(sl.models.delangre("b"), periods=3)
    >>> list(sl.contacts(run).columns[:4])
    ['time', 'time_error', 'guard', 'direction']
    """
    check(run, caller="sl.contacts", kinds=(TRAJECTORY,))
    return _frame(run, contact_columns(run))


@reader
def samples(run: xr.Dataset) -> pd.DataFrame:
    """The samples of a run, one row each.

    Parameters
    ----------
    run : Dataset
        Result of ``simulate`` or ``stroboscope``.

    Returns
    -------
    pandas.DataFrame
        Trajectory after trajectory, with the columns ``trajectory`` (of a batch), ``time`` [s],
        ``period`` (time in forcing periods, of a forced system), each state under its name, and
        ``mode``. SI; ``frame.attrs["units"]`` has the unit of each column.

    Raises
    ------
    ParameterError
        If ``run`` is something else.

    Examples
    --------
    >>> import saltus as sl
    >>> rig = sl.models.delangre("a", force="4 N", frequency="17 Hz")
    >>> frame = sl.samples(sl.simulate(rig, start=("1 mm", 0), periods=10))
    >>> list(frame.columns[:3]), len(frame)
    (['time', 'period', 'x'], 2001)
    """
    check(run, caller="sl.samples", kinds=(TRAJECTORY, STROBOSCOPE))
    return _frame(run, sample_columns(run))


def _frame(run: xr.Dataset, columns: Columns) -> pd.DataFrame:
    """A DataFrame of columns; each comes with the variable that it is."""
    import pandas as pd

    frame = pd.DataFrame({name: values for name, (_, values) in columns.items()})
    frame.attrs["units"] = {
        name: run[variable].attrs.get("units", "") for name, (variable, _) in columns.items()
    }
    return frame
