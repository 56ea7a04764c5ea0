"""End a process that compiles for another one when that one has died, even by SIGKILL."""

from __future__ import annotations

import os
import threading
import time

#: Environment variable with the id of the parent process.
PARENT_ID = "SALTUS_ASKED_BY"
#: Time between two checks of the parent [s].
CHECK_INTERVAL = 0.5


def end_with_asker() -> None:
    """End this process as soon as its parent isn't the process in PARENT_ID any more; do nothing
    without a PARENT_ID.
    """
    asker = os.environ.pop(PARENT_ID, "")
    if asker.isdigit():
        threading.Thread(target=_watch, args=(int(asker),), daemon=True).start()


def _watch(asker: int) -> None:
    # on Windows for ever; there the answer finds nobody, and the process ends after it
    while os.getppid() == asker:
        time.sleep(CHECK_INTERVAL)
    os._exit(1)
