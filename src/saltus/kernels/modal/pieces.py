"""Template of the modal flow: a gap over a step, or a part of it, by its Bernstein coefficients.

A polynomial lies between the least and the largest of them, and falls where they all do. LANES of
them are taken at a time. Both halves of a part are products with tables of binomial coefficients:
de Casteljau's sums hang on one another, these don't (Farouki, Computer Aided Geometric Design 29
(2012), section 3).
"""

from saltus.kernels.isolation import MARGIN
from saltus.kernels.lanes import (
    bits,
    fma,
    larger,
    load,
    load_at,
    lowest_bit,
    select,
    smaller,
    splat,
    store,
    store_at,
)


@kernel
def span_of(r, m):
    """Bernstein coefficients of a row of gaps, to `waves`; what they say of it, to `spans`."""
    rows, terms = (ORDER + 1) // LANES, ORDER + 1
    into = first_wave(r, m) + WAVES * m.sizes[MODE_GROUPS]
    value = m.q[r, 0]
    low, high = splat(value, LANES), splat(value, LANES)
    drop, rise = splat(HUGE, LANES), splat(-HUGE, LANES)
    rises, falls, below, above = 0, 0, 0, 0
    for i in range(rows):
        a, b = splat(0.0, LANES), splat(0.0, LANES)
        for k in range(HALF if 2 * i < rows else 0):
            a = fma(load(m.bernstein, k * rows + i, LANES), m.q[r, k], a)
            b = fma(load(m.bernstein, (terms + k) * rows + i, LANES), m.q[r, k], b)
        for k in range(HALF if 2 * i + 2 >= rows else terms, terms):
            a = fma(load(m.bernstein, k * rows + i, LANES), m.q[r, HALF + k], a)
            b = fma(load(m.bernstein, (terms + k) * rows + i, LANES), m.q[r, HALF + k], b)
        store(m.waves, into + i, a)
        low, high = smaller(low, a), larger(high, a)
        drop, rise = smaller(drop, b), larger(rise, b)
        rises |= bits(b > 0.0) << (i * LANES)
        falls |= bits(b < 0.0) << (i * LANES)
        below |= bits(a < value) << (i * LANES)
        above |= bits(a > value) << (i * LANES)
    store(m.sums, 0, low)
    store(m.sums, 1, -high)
    store(m.sums, 2, drop)
    store(m.sums, 3, -rise)
    m.spans[r, LEAST], m.spans[r, MOST] = least_of(m.sums, 0), -least_of(m.sums, 1)
    m.spans[r, DROP], m.spans[r, RISE] = least_of(m.sums, 2), -least_of(m.sums, 3)
    m.spans[r, RISES], m.spans[r, FALLS] = float(rises), float(falls)
    m.spans[r, BELOW], m.spans[r, ABOVE] = float(below), float(above)
    m.spans[r, FIRST], m.spans[r, LAST], m.spans[r, KNOWN] = value, m.q[r, terms], 1.0


@inner
def least_of(rows, row):
    """The least lane of a row."""
    return min(min(rows[row, 0], rows[row, 1]), min(rows[row, 2], rows[row, 3]))


@kernel
def curve_of(r, sign, away, fresh, m):
    """Bernstein coefficients of a gap by those of its row, to the first row of `bern`: of the gap
    over x, if it is zero where the step begins.
    """
    rows = (ORDER + 1) // LANES
    row = first_wave(r, m) + WAVES * m.sizes[MODE_GROUPS]
    for i in range(rows):
        gap = fma(load(m.waves, row + i, LANES), sign, splat(away, LANES))
        store_at(m.bern, 0, LANES * i, gap)
    value = m.bern[0, 0]
    if fresh:
        for i in range(rows):
            change = load_at(m.bern, 0, LANES * i + 1, LANES) - value
            store_at(m.bern, 0, LANES * i, change * load(m.bernstein, OVER_X + i, LANES))


@inner
def halve_part(top, degree, m):
    """Split a part of the step, whose Bernstein coefficients are a row of `bern`: its right half is
    kept, its left half goes to the next row.
    """
    rows, less = (ORDER + 1) // LANES, ORDER - degree
    for i in range(rows):
        a = splat(0.0, LANES)
        for k in range(min(LANES * (i + 1), degree + 1)):
            a = fma(load(m.bernstein, LEFT_HALF + k * rows + i, LANES), m.bern[top, k], a)
        store_at(m.bern, top + 1, LANES * i, a)
    for i in range(rows):
        a = splat(0.0, LANES)
        for k in range(LANES * i, degree + 1):
            row = RIGHT_HALF + (k + less) * rows + i
            a = fma(load_at(m.bernstein, row, less, LANES), m.bern[top, k], a)
        store_at(m.bern, top, LANES * i, a)
    middle = 0.5 * (m.bounds[top, 0] + m.bounds[top, 1])
    m.bounds[top + 1, 0], m.bounds[top + 1, 1] = m.bounds[top, 0], middle
    m.bounds[top, 0] = middle


@kernel
def pieces(g, degree, fresh, error, whole, slope_error, noise, shortest, m):
    """Outcome of a gap by the parts of its step, from the first on, as far as they tell: the whole
    step, its halves, their halves, down to the shortest.
    """
    top, decided = 0, 0.0
    m.bounds[0, 0], m.bounds[0, 1] = 0.0, 1.0
    while top >= 0:
        answer = judge(g, top, degree, fresh, error, whole, slope_error, noise, m)
        if answer == CROSSES:
            return CROSSES
        if answer == CLEAR:
            decided = m.bounds[top, 1]
            top -= 1
        elif m.bounds[top, 1] - m.bounds[top, 0] <= shortest:
            break
        else:
            halve_part(top, degree, m)
            top += 1
    if decided == 0.0:
        return OPEN
    m.found[g, DECIDED] = decided
    return CLEAR


@kernel
def judge(g, top, degree, fresh, error, whole, slope_error, noise, m):
    """Outcome of a gap in a part of the step, whose Bernstein coefficients are a row of `bern`: of
    the gap over x, if it is zero where the step begins.
    """
    low, high, row, terms = m.bounds[top, 0], m.bounds[top, 1], top, degree
    first = fresh and low == 0.0
    if fresh and not first:  # times x: the gap itself
        row, terms, error = top + 1, degree + 1, whole
        m.bern[row, 0] = low * m.bern[top, 0]
        for k in range(1, degree + 1):
            part = (terms - k) * low * m.bern[top, k] + k * high * m.bern[top, k - 1]
            m.bern[row, k] = part / terms
        m.bern[row, terms] = high * m.bern[top, degree]
    begin, last = m.bern[row, 0], m.bern[row, terms]
    lowest, steepest = splat(begin, LANES), splat(-HUGE, LANES)
    rises, below, most = 0, 0, float(terms)
    for i in range((ORDER + 1) // LANES):
        place, a = load(m.bernstein, PLACES + i, LANES), load_at(m.bern, row, LANES * i, LANES)
        change = load_at(m.bern, row, LANES * i + 1, LANES) - a
        change = select(place < most, change, splat(-HUGE, LANES))
        a = select(place <= most, a, splat(HUGE, LANES))
        lowest, steepest = smaller(lowest, a), larger(steepest, change)
        rises |= bits(change > 0.0) << (i * LANES)
        below |= bits(a < begin) << (i * LANES)
    store(m.sums, 0, lowest)
    store(m.sums, 1, -steepest)
    least, steep = least_of(m.sums, 0), -least_of(m.sums, 1)
    turns = below != 0 and (rises >> lowest_bit(below)) != 0
    if least > error + noise and (first or not turns or least - error >= m.out[MARGIN]):
        return CLEAR
    if first or not terms * steep + slope_error * (high - low) < 0.0:
        return OPEN
    if last - error > noise:
        return CLEAR
    if last + error < -noise:
        guess = low + (high - low) * min(max(begin / (begin - last), 0.0), 1.0)
        bracket(g, low, high, guess, m)
        return CROSSES
    return OPEN


@inner
def bracket(g, low, high, guess, m):
    """Note the part of the step where a gap crosses, and about where."""
    m.found[g, PLACE], m.found[g, FINAL] = guess, 0.0
    m.found[g, BEGINS], m.found[g, BRACKET] = low, high
