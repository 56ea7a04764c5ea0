"""A process that compiles for another one ends when that one is gone: killed, it can't end it itself."""

from __future__ import annotations

import os
import threading
import time

#: Environment variable that holds the number of the process that asked.
ASKED_BY = "SALTUS_ASKED_BY"
#: Time between two looks [s].
LOOK = 0.5


def end_with_asker() -> None:
    """End this process as soon as its parent is another one than the process that asked; asked by none, go on."""
    asker = os.environ.pop(ASKED_BY, "")
    if asker.isdigit():
        threading.Thread(target=_watch, args=(int(asker),), daemon=True).start()


def _watch(asker: int) -> None:
    while os.getppid() == asker:  # on Windows for ever; there the answer finds nobody, and the process ends after it
        time.sleep(LOOK)
    os._exit(1)
