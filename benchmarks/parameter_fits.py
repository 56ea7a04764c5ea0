"""Fits of synthetic measurements: histories, a response with a jump, data that decide nothing, and
input that can't be fitted. See parameters.py.
"""

from __future__ import annotations

import time

import numpy as np
from scipy.optimize import least_squares

import saltus as sl
from saltus.analysis.fits.unknowns import INSIDE, Unknowns
from saltus.errors import SaltusError

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


def jump(random):
    """Sizes of a response that bends to the right, measured on both of its branches."""
    rig = sl.models.delangre("a", force="4 N")
    truth = {"upper_gap": 4.5e-4, "contact_stiffness": 1e4}
    frequencies, sizes = [], []
    for sweep in ("sweep_up", "sweep_down"):
        seen = sl.frequency_response(rig.with_values(**truth), ("9 Hz", "19 Hz", 11), sweep)
        frequencies += seen.response_frequency.values.tolist()
        sizes += seen.output_amplitude.sel(output="x").values.tolist()
    noise = 0.01 * np.sqrt(np.mean(np.square(sizes)))
    points = np.array(sizes) + noise * random.standard_normal(len(sizes))
    free = {name: FREE[name] for name in truth}
    begin = time.process_time()
    found = sl.fit(rig, {"frequency": frequencies, "x": points}, free, starts=4, progress=False)
    took = time.process_time() - begin
    off = (found.value.values - [*truth.values()]) / found.standard_error.values
    up, down = np.split(np.array(sizes), 2)
    apart = np.max(np.abs(up / down[::-1]))
    print(f"A response of {len(sizes)} points, twice at each frequency, noise of 1 % of its rms")
    print(f"  at a frequency the branches differ by up to {apart:.0f} times")
    print(f"  off by {' and '.join(f'{one:.1f}' for one in off)} standard errors; {took:.1f} s\n")


def undecided(random):
    """A motion that never reaches its stop says nothing of the stop."""
    rig = sl.models.delangre("a", force="0.05 N", frequency="8 Hz")
    run = sl.simulate(rig, periods=40, samples=24)
    noise = 0.01 * float(run.x.std())
    measured = run.x.values + noise * random.standard_normal(run.sizes["time"])
    found = sl.fit(rig, {"t": run.time.values, "x": measured}, FREE, progress=False)
    print(f"A motion without a contact ({run.sizes['contact']}), the same unknowns: what is said")
    for line in sl.describe(found).splitlines()[2:]:
        print(f"  {line.strip()}")
    print()


def refused():
    """A sentence for each input that can't be fitted."""
    rig = sl.models.delangre("a", force="4 N", frequency="8 Hz")
    t, gap = np.arange(1, 400) / 200.0, {"upper_gap": FREE["upper_gap"]}
    x = sl.simulate(rig, at=t).x.values
    asked = {
        "NaN": ({"t": t, "x": np.where(t > 1, x, np.nan)}, gap, {}),
        "a wrong unit": ({"t": t, "x": (x, "kg")}, gap, {}),
        "unsorted times": ({"t": t[::-1], "x": x}, gap, {}),
        "a constant signal": ({"t": t, "x": 0 * x}, gap, {}),
        "bounds reversed": ({"t": t, "x": x}, {"upper_gap": ("2 mm", "0.1 mm")}, {}),
        "a name misspelt": ({"t": t, "x": x}, {"uper_gap": (1e-4, 2e-3)}, {}),
        "zero noise": ({"t": t, "x": x}, gap, {"noise": 0.0}),
        "a file for a record": None,
    }
    print("Input that can't be used")
    for what, call in asked.items():
        try:
            if call is None:
                sl.recorded("base.csv")
            else:
                sl.fit(rig, *call[:2], progress=False, **call[2])
            print(f"  {what}: ACCEPTED")
        except SaltusError as error:
            print(f"  {what}: {error}")
    print()
