"""Template of the modal flow: what the gaps do over one step.

Where the amplitudes stand each row of gaps is a sum of waves, whose sizes bound what a step leaves
out. Modes that are too fast for a step are bounded: they add at most their amplitudes to a gap, and
at most |lambda| times these to its rate. The others are a polynomial. A gap is clear if it is less
that bound; it crosses once if it is proven to fall all the way and to end below zero. Where neither
is proven over the step, its parts are looked at, from the first on.
"""

from saltus.kernels.isolation import AT as ROOT_AT
from saltus.kernels.isolation import (
    MARGIN,
    MOST_TOUCHES,
    first_crossing,
    is_rounding,
    leading_sign,
    side_of_leaving,
    to_bernstein,
)
from saltus.kernels.lanes import (
    fma,
    load,
    load_at,
    lowest_bit,
    root,
    smaller,
    splat,
    store,
    store_at,
    totals,
)
from saltus.kernels.status import GAP_MARGIN, HOLD_LAW, MODE_VIOLATION
from saltus.kernels.trigonometry import sincos


# -- where the amplitudes stand --------------------------------------------------------------------
@kernel
def stand(modes, steady, which, m):
    """Put what the amplitudes in `y` say of all gaps to `stood` and `waves`. Needs `angle`."""
    groups, used = m.sizes[MODE_GROUPS], groups_of(modes, m)
    for g in range(used):
        real, imaginary = load(m.y, g, LANES), load(m.y, groups + g, LANES)
        store(m.size, g, root(fma(real, real, imaginary * imaginary)))
    for r in range(m.sizes[GAP_ROWS]):
        row, at = waves_of(r, modes, m), first_wave(r, m)
        value, rate, fifth = splat(0.0, LANES), splat(0.0, LANES), splat(0.0, LANES)
        size, speed, terms = splat(0.0, LANES), splat(0.0, LANES), splat(0.0, LANES)
        store(m.waves, at + WAVES * used + BEYOND, size)
        store(m.waves, at + WAVES * used + FASTER, speed)
        for g in range(used - 1, -1, -1):
            real, imaginary = load(m.y, g, LANES), load(m.y, groups + g, LANES)
            a, b = load(m.modes, row + g, LANES), load(m.modes, row + groups + g, LANES)
            real, imaginary = fma(-b, imaginary, a * real), fma(b, real, a * imaginary)
            a, b = load(m.modes, modes + g, LANES), load(m.modes, modes + groups + g, LANES)
            going, fast = fma(-b, imaginary, a * real), load(m.modes, modes + 2 * groups + g, LANES)
            bound = load(m.size, g, LANES) * load(m.modes, row + 2 * groups + g, LANES)
            store(m.waves, at + WAVES * g + REAL, real)
            store(m.waves, at + WAVES * g + IMAGINARY, imaginary)
            store(m.waves, at + WAVES * g + GOING, going)
            store(m.waves, at + WAVES * g + BOUND, bound)
            value, rate = value + real, rate + going
            size, speed, square = size + bound, fma(bound, fast, speed), fast * fast
            fifth = fma(bound * fast, square * square, fifth)
            weight = load(m.modes, row + 3 * groups + g, LANES)
            terms = fma(load(m.size, g, LANES), weight, terms)
            store(m.waves, at + WAVES * g + BEYOND, size)
            store(m.waves, at + WAVES * g + FASTER, speed)
        store(m.sums, 0, value)
        store(m.sums, 1, rate)
        store(m.sums, 2, fifth)
        store(m.sums, 3, terms)
        add_block_gap(r, modes, m.y, m)
        stand_row(r, steady, which, m)


@inner
def stand_row(r, steady, which, m):
    """Add the drives to what the modes say of a row of gaps, in `sums`."""
    value, rate, fifth = total_of(m.sums, 0), total_of(m.sums, 1), total_of(m.sums, 2)
    first, at = numbers_of_gap(r, steady, m)
    more, faster = steady_gap(first, at, which, m)
    size = total_of(m.sums, 3) + number(m.steady, first, sizes_of_gap(at, m))
    for d in range(m.sizes[DRIVES]):
        a, b = number(m.steady, first, at + 1 + 2 * d), number(m.steady, first, at + 2 + 2 * d)
        fifth += (abs(a) + abs(b)) * abs(m.rate[which, d]) ** 5
    m.stood[r, HERE], m.stood[r, SLOPE] = value + more, rate + faster
    m.stood[r, SIZE], m.stood[r, FIFTH] = size, fifth


@inner
def waves_of(r, modes, m):
    """First row of the amplitudes of a row of gaps in the table of modes."""
    groups = m.sizes[MODE_GROUPS]
    return modes + groups * (3 + 4 * LANES * m.sizes[STATE_GROUPS]) + 4 * groups * r


@inner
def first_wave(r, m):
    """First row of a row of gaps in `waves`."""
    return r * (WAVES * m.sizes[MODE_GROUPS] + WAVES)


@inner
def here(i, g, batch, m):
    """Value and rate of the gap of a guard on its side, where the amplitudes stand."""
    r, side = m.row_of[g], side_of(g, batch.mode[i])
    away = m.offset[int(batch.carry[i, SET]), g]
    return side * (m.sign_of[g] * m.stood[r, HERE] + away), side * m.sign_of[g] * m.stood[r, SLOPE]


@kernel
def reach(i, h, modes, batch, m):
    """The part of a step that is worth trying: as long as the modes that it follows leave no more
    than LEFT of each gap, or of its rate where that decides, to those that it bounds.
    """
    groups, used, most = m.sizes[MODE_GROUPS], groups_of(modes, m), 0
    for g in range(m.sizes[GUARDS]):
        if not is_watched(g, batch.mode[i], m):
            continue
        r, fresh = m.row_of[g], (batch.fresh[i] >> g) & 1 == 1
        value, rate = here(i, g, batch, m)
        slow = LEFT * abs(rate) if fresh == (rate > 0.0) else 0.0
        value = 0.0 if fresh else LEFT * value
        while most < used:
            row = first_wave(r, m) + WAVES * most
            left, speed = total_of(m.waves, row + BEYOND), total_of(m.waves, row + FASTER)
            if left <= value or speed <= slow:
                break
            most += 1
    fastest = m.modes[modes + 2 * groups + most - 1, LANES - 1] if most > 0 else 0.0
    fastest = max(fastest, SPANNED / FOLLOWED * block_limit(modes, m))
    return SPANNED / fastest if h * fastest > SPANNED else h


@inner
def shorter(modes, h, m):
    """The step to try where a step tells nothing, not even by its parts: the next group of modes is
    followed, too.
    """
    near, first = followed(modes, h, m), modes + 2 * m.sizes[MODE_GROUPS]
    if near == groups_of(modes, m):
        return 0.5 * h
    return min(0.5 * h, SPANNED / m.modes[first + near, LANES - 1])


# -- a row of gaps over a step ---------------------------------------------------------------------
@kernel
def followed(modes, h, m):
    """Number of groups of modes that are followed over a time h."""
    near, sizes = groups_of(modes, m), modes + 2 * m.sizes[MODE_GROUPS] - 1
    while near > 0 and m.modes[sizes + near, LANES - 1] * h > 1.000001 * SPANNED:
        near -= 1
    return near


@kernel
def bound_row(r, modes, steady, which, h, near, m):
    """Bounds of a row of gaps over a step, by the ways that its waves can go: quick, and enough for
    a gap that is far from its boundary.
    """
    groups, at, way = m.sizes[MODE_GROUPS], first_wave(r, m), splat(0.0, LANES)
    for g in range(near):
        bound = load(m.waves, at + WAVES * g + BOUND, LANES)
        part = load(m.modes, modes + 2 * groups + g, LANES) * h
        way = fma(bound, smaller(part, splat(2.0, LANES)), way)
    store(m.sums, 0, way)
    most = total_of(m.sums, 0) + 2.0 * total_of(m.waves, at + WAVES * near + BEYOND)
    first, at = numbers_of_gap(r, steady, m)
    for d in range(m.sizes[DRIVES]):
        a, b = number(m.steady, first, at + 1 + 2 * d), number(m.steady, first, at + 2 + 2 * d)
        most += (abs(a) + abs(b)) * min(abs(m.rate[which, d]) * h, 2.0)
    most += course_way(first, at + 1 + 2 * m.sizes[DRIVES], h, m)
    if block_groups(modes, m) > 0:
        most = HUGE
    m.spans[r, LEAST], m.spans[r, MOST] = m.stood[r, HERE] - most, m.stood[r, HERE] + most
    m.spans[r, KNOWN] = 0.0


@inner
def add_terms(row, term, following, twice, squared, m):
    """Add HALF derivatives of waves to the rows of `sums` from a row on; returns the next two."""
    # Re(lambda^(k+1) y) = 2 Re(lambda) Re(lambda^k y) - |lambda|^2 Re(lambda^(k-1) y)
    for k in range(row, row + HALF):
        store(m.sums, k, load(m.sums, k, LANES) + term)
        term, following = following, fma(twice, following, -(squared * term))
    return term, following


@inner
def add_drive_terms(r, at, real, imaginary, way, m):
    """Add HALF derivatives of a drive to q[r] from column `at` on."""
    term, following = real, -imaginary * way
    for k in range(at, at + HALF):
        m.q[r, k] += term
        term, following = following, -(way * way) * term


@inner
def collect(r, at, row, count, m):
    """Put the sums of the lanes of `sums` from a row on to q[r], from column `at` on."""
    for k in range(0, count, LANES):
        a, b = load(m.sums, row + k, LANES), load(m.sums, row + k + 1, LANES)
        c, d = load(m.sums, row + k + 2, LANES), load(m.sums, row + k + 3, LANES)
        store_at(m.q, r, at + k, totals(a, b, c, d))


@inner
def divide(r, at, count, m):
    """Make derivatives in q[r], from column `at` on, terms: over k!."""
    for k in range(0, count, LANES):
        share = load(m.bernstein, SHARES + k // LANES, LANES)
        store_at(m.q, r, at + k, load_at(m.q, r, at + k, LANES) * share)


@inner
def end_drives(which, h, m):
    """Cosine and sine of each drive where a step ends, to `angle`."""
    for d in range(m.sizes[DRIVES]):
        sine, cosine = sincos(splat(m.rate[which, d] * h, LANES))
        store(m.sums, 0, cosine * m.angle[d, 1] - sine * m.angle[d, 2])
        store(m.sums, 1, sine * m.angle[d, 1] + cosine * m.angle[d, 2])
        m.angle[d, 4], m.angle[d, 5] = m.sums[0, 0], m.sums[1, 0]


@kernel
def series_of(r, modes, steady, which, h, near, m):
    """Terms of a row of gaps over a step h, as [0, 1], that follows some groups of modes, to q[r]:
    where the step begins, HALF of them or all if they can tell the gap to rounding; then HALF of
    them where it ends. To errors[r]: what the polynomial of both leaves out at most, of the gap
    and of its slope; the size of its terms; what all terms of the beginning leave out. Needs
    `factor` and the drives where the step ends.
    """
    groups, beyond = m.sizes[MODE_GROUPS], first_wave(r, m) + WAVES * near
    unseen, size = total_of(m.waves, beyond + BEYOND), m.stood[r, SIZE]
    full, rest, to = unseen <= ROUNDED * size, splat(0.0, LANES), ORDER + 4
    for k in range(to + HALF):
        store(m.sums, k, splat(0.0, LANES))
    for g in range(near):
        at = first_wave(r, m) + WAVES * g
        grow = load(m.modes, modes + g, LANES) * h
        turns = load(m.modes, modes + groups + g, LANES) * h
        part = load(m.modes, modes + 2 * groups + g, LANES) * h
        twice, squared = 2.0 * grow, part * part
        real, imaginary = load(m.waves, at + REAL, LANES), load(m.waves, at + IMAGINARY, LANES)
        going = load(m.waves, at + GOING, LANES) * h
        term, following = add_terms(0, real, going, twice, squared, m)
        if full:
            add_terms(HALF, term, following, twice, squared, m)
        cosine, sine = load(m.factor, g, LANES), load(m.factor, groups + g, LANES)
        real, imaginary = fma(-imaginary, sine, real * cosine), fma(imaginary, cosine, real * sine)
        add_terms(to, real, fma(-turns, imaginary, grow * real), twice, squared, m)
        fourth = squared * squared
        eighth = fourth * fourth
        rest = fma(load(m.waves, at + BOUND, LANES), eighth * eighth, rest)
    store(m.sums, to + HALF, rest)
    left = total_of(m.sums, to + HALF)
    for k in range(HALF, ORDER + 1, LANES):
        store_at(m.q, r, k, splat(0.0, LANES))
    collect(r, 0, 0, ORDER + 1 if full else HALF, m)
    collect(r, ORDER + 1, to, HALF, m)
    first, at = numbers_of_gap(r, steady, m)
    for d in range(m.sizes[DRIVES]):
        a, b = number(m.steady, first, at + 1 + 2 * d), number(m.steady, first, at + 2 + 2 * d)
        cosine, sine, way = m.angle[d, 1], m.angle[d, 2], m.rate[which, d] * h
        power = (way * way) * (way * way)
        power *= power
        real, imaginary = a * cosine - b * sine, a * sine + b * cosine
        add_drive_terms(r, 0, real, imaginary, way, m)
        if full:
            add_drive_terms(r, HALF, power * real, power * imaginary, way, m)
        cosine, sine = m.angle[d, 4], m.angle[d, 5]
        real, imaginary = a * cosine - b * sine, a * sine + b * cosine
        add_drive_terms(r, ORDER + 1, real, imaginary, way, m)
        left += power * power * (abs(a) + abs(b))
    divide(r, 0, ORDER + 1 if full else HALF, m)
    divide(r, ORDER + 1, HALF, m)
    constant = number(m.steady, first, at)
    m.q[r, 0], m.q[r, ORDER + 1] = m.q[r, 0] + constant, m.q[r, ORDER + 1] + constant
    if m.sizes[COURSES] > 0 or block_groups(modes, m) > 0:
        size += add_other_terms(r, modes, first, at + 1 + 2 * m.sizes[DRIVES], h, m)
    left /= FACTORIAL
    e0, e1 = total_of(m.sums, ORDER + 1) + unseen, total_of(m.sums, ORDER + 2)
    m.errors[r, 1] = e1 + total_of(m.waves, beyond + FASTER) * h + STEEPER / CLOSER * left
    m.errors[r, 0], m.errors[r, 2] = e0 + left / CLOSER, size + total_of(m.sums, ORDER + 3)
    m.errors[r, 3] = e0 + left if full else HUGE
    span_of(r, m)


@kernel
def add_other_terms(r, modes, first, at, h, m):
    """Add what blocks and courses make of a row of gaps, a polynomial, to its terms in q[r].
    Returns the size of the courses' part.
    """
    for k in range(ORDER + 1):
        store(m.sums, k, splat(0.0, LANES))
    add_block_series(r, modes, h, m)
    share = 1.0
    for k in range(ORDER + 1):
        share /= max(k, 1)
        m.p[k] = share * total_of(m.sums, k)
    size = add_course_series(first, at, h, m)
    for k in range(ORDER + 1):
        m.q[r, k] += m.p[k]
    for k in range(HALF):  # Horner's rule, again and again: the terms where the step ends
        for j in range(ORDER - 1, k - 1, -1):
            m.p[j] += m.p[j + 1]
        m.q[r, ORDER + 1 + k] += m.p[k]
    return size


# -- one gap over a step ---------------------------------------------------------------------------
@inner
def side_of(g, mode):
    """+1 where the gap of a guard is positive, -1 where it is negative."""
    return 1.0 if (mode >> g) & 1 else -1.0


@inner
def is_far(i, g, batch, m):
    """True if the gap of a guard is clear by the bounds of its row, before its series is known."""
    r, side = m.row_of[g], side_of(g, batch.mode[i])
    away, up = side * m.offset[int(batch.carry[i, SET]), g], side * m.sign_of[g] > 0.0
    least = (m.spans[r, LEAST] if up else -m.spans[r, MOST]) + away
    noise = ROUNDED * (m.stood[r, SIZE] + abs(away))
    return known_zeros(i, g, batch) == 0 and least > noise and least >= m.out[MARGIN]


@kernel
def glance(i, g, batch, m):
    """Outcome of a gap over the step by the Bernstein coefficients of its row: CLEAR, CROSSES with
    the place to found[g], or OPEN if more must be asked.
    """
    r, side = m.row_of[g], side_of(g, batch.mode[i])
    away, sign = side * m.offset[int(batch.carry[i, SET]), g], side * m.sign_of[g]
    error, slope_error, size = m.errors[r, 0], m.errors[r, 1], m.errors[r, 2]
    noise, up = ROUNDED * (size + abs(away)), sign > 0.0
    if known_zeros(i, g, batch) > 0 or sign * m.spans[r, FIRST] + away <= max(error, noise):
        return OPEN
    least = (m.spans[r, LEAST] if up else -m.spans[r, MOST]) + away
    below = int(m.spans[r, BELOW] if up else m.spans[r, ABOVE])
    rises = int(m.spans[r, RISES] if up else m.spans[r, FALLS])
    turns = below != 0 and (rises >> lowest_bit(below)) != 0
    if least > error + noise and (not turns or least - error >= m.out[MARGIN]):
        return CLEAR
    steepest = m.spans[r, RISE] if up else -m.spans[r, DROP]
    if ORDER * steepest + slope_error < 0.0:
        last = sign * m.spans[r, LAST] + away
        if last - error > noise:
            return CLEAR
        if last + error < -noise:
            first = sign * m.spans[r, FIRST] + away
            bracket(g, 0.0, 1.0, first / (first - last), m)
            return CROSSES
    return OPEN


@kernel
def terms_of(i, g, side, batch, m):
    """Terms of the gap of a guard on its side where the step begins, to p; returns its rounding
    error.
    """
    r, sign = m.row_of[g], side * m.sign_of[g]
    away = m.offset[int(batch.carry[i, SET]), g]
    for k in range(ORDER + 1):
        m.p[k] = sign * m.q[r, k]
    m.p[0] += side * away
    return ROUNDED * (m.errors[r, 2] + abs(away))


@inner
def without_zeros(known, m):
    """Divide the known zeros at the beginning of the step out of the terms in `p`."""
    for k in range(ORDER + 1 if known > 0 else 0):
        m.p[k] = m.p[k + known] if k + known <= ORDER else 0.0


@inner
def begins_pressed(i, g, batch, m):
    """True if a contact is a stop that is pressed at the start of a run."""
    return batch.carry[i, STARTS] > 0.5 and g >= 0 and m.found[g, PRESSED] > 0.5


@inner
def way_of(i, g, degree, known, noise, batch, m):
    """Side to which a gap leaves its boundary in a step (0: it doesn't). The velocity of a rebound
    or a crossing tells it, however small; the first term of what begins at rest may be rounding.
    Where a force has vanished the first term that isn't tells it, though the gap may close again
    before it is more than rounding.
    """
    rests = known > 1 or m.laws[g, KIND] == HOLD_LAW
    if known == 2 and begins_pressed(i, g, batch, m):
        return -1
    if known > 2 and abs(m.p[0]) > CERTAIN * noise:
        return leading_sign(m.p, degree)
    if rests or (int(batch.carry[i, RIDES]) >> g) & 1 == 1:
        return side_of_leaving(m.p, degree, known, noise)
    return 0 if is_rounding(m.p, degree, noise) else leading_sign(m.p, degree)


@kernel
def decide(i, g, batch, m):
    """Outcome of a gap over the step: CLEAR over the part DECIDED, CROSSES, or OPEN: a shorter step
    must tell. The place of a crossing goes to found[g, PLACE]; FINAL says whether that is final.
    """
    side = side_of(g, batch.mode[i])
    noise = terms_of(i, g, side, batch, m)
    r, known = m.row_of[g], known_zeros(i, g, batch)
    error, slope_error = m.errors[r, 0], m.errors[r, 1]
    exact = m.errors[r, 3] <= noise or m.errors[r, 2] == 0.0  # nothing moves it
    if exact:  # by the terms of the beginning alone
        error, slope_error = m.errors[r, 3], slope_error + (ORDER + 1) * m.errors[r, 3]
    if known == 1 and m.laws[g, LIMITS] != 0 and turns_here(i, g, noise, batch, m):
        known = 2
    fresh, degree, whole = known > 0, ORDER - known, error
    if fresh:
        whole += abs(m.p[0])  # what the bounded modes add to the gap where it is zero
        without_zeros(known, m)
        error = slope_error if exact else slope_error + ORDER * noise
        if known > 1 and not exact:
            return OPEN
        leaves = way_of(i, g, degree, known, noise, batch, m) if exact else 1
        if leaves == 0 and m.laws[g, KIND] != HOLD_LAW:
            m.found[g, RIDDEN] = 1.0
            return CLEAR
        if leaves <= 0:  # to the other side, or the force that holds has gone
            m.found[g, PLACE], m.found[g, FINAL] = 0.0, 1.0
            return CROSSES
        if not exact and m.p[0] <= error:
            return OPEN
    elif not exact and m.p[0] <= max(error, noise):
        return OPEN
    elif m.p[0] <= noise:
        if m.laws[g, KIND] != HOLD_LAW:
            if m.p[0] < -MISSED * noise:
                batch.status[i] = MODE_VIOLATION
                return CLEAR
            m.p[0] = max(m.p[0], -noise)
        if exact and m.laws[g, KIND] != HOLD_LAW and is_rounding(m.p, degree, noise):
            m.found[g, RIDDEN] = 1.0  # held contacts keep it at zero
            return CLEAR
        # what presses a contact at rest jumps where the state does
        least = 0 if m.laws[g, KIND] == HOLD_LAW and m.laws[g, SECOND] >= 0 else -1
        ends = m.p[0] < -noise or side_of_leaving(m.p, degree, 0, noise) <= least
        if ends and least < 0 and begins_pressed(i, m.laws[g, PARTNER], batch, m):
            m.p[0] = max(m.p[0], 0.25 * noise)
        elif ends:
            m.found[g, PLACE], m.found[g, FINAL] = 0.0, 1.0
            return CROSSES
        elif m.p[1] < 0.0 and m.laws[g, KIND] != HOLD_LAW:  # it turns, which the step before noted
            m.p[0] = 0.0
            side_of_leaving(m.p, degree, 0, noise)
    if exact:
        to_bernstein(m.p, degree, m.bern[0])
    else:
        sign = side * m.sign_of[g]
        curve_of(r, sign, side * m.offset[int(batch.carry[i, SET]), g], fresh, m)
    shortest = 1.0 if exact else SHORTEST_PIECE
    answer = pieces(g, degree, fresh, error, whole, slope_error, noise, shortest, m)
    if answer != OPEN or not exact:
        return answer
    crosses, touched = isolate(g, degree, known, noise, m)
    m.found[g, PLACE], m.found[g, FINAL] = m.out[ROOT_AT], 1.0
    if m.laws[g, KIND] != HOLD_LAW:
        crosses, touched = settle(g, degree, known, noise, crosses, touched, m)
    m.found[0, TOUCHED] = min(touched, MOST_TOUCHES - 1)
    return CROSSES if crosses else CLEAR


@inner
def isolate(g, degree, known, noise, m):
    """Isolate the first crossing of a gap, whose terms are in `p`: whether it crosses, and the
    touches now held.
    """
    return first_crossing(
        m.p, degree, known > 0, noise, g, m.bern, m.bounds, m.slopes, m.out, m.touches,
        min(int(m.found[0, TOUCHED]), MOST_TOUCHES - 1),
    )  # fmt: skip


@kernel
def turn_before(i, d, margin, modes, steady, batch, m):
    """Lower the smallest margin by the turns of gaps before a landing, a time d into the step: one
    beyond it doesn't happen.
    """
    which, used = int(batch.carry[i, SET]), groups_of(modes, m)
    m.out[MARGIN], m.found[0, FACTORS] = margin, 0.0
    follow_block(modes, d, m)
    end_drives(which, d, m)
    end_factors(modes, d, used, m)
    for g in range(m.sizes[GUARDS] if d > 0.0 else 0):
        if m.found[g, TURNED] < margin:
            series_of(m.row_of[g], modes, steady, which, d, used, m)
            noise = terms_of(i, g, side_of(g, batch.mode[i]), batch, m)
            known = known_zeros(i, g, batch)
            without_zeros(known, m)
            side_of_leaving(m.p, ORDER - known, known, noise)
            crosses, touched = isolate(g, ORDER - known, known, noise, m)
            m.found[g, PLACE] = m.out[ROOT_AT]
            settle(g, ORDER - known, known, noise, crosses, touched, m)


@inner
def begun(i, hits, batch, m):
    """Of the guards that a step from the start crosses (bits) those that its state is on: how they
    begin is settled before others are met.
    """
    early = 0
    for g in range(m.sizes[GUARDS] if hits != 0 and batch.carry[i, STARTS] > 0.5 else 0):
        stood = known_zeros(i, g, batch) > 0 or m.laws[g, KIND] == HOLD_LAW
        if (hits >> g) & 1 and stood and m.found[g, PLACE] == 0.0:
            early |= 1 << g
    return early


@inner
def look(i, tau, h, modes, steady, batch, m):
    """Decide all gaps over a step: (OPEN, 0, 0) if a shorter one must tell, (CLEAR, d, 0) if no gap
    crosses in a time d, or CROSSES with the time after tau and the guards (bits).
    """
    which, near = int(batch.carry[i, SET]), followed(modes, h, m)
    margin = batch.minima[i, GAP_MARGIN]
    lowest = margin
    follow_block(modes, h, m)
    end_drives(which, h, m)
    for r in range(m.sizes[GAP_ROWS]):
        bound_row(r, modes, steady, which, h, near, m)
    m.found[0, TOUCHED], m.found[0, FACTORS] = 0.0, 0.0
    crossing, hits, first, until = 0, 0, h, 1.0
    for g in range(m.sizes[GUARDS]):
        m.found[g, RIDDEN], m.found[g, DECIDED], m.found[g, TURNED] = 0.0, 1.0, margin
        if not is_watched(g, batch.mode[i], m):
            continue
        r, m.out[MARGIN] = m.row_of[g], margin
        if m.spans[r, KNOWN] == 0.0:
            if is_far(i, g, batch, m):
                continue
            if m.found[0, FACTORS] == 0.0:
                end_factors(modes, h, near, m)
                m.found[0, FACTORS] = float(near)
            series_of(r, modes, steady, which, h, near, m)
        answer = glance(i, g, batch, m)
        if answer == OPEN:
            answer = decide(i, g, batch, m)
        if answer == OPEN:
            return OPEN, 0.0, 0
        if answer == CROSSES:
            crossing |= 1 << g
        until = min(until, m.found[g, DECIDED])
        m.found[g, TURNED], lowest = m.out[MARGIN], min(lowest, m.out[MARGIN])
    m.out[MARGIN] = lowest
    for g in range(m.sizes[GUARDS]):
        if (crossing >> g) & 1:
            d = m.found[g, PLACE] * h
            if m.found[g, FINAL] == 0.0:
                d = crossing_of(i, g, tau, h, modes, steady, batch, m)
            together = abs(d - first) <= COINCIDENT * (batch.origin[i] + tau)
            if hits != 0 and together:
                hits |= 1 << g
            elif hits == 0 or d < first:
                hits, first = 1 << g, d
    if first > until * h:
        first, hits = until * h, 0
    early = begun(i, hits, batch, m)
    if early != 0:
        first, hits = 0.0, early
    if first < h and lowest < margin:
        turn_before(i, first, margin, modes, steady, batch, m)
    return (CROSSES if hits != 0 else CLEAR), first, hits
