"""Template of the modal flow: amplitudes on their way, and what they say of gaps."""

import math

from saltus.kernels.lanes import (
    coarse_exp2,
    fma,
    load,
    nearest_integer,
    splat,
    store,
)
from saltus.kernels.trigonometry import sincos, turned

#: ln 2 as the sum of two doubles.
LN2_1, LN2_2 = 6.93147180369123816490e-01, 1.90821492927058770002e-10


@inner
def exponential(a):
    """e^a of a lane, a at most some 700, to about one ulp: 2^n e^r, |r| <= ln(2)/2."""
    n = nearest_integer(a * 1.4426950408889634)
    r = fma(-n, LN2_2, fma(-n, LN2_1, a))
    p = fma(r, 1.0 / 6227020800.0, 1.0 / 479001600.0)
    p = fma(p, r, 1.0 / 39916800.0)
    p = fma(p, r, 1.0 / 3628800.0)
    p = fma(p, r, 1.0 / 362880.0)
    p = fma(p, r, 1.0 / 40320.0)
    p = fma(p, r, 1.0 / 5040.0)
    p = fma(p, r, 1.0 / 720.0)
    p = fma(p, r, 1.0 / 120.0)
    p = fma(p, r, 1.0 / 24.0)
    p = fma(p, r, 1.0 / 6.0)
    p = fma(p, r, 0.5)
    p = fma(p * r, r, r) + 1.0
    return p * coarse_exp2(n)


@inner
def number(table, first, k):
    """Entry k of numbers that stand in the rows of a table from `first` on."""
    return table[first + k // LANES, k % LANES]


# -- drives ----------------------------------------------------------------------------------------
@kernel
def begin_period(i, batch, m):
    """Phases of the drives at the beginning of the trajectory's period, to `angle`."""
    which = int(batch.carry[i, SET])
    for d in range(m.sizes[DRIVES]):
        rate = m.rate[which, d]
        m.angle[d, 0] = (
            m.lag[which, d]
            + turned(rate, batch.origin[i], 1)
            + turned(rate, batch.period[i], batch.count[i])
        )
        m.angle[d, 3] = math.inf  # its cosine isn't known at any time of this period
    begin_courses(i, batch, m)


@kernel
def drive(i, tau, batch, m):
    """Cosine and sine of each drive at a time of the period, to `angle`; the courses there."""
    which = int(batch.carry[i, SET])
    for d in range(m.sizes[DRIVES]):
        if m.angle[d, 3] != tau:
            at = m.angle[d, 0] + m.rate[which, d] * tau
            m.angle[d, 1], m.angle[d, 2], m.angle[d, 3] = math.cos(at), math.sin(at), tau
    courses_at(tau, m)


@kernel
def answer_now(steady, m):
    """The steady answer to the drives, whose phases are in `angle`, to `answer`."""
    groups = m.sizes[STATE_GROUPS]
    for s in range(groups):
        total = load(m.steady, steady + s, LANES)
        for d in range(m.sizes[DRIVES]):
            row = steady + (1 + 2 * d) * groups + s
            total = fma(load(m.steady, row, LANES), m.angle[d, 1], total)
            total = fma(load(m.steady, row + groups, LANES), -m.angle[d, 2], total)
        for p in range(m.sizes[COURSES]):
            row = steady + (1 + 2 * m.sizes[DRIVES] + m.sizes[TERMS] * p) * groups + s
            for k in range(m.sizes[TERMS]):
                part = load(m.steady, row + k * groups, LANES)
                total = fma(part, m.record[p, VALUE + k], total)
        store(m.answer, s, total)


@kernel
def answer_rate(steady, which, m):
    """The rate of the steady answer, whose phases are in `angle`, to `answer`."""
    groups = m.sizes[STATE_GROUPS]
    for s in range(groups):
        total = splat(0.0, LANES)
        for d in range(m.sizes[DRIVES]):
            row, rate = steady + (1 + 2 * d) * groups + s, m.rate[which, d]
            total = fma(load(m.steady, row, LANES), -rate * m.angle[d, 2], total)
            total = fma(load(m.steady, row + groups, LANES), -rate * m.angle[d, 1], total)
        for p in range(m.sizes[COURSES]):
            row = steady + (1 + 2 * m.sizes[DRIVES] + m.sizes[TERMS] * p) * groups + s
            for k in range(m.sizes[TERMS] - 1):
                part = load(m.steady, row + k * groups, LANES)
                total = fma(part, m.record[p, VALUE + k + 1], total)
        store(m.answer, s, total)


@inner
def numbers_of_gap(r, steady, m):
    """Place of the steady answer of a row of gaps: the first row of numbers, the first of them."""
    numbers = 1 + 2 * m.sizes[DRIVES] + m.sizes[TERMS] * m.sizes[COURSES]
    return steady + numbers * m.sizes[STATE_GROUPS], r * numbers


# -- states and amplitudes -------------------------------------------------------------------------
@inner
def less_answer(m):
    """Subtract the answer from `state`."""
    for s in range(m.sizes[STATE_GROUPS]):
        store(m.state, s, load(m.state, s, LANES) - load(m.answer, s, LANES))


@kernel
def amplitudes_of(modes, y, m):
    """Amplitudes of what is in `state`, to y: L z."""
    groups, count = m.sizes[MODE_GROUPS], LANES * m.sizes[STATE_GROUPS]
    for g in range(2 * groups):
        runs = runs_of(modes, m) + g % groups
        first = modes + 3 * groups + g * count
        a, b = splat(0.0, LANES), splat(0.0, LANES)
        c, d = splat(0.0, LANES), splat(0.0, LANES)
        for run in range(0, LANES, 2):
            for s in range(int(m.modes[runs, run]), int(m.modes[runs, run + 1])):
                row = first + LANES * s
                a = fma(load(m.modes, row, LANES), m.state[s, 0], a)
                b = fma(load(m.modes, row + 1, LANES), m.state[s, 1], b)
                c = fma(load(m.modes, row + 2, LANES), m.state[s, 2], c)
                d = fma(load(m.modes, row + 3, LANES), m.state[s, 3], d)
        store(y, g, (a + b) + (c + d))
    block_amplitudes(modes, y, m)


@inner
def runs_of(modes, m):
    """First row of the runs of a table of modes: of each group of modes the groups of states that
    its amplitudes ask for, of each group of states the groups of modes that it asks for, as first
    and last one of two runs. All else is zero: without contact a mode is two states.
    """
    groups = m.sizes[MODE_GROUPS]
    return modes + groups * (3 + 4 * LANES * m.sizes[STATE_GROUPS] + 3 * m.sizes[GAP_ROWS])


@inner
def group_of_states(s, modes, y, at, answer, m):
    """A lane of states: an answer, and Re(V y) of the amplitudes in the rows of y from `at` on."""
    groups, runs = m.sizes[MODE_GROUPS], runs_of(modes, m) + m.sizes[MODE_GROUPS] + s
    first = modes + 3 * groups + 2 * groups * LANES * (m.sizes[STATE_GROUPS] + s)
    a, b = answer, splat(0.0, LANES)
    c, d = splat(0.0, LANES), splat(0.0, LANES)
    for run in range(0, LANES, 2):
        for g in range(int(m.modes[runs, run]), int(m.modes[runs, run + 1])):
            row, real, imaginary = first + 2 * LANES * g, at + g, at + groups + g
            a = fma(load(m.modes, row, LANES), y[real, 0], a)
            b = fma(load(m.modes, row + 1, LANES), y[imaginary, 0], b)
            c = fma(load(m.modes, row + 2, LANES), y[real, 1], c)
            d = fma(load(m.modes, row + 3, LANES), y[imaginary, 1], d)
            a = fma(load(m.modes, row + 4, LANES), y[real, 2], a)
            b = fma(load(m.modes, row + 5, LANES), y[imaginary, 2], b)
            c = fma(load(m.modes, row + 6, LANES), y[real, 3], c)
            d = fma(load(m.modes, row + 7, LANES), y[imaginary, 3], d)
    return (a + b) + (c + d)


@kernel
def state_of(modes, y, m):
    """The state that some amplitudes are, to `state`: z_p + Re(V y). Needs `answer`."""
    for s in range(m.sizes[STATE_GROUPS]):
        store(m.state, s, group_of_states(s, modes, y, 0, load(m.answer, s, LANES), m))
    add_block_state(modes, y, m)


@inner
def factor_of(modes, g, h, m):
    """e^{lambda h} of a group of modes: its real and its imaginary part."""
    decay = exponential(load(m.modes, modes + g, LANES) * h)
    sine, cosine = sincos(load(m.modes, modes + m.sizes[MODE_GROUPS] + g, LANES) * h)
    return cosine * decay, sine * decay


@inner
def turn(y, g, a, b, to, m):
    """Write (a + i b) y of a group of modes."""
    groups = m.sizes[MODE_GROUPS]
    real, imaginary = load(y, g, LANES), load(y, groups + g, LANES)
    store(to, g, fma(-imaginary, b, real * a))
    store(to, groups + g, fma(imaginary, a, real * b))


@kernel
def move(modes, h, m):
    """The amplitudes after a time h, to `moved`."""
    for g in range(m.sizes[MODE_GROUPS]):
        a, b = factor_of(modes, g, h, m)
        turn(m.y, g, a, b, m.moved, m)
    move_block(modes, h, m.y, m.moved, m)


@inner
def keep_moved(modes, m):
    """Make `moved` the amplitudes."""
    for g in range(2 * m.sizes[MODE_GROUPS] + block_groups(modes, m)):
        store(m.y, g, load(m.moved, g, LANES))


# -- gaps ------------------------------------------------------------------------------------------
@inner
def total_of(rows, row):
    """The sum of the lanes of a row."""
    return (rows[row, 0] + rows[row, 1]) + (rows[row, 2] + rows[row, 3])


@kernel
def gap_of_moved(r, modes, steady, which, m):
    """Value and rate of a row of gaps by the amplitudes in `moved`, the drives in `angle`."""
    groups, row = m.sizes[MODE_GROUPS], waves_of(r, modes, m)
    value, rate = splat(0.0, LANES), splat(0.0, LANES)
    for g in range(groups):
        real, imaginary = load(m.moved, g, LANES), load(m.moved, groups + g, LANES)
        a, b = load(m.modes, row + g, LANES), load(m.modes, row + groups + g, LANES)
        real, imaginary = fma(-b, imaginary, a * real), fma(b, real, a * imaginary)
        value = value + real
        rate = fma(load(m.modes, modes + g, LANES), real, rate)
        rate = fma(-load(m.modes, modes + groups + g, LANES), imaginary, rate)
    store(m.sums, 0, value)
    store(m.sums, 1, rate)
    add_block_gap(r, modes, m.moved, m)
    v, w = total_of(m.sums, 0), total_of(m.sums, 1)
    first, at = numbers_of_gap(r, steady, m)
    more, faster = steady_gap(first, at, which, m)
    return v + more, w + faster


@kernel
def steady_gap(first, at, which, m):
    """The part of a row of gaps that is its steady answer to the drives in `angle`, whose numbers
    stand in the rows from `first` on, from `at` on: its value and its rate.
    """
    v, w = number(m.steady, first, at), 0.0
    for d in range(m.sizes[DRIVES]):
        a, b = number(m.steady, first, at + 1 + 2 * d), number(m.steady, first, at + 2 + 2 * d)
        v += a * m.angle[d, 1] - b * m.angle[d, 2]
        w -= (a * m.angle[d, 2] + b * m.angle[d, 1]) * m.rate[which, d]
    value_of, rate_of = course_gap(first, at + 1 + 2 * m.sizes[DRIVES], m)
    return v + value_of, w + rate_of
