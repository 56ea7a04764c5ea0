"""Template: the Taylor flow in lanes. codegen puts a generated head before this text; see codegen/module.py for the names it supplies.

One step of all lanes reads: jets -> step length -> locate contacts -> advance -> attend to the lanes where something happened (a contact,
the end of a period, a sample, the end). Everything up to `attend` is arithmetic on lanes without branches on their contents, or with
branches that only skip work; so a trajectory's digits don't depend on its neighbours.

Symbols
-------
N = ORDER; y_k Taylor coefficient k of state y; g gap; s = +1/-1 the side of a guard that the mode says; P(d) = s*g along the step, d the
time since its start; h step length; T forcing period; tau phase in [0, T); c parameter-only constants of each lane.
A guard is *fresh* while its lane stands exactly on the boundary: P(0) = 0, and that known root is divided out.
"""

import math
from collections import namedtuple

import numpy as np

from saltus.kernels.isolation import (
    AT,
    CROSSES,
    DEEPEST,
    MARGIN,
    NO_CROSSING,
    TOUCH_AT,
    TOUCHES,
    first_crossing,
    leading_sign,
)
from saltus.kernels.lanes import (
    any_lane,
    bits,
    coarse_exp2,
    coarse_log2,
    fma,
    larger,
    load,
    magnitude,
    root,
    select,
    smaller,
    splat,
    store,
)
from saltus.kernels.status import (
    BUDGET_EVENTS,
    BUDGET_STEPS,
    CONTACT_SPEED,
    CROSSING,
    EVENTS,
    FINISHED,
    GAP_MARGIN,
    GRAZE,
    GRAZE_SHALLOW,
    GRAZE_UNRESOLVED,
    GRAZES,
    NONFINITE,
    OK,
    PAUSED,
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
    RESTING,
    RUNNING,
    SLIDING,
    STEPS,
    UNRESOLVED,
    VIOLATIONS,
)

# Rows of `clock`: phase, time at phase zero, then one phase offset for each harmonic of the forcing.
TAU, BASE, TURN = 0, 1, 2
# Rows of `run`: the phase at which the current stretch ends, the next sample's phase, steps taken, smallest gap margin, active (0/1), the
# step length, the phase at its start, time of the last landing.
END, DUE, TAKEN, LEAST, ACTIVE, STEP, START, LANDED = range(8)
RUN_ROWS = 8
# Rows of `bounds`, for each series that a gap reads (see bound_series).
LINEAR, QUADRATIC, CUBIC, CHANGE, REST, BOUNDS = range(6)
# Rows of `found`: time to the event or end of step, rate of the gap there, guard (-1: none).
DELTA, RATE, WHICH = range(3)
# Columns of `memo`: trajectory, periods, contacts in a row without time passing, whether its mode at the start is still being settled,
# whether the slow path has decided this step, guards that it found to cross (bits), guards on which the state rests (bits), and the
# tangency that it saw (guard + 1, kind).
WHO, COUNT, BOUNCES, STARTING, DECIDED, HITS, RESTS, TOUCHED, TOUCH_KIND = range(9)
MEMO = 9
# Columns of `carry`, what a paused lane needs besides its state: LANDED, BOUNCES, STARTING.
CARRY = 3
#: Times within this many ulp are one event (EVENTS.md, rule 6).
COINCIDENT = 10.0 * 2.220446049250313e-16
#: Rounds of flips at one instant before the contact is given up as sliding (EVENTS.md, rule 6).
MOST_BOUNCES = 100
#: Rounding error of a gap, in units of its terms.
NOISE = 4.0 * 2.220446049250313e-16
HUGE = 1.0e300

Lanes = namedtuple("Lanes", "y side fresh clock c work bounds poly run found memo")
Slow = namedtuple("Slow", "q b bounds rates out gaps state touch")
Batch = namedtuple(
    "Batch",
    "period origin param stride state count phase mode fresh carry status end_count end_phase counters minima "
    "sample_count sample_fraction cursor samples sample_mode rec_first rec_i rec_f rec_used options",
)


# -- one step of all lanes -------------------------------------------------------------------------------------------------------------
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
            nearest, chosen_row, chosen_s = select(crosses, a0, nearest), select(crosses, float(row), chosen_row), select(crosses, s, chosen_s)
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


# -- the slow path: one lane that the quadratic bound could not settle ----------------------------------------------------------------
@kernel
def scaled_gap(lanes, lane, g, h, slow):
    """P on [0, 1] of one lane into slow.q, the known root divided out; returns the rounding error of the gap."""
    s = lanes.side[g, lane]
    slow.q[0] = s * lanes.work[GAP_ROW + g, lane]
    scale = s * GUARD_SIGN[g]
    for k in range(1, ORDER + 1):
        scale *= h
        slow.q[k] = scale * lanes.work[GUARD_ROW[g] + k, lane]
    if lanes.fresh[g, lane] > 0.5:
        for k in range(ORDER):
            slow.q[k] = slow.q[k + 1]
        slow.q[ORDER] = 0.0
    return NOISE * lanes.work[SCALE_ROW + g, lane]


@kernel
def gap_rate(lanes, lane, g, d):
    """d(s*g)/dt at time d into the step."""
    value = ORDER * lanes.work[GUARD_ROW[g] + ORDER, lane]
    for k in range(ORDER - 1, 0, -1):
        value = value * d + k * lanes.work[GUARD_ROW[g] + k, lane]
    return value * GUARD_SIGN[g] * lanes.side[g, lane]


@kernel
def first_place(lanes, lane, g, h, slow):
    """Time into the step at which gap g crosses first, beyond h if it doesn't; notes tangencies and rest in `memo`."""
    noise = scaled_gap(lanes, lane, g, h, slow)
    fresh = lanes.fresh[g, lane] > 0.5
    sign = leading_sign(slow.q, ORDER)
    if sign < 0:
        return 0.0  # on the wrong side from the start of the step on
    if sign == 0:
        lanes.memo[lane, RESTS] |= 1 << g
        return 2.0 * h
    slow.out[MARGIN] = lanes.run[LEAST, lane]
    if not fresh and slow.q[0] == 0.0:  # a node on the boundary that turns back: a tangency at the node
        note_first_touch(lanes, lane, g, 0.0, GRAZE, slow)
        slow.out[MARGIN] = 0.0
    crossing, touched = first_crossing(slow.q, ORDER, fresh, noise, slow.b, slow.bounds, slow.rates, slow.out)
    if touched != NO_CROSSING:
        note_first_touch(lanes, lane, g, slow.out[TOUCH_AT] * h, GRAZE if touched == TOUCHES else GRAZE_SHALLOW, slow)
    lanes.run[LEAST, lane] = slow.out[MARGIN]
    return slow.out[AT] * h if crossing == CROSSES else 2.0 * h


@kernel
def note_first_touch(lanes, lane, g, at, kind, slow):
    """Keep the earliest tangency of this step."""
    if lanes.memo[lane, TOUCHED] == 0 or at < slow.touch[0]:
        lanes.memo[lane, TOUCHED], lanes.memo[lane, TOUCH_KIND] = g + 1, kind
        slow.touch[0] = at


@kernel
def decide(lanes, lane, batch, slow):
    """Settle one lane's step by isolating the roots of all its gaps; writes DELTA, and the guards that cross to memo[HITS]."""
    h = lanes.run[STEP, lane]
    now = abs(lanes.clock[TAU, lane] + lanes.clock[BASE, lane])
    first, hits = h, 0
    lanes.memo[lane, DECIDED], lanes.memo[lane, TOUCHED], lanes.memo[lane, RESTS] = 1, 0, 0
    for g in range(NGUARDS):
        at = first_place(lanes, lane, g, h, slow)
        if at <= h:
            if hits != 0 and abs(at - first) <= COINCIDENT * now:
                hits |= 1 << g
            elif hits == 0 or at < first:
                hits, first = 1 << g, at
    lanes.found[DELTA, lane] = first
    lanes.memo[lane, HITS] = hits
    if lanes.memo[lane, TOUCHED] > 0 and slow.touch[0] <= first:
        note_touch(lanes, lane, batch, slow)


# -- attending to one lane --------------------------------------------------------------------------------------------------------------
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
    """States of a lane at time d into the step that its jets belong to."""
    for i in range(NSTATES):
        value = lanes.work[i * (ORDER + 1) + ORDER, lane]
        for k in range(ORDER - 1, -1, -1):
            value = value * d + lanes.work[i * (ORDER + 1) + k, lane]
        out[i] = value


@inner
def record(lanes, lane, batch, tau, g, direction, velocity, kind, before, after, error, state):
    """Append a contact to the records of its trajectory, if it is wanted."""
    who = lanes.memo[lane, WHO]
    if batch.rec_i.shape[0] == 0 or lanes.memo[lane, COUNT] < batch.rec_first[who]:
        return
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
    """Local error of a contact's time: rounding error of the gap over its rate, and of the clock."""
    if rate == 0.0:
        return math.inf
    return NOISE * lanes.work[SCALE_ROW + g, lane] / abs(rate) + 2.0e-16 * (tau + abs(lanes.clock[BASE, lane]))


@kernel
def note_touch(lanes, lane, batch, slow):
    """Count and record the tangency that the slow path saw."""
    g, who, kind, d = lanes.memo[lane, TOUCHED] - 1, lanes.memo[lane, WHO], lanes.memo[lane, TOUCH_KIND], slow.touch[0]
    state_at(lanes, lane, d, slow.state)
    mode, side = mode_of(lanes, lane), int(lanes.side[g, lane])
    batch.counters[who, GRAZES if kind == GRAZE else UNRESOLVED] += 1
    curve = 2.0 * abs(lanes.work[GUARD_ROW[g] + 2, lane])
    noise = NOISE * lanes.work[SCALE_ROW + g, lane]
    error = math.sqrt(2.0 * noise / curve) if curve > 0.0 else math.inf
    velocity = gap_rate(lanes, lane, g, d) * side
    record(lanes, lane, batch, lanes.clock[TAU, lane] + d, g, side, velocity, kind, mode, mode, error, slow.state)


@inner
def land(lanes, lane, batch, g, rate, slow):
    """One contact: snap the state to the boundary, change the side, make the guard fresh, count and record."""
    who = lanes.memo[lane, WHO]
    before = mode_of(lanes, lane)
    if SNAP_STATE[g] >= 0:
        lanes.y[SNAP_STATE[g], lane] = lanes.c[SNAP_CONST[g], lane]
    velocity = rate * lanes.side[g, lane]
    lanes.side[g, lane] = -lanes.side[g, lane]
    lanes.fresh[g, lane] = 1.0
    if lanes.memo[lane, STARTING] == 1 or lanes.memo[lane, BOUNCES] > 1:
        return  # the side at the start is an initial condition; a return with no time passed was recorded when it came first
    shallow = rate * rate <= 4.0 * NOISE * lanes.work[SCALE_ROW + g, lane] * abs(lanes.work[GUARD_ROW[g] + 2, lane])
    batch.counters[who, EVENTS] += 1
    if shallow:
        batch.counters[who, UNRESOLVED] += 1
    batch.minima[who, CONTACT_SPEED] = min(batch.minima[who, CONTACT_SPEED], abs(rate))
    for i in range(NSTATES):
        slow.state[i] = lanes.y[i, lane]
    tau, direction = lanes.clock[TAU, lane], int(lanes.side[g, lane])
    kind = GRAZE_SHALLOW if shallow else CROSSING
    error = time_error(lanes, lane, g, rate, tau)
    record(lanes, lane, batch, tau, g, direction, velocity, kind, before, mode_of(lanes, lane), error, slow.state)


@inner
def land_all(lanes, lane, batch, hits, slow):
    """Every contact at the end of this step, together. Returns the status."""
    who, d = lanes.memo[lane, WHO], lanes.found[DELTA, lane]
    now = lanes.clock[TAU, lane] + lanes.clock[BASE, lane]
    if d > 0.0 or now != lanes.run[LANDED, lane]:
        lanes.memo[lane, BOUNCES], lanes.memo[lane, STARTING], lanes.run[LANDED, lane] = 0, 0, now
    else:
        lanes.memo[lane, BOUNCES] += 1
    for g in range(NGUARDS):
        if (hits >> g) & 1:
            noise = NOISE * lanes.work[SCALE_ROW + g, lane]
            if d == 0.0 and lanes.fresh[g, lane] < 0.5 and lanes.work[GAP_ROW + g, lane] * lanes.side[g, lane] < -noise:
                batch.counters[who, VIOLATIONS] += 1
            rate = gap_rate(lanes, lane, g, d) if lanes.memo[lane, DECIDED] == 1 else lanes.found[RATE, lane]
            land(lanes, lane, batch, g, rate, slow)
    if lanes.memo[lane, BOUNCES] > MOST_BOUNCES:
        return SLIDING
    return BUDGET_EVENTS if batch.counters[who, EVENTS] >= batch.options[2] else RUNNING


@kernel
def write_samples(lanes, lane, batch, start, slow):
    """Write every sample that this step has passed, from its polynomial; at a node, the node's own state."""
    who, count = lanes.memo[lane, WHO], lanes.memo[lane, COUNT]
    tau, period = lanes.clock[TAU, lane], batch.period[who]
    m = batch.cursor[who]
    while m < batch.sample_count.shape[0]:
        due = (batch.sample_count[m] - count) * period + batch.sample_fraction[m] * period
        if due > tau or batch.sample_count[m] > count:
            break
        if due == tau:
            for i in range(NSTATES):
                batch.samples[who, m, i] = lanes.y[i, lane]
        else:
            state_at(lanes, lane, due - start, batch.samples[who, m])
        batch.sample_mode[who, m] = mode_of(lanes, lane)
        m += 1
    batch.cursor[who] = m
    set_due(lanes, lane, batch)


@inner
def set_due(lanes, lane, batch):
    """Phase of the next sample in this period, infinite if there is none."""
    who, m = lanes.memo[lane, WHO], batch.cursor[lanes.memo[lane, WHO]]
    lanes.run[DUE, lane] = math.inf
    if m < batch.sample_count.shape[0] and batch.sample_count[m] <= lanes.memo[lane, COUNT]:
        lanes.run[DUE, lane] = (batch.sample_count[m] - lanes.memo[lane, COUNT]) * batch.period[who] + batch.sample_fraction[m] * batch.period[who]


@inner
def set_period(lanes, lane, batch):
    """Everything of a lane that depends on its period count: time base, phases of harmonics, end of the stretch, next sample."""
    who, count = lanes.memo[lane, WHO], lanes.memo[lane, COUNT]
    lanes.clock[BASE, lane] = batch.origin[who] + count * batch.period[who]
    turns(batch.param[who * batch.stride], batch.origin[who], batch.period[who], count, lane, lanes.clock)
    lanes.run[END, lane] = batch.period[who] if count < batch.end_count[who] else batch.end_phase[who]
    set_due(lanes, lane, batch)


@kernel
def final_contacts(lanes, lane, batch, slow):
    """A gap that is exactly zero, or past zero by rounding, at the very end is an event there, reported once."""
    for i in range(NSTATES):
        slow.state[i] = lanes.y[i, lane]
    gaps(lanes.clock[TAU, lane] + lanes.clock[BASE, lane], slow.state, batch.param[lanes.memo[lane, WHO] * batch.stride], slow.gaps)
    for g in range(NGUARDS):
        if lanes.fresh[g, lane] < 0.5 and slow.gaps[g] * lanes.side[g, lane] <= 0.0:
            land(lanes, lane, batch, g, gap_rate(lanes, lane, g, lanes.found[DELTA, lane]), slow)


@inner
def end_stretch(lanes, lane, batch, slow):
    """The end of a period, or of the run. Returns the status."""
    who = lanes.memo[lane, WHO]
    if lanes.memo[lane, COUNT] < batch.end_count[who]:
        lanes.memo[lane, COUNT] += 1
        lanes.clock[TAU, lane] = 0.0
        set_period(lanes, lane, batch)
        if lanes.run[DUE, lane] <= 0.0:
            write_samples(lanes, lane, batch, 0.0, slow)
    if lanes.memo[lane, COUNT] < batch.end_count[who] or lanes.clock[TAU, lane] < batch.end_phase[who]:
        return RUNNING
    final_contacts(lanes, lane, batch, slow)
    if lanes.memo[lane, RESTS] != 0:
        return RESTING
    return GRAZE_UNRESOLVED if batch.counters[who, UNRESOLVED] > 0 else OK


@inner
def overflowed(lanes, lane):
    """Whether the step left the range of numbers; the lane then keeps the state at the start of the step."""
    bad = False
    for i in range(NSTATES):
        bad = bad or not abs(lanes.y[i, lane]) < HUGE
    if bad:
        for i in range(NSTATES):
            lanes.y[i, lane] = lanes.work[i * (ORDER + 1), lane]
    return bad


@inner
def crossing_guards(lanes, lane):
    """Bits of the guards that cross at the end of this step."""
    if lanes.memo[lane, DECIDED] == 1:
        return lanes.memo[lane, HITS]
    which = int(lanes.found[WHICH, lane])
    return 1 << which if which >= 0 else 0


@inner
def attend(lanes, lane, batch, slow):
    """Everything that happened to one lane in this step. Returns its status."""
    start = lanes.run[START, lane]
    if overflowed(lanes, lane):
        return NONFINITE
    hits = crossing_guards(lanes, lane)
    if lanes.run[DUE, lane] <= lanes.clock[TAU, lane]:
        write_samples(lanes, lane, batch, start, slow)
    status = land_all(lanes, lane, batch, hits, slow) if hits != 0 else RUNNING
    for g in range(NGUARDS):
        if (lanes.memo[lane, RESTS] >> g) & 1:
            lanes.fresh[g, lane] = 1.0
    if status == RUNNING and lanes.clock[TAU, lane] >= lanes.run[END, lane]:
        status = end_stretch(lanes, lane, batch, slow)
    if status == RUNNING and lanes.run[TAKEN, lane] > batch.options[1]:
        status = BUDGET_STEPS
    lanes.memo[lane, DECIDED] = 0
    return status


# -- filling and emptying lanes -------------------------------------------------------------------------------------------------------------
@kernel
def start_sides(lanes, lane, batch, slow):
    """Sides of all guards from the state; on a boundary the guard is fresh and its side is settled by the first step."""
    gaps(lanes.clock[TAU, lane] + lanes.clock[BASE, lane], slow.state, batch.param[lanes.memo[lane, WHO] * batch.stride], slow.gaps)
    for g in range(NGUARDS):
        lanes.side[g, lane] = -1.0 if slow.gaps[g] < 0.0 else 1.0
        lanes.fresh[g, lane] = 1.0 if slow.gaps[g] == 0.0 else 0.0
    lanes.memo[lane, STARTING] = 1
    lanes.run[LANDED, lane] = lanes.clock[TAU, lane] + lanes.clock[BASE, lane]


@kernel
def fill(lanes, lane, who, batch, slow):
    """Load a trajectory into a lane."""
    lanes.memo[lane, :] = 0
    lanes.memo[lane, WHO], lanes.memo[lane, COUNT] = who, batch.count[who]
    constants(batch.param[who * batch.stride], lanes.c, lane)
    lanes.clock[TAU, lane] = batch.phase[who]
    set_period(lanes, lane, batch)
    lanes.run[TAKEN, lane] = batch.counters[who, STEPS]
    lanes.run[LEAST, lane] = batch.minima[who, GAP_MARGIN]
    lanes.run[ACTIVE, lane] = 1.0
    for i in range(NSTATES):
        lanes.y[i, lane] = batch.state[who, i]
        slow.state[i] = batch.state[who, i]
    if batch.mode[who] < 0:
        start_sides(lanes, lane, batch, slow)
        if lanes.run[DUE, lane] <= lanes.clock[TAU, lane]:
            write_samples(lanes, lane, batch, lanes.clock[TAU, lane], slow)
        return
    for g in range(NGUARDS):
        lanes.side[g, lane] = 1.0 if (batch.mode[who] >> g) & 1 else -1.0
        lanes.fresh[g, lane] = 1.0 if (batch.fresh[who] >> g) & 1 else 0.0
    lanes.run[LANDED, lane] = batch.carry[who, 0]
    lanes.memo[lane, BOUNCES], lanes.memo[lane, STARTING] = int(batch.carry[who, 1]), int(batch.carry[who, 2])


@kernel
def empty(lanes, lane, batch, status):
    """Write a lane back to its trajectory and leave the lane idle."""
    who = lanes.memo[lane, WHO]
    fresh = 0
    for g in range(NGUARDS):
        if lanes.fresh[g, lane] > 0.5:
            fresh |= 1 << g
    for i in range(NSTATES):
        batch.state[who, i] = lanes.y[i, lane]
        lanes.y[i, lane] = 0.0
    batch.count[who], batch.phase[who] = lanes.memo[lane, COUNT], lanes.clock[TAU, lane]
    batch.mode[who], batch.fresh[who], batch.status[who] = mode_of(lanes, lane), fresh, status
    batch.carry[who, 0] = lanes.run[LANDED, lane]
    batch.carry[who, 1], batch.carry[who, 2] = lanes.memo[lane, BOUNCES], lanes.memo[lane, STARTING]
    batch.counters[who, STEPS] = int(lanes.run[TAKEN, lane])
    batch.minima[who, GAP_MARGIN] = lanes.run[LEAST, lane]
    lanes.run[ACTIVE, lane] = 0.0
    lanes.memo[lane, WHO] = -1


@kernel
def refill(lanes, lane, cursor, batch, slow):
    """Give an idle lane the next trajectory that wants to run; returns where to look for the one after it."""
    while cursor < batch.status.shape[0]:
        if batch.status[cursor] == RUNNING:
            if batch.count[cursor] < batch.end_count[cursor] or batch.phase[cursor] < batch.end_phase[cursor]:
                fill(lanes, lane, cursor, batch, slow)
                return cursor + 1
            batch.status[cursor] = OK
        cursor += 1
    return cursor


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


def workspace():
    """The memory that one call of `propagate` works in; one set for each thread."""
    guards = max(NGUARDS, 1)
    lanes = Lanes(
        y=np.zeros((NSTATES, LANES)), side=np.ones((guards, LANES)), fresh=np.zeros((guards, LANES)), clock=np.zeros((TURN + NTURNS, LANES)),
        c=np.zeros((NCONST, LANES)), work=np.zeros((ROWS, LANES)), bounds=np.zeros((BOUNDS * max(NSERIES, 1), LANES)), poly=np.zeros((ORDER + 1, LANES)), run=np.zeros((RUN_ROWS, LANES)),
        found=np.zeros((3, LANES)), memo=np.zeros((LANES, MEMO), np.int64),
    )  # fmt: skip
    slow = Slow(
        q=np.zeros(ORDER + 1), b=np.zeros((DEEPEST + 2, ORDER + 1)), bounds=np.zeros((DEEPEST + 2, 2)), rates=np.zeros(ORDER + 1),
        out=np.zeros(3), gaps=np.zeros(guards), state=np.zeros(NSTATES), touch=np.zeros(1),
    )  # fmt: skip
    return (*lanes, *slow)


@entry
def propagate(period, origin, param, stride, state, count, phase, mode, fresh, carry, status, end_count, end_phase, counters, minima,
              sample_count, sample_fraction, cursor, samples, sample_mode, rec_first, rec_i, rec_f, rec_used, options, budget,
              lane_y, lane_side, lane_fresh, lane_clock, lane_c, lane_work, lane_bounds, lane_poly, lane_run, lane_found, lane_memo,
              slow_q, slow_b, slow_bounds, slow_rates, slow_out, slow_gaps, slow_state, slow_touch):  # fmt: skip
    """Move every trajectory whose status is RUNNING to its end, `budget` steps of the lanes at most. See flow/engine.py for the arrays."""
    batch = Batch(period, origin, param, stride, state, count, phase, mode, fresh, carry, status, end_count, end_phase, counters, minima,
                  sample_count, sample_fraction, cursor, samples, sample_mode, rec_first, rec_i, rec_f, rec_used, options)  # fmt: skip
    lanes = Lanes(lane_y, lane_side, lane_fresh, lane_clock, lane_c, lane_work, lane_bounds, lane_poly, lane_run, lane_found, lane_memo)
    slow = Slow(slow_q, slow_b, slow_bounds, slow_rates, slow_out, slow_gaps, slow_state, slow_touch)
    roomy = rec_i.shape[0] - 2 * LANES * (NGUARDS + 1)
    following = 0
    busy = 0
    for lane in range(LANES):
        lanes.run[END, lane], lanes.run[ACTIVE, lane], lanes.memo[lane, WHO] = 1.0, 0.0, -1
    for lane in range(LANES):
        following = refill(lanes, lane, following, batch, slow)
        busy += lanes.run[ACTIVE, lane] > 0.5
    while busy > 0 and budget > 0 and (roomy <= 0 or rec_used[0] <= roomy):
        budget -= 1
        attention = step_all(lanes, batch, slow)
        for lane in range(LANES):
            if (attention >> lane) & 1:
                outcome = attend(lanes, lane, batch, slow)
                if outcome != RUNNING:
                    empty(lanes, lane, batch, outcome)
                    following = refill(lanes, lane, following, batch, slow)
                    busy -= lanes.run[ACTIVE, lane] < 0.5
    for lane in range(LANES):
        if lanes.run[ACTIVE, lane] > 0.5:
            empty(lanes, lane, batch, RUNNING)
    return FINISHED if busy == 0 else PAUSED
