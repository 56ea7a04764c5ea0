"""Template of the modal flow: columns of the derivative side by side.

A column with respect to the state at the start is moved as the motion itself is, without drives:
z(h) = V e^{Lambda h} L z. Up to two lanes of columns are moved together: each number of the tables
is read once for all of them. In `column` a state takes two rows, one for each lane; the amplitude
of a mode four, two for its real part and two for its imaginary one.
"""

from saltus.kernels.lanes import fma, load, splat, store


@inner
def add_rows(table, stride, apart, source, begin, end, target, step, m):
    """Add a product with rows of a table of modes to four numbers of the columns side by side: rows
    of `column` from `target` on, `step` apart. The rows for LANES numbers from `source` on are
    `apart` from each other, those for the next ones `stride` from them.
    """
    a, b = load(m.column, target, LANES), load(m.column, target + 1, LANES)
    c, d = load(m.column, target + step, LANES), load(m.column, target + step + 1, LANES)
    e, f = load(m.column, target + 2 * step, LANES), load(m.column, target + 2 * step + 1, LANES)
    g, h = load(m.column, target + 3 * step, LANES), load(m.column, target + 3 * step + 1, LANES)
    for block in range(begin, end):
        for k in range(LANES):
            row, at = table + stride * block + apart * k, source + 2 * (LANES * block + k)
            x, y = load(m.column, at, LANES), load(m.column, at + 1, LANES)
            p, q, r, s = m.modes[row, 0], m.modes[row, 1], m.modes[row, 2], m.modes[row, 3]
            a, b, c, d = fma(x, p, a), fma(y, p, b), fma(x, q, c), fma(y, q, d)
            e, f, g, h = fma(x, r, e), fma(y, r, f), fma(x, s, g), fma(y, s, h)
    store(m.column, target, a)
    store(m.column, target + 1, b)
    store(m.column, target + step, c)
    store(m.column, target + step + 1, d)
    store(m.column, target + 2 * step, e)
    store(m.column, target + 2 * step + 1, f)
    store(m.column, target + 3 * step, g)
    store(m.column, target + 3 * step + 1, h)


@inner
def turn_several(row, a, b, m):
    """Multiply the amplitudes of a mode in the columns side by side, from a row on, by a + i b."""
    for real in range(row, row + 2):
        x, y = load(m.column, real, LANES), load(m.column, real + 2, LANES)
        store(m.column, real, fma(y, -b, x * a))
        store(m.column, real + 2, fma(x, b, y * a))


@inner
def first_waves(m):
    """First row of the amplitudes of the columns side by side."""
    return m.sizes[ROWS] + 2 * LANES * m.sizes[STATE_GROUPS]


@inner
def clear_states(m):
    """Make all states of the columns side by side zero."""
    for row in range(m.sizes[ROWS], first_waves(m)):
        store(m.column, row, splat(0.0, LANES))


@kernel
def several_after(i, modes, c, count, batch, m):
    """Columns of the derivative with respect to the start, `count` from c on, after the time of
    `factor`, to `columns`.
    """
    states, columns, first = m.sizes[STATES], m.sizes[TANGENTS], m.sizes[ROWS]
    clear_states(m)
    for row in range(first_waves(m), first_waves(m) + 4 * LANES * m.sizes[MODE_GROUPS]):
        store(m.column, row, splat(0.0, LANES))
    for r in range(states):
        for j in range(count):
            number_of = batch.state[i, states + columns * r + c + j]
            m.column[first + 2 * r + j // LANES, j % LANES] = number_of
    coordinates = coordinates_of(modes, m)
    if coordinates > 0:
        several_by_shapes(modes, coordinates, m)
    else:
        several_by_vectors(modes, m)
    for r in range(states):
        for j in range(count):
            m.columns[r, c + j] = m.column[first + 2 * r + j // LANES, j % LANES]


@inner
def go_on(m):
    """Multiply the amplitudes of the columns side by side by `factor`."""
    groups = m.sizes[MODE_GROUPS]
    for k in range(LANES * groups):
        a, b = number(m.factor, 0, k), number(m.factor, groups, k)
        turn_several(first_waves(m) + 4 * k, a, b, m)


@inner
def several_by_vectors(modes, m):
    """Move the columns side by side by L and V."""
    groups, blocks, runs = m.sizes[MODE_GROUPS], m.sizes[STATE_GROUPS], runs_of(modes, m)
    first, waves, tables = m.sizes[ROWS], first_waves(m), modes + 3 * groups
    for g in range(2 * groups):
        part, group = g // groups, g % groups
        for run in range(0, LANES, 2):
            begin, end = m.modes[runs + group, run], m.modes[runs + group, run + 1]
            add_rows(
                tables + g * LANES * blocks, LANES, 1, first, int(begin), int(end),
                waves + 4 * LANES * group + 2 * part, 4, m,
            )  # fmt: skip
    clear_states(m)
    go_on(m)
    for s in range(blocks):
        for run in range(0, LANES, 2):
            begin, end = m.modes[runs + groups + s, run], m.modes[runs + groups + s, run + 1]
            add_rows(
                tables + 2 * groups * LANES * (blocks + s), LANES, 1, waves, 2 * int(begin),
                2 * int(end), first + 2 * LANES * s, 2, m,
            )  # fmt: skip


# -- structures: coordinates and their rates -------------------------------------------------------
@inner
def asks(modes, block, g, m):
    """True if a block of LANES coordinates asks for a group of modes."""
    row = runs_of(modes, m) + m.sizes[MODE_GROUPS] + block
    early = m.modes[row, 0] <= g < m.modes[row, 1]
    return early or m.modes[row, 2] <= g < m.modes[row, 3]


@kernel
def several_by_shapes(modes, count, m):
    """The same by the shapes of coordinates q, which change at the rates v: the amplitudes are
    s (U' (v + C q) + lambda U' q).
    """
    groups, blocks = m.sizes[MODE_GROUPS], (count + LANES - 1) // LANES
    first, scale = m.sizes[ROWS], shapes_of(modes, blocks, m)
    for k in range(2 * count):
        damping = number(m.modes, scale + 2 * groups, k // 2)
        row = first + 2 * count + k
        rate, place = load(m.column, row, LANES), load(m.column, first + k, LANES)
        store(m.column, row, fma(place, damping, rate))
    for step in range(2):
        source = first + 2 * count * step
        for g in range(groups):
            begin, end = 0, blocks
            while begin < end and not asks(modes, begin, g, m):
                begin += 1
            while begin < end and not asks(modes, end - 1, g, m):
                end -= 1
            for part in range(2):
                add_rows(
                    shapes_of(modes, 0, m) + 2 * LANES * g + part, 2 * LANES * groups, 2, source,
                    begin, end, first_waves(m) + 4 * LANES * g + 2 * part, 4, m,
                )  # fmt: skip
        if step == 0:
            go_at_rates(modes, m)
    for k in range(LANES * groups):
        a, b = number(m.modes, scale, k), number(m.modes, scale + groups, k)
        turn_several(first_waves(m) + 4 * k, a, b, m)
    clear_states(m)
    go_on(m)
    for step in range(2):
        if step == 1:
            go_at_rates(modes, m)
        for block in range(blocks):
            add_along(modes, block, first + 2 * count * step + 2 * LANES * block, m)


@inner
def go_at_rates(modes, m):
    """Multiply the amplitudes of the columns side by side by lambda."""
    groups = m.sizes[MODE_GROUPS]
    for k in range(LANES * groups):
        a, b = number(m.modes, modes, k), number(m.modes, modes + groups, k)
        turn_several(first_waves(m) + 4 * k, a, b, m)


@inner
def add_along(modes, block, to, m):
    """Add Re(U y) of the amplitudes y to a block of coordinates, or rates, in the rows from `to`
    on.
    """
    runs = runs_of(modes, m) + m.sizes[MODE_GROUPS] + block
    a, b = load(m.column, to, LANES), load(m.column, to + 1, LANES)
    c, d = load(m.column, to + 2, LANES), load(m.column, to + 3, LANES)
    e, f = load(m.column, to + 4, LANES), load(m.column, to + 5, LANES)
    g, h = load(m.column, to + 6, LANES), load(m.column, to + 7, LANES)
    for run in range(0, LANES, 2):
        for group in range(int(m.modes[runs, run]), int(m.modes[runs, run + 1])):
            row = shapes_of(modes, block, m) + 2 * LANES * group
            for lane in range(LANES):
                at = first_waves(m) + 4 * (LANES * group + lane)
                x, y = load(m.column, at, LANES), load(m.column, at + 1, LANES)
                p, q = m.modes[row, lane], m.modes[row + 2, lane]
                r, s = m.modes[row + 4, lane], m.modes[row + 6, lane]
                a, b, c, d = fma(x, p, a), fma(y, p, b), fma(x, q, c), fma(y, q, d)
                e, f, g, h = fma(x, r, e), fma(y, r, f), fma(x, s, g), fma(y, s, h)
                x, y = load(m.column, at + 2, LANES), load(m.column, at + 3, LANES)
                p, q = -m.modes[row + 1, lane], -m.modes[row + 3, lane]
                r, s = -m.modes[row + 5, lane], -m.modes[row + 7, lane]
                a, b, c, d = fma(x, p, a), fma(y, p, b), fma(x, q, c), fma(y, q, d)
                e, f, g, h = fma(x, r, e), fma(y, r, f), fma(x, s, g), fma(y, s, h)
    store(m.column, to, a)
    store(m.column, to + 1, b)
    store(m.column, to + 2, c)
    store(m.column, to + 3, d)
    store(m.column, to + 4, e)
    store(m.column, to + 5, f)
    store(m.column, to + 6, g)
    store(m.column, to + 7, h)
