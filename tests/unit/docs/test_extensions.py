"""What the documentation generates is complete, and what guards it can fail."""

import importlib
import json
import typing

import pytest


def test_every_row_of_the_glossary_becomes_a_term(root):
    from glossary_terms import as_glossary, terms

    text = (root / "docs/glossary.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("| **")]
    assert (
        len(terms(text)) == len(rows) == sum(line.startswith("|") for line in text.splitlines()) - 2
    )
    words = [word for names, _ in terms(text) for word in names]
    assert len(words) == len(set(words))
    made = as_glossary(
        "# T\n\n| word | meaning |\n|---|---|\n| **a**, **b c** | `x` is *one*. "
        "|\n| **d** (of e) | f |\n"
    )
    assert made == "# T\n\n```{glossary}\na\nb c\n  `x` is *one*.\n\nd\n  (of e) f\n```\n"


def test_every_key_of_a_study_stands_in_the_tables():
    from study_tables import markdown, tables

    from saltus.study.spec import Study, StudyTable

    described = {model for _, model in tables()}
    text = markdown()
    for model in reachable(Study, StudyTable):
        assert model in described
        for name in model.model_fields:
            assert f"| `{name}` |" in text
    assert {
        "[study]",
        "[system]",
        "[simulate]",
        "[basins]",
        "[[basins.map]]",
        "[basins.axes.<name>]",
    } <= {place for place, _ in tables()}
    assert "anything" not in text, "a type has no words"
    headings = [line for line in text.splitlines() if line.startswith("#")]
    assert {
        '### `[method] name = "Taylor"`',
        "### `[[lyapunov]]`",
        "### `[[poincare]]`",
        "### `[[basins.map]]`",
    } <= set(headings)
    assert not any("Annotated" in line for line in headings)


def test_every_variable_of_every_result_stands_in_the_dictionary():
    from result_tables import markdown

    from saltus.results.dataset.schema import KINDS

    text = markdown()
    for kind in KINDS.values():
        for name, variable in kind.variables.items():
            assert f"| `{name}` | {', '.join(variable.dims).replace('<', '&lt;')} |" in text
            assert variable.long_name.replace("|", "\N{DIVIDES}").replace("<", "&lt;") in text
    lengths = {line.count("|") for line in text.splitlines() if line.startswith("|")}
    assert lengths == {5}, "a cell holds the sign between cells"


def reachable(model, base):
    """All tables below one, found without the code under test."""
    found = set()
    for field in model.model_fields.values():
        pending = [field.annotation]
        while pending:
            one = pending.pop()
            if isinstance(one, type) and issubclass(one, base) and one not in found:
                found |= {one} | reachable(one, base)
            pending += typing.get_args(one)
    return found


@pytest.mark.parametrize(
    ("annotation", "text"),
    [
        (int, "whole number"),
        (float | str, "quantity"),
        (float | str | list[float | str] | None, "quantity or list of quantities"),
        (dict[str, list[float | str]], "table of lists of quantities"),
        (typing.Literal["a", "b"], '`"a"` or `"b"`'),
        (int | None, "whole number"),
    ],
)
def test_types_in_words(annotation, text):
    from study_tables import type_text

    assert type_text(annotation) == text


@pytest.mark.parametrize(
    ("html", "loads"),
    [
        ('<script src="https://cdn.example.org/a.js"></script>', 1),
        ('<link rel="stylesheet" href="//fonts.example.org/a.css">', 1),
        ('<img src="http://example.org/a.png"><img srcset="https://example.org/b.png 2x">', 2),
        ("<style>@import url('https://example.org/a.css')</style>", 1),
        (
            '<a href="https://example.org/">read</a><script src="_static/a.js"></script><img '
            'src="data:image/png;base64,AA//AA">',
            0,
        ),
        ('<link rel="canonical" href="https://example.org/">', 0),
    ],
)
def test_a_page_that_loads_something_from_elsewhere_is_found(tmp_path, html, loads):
    from offline import requests

    (tmp_path / "page.html").write_text(f"<html><body>{html}</body></html>")
    assert len(list(requests(tmp_path))) == loads


def test_a_style_sheet_that_loads_something_from_elsewhere_is_found(tmp_path):
    from offline import requests

    (tmp_path / "a.css").write_text(
        "@font-face { src: url(https://example.org/a.woff2); } b { background: url(local.png); }"
    )
    assert [address for _, address in requests(tmp_path)] == ["https://example.org/a.woff2"]


@pytest.mark.parametrize("name", ["flow", "basins"])
def test_what_benchmarks_wrote_can_be_shown(root, name):
    from measured import markdown

    record = json.loads((root / f"docs/comparison/{name}.json").read_text(encoding="utf-8"))
    text = markdown(record)
    assert record["date"] in text
    assert record["command"].startswith(f"python benchmarks/{name}.py")
    assert text.count("\n| saltus") >= 2


def test_a_record_is_written_and_shown(root, tmp_path, monkeypatch):
    from measured import markdown

    monkeypatch.syspath_prepend(str(root))
    record = importlib.import_module("benchmarks.record")
    table = record.Table(
        "T",
        (record.Column("program"), record.Column("time [s]", ".2f"), record.Column("cells", "d")),
        [("a|b", 1.234, None)],
    )
    file = record.Record("probe", "A setting.", [table], ["one isn't installed"]).write(tmp_path)
    text = markdown(json.loads(file.read_text(encoding="utf-8")))
    assert "| a\\|b | 1.23 | - |" in text
    assert "A setting. Measured on " in text
    assert "Left out: one isn't installed." in text


def test_the_picture_of_the_floors_shows_every_room(root):
    from floors import floors, picture

    rooms = [room for floor in floors("saltus") for room in floor]
    there = {
        path.stem
        for path in (root / "src/saltus").iterdir()
        if (path.is_dir() or path.suffix == ".py") and not path.name.startswith("_")
    }
    assert set(rooms) == there
    drawn = picture("saltus")
    assert all(f">{room}</text>" in drawn for room in rooms)
    with pytest.raises(LookupError, match="no contract of layers"):
        floors("saltus.nothing")
