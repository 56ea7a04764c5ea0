"""Contacts between mirrored points of mirrored structures, which load moves alike: the gap is what
rounding leaves of the motion, and the contact does nothing.
"""

from __future__ import annotations

import warnings
from itertools import product

import numpy as np
import pytest

import saltus as sl
from saltus.errors import SaltusWarning

TIMES = np.arange(2e-3, 1.0, 2e-3)
RECORD = sl.recorded(np.r_[0.0, TIMES], np.r_[0.0, np.sin(40 * TIMES) + TIMES], "m/s^2")
LOADS = {"harmonic": sl.Base("x", "3 m/s^2"), "a record": sl.Base("x", RECORD)}
LAWS = {
    "soft": {"stiffness": 1e3}, "stiff": {"stiffness": 1e6}, "very stiff": {"stiffness": 1e9},
    "damped": {"stiffness": 1e4, "damping": 5.0}, "rigid": {"restitution": 0.5},
}  # fmt: skip


def mirrored(rng, load, laws, modes):
    """A chain that is its own mirror image, with a contact between a mass and its image; the same
    without it.
    """
    half = int(rng.integers(2, 8))
    springs, masses = rng.uniform(0.5e4, 2e4, half), rng.uniform(0.5, 2.0, half)
    springs = np.concatenate([springs, rng.uniform(0.5e4, 2e4, 1), springs[::-1]])
    stiffness = np.diag(springs[:-1] + springs[1:])
    stiffness -= np.diag(springs[1:-1], 1) + np.diag(springs[1:-1], -1)
    at = int(rng.integers(1, half + 1))
    contact = sl.Contact(f"x{at}", to=f"x{2 * half + 1 - at}", gap=0.0, **laws)
    given = {"modes": modes and min(modes, 2 * half), "damping_ratio": 0.02, "base": load}
    given |= {"sensors": {"at": f"x{at}"}}
    given |= {} if load is LOADS["a record"] else {"frequency": float(rng.uniform(2, 30))}
    mass = np.diag(np.concatenate([masses, masses[::-1]]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a structure without contacts, and one with stiff ones
        return [sl.structure(mass, stiffness, **given, **more) for more in
            ({"contacts": [contact]}, {})]  # fmt: skip


@pytest.mark.parametrize("load", LOADS)
def test_a_contact_between_mirrored_points_does_nothing(load):
    """The motion is that without the contact, to rounding. Rounding may be taken for sliding, here
    in one case of ten. Where the terms that cancel in a gap don't count for its rounding half of
    the cases end so, or as a fault of saltus.
    """
    good = []
    for law, modes, seed in product(LAWS, (None, 3), range(3)):
        made, free = mirrored(np.random.default_rng(seed), LOADS[load], LAWS[law], modes)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", SaltusWarning)
            run, alone = (sl.simulate(one, t_end=1.0, samples=100, method=sl.Modal(),
                progress=False) for one in (made, free))  # fmt: skip
        good.append(str(run.status.values) in ("ok", "resting", "graze_unresolved"))
        scale = np.abs(alone["at"].values).max()
        assert np.nanmax(np.abs(run["at"].values - alone["at"].values)) <= 1e-9 * scale, seed
    assert np.mean(good) > 0.75
