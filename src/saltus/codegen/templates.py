"""The templates' bitcode that the package brings: codegen/lowering makes it, once for every equation and every processor."""

from __future__ import annotations

import ast
import hashlib
import io
import json
import lzma
import tokenize
from functools import cache
from importlib import resources
from typing import Any

from saltus.codegen.interface import CAPTURE, ODE45, TAYLOR, Interface
from saltus.errors import CacheError

#: Widths of a step of the Taylor flow.
WIDTHS = (2, 4, 8, 16)
#: Every bitcode: what it is made of, and lanes.
BITCODE: dict[str, tuple[Interface, int]] = {
    **{f"taylor_{lanes}": (TAYLOR, lanes) for lanes in WIDTHS}, "ode45": (ODE45, 1), "capture": (CAPTURE, 1),
}  # fmt: skip
#: Kernels that the templates import.
_SHARED = ("lanes", "trigonometry", "isolation", "status", "batch", "parts", "clocks_layout")
#: What makes bitcode of them, in codegen/.
_MAKERS = ("interface", "lowering/lane_types", "lowering/open_names", "lowering/frontend", "lowering/bitcode")


@cache
def text(name: str) -> str:
    """A template, or a kernel that templates import."""
    return resources.files("saltus.kernels").joinpath(f"{name}.py").read_text(encoding="utf-8").replace("from __future__ import annotations\n", "\n")


@cache
def source_hash(name: str) -> str:
    """Hash of all that a bitcode is made of, comments and docstrings left out: what says whether it is still what the templates give."""
    interface, lanes = BITCODE[name]
    names = [*filter(None, [interface.layout]), *interface.templates, *_SHARED]
    makers = [resources.files("saltus.codegen").joinpath(f"{maker}.py").read_text(encoding="utf-8") for maker in _MAKERS]
    parts = [*(_code_of(text(one)) for one in names), *map(_code_of, makers), str(lanes)]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()


def _code_of(source: str) -> str:
    """A Python text without comments, docstrings and its own layout."""
    tokens = tokenize.generate_tokens(io.StringIO(source).readline)
    kept, before = [], tokenize.NEWLINE
    for kind, word, *_ in tokens:
        docstring = kind == tokenize.STRING and before in (tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.NL)
        if kind not in (tokenize.COMMENT, tokenize.NL, tokenize.ENCODING) and not docstring:
            kept.append(word if kind not in (tokenize.INDENT, tokenize.DEDENT) else str(kind))
        if kind not in (tokenize.COMMENT, tokenize.NL):
            before = kind
    return " ".join(kept)


@cache
def manifest() -> dict[str, Any]:
    """What is known of the bitcode: hashes of its sources and of itself, versions that made it, names of the layouts that depend on sizes."""
    return json.loads(resources.files("saltus.kernels").joinpath("bitcode/manifest.json").read_text(encoding="utf-8"))


@cache
def bitcode(name: str) -> bytes:
    """The bitcode of this name.

    Raises
    ------
    CacheError
        If it is damaged.
    """
    data = resources.files("saltus.kernels").joinpath(f"bitcode/{name}.bc.xz").read_bytes()
    if hashlib.sha256(data).hexdigest() != manifest()["bitcode"][name]["sha256"]:
        raise CacheError(f"saltus/kernels/bitcode/{name}.bc.xz is damaged: install saltus again.")
    return lzma.decompress(data)


def identity(name: str) -> str:
    """What a bitcode is called in the names of what is made of it."""
    return str(manifest()["bitcode"][name]["sha256"])


def is_current(name: str) -> bool:
    """Whether a bitcode is what the templates of this installation give."""
    return manifest()["bitcode"][name]["sources"] == source_hash(name)


@cache
def layout_code(name: str) -> Any:
    """A layout, compiled as Python: it says what the work arrays hold for the sizes of a head."""
    return compile(ast.parse(text(name)), f"<saltus.kernels.{name}>", "exec")
