"""Tables made from functions: a parameter of the function is a key of the table, and nothing is
lost on the way.
"""

from __future__ import annotations

import inspect
from typing import get_args

import pytest

import saltus as sl
from saltus.errors import StudyError
from saltus.study.ask import ask
from saltus.study.read import parse
from saltus.study.spec import QUESTIONS
from saltus.study.tables.kinds import KINDS
from saltus.study.tables.methods import METHODS
from saltus.study.tables.signature import documented, table

HEAD = '[study]\nname = "a"\n'
OF_THE_STUDY = {"system", "threads", "progress"}


@pytest.mark.parametrize(
    ("made", "function", "besides"),
    [
        (QUESTIONS["simulate"], sl.simulate, set()),
        (QUESTIONS["poincare"], sl.poincare, {"name"}),
        (QUESTIONS["impacts"], sl.impact_statistics, {"name"}),
        (QUESTIONS["energy"], sl.energy_balance, {"name"}),
        (QUESTIONS["lyapunov"], sl.lyapunov, {"name"}),
        (QUESTIONS["frequency_response"], sl.frequency_response, {"name", "measured"}),
        (QUESTIONS["bifurcation_diagram"], sl.bifurcation_diagram, {"name"}),
    ],
)
def test_keys_are_the_parameters_with_their_defaults(made, function, besides):
    parameters = inspect.signature(function).parameters
    assert set(made.model_fields) == (set(parameters) - OF_THE_STUDY) | besides
    for name, parameter in parameters.items():
        if name not in OF_THE_STUDY and isinstance(parameter.default, bool | int | float | str):
            assert made.model_fields[name].default == parameter.default, name


def test_options_are_those_of_the_methods():
    for name, made in METHODS.items():
        parameters = inspect.signature(getattr(sl, name)).parameters
        assert {
            key: inspect.Parameter.empty if field.is_required() else field.default
            for key, field in made.model_fields.items()
            if key != "name"
        } == {key: parameter.default for key, parameter in parameters.items()}


def test_choices_are_those_that_the_docstring_names():
    assert get_args(QUESTIONS["lyapunov"].model_fields["unit"].annotation) == (
        "1/s",
        "1/period",
        "bit/s",
        "bit/period",
    )
    with pytest.raises(
        StudyError,
        match=r"\[simulate\] time_errors = \"loca\" must be 'measured' "
        r"or 'local'",
    ):
        parse(HEAD + '[simulate]\nperiods = 3\ntime_errors = "loca"\n')


def test_what_is_as_for_another_function_is_told_by_that_one():
    assert documented(sl.poincare)["t_start"] == documented(sl.simulate)["t_start"]
    assert documented(sl.bifurcation_diagram)["seed"] == documented(sl.frequency_response)["seed"]


def test_a_parameter_that_no_kind_describes_is_refused(monkeypatch):
    """A new one of a kind that a file can't write is seen where saltus is built, not by a user."""
    monkeypatch.delitem(KINDS, "force")
    with pytest.raises(TypeError, match=r"force.*no kind says how it is written in a study file"):
        table("impacts", ["impact_statistics"], KINDS)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            '[method]\nname = "Taylor"\norder = 50\n[simulate]\nperiods = 3\n',
            r"\[method\] order "
            r"must be at most 40, not 50",
        ),
        (
            '[simulate]\nperiods = 3\nmethod = { name = "Taylor", lanes = 3 }\n',
            r"\[simulate\.method\] "
            r"lanes must be 2, 4, 8 or 16",
        ),
        (
            '[lyapunov]\nflow = { name = "Taylor", order = 2 }\n',
            r"\[lyapunov\.flow\] order must be "
            r"a whole number of at least 6",
        ),
    ],
)
def test_what_a_method_refuses_is_told_of_its_table(text, told):
    with pytest.raises(StudyError, match=told):
        ask(HEAD + '[system]\nmodel = "delangre"\n' + text)
