"""Template of the Taylor flow: the life of a lane - filled, attended to at contacts,
samples and ends of periods, emptied.
"""

import math

from saltus.kernels.batch import Batch
from saltus.kernels.isolation import ROUNDING
from saltus.kernels.status import (
    BUDGET_EVENTS,
    BUDGET_STEPS,
    CONTACT_SPEED,
    EVENTS,
    FINISHED,
    GAP_MARGIN,
    HOLD_LAW,
    IMPACT_LAW,
    INVALID_FRICTION,
    MODE_VIOLATION,
    NONFINITE,
    NONUNIQUE,
    OK,
    PAUSED,
    RUNNING,
    STEPS,
    SURFACE_LAW,
    UNRESOLVED,
)


# -- samples and periods ---------------------------------------------------------------------------
@kernel
def write_samples(lanes, lane, batch, start, slow):
    """Write every sample that this step has passed, from its polynomial; at a node, the node's own
    state.
    """
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
    if 0 <= m < batch.sample_count.shape[0] and batch.sample_count[m] <= lanes.memo[lane, COUNT]:
        lanes.run[DUE, lane] = (batch.sample_count[m] - lanes.memo[lane, COUNT]) * batch.period[
            who
        ] + batch.sample_fraction[m] * batch.period[who]


@inner
def set_period(lanes, lane, batch, slow):
    """Set all numbers of a lane that depend on its period count: time base, phases of harmonics,
    clocks, end of the stretch, next sample.
    """
    who, count = lanes.memo[lane, WHO], lanes.memo[lane, COUNT]
    lanes.clock[BASE, lane] = batch.origin[who] + count * batch.period[who]
    if lanes.memo[lane, DRIFTS] == 1:
        turns(
            batch.param[who * batch.stride],
            batch.origin[who],
            batch.period[who],
            count,
            lane,
            lanes.clock,
        )
    lanes.run[END, lane] = (
        batch.period[who] if count < batch.end_count[who] else batch.end_phase[who]
    )
    follow_clocks(lanes, lane, batch, slow, False)
    set_due(lanes, lane, batch)


@inner
def overflowed(lanes, lane):
    """True if the step left the range of numbers; the lane then keeps the state and the time at the
    start of the step.
    """
    bad = lanes.memo[lane, BROKEN] == 1
    for i in range(NSTATES):
        bad = bad or not abs(lanes.y[i, lane]) < HUGE
    if bad:
        for i in range(NSTATES):
            lanes.y[i, lane] = lanes.work[i * (ORDER + 1), lane]
        lanes.clock[TAU, lane] = lanes.run[START, lane]
        lanes.run[TAKEN, lane] -= 1.0
    return bad


@inner
def is_slow(lanes, lane, batch):
    """True if the trajectory has gained less than it must since the last check of its pace."""
    if lanes.run[TAKEN, lane] <= lanes.run[LIMIT, lane]:
        return False
    behind = periods_behind(lanes, lane, batch)
    who = lanes.memo[lane, WHO]
    slow = not behind - lanes.run[MARK, lane] >= batch.options[who, PACE]
    lanes.run[LIMIT, lane], lanes.run[MARK, lane] = (
        lanes.run[TAKEN, lane] + batch.options[who, MOST_STEPS],
        behind,
    )
    return slow


@inner
def periods_behind(lanes, lane, batch):
    """Periods, and parts of one, since the start."""
    return lanes.memo[lane, COUNT] + lanes.clock[TAU, lane] / batch.period[lanes.memo[lane, WHO]]


@inner
def ride(lanes, lane):
    """Mark the boundaries to which a lane has kept in this step as known: it rides them. A margin
    without the terms that were set aside says nothing.
    """
    if lanes.memo[lane, DECIDED] == 0:
        lanes.memo[lane, RESTS] = 0
    aside = sets_aside(lanes, lane)
    for g in range(NGUARDS):
        if (lanes.memo[lane, RESTS] >> g) & 1 and not (aside and LAW[g] == HOLD_LAW):
            lanes.fresh[g, lane] = RIDDEN if LAWS else 1.0
    lanes.memo[lane, ALWAYS] &= lanes.memo[lane, RESTS]


@inner
def crossing_guards(lanes, lane):
    """Bits of the guards that cross at the end of this step."""
    if lanes.memo[lane, DECIDED] == 1:
        return lanes.memo[lane, HITS]
    which = int(lanes.found[WHICH, lane])
    return 1 << which if which >= 0 else 0


@inner
def attend(lanes, lane, batch, slow):
    """Attend to all events of one lane in this step. Returns its status."""
    if lanes.run[AHEAD, lane] > 0.0:
        return end_at_once(lanes, lane, batch, slow)
    start = lanes.run[START, lane]
    if overflowed(lanes, lane):
        return RUNNING if LAWS and gives_way(lanes, lane, batch, slow) else NONFINITE
    hits = crossing_guards(lanes, lane)
    if lanes.run[DUE, lane] <= lanes.clock[TAU, lane]:
        write_samples(lanes, lane, batch, start, slow)
    if lanes.memo[lane, FAULT] != 0:
        return lanes.memo[lane, FAULT]
    ride(lanes, lane)
    status = land_all(lanes, lane, batch, hits, slow) if hits != 0 else RUNNING
    if LAWS and lanes.memo[lane, FAULT] != 0:
        return lanes.memo[lane, FAULT]
    if NCLOCKS > 0 and lanes.clock[TAU, lane] >= lanes.run[WATCH, lane]:
        pass_break(lanes, lane, batch, slow)
    if status == RUNNING and lanes.clock[TAU, lane] >= lanes.run[END, lane]:
        status = end_stretch(lanes, lane, batch, slow)
    if LAWS and status == RUNNING and strays(lanes, lane, batch, slow):
        status = MODE_VIOLATION
    if status == RUNNING and is_slow(lanes, lane, batch):
        status = BUDGET_STEPS
    if status == RUNNING and lanes.run[MET, lane] >= lanes.run[MOST_MET, lane]:
        status = BUDGET_EVENTS
    lanes.memo[lane, DECIDED] = 0
    return status


# -- filling and emptying lanes --------------------------------------------------------------------
@kernel
def start_sides(lanes, lane, batch, slow):
    """Sides of all guards from the state; on a boundary the guard is fresh and the first step
    settles its side. No contact is held yet; a stop is on its allowed side. Gaps are read on the
    sides that boundaries at zero have then, on which they may depend.
    """
    for g in range(NGUARDS):
        stop = LAW[g] == IMPACT_LAW and LAW_SIDE[g] < 0.0
        lanes.side[g, lane] = -1.0 if stop or LAW[g] == HOLD_LAW else 1.0
        lanes.fresh[g, lane] = 0.0
    gaps_here(lanes, lane, batch, slow)
    moves, on = False, slides_on(lanes, lane, batch, slow) if LAWS else 0
    for i in range(NSTATES):
        moves = moves or lanes.y[i, lane] != 0.0
    for g in range(NGUARDS):
        zero = begins_at_zero(g, slow) or (on >> g) & 1 == 1
        past = LAW[g] == IMPACT_LAW and slow.gaps[g] * LAW_SIDE[g] < 0.0
        slides = LAW[g] == SURFACE_LAW
        doubtful = moves and slow.gaps[g] != 0.0 and not past and not slides
        lanes.side[g, lane] = -1.0 if slow.gaps[g] < 0.0 else 1.0
        lanes.fresh[g, lane] = (DOUBTFUL if doubtful else 1.0) if zero else 0.0
        lanes.memo[lane, ALWAYS] |= (1 if zero else 0) << g
        if LAW[g] == HOLD_LAW:
            lanes.side[g, lane], lanes.fresh[g, lane] = -1.0, 0.0
        if LAW[g] == IMPACT_LAW and zero:
            lanes.side[g, lane] = LAW_SIDE[g]
    if LAWS:
        watch(lanes, lane)
        if not begins_uniquely(lanes, lane, batch, slow):
            lanes.memo[lane, FAULT] = NONUNIQUE
        for i in range(NSTATES):
            slow.state[i] = lanes.y[i, lane]
        if LEVELS and pushes_on(lanes, lane, batch, time_of_law(lanes, lane, batch), slow):
            lanes.memo[lane, FAULT] = INVALID_FRICTION
        for g in range(NGUARDS):
            slow_here = abs(slow.gaps[3 * NGUARDS + g]) <= ROUNDING * slow.gaps[5 * NGUARDS + g]
            if LAW[g] == IMPACT_LAW and begins_at_zero(g, slow) and slow_here:
                ask_for_paradox(lanes, lane, g, slow)
    lanes.run[STARTING, lane] = 1.0
    lanes.run[LANDED, lane] = lanes.clock[TAU, lane] + lanes.clock[BASE, lane]
    if LAWS:
        rest_at_once(lanes, lane, batch, moves, slow)
        stick_at_once(lanes, lane, batch, slow)


@inner
def is_at_end(who, batch):
    """True if a trajectory is at the end of its run."""
    return batch.count[who] >= batch.end_count[who] and batch.phase[who] >= batch.end_phase[who]


@kernel
def fill(lanes, lane, who, batch, slow):
    """Load a trajectory into a lane."""
    lanes.memo[lane, :] = 0
    lanes.memo[lane, WHO], lanes.memo[lane, COUNT] = who, batch.count[who]
    constants(batch.param[who * batch.stride], lanes.c, lane)
    drifts = turns(
        batch.param[who * batch.stride],
        batch.origin[who],
        batch.period[who],
        batch.count[who],
        lane,
        lanes.clock,
    )
    lanes.memo[lane, DRIFTS] = 1 if drifts else 0
    lanes.clock[TAU, lane] = batch.phase[who]
    set_period(lanes, lane, batch, slow)
    lanes.run[TAKEN, lane] = batch.counters[who, STEPS]
    lanes.run[MET, lane], lanes.run[SHALLOW, lane] = (
        batch.counters[who, EVENTS],
        batch.counters[who, UNRESOLVED],
    )
    lanes.run[LEAST, lane], lanes.run[SLOWEST, lane] = (
        batch.minima[who, GAP_MARGIN],
        batch.minima[who, CONTACT_SPEED],
    )
    lanes.run[BOUNCES, lane], lanes.run[STARTING, lane], lanes.run[FLIPPED, lane] = 0.0, 0.0, 0.0
    lanes.run[CAUSE, lane], lanes.run[DATED, lane] = -1.0, 0.0
    begun = batch.mode[who] >= 0
    lanes.run[AHEAD, lane] = batch.period[who] if begun and is_at_end(who, batch) else 0.0
    lanes.run[ACTIVE, lane] = 1.0
    lanes.run[TOLERANCE, lane] = batch.options[who, LOG2_TOLERANCE]
    lanes.run[MOST_MET, lane] = batch.options[who, MOST_CONTACTS]
    for i in range(NSTATES):
        lanes.y[i, lane] = batch.state[who, i]
    for g in range(NGUARDS):
        lanes.prior[PRIOR_ROWS * g + NEW, lane] = batch.carry[who, CARRIED + g]
    if LEVELS:
        levels(0.0, slow.state, batch.param[who * batch.stride], slow.held, -1, slow.out)
        lanes.memo[lane, MAY_PUSH] = 1 if slow.out[0] < 0.0 else 0
    if batch.mode[who] < 0:
        lanes.run[LIMIT, lane], lanes.run[MARK, lane] = (
            batch.options[who, MOST_STEPS],
            periods_behind(lanes, lane, batch),
        )
        start_sides(lanes, lane, batch, slow)
        if lanes.run[DUE, lane] <= lanes.clock[TAU, lane]:
            write_samples(lanes, lane, batch, lanes.clock[TAU, lane], slow)
        return
    for g in range(NGUARDS):
        lanes.side[g, lane] = 1.0 if (batch.mode[who] >> g) & 1 else -1.0
        lanes.fresh[g, lane] = 1.0 if (batch.fresh[who] >> g) & 1 else 0.0
        if LAWS:
            lanes.fresh[g, lane] = batch.carry[who, CARRIED + NGUARDS + g]
    if LAWS:
        watch(lanes, lane)
    lanes.run[LANDED, lane] = batch.carry[who, 0]
    lanes.run[BOUNCES, lane], lanes.run[STARTING, lane] = batch.carry[who, 1], batch.carry[who, 2]
    lanes.run[FLIPPED, lane], lanes.run[LIMIT, lane], lanes.run[MARK, lane] = (
        batch.carry[who, 3],
        batch.carry[who, 4],
        batch.carry[who, 5],
    )
    lanes.run[CAUSE, lane] = batch.carry[who, 6]
    lanes.memo[lane, ALWAYS] = int(batch.carry[who, 7])
    lanes.run[DATED, lane] = batch.carry[who, 8]
    for j in range(NCOLUMNS):
        lanes.run[DATES + j, lane] = batch.carry[who, DATES_CARRIED + j]


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
    for g in range(NGUARDS):
        batch.carry[who, CARRIED + g] = lanes.prior[PRIOR_ROWS * g + NEW, lane]
        if LAWS:
            batch.carry[who, CARRIED + NGUARDS + g] = lanes.fresh[g, lane]
    batch.carry[who, 0] = lanes.run[LANDED, lane]
    batch.carry[who, 1], batch.carry[who, 2] = lanes.run[BOUNCES, lane], lanes.run[STARTING, lane]
    batch.carry[who, 3], batch.carry[who, 4], batch.carry[who, 5] = (
        lanes.run[FLIPPED, lane],
        lanes.run[LIMIT, lane],
        lanes.run[MARK, lane],
    )
    batch.carry[who, 6] = lanes.run[CAUSE, lane]
    batch.carry[who, 7] = lanes.memo[lane, ALWAYS]
    batch.carry[who, 8] = lanes.run[DATED, lane]
    for j in range(NCOLUMNS):
        batch.carry[who, DATES_CARRIED + j] = lanes.run[DATES + j, lane]
    batch.counters[who, STEPS] = int(lanes.run[TAKEN, lane])
    batch.counters[who, EVENTS], batch.counters[who, UNRESOLVED] = (
        int(lanes.run[MET, lane]),
        int(lanes.run[SHALLOW, lane]),
    )
    batch.minima[who, GAP_MARGIN], batch.minima[who, CONTACT_SPEED] = (
        lanes.run[LEAST, lane],
        lanes.run[SLOWEST, lane],
    )
    lanes.run[ACTIVE, lane] = 0.0
    lanes.memo[lane, WHO] = -1


@kernel
def refill(lanes, lane, cursor, batch, slow):
    """Give an idle lane the next trajectory that wants to run; returns the next place to search."""
    while cursor < batch.status.shape[0]:
        if batch.status[cursor] == RUNNING:
            if batch.mode[cursor] < 0 and is_at_end(cursor, batch):
                batch.status[cursor] = OK
            else:  # one that was paused at its end goes on to look beyond it
                fill(lanes, lane, cursor, batch, slow)
                if not (LAWS and lanes.memo[lane, FAULT] != 0):
                    return cursor + 1
                empty(lanes, lane, batch, lanes.memo[lane, FAULT])
        cursor += 1
    return cursor


# -- the whole batch -------------------------------------------------------------------------------
@entry
def propagate(
    period, origin, param, stride, state, count, phase, mode, fresh, carry, status, end_count,
    end_phase, counters, minima, sample_count, sample_fraction, cursor, samples, sample_mode,
    rec_first, rec_i, rec_f, rec_used, options, data, budget, lane_y, lane_side, lane_fresh,
    lane_clock, lane_c, lane_work, lane_bounds, lane_prior, lane_poly, lane_run, lane_found,
    lane_probe_y, lane_probe_clock, lane_probe_rate, lane_memo, slow_q, slow_b, slow_bounds,
    slow_rates, slow_out, slow_gaps, slow_state, slow_touches, slow_held, slow_numbers,
):  # fmt: skip
    """Move every trajectory whose status is RUNNING to its end, in `budget` steps of the lanes at
    most. See flow/engine.py for the arrays.
    """
    batch = Batch(
        period, origin, param, stride, state, count, phase, mode, fresh, carry, status, end_count,
        end_phase, counters, minima, sample_count, sample_fraction, cursor, samples, sample_mode,
        rec_first, rec_i, rec_f, rec_used, options, data,
    )  # fmt: skip
    lanes = Lanes(
        lane_y, lane_side, lane_fresh, lane_clock, lane_c, lane_work, lane_bounds, lane_prior,
        lane_poly, lane_run, lane_found, lane_probe_y, lane_probe_clock, lane_probe_rate, lane_memo,
    )  # fmt: skip
    slow = Slow(
        slow_q, slow_b, slow_bounds, slow_rates, slow_out, slow_gaps, slow_state, slow_touches,
        slow_held, slow_numbers,
    )  # fmt: skip
    roomy = rec_i.shape[0] - STEP_RECORDS
    following = 0
    busy = 0
    store(lanes.run, END, splat(1.0, LANES))
    store(lanes.run, ACTIVE, splat(0.0, LANES))
    store(lanes.run, BREAK, splat(math.inf, LANES))
    store(lanes.run, WATCH, splat(math.inf, LANES))
    store(lanes.clock, TAU, splat(0.0, LANES))
    lanes.memo[:, WHO] = -1
    for lane in range(LANES):
        following = refill(lanes, lane, following, batch, slow)
        busy += lanes.run[ACTIVE, lane] > 0.5
    while busy > 0 and budget > 0 and (rec_i.shape[0] == 0 or rec_used[0] <= roomy):
        budget -= 1
        attention = step_all(lanes, batch, slow)
        if LEVELS:
            attention |= watch_friction(lanes, batch, slow)
        while attention != 0:
            lane = lowest_bit(attention)
            attention &= attention - 1
            outcome = attend(lanes, lane, batch, slow)
            if outcome != RUNNING:
                empty(lanes, lane, batch, outcome)
                following = refill(lanes, lane, following, batch, slow)
                busy -= lanes.run[ACTIVE, lane] < 0.5
    for lane in range(LANES):
        if lanes.run[ACTIVE, lane] > 0.5:
            empty(lanes, lane, batch, RUNNING)
    return FINISHED if busy == 0 else PAUSED
