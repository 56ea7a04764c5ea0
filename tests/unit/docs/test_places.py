"""Pages for whoever changes the code name files and folders that are there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
PAGES = ("CONTRIBUTING.md", "docs/architecture.md", "docs/decisions/README.md")
FOLDERS = (
    "src", "tests", "benchmarks", "docs", "replications", "changelog.d", ".ci", "conda", "web",
)  # fmt: skip
PLACE = re.compile(r"`((?:[\w.]+/)+(?:\w+\.\w+)?|\w+\.py)`")


def missing(text: str, places: set[str]) -> list[str]:
    """Files and folders in backticks that are the end of none of the places."""
    return [name for name in PLACE.findall(text) if not any(p.endswith(f"/{name}") for p in places)]


@pytest.fixture(scope="module")
def places():
    return {
        f"/{path.relative_to(ROOT).as_posix()}{'/' * path.is_dir()}"
        for folder in FOLDERS
        for path in [ROOT / folder, *(ROOT / folder).rglob("*")]
        if "__pycache__" not in path.parts
    }


@pytest.mark.parametrize("page", PAGES)
def test_places_that_are_named_are_there(page, places):
    assert not missing((ROOT / page).read_text(encoding="utf-8"), places)


def test_a_place_that_is_gone_would_be_seen():
    assert missing(
        "`flow/engine.py`, `gone.py` and `analysis/orbits/`", {"/src/flow/engine.py"}
    ) == [
        "gone.py",
        "analysis/orbits/",
    ]
