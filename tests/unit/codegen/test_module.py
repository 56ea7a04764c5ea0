"""What the name of compiled code depends on: the equations, the templates, versions, processor. Not
parameter values.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import saltus as sl
from saltus import cache
from saltus.codegen import building, kernels, machine, module, templates
from saltus.codegen.kernels import FULL, GENERIC, TIERS, Call

needs_jit = pytest.mark.skipif(module.jit_disabled(), reason="nothing is compiled with the JIT off")
METHODS = {
    "taylor": lambda system: module.taylor_module.__wrapped__(system, 20, 4),
    "ode45": lambda system: module.steps_module.__wrapped__(system, "ODE45"),
}


@pytest.fixture
def keys(monkeypatch):
    """A function: system -> names of the objects of all tiers, by one of the methods. Nothing is
    compiled.
    """
    monkeypatch.setattr(module, "jit_disabled", lambda: False)
    monkeypatch.setattr(kernels.Kernels, "_begin", lambda *_: None)
    monkeypatch.setattr(kernels, "built", lambda order: b"")

    def of(system, method="taylor"):
        flow = METHODS[method](system)
        return {tier: tuple(order.key for order in flow._orders(tier)) for tier in TIERS}

    return of


def equation(power, name="same name"):
    @sl.system(states="x v", name=name)
    def free(t, x, v, *, stiffness=2.0):
        return v, -stiffness * x**power

    return free


@pytest.mark.parametrize("method", METHODS)
def test_values_do_not_matter_and_equations_do(keys, method):
    rig = sl.models.delangre("b")
    others = (
        rig.with_values(contact_stiffness="70 kN/m", frequency="7 Hz"),
        sl.models.delangre("c"),
    )
    assert all(keys(other, method) == keys(rig, method) for other in others)
    assert keys(equation(3), method) == keys(equation(3, "another name"), method)
    before, after = keys(equation(3), method), keys(equation(5), method)
    assert before[GENERIC][0] == after[GENERIC][0]  # the templates' code serves all equations
    assert before[GENERIC][1] != after[GENERIC][1]
    assert before[FULL] != after[FULL]


def test_methods_orders_and_lanes_have_code_of_their_own(keys):
    rig = sl.models.delangre("b")
    flows = [
        module.taylor_module.__wrapped__(rig, order, lanes)
        for order in (19, 20)
        for lanes in (2, 4, 8)
    ]
    found = {
        tuple(order.key for order in flow._orders(GENERIC))
        for flow in (*flows, METHODS["ode45"](rig))
    }
    assert len(found) == 7


CHANGES = {
    "version of llvmlite or LLVM": lambda patch: patch.setattr(
        machine, "versions", lambda: ("0.0",)
    ),
    "platform": lambda patch: patch.setattr(
        machine, "target", lambda: machine.Target("another", "processor", "")
    ),
    "processor": lambda patch: patch.setattr(
        machine, "target", lambda: machine.Target(machine.llvm.get_process_triple(), "another", "")
    ),
    "features": lambda patch: patch.setattr(
        machine, "target", lambda: machine.Target(*real_target()[:2], "+none")
    ),
    "templates": lambda patch: patch.setattr(templates, "identity", lambda name: f"another {name}"),
}
real_target = machine.target


@pytest.mark.parametrize("change", CHANGES)
def test_what_the_code_depends_on_is_in_its_name(keys, monkeypatch, change):
    before = keys(equation(3))
    CHANGES[change](monkeypatch)
    assert all(keys(equation(3))[tier][0] != before[tier][0] for tier in TIERS)


@pytest.mark.parametrize(
    ("triple", "processor", "features", "lanes"),
    [
        ("x86_64-linux", "znver5", "+avx2,+avx512dq,+avx512f,+fma", 16),
        ("x86_64-linux", "haswell", "+avx2,-avx512f,+fma", 8),
        ("x86_64-linux", "odd", "+avx2,-fma", 2),
        ("x86_64-linux", "odd", "+avx512f,-avx512dq,-avx2", 2), ("x86_64-linux", "old", "", 2),
        ("x86_64-linux", "x86-64-v3", "", 8), ("x86_64-linux", "x86-64-v4", "", 16),
        ("aarch64-linux", "generic", "+neon", 4),
        ("arm64-apple-macosx", "apple-m1", "", 4),
    ],
)  # fmt: skip
def test_lane_width_is_the_processors(monkeypatch, triple, processor, features, lanes):
    monkeypatch.setattr(machine, "target", lambda: machine.Target(triple, processor, features))
    assert module.lane_width() == lanes


TARGET = (
    "from saltus.codegen import machine, module; print(*machine.target()[1:], module.lane_width())"
)


def test_an_older_processor_can_be_asked_for():
    """In a process of its own: it is read once."""
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(sys.path),
        "SALTUS_PROCESSOR": "x86-64-v2",
    }
    said = subprocess.run(
        [sys.executable, "-c", TARGET], env=environment, capture_output=True, text=True, check=True
    ).stdout
    assert said.split()[0] == "x86-64-v2"


# -- the bitcode that the package brings -----------------------------------------------------------
@pytest.mark.parametrize("name", templates.BITCODE)
def test_the_bitcode_is_current(name):
    """Templates were edited? python -m saltus.codegen.lowering"""
    assert templates.is_current(name)
    assert templates.bitcode(name)[:2] == b"BC"


def test_functions_that_the_compiler_treats_apart_exist():
    """One that was renamed would be optimised like all others, without a word."""
    from saltus.codegen.lowering import bitcode as lowering

    files = Path(templates.__file__).parents[1].joinpath("kernels").rglob("*.py")
    defined = {name for file in files for name in re.findall(r"^def (\w+)", file.read_text(), re.M)}
    assert defined >= lowering.COLD | lowering.NOINLINE | lowering._BY_COST_MODEL


def made_again(name):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "saltus.codegen.lowering", "--print", name]
    return subprocess.run(command, env=environment, capture_output=True, check=True).stdout


@pytest.mark.parametrize(
    "name",
    [
        "capture",
        pytest.param("ode45", marks=pytest.mark.nightly),
        pytest.param("taylor_2", marks=pytest.mark.nightly),
    ],
)
@pytest.mark.slow
def test_the_bitcode_is_what_the_templates_give(name):
    """To the byte, where the same versions make it that made it. The smallest every time: whether
    the others are made of the templates as they stand, the test before says.
    """
    import llvmlite
    import numba

    again = made_again(name)
    if templates.manifest()["made_with"] == {
        "numba": numba.__version__,
        "llvmlite": llvmlite.__version__,
    }:
        assert again == templates.bitcode(name)
    assert again[:2] == b"BC"


def test_damaged_bitcode_is_refused_in_a_sentence(monkeypatch):
    whole = templates.manifest()
    known = {**whole["bitcode"], "capture": {**whole["bitcode"]["capture"], "sha256": "0" * 64}}
    monkeypatch.setattr(templates, "manifest", lambda: {**whole, "bitcode": known})
    with pytest.raises(sl.SaltusError, match=r"capture\.bc\.xz is damaged: install saltus again"):
        templates.bitcode.__wrapped__("capture")


@pytest.mark.parametrize(
    ("given", "here", "words"),
    [
        ("x86-64-v9", "x86_64-linux", "Did you mean 'x86-64"),
        ("quick", "x86_64-linux", "Known: x86-64, "),
        ("x86-64-v3", "aarch64-linux", "names no processor for aarch64"),
        ("x86-64-v4", "x86_64-linux", "lacks avx512f"),
    ],
)
def test_a_processor_that_is_unknown_or_can_do_more_is_refused(monkeypatch, given, here, words):
    """Code for one that can do more would end the process without a word."""
    monkeypatch.setenv("SALTUS_PROCESSOR", given)
    monkeypatch.setattr(machine.llvm, "get_process_triple", lambda: here)
    features = type(machine.llvm.get_host_cpu_features())(
        {"avx2": True, "fma": True, "avx512f": False}
    )
    monkeypatch.setattr(machine.llvm, "get_host_cpu_features", lambda: features)
    with pytest.raises(sl.SaltusError, match=words):
        machine.target.__wrapped__()


@pytest.fixture
def edited(monkeypatch, tmp_path):
    """A template that was edited since, and an empty cache."""
    monkeypatch.setenv("SALTUS_CACHE", str(tmp_path / "kernels"))
    monkeypatch.setattr(templates, "is_current", lambda name: name != "capture")
    monkeypatch.setattr(templates, "source_hash", lambda name: f"{'edited':*<64}")


@pytest.mark.slow
def test_edited_templates_are_made_into_bitcode_and_said(edited, capfd):
    assert building.bitcode("capture")[:2] == b"BC"
    assert "edited since" in capfd.readouterr().err
    assert building.bitcode("capture")[:2] == b"BC"
    assert capfd.readouterr().err == ""
    assert [entry.system for entry in cache.kernels()] == ["capture, bitcode"]


def test_edited_templates_without_numba_are_refused_in_a_sentence(edited, monkeypatch, capfd):
    monkeypatch.setattr(building, "_answer_of", lambda *_: None)
    with pytest.raises(
        sl.SaltusError,
        match=r"Numba: pip install 'saltus\[build\]', then python "
        r"-m saltus.codegen.lowering",
    ):
        building.bitcode("capture")


def test_a_comment_more_is_the_same_template(monkeypatch):
    text = templates.text.__wrapped__
    before = templates._hash("capture", [templates._code_of(text("capture"))])
    longer = text("capture").replace('"""', '"""More words. ', 1) + "\n# a comment\n"
    assert templates._hash("capture", [templates._code_of(longer)]) == before
    assert (
        templates._hash("capture", [templates._code_of(longer.replace("found += 1", "found += 2"))])
        != before
    )


# -- nothing of the user's own words is in the code ------------------------------------------------
@pytest.mark.parametrize("method", METHODS)
def test_no_word_of_a_system_is_in_its_code(keys, monkeypatch, method):
    """Another name, other names of states, parameters and guards, other texts: the same source."""
    rig = sl.models.delangre("b")
    names = {name: f"other_{i}" for i, name in enumerate((*rig.states, *rig.values))}
    data = json.loads(json.dumps(rig.to_dict()))
    data["name"], data["description"], data["source"] = "another", "text", "of any kind"
    data["states"], data["parameters"] = (
        [names[name] for name in data[key]] for key in ("states", "parameters")
    )
    data["values"], data["units"] = (
        {names[name]: value for name, value in data[key].items()} for key in ("values", "units")
    )
    data["forced_at"] = names[data["forced_at"]]
    data["nodes"] = [
        [op, args, names[word] if op in ("state", "param") else word]
        for op, args, word in data["nodes"]
    ]
    data["guards"] = [
        [f"guard {i}", gap, names.get(state), boundary]
        for i, (_, gap, state, boundary) in enumerate(data["guards"])
    ]
    renamed = sl.System.from_dict(data)
    text = METHODS[method](renamed)._equation_text
    assert text == METHODS[method](rig)._equation_text
    assert not [name for name in names.values() if name in text]


@needs_jit
def test_new_values_never_recompile(monkeypatch):
    """Values of a call, of a system, of a case, of each trajectory: one kernel for few, one for
    many, and neither is looked for again.
    """
    rig = sl.models.delangre("b")
    for count in (1, 2):  # the default measures times by three more runs of each
        sl.simulate(rig, {"x": [1e-3] * count, "v": 0.0}, 1, samples=1)
    monkeypatch.setattr(kernels, "built", None)
    for other in (
        rig.with_values(contact_stiffness="70 kN/m"),
        rig.with_values(frequency="7 Hz", cubic=0.0),
        sl.models.delangre("a", mass="2 kg"),
    ):
        sl.simulate(other, {"x": [0.0, 1e-3], "v": [0.1, 0.0]}, 1, samples=1)
    sl.stroboscope(rig, (1e-3, 0.0), 2, values={"frequency": [14.0, 15.0, 16.0]})


@pytest.mark.parametrize("shape", [(0, 3), (5,), (3, 2)])
@pytest.mark.parametrize("writeable", [True, False])
def test_a_call_reads_arrays_where_they_lie(shape, writeable):
    """Read-only ones too; that of a part begins in the middle of its whole. Nobody asks where an
    empty one lies.
    """
    array = np.zeros(shape)
    array.flags.writeable = writeable
    block = Call(("float64[::1]" if len(shape) < 2 else "float64[:,::1]",))
    numbers = block.block((array,)).tolist()
    assert numbers[:4] == [0, 0, array.size, 8]
    assert numbers[5 : -len(shape)] == list(shape)
    if array.size:
        assert numbers[4] == array.ctypes.data
        assert tuple(numbers[-len(shape) :]) == array.strides
    if shape == (5,):
        assert block.block((array[2:],))[4] == array.ctypes.data + 16
