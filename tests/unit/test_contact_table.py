"""The table of contacts of a run: its columns are views, it is joined in the order of trajectories,
and knows where each begins.
"""

from __future__ import annotations

import numpy as np

from saltus.flow.contact_table import ContactTable
from saltus.kernels import status as st


def table(trajectories, first=0.0):
    """Contacts of the given trajectories with two states; the time counts them from
    ``first`` on.
    """
    made = ContactTable.empty(len(trajectories), 2)
    made.integers[:], made.floats[:] = 0, 0.0
    made.trajectory[:] = trajectories
    made.time[:] = first + np.arange(len(trajectories))
    return made


def test_columns_are_views_of_all_that_the_kernels_write():
    contacts = table([0, 1])
    integers = (
        "trajectory",
        "period",
        "guard",
        "direction",
        "kind",
        "mode_before",
        "mode_after",
        "steps",
    )
    floats = ("phase", "velocity", "time_error", "state", "time")
    for number, name in enumerate((*integers, *floats)):
        getattr(contacts, name)[...] = number
    assert contacts.integers[0].tolist() == list(range(st.RECORD_INTEGERS))
    assert contacts.floats[0].tolist() == [8, 9, 10, 11, 11, 12]


def test_tables_are_joined_by_trajectory_and_keep_the_order_of_time():
    joined = ContactTable.joined([table([2, 0, 2]), table([0, 2], first=3.0)])
    assert joined.trajectory.tolist() == [0, 0, 2, 2, 2]
    assert joined.time.tolist() == [1, 3, 0, 2, 4]
    assert joined.begins(3).tolist() == [0, 2, 2, 5]
    assert joined.begins(2, first=1).tolist() == [2, 2, 5]
    moved = joined.rows(slice(2, 5)).moved(-2)
    assert (moved.trajectory.tolist(), joined.trajectory[2]) == ([0, 0, 0], 2)


def test_a_contact_changes_its_own_side_and_a_graze_none():
    contacts = table([0, 0, 0])
    contacts.guard[:], contacts.mode_before[:], contacts.mode_after[:] = (
        [1, 0, 1],
        [0, 1, 1],
        [2, 1, 3],
    )
    contacts.kind[:] = [st.CROSSING, st.GRAZE, st.GRAZE_SHALLOW]
    assert contacts.changes_side.tolist() == [True, False, True]
    assert contacts.kind_name.tolist() == ["crossing", "graze", "graze_unresolved"]
