"""The import statements of a module, found without a look at its expressions."""

import ast
from collections.abc import Iterator


def import_statements(
    tree: ast.AST, for_types: bool = False
) -> Iterator[ast.Import | ast.ImportFrom]:
    """Import statements, those inside functions too; those for type checkers if they are asked."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node
        elif isinstance(node, ast.If) and not for_types and _is_for_types(node):
            continue
        elif isinstance(node, ast.stmt | ast.ExceptHandler | ast.match_case):
            yield from import_statements(node, for_types)


def _is_for_types(node: ast.If) -> bool:
    return isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING"
