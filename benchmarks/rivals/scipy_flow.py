"""scipy's solve_ivp (DOP853) on the rig, as an expert would: a smooth field per mode, its exits as
terminal events, restarts at contacts.

A restart is one floating-point number inside the new mode. From the boundary itself, a step that
leaves and comes back would report the old contact again, for ever.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp

from . import rig

FREE, LOWER, UPPER = 0, 1, 2
BOUNDARY = {LOWER: -rig.LOWER_GAP, UPPER: rig.UPPER_GAP}


def _field(mode: int):
    """Right-hand side of one mode."""
    stiffness = rig.WN**2 + (rig.STIFFNESS if mode else 0.0)
    push = rig.STIFFNESS * BOUNDARY[mode] if mode else 0.0
    drive, w, decay, hardening, cos = rig.DRIVE, rig.W, rig.DECAY, rig.HARDENING, math.cos

    def rate(t, y):
        x, v = y
        return v, drive * cos(w * t) - decay * v - x * (hardening * x * x + stiffness) + push

    return rate


def _exit(boundary: float, direction: float):
    """Terminal event: the displacement reaches a boundary in one direction."""

    def gap(_, y):
        return y[0] - boundary

    gap.terminal, gap.direction = True, direction
    return gap


FIELDS = {mode: _field(mode) for mode in (FREE, LOWER, UPPER)}
EXITS = {
    FREE: ((LOWER, _exit(BOUNDARY[LOWER], -1.0)), (UPPER, _exit(BOUNDARY[UPPER], 1.0))),
    LOWER: ((LOWER, _exit(BOUNDARY[LOWER], 1.0)),),
    UPPER: ((UPPER, _exit(BOUNDARY[UPPER], -1.0)),),
}


def trajectory(
    x: float, v: float, periods: int, *, rtol: float, atol: float, method: str = "DOP853"
) -> tuple[float, float, int]:
    """Displacement [m], velocity [m/s] after some periods, and the number of contacts. The start
    isn't on a boundary.
    """
    t, t_end, contacts = 0.0, periods * rig.PERIOD, 0
    mode = UPPER if x > rig.UPPER_GAP else LOWER if x < -rig.LOWER_GAP else FREE
    while True:
        exits = EXITS[mode]
        arc = solve_ivp(
            FIELDS[mode],
            (t, t_end),
            (x, v),
            method=method,
            rtol=rtol,
            atol=atol,
            events=[event for _, event in exits],
        )
        t, (x, v) = arc.t[-1], arc.y[:, -1]
        if arc.status == 0:
            return x, v, contacts
        contacts += 1
        which = next(
            number for (number, _), times in zip(exits, arc.t_events, strict=True) if times.size
        )
        mode = which if mode == FREE else FREE
        x = np.nextafter(BOUNDARY[which], math.copysign(math.inf, v))


def measure(
    x: np.ndarray,
    v: np.ndarray,
    *,
    periods: int = 10,
    rtol: float = 1e-12,
    atol: float = 1e-12,
    method: str = "DOP853",
    repeats: int = 3,
) -> rig.Measured:
    """CPU time, end states and contacts of solve_ivp; some 5 ms a period, so give it few starts.

    Parameters
    ----------
    x, v : arrays (starts,)
        Starts [m], [m/s].
    periods, repeats : int
        Forcing periods in a timed run and number of those.
    rtol, atol, method
        As solve_ivp takes them.
    """
    options = {"rtol": rtol, "atol": atol, "method": method}
    ends = np.array([trajectory(*start, 5, **options) for start in zip(x, v, strict=True)])
    found = []

    def job():
        found[:] = [trajectory(*start, periods, **options)[2] for start in zip(x, v, strict=True)]

    work = periods * x.size
    seconds = rig.cpu_seconds(job, repeats)
    return rig.Measured(
        seconds / work * 1e6, ends[:, :2], sum(found) / work, ends[:, 2].astype(int)
    )
