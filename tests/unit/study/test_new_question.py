"""A new question of studies is one file."""

import os
import subprocess
import sys

import pytest

QUESTION = '''
"""[points]: motions at whole forcing periods."""

from saltus.results import table as rows
from saltus.study.answers.question import OneVerb, asked
from saltus.study.tables.kinds import KINDS
from saltus.study.tables.signature import table


@asked(11, table("points", ["stroboscope"], KINDS, called="Points"))
class Points(OneVerb):
    """Motions at whole periods."""

    def rows(self, ds, found):
        return [rows.table(self.title, [rows.words("points", [ds.x.size])], (), [0])]

    def pictures(self, ds):
        return {}
'''
USE = r'''
import saltus.study.answers as answers

answers.__path__.append(FOLDER)

from saltus.errors import StudyError
from saltus.study.ask import ask
from saltus.study.spec import QUESTIONS, Study
from saltus.study.tables.toml import FILE

HEAD = """
[study]
name = "a"
[system]
model = "delangre"
"""
(answer,) = ask(HEAD + "[points]\nperiods = 5\n")
print(list(QUESTIONS)[:3], "points" in Study.model_json_schema()["properties"])
print(answer.question.stem, answer.rows[0].data[1], FILE.verb("stroboscope"))
try:
    ask(HEAD + "[points]\nperiod = 5\n")
except StudyError as error:
    print(error)
'''


@pytest.mark.slow
def test_a_new_question_is_one_file(tmp_path):
    (tmp_path / "points.py").write_text(QUESTION, encoding="utf-8")
    code = USE.replace("FOLDER", repr(str(tmp_path)))
    said = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False,
        env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)},
    )  # fmt: skip
    assert said.returncode == 0, said.stderr
    assert said.stdout.splitlines() == [
        "['simulate', 'points', 'stroboscope'] True",
        "points ('6',) [points]",
        "study: [points] has no key 'period'. Did you mean 'periods'?",
    ]
