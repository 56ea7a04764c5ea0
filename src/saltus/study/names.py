"""Names as file names."""

from __future__ import annotations

import re


def slug(name: str) -> str:
    """A name as a file name: nothing that leads out of the folder."""
    return re.sub(r"[^a-z0-9.]+", "-", name.lower()).strip("-.") or "map"
