"""Make one entry of the kernel cache: what a process does that another one started to compile for it.

Reads the entry from standard input, as JSON with key, source and title.
"""

from __future__ import annotations

import json
import sys
import warnings

from saltus.codegen.cache import load
from saltus.errors import SaltusWarning

if __name__ == "__main__":
    warnings.simplefilter("error", SaltusWarning)  # a folder that can't be written: end before anything is compiled in vain
    load(**json.load(sys.stdin))
