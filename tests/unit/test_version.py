"""The version stands in each file that a release is made of, and is one."""

import re
import tomllib
from pathlib import Path

import pytest

import saltus

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("file", ["CITATION.cff", "conda/recipe/recipe.yaml"])
def test_citation_and_recipe_have_the_version_of_the_package(file):
    first = re.search(r"^\s*version: (\S+)", (ROOT / file).read_text(), re.MULTILINE)
    assert first is not None
    assert first[1] == saltus.__version__


def test_the_project_and_the_changelog_have_it_too():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["version"] == saltus.__version__
    newest = re.search(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert newest is not None
    assert newest[1] == saltus.__version__
