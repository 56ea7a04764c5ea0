"""Derivatives that are handed out, beside differences, of random systems: of motions, periodic
orbits, fits and places of bifurcations.

``PYTHONPATH=src:tests python -m oracles.derivative_check COUNT SEED`` prints how many derivatives
of how many systems ended how, and for each system that doesn't agree a program that repeats it;
``... 1 SEED.NUMBER`` repeats one, ``--of orbits`` asks for periodic orbits.
"""

from __future__ import annotations

import argparse
import collections
import signal
import sys
import time
import warnings
from functools import partial
from random import Random

import numpy as np

import saltus as sl

from . import event_derivatives, orbit_derivatives, response_derivatives
from .derivative_systems import Case, random_case
from .differences import Column, shifts

READ = {
    "derivative": "value", "contact_time_derivative": "contact_time",
    "maximum_derivative": "maximum", "minimum_derivative": "minimum",
    "end_derivative": "end",
}  # fmt: skip
METHODS = {"Taylor": sl.Taylor(), "Modal": sl.Modal()}
SETTLED = ("events", "responses")
REACHED = ("ok", "graze_unresolved")
SECONDS = 60  # of the processor
NOTHING_WRONG = ("same", "undecidable", "unforced", "no orbit", "no event")


class LateError(Exception):
    """The time of one system is used up."""


def case(seed: str, of: str = "motions") -> Case:
    """The system of a seed."""
    return random_case(Random(seed), of in SETTLED)


def columns(that: Case, method: sl.Method, extremes: bool = True) -> list[Column] | str:
    """All derivatives of a case by a method, or the status with which it ends otherwise."""
    system, to = that.system(), list(that.to)
    fly = partial(_sensitivity, that=that, method=method, extremes=extremes)
    (found,) = fly(system, [that.start])
    if found["status"] not in REACHED:
        return found["status"]
    kinds = [kind for kind in READ if kind in found]
    answer = []
    for number, name in enumerate(to):
        state = name.endswith("(0)")
        place = [*system.states].index(name[:-3]) if state else None
        base = that.start[place] if state else system.values[name]
        moved, unit = shifts(base)
        if state:
            starts = [np.add(that.start, s * np.eye(len(that.start))[place]) for s in moved]
            runs = fly(system, starts)
        elif name == system.forced_at:  # periods of their own have no times in common
            values = [system.with_values(**{name: base + s}) for s in moved]
            runs = [fly(one, [that.start])[0] for one in values]
        else:
            runs = fly(system, [that.start] * len(moved), {name: base + moved})
        if any(run["contacts"] != found["contacts"] for run in runs):
            answer.append(Column("other contacts", name, *np.empty((3, 0))))
            continue
        for kind in kinds:
            read = [run[READ[kind]] for run in runs]
            left_out = found["ends of chatter"] if kind.startswith("contact") else False
            own = found[kind][..., number]
            answer.append(Column.of(kind, name, own, read, unit, left_out))
    return answer


def _sensitivity(system, starts, values=None, *, that, method, extremes):
    """Values and derivatives of motions, each by name."""
    at, names = np.linspace(0.21, 0.97, 4) * that.t_end, (*system.states, *system.outputs.names)
    memories = len(system.states) - len(that.start)  # they begin at zero
    rows = np.pad(np.array(starts), ((0, 0), (0, memories)))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = sl.sensitivity(
            system, rows, t_end=that.t_end, to=list(that.to), at=at, method=method,
            values=values, extremes=extremes,
        )  # fmt: skip
    answer = []
    for i in range(len(starts)):
        one, mine = found.isel(trajectory=i), found.contact_trajectory.values == i
        kinds, times = found.contact_kind.values[mine], found.contact_time.values[mine]
        read = {name: one[name].values for pair in READ.items() for name in pair if name in one}
        read |= {name: found[name].values[mine] for name in read if name.startswith("contact")}
        behind = np.append(False, (kinds[:-1] == "impact") & (np.diff(times) > 0))[: len(kinds)]
        answer.append(
            read
            | {
                "status": str(one.status.item()),
                "end": np.array([one[f"end_{name}"].item() for name in names]),
                "contacts": [*found.contact_guard.values[mine], *kinds],
                # no gap tells when ever smaller impacts end
                "ends of chatter": (kinds == "hold") & behind,
            }
        )
    return answer


OF = {
    "motions": columns, "orbits": orbit_derivatives.columns, "events": event_derivatives.columns,
    "histories": response_derivatives.histories, "responses": response_derivatives.responses,
}  # fmt: skip


def judged(that: Case, which: str, of: str = "motions") -> tuple[str, list[str], int]:
    """How a case ends by a method, what is wrong with it, and how many derivatives were judged."""
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        found = OF[of](that, METHODS[which])
    except LateError:
        return "late", [], 0
    except Exception as error:
        return type(error).__name__, [str(error)], 0
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    if isinstance(found, str):
        return found, [], 0
    wrong = [
        f"{one.kind}[{place}] by {one.to}: {one.found[place]:.9g}, "
        f"differences {one.expected[place]:.9g} +- {one.error[place]:.1g}"
        for one in found
        for place in np.flatnonzero((one.off > 1.0) | one.unknown)
    ]
    decided = sum(int(one.decided.sum()) for one in found)
    return ("differs" if wrong else "same" if decided else "undecidable"), wrong, decided


def _late(*_):
    raise LateError


def main(arguments=None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int)
    parser.add_argument("seed", help="a number; or SEED.NUMBER, with a count of 1")
    parser.add_argument("methods", nargs="*", default=list(METHODS))
    parser.add_argument("--of", choices=OF, default="motions")
    given = parser.parse_args(arguments)
    signal.signal(signal.SIGPROF, _late)
    seeds = [given.seed] if "." in given.seed else [f"{given.seed}.{i}" for i in range(given.count)]
    count, began, decided = collections.Counter(), time.process_time(), 0
    for seed in seeds:
        that = case(seed, given.of)
        for which in given.methods:
            verdict, wrong, more = judged(that, which, given.of)
            count[f"{which}: {verdict}"] += 1
            decided += more
            if verdict not in NOTHING_WRONG:
                print(f"\n# {seed}, {which}, {that.name}: {verdict}", *wrong[:6], sep="\n#   ")
                if wrong:
                    print(that.reproduction(which), flush=True)
    print(f"# {time.process_time() - began:.0f} s, {decided} derivatives: {dict(count)}")
    return int(any(not name.endswith(NOTHING_WRONG) for name in count))


if __name__ == "__main__":
    sys.exit(main())
