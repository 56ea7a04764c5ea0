"""[scatter] of study files."""

import pytest

import saltus as sl
from saltus.study.ask import ask

STUDY = """
[study]
name = "Gap"
[system]
model = "delangre"
case = "a"
force = "4 N"
frequency = "15 Hz"
[scatter]
samples = 4
"""
GAP = 'uncertain.upper_gap = { normal = ["0.4 mm", "0.02 mm"], low = "0.35 mm" }\n'


def test_a_table_asks_as_python_does():
    (answer,) = ask(STUDY + GAP)
    rig = sl.models.delangre("a", force="4 N", frequency="15 Hz")
    gap = sl.truncated(sl.normal("0.4 mm", "0.02 mm"), "0.35 mm")
    known = sl.scatter(rig, {"upper_gap": gap}, samples=4)
    assert answer.dataset.attrs["result_hash"] == known.attrs["result_hash"]
    assert [table.title for table in answer.rows] == ["Scatter", "Scatter: probabilities"]
    assert answer.figure.axes[0].get_title("left") == "Scatter"
    assert "normal" in answer.question.identity()["uncertain"]


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ("", r"uncertain"),
        (GAP.replace("normal", "norml"), r"norml.*Did you mean 'normal'"),
        (GAP.replace(', "0.02 mm"', ""), "normal takes 2 quantities"),
        (GAP.replace("low =", 'uniform = ["1 mm", "2 mm"], low ='), "takes one distribution"),
        (GAP.replace('"0.02 mm"', "0.02"), "has no unit"),
        (GAP.replace("upper_gap", "uper_gap"), "Did you mean 'upper_gap'"),
    ],
)
def test_a_wrong_table_is_refused(written, said):
    with pytest.raises(sl.SaltusError, match=said):
        ask(STUDY + written)
