"""Hash of code: it depends on the statements only, not on comments, docstrings and the version of
Python.
"""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from saltus import cache as disk_cache

#: The folder of saltus.
PACKAGE = Path(__file__).parents[1]
#: All code that takes part in the way from equations, values and arguments to a Dataset: these
#: packages and modules import nothing else of saltus, but for messages. Models and the reading of
#: study files stand in the equations, values and arguments themselves.
COMPUTING = (
    "fence", "intervals", "interrupt", "unit_table", "units", "distributions", "whole_files",
    "cache", "language", "contact", "system", "kernels", "codegen", "flow", "results", "analysis",
)  # fmt: skip
#: Fields of Python's syntax tree without effect on the code.
_IDLE = ("kind", "type_comment", "ctx")


@cache
def code_hash(*places: str) -> str:
    """SHA-256 of the code of packages and modules of saltus, by default of :data:`COMPUTING`.

    To read the syntax takes half a second, so the hash is cached under that of the text.
    """
    sources = dict(pair for place in places or COMPUTING for pair in _sources(place))
    key = hash_of({**sources, "": Path(__file__).read_bytes()})
    found = disk_cache.read(key, disk_cache.HASH)
    if found is None:
        found = hash_of(
            {name: statement_hash(source).encode() for name, source in sources.items()}
        ).encode()
        disk_cache.keep(key, "code of saltus", found, disk_cache.HASH)
    return found.decode()


def hash_of(texts: Mapping[str, bytes]) -> str:
    """SHA-256 of named texts."""
    digest = hashlib.sha256()
    for name, text in texts.items():
        digest.update(f"{name} {len(text)}\n".encode() + text)
    return digest.hexdigest()


@cache
def statement_hash(source: bytes) -> str:
    """SHA-256 of code without its comments and docstrings; versions of Python agree on it."""
    return hashlib.sha256(_written(ast.parse(source)).encode("utf-8", "surrogatepass")).hexdigest()


def _written(value: Any) -> str:
    if isinstance(value, list):
        return f"[{' '.join(map(_written, value))}]"
    if not isinstance(value, ast.AST):
        return repr(value)
    fields = {name: part for name, part in ast.iter_fields(value) if name not in _IDLE}
    if isinstance(
        value, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
    ) and _is_text(value.body[:1]):
        fields["body"] = value.body[1:]
    if isinstance(value, ast.JoinedStr):
        # Python 3.12 adds empty constants.
        fields["values"] = [
            part
            for part in value.values
            if not (isinstance(part, ast.Constant) and part.value == "")
        ]
    # Python versions differ in empty fields
    said = sorted((name, part) for name, part in fields.items() if part is not None and part != [])
    return f"{type(value).__name__}({' '.join(f'{name}={_written(part)}' for name, part in said)})"


def _is_text(body: list[ast.stmt]) -> bool:
    """True if a body begins with a docstring."""
    first = body[0] if body else None
    return (
        isinstance(first, ast.Expr)
        and isinstance(first.value, ast.Constant)
        and isinstance(first.value.value, str)
    )


def _sources(place: str) -> Iterator[tuple[str, bytes]]:
    """Names and texts of the modules of a package of saltus, such as ``study.answers``, with its
    subpackages, or of one module alone.
    """
    alone = PACKAGE / f"{place.replace('.', '/')}.py"
    for file in [alone] if alone.is_file() else sorted(alone.with_suffix("").rglob("*.py")):
        yield file.relative_to(PACKAGE).as_posix(), file.read_bytes()
