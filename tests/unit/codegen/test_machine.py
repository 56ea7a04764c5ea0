"""Machine code for other processors than this one: compiled, not run."""

from __future__ import annotations

import pytest

import saltus as sl
from saltus.codegen import machine, templates
from saltus.codegen.interface import TAYLOR
from saltus.codegen.lane_ir import constants_ir, equation_ir
from saltus.codegen.machine import Target
from saltus.codegen.taylor_head import taylor_head
from saltus.system.tangent import tangent_system

TARGETS = {
    "x86-64-v2": Target("x86_64-unknown-linux-gnu", "x86-64-v2", ""),
    "x86-64-v3": Target("x86_64-unknown-linux-gnu", "x86-64-v3", ""),
    "x86-64-v4": Target("x86_64-unknown-linux-gnu", "x86-64-v4", ""),
    "arm64, Linux": Target("aarch64-unknown-linux-gnu", "generic", "+neon"),
    "arm64, macOS": Target("arm64-apple-macosx", "apple-m1", ""),
}
MAGIC = {"x86_64-unknown-linux-gnu": b"\x7fELF", "aarch64-unknown-linux-gnu": b"\x7fELF", "arm64-apple-macosx": b"\xcf\xfa\xed\xfe"}


def equation(system, lanes):
    head = taylor_head(system, 20, lanes)
    return equation_ir(head.functions, head.constants, TAYLOR, lanes)


@pytest.mark.parametrize("name", TARGETS)
@pytest.mark.parametrize("lanes", templates.WIDTHS)
def test_an_equation_compiles_for_every_processor(name, lanes):
    code = machine.object_code(None, [equation(sl.models.delangre("b"), lanes)], ["saltus_jets"], TARGETS[name])
    assert code[:4] == MAGIC[TARGETS[name].triple]


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param("arm64, Linux", marks=pytest.mark.nightly), "arm64, macOS"])
def test_the_templates_compile_for_arm(name):
    baked = constants_ir({"ORDER": 20}, TAYLOR)
    code = machine.object_code(templates.bitcode("taylor_4"), [baked], ["saltus_propagate"], TARGETS[name])
    assert code[:4] == MAGIC[TARGETS[name].triple]


def test_a_long_equation_is_cut_into_blocks_with_the_same_operations():
    """Masks, lanes and numbers cross from block to block; LLVM accepts what comes out."""
    text = equation(tangent_system(sl.models.chain()), 4)
    assert text.count("define internal void @saltus_jets.") > 5
    whole = text.count(" call <4 x double> @llvm.fma")
    assert whole > 500
    assert machine.object_code(None, [text], ["saltus_jets", "saltus_rates"])
