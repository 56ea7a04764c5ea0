"""One module of the templates as bitcode, simplified as far as sizes and processor don't matter,
with readable names.
"""

from __future__ import annotations

import re

import llvmlite.binding as llvm

from saltus.codegen.interface import known_of_argument

#: Functions that run only at breaks of time, touches, starts and ends, in every template that has
#: one of the name: LLVM doesn't optimise them, which saves a quarter of its time.
COLD = {
    "place_clocks", "set_clocks", "follow_clocks", "first_guess", "begin_of", "hold_piece",
    "hold_polynomial", "on_from_to", "knots",
    "knot", "repeats", "is_cyclic", "rate_of", "place_of", "place_at_base", "turned", "two_product",
    "touches_exactly", "touch_error",
    "note_touch", "note_touches", "is_exact_zero", "final_contacts", "start_sides", "fill", "empty",
    "refill", "set_period", "is_broken",
    "record", "saltate", "overflowed", "end_stretch", "is_slow", "periods_behind", "write_samples",
    "take_impacts", "end_impacts", "begins_uniquely",
}  # fmt: skip
#: Functions of lanes that few equations or structures need: never inlined, to keep them out of the
#: others.
NOINLINE = {
    "probed", "look_ahead", "negligible_step", "add_what_was_left_out", "amplitudes_of_shapes",
    "state_of_shapes", "write_shapes",
}  # fmt: skip
#: Functions that run once a contact: inlined only by LLVM's cost model. Inlining them always would
#: take time to compile, and gain none.
_BY_COST_MODEL = {"attend", "change_side", "land_all"}
_MANGLED = re.compile(r"_ZN8template(\d+)(\w+)")


def bitcode(
    module: llvm.ModuleRef, entry: str, symbol: str, inlined: set[str], arguments: tuple[str, ...]
) -> bytes:
    """The bitcode of a module with one function to be called, ``i64 symbol(ptr values)``.

    Parameters
    ----------
    module : ModuleRef
        From :func:`saltus.codegen.lowering.frontend.module_of`.
    entry : str
        Its function that is to be called.
    symbol : str
        Name that this function gets. Its arguments are read one after the other from the memory
        that it is given.
    inlined : set of str
        Functions that are to be inlined, by the names that they have in the templates.
    arguments : tuple of str
        Types of the arguments, as :class:`saltus.codegen.interface.Interface` has them.
    """
    names = _names(module, symbol)
    # Numba passes it from callers to callees; kernels raise nothing
    text = str(module).replace("alwaysinline", "nounwind")
    text = re.sub(
        r'@("[^"]+"|[\w.$]+)', lambda name: f"@{names.get(name[1].strip(chr(34)), name[1])}", text
    )
    caller = _caller(module.get_function(entry), symbol, names[entry], arguments)
    clean = llvm.parse_assembly(text + caller)
    for function in clean.functions:
        if not function.is_declaration:
            function.linkage = "external" if function.name == symbol else "internal"
            _advise(function, inlined)
    for variable in clean.global_variables:
        if not variable.is_declaration:
            variable.linkage = "internal"  # Numba's constants of exceptions: nobody reads them
    clean.verify()
    _shrink(clean)
    clean.name = symbol
    return clean.as_bitcode()


def _advise(function: llvm.ValueRef, inlined: set[str]) -> None:
    """Mark the functions that LLVM inlines, and those that rarely run."""
    own = function.name.split(".")[1] if "." in function.name else function.name
    if own in NOINLINE:
        function.add_function_attribute("noinline")
    elif own in COLD:
        function.add_function_attribute("cold")
    elif own in inlined - _BY_COST_MODEL | {"numba"}:
        function.add_function_attribute("alwaysinline")


def _names(module: llvm.ModuleRef, symbol: str) -> dict[str, str]:
    """New names of the functions of a module: their name in the templates, and a number."""
    names = {}
    for i, function in enumerate(module.functions):
        if not function.is_declaration:
            own = _MANGLED.match(function.name)
            names[function.name] = (
                f"{symbol}.{own[2][: int(own[1])]}.{i}" if own else f"{symbol}.numba.{i}"
            )
    return names


def _caller(function: llvm.ValueRef, symbol: str, name: str, arguments: tuple[str, ...]) -> str:
    """Write ``i64 symbol(ptr values)``: it calls a function of Numba's with arguments one after the
    other in memory, of which those that are known are numbers; -1 if that fails.
    """
    # its result, an exception, and its arguments
    kinds = [str(argument.type) for argument in function.arguments][2:]
    known = [number for kind in arguments for number in known_of_argument(kind)]
    lines, given = ["%result = alloca i64", "%raised = alloca ptr"], ""
    for i, (kind, number) in enumerate(zip(kinds, known, strict=True)):
        if number is None:
            lines += [
                f"%p{i} = getelementptr i64, ptr %values, i64 {i}",
                f"%a{i} = load {kind}, ptr %p{i}",
            ]
        value = "null" if kind == "ptr" else number
        given += f", {kind} {f'%a{i}' if number is None else value}"
    lines += [
        f"%code = call i32 @{name}(ptr %result, ptr %raised{given})",
        "%value = load i64, ptr %result",
        "%fine = icmp eq i32 %code, 0",
        "%answer = select i1 %fine, i64 %value, i64 -1",
        "ret i64 %answer",
    ]
    return (
        f"\ndefine i64 @{symbol}(ptr %values) {{\n"
        + "\n".join(f"  {line}" for line in lines)
        + "\n}\n"
    )


def _shrink(module: llvm.ModuleRef) -> None:
    """Drop unused functions, and simplify independently of sizes and processor."""
    llvm.initialize_native_target()
    machine = llvm.Target.from_triple(module.triple).create_target_machine()
    builder = llvm.create_pass_builder(machine, llvm.create_pipeline_tuning_options(speed_level=1))
    passes = llvm.create_new_module_pass_manager()
    passes.add_global_dead_code_eliminate_pass()
    passes.add_sroa_pass()
    passes.add_simplify_cfg_pass()
    passes.add_instruction_combine_pass()
    passes.add_simplify_cfg_pass()
    passes.add_global_dead_code_eliminate_pass()
    passes.add_strip_dead_prototype_pass()
    passes.run(module, builder)
