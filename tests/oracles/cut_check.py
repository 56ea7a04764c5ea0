"""Motions cut within a few units in the last place of their contacts, and taken up from there:
together both parts have the contacts and the end of the whole motion.

``PYTHONPATH=src:tests python -m oracles.cut_check COUNT SEED`` prints how many cuts of COUNT random
systems of each kind ended how, by both methods, and each cut that is wrong; ``--kinds rough`` asks
for some kinds. A motion that a start one unit in the last place away would change is
"sensitive", and isn't asked. Impacts of a chatter's last 1e-7 s are not compared: when a chatter is
completed depends on the steps.
"""

from __future__ import annotations

import argparse
import collections
import warnings

import numpy as np

import rubbing_bodies
import saltus as sl

MASS = np.diag([1.0, 2.0, 1.5])
STIFFNESS = 1e3 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.5, -1.5], [0.0, -1.5, 1.5]])
SHAPES = sl.structure_modes(MASS, STIFFNESS, 3)["shape"].values
CLAY = sl.Contact("x3", restitution=0.0, gap=2e-3, name="clay")
PAIR = sl.Contact("x1", to="x2", stiffness=4e3, gap=1e-3, name="pair")
STRUCTURES = {
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


def made(kind):
    """The system of a kind."""
    if kind not in STRUCTURES:
        return rubbing_bodies.made()
    return sl.structure(
        MASS, STIFFNESS, 4e-3 * STIFFNESS + 0.3 * MASS, modes=3, contacts=STRUCTURES[kind],
        forces=[sl.Force("x1", 2.0)], frequency=1.8,
    )  # fmt: skip


def drawn(kind, system, rng):
    """The system with random values, a start that is beyond no stop, and the end."""
    if kind not in STRUCTURES:
        one, start = rubbing_bodies.drawn(system, rng)
        one = one.with_values(e=0.0, f=0.0) if kind != "bodies" else one
        return one, start, 6 * np.pi / one.values["w"]
    values = {
        name: float(value * rng.uniform(0.5, 1.5))
        for name, value in system.values.items()
        if name in ("force", "frequency") or name.endswith(("_gap", "_stiffness"))
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


def ordered(rows):
    """The contacts in the order of time; those of one instant by name, and each once."""
    answer, group = [], []
    for row in [*sorted(rows), (np.inf,)]:
        if group and row[0] - group[-1][0] > TOGETHER:
            answer += sorted({one[1:]: one for one in group}.values(), key=lambda one: one[1:])
            group = []
        group.append(row)
    holds = [(row[0], row[1]) for row in answer if row[2] == "hold"]
    return [
        row
        for row in answer
        if row[2] != "impact"
        or not any(TOGETHER < time - row[0] < CHATTER and row[1] in name for time, name in holds)
    ]


def difference(found, known):
    """What two motions differ in, or ''."""
    if found[2] not in FINE:
        return f"status {found[2]}"
    rows, others = ordered(found[0]), ordered(known[0])
    if [row[1:] for row in rows] != [row[1:] for row in others]:
        return "contacts"
    for row, other in zip(rows, others, strict=True):
        if abs(row[0] - other[0]) > (CHATTER if row[2] == "hold" else 1e-9):
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
    given = parser.parse_args()
    warnings.simplefilter("ignore")
    for kind in given.kinds:
        system = made(kind)
        for name, method in METHODS.items():
            outcomes = collections.Counter()
            for number in range(given.count):
                rng = np.random.default_rng([given.seed, number])
                one = drawn(kind, system, rng)
                answer = cuts(*one, method, rng)
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
