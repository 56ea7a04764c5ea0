"""Template, 3 of 5 of the Taylor flow: one step of all lanes, as arithmetic on lanes."""

import math

from saltus.kernels.isolation import ROUNDING
from saltus.kernels.lanes import any_lane, bits, coarse_exp2, coarse_log2, fma, larger, load, magnitude, root, select, smaller, splat, store


@inner
def step_length(work, log2_tolerance):
    """Longest step whose last two terms stay below the tolerance times the leading terms, for every series on its own scale.

    After Jorba & Zou (2005), with the scale of a series taken from its value, its rate or its acceleration times the step, whichever
    allows most: a state that passes through zero doesn't shrink the step, and changing units changes nothing. Gaps that aren't a state
    count too: a wall may move while the body rests.
    """
    log_h = splat(1000.0, LANES)
    for i in range(NSTEPPED):
        base = STEP_ROW[i]
        log_h = smaller(longest(work, base, ORDER - 1, log2_tolerance), log_h)
        log_h = smaller(longest(work, base, ORDER, log2_tolerance), log_h)
        vanishing = magnitude(load(work, base + ORDER, LANES)) + magnitude(load(work, base + ORDER - 1, LANES)) <= 0.0
        if any_lane(vanishing):  # a series with holes, or a polynomial: ask the upper half of its terms
            for j in range((ORDER + 1) // 2, ORDER - 1):
                log_h = smaller(select(vanishing, longest(work, base, j, log2_tolerance), 1000.0), log_h)
    return coarse_exp2(log_h)


@inner
def longest(work, base, j, log2_tolerance):
    """log2 of the step at which term j of a series is as large as the tolerance times its first three (at rest: its first ones)."""
    last = coarse_log2(load(work, base + j, LANES)) - log2_tolerance
    value, rate, acceleration = load(work, base, LANES), load(work, base + 1, LANES), load(work, base + 2, LANES)
    by_value, by_rate = (coarse_log2(value) - last) * (1.0 / j), (coarse_log2(rate) - last) * (1.0 / (j - 1))
    best = larger(larger(by_value, by_rate), (coarse_log2(acceleration) - last) * (1.0 / (j - 2)))
    at_rest = magnitude(value) + magnitude(rate) + magnitude(acceleration) <= 0.0
    if any_lane(at_rest):
        for i in range(3, ORDER // 2):
            best = select(at_rest, larger(best, (coarse_log2(load(work, base + i, LANES)) - last) * (1.0 / (j - i))), best)
    return select(last + log2_tolerance < -1000.0, 1000.0, best)


@inner
def probed(lanes, h, log2_tolerance):
    """h, halved in each lane until the right-hand side at its middle and end agrees with the derivative of the series there.

    The last coefficients say nothing of a term that sleeps at the start of the step - a saturated tanh, a pulse to come - and wakes within
    it. Corliss & Chang, ACM Trans. Math. Software 8 (1982), section 4, on validating a Taylor step by its defect.
    """
    tries = 0
    wrong = disagrees(lanes, h, 1.0, log2_tolerance) | disagrees(lanes, h, 0.5, log2_tolerance)
    while tries < MOST_HALVINGS and any_lane(wrong):
        h = select(wrong, 0.5 * h, h)
        wrong = wrong & (disagrees(lanes, h, 1.0, log2_tolerance) | disagrees(lanes, h, 0.5, log2_tolerance))
        tries += 1
    return h


@inner
def disagrees(lanes, h, share, log2_tolerance):
    """Where the defect of the series at a share of h, times h, is larger than truncation and rounding explain."""
    work, d = lanes.work, h * share
    look_ahead(lanes, d)
    wrong = splat(0.0, LANES) > 1.0
    for i in range(NSTATES):
        base = i * (ORDER + 1)
        rate, slope = load(lanes.probe_rate, i, LANES), load(lanes.probe_rate, NSTATES + i, LANES)
        size = magnitude(load(work, base, LANES)) + h * (magnitude(load(work, base + 1, LANES)) + magnitude(rate))
        rounding = ROUNDING * load(lanes.probe_rate, 2 * NSTATES + i, LANES)
        if NSINGULAR > 0:
            rounding = rounding + rounding_of_gaps(lanes, i)
        allowed = DEFECT * (coarse_exp2(splat(log2_tolerance, LANES)) * size + h * rounding)
        wrong = wrong | (h * magnitude(rate - slope) > allowed)
    return wrong


@inner
def look_ahead(lanes, d):
    """The right-hand side at the states of the series at d; beside it the derivative of the series, and the size of the terms."""
    work = lanes.work
    for i in range(NSTATES):
        value = load(work, i * (ORDER + 1) + ORDER, LANES)
        slope = value
        value = fma(value, d, load(work, i * (ORDER + 1) + ORDER - 1, LANES))
        for k in range(ORDER - 2, -1, -1):
            slope = fma(slope, d, value)
            value = fma(value, d, load(work, i * (ORDER + 1) + k, LANES))
        store(lanes.probe_y, i, value)
        store(lanes.probe_rate, NSTATES + i, slope)
    for row in range(CLOCK_ROWS):
        store(lanes.probe_clock, row, load(lanes.clock, row, LANES))
    store(lanes.probe_clock, TAU, load(lanes.clock, TAU, LANES) + d)
    rates(lanes.probe_y, lanes.side, lanes.c, lanes.probe_clock, lanes.probe_rate)


@inner
def bound_series(lanes, h):
    """For every series that a gap reads: its first three terms at h, its change over h, its slope there, a bound of what follows its cubic.

    Fills `bounds`: for x in [0, 1], gap(x h) = gap(0) + t1 x + t2 x^2 + t3 x^3 + rest(x), |rest| <= W/6, |rest'| <= W/2, |rest''| <= W
    with W = sum of k(k-1)|t_k| for k >= 4 (k(k-1) >= 2k >= 6 there).
    """
    work, bounds = lanes.work, lanes.bounds
    for j in range(NSERIES):
        row = SERIES_ROW[j]
        rest, change, turn = splat(0.0, LANES), splat(0.0, LANES), splat(0.0, LANES)
        for k in range(ORDER, 3, -1):
            term = load(work, row + k, LANES)
            rest = fma(rest, h, magnitude(term) * (k * (k - 1.0)))
            turn = fma(turn, h, change)
            change = fma(change, h, term)
        h2 = h * h
        turn = fma(turn, h, 4.0 * change)  # of sum t_k h^(k-4), k >= 4: the derivative of h^4 times it, over h^3
        t1, t2, t3 = load(work, row + 1, LANES) * h, load(work, row + 2, LANES) * h2, load(work, row + 3, LANES) * h2 * h
        store(bounds, BOUNDS * j + LINEAR, t1)
        store(bounds, BOUNDS * j + QUADRATIC, t2)
        store(bounds, BOUNDS * j + CUBIC, t3)
        store(bounds, BOUNDS * j + CHANGE, fma(change * h2, h2, t3) + t2 + t1)
        store(bounds, BOUNDS * j + SLOPE_AT_END, fma(turn * h2, h2, 3.0 * t3) + 2.0 * t2 + t1)
        store(bounds, BOUNDS * j + REST, rest * h2 * h2)


@inner
def terms_of_gap(lanes, g):
    """Terms 0 to 3 of a gap over the step that `bounds` belong to, positive on its side, and the gap at its end."""
    j, side = BOUNDS * GUARD_SERIES[g], load(lanes.side, g, LANES)
    s, a0 = side * GUARD_SIGN[g], side * load(lanes.work, GAP_ROW + g, LANES)
    a1, a2, a3 = load(lanes.bounds, j + LINEAR, LANES), load(lanes.bounds, j + QUADRATIC, LANES), load(lanes.bounds, j + CUBIC, LANES)
    end = select(load(lanes.fresh, g, LANES) > 0.5, 0.0, a0) + s * load(lanes.bounds, j + CHANGE, LANES)
    return a0, s * a1, s * a2, s * a3, end


@inner
def without_known_root(on_boundary, a0, a1, a2, a3):
    """The terms of P, divided by x where the root at 0 is known."""
    return select(on_boundary, a1, a0), select(on_boundary, a2, a1), select(on_boundary, a3, a2), select(on_boundary, 0.0, a3)


@inner
def locate(lanes, h):
    """Find the lanes whose gaps may close within h. Fills WHICH, SIGN, DEPTH, ONBOARD (and `poly`, unless
    all gaps share one series) for those with one proven crossing; returns those undecided.

    A gap P (P/x where the root at 0 is known) is p0 + p1 x + p2 x^2 + p3 x^3 + rest on [0, 1]. If it is monotone or concave its end
    decides; if it is convex it crosses once where it ends below zero, and twice where its vertex is proven to be; else its quadratic part
    less the bounds of what follows decides, or the slow path does. What lies within the rounding error of the gap is never proven.
    """
    side, fresh, bounds = lanes.side, lanes.fresh, lanes.bounds
    bound_series(lanes, h)
    active = load(lanes.run, ACTIVE, LANES) > 0.5
    which = splat(-1.0, LANES)
    nearest, chosen_row, chosen_s, chosen_fresh = splat(0.0, LANES), splat(-1.0, LANES), splat(0.0, LANES), splat(0.0, LANES)
    margin, turned_at = splat(math.inf, LANES), splat(0.0, LANES)
    undecided = splat(0.0, LANES) > 1.0
    for g in range(NGUARDS):
        j = BOUNDS * GUARD_SERIES[g]
        row = GUARD_ROW[g]
        s = load(side, g, LANES) * GUARD_SIGN[g]
        on_boundary = load(fresh, g, LANES) > 0.5
        a0, a1, a2, a3, end = terms_of_gap(lanes, g)
        p0, p1, p2, p3 = without_known_root(on_boundary, a0, a1, a2, a3)
        rest = load(bounds, j + REST, LANES)
        size = load(lanes.work, SCALE_ROW + g, LANES) + magnitude(a1) + magnitude(a2) + magnitude(a3) + rest
        inherited = load(lanes.prior, PRIOR_ROWS * g + NEW, LANES)
        store(lanes.prior, PRIOR_ROWS * g + OLD, inherited)
        noise = ROUNDING * (size + inherited)
        bend = 2.0 * p2
        turns = (p1 < 0.0) & (p1 + bend > 0.0)
        flat_at = -p1 / bend  # where the quadratic part turns
        vertex = p0 + 0.5 * p1 * flat_at
        lowest = select(turns, vertex, smaller(p0, p0 + p1 + p2)) + smaller(p3, 0.0)
        falls = p1 + larger(bend, 0.0) + larger(3.0 * p3, 0.0) + 0.5 * rest < 0.0
        rises = p1 + smaller(bend, 0.0) + smaller(3.0 * p3, 0.0) - 0.5 * rest > 0.0
        concave = larger(bend, bend + 6.0 * p3) + rest < 0.0
        convex = smaller(bend, bend + 6.0 * p3) - rest > 0.0
        dips = convex & turns & (6.0 * (vertex + larger(p3, 0.0) + noise) + rest < 0.0)
        inside = p0 > 0.0
        clear = inside & (((falls | rises | concave) & (end > noise)) | (6.0 * (lowest - noise) > rest))
        crosses = active & inside & (((end < -noise) & (falls | concave | convex)) | dips)
        returns = clear & (~on_boundary) & (a1 < 0.0) & (s * load(bounds, j + SLOPE_AT_END, LANES) > 0.0)
        place = larger(smaller(flat_at, 1.0), 0.0)
        depth = fma(fma(fma(a3, place, a2), place, a1), place, a0)
        nearer = returns & (depth < margin)
        margin, turned_at = select(nearer, depth, margin), select(nearer, place * h, turned_at)
        taken = which >= 0.0
        parallel = (magnitude(chosen_row - row) < 0.5) & (s * chosen_s > 0.0) & (magnitude(a0 - nearest) > 0.0) & (~on_boundary)
        undecided = undecided | (active & (~clear) & (~crosses)) | (crosses & taken & (~parallel))
        crosses = crosses & ((~taken) | (a0 < nearest))  # gaps of one state differ by a constant: the nearer closes first
        which = select(crosses, float(g), which)
        if any_lane(crosses):
            nearest, chosen_s = select(crosses, a0, nearest), select(crosses, s, chosen_s)
            chosen_row, chosen_fresh = select(crosses, float(row), chosen_row), select(crosses, load(fresh, g, LANES), chosen_fresh)
            if NSERIES > 1:
                copy_series(lanes.poly, lanes.work, row, crosses)
    store(lanes.found, NEAREST, margin)
    store(lanes.found, TURNED, turned_at)
    store(lanes.found, SIGN, chosen_s)
    store(lanes.found, DEPTH, nearest)
    store(lanes.found, ONBOARD, chosen_fresh)
    which = select(undecided, -1.0, which)
    store(lanes.found, WHICH, which)
    return undecided


@inner
def copy_series(poly, work, row, wanted):
    """Write a series to `poly` in the lanes wanted; the first term isn't needed."""
    for k in range(1, ORDER + 1):
        store(poly, k, select(wanted, load(work, row + k, LANES), load(poly, k, LANES)))


@inner
def newton(terms, base, found, h, wanted):
    """The root of P, or of P(d)/d where the root at 0 is known, in (0, h) in the lanes wanted; its derivative there; and where it is found.

    P = P(0) + s (X(d) - X(0)) with the series X at `base`: guards of one series share its terms. Started from the root of the quadratic
    part; the first two steps use only the leading terms. A step is the last if the square of its length times a bound of P''/2 on [0, h]
    (its first four terms; the rest is smaller) says that what is left is below 1e-17 h. A lane that needs more than three steps gets them
    without touching the others.
    """
    s, depth, fresh = load(found, SIGN, LANES), load(found, DEPTH, LANES), load(found, ONBOARD, LANES) > 0.5
    x1, x2, x3 = load(terms, base + 1, LANES), load(terms, base + 2, LANES), load(terms, base + 3, LANES)
    a, b, c = select(fresh, s * x1, depth), s * select(fresh, x2, x1), s * select(fresh, x3, x2)
    x = 2.0 * a / (root(larger(b * b - 4.0 * a * c, 0.0)) - b)
    x = larger(smaller(x, h), 0.0)
    x, slope, change = newton_step(terms, base, x, s, depth, fresh, NEWTON_DEGREE_1)
    x, slope, change = newton_step(terms, base, x, s, depth, fresh, NEWTON_DEGREE_2)
    x, slope, change = newton_step(terms, base, x, s, depth, fresh, ORDER)
    x4, x5, x6 = load(terms, base + 4, LANES), load(terms, base + 5, LANES), load(terms, base + 6, LANES)
    third, fourth, fifth = magnitude(select(fresh, x4, x3)), magnitude(select(fresh, x5, x4)), magnitude(select(fresh, x6, x5))
    bend = fma(fma(fma(10.0 * fifth, h, 6.0 * fourth), h, 3.0 * third), h, magnitude(c))
    allowed = 1.0e-17 * h
    converged = change * change * bend <= allowed * magnitude(slope)
    more = 0
    while more < 3 and any_lane(wanted & (~converged)):
        closer, steeper, change = newton_step(terms, base, x, s, depth, fresh, ORDER)
        x, slope = select(converged, x, closer), select(converged, slope, steeper)
        converged = converged | (change * change * bend <= allowed * magnitude(slope))
        more += 1
    return x, slope, converged & (x > 0.0) & (x <= h) & (slope < 0.0)


@inner
def newton_step(terms, base, x, s, depth, fresh, degree):
    """One Newton step with the terms of X up to `degree` (at least 5): even and odd terms apart, for half the latency of Horner's rule."""
    u, top_even, top_odd = x * x, degree - degree % 2, degree - 1 + degree % 2
    even, odd = load(terms, base + top_even, LANES), load(terms, base + top_odd, LANES)  # of Q = (X(d) - X(0))/d: odd/even + d * even/odd
    even_rate, odd_rate = even, odd
    even, odd = fma(even, u, load(terms, base + top_even - 2, LANES)), fma(odd, u, load(terms, base + top_odd - 2, LANES))
    for k in range(top_even - 4, 0, -2):
        even_rate = fma(even_rate, u, even)
        even = fma(even, u, load(terms, base + k, LANES))
    for k in range(top_odd - 4, 0, -2):
        odd_rate = fma(odd_rate, u, odd)
        odd = fma(odd, u, load(terms, base + k, LANES))
    quotient = s * fma(even, x, odd)
    quotient_rate = s * fma(2.0 * x, fma(x, even_rate, odd_rate), even)
    slope = select(fresh, quotient_rate, fma(x, quotient_rate, quotient))
    change = select(fresh, quotient, fma(x, quotient, depth)) / slope
    return x - change, slope, change


@inner
def refine_crossings(lanes, h, undecided):
    """Newton's method in the lanes with one proven crossing; what doesn't converge joins the undecided."""
    which = load(lanes.found, WHICH, LANES)
    crosses = which >= 0.0
    store(lanes.found, DELTA, h)
    if any_lane(crosses):
        if NSERIES > 1:
            x, slope, converged = newton(lanes.poly, 0, lanes.found, h, crosses)
        else:
            x, slope, converged = newton(lanes.work, SERIES_ROW[0], lanes.found, h, crosses)
        undecided = undecided | (crosses & (~converged))
        crosses = crosses & converged
        on_boundary = load(lanes.found, ONBOARD, LANES) > 0.5
        store(lanes.found, DELTA, select(crosses, x, h))
        store(lanes.found, RATE, select(on_boundary, slope * x, slope))
        store(lanes.found, WHICH, select(crosses, which, -1.0))
    return undecided


@kernel
def settle_sooner(lanes, undecided):
    """Try one shorter step in lanes whose gaps are undecided; what that doesn't settle keeps its length. Refines, and returns what is open.

    A step that meets several contacts ends at the first; what its series say of the rest is thrown away. docs/decisions/0023.
    """
    longest = load(lanes.run, STEP, LANES)
    h = select(undecided, longest * share_to_first_crossing(lanes, longest), longest)
    tried = h < longest
    if any_lane(tried):
        undecided = locate_again(lanes, h)
        in_vain = tried & undecided
        if any_lane(in_vain):
            h = select(in_vain, longest, h)
            undecided = locate_again(lanes, h)
        store(lanes.run, STEP, h)
    return bits(refine_crossings(lanes, h, undecided))


@kernel
def locate_again(lanes, h):
    """:func:`locate`, not inlined."""
    return locate(lanes, h)


@inner
def share_to_first_crossing(lanes, h):
    """Share of the step that ends just behind the first crossing which the leading terms predict, and in front of the second.

    1 where a shorter step would prove nothing, or could tell less: a gap that turns about at zero before that (a graze is judged on the
    longest step), two crossings that may be one event, a gap that doesn't begin on its side or ends at zero, terms set aside, a step
    so short that time would hardly pass.
    """
    first, second, turned = splat(math.inf, LANES), splat(math.inf, LANES), splat(math.inf, LANES)
    for g in range(NGUARDS):
        a0, a1, a2, a3, end = terms_of_gap(lanes, g)
        p0, p1, p2, p3 = without_known_root(load(lanes.fresh, g, LANES) > 0.5, a0, a1, a2, a3)
        inside, discriminant = p0 > 0.0, p1 * p1 - 4.0 * p0 * p2
        x = 2.0 * p0 / (root(larger(discriminant, 0.0)) - p1)
        x = select(inside & (discriminant >= 0.0) & (x > 0.0), x, math.inf)
        second, first = smaller(second, larger(first, x)), smaller(first, x)
        doubt = load(lanes.bounds, BOUNDS * GUARD_SERIES[g] + REST, LANES) + 6.0 * (magnitude(p3) + TOGETHER * p0)
        touches = (p1 < 0.0) & (p2 > 0.0) & (6.0 * magnitude(discriminant) <= 4.0 * p2 * doubt)  # the vertex is -discriminant / (4 p2)
        ends_on_boundary = magnitude(end) <= TOGETHER * TOGETHER * (magnitude(a0) + magnitude(a1) + magnitude(a2) + magnitude(a3))
        turned = select(inside & (~ends_on_boundary), turned, 0.0)
        if any_lane(touches):
            turned = smaller(select(touches, -0.5 * p1 / p2, math.inf), turned)
    share = smaller(BEHIND * first, 0.5 * (first + second))
    share = select(share < WORTH_AIMING, share, SHORTENED)
    useful = (turned >= share) & (~(second - first <= TOGETHER)) & (share * h > LEAST_SHARE * load(lanes.run, END, LANES))
    for j in range(NSINGULAR):
        useful = useful & (load(lanes.side, NGUARDS + j, LANES) < 0.0)
    return select(useful, share, 1.0)


@inner
def size_of_terms(lanes, g, share):
    """Size of the terms of a gap over a share of the step: what its rounding error is measured by."""
    j = BOUNDS * GUARD_SERIES[g]
    t1, t2 = magnitude(load(lanes.bounds, j + LINEAR, LANES)), magnitude(load(lanes.bounds, j + QUADRATIC, LANES))
    t3 = magnitude(load(lanes.bounds, j + CUBIC, LANES)) + load(lanes.bounds, j + REST, LANES)
    return fma(fma(fma(t3, share, t2), share, t1), share, load(lanes.work, SCALE_ROW + g, LANES))


@inner
def state_after(work, base, d):
    """Value of a series at d. Even and odd terms apart, for half the latency; the leading terms by Horner's rule.

    Powers of d * d, which is rounded, would multiply the leading terms by the same wrong factor in every step of one length, and energy
    would drift with time.
    """
    u, top_even, top_odd = d * d, ORDER - ORDER % 2, ORDER - 1 + ORDER % 2
    even, odd = load(work, base + top_even, LANES), load(work, base + top_odd, LANES)
    for k in range(top_even - 2, HORNER, -2):
        even = fma(even, u, load(work, base + k, LANES))
    for k in range(top_odd - 2, HORNER, -2):
        odd = fma(odd, u, load(work, base + k, LANES))
    value = fma(even, d, odd)  # HORNER is even: the last odd term stands just above it
    for k in range(HORNER, -1, -1):
        value = fma(value, d, load(work, base + k, LANES))
    return value


@inner
def advance(lanes, room, options, records):
    """Evaluate the states at the end of the step, move the clock, land where that is simple; returns the lanes that need attention."""
    work, clock, run = lanes.work, lanes.clock, lanes.run
    d = load(lanes.found, DELTA, LANES)
    turned = load(lanes.found, TURNED, LANES) <= d
    least = load(run, LEAST, LANES)
    store(run, LEAST, select(turned, smaller(load(lanes.found, NEAREST, LANES), least), least))
    total = splat(0.0, LANES)
    for i in range(NSTATES):
        value = state_after(work, i * (ORDER + 1), d)
        total = total + magnitude(value)
        store(lanes.y, i, value)
    if NSINGULAR > 0:
        add_what_was_left_out(lanes, d)
    h = load(run, STEP, LANES)
    share = select(d < h, d / h, 1.0)
    for g in range(NGUARDS):
        store(lanes.fresh, g, select(d > 0.0, 0.0, load(lanes.fresh, g, LANES)))
        inherited = 0.5 * load(lanes.prior, PRIOR_ROWS * g + OLD, LANES)
        store(lanes.prior, PRIOR_ROWS * g + NEW, size_of_terms(lanes, g, share) + inherited)
    start, end = load(clock, TAU, LANES), load(run, END, LANES)
    stop = smaller(end, load(run, BREAK, LANES)) if NCLOCKS > 0 else end
    tau = select(d >= room, stop, smaller(start + d, stop))
    store(clock, TAU, tau)
    store(run, START, start)
    taken = load(run, TAKEN, LANES) + 1.0
    store(run, TAKEN, taken)
    due = (tau >= end) | (tau >= load(run, DUE, LANES)) | (~(total < HUGE)) | (taken > load(run, LIMIT, LANES))
    if NCLOCKS > 0:
        due = due | (tau >= load(run, WATCH, LANES))
    crosses = load(lanes.found, WHICH, LANES) >= 0.0
    if TANGENT or records:
        due = due | crosses
    else:
        land_simply(lanes, crosses & (~due), tau)
        due = due | (load(run, MET, LANES) >= options[MOST_CONTACTS]) | (load(lanes.found, WHICH, LANES) >= 0.0)
    return (load(run, ACTIVE, LANES) > 0.5) & due


@inner
def land_simply(lanes, simple, tau):
    """Land the lanes in which Newton's method found one contact, nothing else happens, and nobody records it: `land_all`, on lanes."""
    run, found, prior = lanes.run, lanes.found, lanes.prior
    which, rate, h = load(found, WHICH, LANES), magnitude(load(found, RATE, LANES)), load(run, STEP, LANES)
    depth = rate * rate * h * h
    shallow, flipped = load(run, SHALLOW, LANES), load(run, FLIPPED, LANES)
    for g in range(NGUARDS):
        here = simple & (magnitude(which - g) < 0.5)
        j = BOUNDS * GUARD_SERIES[g]
        curvature = 2.0 * (magnitude(load(lanes.bounds, j + QUADRATIC, LANES)) + 3.0 * magnitude(load(lanes.bounds, j + CUBIC, LANES)))
        size = load(prior, PRIOR_ROWS * g + NEW, LANES) + load(prior, PRIOR_ROWS * g + OLD, LANES)
        shallow = shallow + select(here & (depth <= 2.0 * ROUNDING * size * curvature), splat(1.0, LANES), 0.0)
        flipped = select(here, float(1 << g), flipped)
        side = load(lanes.side, g, LANES)
        store(lanes.side, g, select(here, -side, side))
        store(lanes.fresh, g, select(here, 1.0, load(lanes.fresh, g, LANES)))
        if SNAP_STATE[g] >= 0:
            store(lanes.y, SNAP_STATE[g], select(here, load(lanes.c, SNAP_CONST[g], LANES), load(lanes.y, SNAP_STATE[g], LANES)))
    store(run, SHALLOW, shallow)
    store(run, FLIPPED, flipped)
    met, slowest = load(run, MET, LANES), load(run, SLOWEST, LANES)
    store(run, MET, select(simple, met + 1.0, met))
    store(run, SLOWEST, select(simple, smaller(rate, slowest), slowest))
    store(run, LANDED, select(simple, tau + load(lanes.clock, BASE, LANES), load(run, LANDED, LANES)))
    store(run, BOUNCES, select(simple, 0.0, load(run, BOUNCES, LANES)))
    store(run, STARTING, select(simple, 0.0, load(run, STARTING, LANES)))
    store(found, WHICH, select(simple, -1.0, which))


@inner
def step_all(lanes, batch, slow):
    """One step of every lane; returns the bit set of lanes that need attention."""
    coefficients(lanes)
    room = load(lanes.run, END, LANES) - load(lanes.clock, TAU, LANES)
    if NCLOCKS > 0:
        room = smaller(load(lanes.run, BREAK, LANES) - load(lanes.clock, TAU, LANES), room)
    h = step_length(lanes.work, batch.options[LOG2_TOLERANCE])
    h = away_from_boundaries(lanes, h, room) if NSINGULAR > 0 else smaller(h, room)
    if PROBED:
        h = probed(lanes, smaller(h, LONGEST_SHARE * load(lanes.run, END, LANES)), batch.options[LOG2_TOLERANCE])
    store(lanes.run, STEP, h)
    undecided = locate(lanes, h)
    open_lanes = settle_sooner(lanes, undecided) if any_lane(undecided) else bits(refine_crossings(lanes, h, undecided))
    waiting = open_lanes
    while waiting != 0:
        decide(lanes, lowest_bit(waiting), batch, slow)
        waiting &= waiting - 1
    return open_lanes | bits(advance(lanes, room, batch.options, batch.rec_i.shape[0] > 0))
