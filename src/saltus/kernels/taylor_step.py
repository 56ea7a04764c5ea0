"""Template, 2 of 4 of the Taylor flow: one step of all lanes, as arithmetic on lanes."""

from saltus.kernels.lanes import any_lane, bits, coarse_exp2, coarse_log2, fma, larger, load, magnitude, root, select, smaller, splat, store


@inner
def step_length(work, log2_tolerance):
    """Longest step whose last two terms stay below the tolerance times the leading terms, for every state on its own scale.

    After Jorba & Zou (2005), with the scale of a state taken from its value, its rate or its acceleration times the step, whichever
    allows most: a state that passes through zero doesn't shrink the step, and changing units changes nothing.
    """
    log_h = splat(1000.0, LANES)
    for i in range(NSTATES):
        base = i * (ORDER + 1)
        l0 = coarse_log2(load(work, base, LANES)) + log2_tolerance
        l1 = coarse_log2(load(work, base + 1, LANES)) + log2_tolerance
        l2 = coarse_log2(load(work, base + 2, LANES)) + log2_tolerance
        for j in (ORDER - 1, ORDER):
            last = coarse_log2(load(work, base + j, LANES))
            best = larger((l0 - last) * (1.0 / j), (l1 - last) * (1.0 / (j - 1)))
            best = larger(best, (l2 - last) * (1.0 / (j - 2)))
            log_h = smaller(select(last < -1000.0, 1000.0, best), log_h)
    return coarse_exp2(log_h)


@inner
def bound_series(lanes, h):
    """For every series that a gap reads: its first three terms at h, its whole change over h, and the bound of what follows its cubic.

    Fills `bounds`: for x in [0, 1], gap(x h) = gap(0) + t1 x + t2 x^2 + t3 x^3 + rest(x), |rest| <= W/6, |rest'| <= W/2, |rest''| <= W
    with W = sum of k(k-1)|t_k| for k >= 4 (k(k-1) >= 2k >= 6 there).
    """
    work, bounds = lanes.work, lanes.bounds
    for j in range(NSERIES):
        row = SERIES_ROW[j]
        rest = splat(0.0, LANES)
        change = splat(0.0, LANES)
        for k in range(ORDER, 3, -1):
            term = load(work, row + k, LANES)
            rest = fma(rest, h, magnitude(term) * (k * (k - 1.0)))
            change = fma(change, h, term)
        h2 = h * h
        t1, t2, t3 = load(work, row + 1, LANES) * h, load(work, row + 2, LANES) * h2, load(work, row + 3, LANES) * h2 * h
        store(bounds, BOUNDS * j + LINEAR, t1)
        store(bounds, BOUNDS * j + QUADRATIC, t2)
        store(bounds, BOUNDS * j + CUBIC, t3)
        store(bounds, BOUNDS * j + CHANGE, fma(change * h2, h2, t3) + t2 + t1)
        store(bounds, BOUNDS * j + REST, rest * h2 * h2)


@inner
def locate(lanes, h):
    """Find the lanes whose gaps may close within h. Fills `poly` and WHICH for those with one proven crossing; returns those undecided.

    A gap P (P/x where the root at 0 is known) is p0 + p1 x + p2 x^2 + p3 x^3 + rest on [0, 1]. If it is monotone or concave its end
    decides; if it is convex it crosses once where it ends below zero, and twice where its vertex is proven to be; else its quadratic part
    less the bounds of what follows decides, or the slow path does.
    """
    side, fresh, run, bounds = lanes.side, lanes.fresh, lanes.run, lanes.bounds
    bound_series(lanes, h)
    active = load(run, ACTIVE, LANES) > 0.5
    which = splat(-1.0, LANES)
    nearest, chosen_row, chosen_s = splat(0.0, LANES), splat(-1.0, LANES), splat(0.0, LANES)
    least = load(run, LEAST, LANES)
    undecided = h < 0.0
    for g in range(NGUARDS):
        j = BOUNDS * GUARD_SERIES[g]
        row = GUARD_ROW[g]
        s = load(side, g, LANES) * GUARD_SIGN[g]
        on_boundary = load(fresh, g, LANES) > 0.5
        a0 = load(side, g, LANES) * load(lanes.work, GAP_ROW + g, LANES)
        a1, a2, a3 = s * load(bounds, j + LINEAR, LANES), s * load(bounds, j + QUADRATIC, LANES), s * load(bounds, j + CUBIC, LANES)
        end = select(on_boundary, 0.0, a0) + s * load(bounds, j + CHANGE, LANES)
        p0, p1, p2 = select(on_boundary, a1, a0), select(on_boundary, a2, a1), select(on_boundary, a3, a2)
        p3 = select(on_boundary, 0.0, a3)
        rest = load(bounds, j + REST, LANES)
        bend = 2.0 * p2
        turns = (p1 < 0.0) & (p1 + bend > 0.0)
        vertex = p0 - p1 * p1 / (2.0 * bend)
        lowest = select(turns, vertex, smaller(p0, p0 + p1 + p2)) + smaller(p3, 0.0)
        falls = p1 + larger(bend, 0.0) + larger(3.0 * p3, 0.0) + 0.5 * rest < 0.0
        rises = p1 + smaller(bend, 0.0) + smaller(3.0 * p3, 0.0) - 0.5 * rest > 0.0
        concave = larger(bend, bend + 6.0 * p3) + rest < 0.0
        convex = smaller(bend, bend + 6.0 * p3) - rest > 0.0
        dips = convex & turns & (6.0 * (vertex + larger(p3, 0.0)) + rest < 0.0)
        inside = p0 > 0.0
        clear = inside & (((falls | rises | concave) & (end > 0.0)) | (6.0 * lowest > rest))
        crosses = active & inside & (((end < 0.0) & (falls | concave | convex)) | dips)
        least = select(clear & turns & active & (~on_boundary), smaller(lowest, least), least)
        taken = which >= 0.0
        parallel = (magnitude(chosen_row - row) < 0.5) & (s * chosen_s > 0.0) & (magnitude(a0 - nearest) > 0.0) & (~on_boundary)
        undecided = undecided | (active & (~clear) & (~crosses)) | (crosses & taken & (~parallel))
        crosses = crosses & ((~taken) | (a0 < nearest))  # gaps of one state differ by a constant: the nearer closes first
        which = select(crosses, float(g), which)
        if any_lane(crosses):
            nearest, chosen_row, chosen_s = (
                select(crosses, a0, nearest),
                select(crosses, float(row), chosen_row),
                select(crosses, s, chosen_s),
            )
            copy_gap(lanes.poly, lanes.work, row, s, a0, on_boundary, crosses)
    store(run, LEAST, least)
    which = select(undecided, -1.0, which)
    store(lanes.found, WHICH, which)
    return undecided


@inner
def copy_gap(poly, work, row, s, a0, on_boundary, wanted):
    """Write P(d), or P(d)/d where the root at 0 is known, to `poly` in the lanes wanted."""
    below = a0
    for k in range(ORDER):
        above = s * load(work, row + k + 1, LANES)
        store(poly, k, select(wanted, select(on_boundary, above, below), load(poly, k, LANES)))
        below = above
    store(poly, ORDER, select(wanted, select(on_boundary, 0.0, below), load(poly, ORDER, LANES)))


@inner
def newton(poly, h, wanted):
    """The root of P in (0, h) in the lanes wanted, P' there, and whether it has converged; started from the root of P's quadratic part.

    The first two steps use only the leading terms. A lane that needs more than three steps gets them without touching the others.
    """
    a, b, c = load(poly, 0, LANES), load(poly, 1, LANES), load(poly, 2, LANES)
    x = 2.0 * a / (root(larger(b * b - 4.0 * a * c, 0.0)) - b)
    x = larger(smaller(x, h), 0.0)
    x, slope, change = newton_step(poly, x, NEWTON_DEGREE_1)
    x, slope, change = newton_step(poly, x, NEWTON_DEGREE_2)
    x, slope, change = newton_step(poly, x, ORDER)
    allowed = 1.0e-17 * h
    converged = change * change * magnitude(c) <= allowed * magnitude(slope)
    more = 0
    while more < 3 and any_lane(wanted & (~converged)):
        closer, steeper, change = newton_step(poly, x, ORDER)
        x, slope = select(converged, x, closer), select(converged, slope, steeper)
        converged = converged | (change * change * magnitude(c) <= allowed * magnitude(slope))
        more += 1
    return x, slope, converged & (x > 0.0) & (x <= h) & (slope < 0.0)


@inner
def newton_step(poly, x, degree):
    """One Newton step with the terms of P up to `degree`."""
    p = load(poly, degree, LANES)
    d = p
    p = fma(p, x, load(poly, degree - 1, LANES))
    for k in range(degree - 2, -1, -1):
        d = fma(d, x, p)
        p = fma(p, x, load(poly, k, LANES))
    change = p / d
    return x - change, d, change


@inner
def refine_crossings(lanes, h, undecided):
    """Newton's method in the lanes with one proven crossing; what doesn't converge joins the undecided."""
    which = load(lanes.found, WHICH, LANES)
    crosses = which >= 0.0
    store(lanes.found, DELTA, h)
    if any_lane(crosses):
        x, slope, converged = newton(lanes.poly, h, crosses)
        undecided = undecided | (crosses & (~converged))
        crosses = crosses & converged
        on_boundary = h < 0.0
        for g in range(NGUARDS):
            on_boundary = on_boundary | ((load(lanes.fresh, g, LANES) > 0.5) & (magnitude(which - g) < 0.5))
        store(lanes.found, DELTA, select(crosses, x, h))
        store(lanes.found, RATE, select(on_boundary, slope * x, slope))
        store(lanes.found, WHICH, select(crosses, which, -1.0))
    return undecided


@inner
def advance(lanes, room, most_steps):
    """Evaluate the states at the end of the step, move the clock; returns the lanes that need attention."""
    work, clock, run = lanes.work, lanes.clock, lanes.run
    d = load(lanes.found, DELTA, LANES)
    total = splat(0.0, LANES)
    for i in range(NSTATES):
        base = i * (ORDER + 1)
        value = load(work, base + ORDER, LANES)
        for k in range(ORDER - 1, -1, -1):
            value = fma(value, d, load(work, base + k, LANES))
        total = total + magnitude(value)
        store(lanes.y, i, value)
    for g in range(NGUARDS):
        store(lanes.fresh, g, select(d > 0.0, 0.0, load(lanes.fresh, g, LANES)))
    start, end = load(clock, TAU, LANES), load(run, END, LANES)
    tau = select(d >= room, end, smaller(start + d, end))
    store(clock, TAU, tau)
    store(run, START, start)
    taken = load(run, TAKEN, LANES) + 1.0
    store(run, TAKEN, taken)
    due = (tau >= end) | (tau >= load(run, DUE, LANES)) | (load(lanes.found, WHICH, LANES) >= 0.0)
    return (load(run, ACTIVE, LANES) > 0.5) & (due | (~(total < HUGE)) | (taken > most_steps))


@inner
def step_all(lanes, batch, slow):
    """One step of every lane; returns the bit set of lanes that need attention."""
    jets(lanes.y, lanes.side, lanes.c, lanes.clock, lanes.work)
    room = load(lanes.run, END, LANES) - load(lanes.clock, TAU, LANES)
    h = smaller(step_length(lanes.work, batch.options[0]), room)
    store(lanes.run, STEP, h)
    undecided = refine_crossings(lanes, h, locate(lanes, h))
    open_lanes = bits(undecided)
    for lane in range(LANES):
        if (open_lanes >> lane) & 1:
            decide(lanes, lane, batch, slow)
    return open_lanes | bits(advance(lanes, room, batch.options[1]))
