"""Memory: how much is free, and what is refused, or stopped, before it fills it. Half of what is free is for one call."""

from __future__ import annotations

import functools
import threading
from pathlib import Path

from saltus.errors import ParameterError

#: What a call may take of the memory that is free.
SHARE = 0.5
#: What is never too much [bytes], so that memory isn't looked at for it.
LITTLE = 2**24
#: Free memory [bytes] where the system doesn't tell.
UNKNOWN = 4 * 2**30
#: Memory of a contact of D states, from the kernel's table to the Dataset with both runs of measured time errors [bytes]. Measured: 401 for
#: two states in one run; the second keeps its own.
CONTACT, CONTACT_OF_A_STATE = 640, 80


def free() -> int:
    """Memory that this process can have without taking it from others [bytes]; the limit of a container counts."""
    amounts = []
    try:
        fields = dict(line.split(":", 1) for line in Path("/proc/meminfo").read_text().splitlines())
        amounts.append(int(fields["MemAvailable"].split()[0]) * 1024)
    except (OSError, KeyError, ValueError, IndexError):
        amounts.append(UNKNOWN)
    for limit, used in (("memory.max", "memory.current"), ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes")):
        try:
            amounts.append(max(int(Path("/sys/fs/cgroup", limit).read_text()) - int(Path("/sys/fs/cgroup", used).read_text()), 0))
        except (OSError, ValueError):  # no such limit
            continue
    return min(amounts)


def check_room(size: float, what: str, instead: str) -> None:
    """Raise ParameterError if so many bytes are more than one call may take.

    Parameters
    ----------
    size : float
        Estimate [bytes].
    what : str
        What would fill it, in the plural: ``"4 trajectories with 100 samples each"``.
    instead : str
        What to do in place of it, as a sentence.
    """
    if size <= LITTLE:
        return
    room = SHARE * free()
    if size > room:
        raise ParameterError(
            f"{what} are more than fits here: they need about {size / 1e9:.3g} GB of memory, and half of what is free is "
            f"{room / 1e9:.3g} GB. {instead}"
        )


class Contacts:
    """Room for the contacts of one run, shared by its threads.

    Parameters
    ----------
    states : int
        States of the system.
    """

    def __init__(self, states: int) -> None:
        self._lock, self._each = threading.Lock(), CONTACT + CONTACT_OF_A_STATE * states
        self.kept, self.stopped = 0, False

    @functools.cached_property
    def most(self) -> float:
        """How many there is room for."""
        return SHARE * free() / self._each

    def take(self, count: int) -> None:
        """Note that so many more are kept."""
        with self._lock:
            self.kept += count

    @property
    def full(self) -> bool:
        """Whether there is room for no more."""
        return self.kept * self._each > LITTLE and self.kept >= self.most
