"""The kernel templates as one LLVM module with open names, by Numba's front end: typed and lowered,
neither optimised nor compiled.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import llvmlite.binding as llvm
import numpy as np
from numba import njit
from numba.core import codegen
from numba.core.compiler_lock import global_compiler_lock

from saltus.codegen.interface import Interface, numba_type
from saltus.codegen.lowering import lane_types, open_names  # noqa: F401  (lane_types: registers its types)
from saltus.codegen.templates import open_names_of, text
from saltus.kernels import batch, clocks_layout, lanes, parts, status

_OPTIONS = dict(
    nogil=True, error_model="numpy", _nrt=False, no_cpython_wrapper=True, no_cfunc_wrapper=True
)
#: Modules that hold no kernels of their own: numbers, and operations that lane_types.py lowers.
_PLAIN = {
    module.__name__.rsplit(".", 1)[-1]: vars(module)
    for module in (batch, clocks_layout, lanes, parts, status)
}


class _Opener(ast.NodeTransformer):
    """Replaces each open name by a call of the function that reads it."""

    def __init__(self, sizes: set[str], tables: set[str]) -> None:
        self.sizes, self.tables = sizes, tables

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if node.id in self.sizes and isinstance(node.ctx, ast.Load):
            return ast.copy_location(ast.Call(node, [], []), node)
        return node

    def visit_Subscript(self, node: ast.Subscript) -> ast.AST:
        if isinstance(node.value, ast.Name) and node.value.id in self.tables:
            return ast.copy_location(ast.Call(node.value, [self.visit(node.slice)], []), node)
        return self.generic_visit(node)


def _kernels_only(tree: ast.Module) -> Iterator[ast.stmt]:
    """The marked functions of a template, and its numbers."""
    for node in tree.body:
        marked = isinstance(node, ast.FunctionDef) and node.decorator_list
        if marked or isinstance(node, ast.Assign):
            yield node


def _mark(function: ast.FunctionDef) -> str:
    (mark,) = function.decorator_list
    assert isinstance(mark, ast.Name), f"{function.name} is marked in a way that isn't known"
    return mark.id


class _Space:
    """The names of one set of templates while it is built."""

    def __init__(self, arguments: tuple[str, ...]) -> None:
        marks = {
            "kernel": njit(**_OPTIONS), "inner": njit(forceinline=True, **_OPTIONS),
            "entry": njit(f"int64({', '.join(map(numba_type, arguments))})", **_OPTIONS),
        }  # fmt: skip
        operations = {name: value for name, value in vars(lanes).items() if callable(value)}
        self.names: dict[str, Any] = {
            "math": math,
            "np": np,
            "__name__": "template",
            **marks,
            **operations,
        }
        self.inlined: set[str] = set()
        self._built: dict[str, dict[str, Any]] = {}

    def imported(self, module: str) -> dict[str, Any]:
        """The names of a module that templates import: plain ones, or kernels built here."""
        if module in _PLAIN:
            return _PLAIN[module]
        if module not in self._built:
            common = ("math", "np", "__name__", "kernel", "inner", "entry")
            self._built[module] = self.fill(
                {name: self.names[name] for name in common}, module, _Opener(set(), set())
            )
        return self._built[module]

    def fill(self, names: dict[str, Any], module: str, opener: _Opener) -> dict[str, Any]:
        """Run the kernels of a module in these names."""
        tree = ast.parse(text(module))
        for node in tree.body:
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith("saltus.kernels."):
                home = str(node.module).removeprefix("saltus.kernels.")
                if home != "marks":
                    source = self.imported(home)
                    names.update(
                        {alias.asname or alias.name: source[alias.name] for alias in node.names}
                    )
        kernels = ast.Module(list(_kernels_only(tree)), [])
        self.inlined |= {
            node.name
            for node in kernels.body
            if isinstance(node, ast.FunctionDef) and _mark(node) == "inner"
        }
        exec(
            compile(ast.fix_missing_locations(opener.visit(kernels)), f"{module}.py", "exec"), names
        )
        return names


def module_of(interface: Interface, lanes: int) -> tuple[llvm.ModuleRef, str, set[str]]:
    """One module with the entry of a method and everything that it calls.

    Parameters
    ----------
    interface : Interface
        The names left open.
    lanes : int
        Lanes of a step.

    Returns
    -------
    (ModuleRef, str, set of str)
        The module; the name of the entry in it; the templates' names of the functions that are to
        be inlined.
    """
    space = _Space(interface.arguments)
    layout, derived = _layout(interface, lanes)
    kinds = (
        dict.fromkeys(interface.sizes, int)
        | dict.fromkeys(interface.flags, bool)
        | {name: type(layout[name]) for name in derived}
    )
    space.names |= layout
    space.names |= {name: open_names.size(name, kind) for name, kind in kinds.items()}
    space.names |= {name: open_names.table(name, kind) for name, kind in interface.tables.items()}
    for name, arguments in interface.functions.items():
        space.names[name] = open_names.function(name, arguments, name in interface.truths)
    opener = _Opener(set(kinds), set(interface.tables))
    with _front_end_only():
        for name in interface.templates:
            space.fill(space.names, name, opener)
        library = next(iter(space.names[interface.entry].overloads.values())).library
        with global_compiler_lock:
            library._ensure_finalized()
    overload = next(iter(space.names[interface.entry].overloads.values()))
    return library._final_module, overload.fndesc.mangled_name, space.inlined


def _layout(interface: Interface, lanes: int) -> tuple[dict[str, Any], list[str]]:
    """The names of a layout for some sizes, and the names that change with the sizes."""
    space: dict[str, Any] = (
        dict.fromkeys(interface.sizes, 20)
        | dict.fromkeys(interface.flags, False)
        | {"LANES": lanes}
    )
    if not interface.layout:
        return space, []
    exec(compile(text(interface.layout), f"{interface.layout}.py", "exec"), space)
    return space, open_names_of(interface)


@contextmanager
def _front_end_only() -> Iterator[None]:
    """Let Numba only type and lower, without passes, machine code and loading."""
    replaced = {
        (codegen.CPUCodeLibrary, "_optimize_functions"): lambda self, module: setattr(
            module, "data_layout", self._codegen._data_layout
        ),
        (codegen.CPUCodeLibrary, "_optimize_final_module"): lambda self: None,
        (codegen.CPUCodegen, "_add_module"): lambda self, module: None,
        (codegen.CPUCodegen, "_scan_and_fix_unresolved_refs"): lambda self, module: None,
        (codegen.JitEngine, "finalize_object"): lambda self: None,
        (codegen.JITCodeLibrary, "get_pointer_to_function"): lambda self, name: 8,
        (codegen.JITCPUCodegen, "set_env"): lambda self, name, env: None,
    }
    before = {place: getattr(*place) for place in replaced}
    for (owner, name), function in replaced.items():
        setattr(owner, name, function)
    try:
        yield
    finally:
        for (owner, name), function in before.items():
            setattr(owner, name, function)
