"""Template of the modal flow: the place at which a gap crosses, by Newton's method on the modes."""

from saltus.kernels.lanes import fma, load, load_at, splat, store


@kernel
def about(g, r, sign, away, m):
    """Part of the step at which a gap crosses in its bracket, roughly: by a few steps of Newton's
    method on the polynomial of both ends.
    """
    rows, half = (ORDER + 1) // LANES, HALF // LANES
    for i in range(half):
        store(m.sums, i, load_at(m.q, r, LANES * i, LANES))
    for i in range(half, rows):
        a = splat(0.0, LANES)
        for k in range(ORDER + 1):
            value = m.q[r, k if k < HALF else HALF + k]
            a = fma(load(m.bernstein, POWERS + k * rows + i, LANES), value, a)
        store(m.sums, i, a)
    x, low, high = m.found[g, PLACE], m.found[g, BEGINS], m.found[g, BRACKET]
    for _ in range(3):
        value, rate = value_and_slope(x, m)
        value = sign * value + away
        x = x - value / (sign * rate) if rate != 0.0 else x
        x = min(max(x, low), high)
    return x


@inner
def value_and_slope(x, m):
    """Value and derivative of a polynomial whose coefficients stand in `sums`, in the order of the
    powers: polynomials of x^LANES, a lane for each power of x below that, side by side.
    """
    square = x * x
    power = square * square
    a = load(m.sums, (ORDER + 1) // LANES - 1, LANES)
    b = splat(0.0, LANES)
    for i in range((ORDER + 1) // LANES - 2, -1, -1):
        b = fma(b, power, a)
        a = fma(a, power, load(m.sums, i, LANES))
    store(m.sums, ORDER + 1, a)
    store(m.sums, ORDER + 2, b)
    p, q = number(m.sums, ORDER + 1, 0), number(m.sums, ORDER + 1, 1)
    r, s = number(m.sums, ORDER + 1, 2), number(m.sums, ORDER + 1, 3)
    value = (p + q * x) + square * (r + s * x)
    rate = (q + 2.0 * r * x) + 3.0 * s * square
    p, q = number(m.sums, ORDER + 2, 0), number(m.sums, ORDER + 2, 1)
    r, s = number(m.sums, ORDER + 2, 2), number(m.sums, ORDER + 2, 3)
    return value, rate + 4.0 * x * square * ((p + q * x) + square * (r + s * x))


@kernel
def crossing_of(i, g, tau, h, modes, steady, batch, m):
    """Time after tau at which a gap that falls all the way crosses, by Newton's method on the modes
    inside a shrinking bracket: each step goes to a zero of the terms up to the fourth.
    """
    which, side, r = int(batch.carry[i, SET]), side_of(g, batch.mode[i]), m.row_of[g]
    sign, away = side * m.sign_of[g], side * m.offset[which, g]
    low, high, d = 0.0, m.found[g, BRACKET] * h, about(g, r, sign, away, m) * h
    noise = 2.3e-16 * (m.errors[r, 2] + abs(away))
    cubic = m.sizes[COURSES] == 0 or m.sizes[TERMS] <= 4
    bounded = cubic and block_groups(modes, m) == 0  # FIFTH holds all that has a fifth derivative
    for _ in range(60):
        drive(i, tau + d, batch, m)
        gap_after(r, d, modes, steady, which, m)
        value, rate = sign * m.near[0] + away, sign * m.near[1]
        if value == 0.0:
            break
        if value > 0.0:
            low = d
        else:
            high = d
        way, left = -value / rate if rate < 0.0 else h, value
        for _ in range(4):
            bend = m.near[2] + way * (m.near[3] + way * m.near[4])
            twist = 2.0 * m.near[2] + way * (3.0 * m.near[3] + 4.0 * way * m.near[4])
            steep = rate + sign * way * twist
            left = value + way * (rate + sign * way * bend)
            if steep < 0.0 and abs(left) > 0.1 * noise:
                way -= left / steep
        new = d + way
        if not low <= new <= high:
            new, left = 0.5 * (low + high), HUGE
        change, d = abs(new - d), new
        square = change * change
        left = abs(left) + m.stood[r, FIFTH] * (square * square * change) * (1.0 / 120.0)
        if bounded and left <= noise:
            break
        if change <= 2.3e-16 * d or change * abs(rate) <= noise:
            break
    return d


@kernel
def gap_after(r, h, modes, steady, which, m):
    """Terms up to the fourth of a row of gaps a time h after where the amplitudes stand, to `near`.
    Needs `angle`.
    """
    groups, used = m.sizes[MODE_GROUPS], groups_of(modes, m)
    a, b, c = splat(0.0, LANES), splat(0.0, LANES), splat(0.0, LANES)
    d, e = splat(0.0, LANES), splat(0.0, LANES)
    for g in range(used):
        at = first_wave(r, m) + WAVES * g
        cosine, sine = factor_of(modes, g, h, m)
        real, imaginary = load(m.waves, at + REAL, LANES), load(m.waves, at + IMAGINARY, LANES)
        real, imaginary = fma(-imaginary, sine, real * cosine), fma(imaginary, cosine, real * sine)
        grow, size = load(m.modes, modes + g, LANES), load(m.modes, modes + 2 * groups + g, LANES)
        turns, twice, squared = load(m.modes, modes + groups + g, LANES), 2.0 * grow, size * size
        rate = fma(-turns, imaginary, grow * real)
        second = fma(twice, rate, -(squared * real))
        third = fma(twice, second, -(squared * rate))
        a, b, c, d = a + real, b + rate, c + second, d + third
        e = fma(twice, third, fma(-squared, second, e))
    store(m.sums, 0, a)
    store(m.sums, 1, b)
    store(m.sums, 2, c)
    store(m.sums, 3, d)
    store(m.sums, 4, e)
    if block_groups(modes, m) > 0:
        move_block(modes, h, m.y, m.moved, m)
        add_block_terms(r, modes, m.moved, m)
    for k in range(5):
        m.near[k] = total_of(m.sums, k)
    first, at = numbers_of_gap(r, steady, m)
    value, rate = steady_gap(first, at, which, m)
    m.near[0], m.near[1] = m.near[0] + value, m.near[1] + rate
    for j in range(m.sizes[DRIVES]):
        u, v = number(m.steady, first, at + 1 + 2 * j), number(m.steady, first, at + 2 + 2 * j)
        real, w = u * m.angle[j, 1] - v * m.angle[j, 2], m.rate[which, j]
        imaginary = u * m.angle[j, 2] + v * m.angle[j, 1]
        m.near[2] -= w * w * real
        m.near[3] += w * w * w * imaginary
        m.near[4] += w * w * w * w * real
    for p in range(m.sizes[COURSES]):
        numbers = at + 1 + 2 * m.sizes[DRIVES] + m.sizes[TERMS] * p
        for order in range(2, 5):
            for k in range(m.sizes[TERMS] - order):
                part = number(m.steady, first, numbers + k) * m.record[p, VALUE + order + k]
                m.near[order] += part
    m.near[2], m.near[3], m.near[4] = m.near[2] / 2.0, m.near[3] / 6.0, m.near[4] / 24.0
