"""Rule 12: one lane, one life. A trajectory is the same to the bit alone, among others, in any
order, on any threads, in any chunks.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from conformance.systems import bent, bits, differing

# these tests look at the status themselves
pytestmark = pytest.mark.filterwarnings("ignore::saltus.errors.SaltusWarning")

# A driven oscillator with a boundary that has stiffness, dashpot and preload: contacts, grazes,
# sliding and rest all occur in a batch.
SYSTEM = bent.with_values(
    spring=1.0,
    damping=0.02,
    cubic=0.3,
    force=1.1,
    stiffness=30.0,
    dashpot=0.1,
    boundary=0.4,
    frequency=0.19,
)
COUNT = 37  # no multiple of any lane width


def _starts(count=COUNT, seed=1):
    rng = np.random.default_rng(seed)
    x, v = rng.uniform(-2, 2, count), rng.uniform(-2, 2, count)
    x[:6], v[:6] = [0.4, 0.4, 0.4, 0.4, 0.0, -0.0], [0.0, 1.0, -1.0, 0.0, 0.0, -0.0]
    x[-4:], v[-4:] = x[:4], v[:4]
    return {"x": x, "v": v}


def _values(count=COUNT, seed=2):
    rng = np.random.default_rng(seed)
    values = {
        "frequency": rng.uniform(0.1, 0.6, count),
        "boundary": rng.uniform(-0.5, 1.0, count),
        "stiffness": 10.0 ** rng.uniform(0, 6, count),
        "preload": np.where(rng.random(count) < 0.3, rng.uniform(0, 1, count), 0.0),
        "force": rng.uniform(0.2, 3.0, count),
    }
    # these start on their boundary; the first of each is held there by a preload
    for some in (slice(0, 4), slice(-4, None)):
        values["boundary"][some], values["preload"][some] = 0.4, [9.0, 9.0, 0.0, 0.0]
    return values


def _run(start=None, values=None, system=SYSTEM, **options):
    return sl.simulate(
        system,
        start or _starts(),
        **{"periods": 12, "samples": 7, "values": values, "threads": 1, **options},
    )


@pytest.fixture(scope="module")
def batch():
    """The batch that the others are compared with, values of its own for each trajectory."""
    return _run(values=_values())


def _each(run):
    return [bits(run, i) for i in range(run.sizes["trajectory"])]


def test_the_batch_is_worth_the_comparison(batch):
    """Thousands of contacts, states that differ, starts on the boundary, one that slides from the
    start.
    """
    assert batch.sizes["contact"] > 1000
    assert len(np.unique(batch.end_x)) > 30
    assert {"ok", "sliding"} <= set(batch.status.values.tolist())
    assert float(batch.end_time[0]) == 0.0


def test_alone_or_in_a_batch(batch):
    """Each of 37 trajectories alone, its values given by with_values, is the one of the batch:
    samples, modes, contacts, counters, end.
    """
    values, start = _values(), _starts()
    owns = [
        SYSTEM.with_values(**{name: float(column[i]) for name, column in values.items()})
        for i in range(COUNT)
    ]
    alone = [
        bits(_run((float(x), float(v)), system=own))
        for x, v, own in zip(start["x"], start["v"], owns, strict=True)
    ]
    assert differing(alone, _each(batch)) == {}


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_permuted(batch, seed):
    order = np.random.default_rng(seed).permutation(COUNT)
    shuffled = _run(
        {k: a[order] for k, a in _starts().items()}, {k: a[order] for k, a in _values().items()}
    )
    wanted = _each(batch)
    assert differing(_each(shuffled), [wanted[i] for i in order]) == {}


def test_among_other_neighbours(batch):
    """The same trajectories between 40 others, every second place."""
    start, values, others, other_values = _starts(), _values(), _starts(seed=5), _values(seed=6)
    mixed = _run(
        {k: np.stack([others[k], start[k]], 1).ravel() for k in start},
        {k: np.stack([other_values[k], values[k]], 1).ravel() for k in values},
    )
    assert differing(_each(mixed)[1::2], _each(batch)) == {}


@pytest.mark.parametrize(
    "lanes",
    [pytest.param(2, marks=pytest.mark.nightly), 4, pytest.param(8, marks=pytest.mark.nightly), 16],
)
def test_lanes(batch, lanes):
    """Any number of lanes gives the digits of the default."""
    assert (
        differing(_each(_run(values=_values(), method=sl.Taylor(lanes=lanes))), _each(batch)) == {}
    )


@pytest.mark.parametrize("threads", [2, 3])
def test_threads(batch, threads, monkeypatch):
    monkeypatch.setattr("saltus.flow.engine.CHUNK", 4)
    assert differing(_each(_run(values=_values(), threads=threads)), _each(batch)) == {}


@pytest.mark.parametrize("chunk", [1, 2, 5, 36])
def test_chunks(batch, chunk, monkeypatch):
    monkeypatch.setattr("saltus.flow.engine.CHUNK", chunk)
    assert differing(_each(_run(values=_values())), _each(batch)) == {}


@pytest.mark.parametrize("slice_", [1, 2, 3, 17, 100])
def test_paused_and_resumed(batch, slice_, monkeypatch):
    """The kernel pauses after so many steps and is called again: nothing of a lane's life is lost,
    start on a boundary included.
    """
    monkeypatch.setattr("saltus.flow.engine.SLICE", slice_)
    assert differing(_each(_run(values=_values())), _each(batch)) == {}


@pytest.mark.parametrize("spare", [1, 2, 9])
def test_table_of_contacts_that_fills_up(batch, spare, monkeypatch):
    """A table of contacts barely larger than what a step of all lanes may need: it is emptied again
    and again, nothing is lost.
    """
    monkeypatch.setattr("saltus.flow.engine.RECORDS", spare)
    assert differing(_each(_run(values=_values())), _each(batch)) == {}


def test_all_at_once(batch, monkeypatch):
    """Tiny chunks, slices and tables on two threads."""
    for name, value in (("CHUNK", 3), ("SLICE", 5), ("RECORDS", 4)):
        monkeypatch.setattr(f"saltus.flow.engine.{name}", value)
    assert differing(_each(_run(values=_values(), threads=2)), _each(batch)) == {}


def test_stroboscope_and_simulate_agree(batch):
    """Two ways to ask for the states at whole periods: the same bits; asking for fewer samples
    changes nothing.
    """
    strobe = sl.stroboscope(SYSTEM, _starts(), 12, values=_values(), threads=1)
    for name in ("x", "v"):
        # NaN after a trajectory that slid
        assert np.array_equal(strobe[name].values, batch[name].values[:, ::7], equal_nan=True)
    assert (strobe.steps == batch.steps).all()
    few = _run(values=_values(), samples=1, keep=2)
    assert (few.end_x.values == batch.end_x.values).all()
    assert (
        few.contact_time.values
        == batch.contact_time.values[np.isin(batch.contact_time, few.contact_time)]
    ).all()


def test_same_call_twice(batch):
    assert differing(_each(_run(values=_values())), _each(batch)) == {}


def test_rig_in_any_company():
    """The rig: 24 starts in case b alone, reversed, and in small chunks on two threads."""
    rng = np.random.default_rng(3)
    x, v = rng.uniform(-5e-3, 5e-3, 24), rng.uniform(-1, 1, 24)
    rig = sl.models.delangre("b")
    together = _each(_run({"x": x, "v": v}, system=rig))
    backwards = _each(_run({"x": x[::-1], "v": v[::-1]}, system=rig))
    assert differing(together, backwards[::-1]) == {}
    assert (
        differing(
            [bits(_run(pair, system=rig)) for pair in zip(x.tolist(), v.tolist(), strict=True)],
            together,
        )
        == {}
    )
