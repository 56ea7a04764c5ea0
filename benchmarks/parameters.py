"""Many parameter sets: derivatives beside closed forms and differences, fits of synthetic
measurements, and the scatter of the rig.

    OPENBLAS_NUM_THREADS=1 python benchmarks/parameters.py [derivatives] [fits] [sets]

`--whole` takes 100 measurements and 10 000 sets, in place of a few. All random numbers have fixed
seeds. Times are those of this machine; sets run as a study, which needs `saltus[cluster]`.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "src"))

from parameter_fits import fits, jump, refused, undecided
from parameter_sets import scatter

import saltus as sl
from saltus.errors import SaltusWarning

#: Differences of fourth order, and their steps.
WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / 12.0
SHIFTS = np.array([-2.0, -1.0, 1.0, 2.0])
#: Systems of a class, with values that differ by up to 5 %.
SYSTEMS = 10


@sl.system(states="x v", forced_at="f")
def bumper(t, x, v, *, f=2.0, pull=3.0, k=40.0, d=0.3, gap=0.01, stop=900.0):
    beyond = sl.where(x > gap, stop * (x - gap), 0)
    return v, pull * sl.cos(2 * sl.pi * f * t) - k * x - d * v - beyond


@sl.system(states="x v", forced_at="f")
def hammer(t, x, v, *, f=2.0, pull=3.0, k=40.0, gap=0.01, e=0.6):
    law = sl.impact(x < gap, v, restitution=e)
    return v, pull * sl.cos(2 * sl.pi * f * t) - k * x, law


@sl.system(states="x v", forced_at="f")
def slider(t, x, v, *, f=2.0, pull=3.0, k=30.0, limit=2.2):
    friction = sl.friction(v, slip=limit, stick=limit)
    return v, pull * sl.cos(2 * sl.pi * f * t) - k * x - friction


@sl.system(states="x v", forced_at="f")
def linear(t, x, v, *, f=2.0, pull=3.0, k=40.0, d=0.9):
    return v, pull * sl.cos(2 * sl.pi * f * t) - k * x - d * v


@sl.system(states="x v", forced_at="f")
def damped(t, x, v, *, f=1.5, pull=3.0, k=40.0, gap=0.08, e=0.6, d=0.4):
    law = sl.impact(x < gap, v, restitution=e)
    return v, pull * sl.cos(2 * sl.pi * f * t) - k * x - d * v, law


@sl.system(states="h v")
def ball(t, h, v, *, g=9.81, e=0.5):  # noqa: ARG001
    return v, -g, sl.impact(h > 0, -v, restitution=e)


# -- derivatives -----------------------------------------------------------------------------------
def derivatives():
    """Worst errors of each class, in the largest derivative by the same parameter."""
    random = np.random.default_rng(20261126)
    print("| derivatives of | by | beside | worst relative error |\n|---|---|---|---|")
    for name, system in (("soft contacts", bumper), ("impacts", hammer), ("stick-slip", slider)):
        for what, worst in motions(system, random).items():
            print(f"| {name}, {what} | every parameter | differences | {worst:.0e} |")
    print(f"| chatter, contact times | height, g, e | closed form | {chatter():.0e} |")
    print(f"| orbits, amplitude without contact | k, d, force | closed form | {amplitude():.0e} |")
    pressed = hammer.with_values(f=0.5, gap=-0.05, e=0.3)  # it chatters to rest in each period
    classes = (("soft contacts", bumper), ("impacts", hammer), ("stick-slip", slider))
    for name, system in (*classes, ("chatter to rest", pressed)):
        print(f"| orbits, {name} | a random way | differences | {orbits(system, random):.0e} |")
    for name, system in classes:
        worst = responses(system, random)
        print(f"| responses, {name} | a random way | differences | {worst:.0e} |")
    slopes, said = graze()
    print(f"| places of grazes | gap, force, k, d | closed form | {slopes:.0e} |")
    print(f"\nAt a graze of a rigid stop: {said}\n")


def varied(system, random):
    values = np.array([*system.values.values()]) * random.uniform(0.95, 1.05, len(system.values))
    return system.with_values(**dict(zip(system.values, values, strict=True)))


def off(found, expected):
    return float(np.nanmax(np.abs(found - expected)) / np.nanmax(np.abs(expected)))


def motions(system, random):
    """Worst errors of states at some times and of contact times, beside differences."""
    worst = {"states": 0.0, "contact times": 0.0}
    times = np.linspace(0.2, 1.6, 7)
    for _ in range(SYSTEMS):
        own, start = varied(system, random), (0.0, 0.05)
        found = sl.sensitivity(own, start, at=times, to=[*own.values], extremes=False)
        for column, name in enumerate(own.values):
            unit = 1e-6 * own.values[name]
            states, contacts = [], []
            for shift in SHIFTS * unit:
                values = {name: own.values[name] + shift}
                run = sl.simulate(own, start, at=times, values=values, time_errors="local")
                states.append(np.stack([run.x.values, run.v.values], axis=1))
                contacts.append(run.contact_time.values)
            for what, several, exact in (
                ("states", states, found.derivative.values[..., column]),
                ("contact times", contacts, found.contact_time_derivative.values[:, column]),
            ):
                by = np.tensordot(WEIGHTS, np.array(several), 1) / unit
                worst[what] = max(worst[what], off(exact, by))
    return worst


def chatter():
    """Times of the impacts of a bouncing ball: t_n = t_1 (1 + 2 e + ... + 2 e^n)."""
    height, g, e = 0.1, 9.81, 0.5
    found = sl.sensitivity(ball, (height, 0), t_end=0.5, to=["g", "e", "h(0)"])
    first, worst, known = np.sqrt(2 * height / g), 0.0, found.contact_time_derivative.values
    count = int((found.contact_kind.values == "impact").sum())
    for n in range(count):
        j = np.arange(1, n + 1)
        powers, slope = 1 + 2 * np.sum(e**j), 2 * np.sum(j * e ** (j - 1.0))
        exact = np.array([-first * powers / (2 * g), first * slope, first * powers / (2 * height)])
        worst = max(worst, float(np.max(np.abs(known[n] - exact) / np.abs(exact).max())))
    return worst


def amplitude():
    """The response of a linear oscillator: pull / sqrt((k - w^2)^2 + (d w)^2)."""
    orbit = sl.attractors(linear, (0, 0)).isel(attractor=0)
    found = sl.sensitivity(linear, orbit, to=["k", "d", "pull"])
    p, w = linear.values, 2 * np.pi * linear.values["f"]
    size = (p["k"] - w * w) ** 2 + (p["d"] * w) ** 2
    by = np.array([-(p["k"] - w * w) / size, -p["d"] * w * w / size, 1 / p["pull"]])
    return off(found.maximum_derivative.values[0], by * p["pull"] / np.sqrt(size))


def orbits(system, random):
    """Largest state of periodic orbits that are found again at values nearby."""
    worst = 0.0
    for _ in range(SYSTEMS // 2):
        own = varied(system, random)
        start = min(0.0, 2 * own.values.get("gap", 0.0)), 0.1  # on the near side of the stop
        orbit = sl.attractors(own, start).isel(attractor=0)
        if str(orbit.attractor_type.item()) == "periodic":
            found = sl.sensitivity(own, orbit, to=[*own.values])
            worst = max(worst, beside(own, found.maximum_derivative.values, start, random))
    return worst


def responses(system, random):
    """Largest state of the responses over the frequency, all in one call."""
    seen, worst = sl.frequency_response(system, ("1.6 Hz", "2.4 Hz", SYSTEMS), (0.0, 0.1)), 0.0
    seen = seen.sel(response=(seen.response_period == 1) & (seen.response_type == "periodic"))
    found = sl.sensitivity(system, seen, to=[*system.values])
    for i, frequency in enumerate(seen.response_f.values):
        own = system.with_values(f=float(frequency))
        worst = max(worst, beside(own, found.maximum_derivative.values[i], (0.0, 0.1), random))
    return worst


def beside(own, slopes, start, random):
    """Error of the slopes of an orbit's largest state, along a random way, beside differences."""
    to, each = [*own.values], []
    values = np.array([*own.values.values()])
    along = random.normal(size=len(to)) * values
    for shift in SHIFTS * 1e-5:
        moved = own.with_values(**dict(zip(to, values + shift * along, strict=True)))
        there = sl.attractors(moved, start).isel(attractor=0)
        each.append(sl.sensitivity(moved, there, to=to).maximum.values)
    return off(slopes @ along, WEIGHTS @ np.array(each) / 1e-5)


def graze():
    """Where a linear response touches its stop, and what is said beside it."""
    found = sl.branches(damped, {"f": (1.39, 1.45)}, (-0.0757, 0.06), at=1, switch=())
    event = found.sel(event=found.event[found.event_kind == "graze"][0])
    slopes = sl.event_sensitivity(damped, event, to=["gap", "pull", "k", "d"])
    p, w = damped.values, 2 * np.pi * float(slopes.event_value)
    k, d = p["k"], p["d"]
    s = (k - w * w) ** 2 + (d * w) ** 2
    by = np.array([2 * s / p["gap"], -2 * s / p["pull"], 2 * (k - w * w), 2 * d * w * w])
    exact = -by / (2 * np.pi * (2 * d * d * w - 4 * w * (k - w * w)))
    said = [line for line in sl.describe(slopes).splitlines() if "infinite" in line]
    return off(slopes.event_derivative.values, exact), said[0].strip()


def main():
    parts = {"derivatives", "fits", "sets"}
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("parts", nargs="*", metavar="derivatives, fits, sets")
    asked.add_argument("--whole", action="store_true", help="100 measurements, 10 000 sets")
    asked.add_argument("--fits", type=int)
    asked.add_argument("--sets", type=int)
    given = asked.parse_args()
    wanted = set(given.parts) or parts
    if wanted - parts:
        asked.error(f"known: {', '.join(sorted(parts))}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SaltusWarning)
        if "derivatives" in wanted:
            derivatives()
        if "fits" in wanted:
            fits(given.fits or (100 if given.whole else 5))
            random = np.random.default_rng(20261126)
            jump(random)
            undecided(random)
            refused()
        if "sets" in wanted:
            scatter(given.sets or (10_000 if given.whole else 300))


if __name__ == "__main__":
    main()
