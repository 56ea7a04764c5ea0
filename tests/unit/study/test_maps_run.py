"""Studies of basins as they run: one outcome, whoever computes it; what is there is kept; what is
damaged is found.
"""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest

import saltus as sl
from saltus.analysis.basins import pipeline
from saltus.errors import StudyError
from saltus.results import load
from saltus.results.store.store import Store, StoreError
from saltus.study import identity
from saltus.study.read import parse
from saltus.study.run import copies, maps
from saltus.study.run.copies import copy_of
from saltus.study.run.running import Resources
from saltus.study.run.status import status_table, status_tables, stores
from saltus.study.run.study import run_study
from small_maps import small_maps
from small_study import maps_of, small_study

#: 576 starts in 12 chunks; four attractors.
STUDY = small_study(24)
#: 64 starts in two chunks, twice.
PAIR = STUDY.replace("count = 24", "count = 8") + (
    '[[basins.map]]\nname = "16 Hz"\n[[basins.map]]\nname = "7 Hz"\nvalues = { frequency = "7 Hz" '
    '}\ncompare = "16 Hz"\n'
)


@pytest.fixture(autouse=True, scope="module")
def small():
    with small_maps(48):
        yield


class Run:
    """A study that is run; keeps what it says."""

    def __init__(self, folder, text=STUDY, pictures=False, **resources):
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
            pictures,
        )

    @property
    def computed(self):
        return self.reports[-1].computed if self.reports else 0


def contents(folder):
    """Every file of its stores but the locks."""
    files = {
        str(file.relative_to(folder)): file.read_bytes()
        for file in (folder / "stores").rglob("*")
        if file.is_file()
    }
    return {name: data for name, data in files.items() if "/locks/" not in name}


@pytest.fixture(scope="module")
def whole(small, tmp_path_factory):
    """A run that nothing disturbed, by one thread."""
    return Run(tmp_path_factory.mktemp("whole"))


def forget(folder, indices, name="basins"):
    """Make chunks missing, as if the run had been stopped before them."""
    for index in indices:
        (folder / "stores" / name / "chunks" / f"{index}.chunk").unlink()


def copied(whole, folder):
    import shutil

    shutil.copytree(whole.folder, folder)
    return folder


# -- one outcome -----------------------------------------------------------------------------------
def test_the_study_is_one_that_can_tell(whole):
    """Twelve chunks, four attractors, several of them in most chunks: a chunk in the wrong place
    would be seen.
    """
    ds = load(whole.folder / "basins.nc")
    assert ds.sizes["attractor"] == 4
    parts = ds.basin.values.reshape(12, 48)
    assert len(np.unique(parts, axis=0)) == 12
    assert whole.computed == 12
    assert len([name for name in contents(whole.folder) if "/chunks/" in name]) == 12


def test_two_threads(whole, tmp_path):
    two = Run(tmp_path / "two", threads=2)
    assert contents(two.folder) == contents(whole.folder)
    assert (
        load(two.folder / "basins.nc")
        .drop_attrs()
        .identical(load(whole.folder / "basins.nc").drop_attrs())
    )


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_shards(whole, tmp_path, order):
    """Two jobs that share the folder and nothing else, in either order; the first can't finish the
    map, the second does.
    """
    first = Run(tmp_path / "run", shard=(order[0], 2))
    assert first.outcome.waiting == ["small"]
    assert first.outcome.files == []
    assert first.computed == 6
    assert not (first.folder / "basins.nc").exists()
    second = Run(tmp_path / "run", shard=(order[1], 2))
    assert second.outcome.waiting == []
    assert contents(second.folder) == contents(whole.folder)
    assert (
        load(second.folder / "basins.nc")
        .drop_attrs()
        .identical(load(whole.folder / "basins.nc").drop_attrs())
    )


def test_more_shards_than_chunks(tmp_path):
    text = STUDY.replace("count = 24", "count = 8")  # two chunks
    runs = [Run(tmp_path / "run", text, shard=(k, 3)) for k in (2, 1, 0)]
    assert [run.computed for run in runs] == [0, 1, 1]
    assert [run.outcome.waiting for run in runs] == [["small"], ["small"], []]


def test_a_study_is_what_basins_returns(whole):
    """The store, its types and its files change nothing: labels, periods, table of attractors."""
    rig = sl.models.delangre("b", force="4 N", frequency="16 Hz")
    ds = sl.basins(
        rig, x=("-5 mm", "5 mm", 24), v=("-1 m/s", "1 m/s", 24), threads=1, progress=False
    )
    kept = load(whole.folder / "basins.nc")
    for name in ds.data_vars:
        np.testing.assert_array_equal(kept[name].values, ds[name].values, err_msg=name)
    assert kept.attrs["title"] == "small"
    assert kept.attrs["study"] == STUDY


# -- going on --------------------------------------------------------------------------------------
def test_only_what_is_missing_is_computed(whole, tmp_path):
    folder = copied(whole, tmp_path / "run")
    forget(folder, (0, 5, 11))
    (status,) = stores(folder)
    assert (status.done, status.total, status.damaged) == (9, 12, 0)
    again = Run(folder)
    assert again.computed == 3
    assert [report.done for report in again.reports] == sorted(
        report.done for report in again.reports
    )
    assert again.reports[-1].done == again.reports[-1].total == 12
    assert contents(folder) == contents(whole.folder)


def test_a_finished_study_computes_nothing(whole, tmp_path, monkeypatch):
    folder = copied(whole, tmp_path / "run")
    monkeypatch.setattr(
        pipeline.BasinPlan, "chunk", lambda *_: pytest.fail("a chunk is computed again")
    )
    monkeypatch.setattr(
        pipeline.BasinPlan, "scout", lambda *_: pytest.fail("attractors are looked for again")
    )
    again = Run(folder)
    assert again.outcome.waiting == []
    assert (
        load(folder / "basins.nc")
        .drop_attrs()
        .identical(load(whole.folder / "basins.nc").drop_attrs())
    )


@pytest.mark.parametrize("damage", ["cut", "bit", "place"])
def test_a_damaged_chunk_is_computed_again(whole, tmp_path, damage):
    folder = copied(whole, tmp_path / "run")
    file = folder / "stores" / "basins" / "chunks" / "7.chunk"
    if damage == "cut":
        file.write_bytes(file.read_bytes()[:-5])
    else:
        data = bytearray(file.read_bytes())
        data[20] ^= 4
        file.write_bytes(bytes(data))
    again = Run(folder)
    assert again.computed == 1
    assert again.said == ["small: damaged chunks that are computed again: 1"]
    assert contents(folder) == contents(whole.folder)


def test_damaged_attractors_are_found_again(whole, tmp_path):
    folder = copied(whole, tmp_path / "run")
    file = folder / "stores" / "basins" / "artifacts" / "attractors.json"
    file.write_bytes(file.read_bytes().replace(b"1", b"2", 1))
    forget(folder, (3,))
    Run(folder)
    assert contents(folder) == contents(whole.folder)


# -- another study ---------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ('"4 N"', '"4.1 N"', "values was .*4.0.*is .*4.1"),
        ("count = 24 }\naxes.v", "count = 23 }\naxes.v", "axes was .*in 24.*is .*in 23"),
        ('"-1 m/s"', '"-1.1 m/s"', r"axes was .*-1\.0.*is .*-1\.1"),
        (
            "[basins]",
            '[method]\nname = "Taylor"\norder = 22\n[basins]',
            "method options was .*20.*is .*22",
        ),
        ("[basins]", '[method]\nname = "ODE45"\n[basins]', "method was 'Taylor', is 'ODE45'"),
        ("[basins]", "[basins]\nperiods = 100", "periods was '2000', is '100'"),
    ],
)
def test_a_changed_study_is_refused(whole, tmp_path, old, new, told):
    """By name, and everything is left as it was: the copy of the study too."""
    folder = copied(whole, tmp_path / "run")
    before = {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}
    with pytest.raises(StoreError, match=f"made from something else: .*{told}"):
        Run(folder, STUDY.replace(old, new))
    assert {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()} == before


def test_other_code_is_refused(whole, tmp_path, monkeypatch):
    folder = copied(whole, tmp_path / "run")
    monkeypatch.setattr(identity, "code_hash", lambda: "another")
    with pytest.raises(StoreError, match=r"code was .* is 'another'"):
        Run(folder)


def test_chunks_of_another_size_are_refused(whole, tmp_path, monkeypatch):
    folder = copied(whole, tmp_path / "run")
    monkeypatch.setattr(maps, "CHUNK", 50)
    with pytest.raises(StoreError, match="chunk was '48', is '50'"):
        Run(folder)


def test_another_title_is_the_same_map(whole, tmp_path):
    folder = copied(whole, tmp_path / "run")
    again = Run(folder, STUDY.replace('"small"', '"by another name"'))
    assert again.computed == 0
    assert contents(folder) == contents(whole.folder)
    assert again.outcome.tables[0].title == "by another name"


# -- what comes out --------------------------------------------------------------------------------
@pytest.mark.slow
def test_two_maps_and_their_agreement(tmp_path):
    run = Run(tmp_path / "run", PAIR, pictures=True)
    names = {file.name for file in run.outcome.files}
    assert names == {
        "16-hz.nc", "16-hz.csv", "16-hz.png", "16-hz-attractors.png", "7-hz.nc", "7-hz.csv",
        "7-hz.png", "7-hz-attractors.png",
        "7-hz-agreement.nc", "7-hz-agreement.csv", "7-hz-agreement.png",
    }  # fmt: skip
    assert all(file.stat().st_size > 0 for file in run.outcome.files)
    assert [table.title for table in run.outcome.tables] == ["16 Hz", "7 Hz", "a: 16 Hz / b: 7 Hz"]
    both = load(run.folder / "7-hz-agreement.nc")
    assert (both.attrs["name_a"], both.attrs["name_b"]) == ("16 Hz", "7 Hz")
    found, ds = pd.read_csv(run.folder / "7-hz.csv", comment="#"), load(run.folder / "7-hz.nc")
    assert len(found) == ds.sizes["attractor"] == 1
    assert found["peak |x| [m]"].tolist() == ds["attractor_peak"].values.tolist()
    assert found["share of starts"].tolist() == ds["attractor_fraction"].values.tolist()
    agreement = pd.read_csv(run.folder / "7-hz-agreement.csv", comment="#")
    assert (
        agreement["share in b"].dropna().tolist()
        == both["match_fraction_b"].values[both["match_b"].values >= 0].tolist()
    )
    assert [one.note["name"] for one in stores(run.folder)] == ["16 Hz", "7 Hz"]
    assert Run(run.folder, PAIR).computed == 0


def test_a_map_compared_with_a_later_one(tmp_path):
    text = PAIR.replace('name = "16 Hz"', 'name = "16 Hz"\ncompare = "7 Hz"').replace(
        'compare = "16 Hz"\n', ""
    )
    names = [file.name for file in Run(tmp_path / "run", text).outcome.files]
    assert "16-hz-agreement.nc" in names


def test_a_map_on_which_nothing_settles(tmp_path):
    """Starts beyond the range of numbers: every cell escapes, no attractor; the table is empty, the
    picture is drawn.
    """
    text = (
        STUDY.replace("count = 24", "count = 8")
        .replace("-5 mm", "1e200 mm")
        .replace("5 mm", "2e200 mm")
    )
    run = Run(tmp_path / "run", text, pictures=True)
    ds = load(run.folder / "basins.nc")
    assert ds.sizes["attractor"] == 0
    assert set(ds.basin.values.ravel()) == {-1}
    assert run.outcome.tables[0].rows == ()
    assert {file.name for file in run.outcome.files} == {"basins.nc", "basins.csv", "basins.png"}


def test_what_is_written_about_progress(whole):
    assert whole.reports[-1].name == "small"
    assert whole.reports[-1].seconds > 0
    assert whole.reports[-1].seconds_left == 0.0
    assert whole.said == [], "twelve chunks are too few for an estimate"


def test_a_large_map_is_estimated_first(tmp_path, monkeypatch):
    monkeypatch.setattr(maps, "LARGE", 2)
    said = Run(tmp_path / "run", STUDY.replace("count = 24", "count = 8")).said
    assert len(said) == 1
    assert said[0].startswith("small: 64 cells: about ")


# -- status ----------------------------------------------------------------------------------------
def test_status_of_a_folder_and_of_a_store(whole):
    (one,), (other,) = stores(whole.folder), stores(whole.folder / "stores" / "basins")
    assert one == other
    assert (one.done, one.total, one.damaged, one.writers) == (12, 12, 0, ())
    table = status_table([one])
    assert table.rows[0][:4] == ("small", "12 of 12", "100 %", "0")
    assert table.rows[0][-1] == "-"


def test_status_of_a_store_at_work(whole, tmp_path):
    folder = copied(whole, tmp_path / "run")
    with Store.open(folder / "stores" / "basins").lock((1, 2)):
        (row,) = status_table(stores(folder)).rows
    assert "shard 1 of 2" in row[-1]


def test_a_damaged_store_is_a_row_of_the_status_and_is_mended(whole, tmp_path):
    """Its head can't be read: the others are told all the same, and going on writes it again and
    computes nothing.
    """
    folder = copied(whole, tmp_path / "run")
    copied(whole, tmp_path / "second")
    (tmp_path / "second" / "stores" / "basins").rename(folder / "stores" / "second")
    head = folder / "stores" / "basins" / "store.json"
    head.write_bytes(head.read_bytes()[:-9])
    table = status_tables(folder)[0]
    assert [row[:2] for row in table.rows] == [("basins", "damaged"), ("small", "12 of 12")]
    assert "all chunks stay" in table.notes[0]
    assert Run(folder).computed == 0
    assert [row[1] for row in status_tables(folder)[0].rows] == ["12 of 12", "12 of 12"]


def test_chunks_of_another_study_are_not_taken_for_own(whole, tmp_path):
    """The map at 3 N and that at 4 N have the same size; a chunk of one is put into the other."""
    other = Run(tmp_path / "other", STUDY.replace('"4 N"', '"3 N"'))
    folder = copied(whole, tmp_path / "run")
    file = "stores/basins/chunks/5.chunk"
    (folder / file).write_bytes((other.folder / file).read_bytes())
    again = Run(folder)
    assert again.computed == 1
    assert any("damaged chunks that are computed again: 1" in text for text in again.said)
    assert contents(folder) == contents(whole.folder)


def test_no_study_here(tmp_path):
    with pytest.raises(StudyError, match="holds no store"):
        status_tables(tmp_path)
    with pytest.raises(StudyError, match="holds no store"):
        status_tables(tmp_path / "nowhere")
    with pytest.raises(StudyError, match=r"holds no study\.toml"):
        copy_of(tmp_path)


def test_a_full_disk_keeps_the_copy_of_the_study(whole, tmp_path, monkeypatch):
    """Resuming where the disk is full must not cost what resuming needs."""
    folder = copied(whole, tmp_path / "run")

    def full(self, data):
        self.open("w").close()  # what the system does first
        raise OSError(28, "No space left on device", str(self))

    monkeypatch.setattr(copies.Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space"):
        Run(folder, STUDY + "# a line more\n")
    assert copy_of(folder).read_text() == STUDY


def test_maps_of_one_system_need_one_compilation():
    assert len({one.plan.system.fingerprint() for one in maps_of(parse(PAIR))}) == 1
