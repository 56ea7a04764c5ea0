"""The templates' bitcode in the package: codegen/lowering makes it, once for every equation and
every processor.
"""

from __future__ import annotations

import ast
import hashlib
import json
import lzma
import threading
from dataclasses import replace
from functools import cache
from importlib import resources
from typing import Any

from saltus.codegen.interface import (
    ADAMS,
    BALANCE,
    CAPTURE,
    FIXED_STEP,
    HARMONICS,
    MODAL,
    MODE_LANES,
    NDF,
    PAIR,
    TAYLOR,
    WAVES,
    Interface,
)
from saltus.errors import CacheError

#: Widths of a step of the Taylor flow.
WIDTHS = (2, 4, 8, 16)
#: Interface and lanes of every bitcode.
BITCODE: dict[str, tuple[Interface, int]] = {
    **{f"taylor_{lanes}": (TAYLOR, lanes) for lanes in WIDTHS}, "pair": (PAIR, 1),
    "fixed_step": (FIXED_STEP, 1), "adams": (ADAMS, 1), "ndf": (NDF, 1), "capture": (CAPTURE, 1),
    "harmonics": (HARMONICS, 1), "balance": (BALANCE, 1), "modal": (MODAL, MODE_LANES),
    "waves": (WAVES, MODE_LANES),
}  # fmt: skip
#: Kernels that the templates import.
_SHARED = ("lanes", "trigonometry", "isolation", "status", "batch", "parts", "clocks_layout")
#: Raised when codegen/lowering makes other bitcode of the same templates.
BITCODE_VERSION = 3


@cache
def text(name: str) -> str:
    """The text of a template, such as ``"taylor/step"``, or of a kernel that templates import."""
    source = resources.files("saltus.kernels").joinpath(f"{name}.py").read_text(encoding="utf-8")
    return source.replace("from __future__ import annotations\n", "\n")


def _texts(name: str) -> list[str]:
    """The texts from which a bitcode is made."""
    interface, _ = BITCODE[name]
    return [
        text(one) for one in (*filter(None, [interface.layout]), *interface.templates, *_SHARED)
    ]


def _hash(name: str, texts: list[str]) -> str:
    interface, lanes = BITCODE[name]
    open_names = replace(interface, layout="", templates=())  # their texts count, not their places
    return hashlib.sha256(
        "\0".join([*texts, repr(open_names), str(lanes), str(BITCODE_VERSION)]).encode()
    ).hexdigest()


@cache
def source_hash(name: str) -> str:
    """Hash of everything that a bitcode is made of, without comments and docstrings: it tells if
    the bitcode is current.
    """
    return _hash(name, [_code_of(one) for one in _texts(name)])


@cache
def text_hash(name: str) -> str:
    """Hash of the same texts to the character: quick, and enough for unchanged files."""
    return _hash(name, _texts(name))


class _WithoutDocstrings(ast.NodeTransformer):
    def visit_Expr(self, node: ast.Expr) -> ast.AST | None:
        return None if isinstance(node.value, ast.Constant) else node


#: CPython 3.11 can't parse to a tree in two threads at once ("AST constructor recursion depth
#: mismatch").
_PARSER = threading.Lock()


def tree_of(source: str) -> ast.Module:
    """A Python text as a tree, from any thread."""
    with _PARSER:
        return ast.parse(source)


def _code_of(source: str) -> str:
    """A Python text without comments, docstrings and layout."""
    return ast.unparse(_WithoutDocstrings().visit(tree_of(source)))


@cache
def manifest() -> dict[str, Any]:
    """The manifest of the bitcode: hashes of its sources and of itself, and the versions that made
    it.

    Raises
    ------
    CacheError
        If it isn't there, or damaged.
    """
    try:
        known: dict[str, Any] = json.loads(_brought("manifest.json"))
        if all(
            isinstance(known["bitcode"][name][one], str)
            for name in BITCODE
            for one in ("texts", "sources", "sha256")
        ):
            return known
    except (ValueError, KeyError, TypeError, RecursionError):
        pass
    raise CacheError("saltus/kernels/bitcode/manifest.json is damaged: install saltus again.")


def _brought(file: str) -> bytes:
    """A file of the bitcode, as installed."""
    try:
        return resources.files("saltus.kernels").joinpath(f"bitcode/{file}").read_bytes()
    except OSError as error:
        raise CacheError(
            f"saltus/kernels/bitcode/{file} can't be read: {error.strerror or error}. "
            f"Install saltus again."
        ) from None


@cache
def bitcode(name: str) -> bytes:
    """The bitcode of this name.

    Raises
    ------
    CacheError
        If it is damaged.
    """
    data = _brought(f"{name}.bc.xz")
    if hashlib.sha256(data).hexdigest() != manifest()["bitcode"][name]["sha256"]:
        raise CacheError(f"saltus/kernels/bitcode/{name}.bc.xz is damaged: install saltus again.")
    return lzma.decompress(data)


@cache
def is_current(name: str) -> bool:
    """True if a bitcode is made from the templates of this installation."""
    known: dict[str, str] = manifest()["bitcode"][name]
    return known["texts"] == text_hash(name) or known["sources"] == source_hash(name)


def identity(name: str) -> str:
    """Name of a bitcode in the keys of the code made from it."""
    return str(manifest()["bitcode"][name]["sha256"]) if is_current(name) else source_hash(name)


@cache
def open_names_of(interface: Interface) -> tuple[str, ...]:
    """The names of a layout whose values depend on open sizes, in the order in which they are
    computed.
    """
    if not interface.layout:
        return ()
    unknown, found = {*interface.sizes, *interface.flags, *interface.tables}, list[str]()
    for node in tree_of(text(interface.layout)).body:
        if isinstance(node, ast.Assign) and unknown & {
            name.id for name in ast.walk(node.value) if isinstance(name, ast.Name)
        }:
            names = [
                name.id
                for target in node.targets
                for name in ast.walk(target)
                if isinstance(name, ast.Name)
            ]
            found += names
            unknown |= set(names)
    return tuple(found)


@cache
def layout_code(name: str) -> Any:
    """A layout, compiled as Python: it computes the work arrays for the sizes of a head."""
    return compile(text(name), f"<saltus/kernels/{name}.py>", "exec")
