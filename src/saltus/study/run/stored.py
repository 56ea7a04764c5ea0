"""Results in one file: stored once computed, and reused if their identity is that of the
question.
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from saltus.interrupt import Interrupted
from saltus.results import load, save
from saltus.results.files.atomic import ResultFileError
from saltus.results.provenance import to_json
from saltus.results.store.identity import differing
from saltus.study.run.running import Report, Running

if TYPE_CHECKING:
    import xarray as xr

#: A Dataset; or None, where other jobs have yet to work on it.
Answer = TypeVar("Answer", "xr.Dataset", "xr.Dataset | None")
#: Attribute of a result that holds its identity.
IDENTITY = "study_identity"
#: End of the name of a file with a result that was stopped.
PARTIAL = "-partial"


def load_or_compute(
    stem: str,
    title: str,
    identity: Mapping[str, str],
    compute: Callable[[Callable[[float], None]], Answer],
    at: Running,
) -> Answer:
    """Load the result in ``STEM.nc`` if it has this question's identity, else compute it and store
    it there.

    Parameters
    ----------
    stem, title : str
        Name of the file; of the question.
    identity : mapping of str to str
        Hashes and texts that the file must have to be the answer.
    compute : callable
        Takes the progress callable; returns None if other jobs have yet to work on it.
    at : Running
        Where.

    Raises
    ------
    Interrupted
        On Ctrl-C; the part computed is stored in ``STEM-partial.nc``.
    """
    file = at.folder / f"{stem}.nc"
    stored = _stored(file, title, identity, at.say)
    if stored is not None:
        at.report(Report(title, 100, 100, 0.0, 0, last=True, what="%"))
        return stored
    return _computed(file, title, identity, compute, at)


def _stored(
    file: Path, title: str, identity: Mapping[str, str], say: Callable[[str], None]
) -> xr.Dataset | None:
    """Result in a file, if the file exists, is intact, and has this identity."""
    if not file.exists():
        return None
    try:
        ds = load(file)
        before = json.loads(ds.attrs.get(IDENTITY, "{}"))
    except (ResultFileError, json.JSONDecodeError) as error:
        say(f"{title}: computed again, as {error}")
        return None
    changed = differing(before, identity)
    if changed:
        say(
            f"{title}: computed again, as the {', '.join(changed)} changed since {file.name} was "
            f"written."
        )
        return None
    return ds


def _computed(
    file: Path,
    title: str,
    identity: Mapping[str, str],
    compute: Callable[[Callable[[float], None]], Answer],
    at: Running,
) -> Answer:

    begin = time.perf_counter()

    def show(share: float, last: bool = False) -> None:
        done = 100 if last else min(round(100 * share), 99)
        at.report(Report(title, done, 100, time.perf_counter() - begin, done, last, "%"))

    labels: dict[str, Any] = {"study": at.text, "title": title, IDENTITY: to_json(dict(identity))}
    partial = file.with_stem(f"{file.stem}{PARTIAL}")
    try:
        answer = compute(show)
    except Interrupted as stopped:
        if stopped.has_partial:
            at.say(f"{title}: what was computed so far goes to {partial}")
            save(stopped.partial.assign_attrs(labels), partial)
        raise
    if answer is None:
        return answer
    ds = answer.assign_attrs(labels)
    save(ds, file)
    partial.unlink(missing_ok=True)
    show(1.0, last=True)
    return ds
