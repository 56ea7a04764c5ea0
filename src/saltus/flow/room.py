"""Memory: free memory, and the limit of one call, which is half of it."""

from __future__ import annotations

import functools
import threading
from pathlib import Path

from saltus.errors import ParameterError
from saltus.sentences import Text

#: Share of the free memory that one call may take.
SHARE = 0.5
#: Size that is allowed without measuring the free memory [bytes].
ALWAYS_ALLOWED = 2**24
#: Free memory if the system doesn't report it [bytes].
DEFAULT_FREE = 4 * 2**30
#: Memory of a contact [bytes], from the kernel's table to the Dataset with both runs of measured
#: time errors. Measured: 401 for two states in one run; the second run keeps as many.
CONTACT = 640
#: Memory of each state in a contact [bytes].
CONTACT_OF_A_STATE = 80


def free() -> int:
    """Memory that this process can have without taking it from others [bytes], within the limit of
    its container.
    """
    amounts = []
    try:
        fields = dict(line.split(":", 1) for line in Path("/proc/meminfo").read_text().splitlines())
        amounts.append(int(fields["MemAvailable"].split()[0]) * 1024)
    except (OSError, KeyError, ValueError, IndexError):
        amounts.append(DEFAULT_FREE)
    for limit, used in (
        ("memory.max", "memory.current"),
        ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes"),
    ):
        try:
            amounts.append(
                max(
                    int(Path("/sys/fs/cgroup", limit).read_text())
                    - int(Path("/sys/fs/cgroup", used).read_text()),
                    0,
                )
            )
        except (OSError, ValueError):  # no such limit
            continue
    return min(amounts)


def check_room(size: float, what: str, instead: Text) -> None:
    """Raise ParameterError if ``size`` is more than one call may take.

    Parameters
    ----------
    size : float
        Estimate [bytes].
    what : str
        The contents, in the plural: ``"4 trajectories with 100 samples each"``.
    instead : str or callable
        Advice, as a sentence.
    """
    if size <= ALWAYS_ALLOWED:
        return
    room = SHARE * free()
    if size > room:
        raise ParameterError(
            f"{what} are more than fits here: they need about {size / 1e9:.3g} GB of memory, and "
            f"half of the free memory is "
            f"{room / 1e9:.3g} GB. ",
            instead,
        )


class Contacts:
    """Memory for the contacts of one run, shared by its threads.

    Parameters
    ----------
    states : int
        States of the system.
    """

    def __init__(self, states: int) -> None:
        self._lock, self._each = threading.Lock(), CONTACT + CONTACT_OF_A_STATE * states
        self.count, self.stopped = 0, False

    @functools.cached_property
    def most(self) -> float:
        """Largest number of contacts."""
        return SHARE * free() / self._each

    def take(self, count: int) -> None:
        """Count ``count`` more contacts."""
        with self._lock:
            self.count += count

    @property
    def full(self) -> bool:
        """True if the memory for contacts is full."""
        return self.count * self._each > ALWAYS_ALLOWED and self.count >= self.most
