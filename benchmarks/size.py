"""Amount of code to read in each package, without comments, docstrings, blank lines and imports.

Lines of code depend on how wide they are; tokens (names, numbers, strings, operators) don't.

Usage: ``python benchmarks/size.py [FOLDER]``
"""

from __future__ import annotations

import ast
import io
import sys
import tokenize
from collections import defaultdict
from pathlib import Path

SOURCE = Path(__file__).parents[1] / "src" / "saltus"
SKIPPED = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENDMARKER,
}


def lines_and_tokens(text: str) -> tuple[int, int]:
    """Lines that hold a token of code (a statement over five lines counts five), and the tokens."""
    out = left_out(ast.parse(text))
    tokens = [
        token
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type not in SKIPPED and token.start[0] not in out
    ]
    lines = {line for token in tokens for line in range(token.start[0], token.end[0] + 1)}
    return len(lines), len(tokens)


def left_out(tree: ast.Module) -> set[int]:
    """Lines of imports and docstrings."""
    nodes: list[ast.stmt] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            nodes.append(node)
        if (
            isinstance(node, ast.Module | ast.FunctionDef | ast.ClassDef)
            and ast.get_docstring(node, clean=False) is not None
        ):
            nodes.append(node.body[0])
    return {
        line for node in nodes for line in range(node.lineno, (node.end_lineno or node.lineno) + 1)
    }


def counted(root: Path) -> dict[str, list[int]]:
    """Files, lines, lines of code and tokens of each package, and of all."""
    rows: dict[str, list[int]] = defaultdict(lambda: [0, 0, 0, 0])
    for file in root.rglob("*.py"):
        text, parts = file.read_text(encoding="utf-8"), file.relative_to(root).parts
        counts = (1, text.count("\n"), *lines_and_tokens(text))
        for name in (parts[0] if len(parts) > 1 else ".", "all"):
            rows[name] = [a + b for a, b in zip(rows[name], counts, strict=True)]
    return rows


def main(root: Path) -> None:
    """Print a row for each package, and their sum."""
    print(f"{'package':12s} {'files':>6s} {'lines':>7s} {'code':>7s} {'tokens':>8s}")
    for name, row in sorted(counted(root).items(), key=lambda item: item[1][2]):
        print(f"{name:12s} {row[0]:6d} {row[1]:7d} {row[2]:7d} {row[3]:8d}")


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else SOURCE)
