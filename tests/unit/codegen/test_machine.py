"""Machine code for other processors than this one: compiled, not run."""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from compiled import compiled
from saltus.codegen import blocks, machine, templates
from saltus.codegen.interface import ARRAY, TAYLOR
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
MAGIC = {
    "x86_64-unknown-linux-gnu": b"\x7fELF",
    "aarch64-unknown-linux-gnu": b"\x7fELF",
    "arm64-apple-macosx": b"\xcf\xfa\xed\xfe",
}


def equation(system, lanes, order=20):
    head = taylor_head(system, order, lanes)
    sizes = tuple((name, n) for name, n in head.constants.items() if isinstance(n, int))
    return equation_ir(head.functions, sizes, TAYLOR, lanes)


@pytest.mark.parametrize("name", TARGETS)
@pytest.mark.parametrize("lanes", templates.WIDTHS)
def test_an_equation_compiles_for_every_processor(name, lanes):
    # a higher order has more of the same instructions
    short = equation(sl.models.delangre("b"), lanes, order=6)
    code = machine.object_code(None, [short], ["saltus_jets"], TARGETS[name])
    assert code[:4] == MAGIC[TARGETS[name].triple]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "open_sizes"),
    [
        ("arm64, macOS", True),
        pytest.param("arm64, macOS", False, marks=pytest.mark.nightly),
        pytest.param("arm64, Linux", True, marks=pytest.mark.nightly),
    ],
)
def test_the_templates_compile_for_arm(name, open_sizes):
    """As what all equations share, and, nightly, with loops unrolled, as for one equation."""
    baked = constants_ir({"ORDER": 20}, TAYLOR)
    code = machine.object_code(
        templates.bitcode("taylor_4"),
        [baked],
        ["saltus_propagate"],
        TARGETS[name],
        open_sizes=open_sizes,
    )
    assert code[:4] == MAGIC[TARGETS[name].triple]


def row_of_masses(masses):
    """Masses in a row between springs, the first one with a stop."""

    @sl.system(states=" ".join(f"{name}{i}" for name in "xv" for i in range(masses)))
    def row(t, *y, k=50.0, stiffness=500.0, gap=0.1):
        x, v = (0.0, *y[:masses], 0.0), y[masses:]
        rates = [k * (x[i - 1] - 2 * x[i] + x[i + 1]) for i in range(1, masses + 1)]
        rates[0] -= sl.piecewise((stiffness * (y[0] - gap), y[0] > gap), otherwise=0)
        return (*v, *rates)

    return row


def test_a_long_equation_is_cut_into_blocks_with_the_same_operations(monkeypatch):
    """Masks, lanes and numbers cross from block to block; LLVM accepts what comes out."""
    cut = equation(row_of_masses(8), 4)
    assert cut.count("define internal void @saltus_jets.") > 5
    assert machine.object_code(None, [cut], ["saltus_jets", "saltus_rates"])
    monkeypatch.setattr(blocks, "WHOLE", 10**9)
    whole = equation(row_of_masses(8), 4)
    assert "@saltus_jets." not in whole
    assert cut.count("@llvm.fma.v4f64(") == whole.count("@llvm.fma.v4f64(") > 400


def test_wherever_a_function_is_cut_its_numbers_are_the_same(monkeypatch):
    """Sine and cosine come as one value, twice as wide as others: also where the cut lies between
    them and who uses them.
    """
    calls = [
        f"s{i}, c{i} = sincos({i + 1}.0 * y)\nstore(out, {2 * i}, s{i})\nstore(out, "
        f"{2 * i + 1}, c{i})"
        for i in range(6)
    ]
    text = "def rates(a, out):\n    y = load(a, 0, LANES)\n" + "".join(
        f"    {line}\n" for call in calls for line in call.split("\n")
    )
    angles, wanted = np.array([[0.1, 0.7, -2.0, 30.0]]), np.zeros((12, 4))
    wanted[::2], wanted[1::2] = (
        turn(np.arange(1.0, 7.0)[:, None] * angles) for turn in (np.sin, np.cos)
    )
    monkeypatch.setattr(blocks, "WHOLE", 10)
    for length in range(2, 12):
        monkeypatch.setattr(blocks, "LENGTH", length)
        out = np.zeros((12, 4))
        compiled(text, (ARRAY, ARRAY), 4)(angles, out)
        np.testing.assert_allclose(
            out, wanted, rtol=1e-15, atol=1e-15, err_msg=f"blocks of {length}"
        )


def test_an_equation_whose_values_would_overrun_the_stack_is_refused(monkeypatch):
    monkeypatch.setattr(blocks, "MAX_STACK", 100)
    with pytest.raises(sl.SaltusError, match="too long to be compiled"):
        equation(row_of_masses(8), 4)


def test_the_code_of_a_tangent_grows_as_that_of_its_equation():
    """All of its columns are one function: a tangent with sixteen has hardly more code, for its
    equation, than one with four.
    """
    shares = []
    for masses in (2, 8):
        row = row_of_masses(masses)
        shares.append(len(equation(tangent_system(row), 4)) / len(equation(row, 4)))
    assert shares[1] < 1.5 * shares[0]


@pytest.mark.parametrize("early", [0.0, 1.0])
def test_a_long_function_that_may_return_early_returns_from_all_of_it(early):
    """As the jump of a tangent does where no force jumps."""
    lines = [
        "a = y[0] + 1.0",
        "if y[1] > 0.0:",
        "    return",
        *["a = a * 1.0 + 1.0"] * (2 * blocks.WHOLE),
        "y[0] = a",
    ]
    y = np.array([3.0, early])
    compiled("def leave(y):\n" + "\n".join(f"    {line}" for line in lines) + "\n", (ARRAY,), 2)(y)
    assert y[0] == (3.0 if early else 4.0 + 2 * blocks.WHOLE)
