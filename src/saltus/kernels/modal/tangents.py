"""Template of the modal flow: the derivative of the state with respect to the state at the
start.

In a contact state it is moved by e^{A h}, whatever the motion does, so it waits until the motion
leaves that state, ends, or is sampled. Where the rates jump at a boundary g = 0, from f- to f+, it
jumps by (f+ - f-) (dg/dz Y) / g'; at an impact Y and f- are reflected before. Leine & Nijmeijer,
Dynamics and Bifurcations of Non-Smooth Mechanical Systems (2004), section 7. Entry (r, c) of Y is
state N + N r + c of a trajectory.
"""

from saltus.kernels.lanes import fma, load, splat, store


@kernel
def load_column(i, c, batch, m):
    """A column of the derivative, to `state`."""
    states = m.sizes[STATES]
    for r in range(states):
        m.state[r // LANES, r % LANES] = batch.state[i, states + states * r + c]


@kernel
def columns_after(i, modes, h, batch, m):
    """The derivative a time h after it was moved last, to `columns`."""
    groups, states = m.sizes[MODE_GROUPS], m.sizes[STATES]
    for g in range(groups):
        a, b = factor_of(modes, g, h, m)
        store(m.factor, g, a)
        store(m.factor, groups + g, b)
    for s in range(m.sizes[STATE_GROUPS]):
        store(m.answer, s, splat(0.0, LANES))
    for c in range(states):
        load_column(i, c, batch, m)
        if h != 0.0:
            amplitudes_of(modes, m.column, m)
            for g in range(groups):
                turn(
                    m.column, g, load(m.factor, g, LANES), load(m.factor, groups + g, LANES),
                    m.column, m,
                )  # fmt: skip
            move_block(modes, h, m.column, m.column, m)
            state_of(modes, m.column, m)
        for r in range(states):
            m.columns[r, c] = m.state[r // LANES, r % LANES]


@kernel
def move_columns(i, modes, batch, m):
    """Move the derivative to where the motion is."""
    if m.sizes[TANGENTS] == 0 or batch.carry[i, WAITED] == 0.0:
        return
    states = m.sizes[STATES]
    columns_after(i, modes, batch.carry[i, WAITED], batch, m)
    for r in range(states):
        for c in range(states):
            batch.state[i, states + states * r + c] = m.columns[r, c]
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
def leave_columns(i, hits, modes, steady, batch, m):
    """Bring the derivative to a boundary that is crossed with the amplitudes in `moved`, and keep
    what the jump there needs.
    """
    first, states = first_rate(m), m.sizes[STATES]
    for g in range(m.sizes[GUARDS]):
        _, rate = gap_of_moved(m.row_of[g], modes, steady, int(batch.carry[i, SET]), m)
        batch.carry[i, first + states + g] = m.sign_of[g] * rate
    rates_of(modes, steady, int(batch.carry[i, SET]), m.moved, m)
    for r in range(states):
        batch.carry[i, first + r] = m.state[r // LANES, r % LANES]
    batch.carry[i, CROSSED] = float(hits)
    move_columns(i, modes, batch, m)


@kernel
def strike_columns(i, g, batch, m):
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
    project_columns(i, row, width, 2 * width, factor, batch, m)


@kernel
def settle_columns(i, g, batch, m):
    """Bring the derivative onto the constraint of a contact that begins to be held: its closing
    velocity and its gap don't change. See codegen/saltation.py.
    """
    row, width, square = law_row(i, g, batch, m), width_of(m), 0.0
    for r in range(m.sizes[STATES]):
        square += m.acts[row, r] * m.acts[row, r]
    project_columns(i, row, width, 2 * width, 1.0, batch, m)
    project_columns(i, row, 0, 0, 1.0 / square, batch, m)


@kernel
def project_columns(i, row, over, along, factor, batch, m):
    """Take a part off the derivative, by columns of `acts`: what it is over some of them, times a
    factor, along others.
    """
    states = m.sizes[STATES]
    for c in range(states):
        total = 0.0
        for r in range(states):
            total += m.acts[row, over + r] * batch.state[i, states + states * r + c]
        total *= factor
        for r in range(states):
            batch.state[i, states + states * r + c] -= total * m.acts[row, along + r]


@kernel
def slope_along(r, modes, m):
    """The derivative of a row of gaps along the amplitudes in `column`."""
    groups = m.sizes[MODE_GROUPS]
    row = modes + groups * (3 + 4 * LANES * m.sizes[STATE_GROUPS]) + 3 * groups * r
    total = splat(0.0, LANES)
    for g in range(groups):
        a, b = load(m.modes, row + g, LANES), load(m.modes, row + groups + g, LANES)
        total = fma(load(m.column, g, LANES), a, total)
        total = fma(-load(m.column, groups + g, LANES), b, total)
    store(m.sums, 0, total + block_gap(r, modes, m.column, m))
    return total_of(m.sums, 0)


@kernel
def enter_columns(i, at, batch, m):
    """The jump of the derivative at the boundary just crossed, behind which the amplitudes are `y`:
    by the first of several whose crossing makes the rates jump. Needs `angle`.
    """
    modes, first, states = m.links[at, MODES], first_rate(m), m.sizes[STATES]
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
    share = m.sign_of[g] / batch.carry[i, first + states + g]
    for c in range(states):
        load_column(i, c, batch, m)
        amplitudes_of(modes, m.column, m)
        slope = slope_along(m.row_of[g], modes, m) * share
        for r in range(states):
            batch.state[i, states + states * r + c] += batch.carry[i, first + r] * slope
