"""The extensions of the documentation need what builds it: `pip install -e ".[docs]"`. CI runs
these tests once that is installed.
"""

import sys
from pathlib import Path

import pytest

pytest.importorskip("sphinx", reason='needs pip install -e ".[docs]"')

ROOT = Path(__file__).parents[3]


@pytest.fixture(autouse=True)
def _extensions(monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "_ext"))
    yield
    for name in ("glossary_terms", "study_tables", "measured", "offline", "decision_notes"):
        sys.modules.pop(name, None)


@pytest.fixture
def root():
    return ROOT
