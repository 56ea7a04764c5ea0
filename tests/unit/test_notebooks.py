"""What notebooks show: a result in a line, a refusal in a sentence, progress that goes away.

IPython isn't needed: what it calls is called here, and what is called of it stands in its place.
"""

from __future__ import annotations

import sys
import types
import warnings

import pytest

import saltus as sl
from saltus.errors import ParameterError, SaltusError
from saltus.flow.progress import _NotebookBar, reporting

rig = sl.models.delangre("a", force="4 N", frequency="8 Hz")


# -- results ---------------------------------------------------------------------------------------
def top_of(result) -> str:
    """What stands above the page that xarray makes."""
    page = result._repr_html_()
    text, _, rest = page.partition("</pre>")
    assert "xr-wrap" in rest
    return text.removeprefix("<pre>")


def test_a_run_says_its_length_contacts_and_how_it_ended():
    run = sl.simulate(rig, ("1 mm", 0), periods=60)
    assert (
        top_of(run) == f"delangre: 60 T, {run.sizes['contact']} contacts, ok, no unresolved graze"
    )
    late = sl.simulate(rig, (0, 0), periods=60, keep=1, values={"force": [1e-9, 1e-8]})
    assert top_of(late) == "delangre: 2 trajectories, 1 T, no contact, 2 ok, no unresolved graze"
    ball = sl.simulate(sl.models.falling_ball(), (1.0, 0.0), t_end=0.4)
    assert top_of(ball) == "falling_ball: 0.4 s, no contact, ok, no unresolved graze"


def test_unresolved_grazes_and_ends_that_are_none_are_said():
    run = sl.simulate(rig, ("1 mm", 0), periods=2)
    counted = run.assign(status="budget_steps", grazes_unresolved=2)
    assert top_of(counted).endswith("budget_steps, 2 unresolved grazes")


def test_other_results_say_what_describe_says():
    found = sl.attractors(rig, (0, 0))
    assert top_of(found).splitlines()[0] == "delangre"
    assert set(top_of(found).splitlines()[1:]) < set(sl.describe(found).splitlines())


def test_what_is_left_of_a_result_is_shown_whatever_was_done_to_it():
    run = sl.simulate(rig, ("1 mm", 0), periods=2)
    assert top_of(run[["x"]]) == "delangre: 2 T"
    assert run.drop_attrs()._repr_html_().startswith("<div>")
    found = sl.attractors(rig, (0, 0))
    assert "xr-wrap" in found.drop_vars("attractor_type")._repr_html_()


def test_a_name_is_never_markup():
    run = sl.simulate(rig, ("1 mm", 0), periods=2).assign_attrs(system="<script>")
    assert top_of(run).startswith("&lt;script&gt;: 2 T")


# -- refusals --------------------------------------------------------------------------------------
def caught(call) -> SaltusError:
    with pytest.raises(SaltusError) as refused:
        call()
    return refused.value


def test_a_refusal_is_the_own_line_and_the_sentence():
    def wrong():
        return sl.simulate(rig, periods=-3)

    error = caught(wrong)
    number = wrong.__code__.co_firstlineno + 1
    line, sentence = error._render_traceback_()
    assert line == f"line {number}: return sl.simulate(rig, periods=-3)"
    assert sentence == "ParameterError: periods must be a whole number of at least 1, not -3."


def test_of_a_refusal_deep_inside_the_line_is_that_which_called():
    def force(t, x, v, *, k=1.0):
        return v, -k * x if x > 0 else 0.0

    error = caught(lambda: sl.system(states="x v")(force))
    line, _ = error._render_traceback_()
    assert line.endswith('error = caught(lambda: sl.system(states="x v")(force))')


def test_a_refusal_that_was_never_raised_is_its_sentence():
    assert ParameterError("No.")._render_traceback_() == ["ParameterError: No."]


# -- progress --------------------------------------------------------------------------------------
@pytest.fixture
def outputs(monkeypatch):
    """The outputs of a cell, as the protocol of Jupyter keeps them: an update takes the place."""
    kept: list[dict[str, str]] = []
    shown: list[dict[str, str]] = []

    class Handle:
        def update(self, content, *, raw):
            assert raw
            kept[0] = content
            shown.append(content)

    def display(content, *, raw, display_id):
        assert (raw, display_id) == (True, True)
        kept.append(content)
        shown.append(content)
        return Handle()

    ipython = types.ModuleType("IPython")
    ipython.get_ipython = lambda: types.SimpleNamespace(kernel=object())
    ipython.display = types.ModuleType("IPython.display")
    ipython.display.display = display
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    monkeypatch.setitem(sys.modules, "IPython.display", ipython.display)
    monkeypatch.setattr(_NotebookBar, "PATIENCE", 0.0)
    monkeypatch.setattr(_NotebookBar, "EVERY", 0.0)
    return types.SimpleNamespace(kept=kept, shown=shown)


@pytest.mark.parametrize("progress", [None, True])
def test_progress_is_one_output_that_is_empty_in_the_end(outputs, progress, capfd):
    with reporting(progress) as show:
        for share in (0.1, 0.5, 0.9):
            show(share)
    said = [content["text/plain"] for content in outputs.shown[:-1]]
    assert [text.split(" in ")[0] for text in said] == [
        "integrating: 10%",
        "integrating: 50%",
        "integrating: 90%",
    ]
    assert outputs.kept == [{}]
    assert capfd.readouterr() == ("", "")


def test_progress_goes_away_on_ctrl_c_too(outputs):
    def interrupted():
        with reporting(None) as show:
            show(0.5)
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert outputs.kept == [{}]


def test_short_work_shows_nothing(outputs, monkeypatch):
    monkeypatch.setattr(_NotebookBar, "PATIENCE", 60.0)
    with reporting(None) as show:
        show(0.5)
    assert outputs.kept == []


def test_without_progress_nothing_is_shown(outputs):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sl.simulate(rig, ("1 mm", 0), periods=60, progress=False)
    assert outputs.kept == []
