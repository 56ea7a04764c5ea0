"""Chunks by processes and by a cluster: one loop for both, workers that die, workers that fail."""

from __future__ import annotations

import sys
from concurrent.futures import Future

import pytest

from fated_plan import Plan
from saltus.errors import StudyError
from saltus.study.run import cluster, processes


class Client:
    """A dask client whose workers are lost so many times."""

    def __init__(self, lost=0, workers=1):
        self.lost, self.workers = lost, workers

    def wait_for_workers(self, count, timeout):
        if self.workers < count:
            raise TimeoutError(timeout)

    def scheduler_info(self):
        return {"workers": dict.fromkeys(range(self.workers))}

    def get_executor(self, pure):
        assert not pure, "a chunk that is asked for again must be computed again"
        return self

    def submit(self, function, *arguments):
        future = Future()
        self.lost -= 1
        if self.lost >= 0:
            future.cancel()
            future.set_running_or_notify_cancel()
        else:
            future.set_result(function(*arguments))
        return future


def by_processes(plan, keep, show):
    processes.run_on_processes(1, plan, 10, [3, 4], keep, show)


def by_cluster(plan, keep, show):
    cluster._run(Client(), plan, 10, [3, 4], keep, show)


@pytest.mark.parametrize("run", [by_processes, by_cluster])
def test_every_chunk_is_kept_by_this_thread_and_shown(run):
    kept, shares = {}, []
    run(Plan(), kept.__setitem__, shares.append)
    assert kept == {3: 30, 4: 40}
    assert shares[-1] == 1.0


@pytest.mark.parametrize("run", ["by_processes", "by_cluster"])
def test_threads_processes_and_cluster_share_one_loop(run, monkeypatch):
    handed = []
    for module in (processes, cluster):
        monkeypatch.setattr(module, "on_threads", lambda _, items, *__: handed.append(items))
    globals()[run](Plan(), None, None)
    assert handed == [[3, 4]]


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX")
def test_processes_that_die_again_and_again_are_reported(monkeypatch):
    monkeypatch.setattr(processes, "MAX_TRIES", 2)
    with pytest.raises(StudyError, match=r"chunk 3 failed in 2 processes.*with code -9"):
        processes.run_on_processes(1, Plan("killed"), 10, [3], None, lambda _: None)


def test_what_goes_wrong_in_a_process_is_reported():
    with pytest.raises(StudyError, match=r"chunk 3 .*ZeroDivisionError: a chunk without cells"):
        processes.run_on_processes(1, Plan("fails"), 10, [3], None, lambda _: None)


def test_a_chunk_that_a_cluster_loses_is_asked_for_again():
    assert cluster._chunk(Client(lost=cluster.MAX_TRIES - 1), Plan(), 10, 3) == 30
    with pytest.raises(StudyError, match=r"chunk 3 failed on 6 workers.*CancelledError"):
        cluster._chunk(Client(lost=cluster.MAX_TRIES), Plan(), 10, 3)


def test_a_cluster_without_workers_is_reported():
    with pytest.raises(StudyError, match="the scheduler has no workers"):
        cluster._run(Client(workers=0), Plan(), 10, [3], None, None)


def test_a_scheduler_without_a_secret_is_told_in_a_line():
    pytest.importorskip("distributed")
    told = cluster.open_to_all("tcp://node7:8786")
    assert "tcp://node7:8786 asks for no secret" in told
    assert "\n" not in told
    assert cluster.open_to_all("tls://node7:8786") == ""
