"""Template of the modal flow: amplitudes on their way, and what they say of gaps."""

import math

from saltus.kernels.lanes import (
    coarse_exp2,
    fma,
    load,
    nearest_integer,
    root,
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
    begin_courses(i, batch, m)


@kernel
def drive(i, tau, batch, m):
    """Cosine and sine of each drive at a time of the period, to `angle`; the courses there."""
    which = int(batch.carry[i, SET])
    for d in range(m.sizes[DRIVES]):
        at = m.angle[d, 0] + m.rate[which, d] * tau
        m.angle[d, 1], m.angle[d, 2] = math.cos(at), math.sin(at)
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
    width, count = 2 * m.sizes[MODE_GROUPS], LANES * m.sizes[STATE_GROUPS]
    for g in range(width):
        row = modes + 3 * m.sizes[MODE_GROUPS] + g * count
        a, b = splat(0.0, LANES), splat(0.0, LANES)
        c, d = splat(0.0, LANES), splat(0.0, LANES)
        for i in range(0, count, 4):
            a = fma(load(m.modes, row + i, LANES), number(m.state, 0, i), a)
            b = fma(load(m.modes, row + i + 1, LANES), number(m.state, 0, i + 1), b)
            c = fma(load(m.modes, row + i + 2, LANES), number(m.state, 0, i + 2), c)
            d = fma(load(m.modes, row + i + 3, LANES), number(m.state, 0, i + 3), d)
        store(y, g, (a + b) + (c + d))
    block_amplitudes(modes, y, m)


@kernel
def state_of(modes, y, m):
    """The state that some amplitudes are, to `state`: z_p + Re(V y). Needs `answer`."""
    groups = m.sizes[MODE_GROUPS]
    count = LANES * groups
    first = modes + 3 * groups + 2 * groups * LANES * m.sizes[STATE_GROUPS]
    for s in range(m.sizes[STATE_GROUPS]):
        row = first + 2 * count * s
        a, b = load(m.answer, s, LANES), splat(0.0, LANES)
        c, d = splat(0.0, LANES), splat(0.0, LANES)
        for j in range(0, count, 2):
            a = fma(load(m.modes, row + 2 * j, LANES), number(y, 0, j), a)
            b = fma(load(m.modes, row + 2 * j + 1, LANES), number(y, groups, j), b)
            c = fma(load(m.modes, row + 2 * j + 2, LANES), number(y, 0, j + 1), c)
            d = fma(load(m.modes, row + 2 * j + 3, LANES), number(y, groups, j + 1), d)
        store(m.state, s, (a + b) + (c + d))
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
def keep_moved(m):
    """Make `moved` the amplitudes."""
    for g in range(m.sizes[ROWS]):
        store(m.y, g, load(m.moved, g, LANES))


# -- gaps ------------------------------------------------------------------------------------------
@inner
def total_of(rows, row):
    """The sum of the lanes of a row."""
    return (rows[row, 0] + rows[row, 1]) + (rows[row, 2] + rows[row, 3])


@kernel
def followed(modes, h, m):
    """Number of groups of modes that are followed over a time h."""
    groups = m.sizes[MODE_GROUPS]
    sizes = modes + 2 * groups - 1
    while groups > 0 and m.modes[sizes + groups, LANES - 1] * h > FOLLOWED:
        groups -= 1
    return groups


@kernel
def series_of(r, modes, steady, which, h, m):
    """Terms of a row of gaps on [0, 1] for a step h, to q[r]. To errors[r]: what they leave out at
    most, of the gap and of its slope; the size of its terms.
    """
    groups, drives = m.sizes[MODE_GROUPS], m.sizes[DRIVES]
    near = followed(modes, h, m)
    row = modes + groups * (3 + 2 * LANES * m.sizes[STATE_GROUPS])
    row += 2 * LANES * groups * m.sizes[STATE_GROUPS] + 3 * groups * r
    for k in range(ORDER + 1):
        store(m.sums, k, splat(0.0, LANES))
    left, slope, size = splat(0.0, LANES), splat(0.0, LANES), splat(0.0, LANES)
    for g in range(groups):
        real, imaginary = load(m.y, g, LANES), load(m.y, groups + g, LANES)
        reach = load(m.modes, modes + 2 * groups + g, LANES) * h
        bound = root(fma(real, real, imaginary * imaginary))
        bound = bound * load(m.modes, row + 2 * groups + g, LANES)
        size = size + bound
        if g >= near:
            left, slope = left + bound, fma(bound, reach, slope)
            continue
        squared = reach * reach
        fourth = squared * squared
        eighth = fourth * fourth
        rest = bound * (eighth * eighth) * (1.0 / FACTORIAL)
        left, slope = left + rest, fma(rest, 16.0, slope)
        a, b = load(m.modes, row + g, LANES), load(m.modes, row + groups + g, LANES)
        real, imaginary = fma(-b, imaginary, a * real), fma(b, real, a * imaginary)
        a, b = load(m.modes, modes + g, LANES) * h, load(m.modes, modes + groups + g, LANES) * h
        for k in range(ORDER + 1):
            store(m.sums, k, load(m.sums, k, LANES) + real)
            real, imaginary = fma(-b, imaginary, a * real), fma(b, real, a * imaginary)
    store(m.sums, ORDER + 1, left)
    store(m.sums, ORDER + 2, slope)
    store(m.sums, ORDER + 3, size)
    add_block_series(r, modes, h, m)
    for k in range(ORDER + 1):
        m.q[r, k] = total_of(m.sums, k)
    e0, e1, scale = (
        total_of(m.sums, ORDER + 1),
        total_of(m.sums, ORDER + 2),
        total_of(m.sums, ORDER + 3),
    )
    first, at = numbers_of_gap(r, steady, m)
    m.q[r, 0] += number(m.steady, first, at)
    scale += abs(number(m.steady, first, at))
    for d in range(drives):
        a, b = number(m.steady, first, at + 1 + 2 * d), number(m.steady, first, at + 2 + 2 * d)
        cosine, sine = m.angle[d, 1], m.angle[d, 2]
        real, imaginary = a * cosine - b * sine, a * sine + b * cosine
        reach, size_of = m.rate[which, d] * h, abs(a) + abs(b)
        scale += size_of
        power = abs(reach)
        for _ in range(4):
            power *= power
        e0 += size_of * power / FACTORIAL
        e1 += 16.0 * size_of * power / FACTORIAL
        for k in range(ORDER + 1):
            m.q[r, k] += real
            real, imaginary = -imaginary * reach, real * reach
    scale += add_course_series(r, first, at + 1 + 2 * drives, h, m)
    share = 1.0
    for k in range(2, ORDER + 1):
        share /= k
        m.q[r, k] *= share
    m.errors[r, 0], m.errors[r, 1], m.errors[r, 2] = e0, e1, scale


@kernel
def gap_of_moved(r, modes, steady, which, m):
    """Value and rate of a row of gaps by the amplitudes in `moved`, the drives in `angle`."""
    groups, drives = m.sizes[MODE_GROUPS], m.sizes[DRIVES]
    row = modes + groups * (3 + 2 * LANES * m.sizes[STATE_GROUPS])
    row += 2 * LANES * groups * m.sizes[STATE_GROUPS] + 3 * groups * r
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
    add_block_gap(r, modes, m)
    v, w = total_of(m.sums, 0), total_of(m.sums, 1)
    first, at = numbers_of_gap(r, steady, m)
    v += number(m.steady, first, at)
    for d in range(drives):
        a, b = number(m.steady, first, at + 1 + 2 * d), number(m.steady, first, at + 2 + 2 * d)
        v += a * m.angle[d, 1] - b * m.angle[d, 2]
        w -= (a * m.angle[d, 2] + b * m.angle[d, 1]) * m.rate[which, d]
    value_of, rate_of = course_gap(first, at + 1 + 2 * drives, m)
    return v + value_of, w + rate_of
