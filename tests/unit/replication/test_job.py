"""What is kept of a job, and when it is computed again."""

from __future__ import annotations

import numpy as np
import pytest

from saltus.replication.job import Job, Shelf
from saltus.results import AttractorTable, attractors_dataset

CALLS = []


def result(value):
    """A small Dataset that any file can hold."""
    table = AttractorTable(
        kind=["periodic"], period=np.array([1]), contacts=np.array([2.0]), itinerary=[""], peak=np.array([value]), rms=np.array([value]),
        margin=np.array([1.0]), multipliers=np.array([[0.5, 0.1]]), exponent=np.array([-1.0]), exponent_error=np.array([0.0]),
        points=[np.array([[value, 0.0]])],
    )  # fmt: skip
    return attractors_dataset(states=("x", "v"), units={"x": "m", "v": "m/s"}, attractors=table)


def compute(settings, inputs, show):
    CALLS.append(settings["value"])
    show(0.5)
    return result(settings["value"] + sum(float(ds["attractor_peak"][0]) for ds in inputs.values()))


def stopped(settings, inputs, show):
    raise KeyboardInterrupt


@pytest.fixture
def shelf(tmp_path):
    CALLS.clear()
    return Shelf(tmp_path)


def test_the_second_time_nothing_is_computed(shelf):
    job = Job("fig1/a b", {"value": 1.0}, compute)
    first = shelf.result(job, {}, lambda _: None)
    again = shelf.result(job, {}, lambda _: None)
    assert CALLS == [1.0]
    assert first.attrs["result_hash"] == again.attrs["result_hash"]
    assert (shelf.computed, shelf.kept) == (["fig1/a b"], ["fig1/a b"])


def test_another_setting_is_another_result(shelf):
    shelf.result(Job("one", {"value": 1.0}, compute), {}, lambda _: None)
    shelf.result(Job("one", {"value": 2.0}, compute), {}, lambda _: None)
    assert CALLS == [1.0, 2.0]


def test_another_input_is_another_result(shelf):
    job = Job("two", {"value": 1.0}, compute, ("one",))
    for value in (1.0, 1.0, 2.0):
        shelf.result(job, {"one": result(value)}, lambda _: None)
    assert CALLS == [1.0, 1.0]


def test_what_was_stopped_is_computed_again(shelf):
    with pytest.raises(KeyboardInterrupt):
        shelf.result(Job("one", {"value": 1.0}, stopped), {}, lambda _: None)
    assert not list(shelf.folder.iterdir())
    shelf.result(Job("one", {"value": 1.0}, compute), {}, lambda _: None)
    assert CALLS == [1.0]


def test_a_result_without_its_identity_counts_for_nothing(shelf):
    job = Job("one", {"value": 1.0}, compute)
    shelf.result(job, {}, lambda _: None)
    shelf.files(job)[1].unlink()
    shelf.result(job, {}, lambda _: None)
    assert CALLS == [1.0, 1.0]


@pytest.mark.parametrize("what", [0, 1])
def test_a_damaged_file_is_computed_again(shelf, what):
    job = Job("one", {"value": 1.0}, compute)
    shelf.result(job, {}, lambda _: None)
    file = shelf.files(job)[what]
    file.write_bytes(file.read_bytes()[:-40])
    shelf.result(job, {}, lambda _: None)
    assert CALLS == [1.0, 1.0]


def test_other_code_is_another_result(shelf, monkeypatch):
    job = Job("one", {"value": 1.0}, compute)
    shelf.result(job, {}, lambda _: None)
    monkeypatch.setattr("saltus.replication.job.code_hash", lambda: "other")
    shelf.result(job, {}, lambda _: None)
    assert CALLS == [1.0, 1.0]
