"""Template, 3 of 4 of the Taylor flow: contacts of one lane - settling what the quadratic bound could not, landing, recording."""

import math

from saltus.kernels.isolation import AT, CROSSES, MARGIN, NO_CROSSING, TOUCH_AT, TOUCHES, first_crossing, leading_sign
from saltus.kernels.status import (
    BUDGET_EVENTS,
    CONTACT_SPEED,
    CROSSING,
    EVENTS,
    GRAZE,
    GRAZE_SHALLOW,
    GRAZES,
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
    UNRESOLVED,
    VIOLATIONS,
)


# -- the slow path: one lane that the quadratic bound could not settle ---------------------------------------------------------
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


# -- landing -------------------------------------------------------------------------------------------------------------------
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
