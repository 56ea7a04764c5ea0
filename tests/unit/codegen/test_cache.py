"""The folder of compiled kernels: shared by processes that start at once, damaged, unwritable,
cleared. One line stands for a kernel.
"""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import threading
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from saltus import cache
from saltus.announce import silent
from saltus.cache import entry
from saltus.codegen import building, machine, templates
from saltus.codegen.building import BuildOrder
from saltus.errors import CacheError, SaltusWarning
from saltus.interrupt import Interrupted, Stop

SOURCE = """
define i64 @next(i64 %n) {
  %m = add i64 %n, 1
  ret i64 %m
}
"""


def order(source=SOURCE):
    return BuildOrder("", (source,), ("next",), "one line", "one line: once for each new equation")


KEY = order().key


@pytest.fixture(autouse=True)
def another_process(monkeypatch):
    """For what takes long, as everywhere but in tests (conftest.py)."""
    monkeypatch.setattr(building, "OTHER_PROCESS", 0.5)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """An empty cache folder of this test's own."""
    path = tmp_path / "kernels"
    monkeypatch.setenv("SALTUS_CACHE", str(path))
    yield path
    forget()


@pytest.fixture
def long(monkeypatch):
    """Everything takes long: it is announced, and compiled by another process."""
    monkeypatch.setattr(BuildOrder, "seconds", 20.0)


def forget():
    """As a new process would begin."""
    building._OBJECTS.clear()


class Loaded:
    """The function of an object."""

    def __init__(self, data):
        self.loaded = machine.loaded([data], "next")
        self.propagate = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(self.loaded.address)


def load(source=SOURCE):
    forget()
    return Loaded(building.built(order(source)))


def kernel(folder):
    return folder / f"{KEY}.kernel"


def stamp(folder):
    return kernel(folder).stat().st_mtime_ns


def reopened(file):
    """The file, which is read-only, open to its owner for a test's damage."""
    os.chmod(file, 0o600)
    return file


def test_an_entry_is_made_once_and_then_loaded(folder, long, capfd):
    assert load().propagate(1) == 2
    assert capfd.readouterr().err == (
        "saltus: compiling one line: once for each new equation, about 20 s\n"
    )
    before = stamp(folder)
    assert load().propagate(2) == 3
    assert stamp(folder) == before
    assert capfd.readouterr().err == ""
    (one,) = cache.kernels()
    assert (one.name, one.system, one.path) == (KEY, "one line", kernel(folder))
    assert one.size_bytes == kernel(folder).stat().st_size
    assert [path.name for path in folder.iterdir()] == [kernel(folder).name]


def test_nothing_is_said_where_it_is_not_wanted(folder, long, capfd):
    with silent():
        load()
    assert capfd.readouterr().err == ""


def test_what_takes_a_moment_is_not_announced(folder, capfd):
    load()
    assert capfd.readouterr().err == ""


def test_within_a_process_the_object_is_held(folder):
    first = building.built(order())
    kernel(folder).unlink()
    assert building.built(order()) is first


def truncate(file):
    file.write_bytes(file.read_bytes()[: file.stat().st_size // 2])


def flip_a_bit(file):
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 1
    file.write_bytes(data)


DAMAGES = {
    "truncated": truncate,
    "a bit flipped": flip_a_bit,
    "lost": lambda file: file.unlink(),
    "emptied": lambda file: file.write_bytes(b""),
    "no header": lambda file: file.write_bytes(b"\n"),
    "a header of another kind": lambda file: file.write_bytes(
        b"[1]\n" + file.read_bytes().partition(b"\n")[2]
    ),
    "of another format": lambda file: file.write_bytes(
        file.read_bytes().replace(b"saltus-kernel/1", b"saltus-kernel/9", 1)
    ),
    "that of another key": lambda file: file.write_bytes(
        file.read_bytes().replace(KEY.encode(), KEY[::-1].encode(), 1)
    ),
    "a folder": lambda file: (file.unlink(), file.mkdir(mode=0o700)),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_entry_is_built_again(folder, damage):
    load()
    DAMAGES[damage](reopened(kernel(folder)))
    cache.kernels()  # shows what is there without failing
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        assert load().propagate(1) == 2
    assert {warning.category for warning in said} <= {SaltusWarning}
    assert bool(said) == (damage != "lost")
    if damage == "a folder":  # nothing can take its place: said each time
        return
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        before = stamp(folder)
        assert load().propagate(1) == 2
    assert stamp(folder) == before  # whole again: loaded, not built
    assert [one.system for one in cache.kernels()] == ["one line"]
    assert not list(folder.glob(".building-*"))


# -- what others could have written ----------------------------------------------------------------
WRONG = SOURCE.replace(", 1", ", 40")


@pytest.fixture
def planted(folder):
    """A whole entry, checksum and all, that holds a stranger's code."""
    folder.mkdir(mode=0o700)
    entry.write(kernel(folder), "one line", building.made(order(WRONG)))


def test_the_planted_entry_would_run_if_it_were_believed(folder, planted):
    assert load().propagate(1) == 41


def given_to_somebody(path):
    if os.geteuid():
        pytest.skip("only root can give a file away")
    os.lchown(path, 65534, 65534)


def linked(path):
    there = path.with_name("elsewhere")
    path.rename(there)
    path.symlink_to(there)


OPENINGS = {
    "writable by its group": lambda file: (
        os.chmod(file, 0o620),
        os.chown(file, -1, other_group()),
    ),
    "writable by all": lambda file: os.chmod(file, 0o602),
    "somebody else's": given_to_somebody,
    "a link": linked,
}


def other_group():
    """A group that isn't this user's private one."""
    if os.geteuid() and not set(os.getgroups()) - {os.getgid()}:
        pytest.skip("this user has no other group")
    return 65534 if not os.geteuid() else next(iter(set(os.getgroups()) - {os.getgid()}))


@pytest.mark.skipif(sys.platform == "win32", reason="owners and modes are POSIX")
@pytest.mark.parametrize("opening", OPENINGS)
def test_an_entry_that_others_could_have_written_is_not_read(folder, planted, opening):
    OPENINGS[opening](kernel(folder))
    with pytest.warns(SaltusWarning, match="building it again"):
        assert load().propagate(1) == 2
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert load().propagate(1) == 2  # its place is taken by one of ours


@pytest.mark.skipif(sys.platform == "win32", reason="owners and modes are POSIX")
@pytest.mark.parametrize("opening", [name for name in OPENINGS if name != "a link"])
def test_a_folder_that_others_could_have_written_to_is_not_used(folder, planted, opening):
    OPENINGS[opening](folder)
    os.chmod(folder, folder.stat().st_mode | 0o500)
    before = kernel(folder).read_bytes()
    with pytest.warns(SaltusWarning, match="compiled for this process only"):
        assert load().propagate(1) == 2
    assert kernel(folder).read_bytes() == before
    assert [path.name for path in folder.iterdir()] == [kernel(folder).name]


@pytest.mark.skipif(sys.platform == "win32", reason="owners and modes are POSIX")
def test_a_link_of_ours_to_a_folder_of_ours_is_used(folder, tmp_path):
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    folder.symlink_to(tmp_path / "elsewhere")
    load()
    assert [path.name for path in (tmp_path / "elsewhere").iterdir()] == [kernel(folder).name]


@pytest.mark.skipif(sys.platform == "win32", reason="owners and modes are POSIX")
def test_somebody_elses_link_to_a_folder_of_ours_is_not_used(folder, tmp_path):
    (tmp_path / "elsewhere").mkdir(mode=0o700)
    folder.symlink_to(tmp_path / "elsewhere")
    given_to_somebody(folder)
    with pytest.warns(SaltusWarning, match="is a link that belongs to another user"):
        load()
    assert not list((tmp_path / "elsewhere").iterdir())


@pytest.mark.skipif(sys.platform == "win32", reason="modes are POSIX")
def test_folder_and_entry_are_closed_whatever_the_umask(folder):
    before = os.umask(0)
    try:
        load()
    finally:
        os.umask(before)
    assert folder.stat().st_mode & 0o777 == 0o700
    assert kernel(folder).stat().st_mode & 0o777 == 0o400


# -- several at once -------------------------------------------------------------------------------
CHILD = """
import ctypes, sys
from saltus.codegen import building, machine
words = "one line", "one line: once for each new equation"
data = building.built(building.BuildOrder("", (sys.stdin.read(),), ("next",), *words))
loaded = machine.loaded([data], "next")
print(ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(loaded.address)(1))
"""


def test_four_processes_that_start_cold_at_once(folder):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-W", "error", "-c", CHILD]
    pipe = subprocess.PIPE
    processes = [
        subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, env=environment)
        for _ in range(4)
    ]
    for process in processes:  # each waits for its source: they all reach the empty folder together
        process.stdin.write(SOURCE)
    for process in processes:
        process.stdin.close()
        process.stdin = None
    answers = [process.communicate(timeout=120) for process in processes]
    assert [
        (out.strip(), process.returncode)
        for (out, _), process in zip(answers, processes, strict=True)
    ] == [("2", 0)] * 4, answers
    assert [one.name for one in cache.kernels()] == [KEY]
    assert [path.name for path in folder.iterdir()] == [kernel(folder).name]
    before = stamp(folder)
    assert load().propagate(1) == 2
    assert stamp(folder) == before


def in_threads(*sources):
    """What threads get that each load an entry of their own, or the exceptions."""
    forget()
    with ThreadPoolExecutor(len(sources)) as pool:
        futures = [
            pool.submit(lambda source=source: Loaded(building.built(order(source))))
            for source in sources
        ]
    return [future.exception() or future.result() for future in futures]


def test_what_takes_long_is_compiled_by_another_process(folder, long, monkeypatch):
    monkeypatch.setattr(building, "made", lambda *_: pytest.fail("compiled here"))
    first, second = in_threads(SOURCE, SOURCE.replace(", 1", ", 2"))
    assert (first.propagate(1), second.propagate(1)) == (2, 3)
    assert len(cache.kernels()) == len(list(folder.iterdir())) == 2


def test_where_no_process_can_be_started_this_one_compiles(folder, long, monkeypatch):
    monkeypatch.setattr(building.sys, "executable", "/no/such/python")
    (one,) = in_threads(SOURCE)
    assert one.propagate(1) == 2


@pytest.mark.parametrize("slowly", [False, True])
def test_what_does_not_compile_says_so_and_leaves_nothing_behind(folder, slowly, monkeypatch):
    monkeypatch.setattr(BuildOrder, "seconds", 20.0 if slowly else 0.0)
    with pytest.raises(RuntimeError, match="parsing error"):
        load(SOURCE.replace("%n, 1", "%nothing, 1"))
    assert list(folder.iterdir()) == []


def test_a_process_that_is_killed_is_told(folder, long, monkeypatch):
    monkeypatch.setattr(building, "_wait", lambda process: process.kill() or process.wait())
    with pytest.raises(CacheError, match="ended by signal 9"):
        load()
    assert list(folder.iterdir()) == []


# -- Ctrl-C ----------------------------------------------------------------------------------------
@pytest.fixture
def slow(long, monkeypatch, tmp_path):
    """The process that compiles doesn't end."""
    script = tmp_path / "slow"
    script.write_text("#!/bin/sh\nexec sleep 60\n")
    script.chmod(0o700)
    monkeypatch.setattr(building.sys, "executable", str(script))


def compiling():
    """Processes that compile now."""
    return [process for process in list(building._COMPILING) if process.poll() is None]


def wait_for(condition):
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_ctrl_c_while_it_compiles_ends_at_once_and_leaves_no_process(folder, slow):
    """The main thread waits for a process: Ctrl-C reaches it, and cannot be lost in
    the compiler.
    """
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    started = []

    def press():
        wait_for(compiling)
        started.extend(compiling())
        os.kill(os.getpid(), signal.SIGINT)

    presser = threading.Thread(target=press)
    presser.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            load()
    finally:
        presser.join()
        signal.signal(signal.SIGINT, before)
    assert [process.poll() is not None for process in started] == [True]
    assert list(folder.iterdir()) == []


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_ctrl_c_while_the_process_starts_leaves_neither_it_nor_its_pipe(folder, slow, monkeypatch):
    """The exception holds what was half made until the garbage is collected, in whatever runs
    then.
    """
    started = []

    class Pressed(subprocess.Popen):
        def __init__(self, *args, **options):
            super().__init__(*args, **options)
            started.append(self)
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(building.subprocess, "Popen", Pressed)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            load()
    finally:
        signal.signal(signal.SIGINT, before)
    (process,) = started
    try:
        assert process.poll() is not None
        assert process.stdout.closed
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


@pytest.mark.skipif(sys.platform == "win32", reason="the slow process is a script")
def test_threads_that_wait_for_a_kernel_stop_when_they_are_told(folder, slow):
    """Both the one that compiles and the one that waits for it: they are part of work that Ctrl-C
    has ended.
    """
    stop = Stop()

    def one():
        stop.hold()
        return building.built(order())

    with ThreadPoolExecutor(2) as pool:
        futures = [pool.submit(one) for _ in range(2)]
        wait_for(compiling)
        stop.set()
        assert [type(future.exception()) for future in futures] == [Interrupted] * 2
    assert not compiling()


# -- a folder that can't be used -------------------------------------------------------------------
def test_a_folder_that_cannot_be_written_costs_time_not_the_run(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("SALTUS_CACHE", str(tmp_path / "file" / "kernels"))
    with pytest.warns(SaltusWarning, match="Set SALTUS_CACHE"):
        one = load()
    assert one.propagate(1) == 2
    forget()
    assert cache.kernels() == []
    assert cache.clear() == 0


def test_a_full_disk_costs_time_not_the_run(folder, monkeypatch):
    def full(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(entry.os, "replace", full)
    with pytest.warns(SaltusWarning, match="No space left on device.*Set SALTUS_CACHE"):
        assert load().propagate(1) == 2
    assert list(folder.iterdir()) == []


def test_what_processes_left_that_were_killed_is_swept_after_a_day(folder):
    load()
    for name in (".building-of-old", ".building-of-now"):
        (folder / name).write_text("")
    (folder / ".building-folder-of-old").mkdir()
    os.utime(folder / ".building-of-old", (0, 0))
    os.utime(folder / ".building-folder-of-old", (0, 0))
    kernel(folder).unlink()
    load()
    assert {path.name for path in folder.iterdir()} == {kernel(folder).name, ".building-of-now"}


def test_clear_takes_entries_and_leftovers_and_nothing_else(folder):
    load()
    (folder / ".building-left-behind").write_text("")
    (folder / "of an older version").mkdir()
    for name in ("kernels.py", "manifest.json"):
        (folder / "of an older version" / name).write_text("")
    (folder / "yours").mkdir()
    (folder / "yours.txt").write_text("keep")
    assert cache.clear() == 1
    assert sorted(path.name for path in folder.iterdir()) == ["yours", "yours.txt"]
    assert cache.kernels() == []


def test_the_folder_is_the_users_cache_by_default(monkeypatch):
    monkeypatch.delenv("SALTUS_CACHE", raising=False)
    assert cache.folder().name == "saltus"
    assert cache.folder().is_absolute()


# -- what somebody else put there, with right checksums --------------------------------------------
@pytest.mark.parametrize("data", [b"", b"no object" * 100])
def test_an_entry_that_is_no_object_is_told(folder, data):
    load()
    kernel(folder).unlink()
    entry.write(kernel(folder), "somebody's", data)
    with pytest.raises(CacheError, match=r"can't be loaded: .* saltus cache clear"):
        load()


@pytest.mark.parametrize("head", [b"[" * 100_000 + b"\n", b"5\n", b"[]\n", b'{"format": []}\n'])
def test_an_entry_with_a_strange_head_is_built_again(folder, head):
    load()
    kernel(folder).chmod(0o600)
    kernel(folder).write_bytes(head)
    assert entry.title_of(kernel(folder)) == "(damaged)"
    with pytest.warns(SaltusWarning, match="is damaged; building it again"):
        assert load().propagate(1) == 2


def test_an_entry_of_many_gigabytes_is_not_read(folder):
    load()
    kernel(folder).chmod(0o600)
    with kernel(folder).open("r+b") as file:
        file.truncate(200 * 10**9)
    with pytest.warns(SaltusWarning, match="is larger than any kernel; building it again"):
        assert load().propagate(1) == 2


@pytest.mark.parametrize(
    "damage",
    [
        None,
        b"",
        b"[]",
        b'{"bitcode": 5}',
        b'{"bitcode": {"taylor_16": {"sha256": 5}}}',
        b"[" * 100_000,
    ],
)
def test_damaged_bitcode_is_told(monkeypatch, tmp_path, damage):
    (tmp_path / "bitcode").mkdir()
    if damage is not None:
        (tmp_path / "bitcode" / "manifest.json").write_bytes(damage)
    monkeypatch.setattr(templates.resources, "files", lambda _: tmp_path)
    for read in (templates.manifest.__wrapped__, lambda: templates._brought("pair.bc.xz")):
        with pytest.raises(
            CacheError,
            match=r"bitcode/\S+ (is damaged|can't be read: .*): install "
            r"saltus again|nstall saltus again",
        ):
            read()


def test_a_tilde_is_the_home_folder(monkeypatch, tmp_path):
    """An env file or a systemd unit hands it over as it stands."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("USERPROFILE", str(tmp_path))
    monkeypatch.setenv("SALTUS_CACHE", "~/kernels")
    assert cache.folder() == tmp_path / "kernels"


@pytest.mark.skipif(
    os.name != "posix", reason="elsewhere a process keeps the number of a parent that is gone"
)
def test_a_process_that_compiles_ends_with_the_one_that_asked(tmp_path):
    """Killed, the asker can't end it: what it held is free all the same."""
    import fcntl

    lock = tmp_path / "held"
    (tmp_path / "busy.py").write_text(
        "import fcntl, sys, time\n"
        "from saltus.codegen.asker import end_with_asker\n"
        "file = open(sys.argv[1], 'w')\n"
        "fcntl.flock(file, fcntl.LOCK_EX)\n"
        "end_with_asker()\n"
        "file.write('at work')\n"
        "file.flush()\n"
        "time.sleep(600)\n"
    )
    asks = (
        f"from saltus.codegen import building\nbuilding._answer_of('busy', ({str(lock)!r},), "
        f"b'', 'nothing')\n"
    )
    path = os.pathsep.join([str(tmp_path), str(Path(building.__file__).parents[2])])
    asker = subprocess.Popen([sys.executable, "-c", asks], env={**os.environ, "PYTHONPATH": path})
    try:
        while not lock.exists() or not lock.read_text():
            assert asker.poll() is None
            time.sleep(0.05)
    finally:
        asker.kill()
        asker.wait()
    with lock.open() as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # waits until its holder has ended


def test_a_kernel_of_long_ago_is_deleted_when_another_is_kept(folder):
    for name, days in (("old", 91), ("young", 89)):
        cache.keep(name, "an equation", b"code")
        when = time.time() - days * 86_400
        os.utime(reopened(folder / f"{name}.kernel"), (when, when))
    cache.keep("new", "another", b"code")
    assert [one.name for one in cache.kernels()] == ["new", "young"]
