"""Errors keep the parts of what they say, and nobody reads them by their text."""

from __future__ import annotations

import ast
import pickle
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import saltus
from saltus.errors import LONGEST, ParameterError, closest, must_be, nearest, one_of, unknown

SOURCES = Path(saltus.__file__).parent
#: Functions that read an error by its text, and why.
READERS = {
    ("study/messages.py", "syntax_fault"): "tomllib says the line and the fault in a text",
    ("system/formula.py", "_parsed"): "the first sentence of a SyntaxError is shown",
    (
        "results/files/export.py",
        "to_netcdf",
    ): "xarray has no type for numbers that netCDF can't hold",
}
#: What reads a text: methods of str, and functions of re.
READING = {
    "startswith", "endswith", "find", "index", "rfind", "partition", "rpartition", "split", "count",
    "search", "match", "fullmatch", "findall",
}  # fmt: skip


def caught(tree: ast.AST) -> set[str]:
    """Names that hold an exception: of ``except``, and of arguments said to be one."""
    names = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ExceptHandler) and node.name:
            names.add(node.name)
        elif isinstance(node, ast.arg) and node.annotation is not None:
            kinds = [one.id for one in ast.walk(node.annotation) if isinstance(one, ast.Name)]
            if any("Error" in kind or "Exception" in kind for kind in kinds):
                names.add(node.arg)
    return names


def is_text(node: ast.AST, errors: set[str]) -> bool:
    """True of what is the text of an error, or a piece of it."""
    match node:
        case ast.Call(func=ast.Name(id="str" | "repr"), args=[ast.Name(id=name)]):
            return name in errors
        case ast.JoinedStr(values=[ast.FormattedValue(value=ast.Name(id=name))]):
            return name in errors
        case ast.Attribute(value=ast.Name(id=name), attr="args" | "msg" | "message"):
            return name in errors
        case ast.Subscript(value=inner) | ast.Call(func=ast.Attribute(value=inner)):
            return is_text(inner, errors)
    return False


def reads(tree: ast.AST) -> Iterator[ast.AST]:
    """Places at which the text of an error is compared, searched or taken apart."""
    errors = caught(tree)
    if not errors:
        return
    held = {
        target.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Assign) and is_text(node.value, errors)
        for target in node.targets
        if isinstance(target, ast.Name)
    }

    def of_error(node: ast.AST) -> bool:
        return is_text(node, errors) or (isinstance(node, ast.Name) and node.id in held)

    for node in ast.walk(tree):
        match node:
            case ast.Compare(left=left, comparators=others):
                if any(map(of_error, (left, *others))):
                    yield node
            case ast.Call(func=ast.Attribute(value=owner, attr=name), args=args):
                if name in READING and args and any(map(of_error, (owner, *args))):
                    yield node


#: What holds an exception: an ``except``, or an argument said to be one.
HOLDS = re.compile(r"except [^\n]* as |: [^\n]*(Error|Exception)")


def found(text: str) -> list[str]:
    """Names of the innermost functions that read an error."""
    if not HOLDS.search(text):
        return []
    functions = [one for one in ast.walk(ast.parse(text)) if isinstance(one, ast.FunctionDef)]
    places = {id(node) for one in functions for node in reads(one)}
    if not places:
        return []
    inner = {id(node): one.name for one in functions for node in ast.walk(one)}
    return sorted({inner[place] for place in places})


@pytest.mark.parametrize(
    "line",
    [
        "'for ^' in str(error)",
        "str(error) == 'no'",
        "str(error).startswith('saltus has no ')",
        "error.args[0].startswith('no')",
        "re.search('Relation', str(error))",
        "f'{error}'.split(':')[0] == 'a'",
    ],
)
def test_a_reader_of_errors_is_seen(line):
    text = (
        f"def f():\n    try:\n        g()\n    except ValueError as error:\n        return {line}\n"
    )
    assert found(text) == ["f"]


def test_what_only_shows_an_error_is_none():
    assert not found("def f(error: Exception):\n    return str(error).rstrip('.') + f'{error}'\n")


def test_no_error_is_read_by_its_text():
    there = {
        (path.relative_to(SOURCES).as_posix(), name)
        for path in SOURCES.rglob("*.py")
        for name in found(path.read_text(encoding="utf-8"))
    }
    assert there == set(READERS)


# -- parts -----------------------------------------------------------------------------------------
def test_an_error_inside_another_is_said_with_it():
    inner = ParameterError("give ", lambda say: say.key(t_end="10 s"), ".")
    outer = ParameterError("trajectory 3: ", inner)
    assert str(outer) == 'trajectory 3: give t_end="10 s".'
    assert outer.parts[1] is inner


def test_an_error_travels_between_processes():
    error = pickle.loads(pickle.dumps(ParameterError(lambda say: say.key("t_end"))))
    assert (type(error), str(error)) == (ParameterError, "t_end=")


def test_a_long_message_loses_its_middle():
    assert len(str(ParameterError("x" * 10_000, lambda _say: "y"))) < LONGEST + 100


def test_arguments_of_another_kind():
    assert str(must_be("every", "a positive time", -1)) == "every must be a positive time, not -1."
    message = "rig has no state 'velocty'. Did you mean 'velocity'?"
    assert str(unknown("rig has no state", "velocty", ["x", "velocity"])) == message
    one_of(("none", "hann"), window="hann")
    with pytest.raises(ParameterError, match=r"window='han' isn't known\. Did you mean 'hann'\?"):
        one_of(("none", "hann"), window="han")
    with pytest.raises(ParameterError, match=r"a: window=\[1\] isn't known\. Known: none, hann"):
        one_of(("none", "hann"), "a: ", window=[1])


def test_the_nearest_name():
    assert closest("velocty", ["x", "velocity"]) == "velocity"
    assert closest("q", ["x"]) is closest(3, ["x"]) is None
    assert nearest("q", ["x"], otherwise="None is near.") == "None is near."
