"""Drives with breaks and recorded drives: the linear oscillator under each, against exact arcs
joined at the breaks.

Between breaks every drive here is the output of a linear system of its own (a line, a sine), so the
state with the drive moves by a matrix exponential: mpmath's, at 40 digits.
"""

import itertools
import math

import mpmath
import numpy as np
import pytest

import saltus as sl
from saltus.codegen.clocks import table_data
from saltus.codegen.taylor_head import taylor_head

METHOD = sl.Taylor(lanes=2)
K, C, START, SPAN = 9.0, 0.2, (0.1, -0.3), 5.0
POINTS = [0.0, 0.37, 0.9, 1.0, 2.2, 3.7]
VALUES = [0.5, -1.0, 2.0, 2.0, 0.0, 1.5]


def recorded(points, values):
    @sl.system(states="x v")
    def driven(
        t, x, v, *, stiffness=K, damping=C, half_sine=0.0, ramp=0.0, square=0.0, pulses=0.0,
        saw=0.0, record=0.0, duty=0.0, tooth=0.0, train=0.0, shock=0.0, duration=0.7, rise=0.4,
        beat=2.5, cycle=0.9, width=0.35, late=0.1,
    ):  # fmt: skip
        """An oscillator with every kind of input; amplitudes choose."""
        push = half_sine * sl.where(
            t < duration, sl.sin(math.pi * t / duration), 0
        ) + ramp * sl.clip(t / rise, 0, 1)
        push += square * sl.where(sl.sin(beat * t) > 0.3, 1, -1) + pulses * sl.where(
            sl.mod(t, cycle) < width, 1, 0
        )
        push += saw * sl.mod(t, cycle) + record * sl.table(t - late, points, values)
        push += duty * sl.square(beat * t + 0.2, 0.3) + tooth * sl.sawtooth(beat * t, 0.4)
        push += train * sl.pulse(t, width, start=2 * late, every=cycle, shape="half_sine")
        push += shock * sl.pulse(t, duration, start=rise, shape="triangle")
        return v, push - stiffness * x - damping * v

    return driven


driven = recorded(POINTS, VALUES)


def arcs(breaks, drive_of, until=SPAN):
    """The state at `until`: drive_of(middle of an arc) is (matrix of the drive's own system, its
    value and rate at the arc's start).
    """
    with mpmath.workdps(40):
        edges = [
            mpmath.mpf(0),
            *sorted(b for b in map(mpmath.mpf, breaks) if 0 < b < until),
            mpmath.mpf(until),
        ]
        x = mpmath.matrix(START)
        for begin, end in itertools.pairwise(edges):
            own, value, rate = drive_of(begin, (begin + end) / 2)
            a = mpmath.matrix(
                [[0, 1, 0, 0], [-mpmath.mpf(K), -mpmath.mpf(C), 1, 0], [0, 0, 0, 1], [0, 0, own, 0]]
            )
            x = (mpmath.expm(a * (end - begin)) * mpmath.matrix([x[0], x[1], value, rate]))[:2]
            x = mpmath.matrix(x)
        return float(x[0]), float(x[1])


def line(points, values):
    """The drive that joins points by straight lines, held outside."""

    def at(begin, middle):
        i = sum(middle > p for p in points)
        if i in (0, len(points)):
            return 0, values[0 if i == 0 else -1], 0
        slope = (mpmath.mpf(values[i]) - values[i - 1]) / (mpmath.mpf(points[i]) - points[i - 1])
        return 0, values[i - 1] + slope * (begin - points[i - 1]), slope

    return at


def half_sine(begin, middle):
    w = mpmath.pi / mpmath.mpf(0.7)
    return (
        (-(w**2), mpmath.sin(w * begin), w * mpmath.cos(w * begin)) if middle < 0.7 else (0, 0, 0)
    )


def cycles(length, *parts):
    """Instants of every cycle, at the given times within it."""
    return [k * mpmath.mpf(length) + mpmath.mpf(part) for k in range(-1, 12) for part in parts]


def turning(middle):
    return 0, (1 if mpmath.sin(mpmath.mpf(2.5) * middle) > 0.3 else -1), 0


RISE = math.asin(0.3) / 2.5
TURN = 2 * mpmath.pi / mpmath.mpf(2.5)


def duty(begin, middle):
    return 0, (1 if (middle / TURN + mpmath.mpf(0.1) / mpmath.pi) % 1 < mpmath.mpf(0.3) else -1), 0


def tooth(begin, middle):
    share, part = mpmath.mpf(0.4), (middle / TURN) % 1
    rate = (2 / share if part < share else -2 / (1 - share)) / TURN
    value = 2 * part / share - 1 if part < share else 1 - 2 * (part - share) / (1 - share)
    return 0, value - rate * (middle - begin), rate


def train(begin, middle):
    w, first = mpmath.pi / mpmath.mpf(0.35), 2 * mpmath.mpf(0.1)
    within = (middle - first) % mpmath.mpf(0.9)
    if within > 0.35:
        return 0, 0, 0
    within -= middle - begin
    return -(w**2), mpmath.sin(w * within), w * mpmath.cos(w * within)


SHOCK = [mpmath.mpf(0.4) + k * mpmath.mpf(0.7) / 2 for k in range(3)]
CASES = {
    "half_sine": ([0.7], half_sine),
    "ramp": ([0.4], line([0, mpmath.mpf(0.4)], [0, 1])),
    "square": (
        cycles(2 * math.pi / 2.5, RISE, math.pi / 2.5 - RISE),
        lambda begin, middle: turning(middle),
    ),
    "pulses": (
        cycles(0.9, 0, 0.35),
        lambda begin, middle: (0, 1 if middle % mpmath.mpf(0.9) < 0.35 else 0, 0),
    ),
    "saw": (
        cycles(0.9, 0),
        lambda begin, middle: (
            0,
            begin - mpmath.floor(middle / mpmath.mpf(0.9)) * mpmath.mpf(0.9),
            1,
        ),
    ),
    "duty": (
        [
            k * TURN - mpmath.mpf(0.2) / mpmath.mpf(2.5) + part
            for k in range(4)
            for part in (0, mpmath.mpf(0.3) * TURN)
        ],
        duty,
    ),
    "tooth": ([(k + part) * TURN for k in range(4) for part in (0, mpmath.mpf(0.4))], tooth),
    "train": (
        [
            2 * mpmath.mpf(0.1) + k * mpmath.mpf(0.9) + part
            for k in range(-1, 7)
            for part in (0, mpmath.mpf(0.35))
        ],
        train,
    ),
    "shock": (SHOCK, line(SHOCK, [0, 1, 0])),
    "record": (
        [p + mpmath.mpf(0.1) for p in POINTS],
        line([p + mpmath.mpf(0.1) for p in POINTS], VALUES),
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_the_linear_oscillator_under_each_input(name):
    run = sl.simulate(
        driven.with_values(**{name: 1.0}), START, t_end=SPAN, samples=1, method=METHOD
    )
    exact = arcs(*CASES[name])
    assert run.x.values[-1] == pytest.approx(exact[0], abs=1e-13)
    assert run.v.values[-1] == pytest.approx(exact[1], abs=3e-13)
    assert run.sizes["contact"] == 0


def test_amplitudes_and_all_inputs_together():
    """The equation is linear: responses from rest add up, whatever breaks the others bring."""
    rest = (0.0, 0.0)
    amplitudes = dict(
        zip(CASES, [2.0, -1.0, 0.5, 3.0, -2.0, 1.0, 0.7, -4.0, 2.5, 1.5], strict=True)
    )
    together = sl.simulate(
        driven.with_values(**amplitudes), rest, t_end=SPAN, samples=1, method=METHOD
    )
    single = [
        sl.simulate(driven.with_values(**{name: 1.0}), rest, t_end=SPAN, samples=1, method=METHOD)
        for name in CASES
    ]
    total = sum(
        amplitude * run.x.values[-1]
        for amplitude, run in zip(amplitudes.values(), single, strict=True)
    )
    assert together.x.values[-1] == pytest.approx(total, abs=1e-13)


def test_trajectories_with_breaks_of_their_own_do_not_disturb_each_other():
    values = {"cycle": [0.9, 0.31, 2.0], "pulses": 1.0, "saw": 1.0}
    together = sl.simulate(
        driven,
        {"x": [0.1, 0.1, 0.1], "v": -0.3},
        values=values,
        t_end=SPAN,
        samples=1,
        method=METHOD,
    )
    for i, cycle in enumerate(values["cycle"]):
        alone = sl.simulate(
            driven.with_values(cycle=cycle, pulses=1.0, saw=1.0),
            START,
            t_end=SPAN,
            samples=1,
            method=METHOD,
        )
        assert together.x.values[i, -1] == alone.x.values[-1]


def test_a_long_record_is_data_and_not_code():
    """20 000 points: the same generated text as for six, and the exact arcs of every interval."""
    count, step = 20_000, 2.0**-8
    values = np.random.default_rng(3).normal(size=count)
    long = recorded(np.arange(count) * step, values)
    assert taylor_head(long, 20, 2) == taylor_head(driven, 20, 2)
    assert long.fingerprint() != driven.fingerprint()
    assert table_data(long).size > 6 * count
    run = sl.simulate(
        long.with_values(record=1.0, late=0.0),
        START,
        t_end=(count - 1) * step,
        samples=1,
        method=METHOD,
    )
    with mpmath.workdps(40):
        a = mpmath.matrix(
            [[0, 1, 0, 0], [-mpmath.mpf(K), -mpmath.mpf(C), 1, 0], [0, 0, 0, 1], [0, 0, 0, 0]]
        )
        move = np.array(mpmath.expm(a * step).tolist(), dtype=np.longdouble)[:2]
    state = np.array(START, dtype=np.longdouble)
    for value, rate in zip(values[:-1], np.diff(values) / step, strict=True):
        state = move @ np.array([*state, value, rate], dtype=np.longdouble)
    assert run.x.values[-1] == pytest.approx(float(state[0]), abs=2e-13)
    assert run.steps.item() < 1.2 * count


def test_ode45_stops_at_the_same_breaks():
    run = sl.simulate(
        driven.with_values(square=1.0),
        START,
        t_end=SPAN,
        samples=1,
        method=sl.ODE45(rtol=1e-10, atol=1e-12),
    )
    assert run.x.values[-1] == pytest.approx(arcs(*CASES["square"])[0], abs=2e-9)


def test_a_system_with_tables_survives_as_data():
    again = sl.System.from_dict(driven.to_dict())
    assert again.fingerprint() == driven.fingerprint()
    assert taylor_head(again, 20, 2) == taylor_head(driven, 20, 2)
    assert np.array_equal(table_data(again), table_data(driven))


@pytest.mark.parametrize(("kind", "order"), [("linear", 2), ("spline", 4)])
def test_tables_converge_at_their_order(kind, order):
    x = np.linspace(0.3, 5.7, 1001)
    errors = []
    for count in (41, 81, 161):
        points = np.linspace(0, 6, count)
        errors.append(
            max(
                abs(sl.table(float(one), points, np.sin(points), kind) - math.sin(one))
                for one in x[::25]
            )
        )
    measured = math.log2(errors[1] / errors[2])
    assert order - 0.4 < measured < order + 1.4


def test_pchip_keeps_the_shape():
    points, values = [0.0, 1.0, 1.5, 4.0, 5.0], [0.0, 0.1, 2.0, 2.0, 7.0]
    for x in np.linspace(0, 5, 200):
        i = min(int(np.searchsorted(points, x, side="right")), len(points) - 1)
        assert (
            values[i - 1] - 1e-15
            <= sl.table(float(x), points, values, "pchip")
            <= values[i] + 1e-15
        )
