"""Every public function explains itself: units, returns, errors, and an example that runs."""

import doctest
import importlib
import inspect

import pytest

import saltus as sl

#: Functions that stand for those of mathematics, in equations.
MATHEMATICS = ("saltus.language.functions", "saltus.language.compositions")


def public(name):
    """What a public name stands for, whether a module of its name was imported before or not."""
    return getattr(importlib.import_module(sl._HOMES[name]), name)


FUNCTIONS = sorted(
    name
    for name in sl.__all__
    if inspect.isfunction(public(name))
    and inspect.unwrap(public(name)).__module__ not in MATHEMATICS
)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_public_function_says_what_it_takes_and_gives_and_shows_it(name):
    text = inspect.getdoc(public(name))
    for section in ("Parameters", "Returns", "Raises", "Examples"):
        assert f"\n{section}\n{'-' * len(section)}\n" in text, section


@pytest.mark.parametrize("name", FUNCTIONS)
def test_its_example_gives_what_it_says(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    function = inspect.unwrap(public(name))
    names = {"sl": sl, name: function}
    for example in doctest.DocTestFinder(recurse=False).find(function, name, globs=names):
        assert example.examples
        assert (
            doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE).run(example).failed == 0
        )
