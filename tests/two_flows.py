"""Random structures with rigid stops, and their motions by modes and by Taylor's method."""

from __future__ import annotations

import numpy as np

import saltus as sl

FOLLOWS = {"progress": False, "time_errors": "local"}


def structure(rng, degrees, stops, *, pairs=False, soft=False, moving=False):
    """A random structure of unit masses, driven, with rigid stops; some with a spring beside."""
    root = rng.normal(size=(degrees, degrees))
    stiffness = 200.0 * (root @ root.T / degrees + np.eye(degrees))
    damping = rng.choice([0.0, 0.3, 2.0]) * np.eye(degrees) + rng.choice([0, 0.002]) * stiffness
    force, lag = rng.uniform(5, 30, degrees), rng.uniform(0, 6, degrees)
    dead, w = rng.normal(0, 3, degrees), float(rng.uniform(5, 30))
    sway = float(rng.uniform(0.002, 0.01)) if moving else 0.0
    kinds, chosen = ["upper", "lower", "both"] + ["pair"] * (pairs and degrees > 1), []
    for _ in range(stops):
        e = rng.choice([0.0, rng.uniform(0, 1), rng.uniform(0.5, 0.95)], p=[0.2, 0.3, 0.5])
        place = rng.choice(degrees, 2, replace=degrees == 1).tolist()
        chosen.append((str(rng.choice(kinds)), *place, float(rng.uniform(0.003, 0.05)), float(e)))
    names = [f"{letter}{i + 1}" for letter in "xv" for i in range(degrees)]

    def equation(t, w, *z):
        x, v, laws = z[:degrees], z[degrees:], []
        wall, speed = sway * sl.sin(w * t), sway * w * sl.cos(w * t)
        rates = [
            sum(
                -float(stiffness[i, k]) * x[k] - float(damping[i, k]) * v[k] for k in range(degrees)
            )
            + float(force[i]) * sl.cos(w * t + float(lag[i]))
            + float(dead[i])
            for i in range(degrees)
        ]
        for kind, i, j, gap, e in chosen:
            if kind == "pair":
                both = {f"v{i + 1}": 1.0, f"v{j + 1}": 1.0}
                closing = v[i] - v[j]
                laws.append(sl.impact(x[i] < x[j] + gap, closing, restitution=e, inertia=both))
            if kind in ("upper", "both"):
                laws.append(sl.impact(x[i] < gap + wall, v[i] - speed, restitution=e))
            if kind in ("lower", "both"):
                laws.append(sl.impact(x[i] > -gap - sway, -v[i], restitution=e))
            if soft:
                rates[j] = rates[j] - 900.0 * sl.max(x[j] - 0.5 * gap, 0.0)
        return (*v, *rates, *laws)

    space = {"equation": equation}
    given = ", ".join(names)
    exec(f"def f(t, {given}, *, w={w}):\n return equation(t, w, {given})", space)
    return sl.system(states=" ".join(names), forced_at="w", units={"w": "rad/s"})(space["f"])


def runs(system, start, **kw):
    """The motion by the modal flow and by Taylor's method."""
    assert isinstance(sl.Modal().serving(system), sl.Modal)
    methods = sl.Modal(), sl.Taylor()
    return [sl.simulate(system, start, method=method, **FOLLOWS, **kw) for method in methods]


def same_rows(one, other, period, tolerance=1e-12):
    """Number of the first contacts that are the same rows, times to a tolerance that grows by a
    third at each.
    """
    count = min(one.sizes["contact"], other.sizes["contact"])
    same = np.ones(count, bool)
    for name in ("kind", "guard", "direction", "mode_before", "mode_after"):
        pair = (run[f"contact_{name}"].values[:count] for run in (one, other))
        same &= np.equal(*pair)
    apart = np.abs(one.contact_time.values[:count] - other.contact_time.values[:count]) / period
    wrong = np.flatnonzero(~same | (apart > tolerance * 1.3 ** np.arange(count)))
    return int(wrong[0]) if len(wrong) else count


def times(run, kind):
    return run["contact_time"].values[run["contact_kind"].values == kind]
