"""Where the search for periodic orbits begins, how it tells of its work, and what it hands out."""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.closed import search
from saltus.errors import ParameterError

CHAIN = 900.0 * (2 * np.eye(4) - np.eye(4, k=1) - np.eye(4, k=-1))


def forced(**options):
    about = {
        "modes": 4, "damping_ratio": 0.05, "frequency": "4 Hz",
        "contacts": [sl.Contact("x4", stiffness=3e3, gap="2 mm")],
        "forces": [sl.Force("x1", "6 N")],
    }  # fmt: skip
    return sl.structure(np.eye(4), CHAIN, **about | options)


def test_without_a_box_starts_lie_on_the_motion_from_rest():
    """What the motion from rest settles to is found, and the search is that from its points."""
    found = sl.periodic_orbits(forced(), periods=1, progress=False)
    run = sl.simulate(forced(), periods=63, samples=1, progress=False)
    points = {name: run[name].values[::4] for name in forced().states}
    given = sl.periodic_orbits(forced(), points, periods=1, progress=False)
    assert found.attrs["starts"] == 16
    assert found.sizes["orbit"] > 0
    np.testing.assert_allclose(found["orbit_q1"], given["orbit_q1"], rtol=1e-9)
    settled = sl.attractors(forced(), progress=False)
    peaks = found["orbit_peak"].values[found["orbit_stable"].values == 1]
    assert np.abs(peaks / float(settled["attractor_peak"][0]) - 1).min() < 1e-6


def test_the_box_may_be_over_what_sensors_show():
    box = {"deflection at stop": ("-2 mm", "2 mm"), "velocity at stop": (-0.1, 0.1)}
    found = sl.periodic_orbits(forced(), "random 8", box=box, periods=1, progress=False)
    rest = sl.periodic_orbits(forced(), periods=1, progress=False)
    shared = np.abs(found["orbit_peak"].values[:, None] / rest["orbit_peak"].values - 1)
    assert shared.min() < 1e-9
    with pytest.raises(ParameterError, match=r"no sensor.*deflection at stop"):
        sl.periodic_orbits(forced(), box={"deflection at stp": (-1, 1)}, progress=False)


def test_the_bar_moves_and_ctrl_c_hands_out_what_is_found(monkeypatch):
    monkeypatch.setattr(search, "TOGETHER", 1)  # as of a hundred states
    shares: list[float] = []
    found = sl.periodic_orbits(forced(), periods=1, progress=shares.append)
    assert shares == sorted(shares)
    assert [shares[0], shares[-1]] == [0.05, 1.0]
    assert {0.1, 0.325, 0.55} < set(np.round(shares, 9).tolist())  # eight starts, the other eight

    def stop(share: float) -> None:
        if share > 0.6:  # Newton's method has come from all starts
            raise KeyboardInterrupt

    with pytest.raises(sl.Interrupted) as caught:
        sl.periodic_orbits(forced(), periods=1, progress=stop)
    partial = caught.value.partial
    assert partial["orbit_peak"].values.tolist() == found["orbit_peak"].values.tolist()
    assert not partial["search_exhausted"].any()
