"""The picture of a fit, and the table of studies that asks for one."""

import numpy as np
import pytest

import saltus as sl
from saltus.errors import ParameterError, StudyError
from saltus.study.ask import ask
from saltus.study.setting.inputs import Inputs

RIG = sl.models.delangre("a", force="4 N", frequency="8 Hz")
STUDY = """
[study]
name = "A gap"
[system]
model = "delangre"
case = "a"
force = "4 N"
frequency = "8 Hz"
[fit]
measured = "run.csv"
starts = 4
values = { upper_gap = "0.5 mm" }
free.upper_gap = ["0.1 mm", "2 mm"]
"""


@pytest.fixture(scope="module")
def answers(tmp_path_factory):
    """A fit by a study."""
    folder = tmp_path_factory.mktemp("study")
    run = sl.simulate(RIG, periods=6, samples=8)
    lines = [
        f"{t!r}, {1e3 * x!r}"
        for t, x in zip(run.time.values.tolist(), run.x.values.tolist(), strict=True)
    ]
    (folder / "run.csv").write_text("\n".join(["t [s], x [mm]", *lines]))
    return folder, ask(STUDY, inputs=Inputs(folder))


def test_a_study_asks_for_a_fit(answers):
    folder, (found,) = answers
    assert found.dataset.value.item() == pytest.approx(4e-4, rel=1e-8)
    assert found.rows[0].rows[0][:2] == ("upper_gap", "0.4 mm")
    assert set(found.question.identity()) >= {"measured", "free"}
    for wrong, message in (
        ('free.uper_gap = ["1 mm", "2 mm"]', "'uper_gap' is unknown"),
        ("free.upper_gap = [1, 2]", "has no unit"),
        ('free.upper_gap = ["2 mm", "1 mm"]', "must ascend"),
        ('noise.x = "1 s"', "noise"),
        ('measured = "none.csv"', "none.csv"),
    ):
        text = STUDY.replace('free.upper_gap = ["0.1 mm", "2 mm"]', wrong)
        if wrong.startswith(("noise", "measured")):
            text = STUDY.replace('measured = "run.csv"', wrong.partition("noise")[0])
            text = text if wrong.startswith("measured") else STUDY + wrong
        with pytest.raises(StudyError, match=message):
            ask(text, inputs=Inputs(folder))


def test_points_curve_and_residuals_are_those_of_the_fit(answers):
    ds = answers[1][0].dataset
    axes = sl.plot.fit(ds)
    curves = {line.get_label(): line.get_ydata() for line in axes.lines}
    assert curves["measured"] == pytest.approx(1e3 * ds.measured.values[:, 0])
    assert curves["fitted"] == pytest.approx(1e3 * ds.fitted.values[:, 0])
    assert axes.get_ylabel() == "x [mm]"
    below = axes.figure.axes[1]
    left = below.lines[0].get_ydata()
    assert left / np.abs(left).max() == pytest.approx(
        ds.residual.values[:, 0] / np.abs(ds.residual.values).max(), abs=1e-9
    )
    shown = sl.plot.fit(ds, span=(0.2, 0.4)).lines[0].get_xdata()
    assert np.ptp(shown) < 210
    with pytest.raises(ParameterError, match="no sample lies between"):
        sl.plot.fit(ds, span=(90, 100))
    with pytest.raises(ParameterError, match="no output 'y'"):
        sl.plot.fit(ds, output="y")
