"""Template of the Taylor flow: contacts of one lane - the slow path after the quadratic
bound, landing, recording. The first crossing of a step is found before, by `locate` in
taylor_crossings.
"""

import math

from saltus.kernels.isolation import (
    AT,
    MARGIN,
    MOST_TOUCHES,
    ROUNDING,
    SAME_TOUCH,
    TOUCH_AT,
    TOUCH_GUARD,
    first_crossing,
    is_exact_zero,
    is_rounding,
    leading_sign,
    polynomial,
    side_of_leaving,
    without_start,
)
from saltus.kernels.status import (
    BUDGET_EVENTS,
    CROSSING,
    GRAZE,
    GRAZE_SHALLOW,
    GRAZES,
    HOLD_LAW,
    IMPACT_LAW,
    MODE_VIOLATION,
    REC_DIRECTION,
    REC_GUARD,
    REC_KIND,
    REC_MODE_AFTER,
    REC_MODE_BEFORE,
    REC_PERIOD,
    REC_PHASE,
    REC_STEPS,
    REC_TIME_ERROR,
    REC_TRAJECTORY,
    REC_VELOCITY,
    RECORD_FLOATS,
    RUNNING,
    SLIDING,
    SURFACE_LAW,
    VIOLATIONS,
)


# -- the slow path: one lane that the quadratic bound could not settle -----------------------------
@kernel
def scaled_gap(lanes, lane, g, h, slow):
    """P on [0, 1] of one lane into slow.q, the known zeros divided out; returns the rounding error
    of the gap's terms at the start.
    """
    s = lanes.side[g, lane]
    slow.q[0] = s * lanes.work[GAP_ROW + g, lane]
    scale = s * GUARD_SIGN[g]
    for k in range(1, ORDER + 1):
        scale *= h
        slow.q[k] = scale * lanes.work[GUARD_ROW[g] + k, lane]
    known = int(lanes.fresh[g, lane])
    if known > 0:
        for k in range(ORDER + 1 - known):
            slow.q[k] = slow.q[k + known]
        for k in range(ORDER + 1 - known, ORDER + 1):
            slow.q[k] = 0.0
    return rounding_at(lanes, lane, g)


@inner
def rounding_at(lanes, lane, g):
    """Rounding error of a gap at the start of the step."""
    return ROUNDING * (lanes.work[SCALE_ROW + g, lane] + lanes.prior[PRIOR_ROWS * g + OLD, lane])


@kernel
def gap_rate(lanes, lane, g, d):
    """d(s*g)/dt at time d into the step."""
    value = ORDER * lanes.work[GUARD_ROW[g] + ORDER, lane]
    for k in range(ORDER - 1, 0, -1):
        value = value * d + k * lanes.work[GUARD_ROW[g] + k, lane]
    return value * GUARD_SIGN[g] * lanes.side[g, lane]


@kernel
def first_place(lanes, lane, g, h, beyond, slow, count):
    """Time into the step at which gap g crosses first, beyond h if it doesn't; and the number of
    touches on the list. The size of the gap's terms at h counts where it begins in rounding.
    """
    if LAWS and lanes.side[WATCHED + g, lane] < 0.5:
        return 2.0 * h, count
    noise, begins = scaled_gap(lanes, lane, g, h, slow), begins_in_rounding(lanes, lane, g)
    if begins:
        noise = max(noise, ROUNDING * beyond)
    if lanes.fresh[g, lane] == DOUBTFUL:
        begins = slow.q[0] >= -noise  # what leaves to its side meets nothing
        lanes.fresh[g, lane] = 1.0 if begins else 0.0
        noise = noise if begins else scaled_gap(lanes, lane, g, h, slow)
    known = int(lanes.fresh[g, lane])
    fresh, beside = known > 0, max(noise, allowed_beside(lanes, lane, g))
    stays_on = fresh and LAW[g] != HOLD_LAW
    if stays_on and abs(lanes.work[GAP_ROW + g, lane]) > beside:
        lanes.memo[lane, FAULT] = MODE_VIOLATION
        return 2.0 * h, count
    sign = leading_sign(slow.q, ORDER)
    if fresh and is_rounding(slow.q, ORDER, noise):
        sign = 0
    elif begins or lanes.fresh[g, lane] == RIDDEN:  # rounding doesn't leave it
        sign = side_of_leaving(slow.q, ORDER, known, noise)
    elif not fresh and sign < 0 and slow.q[0] > -noise:  # it may have reversed at the node
        sign = 1 if side_of_leaving(slow.q, ORDER, 0, noise) > 0 else -1
    holds = LAW[g] == HOLD_LAW and not sets_aside(lanes, lane)
    if sign == 0 and holds and LAW[PARTNER[g]] == SURFACE_LAW:
        return 0.0, count  # its force has gone: it holds nothing
    if sign == 0:
        lanes.memo[lane, RESTS] |= 1 << g  # it is ridden
        return 2.0 * h, count
    if sign < 0:
        return 0.0, count  # on the wrong side from the start of the step on
    slow.out[MARGIN] = lanes.run[LEAST, lane]
    # a node on the boundary that turns back: a tangency at the node
    if not fresh and slow.q[0] == 0.0:
        slow.touches[count, TOUCH_AT], slow.touches[count, TOUCH_GUARD] = 0.0, g
        slow.out[MARGIN] = 0.0
        count += 1
    before = min(count, MOST_TOUCHES - 1)
    crosses, count = first_crossing(
        slow.q,
        ORDER,
        fresh,
        noise,
        g,
        slow.b,
        slow.bounds,
        slow.rates,
        slow.out,
        slow.touches,
        before,
    )
    if not fresh and lanes.run[STARTING, lane] > 0.5:
        count = without_start(slow.q, ORDER, noise, slow.touches, before, count)
    lanes.run[LEAST, lane] = slow.out[MARGIN]
    return (slow.out[AT] * h if crosses else 2.0 * h), min(count, MOST_TOUCHES - 1)


@inner
def begins_in_rounding(lanes, lane, g):
    """True if a gap is at zero where terms of it that should cancel leave rounding: at the start of
    a run, or on a boundary that was ridden. A state less a constant has no such terms, and the
    velocity of a rebound none that cancel.
    """
    starts = lanes.run[STARTING, lane] > 0.5 or lanes.fresh[g, lane] == RIDDEN
    rebounds = LAW[g] == IMPACT_LAW and (int(lanes.run[FLIPPED, lane]) >> g) & 1 == 1
    at_zero = starts and lanes.fresh[g, lane] > 0.5 and not rebounds
    return at_zero and SNAP_STATE[g] < 0 and LAW[g] != SURFACE_LAW


@kernel
def size_beyond(lanes, lane, batch, g, h, slow):
    """Size of the terms of a gap at time h into the step: from rest they begin at zero."""
    state_at(lanes, lane, h, slow.state)
    for j in range(NGUARDS):
        slow.gaps[j] = lanes.side[j, lane]
    look_at_gaps(lanes, lane, batch, h, slow)
    return slow.gaps[SIZES * NGUARDS + g]


@inner
def allowed_beside(lanes, lane, g):
    """Distance by which rounding may carry a lane off a boundary that it keeps to."""
    return KEPT * (lanes.work[SCALE_ROW + g, lane] + lanes.prior[PRIOR_ROWS * g + OLD, lane])


@kernel
def decide(lanes, lane, batch, slow):
    """Settle one lane's step by isolating the roots of all its gaps; writes DELTA, and the guards
    that cross to memo[HITS].
    """
    h = lanes.run[STEP, lane]
    now = abs(lanes.clock[TAU, lane] + lanes.clock[BASE, lane])
    first, hits, early, count, least = h, 0, 0, 0, lanes.run[LEAST, lane]
    lanes.memo[lane, DECIDED], lanes.memo[lane, RESTS], lanes.memo[lane, HITS] = 1, 0, 0
    if is_broken(lanes, lane, h, slow):
        lanes.memo[lane, BROKEN], lanes.found[DELTA, lane] = 1, 0.0
        return
    for g in range(NGUARDS):
        beyond = 0.0
        if begins_in_rounding(lanes, lane, g):
            beyond = size_beyond(lanes, lane, batch, g, h, slow)
        at, count = first_place(lanes, lane, g, h, beyond, slow, count)
        if at == 0.0 and lanes.run[STARTING, lane] > 0.5 and lanes.fresh[g, lane] > 0.5:
            early |= 1 << g
        if at <= h:
            if hits != 0 and abs(at - first) <= COINCIDENT * now:
                hits |= 1 << g
            elif hits == 0 or at < first:
                hits, first = 1 << g, at
    if early != 0:  # how the start begins is settled before others are met
        first, hits = 0.0, early
    lanes.found[DELTA, lane] = first
    lanes.memo[lane, HITS] = hits
    if lanes.run[AHEAD, lane] > 0.0:
        lanes.run[LEAST, lane] = least
        return
    note_touches(lanes, lane, batch, slow, first, count)
    # a gap may have turned after the crossing, which it won't reach
    if first < h and lanes.run[LEAST, lane] < least:
        lanes.run[LEAST, lane] = least
        for g in range(NGUARDS if first > 0.0 else 0):
            beyond = 0.0
            if begins_in_rounding(lanes, lane, g):
                beyond = size_beyond(lanes, lane, batch, g, first, slow)
            first_place(lanes, lane, g, first, beyond, slow, 0)


@kernel
def is_broken(lanes, lane, h, slow):
    """True if a state at the end of the step, or a term of a gap, isn't a number."""
    state_at(lanes, lane, h, slow.state)
    total = 0.0
    for i in range(NSTATES):
        total += abs(slow.state[i])
    for g in range(NGUARDS):
        scaled_gap(lanes, lane, g, h, slow)
        for k in range(ORDER + 1):
            total += abs(slow.q[k])
    return not total < HUGE


@kernel
def note_touches(lanes, lane, batch, slow, first, count):
    """Count and record the tangencies up to `first`, in the order of time."""
    h = lanes.run[STEP, lane]
    for _ in range(count):
        soonest = -1
        for j in range(count):
            if slow.touches[j, TOUCH_AT] >= 0.0 and (
                soonest < 0 or slow.touches[j, TOUCH_AT] < slow.touches[soonest, TOUCH_AT]
            ):
                soonest = j
        d = slow.touches[soonest, TOUCH_AT] * h
        if d <= first:
            note_touch(
                lanes,
                lane,
                batch,
                slow,
                int(slow.touches[soonest, TOUCH_GUARD]),
                d,
                lanes.clock[TAU, lane],
            )
        slow.touches[soonest, TOUCH_AT] = -1.0


@kernel
def touches_exactly(lanes, lane, g, d, slow):
    """True if a gap is zero at d and no operation rounded: otherwise a zero is chance, and the
    touch unresolved.
    """
    if SNAP_STATE[g] >= 0:
        x, place = lanes.work[GUARD_ROW[g], lane], lanes.c[SNAP_CONST[g], lane]
        total = x - place
        part = total - x
        if (x - (total - part)) + (-place - part) != 0.0:
            return False
    slow.q[0] = lanes.work[GAP_ROW + g, lane] * (1.0 if lanes.fresh[g, lane] < 0.5 else 0.0)
    for k in range(1, ORDER + 1):
        slow.q[k] = GUARD_SIGN[g] * lanes.work[GUARD_ROW[g] + k, lane]
    return is_exact_zero(slow.q, ORDER, d)


@kernel
def touch_error(lanes, lane, g, d, slow):
    """Error of the time of a touch: the time around it in which the gap stays within its rounding
    error, up to the ends of the step.
    """
    h = lanes.run[STEP, lane]
    noise = 2.0 * scaled_gap(lanes, lane, g, h, slow)
    fresh, place = lanes.fresh[g, lane] > 0.5, d / h
    for k in range(ORDER + 1):
        noise += ROUNDING * abs(slow.q[k])
    reach = 2.0**-48
    while reach < 1.0:
        left, right = place - reach, place + reach
        before = polynomial(slow.q, ORDER, left) * (left if fresh else 1.0)
        after = polynomial(slow.q, ORDER, right) * (right if fresh else 1.0)
        if (left <= 0.0 or abs(before) > noise) and (right >= 1.0 or abs(after) > noise):
            break
        reach *= 2.0
    return reach * h


@kernel
def note_touch(lanes, lane, batch, slow, g, d, start):
    """Count and record one tangency at time d into the step that began at phase `start`: exact, or
    within the gap's rounding error. Friction that vanishes with its contact's force is none.
    """
    support = SUPPORT[PARTNER[g]] if LAW[g] == HOLD_LAW else -1
    if support >= 0 and (lanes.memo[lane, HITS] >> support) & 1:
        return
    ends = lanes.found[DELTA, lane] - d <= SAME_TOUCH * lanes.run[STEP, lane]
    if LAW[g] == HOLD_LAW and lanes.memo[lane, HITS] != 0 and ends:
        return
    who, kind = (
        lanes.memo[lane, WHO],
        GRAZE if touches_exactly(lanes, lane, g, d, slow) else GRAZE_SHALLOW,
    )
    state_at(lanes, lane, d, slow.state)
    mode, side = mode_of(lanes, lane), int(lanes.side[g, lane])
    if kind == GRAZE:
        batch.counters[who, GRAZES] += 1
    else:
        lanes.run[SHALLOW, lane] += 1.0
    if not recorded(lanes, lane, batch):
        return
    error = touch_error(lanes, lane, g, d, slow)
    velocity = gap_rate(lanes, lane, g, d) * side
    record(lanes, lane, batch, start + d, g, side, velocity, kind, mode, mode, error, slow.state)


# -- gaps at a node, clocks ------------------------------------------------------------------------
@kernel
def follow_clocks(lanes, lane, batch, slow, known):
    """Bring the clocks of a lane to their pieces at its phase, starting from its present pieces if
    they are known; set its next break.
    """
    if NCLOCKS > 0:
        who, count, base = lanes.memo[lane, WHO], lanes.memo[lane, COUNT], lanes.clock[BASE, lane]
        place_clocks(
            batch.param[who * batch.stride],
            batch.origin[who],
            batch.period[who],
            count,
            slow.numbers,
            batch.data,
        )
        for row in range(HELD * NCLOCKS):
            slow.held[row] = lanes.clock[CLOCK_ROW + row, lane]
        following = set_clocks(
            lanes.clock[TAU, lane], base, slow.numbers, batch.data, known, slow.held
        )
        for row in range(HELD * NCLOCKS):
            lanes.clock[CLOCK_ROW + row, lane] = slow.held[row]
        lanes.run[BREAK, lane] = following
        lanes.run[WATCH, lane] = (
            following - SAME_BREAK * (abs(following) + abs(base))
            if following < math.inf
            else math.inf
        )


@inner
def show_clocks(lanes, lane, slow):
    """Write the data of a lane's clocks to slow.held, for code that reads the time as one
    number.
    """
    if NCLOCKS > 0:
        for row in range(HELD * NCLOCKS):
            slow.held[row] = lanes.clock[CLOCK_ROW + row, lane]
        for j in range(NCLOCKS):
            slow.held[HELD * j + REF] += lanes.clock[BASE, lane]


@inner
def begins_at_zero(g, slow):
    """True if a gap in slow.gaps is zero, or the rounding of terms that cancel."""
    told = SNAP_STATE[g] >= 0
    return abs(slow.gaps[g]) <= (0.0 if told else ROUNDING * slow.gaps[SIZES * NGUARDS + g])


@inner
def stands_at(lanes, lane, g, slow):
    """True if a lane is known to be on a boundary whose gap is in slow.gaps: the gap's sign then
    says nothing of the side.
    """
    near = TOLD * ROUNDING * lanes.prior[PRIOR_ROWS * g + NEW, lane]
    return lanes.fresh[g, lane] > 0.5 and abs(slow.gaps[g]) <= near


@kernel
def gaps_here(lanes, lane, batch, slow):
    """All gaps at the node of a lane, to slow.gaps; for contacts that can be held also the entries
    that `gaps` writes after them, in the mode of the lane if it is on a boundary.
    """
    for i in range(NSTATES):
        slow.state[i] = lanes.y[i, lane]
    for g in range(NGUARDS):
        slow.gaps[g] = lanes.side[g, lane]
    look_at_gaps(lanes, lane, batch, 0.0, slow)
    rounded = False
    for g in range(NGUARDS if LAWS else 0):
        rounded = rounded or (slow.gaps[g] != 0.0 and stands_at(lanes, lane, g, slow))
    if rounded:
        for g in range(NGUARDS):
            known = stands_at(lanes, lane, g, slow)
            slow.gaps[g] = lanes.side[g, lane] * (KNOWN if known else 1.0)
        look_at_gaps(lanes, lane, batch, 0.0, slow)


@kernel
def look_at_gaps(lanes, lane, batch, later, slow):
    """Write the result of `gaps` for slow.state, some time later than the node, with the sides in
    slow.gaps.
    """
    show_clocks(lanes, lane, slow)
    parameters = batch.param[lanes.memo[lane, WHO] * batch.stride]
    now = (
        time_of_law(lanes, lane, batch)
        if LAWS
        else lanes.clock[TAU, lane] + lanes.clock[BASE, lane]
    )
    gaps(
        now + later,
        slow.state,
        parameters,
        slow.held,
        slow.gaps,
    )


@inner
def is_past(lanes, lane, g, slow):
    """True if a gap in slow.gaps is on the wrong side of its boundary, by more than the rounding of
    the terms of the step before.
    """
    if LAWS and lanes.side[WATCHED + g, lane] < 0.5:
        return False
    return slow.gaps[g] * lanes.side[g, lane] < -ROUNDING * lanes.prior[PRIOR_ROWS * g + NEW, lane]


@kernel
def pass_break(lanes, lane, batch, slow):
    """Bring the clocks of a lane over a break at the end of its step.

    A boundary may jump there, over the state or away from under it. The next step finds the state
    past it at once, with no step to blame: so this counts as a landing in which nothing has changed
    sides yet.
    """
    was_past, jumped = 0, False
    gaps_here(lanes, lane, batch, slow)
    for g in range(NGUARDS):
        if is_past(lanes, lane, g, slow):
            was_past |= 1 << g
    follow_clocks(lanes, lane, batch, slow, True)
    gaps_here(lanes, lane, batch, slow)
    for g in range(NGUARDS):
        if (
            lanes.fresh[g, lane] > 0.5
            and abs(slow.gaps[g]) > TOLD * ROUNDING * lanes.prior[PRIOR_ROWS * g + NEW, lane]
        ):
            lanes.fresh[g, lane] = 0.0
        jumped = jumped or (is_past(lanes, lane, g, slow) and (was_past >> g) & 1 == 0)
    if jumped and lanes.run[LANDED, lane] != lanes.clock[TAU, lane] + lanes.clock[BASE, lane]:
        note_arrival(lanes, lane)
        lanes.run[BOUNCES, lane] = -1.0


# -- landing ---------------------------------------------------------------------------------------
@inner
def mode_of(lanes, lane):
    """Mode bits of a lane."""
    mode = 0
    for g in range(NGUARDS):
        if lanes.side[g, lane] > 0.0:
            mode |= 1 << g
    return mode


@kernel
def state_at(lanes, lane, d, out):
    """States of a lane at time d into the step of its jets."""
    for i in range(NSTATES):
        value = lanes.work[i * (ORDER + 1) + ORDER, lane]
        for k in range(ORDER - 1, -1, -1):
            value = value * d + lanes.work[i * (ORDER + 1) + k, lane]
        out[i] = value


@inner
def recorded(lanes, lane, batch):
    """True if the contacts of this period are kept."""
    return (
        batch.rec_i.shape[0] > 0
        and lanes.memo[lane, COUNT] >= batch.rec_first[lanes.memo[lane, WHO]]
    )


@inner
def record(lanes, lane, batch, tau, g, direction, velocity, kind, before, after, error, state):
    """Append a contact to the records of its trajectory."""
    who = lanes.memo[lane, WHO]
    j = batch.rec_used[0]
    batch.rec_used[0] = j + 1
    batch.rec_i[j, REC_TRAJECTORY] = who
    batch.rec_i[j, REC_PERIOD] = lanes.memo[lane, COUNT]
    batch.rec_i[j, REC_GUARD] = g
    batch.rec_i[j, REC_DIRECTION] = direction
    batch.rec_i[j, REC_KIND] = kind
    batch.rec_i[j, REC_MODE_BEFORE] = before
    batch.rec_i[j, REC_MODE_AFTER] = after
    batch.rec_f[j, REC_PHASE] = tau
    batch.rec_f[j, REC_VELOCITY] = velocity
    batch.rec_f[j, REC_TIME_ERROR] = error
    batch.rec_i[j, REC_STEPS] = int(lanes.run[TAKEN, lane])
    for i in range(NSTATES):
        batch.rec_f[j, RECORD_FLOATS + i] = state[i]
    batch.rec_f[j, RECORD_FLOATS + NSTATES] = lanes.clock[BASE, lane] + tau


@inner
def time_error(lanes, lane, g, rate, tau):
    """Local error of a contact's time: truncation and rounding of the gap's terms over its rate,
    and the rounding of the clock.
    """
    if rate == 0.0:
        return math.inf
    size = lanes.prior[PRIOR_ROWS * g + NEW, lane]
    return (ROUNDING + 2.0 ** lanes.run[TOLERANCE, lane]) * size / abs(rate) + 2.0e-16 * (
        tau + abs(lanes.clock[BASE, lane])
    )


@inner
def snap(lanes, lane, g):
    """Put the state on the boundary of a guard."""
    if SNAP_STATE[g] >= 0:
        lanes.y[SNAP_STATE[g], lane] = lanes.c[SNAP_CONST[g], lane]
    if lanes.fresh[g, lane] != RIDDEN:
        lanes.fresh[g, lane] = 1.0


@inner
def land(lanes, lane, batch, g, rate, slow):
    """Land one contact: snap the state to the boundary, change the side, make the guard fresh,
    count and record. A boundary on which the state stood is left because the state came to another
    one.
    """
    before, crossed = mode_of(lanes, lane), g
    stood = lanes.found[DELTA, lane] == 0.0 and lanes.fresh[g, lane] > 0.5
    if stood and (lanes.run[CAUSE, lane] >= 0.0 or lanes.fresh[g, lane] == RIDDEN):
        crossed = int(lanes.run[CAUSE, lane])
    if lanes.fresh[g, lane] < 0.5:  # it comes from one side, no time after the start or later
        lanes.run[STARTING, lane] = 0.0
    snap(lanes, lane, g)
    change_side(lanes, lane, batch, g, rate, before, crossed, slow)


@inner
def is_shallow(lanes, lane, g, rate):
    """True if a crossing at this rate goes no deeper than the rounding error of the gap: depth =
    rate^2 / (2 curvature).
    """
    j, h = BOUNDS * GUARD_SERIES[g], lanes.run[STEP, lane]
    curvature = 2.0 * (
        abs(lanes.bounds[j + QUADRATIC, lane]) + 3.0 * abs(lanes.bounds[j + CUBIC, lane])
    )
    size = lanes.prior[PRIOR_ROWS * g + NEW, lane] + lanes.prior[PRIOR_ROWS * g + OLD, lane]
    return abs(rate) * h <= math.sqrt(2.0 * ROUNDING * size) * math.sqrt(curvature)


@inner
def jump_over(lanes, lane, batch, g, rate, slow):
    """Land one contact of a moving boundary: it jumped over the state, when that crossed another
    boundary or at a break (-1).
    """
    cause = int(lanes.run[CAUSE, lane])
    change_side(lanes, lane, batch, g, rate, mode_of(lanes, lane), cause, slow)


@inner
def change_side(lanes, lane, batch, g, rate, before, crossed, slow):
    """Change the side of a guard, after the state crossed its boundary or another one; count and
    record.
    """
    who = lanes.memo[lane, WHO]
    velocity = rate * lanes.side[g, lane]
    lanes.side[g, lane] = -lanes.side[g, lane]
    flipped, started = int(lanes.run[FLIPPED, lane]), lanes.run[STARTING, lane] < 0.5
    counted_again = ((flipped >> g) & 1) << NGUARDS
    counted_again = counted_again if started and lanes.run[BOUNCES, lane] <= 1.5 else 0
    lanes.run[FLIPPED, lane] = flipped | (1 << g) | counted_again
    # the side at the start is an initial condition, no event; a sample taken there had to guess it
    if lanes.run[STARTING, lane] > 0.5:
        for m in range(batch.cursor[who]):
            batch.sample_mode[who, m] = mode_of(lanes, lane)
        return
    if lanes.run[CAUSE, lane] < 0.0:
        lanes.run[CAUSE, lane] = float(crossed)
    if TANGENT and crossed >= 0:
        saltate(lanes, lane, batch, crossed, before, slow)
    if lanes.run[BOUNCES, lane] > 1.5:
        return  # a return with no time passed was recorded when it came first
    shallow = crossed == g and is_shallow(lanes, lane, g, rate)
    lanes.run[MET, lane] += 1.0
    if shallow:
        lanes.run[SHALLOW, lane] += 1.0
    lanes.run[SLOWEST, lane] = min(lanes.run[SLOWEST, lane], abs(rate))
    if not recorded(lanes, lane, batch):
        return
    for i in range(NSTATES):
        slow.state[i] = lanes.y[i, lane]
    tau, direction = lanes.clock[TAU, lane], int(lanes.side[g, lane])
    kind = GRAZE_SHALLOW if shallow else CROSSING
    error = time_error(lanes, lane, g, rate, tau)
    record(
        lanes,
        lane,
        batch,
        tau,
        g,
        direction,
        velocity,
        kind,
        before,
        mode_of(lanes, lane),
        error,
        slow.state,
    )


@kernel
def saltate(lanes, lane, batch, g, before, slow):
    """Apply the jump of the tangent that the states carry, at a crossing of the boundary of guard g
    out of mode `before`. Where an impact is at that instant it tells how the instant moves: it may
    have left no rate at the boundary.
    """
    for i in range(NSTATES):
        slow.state[i] = lanes.y[i, lane]
    parameters = batch.param[lanes.memo[lane, WHO] * batch.stride]
    show_clocks(lanes, lane, slow)
    load_dates(lanes, lane, slow)
    jump(
        lanes.clock[TAU, lane] + lanes.clock[BASE, lane],
        slow.state,
        parameters,
        slow.held,
        before,
        mode_of(lanes, lane),
        g,
        slow.out,
    )
    for i in range(NSTATES):
        lanes.y[i, lane] = slow.state[i]


@inner
def note_arrival(lanes, lane):
    """True if time has passed since the last landing (or the start); counts the landings at one
    instant. A flight after an impact that is too short for the clock leads to the same instant.
    """
    now = lanes.clock[TAU, lane] + lanes.clock[BASE, lane]
    later = now != lanes.run[LANDED, lane]
    arrived = lanes.found[DELTA, lane] > 0.0 or later
    if arrived:
        lanes.run[STARTING, lane], lanes.run[LANDED, lane] = 0.0, now
        lanes.run[FLIPPED, lane], lanes.run[CAUSE, lane] = 0.0, -1.0
    if later or (arrived and lanes.run[DATED, lane] == 0.0):
        lanes.run[BOUNCES, lane], lanes.run[DATED, lane] = 0.0, 0.0
    else:
        lanes.run[BOUNCES, lane] += 1.0
    return arrived


@inner
def land_all(lanes, lane, batch, hits, slow):
    """Land every contact at the end of this step, together. Returns the status.

    A gap may hold sides of other guards, or clocks, and jump when they change: the state is then
    past that boundary without having met it.
    """
    who, d = lanes.memo[lane, WHO], lanes.found[DELTA, lane]
    arrived = note_arrival(lanes, lane)
    if LAWS:  # stops before surfaces: friction holds nothing where a stop does
        hits = strike_together(lanes, lane, batch, hits, slow)
    for g in range(NGUARDS):
        if (hits >> g) & 1:
            # Newton's slope is accurate to about 1e-9
            exactly = lanes.memo[lane, DECIDED] == 1 or batch.rec_i.shape[0] > 0
            rate = gap_rate(lanes, lane, g, d) if exactly else lanes.found[RATE, lane]
            past = -lanes.side[g, lane] * lanes.work[GAP_ROW + g, lane]
            if LAWS and meet(lanes, lane, batch, g, rate, slow):
                continue
            if d == 0.0 and lanes.fresh[g, lane] < 0.5 and past > rounding_at(lanes, lane, g):
                if arrived:
                    batch.counters[who, VIOLATIONS] += 1
                    return MODE_VIOLATION
                jump_over(lanes, lane, batch, g, rate, slow)
            else:
                land(lanes, lane, batch, g, rate, slow)
    if lanes.run[BOUNCES, lane] >= MOST_BOUNCES:
        # there and back where sliding begins is one contact
        lanes.run[MET, lane] -= (int(lanes.run[FLIPPED, lane]) >> NGUARDS) & 1
        return SLIDING
    return BUDGET_EVENTS if lanes.run[MET, lane] >= lanes.run[MOST_MET, lane] else RUNNING
