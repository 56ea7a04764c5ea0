"""Names with dollar signs in pictures: a formula is drawn as one, anything else as it is written;
no picture fails to be saved.
"""

import io
import pathlib
import re

import matplotlib.pyplot as plt
import pytest
from matplotlib.text import Text

import saltus as sl
from saltus import plot
from saltus.errors import ParameterError
from saltus.plot.choice import TAKES, default_kind, pictures_of
from saltus.plot.picture import PictureError, picture
from saltus.results.dataset import schema
from saltus.study.run.write import save_picture

from .conftest import rig_run
from .responses_data import kinds_map, resonance


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


# -- registers -------------------------------------------------------------------------------------
@pytest.mark.parametrize(
    ("word", "homes"),
    [
        (r"\.(imshow|pcolormesh)\(", {"cells.py"}),
        (r"\bparameter_axis\(", {"curves.py", "response_points.py"}),
        (r"\boutput_units\b", {"curves.py"}),
        (r"schema\.[A-Z]+,\)", {"choice.py"}),
    ],
)
def test_what_is_one_stays_one(word, homes):
    """One plane of cells, one frame over a parameter, one way to a quantity, one table of kinds."""
    folder = pathlib.Path(plot.__file__).parent
    found = {file.name for file in folder.glob("*.py") if re.search(word, file.read_text("utf-8"))}
    assert found == homes


def test_the_usual_picture_comes_first():
    assert pictures_of(schema.TRAJECTORY) == ("history", "phase")
    assert pictures_of(schema.BASINS) == ("basins",)  # a gallery needs runs too
    assert pictures_of(schema.SETTLED) == ()
    assert (default_kind(resonance(20)), default_kind(kinds_map())) == (
        "frequency_response",
        "type_map",
    )


@pytest.mark.parametrize("name", [name for name in TAKES if name != "phase"])
def test_another_kind_of_result_is_sent_to_its_picture(name):
    other = rig_run(periods=2) if name != "history" else resonance(20)
    where = "Draw it with plot." + (
        "history or plot.phase"
        if name != "history"
        else "frequency_response, plot.bifurcation_diagram, plot.type_map, plot.amplitude_map or "
        "plot.shares"
    )
    arguments = (other, other) if name == "gallery" else (other,)
    with pytest.raises(ParameterError, match=rf"^plot\.{name} takes .*{where}\.$"):
        getattr(plot, name)(*arguments)


@picture(checks=False)
def inner(fault):
    """A picture."""
    raise fault("no such thing.")


@picture(checks=False)
def outer(fault):
    """A picture with another in it."""
    return inner(fault)


def test_a_picture_names_itself_once():
    """Whether the function, a check of its arguments, or a picture inside it finds the fault."""
    map_ = kinds_map()
    for call, says in (
        (lambda: plot.type_map(map_, start=7), "plot.type_map: there is no start 7"),
        (lambda: plot.type_map(map_, begin=7), "plot.type_map has no argument"),
        (lambda: plot.type_map(resonance(20)), "plot.type_map draws two parameters"),
        (lambda: plot.bifurcation_curves([], over=map_), "plot.bifurcation_curves has no curves"),
        (lambda: outer(ParameterError), "plot.inner: no such thing."),
        (lambda: outer(PictureError), "no such thing."),
    ):
        with pytest.raises(ParameterError) as caught:
            call()
        assert str(caught.value).startswith(says)


def test_the_pictures_are_listed_and_a_call_of_their_module_says_what_to_write():
    assert dir(plot) == plot.__all__
    with pytest.raises(TypeError, match=r"sl\.plot\.history\(run\)"):
        plot(1)


def test_the_section_of_a_settled_motion_shows_the_states_that_its_surface_leaves_free():
    """Its velocity at the stop is the same at every contact; a range of zero is no reason to leave
    it out.
    """

    @sl.system(states="x v", forced_at="f", units={"f": "Hz"})
    def hammer(t, x, v, *, gap=2e-3, f=14.0):
        push = 20.0 * sl.cos(2 * sl.pi * f * t) - 4.0 * v - 4e3 * x
        return v, push, sl.impact(x < gap, v, restitution=0.7)

    found = sl.poincare(hammer, (0, 0), "gap", periods=300, transient=400, progress=False)
    axes = plot.section(found)
    assert axes.get_xlabel().startswith("v")
