"""Rule 12 by the modal flow: the trajectory of a structure is the same to the bit alone, among
others, in any order, on any threads, in any chunks, whatever becomes of its neighbours.
"""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from conformance.systems import bits, differing
from saltus.flow import modal_tables

# these tests look at the status themselves
pytestmark = pytest.mark.filterwarnings("ignore::saltus.errors.SaltusWarning")

STIFFNESS = 400.0 * (2 * np.eye(5) - np.eye(5, k=1) - np.eye(5, k=-1))
#: Springs, a damper, a preload, a rigid stop: contacts, chatter, rest and release in one batch.
SYSTEM = sl.structure(
    np.eye(5), STIFFNESS, damping_ratio=0.02, modes=5, frequency=2.3,
    contacts=[
        sl.Contact("x1", stiffness=900.0, gap=0.01, side="both", name="soft"),
        sl.Contact("x5", stiffness=4e4, gap=0.02, damping=15.0, name="damped"),
        sl.Contact("x4", stiffness=2e3, gap=0.001, preload=1.0, side="lower", name="pressed"),
        sl.Contact("x3", restitution=0.6, gap=0.004, name="rigid"),
    ],
    forces=[sl.Force("x5", 20.0, phase=0.3, name="drive"), sl.Force("x3", 8.0, harmonic=0)],
)  # fmt: skip
METHOD = sl.Modal(max_events=150)
COUNT = 23  # no multiple of any lane width
GROWS, BEYOND = 5, 11  # a motion that overflows, a start beyond the rigid stop


def _starts(count=COUNT, seed=1):
    rng = np.random.default_rng(seed)
    start = rng.normal(0, 1, (count, 10)) * np.repeat([0.004, 0.1], 5)
    start[::4] = 0.0
    if count > BEYOND:
        start[GROWS], start[BEYOND, :5] = 0.0, 1.0
    return start


def _values(count=COUNT, seed=2):
    rng = np.random.default_rng(seed)
    spring = np.full(count, 2e3)
    spring[GROWS::COUNT] = -1e7
    return {
        "pressed_stiffness": spring,
        "frequency": rng.uniform(1.0, 6.0, count),
        "soft_gap": rng.choice([0.0, 0.005, 0.01], count),
        "damped_stiffness": 10.0 ** rng.uniform(2, 9, count),
        "drive": rng.choice([0.0, 5.0, 20.0, 60.0], count),
        "rigid_restitution": rng.choice([0.0, 0.6, 0.9, 1.0], count),
    }


def _run(start=None, values=None, system=SYSTEM, **options):
    given = {"periods": 6, "samples": 7, "threads": 1, "time_errors": "local", "progress": False}
    start = _starts() if start is None else start
    return sl.simulate(system, start, values=values, method=METHOD, **(given | options))


@pytest.fixture(scope="module")
def batch():
    """The batch that the others are compared with, values of its own for each trajectory."""
    return _run(values=_values())


def _each(run):
    return [bits(run, i) for i in range(run.sizes["trajectory"])]


def test_the_batch_is_worth_the_comparison(batch):
    assert batch.attrs["method"] == "Modal"
    assert batch.sizes["contact"] > 500
    assert {"ok", "invalid", "budget_events", "nonfinite"} <= set(batch.status.values.tolist())
    assert {"crossing", "impact", "hold", "release"} <= set(batch.contact_kind.values.tolist())


@pytest.mark.slow
def test_alone_or_in_a_batch(batch):
    """Each of 23 trajectories alone, its values given by with_values, is the one of the batch."""
    values, start = _values(), _starts()
    owns = [
        SYSTEM.with_values(**{name: float(column[i]) for name, column in values.items()})
        for i in range(COUNT)
    ]
    alone = [bits(_run(z, system=own)) for z, own in zip(start, owns, strict=True)]
    assert differing(alone, _each(batch)) == {}


@pytest.mark.parametrize("seed", [0, 1])
def test_permuted(batch, seed):
    order = np.random.default_rng(seed).permutation(COUNT)
    shuffled = _run(_starts()[order], {name: one[order] for name, one in _values().items()})
    wanted = _each(batch)
    assert differing(_each(shuffled), [wanted[i] for i in order]) == {}


def test_among_other_neighbours(batch):
    """The same trajectories between as many others, every second place."""
    start, values, others, other_values = _starts(), _values(), _starts(seed=5), _values(seed=6)
    mixed = _run(
        np.stack([others, start], 1).reshape(-1, 10),
        {name: np.stack([other_values[name], values[name]], 1).ravel() for name in values},
    )
    assert differing(_each(mixed)[1::2], _each(batch)) == {}


@pytest.mark.parametrize(
    ("name", "value"), [("CHUNK", 1), ("CHUNK", 5), ("SLICE", 3), ("RECORDS", 9)]
)
def test_in_chunks_slices_and_small_tables(batch, name, value, monkeypatch):
    monkeypatch.setattr(f"saltus.flow.engine.{name}", value)
    assert differing(_each(_run(values=_values())), _each(batch)) == {}


def test_on_threads_with_few_tables_in_memory(batch, monkeypatch):
    """Contact states are dropped and made anew, chunk by chunk on two threads."""
    for name, value in (("CHUNK", 3), ("SLICE", 5), ("RECORDS", 9)):
        monkeypatch.setattr(f"saltus.flow.engine.{name}", value)
    monkeypatch.setattr(modal_tables, "MOST_BYTES", 2**16)
    assert differing(_each(_run(values=_values(), threads=2)), _each(batch)) == {}
