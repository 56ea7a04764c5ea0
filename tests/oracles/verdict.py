"""The judgement on another solver's contacts: which were missed, which invented, how exact are the
times.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .piecewise_linear import OK, Contacts


@dataclass(frozen=True)
class Verdict:
    """How another solver's contacts compare with the closed form.

    Attributes
    ----------
    compared : int
        Contacts held against each other.
    missed, invented : list of int
        Trajectories whose first disagreement is a contact that the other solver lacks, or one it
        should not have.
    left_out : int
        Contacts that the oracle itself can't vouch for: after a margin within 1000 deviations (and
        1e-14 m), or where its own ``time_error`` exceeds 1e-9 s (a chaotic trajectory).
    worst : float
        Largest time error in units of ``1e-12 t + 20 time_error``; at most 1 is agreement to
        rounding.
    """

    compared: int
    missed: list[int]
    invented: list[int]
    left_out: int
    worst: float


def compare(truth: Contacts, trajectory, time, guard) -> Verdict:
    """Hold another solver's table against the closed form, trajectory by trajectory.

    Parameters
    ----------
    truth : Contacts
        From :func:`contacts`.
    trajectory, time, guard : arrays (contacts,)
        The other solver's contacts: index of the trajectory (sorted), time [s] (rising within a
        trajectory), 1 = lower or 2 = upper boundary.
    """
    trajectory, time, guard = np.asarray(trajectory), np.asarray(time, float), np.asarray(guard)
    compared, left_out, worst = 0, 0, 0.0
    missed, invented = [], []
    for i in range(truth.count.size):
        rows = truth.of(i)
        mine = slice(np.searchsorted(trajectory, i), np.searchsorted(trajectory, i, side="right"))
        deviation = np.maximum.accumulate(truth.time_error[rows] * np.abs(truth.velocity[rows]))
        sound = (truth.margin_so_far[rows] > 1000 * deviation + 1e-14) & (
            truth.time_error[rows] < 1e-9
        )
        trusted = rows[: rows.size if sound.all() else int(np.argmin(sound))]
        whole = (
            trusted.size == rows.size
            and truth.status[i] == OK
            and truth.margin[i] > 1e-14
            and truth.margin_in_errors[i] > 1000
        )
        left_out += rows.size - trusted.size
        n = min(trusted.size, time[mine].size)
        error = np.abs(time[mine][:n] - truth.time[trusted[:n]])
        allowed = 1e-12 * truth.time[trusted[:n]] + 20 * truth.time_error[trusted[:n]]
        wrong = np.flatnonzero(
            (error > 1e4 * allowed) | (guard[mine][:n] != truth.guard[trusted[:n]])
        )
        n = int(wrong[0]) if wrong.size else n
        compared += n
        worst = max(worst, float(np.max(error[:n] / allowed[:n], initial=0.0)))
        if wrong.size:
            (missed if time[mine][n] > truth.time[trusted[n]] else invented).append(i)
        elif n < trusted.size:
            missed.append(i)
        elif whole and time[mine].size > n:
            invented.append(i)
    return Verdict(compared, missed, invented, left_out, worst)
