"""Names with dollar signs in pictures: a formula is drawn as one, anything else as it is written;
no picture fails to be saved.
"""

import io

import matplotlib.pyplot as plt
import pytest
from matplotlib.text import Text

from saltus import plot
from saltus.study.run.write import save_picture

from .conftest import rig_run
from .responses_data import resonance


def texts(axes):
    axes.figure.savefig(io.BytesIO(), format="svg")
    return [text.get_text() for text in axes.findobj(Text)]


@pytest.mark.filterwarnings("ignore:constrained_layout not applied")  # the longest name fills it
@pytest.mark.parametrize("name", ["$a^$", "a $^$ b", "$" + "{" * 90 + "x" + "}" * 90 + "$"])
def test_what_is_no_formula_is_drawn_as_it_is_written(name):
    drawn = texts(plot.frequency_response({name: resonance(20), "other": resonance(20, shift=2.0)}))
    assert name.replace("$", r"\$") in drawn


def test_a_formula_is_drawn_as_one():
    drawn = texts(
        plot.frequency_response(
            {r"$\mu = 0.3$": resonance(20), "$5 a piece": resonance(20, shift=2.0)}
        )
    )
    assert {r"$\mu = 0.3$", "$5 a piece"} <= set(drawn)


def test_a_unit_can_not_spoil_a_picture():
    run = rig_run(periods=3)
    run["x"].attrs["units"] = "$m^$"
    texts(plot.history(run))
    texts(plot.phase(run))


def test_a_title_of_a_study_is_drawn_as_it_is_written(tmp_path):
    figure, axes = plt.subplots()
    axes.set_title("from $^$ on")
    save_picture(figure, tmp_path / "map.png")
    assert axes.get_title() == r"from \$^\$ on"
