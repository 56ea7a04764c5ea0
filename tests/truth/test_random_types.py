"""Types of responses of random structures, beside growth along ten times as many periods, and the
points that come behind them.
"""

from __future__ import annotations

import time

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.attractors.aperiodic import FLOOR, SURE
from saltus.analysis.attractors.find_responses import motion_range
from saltus.analysis.attractors.growth import growth_rates
from saltus.flow.maps import Stroboscope

#: Blocks along which growth is measured again, and parts that tell its error.
BLOCKS, PARTS = 1500, 25


def strongly_driven(rng):
    """A chain of masses with up to three soft stops, which its force presses hard."""
    n, names = int(rng.integers(3, 8)), []
    stiffness = np.zeros((n, n))
    for i, k in enumerate(rng.uniform(5e3, 2e4, n)):
        names.append(f"u{i}")
        link = np.eye(n)[i] - (np.eye(n)[i - 1] if i else 0.0)
        stiffness += k * np.outer(link, link)
    contacts = [
        sl.Contact(
            place,
            stiffness=float(10 ** rng.uniform(3.5, 5.0)),
            gap=float(10 ** rng.uniform(-3.0, -2.0)),
            side=str(rng.choice(["both", "upper"])),
        )
        for place in rng.choice(names, int(rng.integers(1, 4)), replace=False)
    ]
    return sl.structure(
        np.eye(n),
        stiffness,
        damping_ratio=float(10 ** rng.uniform(-2.5, -1.5)),
        names=names,
        contacts=contacts,
        forces=[sl.Force("u0", float(10 ** rng.uniform(1.0, 2.5)))],
        frequency=10.0,
    ), np.sqrt(np.linalg.eigvalsh(stiffness)) / (2 * np.pi)


@pytest.mark.nightly
@pytest.mark.parametrize("seed", [pytest.param(time.time_ns() % 2**32, id="clock")])
def test_no_torus_is_chaos_and_long_orbits_go_on_repeating(seed):
    rng = np.random.default_rng(seed)
    for _ in range(30):
        system, natural = strongly_driven(rng)
        values = np.sort(rng.uniform(0.8 * natural[0], 1.1 * natural[-1], 3))
        found = sl.frequency_response(system, values.tolist(), progress=False)
        for i, kind in enumerate(found.response_type.values.tolist()):
            if kind not in ("quasi_periodic", "long_periodic"):
                continue
            one = found.isel(response=i)
            start = [np.ravel(one[f"response_{name}"])[0] for name in system.states]
            here = system.with_values(frequency=float(one.response_frequency))
            map_, state = Stroboscope(here, sl.Modal(), threads=1), np.array([start])
            scale = motion_range(map_, state)
            end, rates = growth_rates(map_, state, scale, BLOCKS)
            parts = np.array([part.mean() for part in np.array_split(rates[:, 0], PARTS)])
            error = parts.std(ddof=1) / np.sqrt(PARTS)
            assert parts.mean() <= SURE * error + FLOOR, (seed, kind)
            if kind == "long_periodic":
                period = int(one.response_period)
                points = map_.launch(end, period).advance(period)
                assert np.abs((points[:, -1] - end) / scale).max() < 1e-5, seed
