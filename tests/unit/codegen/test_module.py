"""What a kernel's name depends on: the equations, every template it is made of, versions, processor. Not parameter values."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import threading
from importlib import resources

import numba
import numpy as np
import pytest

import saltus as sl
from saltus.codegen import cache, module

METHODS = {
    "taylor": lambda system: module.taylor_module(system, 20, 4),
    "ode45": module.ode45_module,
}


@pytest.fixture
def key(monkeypatch):
    """A function: system -> name of its kernel, by one of the methods. Nothing is compiled."""
    monkeypatch.setattr(module, "load", lambda key, *_: key)
    monkeypatch.setattr(module, "_interpreted", lambda key, head, templates: key)
    module._environment.cache_clear()
    yield lambda system, method="taylor": METHODS[method](system)
    module._environment.cache_clear()


def equation(power):
    @sl.system(states="x v", name="same name")
    def free(t, x, v, *, stiffness=2.0):
        return v, -stiffness * x**power

    return free


@pytest.mark.parametrize("method", METHODS)
def test_values_do_not_matter_and_equations_do(key, method):
    rig = sl.models.delangre("b")
    assert (
        key(rig, method)
        == key(rig.with_values(contact_stiffness="70 kN/m", frequency="7 Hz"), method)
        == key(sl.models.delangre("c"), method)
    )
    assert key(equation(3), method) == key(equation(3), method)
    assert key(equation(3), method) != key(equation(5), method)


def test_methods_orders_and_lanes_have_kernels_of_their_own(key):
    rig = sl.models.delangre("b")
    keys = {module.taylor_module(rig, order, lanes) for order in (19, 20) for lanes in (2, 4, 8)} | {key(rig, "ode45")}
    assert len(keys) == 7


@pytest.fixture
def jit(monkeypatch):
    monkeypatch.setattr(numba.config, "DISABLE_JIT", 0)


def test_what_is_made_in_the_background_is_made_once_in_another_thread(jit):
    made, done = [], threading.Event()

    def kernels(system):
        made.append((system, threading.current_thread()))
        done.set()

    rig = sl.models.delangre("b")
    module.in_background(kernels, rig)
    assert done.wait(60)
    module.in_background(kernels, rig)
    ((system, thread),) = made
    assert system is rig
    assert thread is not threading.main_thread()


def test_what_goes_wrong_in_the_background_is_told_where_it_is_asked_for(jit, recwarn, capfd):
    done = threading.Event()

    def kernels(system):
        done.set()
        raise sl.SaltusError(system.name)

    module.in_background(kernels, sl.models.delangre("b"))
    assert done.wait(60)
    for thread in threading.enumerate():
        if thread.name.startswith("kernels of"):
            thread.join(60)
    assert not recwarn
    assert capfd.readouterr() == ("", "")


def test_analyses_that_need_the_tangent_begin_it_at_once(monkeypatch):
    begun = []
    monkeypatch.setattr(sl.Taylor, "begin_kernels", lambda self, system: begun.append(system.tangent_of))
    rig = sl.models.delangre("b", force="4 N")
    sl.frequency_response(rig, frequency=("6 Hz", "7 Hz", 2), start=[(0.0, 0.0)], periods=2, progress=False)
    assert begun
    assert set(begun) == {rig}


def modules_behind(method):
    """File names of every text whose code is in a method's kernels: its templates, and what they import from the kernels folder."""
    folder = resources.files("saltus.kernels")
    seen, waiting = set(), list(TEMPLATES[method]) + re.findall(r"from saltus\.kernels\.(\w+) import", module._PREAMBLE)
    while waiting:
        name = waiting.pop().removesuffix(".py")
        if name not in seen:
            seen.add(name)
            waiting += re.findall(r"from saltus\.kernels\.(\w+) import", folder.joinpath(f"{name}.py").read_text())
    return sorted(f"{name}.py" for name in seen)


def templates_of(method):
    """Names of the templates that a method puts together."""
    names = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "_module", lambda title, what, head, templates, arguments: names.extend(templates))
        METHODS[method](equation(3))
    return names


TEMPLATES = {method: templates_of(method) for method in METHODS}


@pytest.mark.parametrize(("method", "edited"), [(method, name) for method in METHODS for name in modules_behind(method)])
def test_an_edit_of_any_text_behind_a_kernel_gives_it_another_name(key, monkeypatch, method, edited):
    before = key(equation(3), method)
    template = module._template
    monkeypatch.setattr(module, "_template", lambda name: template(name) + ("# edited\n" if name == edited else ""))
    module._environment.cache_clear()
    assert key(equation(3), method) != before


@pytest.mark.parametrize(("owner", "name"), [(numba, "__version__"), (np, "__version__"), (module.sys, "version")])
def test_versions_are_in_the_name(key, monkeypatch, owner, name):
    before = key(equation(3))
    monkeypatch.setattr(owner, name, "0.0 of another day")
    module._environment.cache_clear()
    assert key(equation(3)) != before


@pytest.mark.parametrize("part", range(3))
def test_what_numba_compiles_for_is_in_the_name(key, monkeypatch, part):
    """Platform, processor, features: as Numba sees them, so NUMBA_CPU_NAME and NUMBA_CPU_FEATURES count."""
    before = key(equation(3))
    target = list(module._target())
    target[part] = "another"
    monkeypatch.setattr(module, "_target", lambda: tuple(target))
    module._environment.cache_clear()
    assert key(equation(3)) != before


@pytest.mark.parametrize(("name", "value"), [("OPT", 0), ("BOUNDSCHECK", 1), ("DEBUGINFO_DEFAULT", 1)])
def test_settings_of_numba_that_change_the_code_are_in_the_name(key, monkeypatch, name, value):
    before = key(equation(3))
    monkeypatch.setattr(numba.config, name, value)
    module._environment.cache_clear()
    assert key(equation(3)) != before


TARGET = "import numba; from saltus.codegen import module; print(*module._target()[1:], module.lane_width())"


def test_overrides_of_the_processor_are_seen():
    """In a process of its own: Numba reads them once."""
    overrides = {"NUMBA_CPU_NAME": "x86-64", "NUMBA_CPU_FEATURES": "+sse2"}
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **overrides}
    said = subprocess.run([sys.executable, "-c", TARGET], env=environment, capture_output=True, text=True, check=True).stdout
    assert said.split() == ["x86-64", "+sse2", "2"]


@pytest.mark.parametrize(
    ("features", "lanes"),
    [("+avx2,+avx512dq,+avx512f,+fma", 16), ("+avx2,-avx512f,+fma", 4), ("+avx2,-fma", 2), ("+avx512f,-avx512dq,-avx2", 2), ("", 2)],
)
def test_lane_width_is_the_processors(monkeypatch, features, lanes):
    monkeypatch.setattr(module, "_target", lambda: ("platform", "processor", features))
    assert module.lane_width() == lanes


# -- nothing of the user's own words is in the code ---------------------------------------------------------------------------------
def source_of(monkeypatch, system, method):
    told = []
    monkeypatch.setattr(module, "load", lambda key, source, *_: told.append(source))
    monkeypatch.setattr(module, "_interpreted", lambda key, head, templates: told.append(head))
    METHODS[method](system)
    return told[0]


@pytest.mark.parametrize("method", METHODS)
def test_no_word_of_a_system_is_in_its_code(monkeypatch, method):
    """Another name, other names of states, parameters and guards, other texts: the same source."""
    rig = sl.models.delangre("b")
    names = {name: f"other_{i}" for i, name in enumerate((*rig.states, *rig.values))}
    data = json.loads(json.dumps(rig.to_dict()))
    data["name"], data["description"], data["source"] = "another", "text", "of any kind"
    data["states"], data["parameters"] = ([names[name] for name in data[key]] for key in ("states", "parameters"))
    data["values"], data["units"] = ({names[name]: value for name, value in data[key].items()} for key in ("values", "units"))
    data["forced_at"] = names[data["forced_at"]]
    data["nodes"] = [[op, args, names[word] if op in ("state", "param") else word] for op, args, word in data["nodes"]]
    data["guards"] = [[f"guard {i}", gap, names.get(state), boundary] for i, (_, gap, state, boundary) in enumerate(data["guards"])]
    renamed = sl.System.from_dict(data)
    source = source_of(monkeypatch, renamed, method)
    assert source == source_of(monkeypatch, rig, method)
    assert not [name for name in names.values() if name in source]


@pytest.mark.skipif(bool(numba.config.DISABLE_JIT), reason="nothing is cached with the JIT off")
def test_new_values_never_recompile(monkeypatch):
    """Values of a call, of a system, of a case, of each trajectory: one kernel for all, and once loaded it isn't even looked for."""
    rig = sl.models.delangre("b")
    sl.simulate(rig, (1e-3, 0.0), 1, samples=1)
    before = {entry.name for entry in cache.entries()}
    monkeypatch.setattr(cache, "_build", None)
    for other in (
        rig.with_values(contact_stiffness="70 kN/m"),
        rig.with_values(frequency="7 Hz", cubic=0.0),
        sl.models.delangre("a", mass="2 kg"),
    ):
        sl.simulate(other, {"x": [0.0, 1e-3], "v": [0.1, 0.0]}, 1, samples=1)
    sl.stroboscope(rig, (1e-3, 0.0), 2, values={"frequency": [14.0, 15.0, 16.0]})
    assert {entry.name for entry in cache.entries()} == before
