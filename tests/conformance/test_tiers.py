"""A flow is the same to the bit however it was compiled: at once, with its sizes known, all in one
piece, for an older processor.
"""

from __future__ import annotations

import hashlib
import os
import platform
import shutil
import subprocess
import sys
import threading
import time
from dataclasses import replace

import numpy as np
import pytest

import saltus as sl
from conformance.systems import pair, walls
from saltus import cache
from saltus.codegen import machine
from saltus.codegen.kernels import FULL, GENERIC, TIERS, Kernels
from saltus.codegen.module import jit_disabled, taylor_module
from saltus.flow import engine
from saltus.flow.request import Request, Schedule
from saltus.kernels import status as st
from saltus.system.tangent import tangent_system

pytestmark = [
    pytest.mark.skipif(jit_disabled(), reason="nothing is compiled with the JIT off"),
]
TAYLOR = sl.Taylor(lanes=2)


@sl.system(states="x v w", forced_at="frequency")
def switches(t, x, v, w, *, gain=0.4, force=2.0, frequency=1.0):
    """The latch and the slider of conformance.systems in one, for a single compilation."""
    threshold = sl.piecewise((0.5, v > 0), otherwise=-0.5)
    friction = sl.piecewise((1.0, w > 0), otherwise=-1.0)
    pull = sl.piecewise((gain, x > threshold), otherwise=0)
    return v, -x - pull, force * sl.cos(2 * sl.pi * frequency * t) - friction


#: (system, spread of the starts, method): contacts, grazes, jumps of a threshold beside sliding, a
#: saltating tangent.
CASES = {
    "walls": (
        walls.with_values(moving_stiffness=30.0, stiffness=5.0, ceiling_stiffness=3.0),
        1.0,
        TAYLOR,
    ),
    "switches": (switches, 2.0, TAYLOR),
    "tangent": (
        tangent_system(
            pair.with_values(lift=0.5, spring=1.0, stiffness1=40.0, stiffness2=30.0, stiffness=20.0)
        ),
        1.0,
        TAYLOR,
    ),
    "ode45": (
        walls.with_values(moving_stiffness=30.0, stiffness=5.0, ceiling_stiffness=3.0),
        1.0,
        sl.ODE45(1e-5, 1e-8),
    ),
    "fixed steps": (
        walls.with_values(moving_stiffness=30.0, stiffness=5.0, ceiling_stiffness=3.0),
        1.0,
        sl.RK4(0.01, "bisect"),
    ),
}


def request(system, spread, periods=8, count=24):
    rng = np.random.default_rng(7)
    start = rng.uniform(-spread, spread, (count, len(system.states)))
    start[:4, 0] = [0.0, 0.3, -0.0, 1.0]  # 1: the stop of the first mass of `tangent`
    schedule = Schedule(np.repeat(np.arange(periods), 2), np.tile([0.0, 0.3], periods))
    period = np.full(count, system.period() or 1.0)
    values = np.array([list(system.values.values())])
    whole = Request.periods(start, values, period, periods, schedule=schedule, record_from=0)
    return replace(whole, end_phase=0.3 * period)


def bits(outcome):
    """Everything that came out, as text."""
    names = ("state", "time", "status", "mode", "counters", "minima", "samples", "sample_mode")
    arrays = [*(getattr(outcome, name) for name in names), *outcome.contacts.arrays]
    return [hashlib.sha256(np.ascontiguousarray(array).tobytes()).hexdigest() for array in arrays]


@pytest.mark.parametrize("case", CASES)
def test_all_tiers_give_the_same_bits(case):
    system, spread, method = CASES[case]
    flow = method.kernels(system.origin)  # as the engine asks for it
    found = {}
    for tier in TIERS:
        flow.exchange(tier)
        assert flow.tier == tier
        outcome = engine.run(system, method, request(system, spread), threads=1)
        found[tier] = bits(outcome)
    assert found[FULL] == found[GENERIC]
    assert len(outcome.contacts) > 20
    if case == "switches":
        assert {st.HOLD, st.RELEASE} <= set(outcome.contacts.kind.tolist())


@pytest.mark.parametrize("case", ["walls", "tangent", "chain"])
def test_registers_one_after_the_other_give_the_same_bits(monkeypatch, case):
    """Two, four or all eight lanes in one."""
    chain = (sl.models.chain(), 1e-3, TAYLOR)
    system, spread, _ = CASES.get(case, chain)
    found = []
    for register in (2, 4, 8):
        monkeypatch.setattr(machine, "register_width", lambda r=register: r)
        flow = taylor_module.__wrapped__(system.origin, 20, 8)
        flow.exchange(GENERIC)
        monkeypatch.setattr(sl.Taylor, "kernels", lambda *_, f=flow: f)
        found.append(bits(engine.run(system, TAYLOR, request(system, spread), threads=1)))
    assert found[0] == found[1] == found[2]


def test_an_exchange_between_two_calls_changes_nothing(monkeypatch):
    """The chunk is worked off in small slices, and another tier takes over after every one."""
    system, spread, method = CASES["walls"]
    flow = method.kernels(system.origin)
    flow.exchange(GENERIC)
    whole = bits(engine.run(system, method, request(system, spread), threads=1))
    called = []
    plain = Kernels.propagate

    def exchanging(self, *values):
        called.append(self.tier)
        answer = plain(self, *values)
        self.exchange(TIERS[len(called) % 2])
        return answer

    monkeypatch.setattr(Kernels, "propagate", exchanging)
    monkeypatch.setattr(engine, "slice_of", lambda states: 40)
    assert bits(engine.run(system, method, request(system, spread), threads=1)) == whole
    assert set(called) == set(TIERS)


@pytest.mark.parametrize("case", ["walls", "tangent", "ode45"])
def test_nothing_is_left_to_the_next_call_in_the_memory_of_a_thread(monkeypatch, case):
    """All calls of a thread work in it, those of another run between two slices of this one too."""
    system, spread, method = CASES[case]
    whole = bits(engine.run(system, method, request(system, spread), threads=1))
    plain, called = Kernels.propagate, []

    def soiled(self, *values):
        for array in self.workspace():
            array[...] = np.nan if array.dtype.kind == "f" else -7
        called.append(plain(self, *values))
        return called[-1]

    monkeypatch.setattr(Kernels, "propagate", soiled)
    monkeypatch.setattr(engine, "slice_of", lambda states: 40)
    assert bits(engine.run(system, method, request(system, spread), threads=1)) == whole
    assert called.count(st.PAUSED) > 3


def test_a_flow_that_has_worked_becomes_steady_by_itself(monkeypatch):
    from saltus.codegen import kernels

    monkeypatch.setattr(kernels, "STEADY_AFTER", 0.0)
    system, spread, method = CASES["walls"]
    flow = method.kernels(system.origin)
    flow.exchange(GENERIC)
    monkeypatch.setattr(flow, "_asked", threading.Lock())
    before = bits(engine.run(system, method, request(system, spread), threads=1))
    end = time.monotonic() + 300
    while flow.tier != kernels.STEADY:
        assert time.monotonic() < end
        time.sleep(0.01)
    assert bits(engine.run(system, method, request(system, spread), threads=1)) == before


ELSEWHERE = """
import json, sys
sys.path[:0] = {path!r}
from conformance import test_tiers as t
system, spread, _ = t.CASES["walls"]
method, request = t.sl.Taylor(lanes={lanes}), t.request(system, spread)
print(json.dumps(t.bits(t.engine.run(system, method, request, threads=1))))
"""


@pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64"), reason="these are processors of one family"
)
@pytest.mark.parametrize(
    ("processor", "lanes"),
    [("x86-64-v2", 2), pytest.param("x86-64-v3", 8, marks=pytest.mark.nightly)],
)
def test_an_older_processor_gives_the_same_bits(processor, lanes):
    """Without fused multiply-add, which the C library then does; with eight lanes in registers of
    four (on this processor: test_registers_one_after_the_other_give_the_same_bits).
    """
    import json

    system, spread, _ = CASES["walls"]
    here = bits(engine.run(system, TAYLOR, request(system, spread), threads=1))
    environment = {
        **os.environ,
        "PYTHONPATH": os.pathsep.join(sys.path),
        "SALTUS_PROCESSOR": processor,
    }
    tests = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    command = [sys.executable, "-c", ELSEWHERE.format(path=[tests], lanes=lanes)]
    said = subprocess.run(
        command, env=environment, capture_output=True, text=True, check=True
    ).stdout
    assert json.loads(said.splitlines()[-1]) == here


SHORT = """
import os, sys, time
import saltus as sl
from saltus.codegen import kernels

kernels.STEADY_AFTER = 0.0
force = lambda x: sl.piecewise((9.5 * x, x > 0.25), otherwise=0)
system = sl.system(states="x v")(lambda t, x, v: (v, -x - force(x)))
method = sl.Taylor(lanes=2)
flow = method.kernels(system.origin)
print(flow.tier)
sl.simulate(system, (1.0, 0.0), t_end=9.0, method=method)
if sys.argv[1:]:  # until its order is written, and not a moment longer
    from saltus.codegen import building

    while not os.path.exists(sys.argv[1]):
        time.sleep(0.01)
    os._exit(0)
"""


def test_what_a_short_process_began_to_compile_serves_the_next(tmp_path):
    """A process that ends while its full tier is compiled: the next begins with that."""
    begun, kept = tmp_path / "begun", tmp_path / "cache"
    kept.mkdir(mode=0o700)
    for shared in cache.kernels():  # what all equations share isn't compiled again
        if shared.system == "taylor_2, generic":
            shutil.copy2(shared.path, kept)
    wrapper = f"""
import subprocess

class Told(subprocess.Popen):
    def __init__(self, command, *rest, **options):
        super().__init__(command, *rest, **options)
        if "saltus.codegen.build_one" in command[:-1]:
            open({str(begun)!r}, "w").close()

subprocess.Popen = Told
"""
    environment = {**os.environ, "SALTUS_CACHE": str(kept)}

    def run(*arguments):
        command = [sys.executable, "-c", wrapper + SHORT, *arguments]
        return subprocess.run(
            command, env=environment, capture_output=True, text=True, timeout=300, check=True
        ).stdout.split()[0]

    assert run(str(begun)) == GENERIC
    generic, end = len(list(kept.glob("*.kernel"))), time.monotonic() + 300
    while len(list(kept.glob("*.kernel"))) == generic:
        assert time.monotonic() < end
        time.sleep(0.05)
    assert run() == FULL
