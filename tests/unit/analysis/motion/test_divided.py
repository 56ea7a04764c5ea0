"""Trajectories in chunks: the same bytes as all of them in one call, whatever is in a batch."""

from __future__ import annotations

import functools

import numpy as np
import pytest

import saltus as sl
from saltus.analysis.derivatives.divided import DividedSensitivity
from saltus.analysis.motion.divided import DividedMotions
from saltus.errors import ParameterError
from saltus.flow.engine import options_of
from saltus.interrupt import Interrupted
from saltus.results.store.store import Store

COUNT = 20
DEFAULTS = {"start": None, "values": None, "periods": None, "t_end": None}
MORE = {"outputs": None, "extremes": True, "t_start": 0.0, "samples": None, "keep": None}
RIG = sl.models.delangre("a", force="4 N")
BALL = sl.models.falling_ball()


def random_starts(seed):
    random = np.random.default_rng(seed)
    start = {"x": 2e-3 * random.normal(size=COUNT), "v": 0.1 * random.normal(size=COUNT)}
    return start, {"frequency": np.repeat(random.uniform(8, 30, COUNT // 2), 2)}


def in_chunks(division, folder, leave=()):
    """The Dataset of the chunks, which are computed in no order; but for some that are left out."""
    store = Store.create_or_resume(
        folder / "store", {}, shape=division.shape, chunk=division.cells, arrays=None, note={}
    )
    with store.lock():
        shared = division.share(1) if division.kept else None
        division.prepare()
        for index in reversed(store.missing()):
            if index not in leave:
                store.commit(index, division.chunk(index, shared))
        return division.finish(store, shared)


@pytest.mark.parametrize("together", [3, 17])
@pytest.mark.parametrize("more", [{"keep": 2}, {"until": "x > 7 mm"}])
def test_motions_with_periods_of_their_own(tmp_path, together, more):
    """A chunk may hold one frequency or several, and ends before others do."""
    start, values = random_starts(20261126)
    asked = DEFAULTS | {"start": start, "values": values, "t_end": 0.4} | more
    found = in_chunks(DividedMotions(RIG, None, asked, COUNT, together), tmp_path)
    assert found.identical(sl.simulate(RIG, **asked))


@pytest.mark.parametrize("until", [None, "v > 2 m/s"])
def test_motions_without_forcing(tmp_path, until):
    """How many samples there are follows from how many trajectories run together."""
    heights = np.random.default_rng(7).uniform(0.01, 2.0, COUNT)
    asked = DEFAULTS | {"start": {"x": heights, "v": 0.0}, "t_end": 1.0, "until": until}
    found = in_chunks(DividedMotions(BALL, None, asked, COUNT, 3), tmp_path)
    assert found.identical(sl.simulate(BALL, **asked))


def test_derivatives(tmp_path):
    """Contacts of all sizes, of trajectories with periods of their own."""
    start, values = random_starts(20261127)
    start = {name: one * 10.0 ** np.linspace(-6, 1, COUNT) for name, one in start.items()}
    asked = DEFAULTS | MORE | {"start": start, "values": values, "t_end": 0.3}
    asked |= {"to": ["frequency", "upper_gap", "x(0)"]}
    found = in_chunks(DividedSensitivity(RIG, None, asked, COUNT, 3), tmp_path)
    assert found.identical(sl.sensitivity(RIG, **asked))


def test_derivatives_at_the_slowest_contacts(tmp_path):
    """A slow contact is one beside the others of its own trajectory."""
    heights = 10.0 ** np.linspace(-20, 1, COUNT)
    asked = DEFAULTS | MORE | {"start": {"x": heights, "v": 0.0}, "t_end": 1.0, "samples": 4}
    asked |= {"to": ["restitution"], "values": {"restitution": np.full(COUNT, 0.5)}}
    found = in_chunks(DividedSensitivity(BALL, None, asked, COUNT, 3), tmp_path)
    assert found.identical(sl.sensitivity(BALL, **asked))


@sl.system(states="x v", forced_at="f")
def adrift(t, x, v, *, f=1.3, pull=2.0):
    return v, pull * sl.cos(2 * sl.pi * f * t)


def test_a_chunk_takes_no_other_method_than_the_rest(tmp_path):
    """Derivatives of a body that nothing ties to a place are unknown to the modal flow."""
    asked = DEFAULTS | MORE | {"start": {"x": np.zeros(COUNT), "v": 0.0}, "t_end": 0.1}
    division = DividedSensitivity(adrift, sl.Modal(), asked | {"to": ["pull"]}, COUNT, 3)
    with pytest.raises(ParameterError, match=r"adrift go together.*method=sl\.Taylor\(\)"):
        in_chunks(division, tmp_path)


@pytest.mark.parametrize("kind", [DividedMotions, DividedSensitivity])
def test_chunks_that_are_missing_are_said_to_be(tmp_path, kind):
    """What is there stands beside it as it is in the whole."""
    start, values = random_starts(5)
    asked = DEFAULTS | {"start": start, "values": values, "t_end": 0.2}
    verb = sl.simulate
    if kind is DividedSensitivity:
        asked, verb = asked | MORE | {"to": ["upper_gap"]}, sl.sensitivity
    whole = verb(RIG, **asked)
    with pytest.raises(Interrupted) as stopped:
        in_chunks(kind(RIG, None, asked, COUNT, 6), tmp_path, leave=[1])
    part, missing = stopped.value.partial, np.arange(6, 12)
    assert (part["status"].values[missing] == "not_computed").all()
    rest = np.setdiff1d(np.arange(COUNT), missing)
    for name in ("end_x", "status"):
        np.testing.assert_array_equal(part[name].values[rest], whole[name].values[rest])
    there = whole.sel(contact=~np.isin(whole["contact_trajectory"], missing))
    np.testing.assert_array_equal(part["contact_time"], there["contact_time"])
    np.testing.assert_array_equal(part["contact_trajectory"], there["contact_trajectory"])


def test_a_budget_is_that_of_the_trajectory_alone():
    periods = np.array([3.0, 700.5, 3.0, 1e6])
    for method in (sl.ODE45(), sl.Taylor(), sl.Modal()):
        alone = [options_of(method, one, 1)[0] for one in periods]
        np.testing.assert_array_equal(options_of(method, periods, 4), alone)


def test_derivatives_end_where_their_trajectory_ends():
    """Times of trajectories whose periods differ are in parts of each one's own."""
    asked = functools.partial(sl.sensitivity, RIG, ("1 mm", 0), t_end=0.5, to="frequency")
    both = asked(values={"frequency": [14.0, 20.0]}, samples=4)
    alone = asked(values={"frequency": [20.0]}, samples=4)
    assert both["end_time"].values.tolist() == [0.5, 0.5]
    np.testing.assert_array_equal(both["end_derivative"][1], alone["end_derivative"][0])
