"""Modules import in one direction: no circle, nor one by an import inside a function. A verb
stands in a file of its name.
"""

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import saltus
from import_statements import import_statements

SOURCE = Path(saltus.__file__).parents[1]
MODULES = {
    ".".join(file.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__"): file
    for file in SOURCE.rglob("saltus/**/*.py")
}


def imported(node):
    """Modules of saltus that a statement imports: the module that is named in it, or that holds the
    name.
    """
    if isinstance(node, ast.ImportFrom) and node.module:
        for alias in node.names:
            yield from [
                name for name in (f"{node.module}.{alias.name}", node.module) if name in MODULES
            ][:1]
    elif isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names if alias.name in MODULES)


def test_no_circle_of_imports():
    graph = {
        name: {
            one
            for node in import_statements(ast.parse(file.read_text(encoding="utf-8")))
            for one in imported(node)
            if one != name
        }
        for name, file in MODULES.items()
    }
    try:
        order = list(TopologicalSorter(graph).static_order())
    except CycleError as error:
        raise AssertionError(f"a circle: {' -> '.join(error.args[1])}") from None
    assert len(order) == len(MODULES) > 300


def test_a_verb_stands_in_a_file_of_its_name():
    verbs = [
        (name, home)
        for name, home in saltus._HOMES.items()
        if home.startswith("saltus.analysis.") and name.islower()
    ]
    assert len(verbs) > 20
    assert [name for name, home in verbs if not home.endswith(f".{name}")] == []
