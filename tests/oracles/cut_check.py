"""Motions cut within a few units in the last place of their contacts, and taken up from there:
together both parts have the contacts and the end of the whole motion.

``PYTHONPATH=src:tests python -m oracles.cut_check COUNT SEED`` prints how many cuts of COUNT random
systems of each kind ended how, by both methods, and each cut that is wrong; ``--kinds rough`` and
``--methods Modal`` ask for some. A motion that a start one unit in the last place away would change
is "sensitive", and isn't asked. Of the last 1e-7 s of a chatter only its outcome is compared: a
state behind a cut knows gaps to their rounding, which over velocities as low as there is 1e-8 s.
"""

from __future__ import annotations

import argparse
import collections
import warnings

import numpy as np

import rubbing_bodies
import saltus as sl
from saltus.analysis.motion.poincare import crossed

MASS = np.diag([1.0, 2.0, 1.5])
STIFFNESS = 1e3 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.5, -1.5], [0.0, -1.5, 1.5]])
SHAPES = sl.structure_modes(MASS, STIFFNESS, 3)["shape"].values
CLAY = sl.Contact("x3", restitution=0.0, gap=2e-3, name="clay")
PAIR = sl.Contact("x1", to="x2", stiffness=4e3, gap=1e-3, name="pair")
STRUCTURES = {
    "soft": [sl.Contact("x3", stiffness=5e3, gap=2e-3, damping=3.0, side="both"), PAIR],
    "rigid": [sl.Contact("x3", restitution=0.7, gap=2e-3), PAIR],
    "rigid pair": [sl.Contact("x1", to="x2", restitution=0.6, gap=1e-3),
                   sl.Contact("x3", stiffness=5e3, gap=2e-3, damping=3.0, side="lower")],
    "clay": [CLAY, PAIR],
    "clays": [CLAY, sl.Contact("x2", restitution=0.0, gap=1e-3, side="lower", name="low"),
              sl.Contact("x1", to="x2", restitution=0.0, gap=1e-3, name="between")],
    "mixed": [CLAY, PAIR, sl.Contact("x1", restitution=0.5, gap=1e-3, side="lower", name="low")],
    "rough": [sl.Contact("x3", stiffness=5e3, gap=1e-3, side="both", friction=0.3, sliding="x2",
                         name="rough"), sl.Contact("x1", stiffness=5e3, gap=2e-3, name="stop")],
}  # fmt: skip
KINDS = ("bodies", "bodies without rebound", *STRUCTURES)
METHODS = {"Modal": sl.Modal(), "Taylor": sl.Taylor()}
SHIFTS = (-3, -1, 0, 1, 3)
TOGETHER, CHATTER = 1e-11, 1e-7  # [s]
FINE = ("ok", "resting", "graze_unresolved")


def made(kind, section=None):
    """The system of a kind; of a structure also with a section, as ``sl.poincare`` takes it."""
    if kind not in STRUCTURES:
        return rubbing_bodies.made()
    system = sl.structure(
        MASS, STIFFNESS, 4e-3 * STIFFNESS + 0.3 * MASS, modes=3, contacts=STRUCTURES[kind],
        forces=[sl.Force("x1", 2.0)], frequency=1.8, sensors={"tip": "x3", "stretch": ("x3", "x1")},
    )  # fmt: skip
    return system if section is None else crossed(system, section, {}).system


def drawn(kind, system, rng):
    """The system with random values, a start that is beyond no stop, and the end."""
    if kind not in STRUCTURES:
        one, start = rubbing_bodies.drawn(system, rng)
        one = one.with_values(e=0.0, f=0.0) if kind != "bodies" else one
        return one, start, 6 * np.pi / one.values["w"]
    values = {
        name: float(value * rng.uniform(0.5, 1.5))
        for name, value in system.values.items()
        if name in ("force", "frequency") or name.endswith(("_gap", "_stiffness", "_level"))
    }
    share = rng.choice([0.0, 0.3, 1.0])
    gaps = min(value for name, value in values.items() if name.endswith("_gap"))
    places = share * 0.3 * gaps * rng.uniform(-1, 1, 3)
    velocities = share * 0.1 * rng.normal(size=3)
    start = np.concatenate([np.linalg.solve(SHAPES, of) for of in (places, velocities)])
    return system.with_values(**values), start, 1.0


def moved(system, start, begin, end, method):
    """A motion: its contacts, its last state, its status."""
    run = sl.simulate(
        system, start, t_start=begin, t_end=end, samples=1, method=method, progress=False,
        time_errors="local",
    )  # fmt: skip
    rows = zip(
        *(run[f"contact_{of}"].values.tolist() for of in ("time", "guard", "kind", "direction")),
        strict=True,
    )
    state = np.array([float(run[f"end_{name}"]) for name in system.states])
    return list(rows), state, str(run.status.values)


def is_of_stop(row):
    """True for an impact, and for the rest and the release of a stop."""
    return row[2] == "impact" or row[1].endswith(" at rest")


def chatters(*motions):
    """The intervals in which stops close again and again, less than 1e-7 s apart, and some come to
    rest, in any of some motions.
    """
    found = []
    for rows in motions:
        times = sorted(row[0] for row in rows if is_of_stop(row))
        rests = [row[0] for row in rows if is_of_stop(row) and row[2] == "hold"]
        for group in np.split(times, np.flatnonzero(np.diff(times) > CHATTER) + 1):
            rest = len(group) and any(group[0] <= time <= group[-1] for time in rests)
            if rest and group[-1] - group[0] > TOGETHER:
                found.append((group[0], group[-1]))
    return found


def ordered(rows, intervals):
    """The contacts in the order of time; those of one instant, or chatter, by name, and each once.
    Of stops that chatter the last row of each.
    """

    def within(time):
        return any(begin - CHATTER < time < end + CHATTER for begin, end in intervals)

    answer, group = [], []
    for row in [*sorted(rows, key=lambda one: one[0]), (np.inf, "", "")]:
        if group and row[0] - group[-1][0] > (CHATTER if within(row[0]) else TOGETHER):
            stops = [one for one in group if within(one[0]) and is_of_stop(one)]
            last = {one[1].removesuffix(" at rest"): one for one in stops}
            kept = {one[1:]: one for one in group if one not in stops} | {
                one[1:]: one for one in last.values()
            }
            answer += sorted(kept.values(), key=lambda one: one[1:])
            group = []
        group.append(row)
    return answer, [within(row[0]) or row[2] == "hold" for row in answer]


def difference(found, known):
    """What two motions differ in, or ''."""
    if found[2] not in FINE:
        return f"status {found[2]}"
    intervals = chatters(found[0], known[0])
    (rows, rough), (others, _) = ordered(found[0], intervals), ordered(known[0], intervals)
    if [row[1:] for row in rows] != [row[1:] for row in others]:
        return "contacts"
    for row, other, vague in zip(rows, others, rough, strict=True):
        if abs(row[0] - other[0]) > (CHATTER if vague else 1e-9):
            return "times"
    apart = np.abs(found[1] - known[1]).max()
    return "end" if apart > 1e-7 * max(1e-9, np.abs(known[1]).max()) else ""


def cuts(system, start, end, method, rng, most=6):
    """What cuts at random times and at contacts differ in: (time, shift, difference); or why the
    motion isn't asked.
    """
    whole = moved(system, start, 0.0, end, method)
    if whole[2] not in FINE:
        return whole[2]
    for way in (-1.0, 1.0):
        beside = start * (1 + way * 2.0**-52)
        if difference(moved(system, beside, 0.0, end, method), whole):
            return "sensitive"
    times = [(float(time), 0) for time in rng.uniform(0.01, 0.99, 2) * end]
    for number in rng.permutation(len(whole[0]))[:most]:
        time = whole[0][number][0]
        times += [(float(time + shift * np.spacing(time)), shift) for shift in SHIFTS]
    answer = []
    for cut, shift in times:
        if 0 < cut < end:
            rows, state, status = moved(system, start, 0.0, cut, method)
            after = (
                moved(system, state, cut, end, method) if status in FINE else ([], state, status)
            )
            answer.append((cut, shift, difference((rows + after[0], *after[1:]), whole)))
    return answer


def main():
    """Ask many systems."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("count", type=int)
    parser.add_argument("seed", type=int)
    parser.add_argument("--kinds", nargs="*", default=KINDS, help=", ".join(KINDS))
    parser.add_argument("--methods", nargs="*", default=METHODS, help=", ".join(METHODS))
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    for kind in given.kinds:
        system = made(kind)
        for name in given.methods:
            outcomes = collections.Counter()
            for number in range(given.count):
                rng = np.random.default_rng([given.seed, number])
                one = drawn(kind, system, rng)
                answer = cuts(*one, METHODS[name], rng)
                if isinstance(answer, str):
                    outcomes[f"{answer} motion"] += 1
                    continue
                outcomes.update(wrong or "same" for _, _, wrong in answer)
                for cut, shift, wrong in answer:
                    if wrong:
                        print(f"{kind} {name} {given.seed}.{number}: {wrong}, {cut!r} ({shift:+d})")
            print(kind, name, dict(outcomes), flush=True)


if __name__ == "__main__":
    main()
