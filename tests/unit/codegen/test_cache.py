"""The folder of compiled kernels: shared by processes that start at once, damaged, unwritable, cleared. One line stands for a kernel."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numba
import pytest

from saltus.codegen import cache
from saltus.errors import CacheError, SaltusWarning

pytestmark = pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is cached with the JIT off")

KEY = "0123456789abcdef0123456789abcdef"
SOURCE = """from numba import njit


@njit("int64(int64)", cache=True)
def propagate(n):
    return n + 1
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty cache folder of this test's own."""
    path = tmp_path / "kernels"
    monkeypatch.setenv("SALTUS_CACHE", str(path))
    yield path
    forget()


def forget():
    """As a new process would begin."""
    sys.modules.pop(f"saltus_kernels_{KEY}", None)


def load(source=SOURCE):
    forget()
    return cache.load(KEY, source, "one line")


def machine_code(folder):
    (file,) = (folder / KEY / "__pycache__").glob("*.nbc")
    return file


def stamps(folder):
    return {str(file): file.stat().st_mtime_ns for file in sorted((folder / KEY).rglob("*.nb?"))}


def test_an_entry_is_made_once_and_then_loaded(folder):
    assert load().propagate(1) == 2
    before = stamps(folder)
    assert len(before) == 2  # Numba's index and one kernel
    assert load().propagate(2) == 3
    assert stamps(folder) == before
    (entry,) = cache.entries()
    assert (entry.name, entry.system, entry.path) == (KEY, "one line", folder / KEY)
    assert entry.size_bytes == sum(file.stat().st_size for file in entry.path.rglob("*") if file.is_file())


def test_within_a_process_the_module_is_the_same(folder):
    assert load() is cache.load(KEY, SOURCE, "one line")


def truncate(file):
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])


def flip_a_bit(file):
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)


DAMAGES = {
    "kernel truncated": lambda entry: truncate(next(entry.rglob("*.nbc"))),
    "kernel with a bit flipped": lambda entry: flip_a_bit(next(entry.rglob("*.nbc"))),
    "kernel lost": lambda entry: next(entry.rglob("*.nbc")).unlink(),
    "index truncated": lambda entry: truncate(next(entry.rglob("*.nbi"))),
    "source edited": lambda entry: (entry / cache.MODULE).write_text(SOURCE.replace("1", "2")),
    "source lost": lambda entry: (entry / cache.MODULE).unlink(),
    "manifest lost": lambda entry: (entry / cache.MANIFEST).unlink(),
    "manifest truncated": lambda entry: truncate(entry / cache.MANIFEST),
    "manifest of another kind": lambda entry: (entry / cache.MANIFEST).write_text("[1]"),
    "everything lost": lambda entry: [shutil.rmtree(entry), entry.mkdir()],
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_entry_is_built_again(folder, damage):
    load()
    DAMAGES[damage](folder / KEY)
    cache.entries()  # shows what is there without failing
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        assert load().propagate(1) == 2
    if said:
        assert {warning.category for warning in said} == {SaltusWarning}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        before = stamps(folder)
        assert load().propagate(1) == 2
    assert stamps(folder) == before  # whole again: loaded, not built
    assert [entry.system for entry in cache.entries()] == ["one line"]
    assert not list(folder.glob(".building-*"))


def test_an_entry_damaged_before_its_checksums_were_taken_is_replaced_with_a_warning(folder):
    load()
    flip = machine_code(folder)
    flip.write_bytes(b"not machine code")
    manifest = folder / KEY / cache.MANIFEST
    manifest.write_text(json.dumps({**json.loads(manifest.read_text()), "files": cache._checksums(folder / KEY)}))
    with pytest.warns(UserWarning, match="building it again"):
        assert load().propagate(1) == 2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert load().propagate(1) == 2


def test_another_source_under_the_same_name_is_not_taken(folder):
    load()
    with pytest.warns(SaltusWarning, match="building it again"):
        assert load(SOURCE.replace("n + 1", "n + 5")).propagate(1) == 6


CHILD = """
import sys
from saltus.codegen import cache
source = sys.stdin.read()
print(cache.load({key!r}, source, "one line").propagate(1))
"""


def test_four_processes_that_start_cold_at_once(folder):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-W", "error", "-c", CHILD.format(key=KEY)]
    pipe = subprocess.PIPE
    processes = [subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, env=environment) for _ in range(4)]
    for process in processes:  # each waits for its source: they all reach the empty folder together
        process.stdin.write(SOURCE)
    for process in processes:
        process.stdin.close()
        process.stdin = None
    answers = [process.communicate(timeout=120) for process in processes]
    assert [(out.strip(), process.returncode) for (out, _), process in zip(answers, processes, strict=True)] == [("2", 0)] * 4, answers
    assert [entry.name for entry in cache.entries()] == [KEY]
    assert [path.name for path in folder.iterdir()] == [KEY]
    before = stamps(folder)
    assert load().propagate(1) == 2
    assert stamps(folder) == before


def in_threads(*sources):
    """What threads get that each load an entry of its own, or the exceptions."""
    forget()

    def one(number):
        name = f"{number:x}" * 32
        try:
            return cache.load(name, sources[number], "one line")
        finally:
            sys.modules.pop(f"saltus_kernels_{name}", None)

    with ThreadPoolExecutor(len(sources)) as pool:
        futures = [pool.submit(one, number) for number in range(len(sources))]
    return [future.exception() or future.result() for future in futures]


def test_threads_compile_in_processes_of_their_own(folder, monkeypatch):
    """So that they don't wait for each other: no thread of this process calls Numba's compiler."""
    monkeypatch.setattr(cache, "_compile", lambda *_: pytest.fail("compiled here"))
    first, second = in_threads(SOURCE, SOURCE.replace("n + 1", "n + 2"))
    assert (first.propagate(1), second.propagate(1)) == (2, 3)
    assert len(cache.entries()) == len(list(folder.iterdir())) == 2


def test_a_thread_whose_process_fails_compiles_itself(folder, monkeypatch):
    monkeypatch.setattr(cache.sys, "executable", "/no/such/python")
    (module,) = in_threads(SOURCE)
    assert module.propagate(1) == 2


def test_a_thread_says_what_does_not_compile(folder):
    (error,) = in_threads(SOURCE.replace("n + 1", "n + nothing"))
    assert isinstance(error, numba.errors.NumbaError)
    assert list(folder.iterdir()) == []


def test_a_folder_that_cannot_be_written_costs_time_not_the_run(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SALTUS_CACHE", str(tmp_path / "file" / "kernels"))
    with pytest.warns(UserWarning, match="Set SALTUS_CACHE"):
        module = load()
    assert module.propagate(1) == 2
    shutil.rmtree(Path(module.__file__).parent)
    forget()
    assert cache.entries() == []
    assert cache.clear() == 0


def test_no_folder_at_all(folder, monkeypatch):
    folder.parent.joinpath("kernels").write_text("")

    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(cache.tempfile, "mkdtemp", full)
    with pytest.warns(UserWarning, match="can't be written"), pytest.raises(CacheError, match="Set SALTUS_CACHE"):
        load()


def test_a_full_disk_costs_time_not_the_run(folder, monkeypatch):
    write = Path.write_text

    def full_beside_the_entries(path, text, *rest, **options):
        if folder in path.parents:
            raise OSError(28, "No space left on device")
        return write(path, text, *rest, **options)

    monkeypatch.setattr(Path, "write_text", full_beside_the_entries)
    with pytest.warns(SaltusWarning, match="No space left on device.*Set SALTUS_CACHE"):
        assert load().propagate(1) == 2
    assert list(folder.iterdir()) == []


def test_a_kernel_that_does_not_compile_leaves_nothing_behind(folder):
    with pytest.raises(numba.errors.NumbaError):
        load(SOURCE.replace("n + 1", "n + nothing"))
    assert list(folder.iterdir()) == []
    assert f"saltus_kernels_{KEY}" not in sys.modules


def test_clear_takes_entries_and_leftovers_and_nothing_else(folder):
    load()
    (folder / ".building-left-behind").mkdir()
    (folder / ".building-left-behind" / cache.MODULE).write_text("")
    (folder / ".building-just-begun").mkdir()
    (folder / "yours").mkdir()
    (folder / "yours.txt").write_text("keep")
    assert cache.clear() == 1
    assert sorted(path.name for path in folder.iterdir()) == ["yours", "yours.txt"]
    assert cache.entries() == []


def test_the_folder_is_the_users_cache_by_default(monkeypatch):
    monkeypatch.delenv("SALTUS_CACHE", raising=False)
    assert cache.folder().name == "saltus"
    assert cache.folder().is_absolute()
