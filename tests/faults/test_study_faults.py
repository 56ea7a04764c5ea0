"""A study of basins survives what befalls a computer: kill -9 of the process or of a worker,
Ctrl-C, a full disk, damage, a second process.

Everything here is the command itself, in processes of its own, on the rig at 16 Hz: 576 starts in
24 chunks, four attractors.
"""

import json
import os
import random
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from contextlib import suppress
from copy import copy
from dataclasses import replace
from functools import cache
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from typer.testing import CliRunner

import saltus as sl
from saltus.analysis.basins import pipeline
from saltus.analysis.basins.pipeline import BasinPlan
from saltus.analysis.basins.serial import found_data
from saltus.cli.commands import app
from saltus.kernels import status as st
from saltus.results import load
from saltus.results.kinds.basins import rows
from saltus.results.store.store import Store
from saltus.study.read import parse
from saltus.study.run.divided import compute, finish, open_store
from saltus.study.run.running import Resources
from small_maps import small_maps
from small_study import maps_of, small_study

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="signals and fork are POSIX"),
]

STUDY = small_study(24)
CHUNKS = 24
#: The command with small chunks (in a process of --workers too, which imports this file first), and
#: a moment between two commits, so that there is one to be killed in; after the MOST-th chunk it
#: waits for that. Pictures are empty frames
#: unless they are asked for: drawing takes longer than all else together. With `serve` it runs the
#: study once, by which everything is loaded and compiled, and forks a child for each line: a child
#: has nothing to load.
COMMAND = """
import gc, json, os, signal, sys, time
import saltus.analysis.basins.pipeline

saltus.analysis.basins.pipeline.CHUNK = 24
saltus.analysis.basins.pipeline.SCOUTS, saltus.analysis.basins.pipeline.CHECKED = 64, 64

if __name__ == "__main__":  # a process of --workers computes chunks only
    import saltus.plot, saltus.study.run.divided, saltus.study.read, saltus.study.run.study
    import saltus.results.files.export
    from saltus.cli import main
    from saltus.results.store.store import Store

    saltus.study.run.divided.LARGE = 100  # nobody asks how long it will take
    saltus.results.files.export._has = lambda _: False  # netCDF-3 is written sooner
    commit = Store.commit
    committed = []

    def slow_commit(self, index, values):
        waits = len(committed) == int(os.environ.get("MOST", "-1"))
        time.sleep(60 if waits else float(os.environ.get("PAUSE", "0")))
        commit(self, index, values)
        committed.append(index)

    Store.commit = slow_commit

def empty_pictures():
    import matplotlib.pyplot as plt
    saltus.plot.basins = lambda *_, **__: plt.figure(figsize=(2, 2)).add_subplot()
    saltus.plot.gallery = lambda *_, **__: plt.figure(figsize=(2, 2))

def run(arguments, pictures):
    sys.argv = ["saltus", *arguments]
    if not pictures:
        empty_pictures()
    try:
        main()
    except SystemExit as end:
        sys.stdout.flush()
        return end.code or 0
    return 99

def serve(out, study):
    plots = saltus.plot.basins, saltus.plot.gallery
    with open(os.devnull, "w") as sys.stdout:
        code = run(["run", study, "--out", out, "--threads", "1", "--progress", "none"], False)
    sys.stdout = sys.__stdout__
    saltus.plot.basins, saltus.plot.gallery = plots
    gc.freeze()  # children needn't look whether it can go
    print("ready" if code == 0 else code, flush=True)
    for asked in map(json.loads, sys.stdin):
        if isinstance(asked, int):
            print(os.waitstatus_to_exitcode(os.waitpid(asked, 0)[1]), flush=True)
            continue
        arguments, environment, log = asked
        child = os.fork()
        if child == 0:
            os.setsid()  # what is sent to the group of a run reaches its workers, and not the tests
            os.environ.update(environment)
            committed.clear()  # what the first run did is not the child's
            signal.signal(signal.SIGINT, signal.default_int_handler)  # else ignored
            to = os.open(log, os.O_CREAT | os.O_WRONLY | os.O_APPEND)
            os.dup2(to, 1)
            os.dup2(to, 2)
            os._exit(run(arguments, "PICTURES" in os.environ))
        print(child, flush=True)

if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if sys.argv[1] == "serve":
        serve(*sys.argv[2:])
    else:
        empty_pictures()
        main()
"""


class Server:
    """Runs the command in children of a process that has loaded everything."""

    def __init__(self, place):
        self.place, self.command, self.study, self.first = (
            place,
            place / "command.py",
            place / "study.toml",
            place / "out",
        )
        self.logs = {}
        self.command.write_text(COMMAND)
        self.study.write_text(STUDY)
        self.process = subprocess.Popen(
            [sys.executable, str(self.command), "serve", str(self.first), str(self.study)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        assert self.process.stdout.readline() == "ready\n"

    def start(self, *arguments, pause=0.0, pictures=False, most=-1):
        """Number of the process that runs the command."""
        log, environment = (
            self.place / f"log{len(self.logs)}.txt",
            {"PAUSE": str(pause), "MOST": str(most)} | ({"PICTURES": "1"} if pictures else {}),
        )
        child = self._answer([list(map(str, arguments)), environment, str(log)])
        self.logs[child] = log
        return child

    def end(self, child):
        """Exit code of the process, minus the number of the signal that ended it;
        what it printed.
        """
        code, log = self._answer(child), self.logs[child]
        return code, log.read_text() if log.exists() else ""

    def run(self, *arguments, pictures=False):
        return self.end(self.start(*arguments, pictures=pictures))

    def _answer(self, asked):
        self.process.stdin.write(json.dumps(asked) + "\n")
        self.process.stdin.flush()
        return int(self.process.stdout.readline())


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    one = Server(tmp_path_factory.mktemp("server"))
    yield one
    one.process.stdin.close()
    one.process.wait(20)
    one.process.stdout.close()  # else whatever collects garbage later is told of it


def arguments(server, folder, *more):
    return "run", server.study, "--out", folder, "--threads", 1, "--progress", "none", *more


@pytest.fixture(scope="module")
def undisturbed(server):
    """The run that nothing disturbed: the files of its store, and its map."""
    files = contents(server.first)
    assert sum("/chunks/" in name for name in files) == CHUNKS
    return files, load(server.first / "basins.nc").drop_attrs()


def contents(folder):
    """Every file of the stores but the locks; drafts must be gone."""
    files = {
        str(file.relative_to(folder)): file.read_bytes()
        for file in (folder / "stores").rglob("*")
        if file.is_file()
    }
    return {name: data for name, data in files.items() if "/locks/" not in name}


def committed(folder):
    return len(list((folder / "stores" / "basins" / "chunks").glob("*.chunk")))


def as_if_undisturbed(folder, undisturbed):
    assert contents(folder) == undisturbed[0]
    assert load(folder / "basins.nc").drop_attrs().identical(undisturbed[1])


def wait_for(condition, seconds=300):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.005)


# -- killed ----------------------------------------------------------------------------------------
def test_killed_at_12_random_moments(server, undisturbed, tmp_path):
    """While attractors are looked for, between chunks, while table and pictures are made; then it
    goes on as if nothing had been. No run gets on by more than five chunks, however fast it is;
    one that finds no more of them to make may end before it is killed.
    """
    moments, folder, progress = random.Random(4), tmp_path / "out", [0]
    for _ in range(12):
        chunks = moments.randrange(5)
        child = server.start(*arguments(server, folder), pictures=True, most=chunks + 1)
        goal = min(progress[-1] + chunks, CHUNKS)
        wait_for(lambda goal=goal, child=child: committed(folder) >= goal or ended(child))
        time.sleep(moments.uniform(0.0, 0.05 if goal < CHUNKS else 0.5))
        os.kill(child, signal.SIGKILL)
        code, text = server.end(child)
        assert code == -signal.SIGKILL or (code == 0 and progress[-1] >= CHUNKS - 5), text
        progress.append(committed(folder))
        if (folder / "stores" / "basins").exists():
            assert Store.open(folder / "stores" / "basins").damaged() == [], (
                "what has a record is true before anything is mended"
            )
        if (folder / "basins.nc").exists():
            load(folder / "basins.nc")
    assert progress == sorted(progress), "what is done stays done"
    assert len(set(progress)) > 5, "it got on between the kills"
    assert progress[-1] > CHUNKS // 2
    for draft in (folder / "stores").glob(".basins.*.part"):
        os.utime(draft, (0, 0))  # old enough to be removed
    code, text = server.run("resume", folder, "--threads", 1, "--progress", "none")
    assert code == 0, text
    assert not list((folder / "stores").glob(".*"))
    as_if_undisturbed(folder, undisturbed)


def ended(child):
    return (
        Path(f"/proc/{child}/stat").exists()
        and Path(f"/proc/{child}/stat").read_text().rsplit(")", 1)[1].split()[0] == "Z"
    )


def test_shards_at_the_same_time_one_of_them_killed(server, undisturbed, tmp_path):
    """Two jobs share the folder; one is killed and started again while the other works."""
    folder = tmp_path / "out"
    other = server.start(*arguments(server, folder, "--shard", "1/2"), pause=0.02)
    child = server.start(*arguments(server, folder, "--shard", "0/2"), pause=0.02)
    wait_for(lambda: committed(folder) >= 3)
    os.kill(child, signal.SIGKILL)
    assert server.end(child)[0] == -signal.SIGKILL
    code, text = server.run(*arguments(server, folder, "--shard", "0/2"))
    assert code == 0, text
    code, text = server.end(other)
    assert code == 0, text
    code, text = server.run("resume", folder, "--threads", 1, "--progress", "none")
    assert code == 0, text
    as_if_undisturbed(folder, undisturbed)


# -- processes -------------------------------------------------------------------------------------
def workers_of(process):
    """The workers that a run has started."""
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            parent = int(stat.read_text().rsplit(")", 1)[1].split()[1])
            if parent == process and b"spawn_main" in (stat.parent / "cmdline").read_bytes():
                found.append(int(stat.parent.name))
    return sorted(found)


def with_workers(server, folder, count, pause):
    return server.start(
        "run", server.study, "--out", folder, "--workers", count, "--progress", "none", pause=pause
    )


def test_the_only_worker_killed(server, undisturbed, tmp_path):
    """Its successor finishes; at the very least a message says what to do."""
    run = with_workers(server, tmp_path / "out", 1, 0.08)
    wait_for(lambda: committed(tmp_path / "out") >= 3)
    os.kill(*workers_of(run), signal.SIGKILL)
    code, text = server.end(run)
    assert "Traceback" not in text
    assert code == 0, text
    as_if_undisturbed(tmp_path / "out", undisturbed)


def family(process):
    """The process and all that descend from it."""
    parents = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            parents[int(stat.parent.name)] = int(stat.read_text().rsplit(")", 1)[1].split()[1])
    found, more = {process}, True
    while more:
        more = {child for child, parent in parents.items() if parent in found} - found
        found |= more
    return found


def sockets_of(processes):
    """Numbers of the sockets that processes hold."""
    found = set()
    for process in processes:
        for link in Path(f"/proc/{process}/fd").glob("*"):
            with suppress(OSError):
                found |= set(re.findall(r"^socket:\[(\d+)\]$", os.readlink(link)))
    return found


def listening(sockets):
    """Those of the sockets that wait for connections, by any protocol."""
    tcp = [
        line.split()
        for name in ("tcp", "tcp6")
        for line in Path(f"/proc/net/{name}").read_text().splitlines()[1:]
    ]
    local = [line.split() for line in Path("/proc/net/unix").read_text().splitlines()[1:]]
    udp = [
        line.split()
        for name in ("udp", "udp6")
        for line in Path(f"/proc/net/{name}").read_text().splitlines()[1:]
    ]
    waiting = (
        {row[9] for row in tcp if row[3] == "0A"}
        | {row[6] for row in local if row[3] == "00010000"}
        | {row[9] for row in udp}
    )
    return waiting & sockets


@pytest.mark.skipif(not Path("/proc/net/tcp").exists(), reason="looks into /proc")
def test_two_workers_listen_nowhere_and_one_of_them_is_killed(server, undisturbed, tmp_path):
    """Nobody else can hand them work: no socket of the run waits for a connection, on any port or
    path. The other one and a successor finish, with the bits of one thread.
    """
    with socket.create_server(("127.0.0.1", 0)):
        assert listening(sockets_of([os.getpid()])), "it would be seen"
    run = with_workers(server, tmp_path / "out", 2, 0.08)
    wait_for(lambda: committed(tmp_path / "out") >= 3)
    workers, processes = workers_of(run), family(run)
    assert len(workers) == 2
    assert {run, *workers} <= processes
    assert listening(sockets_of(processes)) == set()
    os.kill(workers[0], signal.SIGKILL)
    at = committed(tmp_path / "out")
    code, text = server.end(run)
    assert code == 0, text
    assert "Traceback" not in text
    assert at < CHUNKS - 4, "it was killed while there was work to do"
    as_if_undisturbed(tmp_path / "out", undisturbed)


def test_ctrl_c_with_workers(server, undisturbed, tmp_path):
    """As a terminal sends it, to all of them: one message, no process left behind, nothing lost."""
    folder = tmp_path / "out"
    run = with_workers(server, folder, 2, 0.05)
    wait_for(lambda: committed(folder) >= 3)
    processes = family(run)
    os.killpg(run, signal.SIGINT)
    code, text = server.end(run)
    assert code == 130, text
    assert text.count("saltus: stopped") == 2, text  # what to type; and that files are whole
    assert "Traceback" not in text
    wait_for(
        lambda: not [one for one in processes if Path(f"/proc/{one}").exists() and not ended(one)]
    )
    code, text = server.run("resume", folder, "--threads", 1, "--progress", "none")
    assert code == 0, text
    as_if_undisturbed(folder, undisturbed)


MASK = """
import signal
from multiprocessing import resource_tracker
from saltus.study.run.processes import _without_ctrl_c
with _without_ctrl_c():
    resource_tracker.getfd()  # as the start of a process does
    print(signal.SIGINT in signal.pthread_sigmask(signal.SIG_BLOCK, ()))
"""


def test_no_process_sees_ctrl_c_from_its_first_moment_on():
    """What multiprocessing starts beside the first process unblocks the signal: a worker that still
    started ended in a traceback.
    """
    assert (
        subprocess.run(
            [sys.executable, "-c", MASK], capture_output=True, text=True, check=True
        ).stdout
        == "True\n"
    )


# -- Ctrl-C ----------------------------------------------------------------------------------------
@pytest.mark.parametrize("goal", [0, 5, CHUNKS])
def test_ctrl_c(server, undisturbed, tmp_path, goal):
    """While attractors are looked for, between chunks, while results are made: a message, exit code
    130, nothing lost.
    """
    folder = tmp_path / "out"
    child = server.start(*arguments(server, folder), pause=0.02, pictures=True)
    wait_for(lambda: (folder / "study.toml").exists() and committed(folder) >= goal)
    time.sleep(0.05)
    os.kill(child, signal.SIGINT)
    code, text = server.end(child)
    assert code == 130, text
    assert "saltus: stopped." in text
    assert "Traceback" not in text
    assert committed(folder) >= goal
    assert committed(folder) < CHUNKS or goal == CHUNKS
    assert not list((folder / "stores" / "basins" / "parts").iterdir())
    assert f"{committed(folder)} of {CHUNKS}" in server.run("status", folder)[1]
    code, text = server.run("resume", folder, "--threads", 1, "--progress", "none")
    assert code == 0, text
    as_if_undisturbed(folder, undisturbed)


# -- a full disk -----------------------------------------------------------------------------------
@pytest.fixture
def small_disk(tmp_path):
    """A function that makes a file system of so many kB, if this machine lets us make one."""
    place = tmp_path / "disk"
    place.mkdir()

    def make(size):
        mounted = sys.platform == "linux" and subprocess.run(
            ["mount", "-t", "tmpfs", "-o", f"size={size}k", "tmpfs", str(place)],
            capture_output=True,
            check=False,
        )
        if not mounted or mounted.returncode:
            pytest.skip("mounting a small file system needs rights that this user doesn't have")
        return place

    yield make
    if os.path.ismount(place):
        subprocess.run(["umount", str(place)], check=True)


def test_full_disk(server, undisturbed, small_disk):
    """Full amid the chunks: a message, what is done stays; with room again it goes on."""
    disk = small_disk(2400)
    (disk / "ballast").write_bytes(b"\0" * 2_360_000)
    code, text = server.run(*arguments(server, disk / "out"))
    assert code == 2, text
    assert "No space left on device" in text
    assert "Traceback" not in text
    assert 0 < committed(disk / "out") < CHUNKS
    assert Store.open(disk / "out" / "stores" / "basins").damaged() == []
    assert server.run("status", disk / "out")[0] == 0, "looking needs no room"
    (disk / "ballast").unlink()
    code, text = server.run("resume", disk / "out", "--threads", 1, "--progress", "none")
    assert code == 0, text
    as_if_undisturbed(disk / "out", undisturbed)


def test_full_disk_leaves_no_half_picture(server, small_disk):
    """As the message says: files are written in full or not at all."""
    disk = small_disk(1400)
    code, text = server.run(*arguments(server, disk / "out"))
    assert code == 0, text
    for file in disk.glob("out/basins*"):
        file.unlink()
    free = os.statvfs(disk).f_bavail * os.statvfs(disk).f_bsize
    # room for map and table, not for the picture
    (disk / "ballast").write_bytes(b"\0" * (free - 80_000))
    code, text = server.run(
        "resume", disk / "out", "--threads", 1, "--progress", "none", pictures=True
    )
    assert code == 2, text
    assert "No space left on device" in text
    assert load(disk / "out" / "basins.nc").sizes["attractor"] == 4
    for picture in disk.glob("out/*.png"):
        matplotlib.image.imread(picture)


# -- damage, other studies, other processes --------------------------------------------------------
@pytest.fixture(scope="module")
def killed_half_way(server, tmp_path_factory):
    """A folder whose run was killed after five chunks."""
    folder = tmp_path_factory.mktemp("half") / "out"
    child = server.start(*arguments(server, folder), pause=0.02)
    wait_for(lambda: committed(folder) >= 5)
    os.kill(child, signal.SIGKILL)
    assert server.end(child)[0] == -signal.SIGKILL
    return folder


@pytest.fixture
def half(killed_half_way, tmp_path):
    """A copy of it for one test."""
    return shutil.copytree(killed_half_way, tmp_path / "out", symlinks=True)


def test_a_cut_and_a_flipped_chunk_are_computed_again(server, undisturbed, half):
    store = Store.open(half / "stores" / "basins")
    first, second, *_ = map(int, np.flatnonzero(store.done()))
    cut, flipped = (store.path / "chunks" / f"{index}.chunk" for index in (first, second))
    cut.write_bytes(cut.read_bytes()[:100])
    data = bytearray(flipped.read_bytes())
    data[7] ^= 1
    flipped.write_bytes(bytes(data))
    assert store.damaged() == [first, second]
    code, text = server.run("resume", half, "--threads", 1, "--progress", "bar")
    assert code == 0, text
    assert "damaged chunks that are computed again: 2" in text
    as_if_undisturbed(half, undisturbed)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('"4 N"', '"4.5 N"', "values was"),
        ("count = 24", "count = 25", "axes was"),
        ("[basins]", '[method]\nname = "ODE45"\n[basins]', "method was 'Taylor', is 'ODE45'"),
    ],
)
def test_a_changed_study_is_refused(server, half, tmp_path, old, new, told):
    before = contents(half)
    (tmp_path / "other.toml").write_text(STUDY.replace(old, new))
    code, text = server.run("run", tmp_path / "other.toml", "--out", half, "--progress", "none")
    assert code == 2
    assert "was made from something else" in text
    assert told in text
    assert contents(half) == before
    assert (half / "study.toml").read_text() == STUDY


def test_a_second_process_is_refused(server, undisturbed, tmp_path, monkeypatch):
    """While the first works, which is halted for a moment here; it isn't disturbed."""
    folder = tmp_path / "out"
    first = server.start(*arguments(server, folder), pause=0.02)
    wait_for(lambda: committed(folder) >= 2)
    os.kill(first, signal.SIGSTOP)
    assert committed(folder) < CHUNKS
    monkeypatch.setattr(pipeline, "CHUNK", 24)
    second = CliRunner().invoke(
        app, ["resume", str(folder), "--threads", "1", "--progress", "none"], catch_exceptions=False
    )
    seen = CliRunner().invoke(app, ["status", str(folder)], catch_exceptions=False)
    os.kill(first, signal.SIGCONT)
    assert second.exit_code == 2, second.output
    assert f"is being written by process {first} on" in second.stderr
    assert "Wait for it, stop it, or choose another path." in second.stderr
    assert f"process {first} on" in seen.stdout, "status needs no lock"
    code, text = server.end(first)
    assert code == 0, text
    as_if_undisturbed(folder, undisturbed)


# -- a poison cell ---------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def small_chunks():
    with small_maps(48):
        yield


@pytest.fixture(scope="module")
def mapped(small_chunks, tmp_path_factory):
    """A function that computes the map by a method, in the same chunks and with the same attractors
    each time.
    """
    (job,) = maps_of(parse(STUDY.replace("count = 24", "count = 12")))
    found = job.plan.scout(1)

    def run(method):
        one = copy(job)
        one.plan = replace(job.plan, method=method)
        store = open_store(one, tmp_path_factory.mktemp("mapped"))
        with store.lock():
            store.put("attractors", found_data(found))
        assert compute(one, store, Resources(threads=1), lambda _: None, print)
        return finish(one, store, 1)

    return run


@pytest.fixture(scope="module")
def healthy(mapped):
    """The same function, which computes each map once."""
    return cache(mapped)


@pytest.fixture
def poisoned(mapped, monkeypatch):
    """The same function, with one start replaced."""
    whole = BasinPlan.starts

    def run(method, cell, start):
        def starts(self, cells):
            states = whole(self, cells)
            states[cells == cell] = start
            return states

        monkeypatch.setattr(BasinPlan, "starts", starts)
        return mapped(method)

    return run


@pytest.mark.parametrize(
    ("start", "method", "label", "status"),
    [
        ((1e200, 0.0), sl.Taylor(), -1, st.NONFINITE),
        ((0.0, 1e300), sl.Taylor(), -1, st.NONFINITE),
        ((np.nan, 0.0), sl.Taylor(), -3, st.INVALID),
        ((np.inf, 0.0), sl.Taylor(), -3, st.INVALID),
        ((1e3, 0.0), sl.Taylor(max_steps=3000), -3, st.BUDGET_STEPS),
        ((1e200, 0.0), sl.ODE45(rtol=1e-4, atol=1e-7), -1, st.NONFINITE),
    ],
)
@pytest.mark.parametrize("cell", [70, 96])
def test_a_poison_cell_hurts_only_itself(healthy, poisoned, start, method, label, status, cell):
    """A start that overflows, isn't a number, or never gets anywhere has a code; all other cells
    are those of a map without it.
    """
    healthy_, poisoned_ = healthy(method), poisoned(method, cell, start)
    here = np.unravel_index(cell, healthy_.basin.shape)
    assert int(poisoned_.basin.values[here]) == label
    assert int(poisoned_.status.values[here]) == status
    assert int(poisoned_.periods_to_settle.values[here]) == -1
    for name in ("basin", "status", "periods_to_settle", "grazes_unresolved"):
        mended = poisoned_[name].values.copy()
        mended[here] = healthy_[name].values[here]
        np.testing.assert_array_equal(mended, healthy_[name].values)
    for name in ("attractor_period", "attractor_peak", "attractor_x"):
        np.testing.assert_array_equal(poisoned_[name], healthy_[name])
    assert poisoned_.attrs["unsettled_cells"] == healthy_.attrs["unsettled_cells"] + 1
    told = (
        f"{int((poisoned_.basin == label).sum())} starts {'escaped' if label == -1 else 'failed'}:"
    )
    assert told in " ".join(rows("a", poisoned_)[0].notes)
