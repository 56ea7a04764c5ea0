"""Compile one module: what a process does that another one started for it (machine.py).

Reads ``{"name": ..., "source": ...}`` as JSON from standard input; writes the bytes that stand for the module to standard output.
"""

from __future__ import annotations

import json
import os
import sys

from saltus.codegen.machine import compiled

if __name__ == "__main__":
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what anything prints is no part of the answer
    _, data = compiled(**json.load(sys.stdin))
    with answer:
        answer.write(data or b"")
