"""Open names of the templates: loads from symbols and calls of functions that an equation brings
later.
"""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from saltus.codegen.interface import REAL, WHOLE

_WHOLE, _REAL, _POINTER = ir.IntType(64), ir.DoubleType(), ir.IntType(8).as_pointer()


def _symbol(builder: Any, name: str, kind: Any) -> Any:
    """The constant ``saltus_NAME`` that another module defines."""
    module = builder.module
    full = f"saltus_{name}"
    if full not in module.globals:
        one = ir.GlobalVariable(module, kind, full)
        one.linkage, one.global_constant = "external", True
    return module.globals[full]


def size(name: str, kind: type = int) -> Any:
    """A function without arguments that returns the constant of this name: a whole number, a double
    or a truth value.
    """
    numba_type, llvm_type = (types.float64, _REAL) if kind is float else (types.int64, _WHOLE)

    def generate(_context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        value = builder.load(_symbol(builder, name, llvm_type))
        return builder.icmp_signed("!=", value, ir.Constant(_WHOLE, 0)) if kind is bool else value

    @intrinsic
    def one(typingctx):
        return (types.boolean if kind is bool else numba_type)(), generate

    return one


def table(name: str, kind: str) -> Any:
    """A function of an index that returns an entry of the table of this name."""
    numba_type, llvm_type = (types.float64, _REAL) if kind == REAL else (types.int64, _WHOLE)

    def generate(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        place = _symbol(builder, name, ir.ArrayType(llvm_type, 0))
        return builder.load(builder.gep(place, [ir.Constant(_WHOLE, 0), arguments[0]]))

    @intrinsic
    def at(typingctx, index):
        return numba_type(types.int64), generate

    return at


def function(name: str, arguments: tuple[str, ...], returns: bool) -> Any:
    """A function that an equation brings: arrays go to it as the address of their first value."""
    result = types.int64 if returns else types.void

    def generate(context: Any, builder: Any, signature: Any, given: Any) -> Any:
        values = []
        for value, kind in zip(given, signature.args, strict=True):
            first = (
                context.make_array(kind)(context, builder, value).data
                if isinstance(kind, types.Array)
                else value
            )
            values.append(
                builder.bitcast(first, _POINTER) if isinstance(kind, types.Array) else value
            )
        kind = ir.FunctionType(
            _WHOLE if returns else ir.VoidType(), [value.type for value in values]
        )
        answer = builder.call(
            cgutils.get_or_insert_function(builder.module, kind, f"saltus_{name}"), values
        )
        return answer if returns else context.get_dummy_value()

    def typed(given: tuple) -> Any:
        scalar = {WHOLE: types.int64, REAL: types.float64}
        return result(*(scalar.get(kind, one) for one, kind in zip(given, arguments, strict=True)))

    # Numba reads the number of arguments from the function itself, so it is written out
    names = ", ".join(f"a{i}" for i in range(len(arguments)))
    space: dict[str, Any] = dict(typed=typed, generate=generate)
    exec(f"def {name}(typingctx, {names}):\n    return typed(({names},)), generate\n", space)
    return intrinsic(space[name])
