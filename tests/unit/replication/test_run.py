"""What a replication does when something fails, is stopped, or meets another: on a paper whose jobs
take no time.
"""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import pytest
from typer.testing import CliRunner

from saltus.cli.commands import app
from saltus.errors import ParameterError
from saltus.interrupt import Interrupted
from saltus.replication import Check, Finding, claims_table, reproduce
from saltus.replication.verdict import HOLDS, UNDECIDED
from saltus.results.files.atomic import ResultFileError
from saltus.results.store.durable import StoreError
from saltus.results.store.lock import WHOLE, locked
from small_paper import compute, draw, small_paper, small_result


def broken(*_, **__):
    raise ZeroDivisionError("no such luck")


def verdicts(result):
    return {claim.id: finding.verdict for claim, finding in result.findings}


def page(result):
    return result.report.read_text(encoding="utf-8")


def test_without_failures_everything_is_there(tmp_path):
    result = reproduce(small_paper(), tmp_path)
    assert result.failures == {}
    assert verdicts(result) == {"two-is": HOLDS, "ten-is": HOLDS}
    assert sorted(file.name for file in tmp_path.iterdir()) == [
        "claims.csv",
        "data",
        "locks",
        "pictures",
        "report.html",
    ]
    assert sorted(file.name for file in (tmp_path / "pictures").iterdir()) == [
        "numbers.csv",
        "ten.png",
        "two.png",
    ]
    assert "Missing" not in page(result)


# -- something fails -------------------------------------------------------------------------------
def test_a_job_that_fails_costs_only_what_needs_it(tmp_path):
    said = []
    result = reproduce(small_paper(compute=broken), tmp_path, say=said.append)
    assert verdicts(result) == {"two-is": UNDECIDED, "ten-is": HOLDS}
    assert [picture.name for picture, _ in result.pictures] == ["ten"]
    assert [text.split(":")[0] for text in said] == ["figure 2 not complete", "figure 10 done"]
    assert set(result.failures) == {
        "fig2/first",
        "fig2/second",
        "picture two",
        "table numbers",
        "claim two-is",
    }
    (why,) = set(result.failures.values())
    assert re.match(
        r"fig2/first could not be computed: ZeroDivisionError in test_run.py, line "
        r"\d+: no such luck\. What is computed",
        why,
    )
    assert str(tmp_path / "data") in why
    assert "run the same command again" in why
    assert page(result).count("no such luck") == 3  # picture, table and claim


def test_a_job_that_two_figures_need_fails_once(tmp_path):
    tried = []

    def failing(*_, **__):
        tried.append(1)
        raise ZeroDivisionError

    paper = small_paper(compute=failing)
    both = replace(
        paper, claims=tuple(replace(claim, needs=("fig2/first",)) for claim in paper.claims)
    )
    assert set(verdicts(reproduce(both, tmp_path)).values()) == {UNDECIDED}
    assert len(tried) == 1


def test_what_failed_is_tried_again_and_only_that(tmp_path):
    reproduce(small_paper(compute=broken), tmp_path)
    again = reproduce(small_paper(), tmp_path)
    assert set(again.data) - set(again.computed) == {"fig10/other"}
    assert verdicts(again) == {"two-is": HOLDS, "ten-is": HOLDS}


@pytest.mark.parametrize(
    ("part", "what"),
    [("draw", "picture two"), ("judge", "claim two-is"), ("table", "table numbers")],
)
def test_a_picture_table_or_judge_that_fails_costs_only_itself(tmp_path, part, what):
    result = reproduce(small_paper(**{part: broken}), tmp_path)
    assert set(result.failures) == {what}
    assert verdicts(result) == {"two-is": UNDECIDED if part == "judge" else HOLDS, "ten-is": HOLDS}
    assert "no such luck" in page(result)
    if part == "judge":
        (finding,) = [finding for claim, finding in result.findings if claim.id == "two-is"]
        assert [check.passed for check in finding.checks] == [None]
        assert f"{what} failed: ZeroDivisionError" in finding.why


def test_the_command_tells_each_failure_once_and_ends_with_1(tmp_path, monkeypatch):
    monkeypatch.setattr("saltus.replication.find", lambda _: small_paper(compute=broken))
    ended = CliRunner().invoke(app, ["reproduce", "saunders2021", "--out", str(tmp_path)])
    assert ended.exit_code == 1
    assert ended.output.count("no such luck") == 1
    assert str(tmp_path / "report.html") in ended.output.replace("\n", "")
    assert str(tmp_path / "claims.csv") in ended.output.replace("\n", "")


def test_a_folder_that_can_not_be_written_to_stops_everything(tmp_path, monkeypatch):
    def full(*_):
        raise ResultFileError("the disk is full")

    monkeypatch.setattr("saltus.study.run.stored.save", full)
    with pytest.raises(ResultFileError, match="the disk is full"):
        reproduce(small_paper(), tmp_path)


def test_claims_that_fail_come_first(tmp_path):
    paper = small_paper(
        judge=lambda data: Finding("one", "two", (Check("so it is not", False),), "quite")
    )
    failing, holding = paper.claims
    text = page(reproduce(replace(paper, claims=(holding, failing)), tmp_path))
    assert text.index(f'href="#{failing.id}"') < text.index(f'href="#{holding.id}"')


# -- it is stopped ---------------------------------------------------------------------------------
def test_ctrl_c_keeps_what_is_done_and_the_same_command_goes_on(tmp_path):
    def stop(report):
        if report.name == "fig2/second (2 of 2)":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        reproduce(small_paper(), tmp_path, report=stop)
    assert {file.name for file in (tmp_path / "data").iterdir()} == {"fig2-first.nc"}
    assert not list(tmp_path.glob("report*"))
    assert set(reproduce(small_paper(), tmp_path).computed) == {"fig2/second", "fig10/other"}


def test_what_ctrl_c_interrupts_is_computed_again(tmp_path):
    def stopped(*_, **__):
        raise Interrupted(lambda: small_result(1.0))

    with pytest.raises(KeyboardInterrupt):
        reproduce(small_paper(compute=stopped), tmp_path)
    assert "fig2-first.nc" not in {file.name for file in (tmp_path / "data").iterdir()}
    assert len(reproduce(small_paper(), tmp_path).computed) == 3


# -- it meets another ------------------------------------------------------------------------------
def test_two_runs_at_a_time_in_one_folder_are_kept_apart(tmp_path):
    (tmp_path / "locks").mkdir()
    with (
        locked(tmp_path / "locks", WHOLE),
        pytest.raises(
            StoreError,
            match=rf"{tmp_path} is being "
            rf"written by process \d+ on",
        ),
    ):
        reproduce(small_paper(), tmp_path)
    assert not list((tmp_path / "data").iterdir())
    assert reproduce(small_paper(), tmp_path).failures == {}


def test_a_run_holds_the_folder_while_it_computes(tmp_path):
    refused = []

    def meeting(*inputs, **how):
        with pytest.raises(StoreError) as caught:
            reproduce(small_paper(), tmp_path)
        refused.append(str(caught.value))
        return compute(*inputs, **how)

    assert reproduce(small_paper(compute=meeting), tmp_path).failures == {}
    assert len(refused) == 1


# -- some figures ----------------------------------------------------------------------------------
@pytest.mark.parametrize("figure", ["10", "fig10", "Fig. 10", "FIG.10", "figure 10"])
def test_a_figure_has_a_report_of_its_own(tmp_path, figure):
    result = reproduce(small_paper(), tmp_path, [figure])
    assert result.figures == ("10",)
    assert {file.name for file in tmp_path.iterdir() if file.is_file()} == {
        "report-fig10.html",
        "claims-fig10.csv",
    }


def test_the_report_of_a_figure_leaves_that_of_all_alone(tmp_path):
    whole = reproduce(small_paper(), tmp_path)
    before = whole.report.read_bytes(), whole.claims_file.read_bytes()
    reproduce(small_paper(), tmp_path, ["2"])
    assert (whole.report.read_bytes(), whole.claims_file.read_bytes()) == before


def test_an_unknown_figure_lists_them_in_their_order_and_leaves_no_folder(tmp_path, monkeypatch):
    told = r"no figure 'fig3' to reproduce. Its figures: 2, 10\."
    with pytest.raises(ParameterError, match=told):
        reproduce(small_paper(), tmp_path / "new", ["fig3"])
    monkeypatch.setattr("saltus.replication.find", lambda _: small_paper())
    monkeypatch.chdir(tmp_path)
    ended = CliRunner().invoke(app, ["reproduce", "saunders2021", "--figure", "fig3"])
    assert ended.exit_code == 2
    assert re.search(told, ended.output.replace("\n", " "))
    assert not list(tmp_path.iterdir())


# -- what it leaves --------------------------------------------------------------------------------
def test_open_figures_and_the_backend_stay(tmp_path):
    """A notebook's own; those that a picture opened are closed, drawn or not."""
    backend = matplotlib.get_backend()
    own = plt.figure()
    try:
        matplotlib.use("svg")
        open_before = plt.get_fignums()

        def half(data):
            draw(data)
            raise ValueError

        reproduce(small_paper(draw=half), tmp_path)
        assert plt.get_fignums() == open_before
        assert plt.fignum_exists(own.number)
        assert matplotlib.get_backend() == "svg"
    finally:
        plt.close(own)
        matplotlib.use(backend)


def test_claims_are_a_table_to_go_on_with(tmp_path):
    result = reproduce(small_paper(), tmp_path)
    with result.claims_file.open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    assert rows[0] == list(claims_table(result).columns)
    assert rows[1] == ["2", "two-is", "Two, it says, is so", "p. 2", "one", "two", HOLDS]
    assert len(rows) == 3


@pytest.mark.parametrize(("threads", "told"), [(1, "with 1 thread on"), (3, "with 3 threads on")])
def test_the_report_says_what_its_times_are(tmp_path, threads, told):
    first = reproduce(small_paper(), tmp_path, threads=threads)
    assert told in page(first)
    again = reproduce(small_paper(), tmp_path, threads=threads)
    assert again.seconds_in_all == first.seconds_in_all > 0.0
    assert "0 computations in this run, 3 from an earlier one" in page(again)


def test_the_folder_of_study_files_says_what_each_is():
    """And how all of them are computed at once."""
    folder = Path(__file__).parents[3] / "replications" / "saunders2021"
    told = (folder / "README.md").read_text(encoding="utf-8")
    assert [
        file.name
        for file in sorted(folder.glob("*.*"))
        if file.name != "README.md" and f"`{file.name}`" not in told
    ] == []
    assert "saltus reproduce saunders2021" in told
    assert "measured_" in told
