"""A copy of the package's source with one module edited: what the hash of the code sees."""

import shutil
from pathlib import Path

from saltus.study import identity


def edited_copy(folder: Path, edited: str, patch) -> None:
    """Let the hash of the code read a copy in ``folder`` in which the modules of this name have another statement."""
    copy = shutil.copytree(identity.PACKAGE, folder / "saltus", ignore=shutil.ignore_patterns("__pycache__", "bitcode", "*.so"))
    found = list(copy.rglob(edited))
    assert found
    for file in found:
        file.write_text(file.read_text(encoding="utf-8") + "EDITED = True\n", encoding="utf-8")
    patch.setattr(identity, "PACKAGE", copy)
