"""Questions asked without a file: the Dataset, rows and figure that the command writes."""

from __future__ import annotations

import tomllib

import pytest

import saltus as sl
from saltus.errors import StudyError
from saltus.results import load
from saltus.study.ask import ask
from saltus.study.read import parse
from saltus.study.run.running import Resources
from saltus.study.run.study import run_study
from small_study import small_study

STUDY = """
[study]
name = "a page"
[system]
model = "delangre"
case = "b"
force = "4 N"
frequency = "15 Hz"
[simulate]
start = { x = ["0.2 mm", "1 mm"], v = "0 m/s" }
periods = 5
[impacts]
periods = 20
"""


def test_answers_are_those_of_the_command(tmp_path):
    shares = []
    answers = ask(STUDY, threads=1, progress=shares.append)
    run_study(
        parse(STUDY),
        STUDY,
        tmp_path,
        None,
        Resources(threads=1),
        lambda _: None,
        lambda _: None,
        pictures=False,
    )
    assert [answer.question.stem for answer in answers] == ["run", "impact-statistics"]
    for answer in answers:
        assert answer.dataset.drop_attrs().identical(
            load(tmp_path / f"{answer.question.stem}.nc").drop_attrs()
        )
        written = (tmp_path / f"{answer.question.stem}.csv").read_text().splitlines()
        assert len([line for line in written if not line.startswith("#")]) == len(
            answer.rows[0].data
        )
        assert answer.figure.axes
    assert shares == sorted(shares)
    assert 0.5 < shares[-1] <= 1


def test_tables_may_be_a_dict():
    (answer,) = ask(tomllib.loads(STUDY), only=["simulate"], threads=1)
    rig = sl.models.delangre("b", force="4 N", frequency="15 Hz")
    motion = sl.simulate(rig, {"x": [0.2e-3, 1e-3], "v": 0.0}, periods=5, threads=1, progress=False)
    assert answer.dataset.drop_attrs().identical(motion.drop_attrs())
    assert answer.rows[0].title == "a page"


def test_a_map_needs_no_store(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (answer,) = ask(small_study(6, 4), threads=1)
    assert answer.dataset["basin"].shape == (6, 4)
    assert len(answer.rows[0].rows) == answer.dataset.sizes["attractor"]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("study", "told"),
    [
        (
            STUDY.replace("periods = 5", "period = 5"),
            r"\[simulate\] has no key 'period'\. Did you "
            r"mean 'periods'\?",
        ),
        ({"study": {"name": "a"}, "simulat": {}}, "has no table 'simulat'"),
        (STUDY + '[compare]\nprinted = "/etc/passwd"\n', r"\[compare\] is for one start"),
        (
            STUDY.replace('["0.2 mm", "1 mm"]', '"1 mm"') + '[compare]\nprinted = "/etc/passwd"\n',
            "no file may be read here",
        ),
    ],
)
def test_faults_are_told_as_by_the_command(study, told):
    with pytest.raises(StudyError, match=told):
        ask(study)
