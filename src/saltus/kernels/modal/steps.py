"""Template of the modal flow: steps that are proven to cross no boundary, or just one, and
the life of a trajectory.

A step is tried and halved until every gap is decided. Modes that are too fast for it are bounded:
they add at most their amplitudes to a gap, and at most |lambda| times these to its rate. A gap is
clear if its polynomial less that bound is; it crosses once if it is proven to fall all the way and
to end below zero. The place is then found by Newton's method on the modes themselves.
"""

import math

from saltus.kernels.batch import Batch
from saltus.kernels.isolation import MARGIN, MOST_TOUCHES
from saltus.kernels.lanes import load, magnitude, splat, store
from saltus.kernels.status import (
    BUDGET_EVENTS,
    BUDGET_STEPS,
    CONTACT_SPEED,
    CROSSING,
    EVENTS,
    FINISHED,
    GAP_MARGIN,
    GRAZE_UNRESOLVED,
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
    REJECTED,
    RESTING,
    RUNNING,
    STEPS,
    UNRESOLVED,
)


# -- records ---------------------------------------------------------------------------------------
@inner
def time_of(i, tau, batch):
    """Absolute time [s]."""
    return batch.origin[i] + batch.count[i] * batch.period[i] + tau


@inner
def has_room(batch, m):
    """True if the contacts of one more step fit in the table."""
    most = 2 * m.sizes[GUARDS] + MOST_TOUCHES
    return batch.rec_i.shape[0] == 0 or batch.rec_used[0] + most <= batch.rec_i.shape[0]


@kernel
def record(i, g, tau, kind, direction, velocity, after, error, batch, m):
    """Write one contact, whose state is in `state`, if there is a table and its period is kept."""
    if batch.rec_i.shape[0] == 0 or batch.count[i] < batch.rec_first[i]:
        return
    r = batch.rec_used[0]
    batch.rec_used[0] = r + 1
    batch.rec_i[r, REC_TRAJECTORY], batch.rec_i[r, REC_PERIOD] = i, batch.count[i]
    batch.rec_i[r, REC_GUARD], batch.rec_i[r, REC_KIND] = g, kind
    batch.rec_i[r, REC_DIRECTION], batch.rec_i[r, REC_STEPS] = direction, batch.counters[i, STEPS]
    batch.rec_i[r, REC_MODE_BEFORE], batch.rec_i[r, REC_MODE_AFTER] = batch.mode[i], after
    batch.rec_f[r, REC_PHASE], batch.rec_f[r, REC_VELOCITY] = tau, velocity
    batch.rec_f[r, REC_TIME_ERROR] = error
    write_state(batch.rec_f, r, RECORD_FLOATS, m)
    for j in range(m.sizes[STATES], m.sizes[STATES] + m.sizes[REMEMBERED]):
        batch.rec_f[r, RECORD_FLOATS + j] = batch.state[i, j]
    batch.rec_f[r, RECORD_FLOATS + batch.state.shape[1]] = time_of(i, tau, batch)


@inner
def state_after(i, tau, d, modes, steady, batch, m):
    """The state a time d after tau, to `state`; its amplitudes to `moved`."""
    move(modes, d, 0, m)
    drive(i, tau + d, batch, m)
    answer_now(steady, m)
    state_of(modes, m.moved, m)


@inner
def due_at(i, k, batch):
    """Time of the period at which a sample is due [s]: infinite if that isn't in this one."""
    if not 0 <= k < batch.sample_count.shape[0] or batch.sample_count[k] > batch.count[i]:
        return math.inf
    due = (batch.sample_count[k] - batch.count[i]) * batch.period[i]
    return due + batch.sample_fraction[k] * batch.period[i]


@inner
def take_samples(i, tau, until, modes, steady, batch, m):
    """Take the samples due up to a time of the period, if there are any: a call takes long."""
    if due_at(i, batch.cursor[i], batch) <= until:
        take_due(i, tau, until, modes, steady, batch, m)


@kernel
def take_due(i, tau, until, modes, steady, batch, m):
    """Take the samples due up to a time of the period from the amplitudes at tau: their states are
    written together, when the queue is full or the contact state ends.
    """
    k = batch.cursor[i]
    while due_at(i, k, batch) <= until:
        due = due_at(i, k, batch)
        states = m.sizes[STATES]
        if due == tau and has_just_landed(i, tau, batch):
            for j in range(states):
                batch.samples[i, k, j] = batch.state[i, j]
        elif block_groups(modes, m) > 0:
            state_after(i, tau, due - tau, modes, steady, batch, m)
            for j in range(states):
                batch.samples[i, k, j] = m.state[j // LANES, j % LANES]
        else:
            put_off(i, k, tau, due - tau, modes, steady, batch, m)
        for j in range(states, states + m.sizes[REMEMBERED]):
            batch.samples[i, k, j] = batch.state[i, j]
        if m.sizes[TANGENTS] != 0:
            at, columns = int(batch.carry[i, AT]), m.sizes[TANGENTS]
            columns_after(i, at, due, batch.carry[i, WAITED] + (due - tau), batch, m)
            for j in range(states * columns):
                batch.samples[i, k, states + j] = m.columns[j // columns, j % columns]
        batch.sample_mode[i, k] = batch.mode[i]
        k += 1
    batch.cursor[i] = k


@inner
def put_off(i, k, tau, d, modes, steady, batch, m):
    """Put the amplitudes of a sample a time d after tau, and the answer, into the queue."""
    if m.queued[0] == QUEUE:
        write_queue(i, k, modes, batch, m)
    move(modes, d, 0, m)
    drive(i, tau + d, batch, m)
    answer_now(steady, m)
    width = 2 * m.sizes[MODE_GROUPS]
    row = m.queued[0] * (2 * width + m.sizes[STATE_GROUPS])
    for g in range(width):
        store(m.queue, row + g, load(m.moved, g, LANES))
    if coordinates_of(modes, m) > 0:
        rates_of_waves(modes, m.moved, m)
        for g in range(width):
            store(m.queue, row + width + g, load(m.rates, g, LANES))
    for s in range(m.sizes[STATE_GROUPS]):
        store(m.queue, row + 2 * width + s, load(m.answer, s, LANES))
    m.queued[0] += 1


@kernel
def write_queue(i, k, modes, batch, m):
    """Write the samples in the queue, the last ones before sample k: all of them for one group of
    states after the other, whose part of the table stays near.
    """
    width, states, count = 2 * m.sizes[MODE_GROUPS], m.sizes[STATES], m.queued[0]
    if count == 0:
        return
    m.queued[0] = 0
    coordinates = coordinates_of(modes, m)
    if coordinates > 0:
        write_shapes(i, k - count, count, modes, coordinates, batch, m)
        return
    for s in range(m.sizes[STATE_GROUPS]):
        for p in range(count):
            row = p * (2 * width + m.sizes[STATE_GROUPS])
            answer = load(m.queue, row + 2 * width + s, LANES)
            store(m.sums, 0, group_of_states(s, modes, m.queue, row, answer, m))
            for j in range(min(LANES, states - LANES * s)):
                batch.samples[i, k - count + p, LANES * s + j] = m.sums[0, j]


@kernel
def write_shapes(i, first, count, modes, coordinates, batch, m):
    """The same for samples of coordinates and rates, from the first one on."""
    width = 2 * m.sizes[MODE_GROUPS]
    for b in range((coordinates + LANES - 1) // LANES):
        for p in range(count):
            row = p * (2 * width + m.sizes[STATE_GROUPS])
            coordinates_and_rates(b, modes, m.queue, row, m.queue, row + width, m)
            for j in range(min(LANES, coordinates - LANES * b)):
                at = LANES * b + j
                answer = number(m.queue, row + 2 * width, at)
                batch.samples[i, first + p, at] = answer + total_of(m.sums, j)
                at += coordinates
                answer = number(m.queue, row + 2 * width, at)
                batch.samples[i, first + p, at] = answer + total_of(m.sums, LANES + j)


# -- one trajectory --------------------------------------------------------------------------------
@kernel
def enter(i, tau, batch, m):
    """Begin in a contact state with the state of the trajectory: its amplitudes to `y`."""
    at = int(batch.carry[i, AT])
    take_state(i, batch, m)
    drive(i, tau, batch, m)
    answer_now(m.links[at, STEADY], m)
    less_answer(m)
    amplitudes_of(m.links[at, MODES], m.y, m)
    set_block_drives(m.links[at, MODES], m)
    if m.sizes[TANGENTS] != 0:
        enter_columns(i, at, tau, batch, m)
        keep_amplitudes(i, batch, m)
    batch.carry[i, ENTERS] = 0.0


@kernel
def keep_state(i, tau, batch, m):
    """Store the state that the amplitudes are, but for one that is known to the bit."""
    if not has_just_landed(i, tau, batch):
        at = int(batch.carry[i, AT])
        drive(i, tau, batch, m)
        answer_now(m.links[at, STEADY], m)
        state_of(m.links[at, MODES], m.y, m)
        write_state(batch.state, i, 0, m)


@kernel
def take_up(i, tau, batch, m):
    """Make the amplitudes anew of the state, where a course has changed its piece."""
    if m.sizes[COURSES] > 0:
        follow_courses(i, tau, batch, m)
        enter(i, tau, batch, m)


@kernel
def land(i, tau, d, hits, modes, steady, batch, m):
    """Cross boundaries a time d after tau: the contacts are recorded, the contact state changes.
    Returns the status.
    """
    which, before, law = int(batch.carry[i, SET]), batch.mode[i], first_law(hits, m)
    at = int(batch.carry[i, AT])
    if law >= 0:
        return act(i, law, tau, d, hits, modes, steady, batch, m)
    state_at(i, tau, d, modes, steady, batch, m)
    end_start(i, d, hits, batch)
    starts = batch.carry[i, STARTS] > 0.5  # a side at the start is no event
    for k in range(max(batch.cursor[i], 0) if starts else 0):
        batch.sample_mode[i, k] = before ^ hits
    for g in range(m.sizes[GUARDS]):
        if not starts and (hits >> g) & 1:
            snap(i, g, batch, m)
    for g in range(m.sizes[GUARDS]):
        if not starts and (hits >> g) & 1:
            _, rate = gap_of_moved(m.row_of[g], modes, steady, which, m)
            rate *= m.sign_of[g]
            size = m.errors[m.row_of[g], 2] + abs(m.offset[which, g])
            error = ROUNDED * size / abs(rate) if rate != 0.0 else math.inf
            after = before ^ hits
            direction = -1 if (before >> g) & 1 else 1
            batch.counters[i, EVENTS] += 1
            batch.minima[i, CONTACT_SPEED] = min(batch.minima[i, CONTACT_SPEED], abs(rate))
            record(i, g, tau + d, CROSSING, direction, rate, after, error, batch, m)
    arrives = hits if d > 0.0 else hits & ~batch.fresh[i]
    if d > 0.0:
        know_rides(i, batch, m)
    for g in range(m.sizes[GUARDS]):
        if (hits >> g) & 1:  # a force may jump there, a velocity doesn't
            know_zeros(i, g, max(1, min(2, known_zeros(i, g, batch))), batch)
    batch.mode[i] = before ^ hits
    leave(i, before, batch, m)
    if m.sizes[TANGENTS] != 0:
        batch.carry[i, WAITED] += d
        leave_columns(i, hits, at, tau + d, batch, m)
        date_limits(i, arrives, modes, tau + d, batch, m)
    return count_landing(i, tau + d, batch)


@inner
def land_and_enter(i, tau, d, hits, modes, steady, batch, m):
    """Land, and begin in the contact state behind if it has been made. Returns the status."""
    write_queue(i, batch.cursor[i], modes, batch, m)
    status = land(i, tau, d, hits, modes, steady, batch, m)
    if batch.carry[i, AT] >= 0.0:
        follow_courses(i, tau + d, batch, m)
        enter(i, tau + d, batch, m)
    return status


@inner
def keep_on(i, h, batch, m):
    """Take a step without a contact: boundaries that were ridden go on to be."""
    know_rides(i, batch, m)
    batch.carry[i, RIDES] = float(int(batch.carry[i, RIDES]) & batch.fresh[i])
    batch.carry[i, NEXT_STEP] = 4.0 * h


@inner
def end_of(i, batch):
    """End of the current period, or of the run in it."""
    return batch.period[i] if batch.count[i] < batch.end_count[i] else batch.end_phase[i]


@inner
def at_the_end(i, batch):
    """Status of a trajectory that has come to its end."""
    if batch.carry[i, RIDES] != 0.0:
        return RESTING
    return GRAZE_UNRESOLVED if batch.counters[i, UNRESOLVED] > 0 else OK


@inner
def is_lost(modes, m):
    """True if the amplitudes are no numbers any more."""
    total = splat(0.0, LANES)
    for g in range(2 * m.sizes[MODE_GROUPS] + block_groups(modes, m)):
        total = total + magnitude(load(m.y, g, LANES))
    store(m.sums, 0, total)
    return not total_of(m.sums, 0) < HUGE


@kernel
def advance(i, budget, batch, m):
    """Move a trajectory to its end, until the budget of steps is used up, the table of contacts is
    full, or it comes to a contact state that hasn't been made. Returns the budget left.
    """
    tau, rows = batch.phase[i], m.sizes[ROWS]
    begin_period(i, batch, m)
    follow_courses(i, tau, batch, m)
    if batch.carry[i, ENTERS] > 0.5:
        enter(i, tau, batch, m)
    else:
        for k in range(rows * LANES):
            m.y[k // LANES, k % LANES] = batch.carry[i, AMPLITUDES + k]
    status, stands = RUNNING, False
    while status == RUNNING and budget > 0 and batch.carry[i, AT] >= 0.0 and has_room(batch, m):
        at = int(batch.carry[i, AT])
        modes, steady = m.links[at, MODES], m.links[at, STEADY]
        if batch.carry[i, ASKS] > 0.5:
            stands = False
            write_queue(i, batch.cursor[i], modes, batch, m)
            rest_or_go(i, tau, modes, steady, batch, m)
            if batch.carry[i, ENTERS] > 0.5 and batch.carry[i, AT] >= 0.0:
                enter(i, tau, batch, m)
            continue
        take_samples(i, tau, tau, modes, steady, batch, m)
        end = end_of(i, batch)
        if tau >= end:
            stands = False
            if batch.count[i] < batch.end_count[i]:
                if m.sizes[COURSES] > 0:
                    keep_state(i, tau, batch, m)
                batch.count[i] += 1
                tau = 0.0
                begin_period(i, batch, m)
                take_up(i, tau, batch, m)
                take_samples(i, tau, tau, modes, steady, batch, m)
            if batch.count[i] >= batch.end_count[i] and tau >= batch.end_phase[i]:
                hits = ending_holds(i, tau, modes, steady, batch, m)
                if hits == 0 and batch.fresh[i] != 0:
                    hits = left_at_once(i, tau, modes, steady, batch, m)
                status = at_the_end(i, batch)
                if hits != 0:
                    status = land_and_enter(i, tau, 0.0, hits, modes, steady, batch, m)
            continue
        budget -= 1
        following, wanted = next_break(m), batch.carry[i, NEXT_STEP]
        h = min(wanted, end - tau, following - tau)
        if not stands:
            drive(i, tau, batch, m)
            set_block_drives(modes, m)
            stand(modes, steady, int(batch.carry[i, SET]), m)
            if batch.carry[i, STARTS] > 0.5:
                tell_pressed(i, tau, batch, m)
        h = reach(i, h, modes, batch, m)
        answer, d, hits = look(i, tau, h, modes, steady, batch, m)
        if batch.status[i] != RUNNING:
            status = batch.status[i]
        elif answer == OPEN:
            batch.counters[i, REJECTED] += 1
            batch.carry[i, NEXT_STEP], stands = shorter(modes, h, m), True
            status = NONFINITE if is_lost(modes, m) or not h > LEAST_STEP else RUNNING
        else:
            stands = False
            batch.counters[i, STEPS] += 1
            batch.minima[i, GAP_MARGIN] = m.out[MARGIN]
            take_samples(i, tau, tau + d, modes, steady, batch, m)
            note_touches(i, tau, h, d, modes, steady, batch, m)
            if answer == CLEAR:
                kept = d == h and m.sizes[TANGENTS] == 0  # columns have a use for `factor`
                h = d
                move(modes, h, int(m.found[0, FACTORS]) if kept else 0, m)
                keep_moved(modes, m)
                keep_on(i, h, batch, m)
                batch.carry[i, WAITED] += h
                if h == following - tau:
                    batch.carry[i, NEXT_STEP] = max(wanted, 2.0 * h)
                    tau = following
                else:
                    tau = end if h == end - tau else tau + h
                if is_break(i, tau, batch, m):
                    keep_state(i, tau, batch, m)
                    take_up(i, tau, batch, m)
                status = NONFINITE if is_lost(modes, m) else RUNNING
            else:
                status = land_and_enter(i, tau, d, hits, modes, steady, batch, m)
                tau = end if d == end - tau else tau + d
        if status == RUNNING and batch.counters[i, EVENTS] >= batch.options[i, MOST_CONTACTS]:
            status = BUDGET_EVENTS
        if status == RUNNING and batch.counters[i, STEPS] >= batch.options[i, MOST_STEPS]:
            status = BUDGET_STEPS
    put_back(i, tau, status, batch, m)
    return budget


@kernel
def put_back(i, tau, status, batch, m):
    """Store a trajectory that has ended or is paused. The derivative of one that is paused waits
    where it is: no bit depends on when that was.
    """
    if batch.carry[i, ENTERS] < 0.5:
        at = int(batch.carry[i, AT])
        write_queue(i, batch.cursor[i], m.links[at, MODES], batch, m)
        for k in range(m.sizes[ROWS] * LANES):
            batch.carry[i, AMPLITUDES + k] = m.y[k // LANES, k % LANES]
        keep_state(i, tau, batch, m)
        if status != RUNNING:
            move_columns(i, at, tau, batch, m)
            keep_amplitudes(i, batch, m)
            know_rests(i, tau, batch, m)
    batch.phase[i], batch.status[i] = tau, status


@entry
def propagate(
    period, origin, param, stride, state, count, phase, mode, fresh, carry, status, end_count,
    end_phase, counters, minima, sample_count, sample_fraction, cursor, samples, sample_mode,
    rec_first, rec_i, rec_f, rec_used, options, data, budget, sizes, row_of, sign_of, offset, rate,
    lag, modes, steady, links, course, pieces, laws, acts, presses, remembers, varied, shifts, y,
    moved, size, sums, q, errors, p, bern, bounds, slopes, out, touches, place, answer, angle,
    found, chain, follows, factor, column, columns, struck, bernstein, stood, waves, spans, near,
    queue, queued, rates,
):  # fmt: skip
    """Move every trajectory whose status is RUNNING and whose contact state has been made, `budget`
    steps at most. See kernels/batch.py for the arrays.
    """
    batch = Batch(
        period, origin, param, stride, state, count, phase, mode, fresh, carry, status, end_count,
        end_phase, counters, minima, sample_count, sample_fraction, cursor, samples, sample_mode,
        rec_first, rec_i, rec_f, rec_used, options, data,
    )  # fmt: skip
    m = Modal(
        sizes, row_of, sign_of, offset, rate, lag, modes, steady, links, course, pieces, laws, acts,
        presses, remembers, varied, shifts, y, moved, size, sums, q, errors, p, bern, bounds,
        slopes, out, touches, place, answer, angle, found, chain, follows, factor, column, columns,
        struck, bernstein, stood, waves, spans, near, queue, queued, rates,
    )  # fmt: skip
    waits = False
    for i in range(status.shape[0]):
        if status[i] == RUNNING and carry[i, AT] >= 0.0:
            budget = advance(i, budget, batch, m)
        if status[i] == RUNNING:
            waits = True
            if carry[i, AT] >= 0.0:
                return PAUSED
    return PAUSED if waits else FINISHED
