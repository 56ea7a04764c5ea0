"""Questions in chunks: one outcome, whoever computes it; what is there is kept; what is damaged is
found.
"""

from __future__ import annotations

import itertools
from contextlib import nullcontext

import numpy as np
import pytest

from saltus.analysis.attractors import divided_grid
from saltus.analysis.motion import divided
from saltus.errors import SaltusWarning, StudyError
from saltus.results import load
from saltus.results.store.arrays import packed, unpacked
from saltus.results.store.store import Store, StoreError
from saltus.study.read import parse
from saltus.study.run.running import Resources
from saltus.study.run.status import status_tables
from saltus.study.run.study import run_study, turns

pytestmark = pytest.mark.slow

HEAD = """
[study]
name = "divided"
[system]
model = "delangre"
case = "b"
force = "4 N"
"""
#: Kinds over two parameters at six values, with two starts each: orbits of several periods, and
#: chaos.
MAP = """
[[bifurcation_diagram]]
name = "map"
vary.contact_stiffness = ["25 kN/m", "60 kN/m"]
vary.frequency = ["16 Hz", "17 Hz", "20 Hz"]
start = { x = ["0 mm", "2 mm"], v = "0 m/s" }
"""
#: Responses and the branch that they lie on.
RESPONSE = """
[frequency_response]
frequency = { first = "14 Hz", last = "14.1 Hz", count = 2 }
start = { x = ["0 mm", "1 mm"], v = "0 m/s" }
"""
#: Sets of uncertain values, of which the system refuses some, with two starts each.
SCATTER = """
[scatter]
samples = 8
start = { x = ["0 mm", "5 mm"], v = "0 m/s" }
outputs.stop = { formula = "contact_stiffness*max(x - upper_gap, 0)", unit = "N" }
uncertain.upper_gap = { normal = ["0.4 mm", "0.3 mm"] }
uncertain.frequency = { uniform = ["15 Hz", "18 Hz"] }
"""
#: Motions and derivatives: the last two frequencies are equal.
ROWS = """
[simulate]
t_end = "0.2 s"
start = { x = "1 mm", v = "0 m/s" }
values.frequency = ["15 Hz", "17 Hz", "20 Hz", "20 Hz"]
[sensitivity]
t_end = "0.2 s"
to = ["frequency", "upper_gap"]
start = { x = "1 mm", v = "0 m/s" }
values.frequency = ["15 Hz", "17 Hz", "20 Hz", "20 Hz"]
"""
#: A question that doesn't divide.
ONE = """
[simulate]
periods = 3
"""
SWEEP = """
[frequency_response]
frequency = { first = "15 Hz", last = "17 Hz", count = 3 }
start = "sweep_up"
"""


@pytest.fixture(autouse=True, scope="module")
def small():
    """Two trajectories in a chunk, or those of one value."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(divided_grid, "TRAJECTORIES", 2)
        patch.setattr(divided, "TOGETHER", 2)
        yield


class Run:
    """A study that is run without pictures; keeps what it says."""

    def __init__(self, folder, text=HEAD + MAP, **resources):
        folder.mkdir(exist_ok=True)
        self.folder, self.reports, self.said = folder, [], []
        self.outcome = run_study(
            parse(text),
            text,
            folder,
            None,
            Resources(**({"threads": 1} | resources)),
            self.reports.append,
            self.said.append,
            False,
        )

    @property
    def computed(self):
        return sum(one.computed for one in self.reports if one.last and one.what == "chunks")


def contents(folder):
    """The answers, but for the names of files, and every file of the stores but the locks."""
    files = {
        str(file.relative_to(folder)): file.read_bytes()
        for file in (folder / "stores").rglob("*")
        if file.is_file() and "locks" not in file.parts
    }
    return files, {file.name: file.read_bytes() for file in folder.glob("*.nc")}


@pytest.fixture(scope="module")
def whole(small, tmp_path_factory):
    """A run that nothing divides."""
    return Run(tmp_path_factory.mktemp("whole"))


@pytest.fixture(scope="module")
def chunks(small, tmp_path_factory):
    """The same in chunks, by one process."""
    return Run(tmp_path_factory.mktemp("chunks"), workers=1)


def test_the_study_is_one_that_can_tell(whole):
    """Several responses at one value, several periods, and a motion that never repeats."""
    kinds = load(whole.folder / "map.nc")
    assert "chaotic" in kinds["response_type"].values
    assert len(np.unique(kinds["response_period"])) > 2
    assert kinds.sizes["response"] > 6


@pytest.mark.slow
def test_chunks_change_no_bit(whole, chunks):
    assert chunks.computed == 6
    assert contents(chunks.folder)[1] == contents(whole.folder)[1]


def test_responses_and_their_branches(tmp_path):
    """The last of the jobs follows the branches."""
    plain = Run(tmp_path / "plain", HEAD + RESPONSE)
    for k in (1, 0):
        jobs = Run(tmp_path / "jobs", HEAD + RESPONSE, shard=(k, 2))
    assert jobs.computed == 1
    assert load(jobs.folder / "frequency-response.nc").sizes["branch"] > 0
    assert contents(jobs.folder)[1] == contents(plain.folder)[1]


@pytest.mark.slow
def test_sets_of_values(tmp_path):
    """What is told apart over all sets is told by the last of the jobs; sets that the system
    refuses are in no chunk.
    """
    with pytest.warns(SaltusWarning, match="refused"):
        plain = Run(tmp_path / "plain", HEAD + SCATTER)
    answer = load(plain.folder / "scatter.nc")
    sets = np.count_nonzero(answer["set_status"] == "computed")
    assert 0 < sets < 8
    assert answer.sizes["response"] > 1
    for k in (1, 0):
        with pytest.warns(SaltusWarning, match="refused") if not k else nullcontext():
            jobs = Run(tmp_path / "jobs", HEAD + SCATTER, shard=(k, 2))
    assert jobs.computed == (sets + 1) // 2
    assert contents(jobs.folder)[1] == contents(plain.folder)[1]


def test_motions_and_derivatives(tmp_path):
    plain = Run(tmp_path / "plain", HEAD + ROWS)
    for k in (1, 0):
        jobs = Run(tmp_path / "jobs", HEAD + ROWS, shard=(k, 2))
    assert jobs.computed == 2
    assert contents(jobs.folder)[1] == contents(plain.folder)[1]


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1)])
def test_shards(chunks, tmp_path, order):
    runs = [Run(tmp_path / "run", shard=(k, 3)) for k in order]
    assert [run.outcome.waiting for run in runs] == [["map"]] * 2 + [[]]
    assert [run.computed for run in runs] == [2, 2, 2]
    assert contents(tmp_path / "run") == contents(chunks.folder)


def test_a_run_without_shards_goes_on_with_what_they_left(chunks, tmp_path):
    Run(tmp_path / "run", shard=(1, 2))
    assert status_tables(tmp_path / "run")[0].rows[0][:2] == ("map", "3 of 6")
    rest = Run(tmp_path / "run")
    assert rest.computed == 3
    assert contents(tmp_path / "run") == contents(chunks.folder)


def test_a_full_disk_and_a_damaged_chunk(chunks, tmp_path, monkeypatch):
    """What was committed stays; what is damaged is told and computed again."""
    count, commit = itertools.count(), Store.commit

    def full(store, index, values):
        if next(count) == 2:
            raise StoreError("No space left on device")
        commit(store, index, values)

    with monkeypatch.context() as patch:
        patch.setattr(Store, "commit", full)
        with pytest.raises(StoreError, match="No space"):
            Run(tmp_path / "run", shard=(0, 1))
    first = sorted((tmp_path / "run").glob("stores/map-*/chunks/*.chunk"))[0]
    data = bytearray(first.read_bytes())
    data[200] ^= 4
    first.write_bytes(bytes(data))
    again = Run(tmp_path / "run")
    assert again.said == ["map: damaged chunks that are computed again: 1"]
    assert again.computed == 5
    assert contents(tmp_path / "run")[1] == contents(chunks.folder)[1]


def test_a_stop_keeps_a_part(tmp_path, monkeypatch):
    """The values whose chunks are there; the others weren't computed."""
    count, commit = itertools.count(), Store.commit

    def stopped(store, index, values):
        if next(count) == 2:
            raise KeyboardInterrupt
        commit(store, index, values)

    monkeypatch.setattr(Store, "commit", stopped)
    with pytest.raises(KeyboardInterrupt):
        Run(tmp_path / "run", HEAD + MAP, shard=(0, 1))
    kinds = load(tmp_path / "run" / "map-partial.nc")["type"].values.ravel()
    assert np.count_nonzero(kinds != "not_computed") == 4


def test_another_question_has_another_store(tmp_path):
    text = HEAD + MAP.replace('"16 Hz", "17 Hz", ', "")
    first = Run(tmp_path / "run", text, shard=(0, 1))
    second = Run(tmp_path / "run", text.replace('"4 N"', '"3 N"'), shard=(0, 1))
    assert (first.computed, second.computed) == (2, 2)
    assert len(list((tmp_path / "run" / "stores").iterdir())) == 2
    assert "values changed" in second.said[0]


def test_jobs_take_in_turn_what_cannot_be_divided(tmp_path):
    text = HEAD + ONE + SWEEP
    for k, name in ((1, "frequency-response.nc"), (0, "run.nc")):
        Run(tmp_path / f"job {k}", text, shard=(k, 2))
        Run(tmp_path / "jobs", text, shard=(k, 2))
        assert [*contents(tmp_path / f"job {k}")[1]] == [name]
    assert contents(tmp_path / "jobs")[1] == contents(Run(tmp_path / "plain", text).folder)[1]


def test_questions_that_need_each_other_go_to_one_job():
    class Asked:
        def __init__(self, stem, *needs):
            self.stem, self.needs = stem, needs

    asked = [Asked("a"), Asked("b"), Asked("c"), Asked("d", "map", "a"), Asked("e", "c", "d")]
    assert turns(asked) == [{"b"}, {"a", "c", "d", "e"}]


@pytest.mark.parametrize("resources", [{"workers": 2}, {"shard": (0, 2)}])
def test_what_cannot_be_divided_says_why(tmp_path, resources):
    with pytest.raises(StudyError, match=r"\[frequency_response\] sweeps: each value begins where"):
        Run(tmp_path / "run", HEAD + SWEEP, **resources)


def test_arrays_of_any_shape():
    """They come back as they were, their bytes don't depend on their order, and no other bytes are
    read as arrays.
    """
    random = np.random.default_rng(20261126)
    arrays = {
        "b": random.normal(size=(3, 0, 2)),
        "a": np.array(["eins", "zwölf", ""]),
        "c": random.normal(size=4) + 1j,
        "d": np.array(7, np.int8),
    }
    data = packed(arrays)
    assert packed(dict(reversed(arrays.items()))) == data
    back = unpacked(data)
    assert back is not None
    for name, array in arrays.items():
        assert back[name].shape == array.shape
        assert back[name].dtype == array.dtype
        np.testing.assert_array_equal(back[name], array)
    for other in (data[:-1], data + b"0", b"", b"[]\n", b'{"a":["<O8",[1]]}\n', b'{"a":1}\n'):
        assert unpacked(other) is None
