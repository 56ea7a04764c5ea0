"""Folders that appear under their names complete or not at all, and removal of the drafts that
killed processes leave.
"""

from __future__ import annotations

import os
import shutil
import uuid
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path

from saltus.results.store.durable import StoreError
from saltus.results.store.lock import exclusive, is_held
from saltus.whole_files import flush, is_older, refused_as, write

#: Age of a draft without a lock [s] above which its process was killed: making a folder takes a
#: moment only.
_DRAFT_AGE = 60.0
#: Lock file in a draft, held while the draft is filled. A clock that jumps ahead makes the draft
#: seem old, but the lock shows that it is in use.
_LOCK = Path("locks") / "draft"


def write_folder(path: Path, files: Mapping[str, bytes], folders: Iterable[str]) -> None:
    """Make a folder that appears under its name complete or not at all.

    Parameters
    ----------
    path : Path
        Its name, not taken yet.
    files : mapping of str to bytes
        Its content, by path in the folder.
    folders : iterable of str
        Folders in it; ``locks`` is one of them.

    Raises
    ------
    StoreError
        If something stands under the name, or the disk is full.
    """
    remove_old_drafts(path)
    draft = path.with_name(f".{path.name}.{uuid.uuid4().hex[:8]}.part")
    advice = "Nothing was left behind; make room or choose another folder."
    try:
        with refused_as(StoreError, f"{path} can't be made", advice):
            for name in folders:
                (draft / name).mkdir(parents=True)
            with _locked(draft):
                for name, data in files.items():
                    write(draft / name, data)
                for place in [draft, *(place for place in draft.rglob("*") if place.is_dir())]:
                    flush(place)
                os.rename(draft, path)
            flush(path.parent)
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _locked(draft: Path) -> AbstractContextManager[object]:
    """Hold the lock of a draft. Windows renames no folder with an open file in it: on Windows only
    the age of a draft counts.
    """
    return nullcontext() if os.name == "nt" else exclusive(draft / _LOCK)


def remove_old_drafts(path: Path) -> None:
    """Remove drafts of processes that were killed within :func:`write_folder`."""
    for draft in path.parent.iterdir():
        if (
            draft.name.startswith(f".{path.name}.")
            and draft.name.endswith(".part")
            and _abandoned(draft)
        ):
            shutil.rmtree(draft, ignore_errors=True)


def _abandoned(draft: Path) -> bool:
    return is_older(draft, _DRAFT_AGE) and not ((draft / _LOCK).exists() and is_held(draft / _LOCK))
