"""Template of the modal flow: the derivative of the state with respect to the state at the
start, and to parameters.

In a contact state it is moved by e^{A h}, whatever the motion does, so it waits until the motion
leaves that state, ends, or is sampled. Where the rates jump at a boundary g = 0, from f- to f+, it
jumps by (f+ - f-) (dg/dz Y) / g'; at an impact Y and f- are reflected before. Leine & Nijmeijer,
Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), section 7. Entry (r, c) of Y is
state N + C r + c of a trajectory, with C columns: those of the N states, then those of parameters.

That of a parameter p is moved likewise but for the derivative of the steady answer, s_p, which is
taken off before and added behind, and for what a derivative of A adds: its amplitudes gain sum_k
G_jk D_jk y_k, with the amplitudes y of the motion when it was moved last, G = L (dA/dp) V, and D_jk
= (e^{lambda_j h} - e^{lambda_k h}) / (lambda_j - lambda_k). Where a boundary moves with p, dg/dp is
added to dg/dz Y.

Rows of `varied`, from `links[at, SLOPES]` on, one parameter after the other: the number of the
first row of G, 0 if there is none; derivatives of the amplitudes of the steady answer, as they
stand in `steady`. Behind them those of G: for each mode k, by groups of modes j, the real and the
imaginary part of G_jk, then those where k is the partner of a kept mode. Columns of `shifts`, set
by set, one parameter after the other: derivatives of the rates and of the phases of the drives;
then for each guard the derivatives of its constant and of its drives, and these drives.
"""

import math

from saltus.kernels.lanes import any_lane, fma, load, select, splat, store
from saltus.kernels.status import IMPACT_LAW

#: |lambda_j - lambda_k| h, squared, below which D_jk is a series: of terms (x/2 .. x^11/12!).
CLOSE, CLOSE_TERMS = 0.0625, 12


@inner
def shift_of(c, m):
    """First column of `shifts` for a column of the derivative."""
    width = 2 * m.sizes[DRIVES] + m.sizes[GUARDS] * (1 + 2 * m.sizes[DRIVES])
    return (c - m.sizes[STATES]) * width


@inner
def lead_of(i, c, d, tau, batch, m):
    """The derivative of the phase of a drive with respect to the parameter of a column."""
    which, first = int(batch.carry[i, SET]), shift_of(c, m)
    slope = m.shifts[which, first + m.sizes[DRIVES] + d]
    return slope + m.shifts[which, first + d] * time_of(i, tau, batch)


@inner
def varied_of(at, c, m):
    """First row of `varied` for a contact state and a column."""
    rows = 1 + (1 + 2 * m.sizes[DRIVES]) * m.sizes[STATE_GROUPS]
    return m.links[at, SLOPES] + (c - m.sizes[STATES]) * rows


@kernel
def answer_slope(i, at, c, tau, batch, m):
    """The derivative of the steady answer of a contact state with respect to the parameter of a
    column, to `answer`. Needs `angle`.
    """
    groups, steady = m.sizes[STATE_GROUPS], m.links[at, STEADY]
    varied = varied_of(at, c, m) + 1
    for s in range(groups):
        store(m.answer, s, load(m.varied, varied + s, LANES))
    for d in range(m.sizes[DRIVES]):
        lead, cosine, sine = lead_of(i, c, d, tau, batch, m), m.angle[d, 1], m.angle[d, 2]
        for s in range(groups):
            row, total = (1 + 2 * d) * groups + s, load(m.answer, s, LANES)
            total = fma(load(m.varied, varied + row, LANES), cosine, total)
            total = fma(load(m.varied, varied + row + groups, LANES), -sine, total)
            total = fma(load(m.steady, steady + row, LANES), -lead * sine, total)
            total = fma(load(m.steady, steady + row + groups, LANES), -lead * cosine, total)
            store(m.answer, s, total)


@kernel
def gap_slope(i, g, c, tau, batch, m):
    """The derivative of the gap of a guard with respect to the parameter of a column, in the same
    state. Needs `angle`.
    """
    which, drives = int(batch.carry[i, SET]), m.sizes[DRIVES]
    first = shift_of(c, m) + 2 * drives + g * (1 + 2 * drives)
    total = m.shifts[which, first]
    for d in range(drives):
        lead = lead_of(i, c, d, tau, batch, m) * m.angle[d, 2]
        total += m.shifts[which, first + 1 + d] * m.angle[d, 1]
        total -= m.shifts[which, first + 1 + drives + d] * lead
    return total


@kernel
def load_column(i, c, batch, m):
    """A column of the derivative, to `state`."""
    states = m.sizes[STATES]
    for r in range(states):
        m.state[r // LANES, r % LANES] = batch.state[i, states + m.sizes[TANGENTS] * r + c]


@inner
def first_date(m):
    """Column of `carry` of the first of the derivatives of the instant of a landing."""
    return AMPLITUDES + m.sizes[ROWS] * LANES + m.sizes[STATES] + m.sizes[GUARDS]


@inner
def first_kept(m):
    """Column of `carry` of the first of the amplitudes when the derivative was moved last."""
    return first_date(m) + m.sizes[TANGENTS]


@kernel
def keep_amplitudes(i, batch, m):
    """Keep the amplitudes, where the derivative is as far as the motion."""
    if m.sizes[TANGENTS] > m.sizes[STATES]:
        for k in range(2 * m.sizes[MODE_GROUPS] * LANES):
            batch.carry[i, first_kept(m) + k] = m.y[k // LANES, k % LANES]


@inner
def divided(modes, g, k, sign, h, m):
    """D_jk of a group of modes j, for the mode k if `sign` is 1, for its partner if it is -1. Needs
    `factor`.
    """
    groups = m.sizes[MODE_GROUPS]
    a = load(m.modes, modes + g, LANES) - number(m.modes, modes, k)
    b = load(m.modes, modes + groups + g, LANES) - sign * number(m.modes, modes + groups, k)
    real, imaginary = number(m.factor, 0, k), sign * number(m.factor, groups, k)
    size = fma(a, a, b * b)
    near = size * (h * h) < CLOSE
    below = select(near, splat(1.0, LANES), size)
    c, d = load(m.factor, g, LANES) - real, load(m.factor, groups + g, LANES) - imaginary
    x, y = fma(c, a, d * b) / below, fma(d, a, -(c * b)) / below
    if any_lane(near):
        a, b = a * h, b * h
        p, q = splat(1.0, LANES), splat(0.0, LANES)
        for term in range(CLOSE_TERMS, 1, -1):  # 1 + x/2 (1 + x/3 (1 + ...))
            share = 1.0 / term
            c, d = a * share, b * share
            p, q = fma(c, p, -(d * q)) + 1.0, fma(c, q, d * p)
        x = select(near, (p * real - q * imaginary) * h, x)
        y = select(near, (p * imaginary + q * real) * h, y)
    return x, y


@kernel
def mix_modes(i, at, c, h, batch, m):
    """Add to the amplitudes of a column what the derivative of A adds in a time h, for the
    parameter of the column. Needs `factor`.
    """
    groups, modes, first = m.sizes[MODE_GROUPS], m.links[at, MODES], m.links[at, SLOPES]
    behind = m.varied[varied_of(at, c, m), 0]
    if behind == 0.0:
        return
    for k in range(groups * LANES):
        real = batch.carry[i, first_kept(m) + k]
        imaginary = batch.carry[i, first_kept(m) + groups * LANES + k]
        if real == 0.0 and imaginary == 0.0:
            continue
        for g in range(groups):
            row = first + int(behind) + 4 * (k * groups + g)
            x, y = load(m.column, g, LANES), load(m.column, groups + g, LANES)
            for partner in range(2):
                sign = 1.0 - 2.0 * partner
                if partner == 1 and number(m.modes, modes + groups, k) == 0.0:
                    continue
                a, b = divided(modes, g, k, sign, h, m)
                p, q = (
                    load(m.varied, row + 2 * partner, LANES),
                    load(m.varied, row + 2 * partner + 1, LANES),
                )
                a, b = fma(a, p, -(b * q)), fma(a, q, b * p)
                x, y = (
                    fma(a, real, fma(b, -sign * imaginary, x)),
                    fma(b, real, fma(a, sign * imaginary, y)),
                )
            store(m.column, g, x)
            store(m.column, groups + g, y)


@kernel
def column_after(i, at, c, tau, h, batch, m):
    """A column of the derivative a time h after it was moved last, to `state`. Needs `factor`."""
    modes, states = m.links[at, MODES], m.sizes[STATES]
    for s in range(m.sizes[STATE_GROUPS]):
        store(m.answer, s, splat(0.0, LANES))
    load_column(i, c, batch, m)
    if h == 0.0:
        return
    if c >= states:
        drive(i, tau - h, batch, m)
        answer_slope(i, at, c, tau - h, batch, m)
        less_answer(m)
        drive(i, tau, batch, m)
        answer_slope(i, at, c, tau, batch, m)
    amplitudes_of(modes, m.column, m)
    for g in range(m.sizes[MODE_GROUPS]):
        a, b = load(m.factor, g, LANES), load(m.factor, m.sizes[MODE_GROUPS] + g, LANES)
        turn(m.column, g, a, b, m.column, m)
    move_block(modes, h, m.column, m.column, m)
    if c >= states:
        mix_modes(i, at, c, h, batch, m)
    state_of(modes, m.column, m)


@kernel
def columns_after(i, at, tau, h, batch, m):
    """The derivative a time h after it was moved last in a contact state, to `columns`. Sets
    `angle` for that time, tau.
    """
    modes, groups, states = m.links[at, MODES], m.sizes[MODE_GROUPS], m.sizes[STATES]
    for g in range(groups):
        a, b = factor_of(modes, g, h, m)
        store(m.factor, g, a)
        store(m.factor, groups + g, b)
    alone = h == 0.0 or block_groups(modes, m) > 0
    c = 0
    while c < m.sizes[TANGENTS]:
        count = min(min(m.sizes[TANGENTS], states) - c, 2 * LANES)
        if count < LANES or alone:
            column_after(i, at, c, tau, h, batch, m)
            for r in range(states):
                m.columns[r, c] = m.state[r // LANES, r % LANES]
            c += 1
        else:
            several_after(i, modes, c, count, batch, m)
            c += count
    for s in range(m.sizes[STATE_GROUPS]):  # a column without a closed form is NaN, the rest isn't
        store(m.state, s, splat(0.0, LANES))


@kernel
def move_columns(i, at, tau, batch, m):
    """Move the derivative to where the motion is in a contact state."""
    if m.sizes[TANGENTS] == 0 or batch.carry[i, WAITED] == 0.0:
        return
    states, columns = m.sizes[STATES], m.sizes[TANGENTS]
    columns_after(i, at, tau, batch.carry[i, WAITED], batch, m)
    for r in range(states):
        for c in range(columns):
            batch.state[i, states + columns * r + c] = m.columns[r, c]
    batch.carry[i, WAITED] = 0.0


@kernel
def rates_of(modes, steady, which, y, m):
    """The rates of the states where the amplitudes are y, to `state`. Needs `angle`."""
    groups = m.sizes[MODE_GROUPS]
    for g in range(groups):
        a, b = load(m.modes, modes + g, LANES), load(m.modes, modes + groups + g, LANES)
        turn(y, g, a, b, m.column, m)
    block_rates(modes, y, m.column, m)
    answer_rate(steady, which, m)
    state_of(modes, m.column, m)


@inner
def first_rate(m):
    """Column of `carry` of the first of the rates before a boundary: those of the states, then of
    the gaps.
    """
    return AMPLITUDES + 2 * m.sizes[MODE_GROUPS] * LANES


@kernel
def leave_columns(i, hits, at, tau, batch, m):
    """Bring the derivative to a boundary that is crossed with the amplitudes in `moved`, and keep
    what the jump there needs. Needs `angle`.
    """
    first, states = first_rate(m), m.sizes[STATES]
    modes, steady = m.links[at, MODES], m.links[at, STEADY]
    for g in range(m.sizes[GUARDS]):
        _, rate = gap_of_moved(m.row_of[g], modes, steady, int(batch.carry[i, SET]), m)
        batch.carry[i, first + states + g] = m.sign_of[g] * rate
    rates_of(modes, steady, int(batch.carry[i, SET]), m.moved, m)
    for r in range(states):
        batch.carry[i, first + r] = m.state[r // LANES, r % LANES]
    batch.carry[i, CROSSED] = float(hits)
    move_columns(i, at, tau, batch, m)


@kernel
def strike_columns(i, g, tau, batch, m):
    """Let the impact of a contact act on the derivative, and on the rates before it: by
    I - (1 + e) p n', with the closing velocity n' z and what a unit of it moves, p. Needs `angle`.
    """
    states, row, width = m.sizes[STATES], law_row(i, g, batch, m), width_of(m)
    first, factor, rate = first_rate(m), 1.0 + restitution_of(i, g, batch, m), 0.0
    for d in range(m.sizes[DRIVES]):
        slope = m.acts[row, width + states + 1 + d] * m.angle[d, 2]
        rate -= m.rate[int(batch.carry[i, SET]), d] * slope
    for r in range(states):
        rate += m.acts[row, width + r] * batch.carry[i, first + r]
    for r in range(states):
        batch.carry[i, first + r] -= factor * rate * m.acts[row, 2 * width + r]
    project_columns(i, tau, row, width, 2 * width, factor, batch, m)


@kernel
def settle_held(i, tau, batch, m):
    """Bring the derivative onto the constraints of all contacts at rest, where one begins to be
    held. What one of them takes off changes the velocities of others: all are asked in turn, until
    nothing changes. Needs `angle`.
    """
    first, change, rounds = 0.0, math.inf, 0
    while change > SETTLED * first and rounds < MOST_SETTLED:
        change, rounds = 0.0, rounds + 1
        for g in range(m.sizes[GUARDS]):
            stops = m.laws[g, KIND] == IMPACT_LAW
            if stops and (batch.mode[i] >> m.laws[g, PARTNER]) & 1 == 1:
                change = max(change, settle_columns(i, g, tau, batch, m))
        first = max(first, change)


@inner
def settle_columns(i, g, tau, batch, m):
    """Bring the derivative onto the constraint of a contact at rest: its closing velocity and its
    gap don't change. See codegen/saltation.py. Returns the largest change of a closing velocity.
    """
    row, width, square = law_row(i, g, batch, m), width_of(m), 0.0
    for r in range(m.sizes[STATES]):
        square += m.acts[row, r] * m.acts[row, r]
    change = project_columns(i, tau, row, width, 2 * width, 1.0, batch, m)
    project_columns(i, tau, row, 0, 0, 1.0 / square, batch, m)
    return change


@kernel
def project_columns(i, tau, row, over, along, factor, batch, m):
    """Take a part off the derivative, by columns of `acts`: what it does to the function that
    stands in some of them, times a factor, along others. Returns the largest of these parts.
    """
    states, columns, largest = m.sizes[STATES], m.sizes[TANGENTS], 0.0
    for c in range(columns):
        total = 0.0
        for r in range(states):
            total += m.acts[row, over + r] * batch.state[i, states + columns * r + c]
        if c >= states:
            for d in range(m.sizes[DRIVES]):
                lead = lead_of(i, c, d, tau, batch, m) * m.angle[d, 2]
                total -= m.acts[row, over + states + 1 + d] * lead
        total *= factor
        largest = max(largest, abs(total))
        for r in range(states):
            batch.state[i, states + columns * r + c] -= total * m.acts[row, along + r]
    return largest


@kernel
def gap_gradient(r, modes, m):
    """The derivative of a row of gaps with respect to the state, to `state`."""
    groups, count = m.sizes[MODE_GROUPS], LANES * m.sizes[STATE_GROUPS]
    row, first, more = waves_of(r, modes, m), modes + 3 * groups, block_groups(modes, m)
    if coordinates_of(modes, m) > 0:
        gradient_of_shapes(row, modes, coordinates_of(modes, m), m)
        return
    left, waves = block_left(modes, more, m), block_waves(modes, more, m) + more * r
    for k in range(count):
        total = splat(0.0, LANES)
        for g in range(groups):
            a, b = load(m.modes, row + g, LANES), load(m.modes, row + groups + g, LANES)
            total = fma(load(m.modes, first + g * count + k, LANES), a, total)
            total = fma(-load(m.modes, first + (groups + g) * count + k, LANES), b, total)
        for g in range(more):
            part = load(m.modes, left + more * k + g, LANES)
            total = fma(part, load(m.modes, waves + g, LANES), total)
        store(m.sums, 0, total)
        m.state[k // LANES, k % LANES] = total_of(m.sums, 0)


@kernel
def gradient_of_shapes(row, modes, count, m):
    """The same of coordinates and rates, for the row of a gap's amplitudes w: Re(w s (C + lambda)
    u) and Re(w s u) for a coordinate of the shapes u.
    """
    groups, blocks = m.sizes[MODE_GROUPS], (count + LANES - 1) // LANES
    scale = shapes_of(modes, blocks, m)
    for g in range(groups):
        store(m.rates, g, load(m.modes, row + g, LANES))
        store(m.rates, groups + g, load(m.modes, row + groups + g, LANES))
        turn(
            m.rates, g, load(m.modes, scale + g, LANES), load(m.modes, scale + groups + g, LANES),
            m.rates, m,
        )  # fmt: skip
    for k in range(count):
        first, by_rate, by_place = (
            shapes_of(modes, k // LANES, m),
            splat(0.0, LANES),
            splat(0.0, LANES),
        )
        for g in range(groups):
            at = first + 2 * LANES * g + 2 * (k % LANES)
            a, b = load(m.modes, modes + g, LANES), load(m.modes, modes + groups + g, LANES)
            c, d = load(m.rates, g, LANES), load(m.rates, groups + g, LANES)
            u, v = load(m.modes, at, LANES), load(m.modes, at + 1, LANES)
            p, q = fma(c, u, -(d * v)), fma(c, v, d * u)
            by_rate, by_place = by_rate + p, fma(-b, q, fma(a, p, by_place))
        store(m.sums, 0, by_rate)
        store(m.sums, 1, by_place)
        slope = total_of(m.sums, 0)
        m.state[(count + k) // LANES, (count + k) % LANES] = slope
        slope = m.modes[scale + 2 * groups + k // LANES, k % LANES] * slope + total_of(m.sums, 1)
        m.state[k // LANES, k % LANES] = slope


@kernel
def enter_columns(i, at, tau, batch, m):
    """The jump of the derivative at the boundary just crossed, behind which the amplitudes are `y`.
    The instant moves with the first of several boundaries whose crossing makes the rates jump, and
    with that of the first landing where landings cause others at once: their own gaps and rates
    become as small as rounding. Needs `angle`.
    """
    modes, first = m.links[at, MODES], first_rate(m)
    states, columns = m.sizes[STATES], m.sizes[TANGENTS]
    jumps = int(batch.carry[i, CROSSED]) & ~m.links[at, SMOOTH]
    batch.carry[i, CROSSED] = 0.0
    if jumps == 0:
        return
    g = 0
    while (jumps >> g) & 1 == 0:
        g += 1
    rates_of(modes, m.links[at, STEADY], int(batch.carry[i, SET]), m.y, m)
    for r in range(states):
        batch.carry[i, first + r] = m.state[r // LANES, r % LANES] - batch.carry[i, first + r]
    if batch.carry[i, DATED] == 0.0:
        date_landing(i, g, modes, tau, batch, m)
    for r in range(states):
        for c in range(columns):
            jump = batch.carry[i, first + r] * batch.carry[i, first_date(m) + c]
            batch.state[i, states + columns * r + c] += jump


@kernel
def date_landing(i, g, modes, tau, batch, m):
    """By how much earlier the boundary of a guard is met, for each column: (dg/dz Y + dg/dp) / g'.
    Needs `angle`.
    """
    states, columns, first = m.sizes[STATES], m.sizes[TANGENTS], first_date(m)
    rate = batch.carry[i, first_rate(m) + states + g]
    gap_gradient(m.row_of[g], modes, m)
    for c in range(columns):
        batch.carry[i, first + c] = 0.0
    for r in range(states):
        slope = m.state[r // LANES, r % LANES] * m.sign_of[g]
        if slope != 0.0:
            for c in range(columns):
                batch.carry[i, first + c] += slope * batch.state[i, states + columns * r + c]
    for c in range(columns):
        if c >= states:
            batch.carry[i, first + c] += gap_slope(i, g, c, tau, batch, m)
        batch.carry[i, first + c] /= rate
    batch.carry[i, DATED] = 1.0
