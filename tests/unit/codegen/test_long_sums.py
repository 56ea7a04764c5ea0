"""Equations of many states: split into sums, parts and rows, they are what they were."""

from __future__ import annotations

import numpy as np
import pytest

import saltus as sl
from saltus.codegen import long_sums as ls
from saltus.codegen.plain_series import _plain
from saltus.codegen.taylor_head import taylor_head
from saltus.contact.singular import set_aside
from saltus.language import expression as ex
from saltus.language.evaluate import evaluate
from saltus.system.tangent import tangent_system

pytestmark = pytest.mark.nojit
MODES = 16
ORDER = 12


def force(law, d, rate, stiffness, gap, phase):
    """The force of a contact on a deflection."""
    depth = d - gap * (1 + 0.3 * sl.cos(2 * phase))
    match law:
        case "hertz":
            return sl.piecewise(
                (stiffness * (d - gap) ** 1.5, d > gap),
                (-stiffness * (-d - gap) ** 1.5, d < -gap), otherwise=0,
            )  # fmt: skip
        case "cubic":
            return stiffness * d**3 + 2.0 * rate + 1e-3 * stiffness * gap
        case "stop":
            return sl.piecewise((stiffness * depth + 3.0 * rate, depth > 0), otherwise=0)
        case "smooth":
            return stiffness * d / sl.sqrt(1 + (d / gap) ** 2) + sl.tanh(rate) * sl.exp(-d)
    raise ValueError(law)


def structure(law, seed=0, modes=MODES):
    """Modes of a chain with two contacts, a drive, and a cubic spring on the first mode."""
    random = np.random.default_rng(seed)
    springs = random.uniform(0.5, 2.0, 3 * modes)
    stiffness = np.diag(springs + np.append(springs[1:], 0))
    stiffness -= np.diag(springs[1:], 1) + np.diag(springs[1:], -1)
    squares, shapes = np.linalg.eigh(stiffness)
    squares, shapes = squares[:modes].tolist(), shapes[:, :modes].tolist()
    names = [f"q{i}" for i in range(modes)] + [f"w{i}" for i in range(modes)]

    @sl.system(states=names, forced_at="frequency", name=law)
    def chain(t, *y, stiffness=1.0, gap=0.1, amplitude=0.2, frequency="0.02 Hz"):
        q, w = y[:modes], y[modes:]
        phase = 2 * sl.pi * frequency * t
        drive = amplitude * sl.cos(phase)
        load = [a * drive for a in shapes[-1]]
        for at in (shapes[-1], shapes[-4]):
            d, rate = (sum(a * one for a, one in zip(at, of, strict=True)) for of in (q, w))
            push = force(law, d, rate, stiffness, gap, phase)
            load = [one - a * push for one, a in zip(load, at, strict=True)]
        load[0] = load[0] - 0.3 * q[0] ** 3
        rates = [
            one - square * x - 0.02 * v / 2
            for one, square, x, v in zip(load, squares, q, w, strict=True)
        ]
        return (*w, *rates)

    return chain


LAWS = ("hertz", "cubic", "stop", "smooth")


@pytest.mark.parametrize("law", LAWS)
def test_sums_parts_and_rows_are_the_field(law):
    system = structure(law)
    aside = set_aside(system.field, system.guards)
    split = ls.long_sums(aside.field, aside.gaps, system.states)
    assert len(split.sums) == (2 if law == "hertz" else 4)
    random = np.random.default_rng(5)
    y = random.normal(0.0, 0.2, len(system.states))
    states = dict(zip(system.states, y, strict=True))
    known = {
        name: states.get(name, sum(w * y[i] for i, w in split.sums[number - split.size].items()))
        if number >= split.size
        else states[name]
        for name, number in split.names.items()
    }
    bits = random.random(40) < 0.5
    asked = {"t": 0.7, "values": system.values, "bits": bits}
    parts = evaluate(split.parts, states=known, **asked)
    all_of_them = np.array([*(known[name] for name in split.names), *parts], float)
    found = [sum(w * all_of_them[i] for i, w in row.items()) for row in split.rows]
    exact = evaluate(aside.field, states=states, **asked)
    np.testing.assert_allclose(found, exact, rtol=1e-13, atol=1e-14, equal_nan=True)
    np.testing.assert_allclose(
        evaluate(split.gaps, states=known, **asked),
        evaluate(aside.gaps, states=states, **asked), rtol=1e-13,
    )  # fmt: skip


def test_small_equations_and_tangents_keep_their_code():
    small = structure("cubic", modes=8)
    assert ls.long_sums(small.field, (), small.states) is None
    assert "add_up" not in taylor_head(small, ORDER, 1).functions
    assert "add_up" not in taylor_head(tangent_system(small), ORDER, 1).functions


def test_an_equation_of_parts_only_keeps_its_code():
    names = [f"x{i}" for i in range(ls.LEAST_STATES + 8)]
    field = [ex.elementary("sin", ex.mul(ex.state(a), ex.state(b)))
             for a, b in zip(names, names[1:] + names[:1], strict=True)]  # fmt: skip
    assert ls.long_sums(field, (), names) is None


def series(system):
    """Everything that a head computes at some states, as far as the flow reads it."""
    head = _plain(taylor_head(system, ORDER, 1).text)
    random, k, n = np.random.default_rng(3), 6, len(system.states)
    y = random.normal(0.0, 0.3, (n, k))
    side = np.where(random.random((head.NGUARDS + head.SINGULAR, k)) < 0.5, -1.0, 1.0)
    side[head.NGUARDS :] = -1.0
    constants, clock = np.zeros((head.NCONST, k)), np.zeros((head.CLOCK_ROWS, k))
    for lane in range(k):
        head.constants(np.array(list(system.values.values())), constants, lane)
        head.turns(np.array(list(system.values.values())), 0.0, 50.0, 0, lane, clock)
    clock[0] = 0.3
    work, rates = np.zeros((head.ROWS, k)), np.zeros((3 * n, k))
    with np.errstate(all="ignore"):
        head.jets(y, side, constants, clock, work)
        head.rates(y, side, constants, clock, rates)
    rows = [*range(n * (ORDER + 1)), *range(head.GAP_ROW, head.GAP_ROW + 2 * head.NGUARDS)]
    rows += [row + i for row in head.GUARD_ROW[: head.NGUARDS] for i in range(ORDER + 1)]
    rows += [head.CALM_ROW + i for i in range(head.SINGULAR * head.NMOVED)]
    return work[rows], np.delete(rates, np.s_[n : 2 * n], axis=0)


@pytest.mark.parametrize("law", LAWS)
def test_series_gaps_sizes_and_rates_are_those_of_plain_code(law, monkeypatch):
    system = structure(law, seed=7)
    looped = series(system)
    monkeypatch.setattr(ls, "LEAST_STATES", 1000)
    for found, exact in zip(looped, series(system), strict=True):
        known = np.isfinite(exact)
        assert (np.isfinite(found) == known).all()
        size = np.abs(np.where(known, exact, 0.0)).max(axis=1, keepdims=True)
        assert np.all((np.abs(found - exact) <= 1e-11 * size)[known])


@pytest.mark.parametrize("law", LAWS)
def test_the_code_of_a_step_does_not_grow_with_the_states(law):
    def lines(modes):
        text = taylor_head(structure(law, modes=modes), ORDER, 4).functions
        return text[text.index("def jets(") :].count("\n")

    assert lines(32) == lines(16)
