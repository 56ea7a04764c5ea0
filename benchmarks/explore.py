"""What the explorer costs, beside the bars that it was built to: a prototype's numbers, and goals.

The rig b4 at 15 Hz, x in [-5, 5] mm, v in [-1, 1] m/s. The prototype ran on two busy cores; its
column is for orientation. The server is a process of its own, as `saltus explore` starts it; most
rows are what a page without a picture hears of it, over its socket. The last ones drive the
system's Chromium (SALTUS_CHROMIUM names another one), drawing by software; without a browser they
are left out. CPU time is the server's.

    python benchmarks/explore.py            all but the large map
    python benchmarks/explore.py --large    with 400 x 400 starts, beside sl.basins: two minutes
    python benchmarks/explore.py --desk     without a browser
"""

from __future__ import annotations

import argparse
import gzip
import json
import os
import shutil
import subprocess
import sys
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from websockets.extensions.permessage_deflate import PerMessageDeflate
from websockets.frames import Frame, Opcode
from websockets.sync.client import ClientConnection, connect

import saltus as sl
from saltus.cli.doctor import processor
from saltus.explore.frames import unpacked
from saltus.flow import engine

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "tests")]

from benchmarks.structures import structure  # noqa: E402

RIG = sl.models.delangre("b", force="4 N", frequency="15 Hz")
BOX = {"x": [-5e-3, 5e-3], "v": [-1.0, 1.0]}
#: A beam of ten modes with two stops, seen by sensors.
BEAM = structure(
    10,
    2,
    sensors={
        "tip": "w30",
        "tip speed": sl.velocity("w30"),
        "stop force": sl.contact_force("stop_30"),
    },
)
CLICKS = 40
#: Time between two questions [s]: the server refuses more than 200 a second.
PACE = 0.006
TICK = os.sysconf("SC_CLK_TCK")
#: The same rig on the command line.
COMMAND = ("delangre", "case=b", "force=4 N", "frequency=15 Hz")
#: Chromium draws by software, as in the tests.
DRAWING = (
    "--disable-gpu-compositing", "--disable-gpu-rasterization", "--disable-accelerated-2d-canvas",
    "--no-sandbox",
)  # fmt: skip


#: Bytes of frames on the line, compressed or not, until they are read.
WEIGHED: deque[int] = deque()


def weighed(
    self: PerMessageDeflate,
    frame: Frame,
    decode: Callable[..., Frame] = PerMessageDeflate.decode,
    **named: Any,
) -> Frame:
    """A frame as it was before it was compressed, once it is weighed."""
    if frame.opcode is Opcode.BINARY:
        WEIGHED.append(len(frame.data))
    return decode(self, frame, **named)


PerMessageDeflate.decode = weighed  # type: ignore[method-assign]


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
        """Heads of the answers to a question, with the bytes of each on the line."""
        while True:
            frame = self.line.recv()
            head, _ = unpacked(frame)  # type: ignore[arg-type]
            size = WEIGHED.popleft()
            if head["kind"] == "map-piece":
                self.line.send(json.dumps({"ask": "seen", "id": head["id"]}))
            if head["id"] == number:
                yield head, size
            if head["id"] == number and head["kind"] in FAILED:
                raise RuntimeError(head["why"])
            if head["id"] == number and head["kind"] in LAST and head.get("done", True):
                return

    def one(self, ask: str, **fields: Any) -> tuple[dict[str, Any], int]:
        """The last answer to a question, and its bytes."""
        time.sleep(PACE)
        return list(self.answers(self.ask(ask, **fields)))[-1]

    def cpu(self) -> float:
        """CPU time of the server so far [s]."""
        with open(f"/proc/{self.process}/stat") as stat:
            fields = stat.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / TICK

    def threads(self) -> int:
        """Threads of the server."""
        return len(os.listdir(f"/proc/{self.process}/task"))

    def memory(self) -> float:
        """Memory of the server [MB]."""
        with open(f"/proc/{self.process}/status") as status:
            (line,) = [line for line in status if line.startswith("VmRSS")]
        return int(line.split()[1]) / 1024


#: Kinds that end the answers to a question.
LAST = (
    "hello", "about", "motion", "settle", "track", "orbit", "responses", "save", "map-end",
    "map-stopped", "stopped",
)  # fmt: skip
FAILED = ("refused", "failed")


@contextmanager
def served(*system: str) -> Iterator[tuple[Page, float]]:
    """A page of a system, and the seconds until its address was printed."""
    begun = time.perf_counter()
    with subprocess.Popen(
        [sys.executable, "-m", "saltus", "explore", *system, "--no-browser"],
        stdout=subprocess.PIPE,
        text=True,
    ) as server:
        assert server.stdout is not None
        url = server.stdout.readline().strip()
        took = time.perf_counter() - begun
        port, token = url.split(":")[2].split("/")[0], url.partition("token=")[2]
        with connect(f"ws://127.0.0.1:{port}/socket", max_size=None) as line:
            page = Page(line, server.pid)
            list(page.answers(page.ask("hello", token=token, wire=2)))
            yield page, took
        server.terminate()


def row(name: str, ours: str, prototype: str, goal: str) -> None:
    """Print a row of the table."""
    print(f"| {name:<62} | {ours:>26} | {prototype:>20} | {goal:>18} |", flush=True)


def spread(times: list[float]) -> str:
    """Median and 95th percentile, in milliseconds."""
    return f"{1e3 * np.median(times):.0f}, {1e3 * np.quantile(times, 0.95):.0f} ms"


def timed(work: Callable[[], Any], clock: Callable[[], float]) -> float:
    """Seconds of a piece of work."""
    begun = clock()
    work()
    return clock() - begun


def a_click(starts: np.ndarray) -> None:
    """CPU time of the work behind a click, by part."""

    def cpu(**how: Any) -> float:
        each = [
            timed(
                lambda s=s: sl.simulate(RIG, s, periods=60, progress=False, **how),
                time.process_time,
            )
            for s in starts
        ]
        return 1e3 * float(np.median(each))

    cpu()
    spent: list[float] = []
    run = engine.run

    def counted(*given: Any, **named: Any) -> Any:
        begun = time.process_time()
        try:
            return run(*given, **named)
        finally:
            spent.append(time.process_time() - begun)

    local, measured = cpu(time_errors="local"), cpu()
    engine.run = counted
    try:
        cpu(time_errors="local")
    finally:
        engine.run = run
    row(
        "CPU of sl.simulate a click: local errors, measured; the engine",
        f"{local:.1f}, {measured:.1f}; {1e3 * float(np.median(spent)):.1f} ms",
        "2.8, 4.2; 1.1 ms", "2, 3 ms",
    )  # fmt: skip


def motions(page: Page, starts: np.ndarray) -> None:
    """Bytes and times of answers."""
    size = np.median([page.one("motion", start=s.tolist())[1] for s in starts[:10]])
    begun = time.perf_counter()
    _, long = page.one("motion", start=starts[0].tolist(), periods=1000)
    row(
        "bytes a click; a click of 1000 periods",
        f"{size:.0f}; {long / 1e6:.2f} MB, {1e3 * (time.perf_counter() - begun):.0f} ms",
        "111640; 1.85 MB, 170", "112000; 150 ms",
    )  # fmt: skip


def a_map(page: Page, n: int, box: dict[str, list[float]] = BOX, **fields: Any) -> dict[str, float]:
    """Wall and CPU time of a map, of its first cells, and its bytes."""
    begun, cpu = time.perf_counter(), page.cpu()
    found = {"bytes": 0.0}
    for head, size in page.answers(page.ask("map", axes=box, size=[n, n], **fields)):
        found["bytes"] += size
        if head["kind"] == "map-piece":
            found.setdefault("first", time.perf_counter() - begun)
    return found | {"wall": time.perf_counter() - begun, "cpu": page.cpu() - cpu}


def maps(large: bool) -> None:
    """How soon maps begin and end."""
    with served(*COMMAND) as (page, _):
        nothing = a_map(page, 25)["first"]
        known = a_map(page, 26)["first"]
        zoomed = a_map(page, 25, {"x": [0, 2e-3], "v": [-0.2, 0.2]})["first"]
        values = [
            a_map(page, 25, values={"frequency": 15 + 0.05 * k}, coarse=True)["first"]
            for k in range(1, 9)
        ]
    row(
        "first cells: nothing known; attractors known; zoomed",
        f"{nothing:.2f}; {known:.2f}; {zoomed:.2f} s", "1.3; 0.06; 0.07 s", "0.5; 0.06; 0.07 s",
    )  # fmt: skip
    row(
        "first cells at new values, median and worst",
        f"{np.median(values):.2f}, {max(values):.2f} s", "0.32, 2.5 s", "0.2, 0.5 s",
    )  # fmt: skip
    sizes = (25, 100, 400) if large else (25, 100)
    with served(*COMMAND) as (page, _):
        a_map(page, 16)
        done = [a_map(page, n) for n in sizes]
    theirs = timed(
        lambda: sl.basins(
            RIG, x=(*BOX["x"], sizes[-1]), v=(*BOX["v"], sizes[-1]), progress=False
        ),
        time.process_time,
    )  # fmt: skip
    row(
        " and ".join(f"{n} x {n}" for n in sizes) + " complete",
        ", ".join(f"{one['wall']:.1f}" for one in done) + " s", "0.9, 2.3, 28 s", "0.6, 2 s",
    )  # fmt: skip
    row(
        f"CPU of {sizes[-1]} x {sizes[-1]}; of sl.basins, which finds its attractors too",
        f"{done[-1]['cpu']:.1f}; {theirs:.1f} s", "30.9; 31.9 s", "1.0 times",
    )  # fmt: skip
    row(
        f"bytes of a {sizes[-1]} x {sizes[-1]} map",
        f"{done[-1]['bytes'] / 1e6:.2f} MB, {done[-1]['bytes'] / sizes[-1] ** 2:.1f} a cell",
        "1.13 MB, 7 a cell", "2 a cell",
    )  # fmt: skip


def stops(page: Page) -> None:
    """How soon work ends that is asked to."""
    waited = []
    for k in range(8):
        number = page.ask("map", axes=BOX, size=[400, 400], values={"force": 3 + 0.1 * k})
        time.sleep(0.3 + 0.1 * k)
        begun = time.perf_counter()
        page.ask("stop", of="map")
        for _ in page.answers(number):
            pass
        waited.append(time.perf_counter() - begun)
    row("stop asked -> ended, worst", f"{1e3 * max(waited):.0f} ms", "54 ms", "60 ms")


def orbits(page: Page) -> None:
    """Orbits of the points of a branch."""
    number = page.ask("responses", parameter="frequency", range=["12 Hz", "18 Hz"])
    begun, first, head = time.perf_counter(), 0.0, {}
    for head, _ in page.answers(number):
        if head["kind"] == "responses":
            first = first or time.perf_counter() - begun
    row(
        "responses from 12 to 18 Hz: first branches, all",
        f"{first:.1f}, {time.perf_counter() - begun:.1f} s", "7.3 s, all at the end",
        "points as found",
    )  # fmt: skip
    times = [
        timed(partial(page.one, "orbit", responses=head["key"], point=point), time.perf_counter)
        for point in range(0, 200, 7)
    ]
    row("orbit of a branch point, median and p95", spread(times), "33 ms", "50 ms")


def models() -> None:
    """A click on some models, after the first one."""
    first, later = [], []
    for name in ("delangre", "impact_oscillator", "gear_pair", "jeffcott_rotor", "play", "chain"):
        start = [0.0] * len(getattr(sl.models, name)().states)
        with served(name) as (page, _):
            for spent, many in ((first, 1), (later, 20)):
                begun = page.cpu()
                for _ in range(many):
                    page.one("motion", start=start)
                spent.append(1e3 * (page.cpu() - begun) / many)
    row(
        "CPU of a click on six models: later ones; the first",
        f"{min(later):.1f} to {max(later):.1f}; {max(first):.0f} ms", "2.6 to 16.6; 276 ms",
        "the same",
    )  # fmt: skip


def mixed(page: Page, seconds: float = 30.0) -> None:
    """Memory and threads over mixed questions, in two halves."""
    random, before, kept = np.random.default_rng(1), page.threads(), []
    for _ in range(2):
        end = time.monotonic() + seconds / 2
        while time.monotonic() < end:
            values = {"frequency": random.uniform(14, 16)}
            page.ask("map", axes=BOX, size=[100, 100], values=values)
            start = (random.uniform(-1, 1, 2) * (5e-3, 1.0)).tolist()
            page.one("motion", start=start, values=values)
            time.sleep(0.03)
        kept.append(page.memory())
    during = page.threads()
    page.ask("stop")
    time.sleep(1.0)
    idle = -page.cpu()
    time.sleep(1.0)
    idle += page.cpu()
    row(
        f"{seconds:.0f} s of mixed questions: memory; threads; CPU left over",
        f"{kept[0]:.0f}, {kept[1]:.0f} MB; {before}, {during}, {page.threads()}; {idle:.2f} s",
        "+23 MB; 11, 15, 11; 0.01", "no growth",
    )  # fmt: skip


def a_structure() -> None:
    """Clicks, and how soon maps begin, of the beam."""
    random = np.random.default_rng(1)
    with served(f"{__file__}:BEAM") as (page, _):
        box = {"tip": [-2e-3, 2e-3], "tip speed": [-0.5, 0.5]}
        tips = random.uniform(-1, 1, (CLICKS, 2)) * (2e-3, 0.5)
        starts = [dict(zip(box, tip, strict=True)) for tip in tips.tolist()]
        begun = page.cpu()
        times = [timed(partial(page.one, "motion", start=s), time.perf_counter) for s in starts]
        each = (page.cpu() - begun) / CLICKS
        begun, first = time.perf_counter(), 0.0
        for head, _ in page.answers(page.ask("map", axes=box, size=[100, 100])):
            if head["kind"] == "map-piece" and not first:
                first = time.perf_counter() - begun
                page.ask("stop", of="map")
    row(
        "beam, 10 modes, 2 stops, 3 sensors: click -> heard, median, p95",
        f"{spread(times)}; {1e3 * each:.0f} ms CPU", "-", "30, 50 ms",
    )  # fmt: skip
    row("the same: first cells, nothing known", f"{first:.2f} s", "-", "0.5 s")


def opening() -> None:
    """From the command to the printed address; the size of the page."""
    waited = []
    for _ in range(4):
        with served("delangre") as (_, took):
            waited.append(took)
    row(
        "saltus explore delangre -> address printed",
        f"{min(waited):.1f} s",
        "1.3 to 2.5 s",
        "1.2 s",
    )
    page = ROOT / "src" / "saltus" / "explore" / "page"
    size = sum(len(gzip.compress(file.read_bytes())) for file in page.iterdir())
    row("page, compressed", f"{size / 1e3:.1f} kB", "28.7 kB", "40 kB")


# -- in a browser ----------------------------------------------------------------------------------
def in_browser() -> None:
    """Clicks and drags as a person makes them."""
    chromium = os.environ.get("SALTUS_CHROMIUM") or next(
        filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
    )
    try:
        from playwright.sync_api import sync_playwright
    except ModuleNotFoundError:
        chromium = None
    if chromium is None:
        print("no Chromium, or no Playwright: the rows of the page are left out")
        return
    from explorer_page import opened

    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=chromium, args=list(DRAWING))
        with opened(RIG) as explorer:
            seen = shown(browser, explorer)
            row(
                "click -> drawn while a map is computed, median, p95",
                clicks(seen),
                "42, 81 ms",
                "40, 80 ms",
            )
            seen.patience = 300.0
            seen.rest()
            row("click -> drawn, idle, median, p95", clicks(seen), "31, 43 ms", "30, 50 ms")
            row("slider: motions a second", drags(seen), "32 to 39", "30 to 40")
            heap = seen.get("performance.memory ? performance.memory.usedJSHeapSize / 1e6 : NaN")
            row("heap of the page", f"{heap:.1f} MB", "7.8 MB", "30 MB")
        with opened(BEAM) as explorer:
            seen = shown(browser, explorer)
            row("beam: click -> drawn while a map is computed", clicks(seen), "-", "40, 80 ms")
            row("beam: slider, motions a second", drags(seen), "-", "30 to 40")
        browser.close()


def shown(browser: Any, explorer: sl.explore.Explorer) -> Any:
    """The page of an explorer with its first motion, watched."""
    from explorer_page import Seen

    seen = Seen(browser.new_page(viewport={"width": 1400, "height": 900}))
    seen.page.goto(explorer.url)
    seen.until("!!window.explorer && !!explorer.motion && !!explorer.map.sheet")
    seen.get(WATCH)
    return seen


#: In the page: the motions that were drawn, and the times from clicks until theirs were.
WATCH = """(() => {
  const told = window.told = { ids: new Set(), times: [], up: 0, before: -1 };
  addEventListener('pointerup', () => {
    told.up = performance.now(); told.before = explorer.motion.head.id;
  }, true);
  const tick = () => {
    const id = explorer.motion.head.id;
    told.ids.add(id);
    if (told.up && id !== told.before) {
      told.times.push(performance.now() - told.up); told.up = 0;
    }
    requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
})()"""


def clicks(seen: Any) -> str:
    """Times from clicks on the map until their motions are drawn."""
    random = np.random.default_rng(2)
    a, b, c, d = seen.get("explorer.map.sheet.box")
    seen.get("void (told.times = [])")
    for count in range(1, CLICKS + 1):
        x, v = random.uniform(0.9 * a, 0.9 * b), random.uniform(0.9 * c, 0.9 * d)
        seen.page.mouse.click(*seen.place("#map-canvas", x, v))
        while seen.get("told.times.length") < count:
            time.sleep(0.02)
    return spread([1e-3 * one for one in seen.get("told.times")])


#: In the page: a slider that moves in every frame, as under a finger; the motions drawn meanwhile.
#: Playwright's own mouse makes some 20 steps a second, which was what this row once measured.
DRAG = """seconds => new Promise(done => {
  const slider = document.querySelector('[aria-label=frequency][type=range]');
  const from = +slider.value, begun = performance.now();
  told.ids.clear();
  const step = () => {
    const t = (performance.now() - begun) / 1000;
    slider.value = from + 50 * Math.sin(4 * t);
    slider.dispatchEvent(new Event('input', { bubbles: true }));
    if (t < seconds) requestAnimationFrame(step);
    else { slider.dispatchEvent(new Event('change', { bubbles: true })); done(told.ids.size); }
  };
  step();
})"""


def drags(seen: Any) -> str:
    """Motions drawn in a second while a slider moves."""
    return f"{seen.get(DRAG, 5) / 5.0:.0f}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--large", action="store_true", help="a map of 400 x 400 too")
    parser.add_argument("--desk", action="store_true", help="without a browser")
    given = parser.parse_args()
    print(f"{processor()}, {os.cpu_count()} cores, saltus {sl.__version__}")
    row("", "here", "prototype", "goal")
    starts = np.random.default_rng(1).uniform(-1, 1, (CLICKS, 2)) * (5e-3, 1.0)
    a_click(starts)
    with served(*COMMAND) as (page, _):
        motions(page, starts)
        stops(page)
        orbits(page)
        mixed(page)
    maps(given.large)
    models()
    a_structure()
    opening()
    if not given.desk:
        in_browser()


if __name__ == "__main__":
    main()
