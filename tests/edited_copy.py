"""A copy of the package's source with one module edited: what the hash of the code sees."""

import shutil
from pathlib import Path

from saltus.study import code


def edited_copy(folder: Path, edited: str, patch, more: str = "EDITED = True\n") -> None:
    """Let the hash of the code read a copy in ``folder`` in which the modules of this name have
    ``more``, another statement.
    """
    copy = shutil.copytree(
        code.PACKAGE,
        folder / "saltus",
        ignore=shutil.ignore_patterns("__pycache__", "bitcode", "*.so"),
    )
    found = list(copy.rglob(edited))
    assert found
    for file in found:
        file.write_text(file.read_text(encoding="utf-8") + more, encoding="utf-8")
    patch.setattr(code, "PACKAGE", copy)
