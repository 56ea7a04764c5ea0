"""The replication of a paper: verdicts follow from checks, every claim says how it is judged, the
report needs nothing from outside.
"""

import math
import re
import tomllib
from itertools import product
from pathlib import Path

import pytest

from saltus.errors import ParameterError
from saltus.replication import find, papers
from saltus.replication.claims import Row, filled
from saltus.replication.run import reproduce
from saltus.replication.verdict import (
    FAILS,
    HOLDS,
    IN_PART,
    RULES,
    UNDECIDED,
    VERDICTS,
    Check,
    passed,
    verdict_of,
)


# -- verdicts --------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("passed", "verdict"),
    [
        ([True, True], HOLDS),
        ([True, False], IN_PART),
        ([True, None], IN_PART),
        ([False, False], FAILS),
        ([False, None], FAILS),
        ([None, None], UNDECIDED),
        ([], UNDECIDED),
    ],
)
def test_a_verdict_follows_from_the_checks(passed, verdict):
    assert verdict_of([Check("so it is", one) for one in passed]) == verdict


def test_one_more_failure_never_makes_a_verdict_better():
    order = {HOLDS: 0, IN_PART: 1, FAILS: 2}
    for some in product([True, False], repeat=3):
        checks = [Check("", one) for one in some]
        assert order[verdict_of([*checks, Check("", False)])] >= order[verdict_of(checks)]


# -- rules and rows --------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("rule", "limit", "so", "not_so"),
    [
        ("below", 2, 1, 2), ("at_most", 2, 2, 3), ("above", 2, 3, 2), ("at_least", 2, 2, 1),
        ("equals", 2, 2, 1), ("differs", 2, 1, 2),
        ("between", [1, 2], 2, 3), ("inside", [1, 2], 1.5, 2), ("near", [100, 0.1], 109, 111),
        ("same_set", ["a", "b", "b"], ["b", "a", "b"], ["a", "b"]),
        ("contains", ["x"], ["x", "y"], ["y"]), ("is", True, True, False),
    ],
)  # fmt: skip
def test_each_rule_can_pass_and_fail(rule, limit, so, not_so):
    assert passed({"of": "a", rule: limit}, {"a": so}) is True
    assert passed({"of": "a", rule: limit}, {"a": not_so}) is False
    assert passed({"of": "a", rule: "b"}, {"a": so, "b": limit}) is True


@pytest.mark.parametrize(
    "row", [{"of": "b"}, {"of": "a", "equals": "b"}, {"of": "a", "given": "b"}]
)
def test_a_name_that_nothing_has_is_no_verdict(row):
    with pytest.raises(KeyError):
        passed(row, {"a": 1})


def test_every_rule_is_tested():
    (mark,) = test_each_rule_can_pass_and_fail.pytestmark
    assert {row[0] for row in mark.args[1]} == set(RULES)


@pytest.mark.parametrize(
    ("row", "quantities"),
    [
        ({"of": "a", "below": 1}, {"a": math.nan}),
        ({"of": "a", "below": 1}, {"a": None}),
        ({"of": "a"}, {"a": None}),
        ({"of": "a", "below": "b"}, {"a": 0, "b": math.nan}),
        ({"of": "a", "below": 1, "given": "b"}, {"a": 0, "b": False}),
    ],
)
def test_what_is_not_known_is_not_decided(row, quantities):
    assert passed(row, quantities) is None


def test_a_row_makes_checks_and_sentences_from_quantities():
    row = Row(
        read=lambda data: {"cases": [{"name": "a", "part": 0.5}, {"name": "b", "part": 2e-4}],
            "most": 0.4, "odd": True},
        checks=({"each": "cases", "text": "{name}: {part:share}", "of": "part", "below": "most"},),
        lines={"all": {"each": "cases", "text": "{name} {most:.1f}"}}, own="{all}.",
        exact="{cases[0][name]}", sure="so",
        why=({"unless": "odd", "text": "first"}, {"when": "odd", "text": "second"},
            {"text": "third"}),
    )  # fmt: skip
    finding = row.judge({})
    assert [(check.text, check.passed) for check in finding.checks] == [
        ("a: 50.0 %", False),
        ("b: < 0.1 %", True),
    ]
    assert (finding.own, finding.exact, finding.why, finding.verdict) == (
        "a 0.4; b 0.4.",
        "a",
        "second",
        IN_PART,
    )


def test_words_for_numbers():
    numbers = {"k": 2.55e4, "nan": math.nan, "n": [1, 3, 0], "d": 1.23e-5, "none": []}
    text = "{k:power} {nan:power} {n:period} {d:um} {d:mm} {nan:alpha} {none:share}"
    assert filled(text, numbers) == (
        "2.55e4 nowhere T, 3T, not periodic 12.3 µm 0.012 mm not measurable none"
    )


@pytest.mark.parametrize("name", papers.names())
def test_a_row_of_a_claim_says_what_is_known_and_nothing_else(name):
    rows = tomllib.loads((papers.folder_of(name) / "claims.toml").read_text(encoding="utf-8"))[
        "claim"
    ]
    for check in (check for row in rows for check in row.get("checks", ())):
        assert {"text", "of"} <= set(check)
        assert set(check) - {"text", "of", "each", "given"} <= set(RULES)
        assert len(set(check) & set(RULES)) <= 1


def test_the_page_on_rows_shows_one_that_is_there_and_every_rule():
    page = (Path(__file__).parents[3] / "docs" / "replication.md").read_text(encoding="utf-8")
    (row,) = re.findall(r"```\{code-block\} toml\n(.*?)```", page, re.DOTALL)
    assert row in (papers.folder_of("saunders2021") / "claims.toml").read_text(encoding="utf-8")
    assert set(RULES) - {"is"} <= set(re.findall(r"`(\w+)", page))


def test_code_is_imported_from_no_folder_but_saltus_s_own(tmp_path, monkeypatch):
    """Not from where one works, whatever it is called there."""
    folder = tmp_path / "replications" / "saunders2021"
    folder.mkdir(parents=True)
    for file in ("__init__.py", "jobs.py", "paper.toml", "claims.toml"):
        (folder / file).write_text("raise SystemExit('foreign code ran')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(
        "sys.modules",
        {
            key: one
            for key, one in __import__("sys").modules.items()
            if not key.startswith("saltus_")
        },
    )
    assert papers.find.__wrapped__("saunders2021").claims
    for name in ("../saunders2021", str(folder), "replications.saunders2021"):
        with pytest.raises(ParameterError, match="no paper"):
            papers.code(name, "jobs")


# -- the paper -------------------------------------------------------------------------------------
PAPER = find("saunders2021")


def test_every_claim_says_what_where_and_how_it_is_judged():
    assert len({claim.id for claim in PAPER.claims}) == len(PAPER.claims)
    for claim in PAPER.claims:
        assert claim.says.strip()
        assert claim.where.strip()
        assert claim.rule.strip()
        assert claim.figure in PAPER.figures


def test_every_figure_from_2_to_14_is_there_with_a_picture_and_a_claim():
    assert set(PAPER.figures) == {str(number) for number in range(2, 15)}
    for figure in PAPER.figures:
        assert any(claim.figure == figure for claim in PAPER.claims)
        assert any(picture.figure == figure for picture in PAPER.pictures)


def test_a_wrong_name_is_answered_with_the_nearest():
    with pytest.raises(ParameterError, match="saunders2021"):
        find("saunders2012")
    with pytest.raises(ParameterError, match="figure"):
        reproduce(PAPER, None, ["99"])


# -- the report ------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """Fig. 4, the quickest, end to end."""
    out = tmp_path_factory.mktemp("report")
    return out, reproduce(PAPER, out, ["4"], quick=True)


def test_the_report_is_one_file_that_loads_nothing(report):
    _, result = report
    page = result.report.read_text(encoding="utf-8")
    loaded = re.findall(
        r"(?:src|srcset)\s*=\s*[\"']([^\"']+)|<link[^>]+href\s*=\s*[\"']([^\"']+)|url\(([^)]+)\)|@import\s+(\S+)",
        page,
    )
    assert loaded
    assert all(
        place.strip("'\"").startswith("data:") for group in loaded for place in group if place
    )
    assert "<script" not in page


def test_the_report_shows_each_claim_with_its_verdict(report):
    _, result = report
    page = result.report.read_text(encoding="utf-8")
    assert {claim.figure for claim, _ in result.findings} == {"4"}
    for claim, finding in result.findings:
        assert finding.verdict in VERDICTS
        assert f'id="{claim.id}"' in page
        assert "saltus reproduce saunders2021" in page


def test_the_two_responses_of_fig_4_are_found(report):
    _, result = report
    assert {claim.id: finding.verdict for claim, finding in result.findings}[
        "fig4-periods"
    ] == HOLDS


@pytest.mark.nightly
def test_every_part_of_the_report_can_be_made(tmp_path):
    """All computations, pictures, tables and claims, from a quick run: five minutes of one core."""
    result = reproduce(PAPER, tmp_path, quick=True)
    assert result.failures == {}
    assert len(result.findings) == len(PAPER.claims)
    assert len(result.pictures) == len(PAPER.pictures)
    assert len(result.tables) == len(PAPER.tables)


def test_what_is_there_is_not_computed_again(report):
    out, _ = report
    before = {file: file.stat().st_mtime_ns for file in (out / "data").rglob("*") if file.is_file()}
    reproduce(PAPER, out, ["4"], quick=True)
    assert before
    assert {
        file: file.stat().st_mtime_ns for file in (out / "data").rglob("*") if file.is_file()
    } == before


def test_what_is_damaged_or_missing_is_computed_again(report):
    out, _ = report
    data = sorted((out / "data").glob("*.nc"))
    data[0].unlink()
    data[1].write_bytes(b"not a result")
    again = reproduce(PAPER, out, ["4"], quick=True)
    assert {claim.id: finding.verdict for claim, finding in again.findings}["fig4-periods"] == HOLDS
    assert data[0].is_file()
    assert len(data[1].read_bytes()) > 100
