"""The text of a generated head, taken apart: its tables, and its functions statement by statement.

Python's parser is slow where it makes trees, and most of a head are lines that need none
(repeats.py).
"""

from __future__ import annotations

import ast
import re
from typing import NamedTuple

from saltus.codegen import templates

_DEFINITION = re.compile(r"def (\w+)\((.*)\):")
_INDENT = "    "


class Function(NamedTuple):
    """A function of a head.

    Attributes
    ----------
    name : str
    arguments : tuple of str
    body : list of str or ast.stmt
        Its statements: a text of one or more lines, or a tree.
    """

    name: str
    arguments: tuple[str, ...]
    body: list[str | ast.stmt]


def functions_of(text: str) -> tuple[list[ast.Assign], dict[str, Function]]:
    """The tables that stand between the functions of a head, and the functions by name.

    A statement begins on a line that is indented by four spaces; what is indented further belongs
    to it.
    """
    tables: list[ast.Assign] = []
    functions: dict[str, Function] = {}
    body: list[str | ast.stmt] = []
    for line in text.splitlines():
        if line.startswith(_INDENT):
            statement = line[len(_INDENT) :]
            if statement.startswith(" "):
                body[-1] = f"{body[-1]}\n{statement}"
            else:
                body.append(statement)
        elif found := _DEFINITION.fullmatch(line):
            name, arguments = found.groups()
            body = []
            functions[name] = Function(name, tuple(arguments.split(", ")), body)
        elif line and not line.startswith("@"):
            tables += [
                node for node in templates.tree_of(line).body if isinstance(node, ast.Assign)
            ]
    return tables, functions


def function_of(tree: ast.FunctionDef) -> Function:
    """A function whose tree is known."""
    arguments = tuple(argument.arg for argument in tree.args.args)
    return Function(tree.name, arguments, list(tree.body))
