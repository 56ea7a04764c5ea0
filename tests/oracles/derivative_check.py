"""Derivatives that `sl.sensitivity` hands out, beside differences of motions of random systems.

``PYTHONPATH=src:tests python -m oracles.derivative_check COUNT SEED`` prints how many derivatives
of how many systems ended how, and for each system that doesn't agree a program that repeats it;
``... 1 SEED.NUMBER`` repeats one.
"""

from __future__ import annotations

import argparse
import collections
import signal
import sys
import time
import warnings
from dataclasses import dataclass
from random import Random

import numpy as np

import saltus as sl

from .derivative_systems import Case, random_case

SHIFTS = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
#: Differences of fourth order, and of second order on either side.
MIDDLE = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12.0
SIDES = np.array([[1.0, -4.0, 3.0, 0.0, 0.0], [0.0, 0.0, -3.0, 4.0, -1.0]]) / 2.0
#: Two steps, in the parameter.
STEPS = (3e-5, 4e-6)
#: Part of a derivative, and of the largest of its kind, that it may be off; differences whose own
#: error is larger than the last, in the largest, decide nothing.
ALLOWED, OF_LARGEST, UNDECIDABLE = 1e-6, 1e-7, 1e-3
READ = {
    "derivative": "value", "contact_time_derivative": "contact_time",
    "maximum_derivative": "maximum", "minimum_derivative": "minimum",
    "end_derivative": None,
}  # fmt: skip
METHODS = {"Taylor": sl.Taylor(), "Modal": sl.Modal()}
REACHED = ("ok", "graze_unresolved")
SECONDS = 60  # of the processor


class LateError(Exception):
    """The time of one system is used up."""


@dataclass(frozen=True)
class Column:
    """The derivatives of one kind by one parameter: found, by differences, their errors."""

    kind: str
    to: str
    found: np.ndarray
    expected: np.ndarray
    error: np.ndarray
    left_out: np.ndarray | bool = False

    @property
    def largest(self) -> float:
        return float(np.nanmax(np.abs(self.expected), initial=1e-12))

    @property
    def decided(self) -> np.ndarray:
        """Where the differences say something."""
        return np.isfinite(self.expected) & (self.error <= UNDECIDABLE * self.largest)

    @property
    def off(self) -> np.ndarray:
        """How far each is off, in what it may be; NaN where nothing is said."""
        may = 10 * self.error + ALLOWED * np.abs(self.expected) + OF_LARGEST * self.largest
        return np.where(self.decided, np.abs(self.found - self.expected) / may, np.nan)

    @property
    def unknown(self) -> np.ndarray:
        """Where a derivative exists and none is given."""
        return self.decided & ~np.isfinite(self.found) & ~np.asarray(self.left_out)


def case(seed: str) -> Case:
    """The system of a seed."""
    return random_case(Random(seed))


def columns(that: Case, method: sl.Method, system: sl.System | None = None) -> list[Column] | str:
    """All derivatives of a case by a method, or the status with which it ends otherwise."""
    system, to = system or that.system(), list(that.to)
    found = _sensitivity(system, that.start, that.t_end, to, method)
    if str(found.status.item()) not in REACHED:
        return str(found.status.item())
    answer = []
    for number, name in enumerate(to):
        differences = [_differences(that, method, system, name, found, step) for step in STEPS]
        if any(one is None for one in differences):
            answer.append(Column("other contacts", name, *np.empty((3, 0))))
            continue
        (first, _), (second, kink) = differences
        for kind in READ:
            own = found[kind].values[..., number]
            error = np.maximum(np.abs(second[kind] - first[kind]), kink[kind])
            left_out = _ends_of_chatter(found) if kind.startswith("contact") else False
            answer.append(Column(kind, name, own, second[kind], error, left_out))
    return answer


def _ends_of_chatter(found):
    """Where a contact comes to rest by ever smaller impacts: no gap tells this instant."""
    kinds, times = found.contact_kind.values, found.contact_time.values
    behind = np.append(False, (kinds[:-1] == "impact") & (np.diff(times) > 0))
    return (kinds == "hold") & behind


def _sensitivity(system, start, t_end, to, method):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        at = np.linspace(0.21, 0.97, 4) * t_end
        return sl.sensitivity(system, start, t_end=t_end, to=to, at=at, method=method)


def _differences(that, method, system, name, found, step):
    """Differences of everything that was read, and by how much those of both sides differ; None
    where the contacts are other ones.
    """
    values, start = dict(system.values), np.array(that.start, float)
    place = system.states.index(name[:-3]) if name.endswith("(0)") else None
    base = values[name] if place is None else start[place]
    unit = step * max(abs(base), 0.1)
    runs = []
    for shift in SHIFTS * unit:
        moved, other = start.copy(), system
        if place is None:
            other = system.with_values(**{name: base + shift})
        else:
            moved[place] += shift
        run = _sensitivity(other, moved, that.t_end, list(that.to), method)
        same = np.array_equal(run.contact_guard.values, found.contact_guard.values)
        if not same or not np.array_equal(run.contact_kind.values, found.contact_kind.values):
            return None
        runs.append(run)
    slopes, kinks = {}, {}
    for kind, read in READ.items():
        if read is None:
            names = (*system.states, *system.outputs.names)
            rows = np.array([[run[f"end_{one}"].item() for one in names] for run in runs])
        else:
            rows = np.array([run[read].values for run in runs])
        slopes[kind] = np.tensordot(MIDDLE, rows, 1) / unit
        sides = np.tensordot(SIDES, rows, 1) / unit
        kinks[kind] = np.abs(sides[1] - sides[0])
    return slopes, kinks


def judged(seed: str, which: str) -> tuple[Case, str, list[str]]:
    """A case, how it ends, and what is wrong with it."""
    that = case(seed)
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        found = columns(that, METHODS[which])
    except LateError:
        return that, "late", []
    except Exception as error:
        return that, type(error).__name__, [str(error)]
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    if isinstance(found, str):
        return that, found, []
    wrong = []
    for one in found:
        off = one.off
        wrong += [
            f"{one.kind}{[int(k) for k in place]} by {one.to}: {one.found[place]:.9g}, "
            f"differences {one.expected[place]:.9g} +- {one.error[place]:.1g}"
            for place in zip(*np.nonzero((off > 1.0) | one.unknown), strict=True)
        ]
    if all(one.kind == "other contacts" for one in found):
        return that, "undecidable", []
    return that, "differs" if wrong else "same", wrong


def _late(*_):
    raise LateError


def main(arguments=None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int)
    parser.add_argument("seed", help="a number; or SEED.NUMBER, with a count of 1")
    parser.add_argument("methods", nargs="*", default=list(METHODS))
    given = parser.parse_args(arguments)
    signal.signal(signal.SIGPROF, _late)
    seeds = [given.seed] if "." in given.seed else [f"{given.seed}.{i}" for i in range(given.count)]
    count, began = collections.Counter(), time.process_time()
    for seed in seeds:
        for which in given.methods:
            that, verdict, wrong = judged(seed, which)
            count[f"{which}: {verdict}"] += 1
            if verdict not in ("same", "undecidable"):
                print(f"\n# {seed}, {which}, {that.name}: {verdict}", *wrong[:6], sep="\n#   ")
                if wrong:
                    print(that.reproduction(which), flush=True)
    print(f"# {time.process_time() - began:.0f} s: {dict(count)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
