"""Many parameter sets: derivatives beside closed forms and differences, fits of synthetic
measurements, and the scatter of the rig.

    OPENBLAS_NUM_THREADS=1 python benchmarks/parameters.py [derivatives] [fits] [scatter]

`--fits 100 --sets 10000` are the numbers of measurements and sets. All random numbers have fixed
seeds. Times are those of this machine; scatter runs as a study, by one worker and by two.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import numpy as np
from scipy.optimize import least_squares

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "src"))

import saltus as sl
from saltus.analysis.fits.unknowns import INSIDE, Unknowns
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
    for name, system in (("soft contacts", bumper), ("impacts", hammer), ("stick-slip", slider)):
        print(f"| orbits, {name} | a random way | differences | {orbits(system, random):.0e} |")
    print(f"| responses, soft contacts | a random way | differences | {responses(random):.0e} |")
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
        orbit = sl.attractors(own, (0.0, 0.1)).isel(attractor=0)
        if str(orbit.attractor_type.item()) == "periodic":
            found = sl.sensitivity(own, orbit, to=[*own.values])
            worst = max(worst, beside(own, found.maximum_derivative.values, orbit, random))
    return worst


def responses(random):
    """Largest state of the responses over the frequency, all in one call."""
    seen, worst = sl.frequency_response(bumper, ("1.6 Hz", "2.4 Hz", SYSTEMS), (0.0, 0.1)), 0.0
    seen = seen.sel(response=(seen.response_period == 1) & (seen.response_type == "periodic"))
    found = sl.sensitivity(bumper, seen, to=[*bumper.values])
    for i, frequency in enumerate(seen.response_f.values):
        own = bumper.with_values(f=float(frequency))
        orbit = sl.attractors(own, (0.0, 0.1)).isel(attractor=0)
        worst = max(worst, beside(own, found.maximum_derivative.values[i], orbit, random))
    return worst


def beside(own, slopes, orbit, random):
    """Error of the slopes of an orbit's largest state, along a random way, beside differences."""
    to, each = [*own.values], []
    values = np.array([*own.values.values()])
    along = random.normal(size=len(to)) * values
    start = [orbit[f"attractor_{name}"].values[0] for name in own.states]
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


# -- fits ------------------------------------------------------------------------------------------
#: Unknowns of the rig, and their bounds.
FREE = {
    "upper_gap": (1e-4, 2e-3),
    "contact_stiffness": (1e3, 1e5),
    "damping_ratio": (0.005, 0.1),
}
#: Measurements whose search is repeated by differences: it takes long.
RIVALS = 10


def fits(count):
    """60 noisy periods (1 %) of rigs with random gaps, stiffnesses and dampings."""
    random, names = np.random.default_rng(20261126), list(FREE)
    low, high = np.array([*FREE.values()]).T
    rig = sl.models.delangre("a", force="4 N", frequency="8 Hz")
    at = np.arange(1, 60 * 24 + 1) / (24 * 8.0)
    off, took, flows, grown, rivals = [], [], [], [], []
    for number in range(count):
        truth = np.exp(np.log(low) + (0.15 + 0.7 * random.random(3)) * np.log(high / low))
        exact = sl.simulate(rig.with_values(**dict(zip(names, truth, strict=True))), at=at).x.values
        noise = 0.01 * np.sqrt(np.mean(exact**2))
        measured = exact + noise * random.standard_normal(len(at))
        begin = time.process_time()
        found = sl.fit(rig, {"t": at, "x": measured}, FREE, progress=False)
        took.append(time.process_time() - begin)
        off.append((found.value.values - truth) / found.standard_error.values)
        flows.append(int(found.flows))
        if number < RIVALS:
            both = [differences(rig, at, measured, jac) for jac in ("2-point", "3-point")]
            rivals.append(both)
            grown.append(flows[-1])
    inside = np.abs(off) < 2
    print(f"{count} measurements of the rig, 60 periods, noise of 1 %, three unknowns")
    for name, share in zip(names, inside.mean(axis=0), strict=True):
        print(f"  {name:18} within two standard errors in {share:.0%}")
    print(f"  wrong by more than five: {int((np.abs(off) > 5).any(axis=1).sum())} fits")
    print(f"  CPU time {np.median(took):.2f} s (median), {np.max(took):.1f} s (longest)")
    two, three = np.median(np.array(rivals), axis=0)
    print(
        f"  motions: {np.median(grown):.0f} (median of {len(grown)}), by forward differences "
        f"{two:.0f}, by central ones {three:.0f}; of all fits {np.median(flows):.0f}\n"
    )


def differences(rig, at, measured, jac):
    """Motions that SciPy's differences take for the four best of the same 17 places."""
    unknowns = Unknowns.of(rig, FREE)
    own = unknowns.shares(np.array([rig.values[name] for name in FREE]))
    places = np.concatenate([np.clip(own, INSIDE, 1 - INSIDE)[None], unknowns.scattered(16, 1)])
    count = [len(places)]

    def residuals(shares):
        values = dict(zip(FREE, unknowns.values(shares[None])[0].tolist(), strict=True))
        return sl.simulate(rig, at=at, values=values).x.values - measured

    def counted(shares):
        count[0] += 1
        return residuals(shares) / measured.std()

    misfit = [np.sum(residuals(place) ** 2) for place in places]
    for i in np.argsort(misfit, kind="stable")[:4]:
        least_squares(counted, places[i], jac=jac, bounds=(0, 1), max_nfev=60)
    return count[0]


# -- scatter ---------------------------------------------------------------------------------------
STUDY = """
[study]
name = "scatter"
[system]
model = "delangre"
case = "a"
force = "4 N"
frequency = "15 Hz"
[scatter]
samples = {sets}
start = {{ x = ["0 mm", "5 mm"], v = "0 m/s" }}
uncertain.upper_gap = {{ normal = ["0.4 mm", "0.02 mm"], low = "0.3 mm" }}
uncertain.contact_stiffness = {{ uniform = ["12 kN/m", "16 kN/m"] }}
uncertain.damping_ratio = {{ lognormal = ["0.03", 1.1] }}
"""


def scatter(sets):
    """Peaks and responses of the rig at 15 Hz, by one worker and by two."""
    took, hashes = [], []
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "study.toml").write_text(STUDY.format(sets=sets))
        for workers in ("1", "2"):
            command = [sys.executable, "-m", "saltus.cli", "run", "study.toml", "--out", workers]
            begin = time.perf_counter()
            subprocess.run(
                [*command, "--workers", workers, "--progress", "none"], cwd=folder, check=True,
                capture_output=True,
            )  # fmt: skip
            took.append(time.perf_counter() - begin)
            found = sl.load(Path(folder) / workers / "scatter.nc")
            hashes.append(found.attrs["result_hash"])
    print(f"{sets} sets of the rig at 15 Hz: gap, stiffness and damping uncertain")
    one, two = took
    print(f"  {one:.1f} s with one worker, {two:.1f} s with two ({one / two:.2f} times)")
    print(f"  equal bits: {hashes[0] == hashes[1]}")
    for q in (0.05, 0.5, 0.95):
        each = [found.sel(outcome="x peak", start=start, quantile=q) for start in (0, 1)]
        texts = [
            f"{1e3 * float(at.quantile_of):.4f} mm ({1e3 * float(at.quantile_low):.4f} to "
            f"{1e3 * float(at.quantile_high):.4f})"
            for at in each
        ]
        print(f"  peak, {q:4.0%}: from rest {texts[0]}, from 5 mm {texts[1]}")
    for k in range(found.sizes["response"]):
        at = found.isel(response=k)
        exists = share(at, "probability_exists")
        reached = [share(at.isel(start=start), "probability_reached") for start in (0, 1)]
        name = f"{at.response_type.item()} {int(at.response_period)}T"
        print(f"  {name}: exists {exists}; reached from rest {reached[0]}, from 5 mm {reached[1]}")


def share(at, name):
    low, high = (100 * float(at[f"{name}_{end}"]) for end in ("low", "high"))
    return f"{100 * float(at[name]):.2f} % ({low:.2f} to {high:.2f})"


def main():
    parts = {"derivatives", "fits", "scatter"}
    asked = argparse.ArgumentParser(description=__doc__)
    asked.add_argument("parts", nargs="*", metavar="derivatives, fits, scatter")
    asked.add_argument("--fits", type=int, default=100)
    asked.add_argument("--sets", type=int, default=10_000)
    given = asked.parse_args()
    wanted = set(given.parts) or parts
    if wanted - parts:
        asked.error(f"known: {', '.join(sorted(parts))}")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SaltusWarning)
        if "derivatives" in wanted:
            derivatives()
        if "fits" in wanted:
            fits(given.fits)
        if "scatter" in wanted:
            scatter(given.sets)


if __name__ == "__main__":
    main()
