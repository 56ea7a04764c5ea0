"""Where saltus keeps what is safe to lose: compiled kernels, and which result files need no trial."""

from __future__ import annotations

import os
from pathlib import Path

import platformdirs


def cache_folder() -> Path:
    """``$SALTUS_CACHE``, a ``~`` at its beginning being the home folder as in a shell; else saltus's folder in the user's cache."""
    chosen = os.environ.get("SALTUS_CACHE")
    return Path(os.path.expanduser(chosen)) if chosen else Path(platformdirs.user_cache_dir("saltus", appauthor=False))
