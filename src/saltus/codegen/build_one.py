"""Compile one object, in a process that another one started for it (building.py).

Reads ``[template, texts, called symbols, target, whether sizes are open]`` as JSON from standard
input; writes the object to standard output, or, given a key and a title, to the cache.
"""

from __future__ import annotations

import json
import os
import sys

from saltus import cache
from saltus.codegen import building, machine
from saltus.codegen.asker import end_with_asker

if __name__ == "__main__":
    end_with_asker()
    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # printed text is no part of the answer
    template, texts, called, target, open_sizes = json.load(sys.stdin)
    code = building.bitcode(template) if template else None
    made = machine.object_code(
        code, texts, frozenset(called), machine.Target(*target), open_sizes=open_sizes
    )
    if len(sys.argv) > 2:
        cache.keep(sys.argv[1], sys.argv[2], made)
    with answer:
        answer.write(made)
