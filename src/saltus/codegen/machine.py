"""Machine code: LLVM modules compiled to objects for this processor, and objects loaded and called.
The only module that drives LLVM.
"""

from __future__ import annotations

import itertools
import os
import threading
from collections.abc import Collection, Sequence
from functools import cache, lru_cache
from typing import Any, NamedTuple

import llvmlite.binding as llvm

from saltus.errors import CacheError, ParameterError, nearest, shown

#: Version of the code made from the same templates and equations; it is part of the names of cache
#: entries.
PIPELINE = 6
#: LLVM's level for a template, for its passes if its sizes are open, and for an equation alone:
#: straight lines of lanes, ready in a third of the time that level 1 takes (0085).
LEVEL, LEVEL_OPEN, LEVEL_ALONE = 3, 1, 0
#: Lock on LLVM: it keeps modules in one context.
_LLVM = threading.Lock()
_NUMBER = itertools.count()


class Target(NamedTuple):
    """The target of compilation: platform, processor, and its features, such as
    ``+avx2,-avx512f``.
    """

    triple: str
    processor: str
    features: str


#: Levels of x86-64 that ``$SALTUS_PROCESSOR`` may name, and the features of this machine that their
#: code needs.
LEVELS = {
    "x86-64": (), "x86-64-v2": ("sse4.2", "popcnt"), "x86-64-v3": ("avx2", "fma", "bmi2"),
    "x86-64-v4": ("avx512f", "avx512dq", "avx512bw", "avx512vl"),
}  # fmt: skip


@cache
def target() -> Target:
    """The machine at hand, or an older processor of its family named by ``$SALTUS_PROCESSOR``, such
    as ``x86-64-v3``.

    Raises
    ------
    ParameterError
        If it names none that is known, or one that can do more than this machine.
    """
    triple, features = llvm.get_process_triple(), llvm.get_host_cpu_features()
    chosen = os.environ.get("SALTUS_PROCESSOR")
    if not chosen:
        return Target(triple, llvm.get_host_cpu_name(), features.flatten())
    if chosen not in LEVELS or not triple.startswith("x86_64"):
        known = LEVELS if triple.startswith("x86_64") else ()
        raise ParameterError(
            f"SALTUS_PROCESSOR={shown(chosen)} names no processor for {triple}. "
            f"{nearest(chosen, known) if known else ''}"
        )
    if lacking := [name for name in LEVELS[chosen] if not features.get(name)]:
        raise ParameterError(
            f"SALTUS_PROCESSOR={chosen}: this processor lacks "
            f"{', '.join(lacking)}. Name an older one, or none."
        )
    return Target(triple, chosen, "")


def register_width() -> int:
    """Doubles that a register of the target holds."""
    _, processor, listed = target()
    features = set(listed.split(","))
    if features >= {"+avx512f", "+avx512dq"} or processor == "x86-64-v4":
        return 8
    return 4 if features >= {"+avx2", "+fma"} or processor == "x86-64-v3" else 2


def versions() -> tuple[str, ...]:
    """Versions of the packages that make the code."""
    import llvmlite

    return (llvmlite.__version__, ".".join(map(str, llvm.llvm_version_info)), str(PIPELINE))


def object_code(
    template: bytes | None,
    texts: Sequence[str],
    called: Collection[str],
    chosen: Target | None = None,
    *,
    open_sizes: bool = False,
) -> bytes:
    """One object file, optimised as a whole.

    Parameters
    ----------
    template : bytes or None
        Bitcode.
    texts : sequence of str
        LLVM IR: constants that the template leaves open, functions that it calls.
    called : collection of str
        Symbols that others refer to; the rest is this object's own.
    chosen : Target, optional
        Default: this machine.
    open_sizes : bool
        The template reads its sizes as it runs: LLVM neither unrolls its loops nor inlines what
        doesn't ask for it. That takes a third of the time, and gains nothing there (0028).
    """
    made_for = chosen or target()
    alone = template is None
    with _LLVM:
        machine = _target_machine(made_for, LEVEL_ALONE if alone else LEVEL)
        modules = [llvm.parse_bitcode(template)] if template is not None else []
        modules += [llvm.parse_assembly(text) for text in texts]
        module = modules[0]
        module.triple, module.data_layout = made_for.triple, str(machine.target_data)
        for other in modules[1:]:
            other.triple, other.data_layout = module.triple, module.data_layout
            module.link_in(other)
        for one in (*module.functions, *module.global_variables):
            if not one.is_declaration:
                one.linkage = "external" if one.name in called else "internal"
        module.verify()
        if open_sizes:
            _optimise_open(module, machine)
        else:
            _optimise(module, machine, LEVEL_ALONE if alone else LEVEL)
        code: bytes = machine.emit_object(module)
        return code


@lru_cache(maxsize=4)
def _target_machine(made_for: Target, level: int = LEVEL) -> llvm.TargetMachine:
    if made_for.triple == llvm.get_process_triple():
        llvm.initialize_native_target()
        llvm.initialize_native_asmprinter()
    else:
        llvm.initialize_all_targets()
        llvm.initialize_all_asmprinters()
    near = _in_one_block(made_for.triple)
    return llvm.Target.from_triple(made_for.triple).create_target_machine(
        cpu=made_for.processor,
        features=made_for.features,
        opt=level,
        reloc="pic" if near else "default",
        codemodel="small" if near else "jitdefault",
    )


def _in_one_block(triple: str) -> bool:
    """True where JITLink loads: it takes one block for code and the numbers that it reads, so that
    32 bits tell where they are (0134). LLVM's older loader, which is left for Windows, aborts on
    arm64 where they lie more than 4 GB apart (LLVM issue 71963).
    """
    return "windows" not in triple


def _optimise(module: llvm.ModuleRef, machine: llvm.TargetMachine, level: int) -> None:
    """Run LLVM's passes, without vectorising: lanes are vectors already, and sums of doubles must
    keep their order.
    """
    builder = llvm.create_pass_builder(machine, _options(level))
    builder.getModulePassManager().run(module, builder)


def _optimise_open(module: llvm.ModuleRef, machine: llvm.TargetMachine) -> None:
    """Run the passes for a template whose sizes are open: LLVM's own for each function, and few
    across functions. Its pipeline for modules takes three times as long: it follows pointers to
    functions, of which there are none, and simplifies everything twice (0028).
    """
    options = _options(LEVEL_OPEN)
    options.loop_unrolling, options.inlining_threshold = False, 0
    builder = llvm.create_pass_builder(machine, options)
    first = llvm.create_new_module_pass_manager()
    first.add_always_inliner_pass()
    first.add_global_dead_code_eliminate_pass()
    first.add_sroa_pass()
    first.add_simplify_cfg_pass()
    first.add_ipsccp_pass()
    first.add_global_opt_pass()
    first.add_dead_arg_elimination_pass()
    first.add_post_order_function_attributes_pass()
    first.run(module, builder)
    each = builder.getFunctionPassManager()
    for function in module.functions:
        if not function.is_declaration:
            each.run(function, builder)
    last = llvm.create_new_module_pass_manager()
    last.add_ipsccp_pass()
    last.add_global_opt_pass()
    last.add_dead_arg_elimination_pass()
    last.add_global_dead_code_eliminate_pass()
    last.add_simplify_cfg_pass()
    last.add_instruction_combine_pass()
    last.run(module, builder)


def _options(level: int) -> llvm.PipelineTuningOptions:
    options = llvm.create_pipeline_tuning_options(speed_level=level)
    options.loop_vectorization, options.slp_vectorization = False, False
    return options


@cache
def _jit() -> llvm.LLJIT:
    made_for = target()
    jit_link = _in_one_block(made_for.triple)
    return llvm.create_lljit_compiler(_target_machine(made_for), use_jit_link=jit_link)


class Loaded(NamedTuple):
    """A function in memory: its address, and the objects that keep it there."""

    address: int
    keeper: Any


def loaded(objects: Sequence[bytes], symbol: str) -> Loaded:
    """Load objects that refer to one another and to the C library, and return the address of one
    function.

    Raises
    ------
    CacheError
        If they are no such objects: somebody else's files in the folder of kernels.
    """
    with _LLVM:
        library = llvm.JITLibraryBuilder()
        for one in objects:
            library = library.add_object_img(one)
        try:
            keeper = (
                library.add_current_process()
                .export_symbol(symbol)
                .link(_jit(), f"saltus{next(_NUMBER)}")
            )
        except RuntimeError as error:
            why = " ".join(str(error).split())
            raise CacheError(
                f"a compiled kernel can't be loaded: {shown(why, 200)}. Delete the "
                f"cache: saltus cache clear."
            ) from error
    return Loaded(keeper[symbol], keeper)
