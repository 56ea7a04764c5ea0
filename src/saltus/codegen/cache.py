"""The folder of generated kernels: one entry per (equations, templates, versions, processor), safe to share and to lose.

An entry is built in a private folder and renamed into place, so processes that start cold at once can't disturb each other. A manifest of
checksums is verified before anything is loaded; an entry that doesn't match is thrown away and built again.

Numba compiles one function at a time and holds the interpreter meanwhile. The main thread compiles where it is; other threads compile in
processes of their own (build_one.py), so that they neither wait for each other nor keep those that compute from going on.
"""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import importlib.util
import json
import os
import shutil
import subprocess
import sys
import tempfile
import threading
import warnings
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import platformdirs

from saltus.errors import CacheError, SaltusWarning

MANIFEST = "manifest.json"
MODULE = "kernels.py"
_BUILDING = ".building-"
#: One thread at a time sees to an entry: a module stands in sys.modules before it is complete.
_LOCKS: defaultdict[str, threading.Lock] = defaultdict(threading.Lock)


@dataclass(frozen=True)
class Entry:
    """One cached module: its key, the system it was made for, its size [bytes] and its folder."""

    name: str
    system: str
    size_bytes: int
    path: Path


def folder() -> Path:
    """Where generated kernels are kept: ``$SALTUS_CACHE``, else the user's cache folder."""
    chosen = os.environ.get("SALTUS_CACHE")
    return Path(chosen) if chosen else Path(platformdirs.user_cache_dir("saltus", appauthor=False))


def entries() -> list[Entry]:
    """Every complete entry, by name."""
    found = []
    for manifest in sorted(folder().glob(f"*/{MANIFEST}")):
        path = manifest.parent
        if path.name.startswith(_BUILDING):
            continue
        try:
            title = json.loads(manifest.read_text())["title"]
        except (OSError, ValueError, KeyError, TypeError):
            title = "(damaged)"
        size = sum(file.stat().st_size for file in path.rglob("*") if file.is_file())
        found.append(Entry(path.name, title, size, path))
    return found


def clear() -> int:
    """Delete every entry and every unfinished one; returns how many entries there were."""
    count = len(entries())
    if folder().exists():
        for path in folder().iterdir():
            if path.name.startswith(_BUILDING) or (path / MANIFEST).exists() or (path / MODULE).exists():
                shutil.rmtree(path, ignore_errors=True)
    return count


def load(key: str, source: str, title: str) -> ModuleType:
    """The module with this source, from the cache or compiled now.

    Parameters
    ----------
    key : str
        Name of the entry: a hash of everything that its machine code depends on.
    source : str
        Text of the module.
    title : str
        What `saltus cache` shows for it.

    Raises
    ------
    CacheError
        If no folder at all can be written.
    """
    with _LOCKS[key]:
        return _load(f"saltus_kernels_{key}", folder() / key, source, title)


def _load(name: str, final: Path, source: str, title: str) -> ModuleType:
    if name in sys.modules:
        return sys.modules[name]
    if not (final / MANIFEST).exists() and threading.current_thread() is not threading.main_thread():
        _build_in_a_process(final.name, source, title)
    if _intact(final, source):
        try:
            return _import(name, final / MODULE)
        except Exception as error:  # whatever a damaged file makes Numba raise: the entry is ours, so build it again
            warnings.warn(
                f"saltus: the cached kernel {final} could not be loaded ({error!r}); building it again.", SaltusWarning, stacklevel=2
            )
            shutil.rmtree(final, ignore_errors=True)
    elif (final / MANIFEST).exists():
        warnings.warn(f"saltus: the cached kernel {final} is damaged; building it again.", SaltusWarning, stacklevel=2)
    return _build(name, final, source, title)


def _checksums(path: Path) -> dict[str, str]:
    files = sorted(f for f in path.rglob("*") if f.is_file() and f.name != MANIFEST and f.suffix != ".pyc")
    return {str(f.relative_to(path)): hashlib.sha256(f.read_bytes()).hexdigest() for f in files}


def _intact(path: Path, source: str) -> bool:
    """Whether an entry is whole: every file as it was when it was built, and made from this source."""
    try:
        manifest = json.loads((path / MANIFEST).read_text())
        return manifest["files"] == _checksums(path) and (path / MODULE).read_text() == source
    except (OSError, ValueError, KeyError, TypeError):
        return False


def _import(name: str, file: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # Numba looks a cached function's module up by name
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


def _build_in_a_process(key: str, source: str, title: str) -> None:
    """Let another process make the entry. Whether it did shows in the folder; if not, this process builds it, and says why it can't."""
    order = json.dumps({"key": key, "source": source, "title": title}).encode()
    here = str(Path(__file__).parents[2])
    path = os.pathsep.join([here, *filter(None, [os.environ.get("PYTHONPATH")])])
    command = [sys.executable, "-P", "-m", "saltus.codegen.build_one"]  # -P: not what lies in the working folder
    with contextlib.suppress(OSError):  # no processes here
        subprocess.run(
            command, input=order, env={**os.environ, "PYTHONPATH": path}, capture_output=True, check=False,
            start_new_session=True,  # Ctrl-C is for this process
        )  # fmt: skip


def _build(name: str, final: Path, source: str, title: str) -> ModuleType:
    """Compile beside the entries and publish; where that can't be written or is full, in a folder that goes with this process."""
    try:
        folder().mkdir(parents=True, exist_ok=True)
        building, module = _compile(name, tempfile.mkdtemp(prefix=f"{_BUILDING}{final.name[:12]}-", dir=folder()), source, title)
    except OSError as error:
        warnings.warn(
            f"saltus: {folder()} can't be written ({error.strerror or error}); kernels are compiled for this process only. "
            "Set SALTUS_CACHE to a folder of yours with free space.",
            SaltusWarning,
            stacklevel=5,
        )
        return _build_for_this_process(name, source, title)
    _publish(building, final, source)
    return module


def _build_for_this_process(name: str, source: str, title: str) -> ModuleType:
    try:
        building, module = _compile(name, tempfile.mkdtemp(prefix="saltus-"), source, title)
    except OSError as error:
        raise CacheError(f"no folder for generated kernels: {error}. Set SALTUS_CACHE to a folder with free space.") from error
    atexit.register(shutil.rmtree, building, ignore_errors=True)
    return module


def _compile(name: str, building: str, source: str, title: str) -> tuple[Path, ModuleType]:
    """The module, compiled and with its manifest in a private folder, which is removed if anything goes wrong."""
    path = Path(building)
    try:
        (path / MODULE).write_text(source)
        module = _import(name, path / MODULE)
        (path / MANIFEST).write_text(json.dumps({"title": title, "files": _checksums(path)}, indent=1))
    except BaseException:
        shutil.rmtree(path, ignore_errors=True)
        raise
    return path, module


def _publish(building: Path, final: Path, source: str) -> None:
    """Rename a finished entry into place; a whole one that came first stays, a damaged one gives way."""
    if final.exists() and not _intact(final, source):
        shutil.rmtree(final, ignore_errors=True)
    try:
        os.replace(building, final)
    except OSError:  # another process was first
        shutil.rmtree(building, ignore_errors=True)
