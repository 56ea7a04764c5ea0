"""Template of the Taylor flow: one step of all lanes, as arithmetic on lanes: its length
and its execution.
"""

from saltus.kernels.isolation import ROUNDING
from saltus.kernels.lanes import (
    any_lane,
    bits,
    coarse_exp2,
    coarse_log2,
    fma,
    larger,
    load,
    magnitude,
    select,
    smaller,
    splat,
    store,
)


@inner
def step_length(work, log2_tolerance):
    """Longest step whose last two terms stay below the tolerance times the leading terms, for every
    series on its own scale.

    After Jorba & Zou (2005), with the scale of a series taken from its value, its rate or its
    acceleration times the step, whichever allows most: a state that passes through zero doesn't
    shrink the step, and changing units changes nothing. Gaps that aren't a state count too, on the
    scale of their terms: a wall may move while the body rests, and a boundary that is ridden leaves
    nothing but their rounding.
    """
    log_h = splat(1000.0, LANES)
    for i in range(NSTATES):
        base = i * (ORDER + 1)
        log_h = shortened(work, base, load(work, base, LANES), log_h, log2_tolerance)
    for g in range(NGUARDS):
        base = GUARD_ROW[g]
        if base >= NSTATES * (ORDER + 1):
            size = larger(magnitude(load(work, base, LANES)), load(work, SCALE_ROW + g, LANES))
            log_h = shortened(work, base, size, log_h, log2_tolerance)
    return coarse_exp2(log_h)


@inner
def shortened(work, base, value, log_h, log2_tolerance):
    """log_h, or less where a series of this value asks for a shorter step."""
    log_h = smaller(longest(work, base, value, ORDER - 1, log2_tolerance), log_h)
    log_h = smaller(longest(work, base, value, ORDER, log2_tolerance), log_h)
    vanishing = (
        magnitude(load(work, base + ORDER, LANES)) + magnitude(load(work, base + ORDER - 1, LANES))
        <= 0.0
    )
    # a series with holes, or a polynomial: ask the upper half of its terms
    if any_lane(vanishing):
        for j in range((ORDER + 1) // 2, ORDER - 1):
            log_h = smaller(
                select(vanishing, longest(work, base, value, j, log2_tolerance), 1000.0), log_h
            )
    return log_h


@inner
def longest(work, base, value, j, log2_tolerance):
    """log2 of the step at which term j of a series is as large as the tolerance times its first
    three (at rest: its first ones).
    """
    last = coarse_log2(load(work, base + j, LANES)) - log2_tolerance
    rate, acceleration = load(work, base + 1, LANES), load(work, base + 2, LANES)
    by_value, by_rate = (
        (coarse_log2(value) - last) * (1.0 / j),
        (coarse_log2(rate) - last) * (1.0 / (j - 1)),
    )
    best = larger(larger(by_value, by_rate), (coarse_log2(acceleration) - last) * (1.0 / (j - 2)))
    at_rest = magnitude(value) + magnitude(rate) + magnitude(acceleration) <= 0.0
    if any_lane(at_rest):
        for i in range(3, ORDER // 2):
            best = select(
                at_rest,
                larger(best, (coarse_log2(load(work, base + i, LANES)) - last) * (1.0 / (j - i))),
                best,
            )
    return select(last + log2_tolerance < -1000.0, 1000.0, best)


@inner
def probed(lanes, h, log2_tolerance):
    """Halve h in each lane until the right-hand side at its middle and end agrees with the
    derivative of the series there.

    The last coefficients say nothing of a term that sleeps at the start of the step - a saturated
    tanh, a pulse to come - and wakes within it. Corliss & Chang, ACM Trans. Math. Software 8
    (1982), section 4, on validating a Taylor step by its defect.
    """
    tries = 0
    wrong = disagrees(lanes, h, 1.0, log2_tolerance) | disagrees(lanes, h, 0.5, log2_tolerance)
    while tries < MOST_HALVINGS and any_lane(wrong):
        h = select(wrong, 0.5 * h, h)
        wrong = wrong & (
            disagrees(lanes, h, 1.0, log2_tolerance) | disagrees(lanes, h, 0.5, log2_tolerance)
        )
        tries += 1
    return h


@inner
def disagrees(lanes, h, share, log2_tolerance):
    """Lanes in which the defect of the series at a share of h, times h, exceeds truncation and
    rounding.
    """
    work, d = lanes.work, h * share
    look_ahead(lanes, d)
    wrong = splat(0.0, LANES) > 1.0
    for i in range(NSTATES):
        base = i * (ORDER + 1)
        rate, slope = load(lanes.probe_rate, i, LANES), load(lanes.probe_rate, NSTATES + i, LANES)
        size = magnitude(load(work, base, LANES)) + h * (
            magnitude(load(work, base + 1, LANES)) + magnitude(rate)
        )
        rounding = ROUNDING * load(lanes.probe_rate, 2 * NSTATES + i, LANES)
        if NSINGULAR > 0:
            rounding = rounding + rounding_of_gaps(lanes, i)
        allowed = DEFECT * (coarse_exp2(log2_tolerance) * size + h * rounding)
        wrong = wrong | (h * magnitude(rate - slope) > allowed)
    return wrong


@inner
def look_ahead(lanes, d):
    """The right-hand side at the states of the series at d, the derivative of the series, and the
    size of the terms.
    """
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
def size_of_terms(lanes, g, share):
    """Size of the terms of a gap over a share of the step, the unit of its rounding error."""
    j = BOUNDS * GUARD_SERIES[g]
    t1, t2 = (
        magnitude(load(lanes.bounds, j + LINEAR, LANES)),
        magnitude(load(lanes.bounds, j + QUADRATIC, LANES)),
    )
    t3 = magnitude(load(lanes.bounds, j + CUBIC, LANES)) + load(lanes.bounds, j + REST, LANES)
    return fma(fma(fma(t3, share, t2), share, t1), share, load(lanes.work, SCALE_ROW + g, LANES))


@inner
def state_after(work, base, d):
    """Value of a series at d. Even and odd terms apart, for half the latency; the leading terms by
    Horner's rule.

    Powers of d * d, which is rounded, would multiply the leading terms by the same wrong factor in
    every step of one length, and energy would drift with time.
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
def advance(lanes, room, records):
    """Evaluate the states at the end of the step, move the clock, land simple contacts; return the
    lanes that need attention.
    """
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
    due = (
        (tau >= end)
        | (tau >= load(run, DUE, LANES))
        | (~(total < HUGE))
        | (taken > load(run, LIMIT, LANES))
    )
    if NCLOCKS > 0:
        due = due | (tau >= load(run, WATCH, LANES))
    crosses = load(lanes.found, WHICH, LANES) >= 0.0
    if TANGENT or LAWS or records:
        due = due | crosses
    else:
        land_simply(lanes, crosses & (~due), tau)
        due = (
            due
            | (load(run, MET, LANES) >= load(run, MOST_MET, LANES))
            | (load(lanes.found, WHICH, LANES) >= 0.0)
        )
    return (load(run, ACTIVE, LANES) > 0.5) & due


@inner
def land_simply(lanes, simple, tau):
    """Land the lanes in which Newton's method found one contact, nothing else happens, and no
    record is kept: `land_all`, on lanes.
    """
    run, found, prior = lanes.run, lanes.found, lanes.prior
    which, rate, h = (
        load(found, WHICH, LANES),
        magnitude(load(found, RATE, LANES)),
        load(run, STEP, LANES),
    )
    depth = smaller(rate * h, LARGE)
    depth = depth * depth
    shallow, flipped = load(run, SHALLOW, LANES), load(run, FLIPPED, LANES)
    for g in range(NGUARDS):
        here = simple & (magnitude(which - g) < 0.5)
        j = BOUNDS * GUARD_SERIES[g]
        curvature = 2.0 * (
            magnitude(load(lanes.bounds, j + QUADRATIC, LANES))
            + 3.0 * magnitude(load(lanes.bounds, j + CUBIC, LANES))
        )
        size = load(prior, PRIOR_ROWS * g + NEW, LANES) + load(prior, PRIOR_ROWS * g + OLD, LANES)
        below = 2.0 * ROUNDING * smaller(size, LARGE) * smaller(curvature, LARGE)
        shallow = shallow + select(here & (depth <= below), splat(1.0, LANES), 0.0)
        flipped = select(here, float(1 << g), flipped)
        side = load(lanes.side, g, LANES)
        store(lanes.side, g, select(here, -side, side))
        store(lanes.fresh, g, select(here, 1.0, load(lanes.fresh, g, LANES)))
        if SNAP_STATE[g] >= 0:
            store(
                lanes.y,
                SNAP_STATE[g],
                select(
                    here, load(lanes.c, SNAP_CONST[g], LANES), load(lanes.y, SNAP_STATE[g], LANES)
                ),
            )
    store(run, SHALLOW, shallow)
    store(run, FLIPPED, flipped)
    store(run, CAUSE, select(simple, which, load(run, CAUSE, LANES)))
    met, slowest = load(run, MET, LANES), load(run, SLOWEST, LANES)
    store(run, MET, select(simple, met + 1.0, met))
    store(run, SLOWEST, select(simple, smaller(rate, slowest), slowest))
    store(
        run, LANDED, select(simple, tau + load(lanes.clock, BASE, LANES), load(run, LANDED, LANES))
    )
    store(run, BOUNCES, select(simple, 0.0, load(run, BOUNCES, LANES)))
    store(run, STARTING, select(simple, 0.0, load(run, STARTING, LANES)))
    store(found, WHICH, select(simple, -1.0, which))


@inner
def step_all(lanes, batch, slow):
    """Take one step of every lane; return the bit set of lanes that need attention."""
    coefficients(lanes)
    room = load(lanes.run, END, LANES) - load(lanes.clock, TAU, LANES)
    ahead = load(lanes.run, AHEAD, LANES)
    room = room + ahead
    if NCLOCKS > 0:
        room = smaller(load(lanes.run, BREAK, LANES) - load(lanes.clock, TAU, LANES), room)
    log2_tolerance = load(lanes.run, TOLERANCE, LANES)
    h = step_length(lanes.work, log2_tolerance)
    h = away_from_boundaries(lanes, h, room) if NSINGULAR > 0 else smaller(h, room)
    if PROBED:
        most = LONGEST_SHARE * larger(load(lanes.run, END, LANES), ahead)
        h = probed(lanes, smaller(h, most), log2_tolerance)
    store(lanes.run, STEP, h)
    undecided = locate(lanes, h)
    open_lanes = (
        settle_sooner(lanes, undecided)
        if any_lane(undecided)
        else bits(refine_crossings(lanes, h, undecided))
    )
    waiting = open_lanes
    while waiting != 0:
        decide(lanes, lowest_bit(waiting), batch, slow)
        waiting &= waiting - 1
    if any_lane(ahead > 0.0):
        hold_still(lanes)
    return open_lanes | bits(advance(lanes, room, batch.rec_i.shape[0] > 0))
