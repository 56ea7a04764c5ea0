"""Template of the modal flow: amplitudes on their way, and what they say of gaps."""

import math

from saltus.kernels.lanes import (
    fma,
    load,
    load_at,
    splat,
    store,
    store_at,
)
from saltus.kernels.trigonometry import sincos, turned


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
    """Cosine and sine of each drive at a time of the period, to `angle`; the courses there. Uses
    `sums`.
    """
    which = int(batch.carry[i, SET])
    for d in range(m.sizes[DRIVES]):
        if m.angle[d, 3] != tau:
            at = m.angle[d, 0] + m.rate[which, d] * tau
            sine, cosine = sincos(splat(at, LANES))
            store(m.sums, 0, cosine)
            store(m.sums, 1, sine)
            m.angle[d, 1], m.angle[d, 2] = m.sums[0, 0], m.sums[1, 0]
            m.angle[d, 3] = tau
    courses_at(tau, m)


@kernel
def answer_now(steady, m):
    """The steady answer to the drives, whose phases are in `angle`, to `answer`."""
    groups = m.sizes[STATE_GROUPS]
    for s in range(groups):
        store(m.answer, s, load(m.steady, steady + s, LANES))
    for d in range(m.sizes[DRIVES]):
        row = steady + (1 + 2 * d) * groups
        cosine, sine = splat(m.angle[d, 1], LANES), splat(m.angle[d, 2], LANES)
        for s in range(groups):
            total = fma(load(m.steady, row + s, LANES), cosine, load(m.answer, s, LANES))
            store(m.answer, s, fma(-load(m.steady, row + groups + s, LANES), sine, total))
    for p in range(m.sizes[COURSES]):
        for k in range(m.sizes[TERMS]):
            row = steady + (1 + 2 * m.sizes[DRIVES] + m.sizes[TERMS] * p + k) * groups
            add_answer(row, m.record[p, VALUE + k], m)


@inner
def add_answer(row, factor, m):
    """Add a factor times the lanes of the table of drives from a row on to `answer`."""
    for s in range(m.sizes[STATE_GROUPS]):
        store(m.answer, s, fma(load(m.steady, row + s, LANES), factor, load(m.answer, s, LANES)))


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
    sizes = 1 + m.sizes[TERMS] * m.sizes[COURSES]
    return steady + numbers * m.sizes[STATE_GROUPS], r * (numbers + sizes)


@inner
def sizes_of_gap(at, m):
    """Place of the sizes of the terms of a steady answer whose numbers stand from `at` on: of its
    constant and its drives together, then of each number of its courses.
    """
    return at + 1 + 2 * m.sizes[DRIVES] + m.sizes[TERMS] * m.sizes[COURSES]


# -- states and amplitudes -------------------------------------------------------------------------
@inner
def take_state(i, batch, m):
    """The state of a trajectory, to `state`."""
    whole = m.sizes[STATES] // LANES
    for s in range(whole):
        store(m.state, s, load_at(batch.state, i, LANES * s, LANES))
    for j in range(LANES * whole, m.sizes[STATES]):
        m.state[whole, j - LANES * whole] = batch.state[i, j]


@inner
def write_state(table, row, first, m):
    """Write what is in `state` to a row of a table, from a column on."""
    whole = m.sizes[STATES] // LANES
    for s in range(whole):
        store_at(table, row, first + LANES * s, load(m.state, s, LANES))
    for j in range(LANES * whole, m.sizes[STATES]):
        table[row, first + j] = m.state[whole, j - LANES * whole]


@inner
def less_answer(m):
    """Subtract the answer from `state`."""
    for s in range(m.sizes[STATE_GROUPS]):
        store(m.state, s, load(m.state, s, LANES) - load(m.answer, s, LANES))


@kernel
def amplitudes_of(modes, y, m):
    """Amplitudes of what is in `state`, to y: L z."""
    groups, count = m.sizes[MODE_GROUPS], LANES * m.sizes[STATE_GROUPS]
    coordinates = coordinates_of(modes, m)
    if coordinates > 0:
        amplitudes_of_shapes(modes, coordinates, y, m)
        return
    for g in range(groups):
        runs, zero = runs_of(modes, m) + g, splat(0.0, LANES)
        first = modes + 3 * groups + g * count
        a, b, c, d = zero, zero, zero, zero
        e, f, p, q = zero, zero, zero, zero
        for run in range(0, LANES, 2):
            for s in range(int(m.modes[runs, run]), int(m.modes[runs, run + 1])):
                row, other = first + LANES * s, first + LANES * s + groups * count
                one, two, three, four = m.state[s, 0], m.state[s, 1], m.state[s, 2], m.state[s, 3]
                a, e = times_rows(row, other, one, a, e, m)
                b, f = times_rows(row + 1, other + 1, two, b, f, m)
                c, p = times_rows(row + 2, other + 2, three, c, p, m)
                d, q = times_rows(row + 3, other + 3, four, d, q, m)
        store(y, g, (a + b) + (c + d))
        store(y, groups + g, (e + f) + (p + q))
    block_amplitudes(modes, y, m)


@inner
def times_rows(row, other, value, a, b, m):
    """A number times two rows of the table of modes, added to a and b."""
    value = splat(value, LANES)
    return fma(load(m.modes, row, LANES), value, a), fma(load(m.modes, other, LANES), value, b)


@inner
def runs_of(modes, m):
    """First row of the runs of a table of modes: of each group of modes the groups of states that
    its amplitudes ask for, of each group of states the groups of modes that it asks for, as first
    and last one of two runs. All else is zero: without contact a mode is two states.
    """
    groups = m.sizes[MODE_GROUPS]
    return modes + groups * (3 + 4 * LANES * m.sizes[STATE_GROUPS] + 4 * m.sizes[GAP_ROWS])


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
    coordinates = coordinates_of(modes, m)
    if coordinates > 0:
        state_of_shapes(modes, coordinates, y, m)
        return
    s, groups, runs = 0, m.sizes[STATE_GROUPS], runs_of(modes, m) + m.sizes[MODE_GROUPS]
    while s < groups:
        answer = load(m.answer, s, LANES)
        if s + 1 < groups and are_alike(runs + s, m):
            both = two_groups_of_states(s, modes, y, answer, load(m.answer, s + 1, LANES), m)
            store(m.state, s, both[0])
            store(m.state, s + 1, both[1])
            s += 2
        else:
            store(m.state, s, group_of_states(s, modes, y, 0, answer, m))
            s += 1
    add_block_state(modes, y, m)


@inner
def are_alike(row, m):
    """True if two rows of runs that follow one another are the same."""
    alike = True
    for k in range(LANES):
        alike = alike and m.modes[row, k] == m.modes[row + 1, k]
    return alike


@inner
def two_groups_of_states(s, modes, y, first_answer, second_answer, m):
    """As :func:`group_of_states`, of two groups that follow one another and have the same runs."""
    groups, runs = m.sizes[MODE_GROUPS], runs_of(modes, m) + m.sizes[MODE_GROUPS] + s
    across = 2 * groups * LANES
    first, zero = modes + 3 * groups + across * (m.sizes[STATE_GROUPS] + s), splat(0.0, LANES)
    a, b, c, d = first_answer, zero, zero, zero
    e, f, p, q = second_answer, zero, zero, zero
    for run in range(0, LANES, 2):
        for g in range(int(m.modes[runs, run]), int(m.modes[runs, run + 1])):
            row, real, imaginary = first + 2 * LANES * g, g, groups + g
            a, e = times_rows(row, row + across, y[real, 0], a, e, m)
            b, f = times_rows(row + 1, row + 1 + across, y[imaginary, 0], b, f, m)
            c, p = times_rows(row + 2, row + 2 + across, y[real, 1], c, p, m)
            d, q = times_rows(row + 3, row + 3 + across, y[imaginary, 1], d, q, m)
            a, e = times_rows(row + 4, row + 4 + across, y[real, 2], a, e, m)
            b, f = times_rows(row + 5, row + 5 + across, y[imaginary, 2], b, f, m)
            c, p = times_rows(row + 6, row + 6 + across, y[real, 3], c, p, m)
            d, q = times_rows(row + 7, row + 7 + across, y[imaginary, 3], d, q, m)
    return (a + b) + (c + d), (e + f) + (p + q)


# -- structures: coordinates and their rates -------------------------------------------------------
@inner
def coordinates_of(modes, m):
    """Number of coordinates q, if the states are q and q', damping couples none, and they are many:
    V is (U, U lambda) then, L is s (lambda U' + U' C, U'). In place of L stands U: of each block of
    LANES coordinates and group of modes, for each coordinate a row of real parts and one of
    imaginary ones; then the factors s, and C. In place of V stands nothing. Else 0.
    """
    return int(m.modes[block_of(modes, m), 3])


@inner
def shapes_of(modes, block, m):
    """First row of U for a block of LANES coordinates."""
    return modes + (3 + 2 * LANES * block) * m.sizes[MODE_GROUPS]


@inner
def onto(row, v, q, a, b, c, d, m):
    """Add a coordinate and its rate to U' (v + C q), a + i b, and to U' q, c + i d."""
    real, imaginary = load(m.modes, row, LANES), load(m.modes, row + 1, LANES)
    return fma(real, v, a), fma(imaginary, v, b), fma(real, q, c), fma(imaginary, q, d)


@kernel
def amplitudes_of_shapes(modes, count, y, m):
    """Amplitudes of coordinates q and rates v in `state`, to y: s (U' (v + C q) + lambda U' q)."""
    groups, blocks, last = m.sizes[MODE_GROUPS], (count + LANES - 1) // LANES, 2 * count - 1
    scale = shapes_of(modes, blocks, m)
    for g in range(4 * groups):
        store(m.rates, g, splat(0.0, LANES))
    for block in range(blocks):
        runs, first = runs_of(modes, m) + groups + block, shapes_of(modes, block, m)
        damping, q, v = scale + 2 * groups + block, LANES * block, count + LANES * block
        q0, q1 = number(m.state, 0, q), number(m.state, 0, q + 1)
        q2, q3 = number(m.state, 0, q + 2), number(m.state, 0, q + 3)
        v0 = number(m.state, 0, v) + m.modes[damping, 0] * q0
        v1 = number(m.state, 0, min(v + 1, last)) + m.modes[damping, 1] * q1
        v2 = number(m.state, 0, min(v + 2, last)) + m.modes[damping, 2] * q2
        v3 = number(m.state, 0, min(v + 3, last)) + m.modes[damping, 3] * q3
        for run in range(0, LANES, 2):
            for g in range(int(m.modes[runs, run]), int(m.modes[runs, run + 1])):
                row, to = first + 2 * LANES * g, 4 * g
                a, b = load(m.rates, to, LANES), load(m.rates, to + 1, LANES)
                c, d = load(m.rates, to + 2, LANES), load(m.rates, to + 3, LANES)
                a, b, c, d = onto(row, v0, q0, a, b, c, d, m)
                a, b, c, d = onto(row + 2, v1, q1, a, b, c, d, m)
                a, b, c, d = onto(row + 4, v2, q2, a, b, c, d, m)
                a, b, c, d = onto(row + 6, v3, q3, a, b, c, d, m)
                store(m.rates, to, a)
                store(m.rates, to + 1, b)
                store(m.rates, to + 2, c)
                store(m.rates, to + 3, d)
    for g in range(groups):
        a, b = load(m.modes, modes + g, LANES), load(m.modes, modes + groups + g, LANES)
        c, d = load(m.rates, 4 * g + 2, LANES), load(m.rates, 4 * g + 3, LANES)
        store(y, g, fma(-b, d, fma(a, c, load(m.rates, 4 * g, LANES))))
        store(y, groups + g, fma(b, c, fma(a, d, load(m.rates, 4 * g + 1, LANES))))
        turn(y, g, load(m.modes, scale + g, LANES), load(m.modes, scale + groups + g, LANES), y, m)


@kernel
def state_of_shapes(modes, count, y, m):
    """The coordinates and rates that some amplitudes are, to `state`."""
    rates_of_waves(modes, y, m)
    for b in range((count + LANES - 1) // LANES):
        coordinates_and_rates(b, modes, y, 0, m.rates, 0, m)
        for j in range(min(LANES, count - LANES * b)):
            q, v = LANES * b + j, count + LANES * b + j
            m.state[q // LANES, q % LANES] = number(m.answer, 0, q) + total_of(m.sums, j)
            speed = number(m.answer, 0, v) + total_of(m.sums, LANES + j)
            m.state[v // LANES, v % LANES] = speed


@inner
def rates_of_waves(modes, y, m):
    """The rates of amplitudes, lambda y, to `rates`."""
    groups = m.sizes[MODE_GROUPS]
    for g in range(groups):
        a, b = load(m.modes, modes + g, LANES), load(m.modes, modes + groups + g, LANES)
        turn(y, g, a, b, m.rates, m)


@inner
def along(row, a, b, c, d, q, v, m):
    """Add amplitudes a + i b and their rates c + i d to a coordinate and its rate."""
    real, imaginary = load(m.modes, row, LANES), load(m.modes, row + 1, LANES)
    return fma(-imaginary, b, fma(real, a, q)), fma(-imaginary, d, fma(real, c, v))


@inner
def coordinates_and_rates(block, modes, y, at, rates, row, m):
    """LANES coordinates without the answer, Re(U y) of the amplitudes in the rows of y from `at`
    on, and their rates by those of the amplitudes: lanes that add up to each, to `sums`.
    """
    groups, runs = m.sizes[MODE_GROUPS], runs_of(modes, m) + m.sizes[MODE_GROUPS] + block
    first, zero = shapes_of(modes, block, m), splat(0.0, LANES)
    q0, q1, q2, q3, v0, v1, v2, v3 = zero, zero, zero, zero, zero, zero, zero, zero
    for run in range(0, LANES, 2):
        for g in range(int(m.modes[runs, run]), int(m.modes[runs, run + 1])):
            k = first + 2 * LANES * g
            a, b = load(y, at + g, LANES), load(y, at + groups + g, LANES)
            c, d = load(rates, row + g, LANES), load(rates, row + groups + g, LANES)
            q0, v0 = along(k, a, b, c, d, q0, v0, m)
            q1, v1 = along(k + 2, a, b, c, d, q1, v1, m)
            q2, v2 = along(k + 4, a, b, c, d, q2, v2, m)
            q3, v3 = along(k + 6, a, b, c, d, q3, v3, m)
    store(m.sums, 0, q0)
    store(m.sums, 1, q1)
    store(m.sums, 2, q2)
    store(m.sums, 3, q3)
    store(m.sums, 4, v0)
    store(m.sums, 5, v1)
    store(m.sums, 6, v2)
    store(m.sums, 7, v3)


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


@inner
def end_factors(modes, h, near, m):
    """e^{lambda h} of some groups of modes, where a step ends, to `factor`."""
    for g in range(near):
        real, imaginary = factor_of(modes, g, h, m)
        store(m.factor, g, real)
        store(m.factor, m.sizes[MODE_GROUPS] + g, imaginary)


@kernel
def move(modes, h, known, m):
    """The amplitudes after a time h, to `moved`. Of some groups of modes e^{lambda h} is known: it
    stands in `factor`.
    """
    used, groups = groups_of(modes, m), m.sizes[MODE_GROUPS]
    for g in range(known):
        turn(m.y, g, load(m.factor, g, LANES), load(m.factor, groups + g, LANES), m.moved, m)
    for g in range(known, used):
        a, b = factor_of(modes, g, h, m)
        turn(m.y, g, a, b, m.moved, m)
    for g in range(used, groups):
        store(m.moved, g, splat(0.0, LANES))
        store(m.moved, groups + g, splat(0.0, LANES))
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
    for g in range(groups_of(modes, m)):
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
