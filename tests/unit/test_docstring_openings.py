"""Docstrings, and the lines above constants, begin with the verb or the thing, not with a question
word.
"""

import ast
import re
from pathlib import Path

import pytest

import saltus

ROOT = Path(saltus.__file__).parent
QUESTION_WORDS = {"What", "Whether", "How", "Where", "Which", "When", "Who", "Whose", "Why", "That"}
#: The first of the lines ``#:`` above a constant.
FIRST_LINES = re.compile(r"(?:^|\n)(?! *#:)[^\n]*\n *#: ([^\n]+)")
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def questions(source: str) -> list[str]:
    """First lines of docstrings, and above constants, that begin with a question word."""
    found: list[str | None] = []
    if any(f'"""{word}' in source for word in QUESTION_WORDS):
        tree = ast.parse(source)
        found = [ast.get_docstring(one) for one in ast.walk(tree) if isinstance(one, DOCUMENTED)]
    found += FIRST_LINES.findall(source)
    return [text.splitlines()[0] for text in found if text and text.split()[0] in QUESTION_WORDS]


def test_nothing_that_is_documented_begins_with_a_question_word():
    found = {}
    for file in sorted(ROOT.rglob("*.py")):
        if asked := questions(file.read_text(encoding="utf-8")):
            found[file.relative_to(ROOT).as_posix()] = asked
    assert not found, "begin with the verb or the thing: Return ..., Periods of ..., True where ..."


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ('def f():\n    """Whether it is so."""', ["Whether it is so."]),
        ('"""What is here.\n\nMore."""\nclass C:\n    """Contacts."""', ["What is here."]),
        ('async def f():\n    """True if it is so."""', []),
        ("x = 'What is no docstring'", []),
        ("x = 1\n#: How often it is tried.\nN = 3", ["How often it is tried."]),
        ("x = 1\n#: Trials of a step\n#: Which fails.\nN = 3", []),
    ],
)
def test_a_question_would_be_seen(text, expected):
    assert questions(text) == expected
