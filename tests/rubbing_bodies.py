"""Random bodies with friction between them, a memory, and stops that they meet together."""

from __future__ import annotations

import numpy as np

import saltus as sl

BODIES = 4
GIVEN = {f"k{i}{j}": 0.0 for i in range(BODIES) for j in range(i, BODIES)}
GIVEN |= {f"{name}{i}": 0.5 for name in ("force", "lag", "dead", "a") for i in range(BODIES)}
GIVEN |= {"c": 0.3, "slip": 2.0, "stick": 2.5, "pair": 1.0, "belt": 0.1, "sway": 0.1, "limit": 2.0}
GIVEN |= {"spring": 300.0, "wall": 0.02, "near": 0.02, "e": 0.5, "f": 0.0, "w": 10.0}


def equation(t, *z, **p):
    """Four bodies on springs: one on a belt, friction between two, a Jenkins element at the last;
    a stop that all of them meet together, another between the last two.
    """
    x, v = z[:BODIES], z[BODIES:]
    rates = [
        p[f"force{i}"] * sl.cos(p["w"] * t + p[f"lag{i}"]) + p[f"dead{i}"] - p["c"] * v[i]
        - sum(p[f"k{min(i, j)}{max(i, j)}"] * x[j] for j in range(BODIES))
        for i in range(BODIES)
    ]  # fmt: skip
    along = [p[f"a{i}"] for i in range(BODIES)]
    rubbed = sl.friction(v[1] - v[2], slip=p["pair"])
    speed = p["belt"] + p["sway"] * sl.cos(p["w"] * t)
    rates[0] -= sl.friction(v[0] - speed, slip=p["slip"], stick=p["stick"])
    rates[1], rates[2] = rates[1] - rubbed, rates[2] + rubbed
    rates[3] -= sl.slider(x[3], stiffness=p["spring"], limit=p["limit"])
    met, closing = (sum(a * one for a, one in zip(along, of, strict=True)) for of in (x, v))
    laws = [
        sl.impact(met < p["wall"], closing, restitution=p["e"],
                  inertia={f"v{i}": 1.0 for i in range(BODIES)}),
        sl.impact(x[2] < x[3] + p["near"], v[2] - v[3], restitution=p["f"],
                  inertia={"v2": 1.0, "v3": 1.0}),
    ]  # fmt: skip
    return (*v, *rates, *laws)


def made():
    """The system."""
    names = [f"{letter}{i}" for letter in "xv" for i in range(BODIES)]
    values = ", ".join(f"{name}={value}" for name, value in GIVEN.items())
    space = {"equation": equation}
    passed = ", ".join(f"{name}={name}" for name in GIVEN)
    exec(
        f"def bodies(t, {', '.join(names)}, *, {values}):\n"
        f" return equation(t, {', '.join(names)}, {passed})",
        space,
    )
    return sl.system(states=" ".join(names), forced_at="w", units={"w": "rad/s"})(space["bodies"])


def drawn(system, rng):
    """Random values, and a start."""
    root = rng.normal(size=(BODIES, BODIES))
    stiffness = 200 * (root @ root.T / BODIES + np.eye(BODIES))
    way = rng.normal(size=BODIES)
    values = {f"k{i}{j}": stiffness[i, j] for i in range(BODIES) for j in range(i, BODIES)}
    for i in range(BODIES):
        values |= {f"force{i}": rng.uniform(5, 30), f"lag{i}": rng.uniform(0, 6)}
        values |= {f"dead{i}": rng.normal(0, 3), f"a{i}": way[i] / np.linalg.norm(way)}
    values |= {"c": rng.choice([0.0, 0.3, 2.0]), "slip": rng.uniform(1, 8), "w": rng.uniform(5, 30)}
    values |= {"belt": rng.choice([0.0, 0.2]), "sway": rng.choice([0.0, 0.2])}
    values |= {"stick": values["slip"] * rng.choice([1.0, 1.2]), "pair": rng.uniform(1, 8)}
    values |= {"limit": rng.uniform(2, 15), "spring": rng.uniform(60, 400)}
    for name in ("e", "f"):
        values[name] = rng.choice([0.0, rng.uniform(0, 1), rng.uniform(0.5, 0.95), 1.0])
    values |= {name: rng.uniform(0.003, 0.04) for name in ("wall", "near")}
    start = np.zeros(len(system.states))
    start[BODIES : 2 * BODIES] = rng.normal(0, 0.05, BODIES)
    return system.with_values(**{name: float(one) for name, one in values.items()}), start
