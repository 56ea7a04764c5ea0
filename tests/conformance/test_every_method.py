"""Every method wherever ``method=`` is taken: all answers are the exact ones within its errors, for
any number of threads, and pauses change nothing.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.flow import engine
from saltus.flow.methods import METHODS, Taylor
from saltus.study.tables.methods import METHODS as TABLES

RIG = sl.models.delangre("b", force="4 N", frequency="7 Hz")
START = np.random.default_rng(5).uniform((-1e-3, -0.1), (1e-3, 0.1), (6, 2))
MADE = {
    "RK4 ignore": sl.RK4("0.2 ms", "ignore"),
    "RK4 henon": sl.RK4("0.2 ms", "henon"),
    "RK4 inverse": sl.RK4("0.2 ms", "inverse"),
    "RK4 bisect": sl.RK4("0.2 ms", "bisect"),
    "ODE23": sl.ODE23(1e-6, 1e-9),
    "ODE45": sl.ODE45(1e-6, 1e-9),
    "ODE113": sl.ODE113(1e-7, 1e-10),
    "ODE15s": sl.ODE15s(1e-8, 1e-11),
}
every = pytest.mark.parametrize("method", MADE.values(), ids=MADE)


def test_none_is_missing_here():
    assert {one.name for one in MADE.values()} | {"Taylor"} == set(METHODS) == set(TABLES)


@every
def test_a_run_is_the_same_in_any_threads_and_pieces(method, monkeypatch):
    def run(**more):
        return sl.simulate(RIG, START, 5, samples=7, method=method, time_errors="local", **more)

    whole = run(threads=1)
    assert whole.equals(run(threads=3))
    monkeypatch.setattr(engine, "SLICE", 20)
    assert whole.equals(run(threads=1))
    exact = sl.simulate(RIG, START, 5, samples=7)
    assert np.abs(whole.x - exact.x).max() < 1e-6  # [m], of some mm
    if method.records_contacts:
        assert np.abs(whole.contact_time.values - exact.contact_time.values).max() < 1e-4


@every
def test_orbits_are_the_exact_ones(method):
    exact, found = (sl.attractors(RIG, START, method=one) for one in (Taylor(), method))
    assert found.attractor_type.values.tolist() == exact.attractor_type.values.tolist()
    np.testing.assert_allclose(found.attractor_peak, exact.attractor_peak, rtol=1e-4)
    frequency = ("7 Hz", "8 Hz", 2)
    exact, found = (sl.frequency_response(RIG, frequency, method=one) for one in (Taylor(), method))
    np.testing.assert_allclose(found.peak, exact.peak, rtol=1e-4)
    exact, found = (
        sl.bifurcation_diagram(RIG, {"frequency": frequency}, method=one)
        for one in (Taylor(), method)
    )
    assert found.type.values.tolist() == exact.type.values.tolist()


def test_all_are_compared_side_by_side():
    table = sl.compare_methods(
        RIG, sl.frequency_response, list(MADE.values()), frequency=("7 Hz", "8 Hz", 2)
    )
    assert table.sizes["method"] == 1 + len(MADE)
    assert (table["method_agreement"] == 1.0).all()
    assert (table["step_error"].isel(method=slice(1, None)) > 0.0).all()
    assert (table["steps_per_period"] > 0.0).all()
    maps = sl.compare_methods(
        RIG,
        sl.basins,
        [sl.RK4("2 ms", "henon"), sl.ODE23(1e-3, 1e-6)],
        x=("-1 mm", "1 mm", 4),
        v=("-0.1 m/s", "0.1 m/s", 4),
    )
    assert (maps["method_agreement"] == 1.0).all()
