"""What is kept of a job, and when it is computed again."""

from __future__ import annotations

import ast
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import saltus
from saltus.flow import ODE45
from saltus.replication import job as jobs
from saltus.replication import papers
from saltus.study import code
from saltus.study.run.running import Resources, Running
from small_paper import compute, small_job, small_result

CALLS = []


def counted(*inputs, value, **how):
    CALLS.append(value)
    return compute(*inputs, value=value, **how)


def beside(*inputs, **how):
    return compute(*inputs, **how)


def job(value=1.0, name="one", needs=()):
    return small_job(name, value, counted, needs)


@pytest.fixture
def at(tmp_path):
    CALLS.clear()
    return Running(tmp_path, "a test", Resources(1), lambda _: None, lambda _: None)


def test_the_second_time_nothing_is_computed(at):
    first, new = job(name="fig1/a b").result({}, at)
    again, kept = job(name="fig1/a b").result({}, at)
    assert (CALLS, new, kept) == ([1.0], True, False)
    assert first.attrs["result_hash"] == again.attrs["result_hash"]
    assert [file.name for file in at.folder.iterdir()] == ["fig1-a-b.nc"]


def test_another_setting_is_another_result(at):
    job(1.0).result({}, at)
    job(2.0).result({}, at)
    assert CALLS == [1.0, 2.0]


def test_another_input_is_another_result(at):
    for value in (1.0, 1.0, 2.0):
        job(needs=("zero",)).result({"zero": small_result(value)}, at)
    assert CALLS == [1.0, 1.0]


@pytest.mark.parametrize(
    "other",
    [
        {"system": saltus.models.delangre("c")},
        {"method": ODE45()},
        {"compute": compute},
        {"compute": beside},
    ],
)
def test_another_system_method_or_analysis_is_another_result(at, other):
    job().result({}, at)
    assert replace(job(), **other).result({}, at)[1]


def test_a_damaged_file_is_computed_again(at):
    job().result({}, at)
    (file,) = at.folder.iterdir()
    file.write_bytes(file.read_bytes()[: len(file.read_bytes()) // 3])
    job().result({}, at)
    assert CALLS == [1.0, 1.0]


def test_other_code_is_another_result(at, monkeypatch):
    job().result({}, at)
    monkeypatch.setattr("saltus.study.identity.code_hash", lambda *_: "other")
    job().result({}, at)
    assert CALLS == [1.0, 1.0]


def test_the_file_of_a_paper_s_own_function_is_part_of_its_identity(tmp_path, monkeypatch):
    copied = Path(shutil.copy(__file__, tmp_path))
    before = jobs._own_code.__wrapped__(__name__)
    monkeypatch.setitem(sys.modules, "copied", type("module", (), {"__file__": str(copied)}))
    assert jobs._own_code.__wrapped__("copied") == before
    copied.write_text(copied.read_text(encoding="utf-8") + "# a remark\n", encoding="utf-8")
    assert jobs._own_code.__wrapped__("copied") == before
    copied.write_text(copied.read_text(encoding="utf-8") + "EDITED = True\n", encoding="utf-8")
    assert jobs._own_code.__wrapped__("copied") != before


def test_the_code_of_saltus_is_no_paper_s_own():
    assert jobs._own_code("saltus.analysis.motion.simulate") == ""


# -- what a result depends on ----------------------------------------------------------------------
#: Packages that take no part in numbers: messages, what kinds arguments may be of, the end of work,
#: and pictures of what was computed.
NO_NUMBERS = ("errors", "sentences", "announce", "arguments", "blas_threads", "interrupt", "plot")
#: What only says which system, method and arguments: these are in the identity themselves.
SAYS_WHAT = ("replication.Job", "study.read", "study.spec", "study.tables", "study.setting")


def sources(place):
    """The modules of a package of saltus, or one module that stands alone."""
    folder = Path(saltus.__file__).parent / place.replace(".", "/")
    return sorted(folder.rglob("*.py")) or [folder.with_suffix(".py")]


def imported(file):
    """What a module imports of saltus or of its own folder, wherever it does so:
    ``analysis.lyapunov``, ``units.to_si``.
    """
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (
            node.level or (node.module or "").partition(".")[0] == "saltus"
        ):
            module = node.module or "" if not node.level else f"saltus.beside.{node.module or ''}"
            yield from (f"{module}.{alias.name}".partition(".")[2] for alias in node.names)


def strangers(files, known):
    """Imports from outside of some packages."""
    inside = tuple(f"{place}." for place in known)
    found = {
        (file.name, name)
        for file in files
        for name in imported(file)
        if not f"{name}.".startswith(inside)
    }
    return {one for one in found if one[1] != "__version__"}


def test_the_hash_of_a_study_covers_all_that_its_code_calls():
    files = [file for place in code.COMPUTING for file in sources(place)]
    assert len(files) > 80
    assert strangers(files, (*code.COMPUTING, *NO_NUMBERS)) == set()


@pytest.mark.parametrize("paper", papers.names())
def test_the_identity_of_a_job_covers_all_that_its_code_calls(paper):
    """Its own file counts, so it may call none beside it."""
    assert (
        strangers([papers.folder_of(paper) / "jobs.py"], (*code.COMPUTING, *NO_NUMBERS, *SAYS_WHAT))
        == set()
    )


def test_errors_of_further_methods_are_kept(at):
    """From a diagram of three values: as Fig. 7 asks for them."""
    own = papers.code("saunders2021", "jobs")
    asked = {
        "vary": {"contact_stiffness": ("1 kN/m", "1 MN/m", 3, "log")},
        "start": {"x": "0.32 mm", "v": "0 m/s"},
        "periods": 200,
        "sample": "stroboscope",
    }
    system = saltus.models.delangre("c").with_values(force="4 N", frequency="5 Hz")
    exact = jobs.Job("exact", own.bifurcation_diagram, system, own.ENDS["exact"], asked)
    tighter = jobs.Job("tighter", own.tighter, system, own.ENDS["exact"], {}, ("exact",))
    diagram = exact.result({}, at)[0]
    tighter.result({"exact": diagram}, at)
    kept, new = tighter.result({"exact": diagram}, at)
    errors = kept["step_error_rms"].values
    assert not new
    assert errors.shape == (2, 3)
    assert (errors < 1e-5).all()
    assert (errors > 1e-12).all()
