"""The pages of the documentation are programs: their code, studies and commands run. Notebooks run
when the docs are built.
"""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

import saltus
from saltus.analysis.basins import pipeline

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
#: Commands of other programs that pages may show: CI runs the first (see .ci/run), people the
#: second.
OTHERS = {"pip install .", "python -m benchmarks"}
#: What other tests run, or CI does: `reproduce` with its smallest figure, since the whole takes
#: minutes.
ELSEWHERE = {
    "saltus demo",
    "saltus reproduce saunders2021 --quick",
    "saltus reproduce saunders2021",
}

#: Languages of the programs that a page compares saltus with; saltus's own code beside them runs.
FOREIGN = {"matlab", "julia"}

_BLOCK = re.compile(r"^```(?:\{code-block\} )?(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)


_CELL = re.compile(r"^```\{code-cell\}[^\n]*\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def cells(page: str, heading: str = "") -> list[str]:
    """The code cells of a notebook's page, or of one of its sections, in order."""
    text = (DOCS / page).read_text(encoding="utf-8")
    begin = text.index(f"\n## {heading}\n") if heading else 0
    end = text.find("\n## ", begin + 1) if heading else len(text)
    return _CELL.findall(text[begin:end])


def is_notebook(text: str) -> bool:
    return text.startswith("---\nfile_format: mystnb")


def blocks(page: Path) -> list[tuple[str, str]]:
    """(language, text) of the fenced code of a page, in order."""
    return _BLOCK.findall(page.read_text(encoding="utf-8"))


PAGES = sorted(page for page in DOCS.rglob("*.md") if "_build" not in page.parts)
WITH_CODE = [page for page in PAGES if blocks(page)]


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=pytest.mark.slow if page.stem == "studies" else ())
        for page in WITH_CODE
    ],
    ids=[page.stem for page in WITH_CODE],
)
def test_code_of_a_page_runs(page, tmp_path, monkeypatch):
    """In order, in one namespace and one folder; a study is saved under the name that the next
    command uses. Few starts look for the attractors of a map, and few of its cells are computed
    again: that a page runs is asked here, not what comes out.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(pipeline, "SCOUTS", 64)
    monkeypatch.setattr(pipeline, "CHECKED", 16)
    names: dict[str, object] = {"__name__": "page"}
    for language, text in blocks(page):
        match language:
            case "python":
                assert not is_notebook(page.read_text()), "a notebook's code stands in code cells"
                exec(compile(text, page.name, "exec"), names)
            case "toml":
                Path("study.toml").write_text(text)
            case "console" | "bash":
                for line in text.splitlines():
                    run_command(line.removeprefix("$ "))
            case _ if language in FOREIGN:
                assert page.name == "coming-from.md", f"{page.name} shows {language}"
            case _:
                pytest.fail(f"{page.name} has a block of {language}, which no test runs")


def run_command(line: str) -> None:
    """A command of a page; those of saltus are carried out."""
    if line in OTHERS | ELSEWHERE:
        return
    program, *arguments = shlex.split(line)
    assert program == "saltus", f"{line!r} is no command that a test runs"
    from saltus.cli.commands import app

    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0, (line, result.output)


def test_notebooks_are_executed_and_fail_loudly():
    conf = (DOCS / "conf.py").read_text()
    assert 'nb_execution_mode = "force"' in conf
    assert "nb_execution_raise_on_error = True" in conf
    notebooks = [page for page in PAGES if "{code-cell}" in page.read_text(encoding="utf-8")]
    assert notebooks
    assert [
        page.name for page in notebooks if not is_notebook(page.read_text(encoding="utf-8"))
    ] == []


def test_every_public_name_is_documented():
    text = (DOCS / "api.md").read_text(encoding="utf-8")
    documented = {
        name.rpartition(".")[2] for name in re.findall(r"^\.\. auto\w+:: (\S+)", text, re.MULTILINE)
    }
    named = set(re.findall(r"`sl\.(\w+)`", text))
    assert set(saltus.__all__) - {"models", "plot"} - documented - named == set()
    assert set(saltus.models.MODELS) <= documented
    drawn = (DOCS / "models.md").read_text(encoding="utf-8")
    assert [name for name in saltus.models.MODELS if f"sl.models.{name}(" not in drawn] == []
    assert {name for name in saltus.plot.__all__ if name.islower()} <= documented


def test_ci_builds_the_documentation_without_warnings():
    script = (ROOT / ".ci" / "run").read_text()
    assert 'pip install -q -e ".[docs,lint,browser]"' in script
    assert "sphinx-build -W --keep-going" in script


@pytest.mark.slow
def test_the_superelement_of_the_page_on_structures_is_its_beam(tmp_path, monkeypatch):
    """The cells as they stand there; what a boundary of Craig and Bampton keeps is exact."""
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for cell in [*cells("structures.md")[:2], *cells("structures.md", "Superelements")]:
        exec(compile(cell, "structures.md", "exec"), names)
    reduced = names["reduced"]
    assert "Static flexibility at stop: 100 % of it kept" in reduced.description
    transform, known = names["T"], "tip middle m1 m2 m3 m4"
    small = [transform.T @ names[one] @ transform for one in "MK"]
    found = saltus.structure_modes(*small, 3, at="tip", names=known)
    full = saltus.structure_modes("beam.npz", modes=3, at="w_20")
    assert float(found["flexibility"][0]) == pytest.approx(float(full["flexibility"][0]), rel=1e-9)
    ratio = found["frequency"].values / full["frequency"].values
    assert (ratio > 1 - 1e-9).all()  # Rayleigh: a reduction stiffens
    assert (ratio < 1.01).all()
    run = saltus.simulate(reduced, t_end=0.3, progress=False)
    whole = saltus.simulate(names["beam"], t_end=0.3, progress=False)
    tips = (run["deflection at stop"].values[-1], whole["tip"].values[-1])
    assert tips[0] == pytest.approx(tips[1], rel=0.05)
