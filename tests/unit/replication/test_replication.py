"""The replication of a paper: verdicts follow from checks, every claim says how it is judged, the report needs nothing from outside."""

import re
from itertools import product

import pytest

from saltus.errors import ParameterError
from saltus.replication import find
from saltus.replication.run import reproduce
from saltus.replication.verdict import FAILS, HOLDS, IN_PART, UNDECIDED, VERDICTS, Check, verdict_of


# -- verdicts --------------------------------------------------------------------------------------------------------------------
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
    for passed in product([True, False], repeat=3):
        checks = [Check("", one) for one in passed]
        assert order[verdict_of([*checks, Check("", False)])] >= order[verdict_of(checks)]


# -- the paper -------------------------------------------------------------------------------------------------------------------
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


# -- the report ------------------------------------------------------------------------------------------------------------------
@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """Fig. 4, the quickest, end to end."""
    out = tmp_path_factory.mktemp("report")
    return out, reproduce(PAPER, out, ["4"], quick=True)


def test_the_report_is_one_file_that_loads_nothing(report):
    _, result = report
    page = result.report.read_text(encoding="utf-8")
    loaded = re.findall(r"(?:src|srcset)\s*=\s*[\"']([^\"']+)|<link[^>]+href\s*=\s*[\"']([^\"']+)|url\(([^)]+)\)|@import\s+(\S+)", page)
    assert loaded
    assert all(place.strip("'\"").startswith("data:") for group in loaded for place in group if place)
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
    assert {claim.id: finding.verdict for claim, finding in result.findings}["fig4-periods"] == HOLDS


def test_what_is_there_is_not_computed_again(report):
    out, _ = report
    before = {file: file.stat().st_mtime_ns for file in (out / "data").rglob("*") if file.is_file()}
    reproduce(PAPER, out, ["4"], quick=True)
    assert before
    assert {file: file.stat().st_mtime_ns for file in (out / "data").rglob("*") if file.is_file()} == before


def test_what_is_damaged_or_missing_is_computed_again(report):
    out, _ = report
    data = sorted((out / "data").glob("*.nc"))
    data[0].unlink()
    data[1].write_bytes(b"not a result")
    again = reproduce(PAPER, out, ["4"], quick=True)
    assert {claim.id: finding.verdict for claim, finding in again.findings}["fig4-periods"] == HOLDS
    assert data[0].is_file()
    assert len(data[1].read_bytes()) > 100
