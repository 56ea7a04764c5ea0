"""The job of every rival: the deLangre rig in case b with 4 N at 15 Hz, many starts, contacts
located.
"""

from __future__ import annotations

import contextlib
import math
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

MASS, DAMPING_RATIO, NATURAL_FREQUENCY, CUBIC = 3.0, 0.03, 5.0, 7e8  # kg, 1, Hz, N/m^3
CONTACT_STIFFNESS, LOWER_GAP, UPPER_GAP = 1.4e4, 0.0, 0.4e-3  # N/m, m, m
FORCE, FREQUENCY = 4.0, 15.0  # N, Hz
PERIOD = 1.0 / FREQUENCY
WN, W = 2.0 * math.pi * NATURAL_FREQUENCY, 2.0 * math.pi * FREQUENCY
DECAY = 2.0 * DAMPING_RATIO * WN
DRIVE = FORCE * (1.0 - 18.0 / W**2) / MASS  # m/s^2
STIFFNESS = CONTACT_STIFFNESS / MASS  # 1/s^2
HARDENING = CUBIC / MASS  # 1/(m s)^2


@dataclass(frozen=True)
class Measured:
    """The time and the results of a rival.

    Attributes
    ----------
    us_per_period : float
        CPU time per forcing period per trajectory [us], minimum over the repeats.
    end : float array (starts, 2)
        Displacement [m] and velocity [m/s] after 5 periods.
    contacts_per_period : float
        Contacts per forcing period per trajectory over the timed periods.
    contacts : int array (starts,)
        Contacts of each start in the first 5 periods; empty if the rival counts over all starts
        only.
    """

    us_per_period: float
    end: np.ndarray
    contacts_per_period: float
    contacts: np.ndarray


def starts(count: int, seed: int = 15) -> tuple[np.ndarray, np.ndarray]:
    """Random starts x in [-5, 5] mm, v in [-1, 1] m/s: arrays in m and m/s."""
    rng = np.random.default_rng(seed)
    return rng.uniform(-5e-3, 5e-3, count), rng.uniform(-1.0, 1.0, count)


def pin(core: int | None = None) -> None:
    """Keep this process on one core: the last one it may use, unless told otherwise."""
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0)) if core is None else core})


@contextlib.contextmanager
def one_core() -> Iterator[None]:
    """Pin everything inside to one core."""
    before = os.sched_getaffinity(0)
    pin()
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def cpu_seconds(job: Callable[[], object], repeats: int = 3) -> float:
    """Smallest CPU time of a job over some repeats [s]."""
    return min(alternating([job], repeats)[0])


def alternating(jobs: list[Callable[[], object]], repeats: int) -> list[list[float]]:
    """CPU times of each job [s], one job after the other in every round."""
    taken: list[list[float]] = [[] for _ in jobs]
    for _ in range(repeats):
        for job, times in zip(jobs, taken, strict=True):
            began = time.process_time()
            job()
            times.append(time.process_time() - began)
    return taken


def warm(system: Any, method: Any) -> None:
    """Let the final code of long work take over before the clock runs: saltus compiles it beside
    the first seconds of work.
    """
    kernels = method.kernels(system.origin)
    if kernels.tier != "full":
        kernels.exchange("full")
