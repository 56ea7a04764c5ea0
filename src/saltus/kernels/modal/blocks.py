"""Template of the modal flow: modes that don't go their own ways go together, in a block.

The block of a contact state is v' = T v: amplitudes of an invariant subspace, and of the drives
that it resonates with. Its table: a row (groups, alpha, drives; coordinates_of, which isn't of the
block); T, column by column; L and V; for each row of gaps w and w T; for each of its drives a row
(number, first amplitude, scale, rate).
alpha is such that ||T^k|| <= alpha^k for all k > 11 (Al-Mohy & Higham, SIAM J. Matrix Anal. Appl.
31 (2009), theorem 4.2): exp(T h) v is its Taylor series in parts of alpha h <= 1. A block is always
followed.
"""

from saltus.kernels.lanes import fma, larger, load, magnitude, splat, store

#: Terms of exp(T h) v with alpha h <= 1: the next one is 1/19! = 8e-18.
BLOCK_TERMS = 18
#: Sum of the terms of a gap's series beyond the last one, in units of the first of them:
#: 1 + 6/17 + 6^2/(17*18) + ..., since alpha h <= FOLLOWED.
TAIL = 1.6


@inner
def block_of(modes, m):
    """First row of the block of a contact state, behind its modes."""
    return runs_of(modes, m) + m.sizes[MODE_GROUPS] + m.sizes[STATE_GROUPS] + 1


@inner
def groups_of(modes, m):
    """Groups of modes in use: other contact states may have more, of modes that don't oscillate."""
    return int(m.modes[block_of(modes, m) - 1, 0])


@inner
def block_groups(modes, m):
    """Groups of amplitudes in a block, 0 if there is none."""
    return int(m.modes[block_of(modes, m), 0])


@inner
def block_limit(modes, m):
    """The rate alpha [1/s] that a step must not exceed: see FOLLOWED."""
    return m.modes[block_of(modes, m), 1]


@inner
def block_left(modes, groups, m):
    """First row of L of a block."""
    return block_of(modes, m) + 1 + LANES * groups * groups


@inner
def block_waves(modes, groups, m):
    """First row of the gaps of a block."""
    return block_left(modes, groups, m) + 2 * LANES * groups * m.sizes[STATE_GROUPS]


@kernel
def set_block_drives(modes, m):
    """The drives in a block at their phases in `angle`, to `y`: no rounding of theirs adds up."""
    groups, first = block_groups(modes, m), 2 * m.sizes[MODE_GROUPS]
    row = block_waves(modes, groups, m) + 2 * groups * m.sizes[GAP_ROWS]
    for e in range(int(m.modes[block_of(modes, m), 2])):
        d, k, scale = int(m.modes[row + e, 0]), int(m.modes[row + e, 1]), m.modes[row + e, 2]
        if d == 0:
            m.y[first + k // LANES, k % LANES] = scale
        elif d <= m.sizes[DRIVES]:
            m.y[first + k // LANES, k % LANES] = scale * m.angle[d - 1, 1]
            m.y[first + (k + 1) // LANES, (k + 1) % LANES] = scale * m.angle[d - 1, 2]
        else:
            for j in range(m.sizes[TERMS]):
                value = scale * m.record[d - 1 - m.sizes[DRIVES], VALUE + j]
                m.y[first + (k + j) // LANES, (k + j) % LANES] = value
                scale /= m.modes[row + e, 3]


@kernel
def times_block(modes, groups, source, h, target, m):
    """Rows from `target` on of `chain`: T h times the rows from `source` on."""
    for g in range(groups):
        row = block_of(modes, m) + 1 + g
        a, b = splat(0.0, LANES), splat(0.0, LANES)
        for j in range(0, LANES * groups, 2):
            a = fma(load(m.modes, row + j * groups, LANES), number(m.chain, source, j), a)
            b = fma(load(m.modes, row + (j + 1) * groups, LANES), number(m.chain, source, j + 1), b)
        store(m.chain, target + g, (a + b) * h)


@kernel
def move_block(modes, h, y, to, m):
    """The amplitudes y of a block after a time h: exp(T h) v."""
    groups, first = block_groups(modes, m), 2 * m.sizes[MODE_GROUPS]
    if groups == 0:
        return
    parts = int(block_limit(modes, m) * h) + 1
    for g in range(groups):
        store(to, first + g, load(y, first + g, LANES))
    here = (ORDER + 1) * groups
    for _ in range(parts):
        for g in range(groups):
            store(m.chain, here + g, load(to, first + g, LANES))
        for k in range(1, BLOCK_TERMS + 1):
            source, target = here + groups * ((k - 1) % 2), here + groups * (k % 2)
            times_block(modes, groups, source, h / (parts * k), target, m)
            for g in range(groups):
                total = load(to, first + g, LANES) + load(m.chain, target + g, LANES)
                store(to, first + g, total)


@kernel
def follow_block(modes, h, m):
    """(T h)^k v for all terms k of a gap's series, to `chain`."""
    groups, first = block_groups(modes, m), 2 * m.sizes[MODE_GROUPS]
    for g in range(groups):
        store(m.chain, g, load(m.y, first + g, LANES))
    if groups > 0:
        for k in range(ORDER):
            times_block(modes, groups, k * groups, h, (k + 1) * groups, m)


@kernel
def add_block_series(r, modes, h, m):
    """Add a block's part of a gap to its terms in `sums`, and to the rows behind them."""
    groups = block_groups(modes, m)
    if groups == 0:
        return
    row, most = block_waves(modes, groups, m) + groups * r, 0.0
    for j in range(LANES * groups):
        most = max(most, abs(number(m.chain, 0, j)))
    left, size, share = splat(0.0, LANES), splat(0.0, LANES), 1.0
    for k in range(ORDER + 1):
        total, sizes = splat(0.0, LANES), splat(0.0, LANES)
        for g in range(groups):
            part = load(m.modes, row + g, LANES) * load(m.chain, k * groups + g, LANES)
            total, sizes = total + part, sizes + magnitude(part)
        store(m.sums, k, load(m.sums, k, LANES) + total)
        share /= max(k, 1)
        size = larger(size, sizes * share)
    power = (block_limit(modes, m) * h) ** 2
    power *= power
    power *= power
    for g in range(groups):
        left = left + magnitude(load(m.modes, row + g, LANES))
    left = left * (most * TAIL * power * power / FACTORIAL)
    store(m.sums, ORDER + 1, load(m.sums, ORDER + 1, LANES) + left)
    store(m.sums, ORDER + 2, fma(left, 16.0, load(m.sums, ORDER + 2, LANES)))
    store(m.sums, ORDER + 3, load(m.sums, ORDER + 3, LANES) + size)


@kernel
def block_amplitudes(modes, y, m):
    """Amplitudes of a block from what is in `state`, to y."""
    groups, first = block_groups(modes, m), 2 * m.sizes[MODE_GROUPS]
    for g in range(groups):
        row, a = block_left(modes, groups, m) + g, splat(0.0, LANES)
        for i in range(LANES * m.sizes[STATE_GROUPS]):
            a = fma(load(m.modes, row + i * groups, LANES), number(m.state, 0, i), a)
        store(y, first + g, a)


@kernel
def block_rates(modes, y, to, m):
    """The rates of the amplitudes y of a block: T v."""
    groups, first = block_groups(modes, m), 2 * m.sizes[MODE_GROUPS]
    if groups == 0:
        return
    for g in range(groups):
        store(m.chain, g, load(y, first + g, LANES))
    times_block(modes, groups, 0, 1.0, groups, m)
    for g in range(groups):
        store(to, first + g, load(m.chain, groups + g, LANES))


@kernel
def block_gap(r, modes, y, m):
    """A block's part of a row of gaps by its amplitudes y: a lane whose numbers add up to it."""
    groups, first = block_groups(modes, m), 2 * m.sizes[MODE_GROUPS]
    total = splat(0.0, LANES)
    if groups > 0:
        row = block_waves(modes, groups, m) + groups * r
        for g in range(groups):
            total = fma(load(m.modes, row + g, LANES), load(y, first + g, LANES), total)
    return total


@kernel
def add_block_state(modes, y, m):
    """Add the state that a block's amplitudes are to `state`."""
    groups, states, first = block_groups(modes, m), m.sizes[STATE_GROUPS], 2 * m.sizes[MODE_GROUPS]
    if groups == 0:
        return
    row = block_left(modes, groups, m) + LANES * groups * states
    for s in range(states):
        a = load(m.state, s, LANES)
        for j in range(LANES * groups):
            a = fma(load(m.modes, row + j * states + s, LANES), number(y, first, j), a)
        store(m.state, s, a)


@kernel
def block_terms(r, modes, y, m):
    """A block's part of what :func:`terms_of_gap` says of a row of gaps, by its amplitudes y: the
    size of what makes the rate, the second, third and fourth derivative.
    """
    groups, first = block_groups(modes, m), 2 * m.sizes[MODE_GROUPS]
    size, second, third, fourth = 0.0, 0.0, 0.0, 0.0
    if groups > 0:
        row = block_waves(modes, groups, m) + groups * r
        rates = row + groups * m.sizes[GAP_ROWS]
        for g in range(groups):
            store(m.chain, g, load(y, first + g, LANES))
        for k in range(3):
            times_block(modes, groups, k * groups, 1.0, (k + 1) * groups, m)
        for j in range(LANES * groups):
            w = number(m.modes, rates, j)
            size += abs(w * number(m.chain, 0, j))
            second += w * number(m.chain, groups, j)
            third += w * number(m.chain, 2 * groups, j)
            fourth += w * number(m.chain, 3 * groups, j)
    return size, second, third, fourth


@kernel
def add_block_gap(r, modes, y, m):
    """Add a block's part of a gap and of its rate, by its amplitudes y, to `sums`."""
    groups, first = block_groups(modes, m), 2 * m.sizes[MODE_GROUPS]
    if groups == 0:
        return
    row = block_waves(modes, groups, m) + groups * r
    value, rate = load(m.sums, 0, LANES), load(m.sums, 1, LANES)
    for g in range(groups):
        part = load(y, first + g, LANES)
        value = fma(load(m.modes, row + g, LANES), part, value)
        rate = fma(load(m.modes, row + groups * m.sizes[GAP_ROWS] + g, LANES), part, rate)
    store(m.sums, 0, value)
    store(m.sums, 1, rate)


@kernel
def add_block_terms(r, modes, y, m):
    """Add a block's part of a gap and of its derivatives up to the fourth, by its amplitudes y, to
    `sums`.
    """
    groups, first = block_groups(modes, m), 2 * m.sizes[MODE_GROUPS]
    row = block_waves(modes, groups, m) + groups * r
    for g in range(groups):
        store(m.chain, g, load(y, first + g, LANES))
    for k in range(5):
        for g in range(groups):
            part = load(m.chain, k * groups + g, LANES)
            store(m.sums, k, fma(load(m.modes, row + g, LANES), part, load(m.sums, k, LANES)))
        times_block(modes, groups, k * groups, 1.0, (k + 1) * groups, m)
