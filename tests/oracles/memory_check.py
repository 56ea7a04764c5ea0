"""saltus beside two independent solvers on random systems with a memory.

``PYTHONPATH=src:tests python -m oracles.memory_check COUNT SEED`` prints how many systems ended
how, and for each that doesn't agree a program that repeats it. ``... COUNT SEED conditions`` takes
random joined and nested conditions instead, which RK4 alone judges. ``... 1 SEED.NUMBER`` repeats
one.
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

from . import written_equations
from .memory_automaton import NoModeError
from .memory_systems import Case, random_case, random_conditions

#: Statuses with which a motion has come to the end; `resting`: on a boundary since the start.
REACHED = ("ok", "graze_unresolved", "resting")
SHIFT = 1e-7
STEPS_A_SECOND = (10_007, 7_001, 3_001)  # no common nodes
UNDECIDABLE = 0.05  # of motions of order one
SECONDS = 20  # of the processor


@dataclass(frozen=True)
class Judged:
    """What the judges say of a case.

    Attributes
    ----------
    end : float array (states,)
        The end to compare with: the exact one where there is one, else RK4's.
    allowed : float
        How far from it an answer may lie: rounding, times how far a change of the start by
        ``SHIFT`` goes; RK4's own error where it is the judge.
    apart : float
        Distance of the two judges, in units of what RK4 may err.
    """

    end: np.ndarray
    allowed: float
    apart: float = 0.0


@dataclass(frozen=True)
class Answer:
    """What saltus says: status (or error), end, verdict, contacts on the way."""

    status: str
    verdict: str
    off: float
    end: np.ndarray | None = None
    words: str = ""
    contacts: int = 0


class LateError(Exception):
    """The time of one system is used up."""


def case(seed: str, conditions: bool = False) -> Case:
    """The system of a seed."""
    rng = Random(seed)
    return random_conditions(rng) if conditions else random_case(rng)


def judge(case: Case, rk4: bool = True) -> Judged:
    """The end by both judges; without RK4 by the exact one alone, in a hundredth of the time."""
    end = allowed = None
    if case.machine:
        end = case.exact()
        growth = max(np.abs(case.exact(d) - end).max() for d in (SHIFT, -SHIFT)) / SHIFT
        allowed = 1e-9 * (1.0 + growth) * (1.0 + np.abs(end).max())
        if not rk4:
            return Judged(end, allowed)
    tape, (many, some, few) = written_equations.read(case.source), STEPS_A_SECOND
    runs = [
        written_equations.run(tape, np.add(case.start, shift), case.t_end, round(case.t_end * n))
        for n, shift in ((many, 0.0), (some, 0.0), (few, 0.0), (few, SHIFT))
    ]
    error = 10.0 / many + 10.0 * max(np.abs(runs[2] - run).max() for run in runs)
    if end is None:
        return Judged(runs[0], error)
    return Judged(end, allowed, float(np.abs(runs[0] - end).max() / error))


def answer(case: Case, judged: Judged) -> Answer:
    """saltus on the same case."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            run = sl.simulate(case.system(), case.start, t_end=case.t_end, samples=2)
    except LateError:
        return Answer(f"later than {SECONDS} s", "dead end", np.inf)
    except Exception as error:
        return Answer(type(error).__name__, "refused", np.inf, words=str(error))
    end = np.array([run[f"end_{name}"].item() for name in case.states.split()])
    status, off = str(run.status.item()), float(np.abs(end - judged.end).max())
    if status not in REACHED:
        return Answer(status, "dead end", off, end, f"at t = {run.end_time.item()}")
    if judged.allowed > UNDECIDABLE:
        return Answer(status, "undecidable", off, end)
    verdict = "same" if off <= judged.allowed else "differs"
    return Answer(status, verdict, off, end, contacts=run.sizes["contact"])


def _one(seed: str, conditions: bool) -> tuple[Case, Judged, Answer]:
    that = case(seed, conditions)
    judged = judge(that)
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        return that, judged, answer(that, judged)
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def report(seed: str, case: Case, judged: Judged, ours: Answer) -> str:
    """Everything that is needed to repeat a case and to see what is wrong."""
    return (
        f"\n# {seed}, {case.name}: {ours.status}, {ours.verdict} {ours.words}\n"
        f"# off {ours.off:.2e}, allowed {judged.allowed:.1e}; "
        f"RK4 is off by {judged.apart:.1e} of its own error\n"
        f"# saltus {ours.end}\n# judge  {judged.end}\n{case.reproduction()}"
    )


def _late(*_):
    raise LateError


def main(arguments=None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int)
    parser.add_argument("seed", help="a number; or SEED.NUMBER, with a count of 1")
    parser.add_argument("kind", nargs="?", choices=("memory", "conditions"), default="memory")
    given = parser.parse_args(arguments)
    signal.signal(signal.SIGPROF, _late)
    seeds = [given.seed] if "." in given.seed else [f"{given.seed}.{i}" for i in range(given.count)]
    count, contacts, began = collections.Counter(), 0, time.process_time()
    found = collections.defaultdict(list)
    for i, seed in enumerate(seeds):
        try:
            that, judged, ours = _one(seed, given.kind == "conditions")
        except NoModeError as error:  # two exits at one instant, in rounding
            print(f"# {seed}: the exact judge gives up: {error}", flush=True)
            count["no judge: undecidable"] += 1
            continue
        count[f"{ours.status}: {ours.verdict}"] += 1
        contacts += ours.contacts
        if judged.apart > 1.0:
            count["judges differ"] += 1
        if ours.verdict not in ("same", "undecidable") or judged.apart > 1.0:
            print(report(seed, that, judged, ours), flush=True)
            found[f"{ours.status}: {ours.verdict}"].append((len(that.source), seed, that.name))
        if i % 50 == 49:
            print(
                f"# {i + 1} systems, {time.process_time() - began:.0f} s: {dict(count)}", flush=True
            )
    for what, those in found.items():
        print(f"# {what}, shortest first: {[one[1:] for one in sorted(those)[:8]]}")
    print(f"# {len(seeds)} systems, {contacts} contacts in those that are decided: {dict(count)}")
    return int(any(not name.endswith(("same", "undecidable")) for name in count))


if __name__ == "__main__":
    sys.exit(main())
