"""What is kept of a job, and when it is computed again."""

from __future__ import annotations

import ast
import json
import shutil
from pathlib import Path

import pytest

import saltus
from edited_copy import edited_copy
from saltus.replication import job as jobs
from saltus.replication.job import Job, Shelf
from saltus.replication.saunders2021 import compute_responses, plan
from saltus.study import identity
from small_paper import small_result

CALLS = []


def compute(settings, inputs, show):
    CALLS.append(settings["value"])
    show(0.5)
    return small_result(settings["value"] + sum(float(ds["attractor_peak"][0]) for ds in inputs.values()))


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
        shelf.result(job, {"one": small_result(value)}, lambda _: None)
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
    file.write_bytes(file.read_bytes()[: -len(file.read_bytes()) // 3])
    shelf.result(job, {}, lambda _: None)
    assert CALLS == [1.0, 1.0]


def test_other_code_is_another_result(shelf, monkeypatch):
    job = Job("one", {"value": 1.0}, compute)
    shelf.result(job, {}, lambda _: None)
    monkeypatch.setattr("saltus.replication.job.code_hash", lambda *_: "other")
    shelf.result(job, {}, lambda _: None)
    assert CALLS == [1.0, 1.0]


# -- data and their note belong together -----------------------------------------------------------------------------------------
def test_the_note_of_one_result_does_not_vouch_for_the_data_of_another(shelf, tmp_path):
    """As two runs at a time in one folder would leave them."""
    other = Shelf(tmp_path / "other")
    other.folder.mkdir()
    shelf.result(Job("one", {"value": 1.0}, compute), {}, lambda _: None)
    other.result(Job("one", {"value": 2.0}, compute), {}, lambda _: None)
    job = Job("one", {"value": 1.0}, compute)
    shutil.copy(other.files(job)[0], shelf.files(job)[0])
    assert float(shelf.result(job, {}, lambda _: None)["attractor_peak"][0]) == 1.0
    assert CALLS == [1.0, 2.0, 1.0]


@pytest.mark.parametrize("missing", ["identity", "result_hash", "seconds"])
def test_a_note_that_lacks_something_counts_for_nothing(shelf, missing):
    job = Job("one", {"value": 1.0}, compute)
    shelf.result(job, {}, lambda _: None)
    note = shelf.files(job)[1]
    told = json.loads(note.read_text())
    del told[missing]
    note.write_text(json.dumps(told))
    shelf.result(job, {}, lambda _: None)
    assert CALLS == [1.0, 1.0]


def test_the_file_of_a_job_s_function_is_part_of_its_identity(tmp_path):
    """And so are modules beside it that it may call."""
    before = jobs._source_hash.__wrapped__(Path(__file__))
    copied = Path(shutil.copy(__file__, tmp_path))
    assert jobs._source_hash.__wrapped__(copied) == before
    (tmp_path / "compute_more.py").write_text("")
    more = jobs._source_hash.__wrapped__(copied)
    copied.write_text(copied.read_text(encoding="utf-8") + "#")
    assert len({before, more, jobs._source_hash.__wrapped__(copied)}) == 3


# -- what a result depends on ----------------------------------------------------------------------------------------------------
#: Packages that take no part in numbers: messages, what kinds arguments may be of, the end of work, and pictures of what was computed.
NO_NUMBERS = ("cache_folder", "errors", "arguments", "interrupt", "plot")


def sources(place):
    """The modules of a package of saltus, or one module that stands alone."""
    folder = Path(saltus.__file__).parent / place.replace(".", "/")
    return sorted(folder.rglob("*.py")) or [folder.with_suffix(".py")]


def imported(file):
    """What a module imports of saltus, wherever it does so: ``analysis.lyapunov``, ``units.to_si``."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module and node.module.partition(".")[0] == "saltus":
            yield from (f"{node.module}.{alias.name}".partition(".")[2] for alias in node.names)


def strangers(files, known):
    """Imports from outside of some packages."""
    inside = tuple(f"{place}." for place in known)
    found = {(file.name, name) for file in files for name in imported(file) if not f"{name}.".startswith(inside)}
    return {one for one in found if one[1] != "__version__"}


def test_the_hash_of_a_study_covers_all_that_its_code_calls():
    files = [file for place in identity.COMPUTING for file in sources(place)]
    assert len(files) > 80
    assert strangers(files, (*identity.COMPUTING, *NO_NUMBERS)) == set()


def test_the_hash_of_a_job_covers_all_that_its_code_calls():
    known = (*identity.COMPUTING, *jobs._READING)
    own = [file for file in sources("replication.saunders2021") if file.name.startswith("compute")]
    files = [*own, *(file for place in known for file in sources(place))]
    siblings = ("replication.job.Show", "replication.saunders2021.compute")
    assert strangers(files, (*known, *NO_NUMBERS, *siblings)) == set()


@pytest.mark.parametrize("changed", ["delangre.py", "setting.py", "parts.py", "lyapunov_table.py", "intervals.py", "units.py"])
def test_an_edit_of_a_model_or_of_the_reading_is_another_result(shelf, tmp_path, monkeypatch, changed):
    before = Job("one", {"value": 1.0}, compute).identity({})
    edited_copy(tmp_path, changed, monkeypatch)
    identity.code_hash.cache_clear()
    after = Job("one", {"value": 1.0}, compute).identity({})
    identity.code_hash.cache_clear()
    assert after["code"] != before["code"]


def test_errors_of_further_methods_are_kept(tmp_path):
    """From a diagram of three values: as Fig. 7 asks for them."""
    vary = {"contact_stiffness": {"first": "1 kN/m", "last": "1 MN/m", "count": 3, "scale": "log"}}
    settings = {
        "question": "bifurcation_diagram", "method": plan.TAYLOR,
        "system": {"model": "delangre", "case": "c", "force": "4 N", "frequency": "5 Hz"},
        "table": {"vary": vary, "start": {"x": "0.32 mm", "v": "0 m/s"}, "periods": 200, "sample": "stroboscope"},
    }  # fmt: skip
    exact = Job("exact", settings, compute_responses.responses)
    tighter = Job("tighter", {**settings, "methods": plan.TIGHTER}, compute_responses.period_errors, ("exact",))
    shelf = Shelf(tmp_path)
    diagram = shelf.result(exact, {}, lambda _: None)
    shelf.result(tighter, {"exact": diagram}, lambda _: None)
    kept = Shelf(tmp_path).result(tighter, {"exact": diagram}, lambda _: pytest.fail("computed again"))
    errors = kept["step_error_rms"].values
    assert errors.shape == (2, 3)
    assert (errors < 1e-5).all()
    assert (errors > 1e-12).all()
