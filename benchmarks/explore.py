"""What the explorer answers, and when: clicks, a slider, maps, stops and memory of its server.

Case b4 of the deLangre rig at 15 Hz. The server is a process of its own, as `saltus explore` starts
it; this one is the page, and reads every frame without drawing it. CPU time is the server's.

    python benchmarks/explore.py               the table
    python benchmarks/explore.py --size 400    a map of 400 x 400
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from argparse import ArgumentParser
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from websockets.sync.client import ClientConnection, connect

import saltus as sl
from saltus.explore.frames import unpacked

BOX = {"x": [-5e-3, 5e-3], "v": [-1.0, 1.0]}
ARGUMENTS = ("delangre", "case=b", "force=4 N", "frequency=15 Hz", "--no-browser")
CLICKS = 100
#: Time between two questions [s]: the server refuses more than 200 a second.
PACE = 0.006
TICK = os.sysconf("SC_CLK_TCK")


class Page:
    """A page without a picture.

    Parameters
    ----------
    line : ClientConnection
        Its socket.
    process : int
        The server's number.
    """

    def __init__(self, line: ClientConnection, process: int) -> None:
        self.line, self.process, self._next = line, process, 0

    def ask(self, ask: str, **fields: Any) -> int:
        """Send a question; its number."""
        self._next += 1
        self.line.send(json.dumps({"ask": ask, "id": self._next, **fields}))
        return self._next

    def answers(self, number: int) -> Iterator[tuple[dict[str, Any], int]]:
        """Heads of the answers to a question, with the bytes of each."""
        while True:
            frame = self.line.recv()
            head, _ = unpacked(frame)  # type: ignore[arg-type]
            if head["kind"] == "map-piece":
                self.line.send(json.dumps({"ask": "seen", "id": head["id"]}))
            if head["id"] == number:
                yield head, len(frame)
            if head["id"] == number and head["kind"] in LAST:
                return

    def cpu(self) -> float:
        """CPU time of the server so far [s]."""
        with open(f"/proc/{self.process}/stat") as stat:
            fields = stat.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / TICK

    def memory(self) -> float:
        """Memory of the server [MB]."""
        with open(f"/proc/{self.process}/status") as status:
            (line,) = [line for line in status if line.startswith("VmRSS")]
        return int(line.split()[1]) / 1024


#: Kinds that end the answers to a question.
LAST = (
    "hello", "about", "motion", "settle", "track", "orbit", "save", "map-end", "map-stopped",
    "stopped", "refused", "failed",
)  # fmt: skip


@contextmanager
def opened() -> Iterator[tuple[Page, float]]:
    """A page, and the seconds until its address was printed."""
    begun = time.perf_counter()
    with subprocess.Popen(
        [sys.executable, "-m", "saltus", "explore", *ARGUMENTS], stdout=subprocess.PIPE, text=True
    ) as server:
        assert server.stdout is not None
        url = server.stdout.readline().strip()
        took = time.perf_counter() - begun
        port, token = url.split(":")[2].split("/")[0], url.partition("token=")[2]
        with connect(f"ws://127.0.0.1:{port}/socket", max_size=None) as line:
            page = Page(line, server.pid)
            list(page.answers(page.ask("hello", token=token, wire=1)))
            yield page, took
        server.terminate()


def clicks(page: Page, ask: str, fields: Callable[[int], dict[str, Any]]) -> str:
    """Median and 95th percentile of the wall time of questions, and CPU time of each [ms]."""
    waits, begun, size = [], page.cpu(), 0
    for number in range(CLICKS):
        time.sleep(PACE)
        start = time.perf_counter()
        for _, count in page.answers(page.ask(ask, **fields(number))):
            size = count
        waits.append(1e3 * (time.perf_counter() - start))
    middle, most = np.quantile(waits, [0.5, 0.95])
    cpu = 1e3 * (page.cpu() - begun) / CLICKS
    return f"{middle:6.1f} {most:6.1f} {cpu:6.1f}   {size} bytes"


def a_map(page: Page, **fields: Any) -> str:
    """Seconds until the first cells and the end, CPU time [s] and bytes of a map."""
    start, begun, first, size = time.perf_counter(), page.cpu(), 0.0, 0
    for head, count in page.answers(page.ask("map", **{"axes": BOX, **fields})):
        size += count
        if head["kind"] == "map-piece" and not first:
            first = time.perf_counter() - start
    took = time.perf_counter() - start
    return f"{first:6.2f} {took:6.2f} {page.cpu() - begun:6.2f}   {size} bytes"


def stops(page: Page, size: int) -> str:
    """Median and worst wall time from stop to the end of a map [ms]."""
    waits = []
    for number in range(10):
        values = {"frequency": 15.0 + 0.01 * (number + 1)}
        map_ = page.ask("map", axes=BOX, size=[size, size], values=values)
        for head, _ in page.answers(map_):
            if head["kind"] == "map-piece":
                break
        start = time.perf_counter()
        page.ask("stop")
        list(page.answers(map_))
        waits.append(1e3 * (time.perf_counter() - start))
    return f"{np.median(waits):6.1f} {max(waits):6.1f}"


def main() -> None:
    parser = ArgumentParser()
    parser.add_argument("--size", type=int, default=100)
    size = parser.parse_args().size
    draw = np.random.default_rng(0)
    at = [{"x": x, "v": v} for x, v in draw.uniform(-1, 1, (CLICKS, 2)) * [2e-3, 0.2]]
    with opened() as (page, took):
        print(f"address printed after {took:.1f} s")
        list(page.answers(page.ask("motion", start=at[0])))
        print("                            median   95 %    CPU [ms]")
        for errors in ("local", "measured"):
            told = clicks(page, "motion", lambda i, e=errors: {"start": at[i], "errors": e})
            print(f"click, {errors:8} errors      {told}")
        slider = {"start": at[0], "errors": "local"}
        told = clicks(page, "motion", lambda i: slider | {"values": {"force": 3.5 + 0.01 * i}})
        print(f"slider, motion              {told}")
        begin = {"x": "1 mm", "v": 0}
        (settled,) = [head for head, _ in page.answers(page.ask("settle", start=begin))]
        key = settled["attractor"]["key"]
        told = clicks(
            page, "track",
            lambda i: {"key": key, "source": {}, "values": {"frequency": 15 + 2e-4 * i}},
        )  # fmt: skip
        print(f"slider, tracked orbit       {told}")
        print("                             first    all    CPU [s]")
        print(f"map {size} x {size}               {a_map(page, size=[size, size])}")
        zoomed = {"x": [-1e-3, 1.5e-3], "v": [-0.1, 0.1]}
        print(f"zoomed                      {a_map(page, size=[size, size], axes=zoomed)}")
        coarse = {"size": [size, size], "coarse": True}
        print(f"new values, coarse          {a_map(page, values={'frequency': 15.05}, **coarse)}")
        print("                            median  worst [ms]")
        print(f"stop of a map               {stops(page, 4 * size)}")
        print(f"memory of the server        {page.memory():6.0f} MB")
    rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    begun = time.process_time()
    sl.basins(rig, **{name: (*ends, size) for name, ends in BOX.items()}, progress=False)
    print(f"sl.basins of the map               CPU {time.process_time() - begun:6.2f} s")


if __name__ == "__main__":
    main()
