"""Attractors of starts, and orbits as the page draws them: one whole period, stable or not."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from saltus.analysis.attractors.find_attractors import find_attractors
from saltus.analysis.basins.labels import OPEN
from saltus.analysis.basins.labels import settle as follow
from saltus.analysis.closed.motions import ClosedMotion
from saltus.analysis.closed.track import track
from saltus.explore.attractors import Legend, pairs
from saltus.explore.frames import Answer
from saltus.explore.motion import AskedRun, motion
from saltus.flow.maps import Stroboscope
from saltus.flow.methods import Method
from saltus.interrupt import Interrupted, Stop, check_stop
from saltus.results.dataset.kinds import WITHOUT, Kind
from saltus.results.dataset.schema import kind_text
from saltus.system import System

#: Periods that a start is followed at most, as by sl.basins.
MOST_PERIODS = 2000
#: Time for which a start is followed on the page [s].
WITHIN = 20.0
#: Periods that are shown of an attractor that never repeats.
NEVER_REPEATS = 60


def settled(known: Legend, start: Sequence[float]) -> tuple[int, int]:
    """The key of the attractor that a start leads to, or a code of
    :class:`~saltus.results.dataset.kinds.Kind`, and the periods until it is captured (-1: it
    isn't). What nobody knew yet joins the known ones.
    """
    with known.lock:
        found, keys = known.found, known.keys()
    begin = np.array([start], float)
    followed = follow(known.map, begin, found, MOST_PERIODS)
    label, periods = int(followed.label[0]), int(followed.periods[0])
    if label != OPEN:
        return (int(keys[label]) if label >= 0 else label), periods
    wider, ids, _ = find_attractors(known.map, followed.end, known.scale, MOST_PERIODS, found)
    known.grow(wider)
    if ids[0] < 0:
        return int(Kind.UNCONVERGED), -1
    again = follow(known.map, begin, wider, MOST_PERIODS)
    return int(known.keys(wider)[ids[0]]), int(again.periods[0])


def settle(
    known: Legend, start: Sequence[float], method: Method, quantities: Sequence[str]
) -> Answer:
    """The attractor that a start settles to, and its orbit."""
    found = _in_time(lambda: settled(known, start))
    if found is None:
        words = f"This start hasn't settled within {WITHIN:g} s: it may never repeat."
        return nowhere(known.map.system, words, int(Kind.UNCONVERGED))
    key, periods = found
    unit = "periods" if known.map.system.forced_at is not None else "turns"
    if key < 0:
        return nowhere(known.map.system, f"This start {_fate(key)}.", key)
    head, arrays = attractor_orbit(known, key, method, quantities)
    words = f"settles to {_noun(head['attractor'])}"
    if periods >= 0:
        words += f" after {periods} {unit}"
    return {**head, "kind": "settle", "code": None, "settles": periods, "words": [words]}, arrays


def _in_time(work: Callable[[], tuple[int, int]]) -> tuple[int, int] | None:
    """Return the findings of work within :data:`WITHIN`; None if it takes longer. Raises
    Interrupted if it is asked to stop from outside.
    """
    late, stop = threading.Event(), Stop()

    def end() -> None:
        late.set()
        stop.set()

    timer = threading.Timer(WITHIN, end)
    timer.daemon = True
    timer.start()
    try:
        with stop:
            return work()
    except Interrupted:
        check_stop()
        if late.is_set():
            return None
        raise
    finally:
        timer.cancel()


def nowhere(system: System, why: str, code: int | None = None) -> Answer:
    """The answer on a start that settles to nothing, in a sentence."""
    head = {"kind": "settle", "attractor": None, "code": code, "settles": -1, "words": [why]}
    return {**head, "values": dict(system.values)}, {}


def _noun(row: Mapping[str, Any]) -> str:
    """An attractor in a sentence."""
    if row["period"]:
        return str(row["name"])
    rests = {"limit_cycle": "a limit cycle", "equilibrium": "an equilibrium"}
    return rests.get(row["kind"], f"a {row['name']} motion")


def _fate(code: int) -> str:
    """The fate of one start, in the words for many."""
    return WITHOUT[Kind(code)].split(":")[0].replace("lead to", "leads to")


def attractor_orbit(known: Legend, key: int, method: Method, quantities: Sequence[str]) -> Answer:
    """The orbit of an attractor: a whole period; of one that never repeats some periods on it."""
    row: dict[str, Any] = known.row(key) or {}
    repeats = bool(row["period"]) or row["kind"] in ("equilibrium", "limit_cycle")
    head, arrays = orbit(
        AskedRun(
            known.map.system,
            row["points"][0 if row["seconds"] == row["seconds"] else -1],
            float(known.map.period[0]),
            row["period"] or (1 if row["kind"] == "equilibrium" else NEVER_REPEATS),
            row["seconds"] if row["kind"] == "limit_cycle" else None,
            method,
        ),
        quantities,
        {**row, "repeats": repeats},
    )
    return {**head, "attractor": row}, arrays


def orbit(asked: AskedRun, quantities: Sequence[str], about: Mapping[str, Any]) -> Answer:
    """A motion over a whole period, and what is known of its orbit: ``name``, ``stable``,
    ``multipliers``, ``margin``, ``peak``, ``seconds``.
    """
    head, arrays = motion(replace(asked, measured=False), quantities)
    names = ("name", "stable", "multipliers", "eigenvalues", "margin", "peak", "seconds")
    told = {name: about[name] for name in names if name in about}
    return {**head, **told, "kind": "orbit", "repeats": bool(about.get("repeats", True))}, arrays


def orbit_of(map_: Stroboscope, point: Sequence[float], period: int) -> ClosedMotion:
    """An orbit from a point on it and its period, as Newton's method takes it."""
    start = np.array([point], float)
    points = np.concatenate([start[:, None], map_.launch(start, period).advance(period)], axis=1)
    return ClosedMotion(points[0, :period], np.zeros(len(point)), 0.0)


def tracked(
    old: ClosedMotion,
    source: System,
    system: System,
    method: Method,
    turn_of: Callable[[System], float],
    quantities: Sequence[str],
) -> Answer:
    """An orbit that is known at the values of one system at those of another: ``lost`` says where
    it folded on the way, and the orbit is then the last one.
    """
    now = track(source, old, source.values, system.values, method)
    one = now.motion
    cycle = one.time > 0
    rests = system.forced_at is None and not cycle
    n = one.period if system.forced_at is not None else 0
    there = system.with_values(**now.values)
    turn = turn_of(there)
    about = {
        "name": kind_text("equilibrium" if rests else one.kind, n),
        "stable": now.stable,
        "multipliers": pairs(one.multipliers),
        "eigenvalues": rests,
        "seconds": one.time if cycle else n * turn or None,
    }
    run = AskedRun(there, one.points[0], turn, max(n, 1), one.time if cycle else None, method)
    head, arrays = orbit(run, quantities, about)
    words = [now.lost] if now.lost else []
    return {**head, "kind": "track", "lost": now.lost or None, "words": words}, arrays
