"""Template of the modal flow: steps that are proven to cross no boundary, or just one, and
the life of a trajectory.

A step is tried and halved until every gap is decided. Modes that are too fast for it are bounded:
they add at most their amplitudes to a gap, and at most |lambda| times these to its rate. A gap is
clear if its polynomial less that bound is; it crosses once if it is proven to fall all the way and
to end below zero. The place is then found by Newton's method on the modes themselves.
"""

import math

from saltus.kernels.batch import Batch
from saltus.kernels.isolation import AT as PLACE
from saltus.kernels.isolation import (
    MARGIN,
    MOST_TOUCHES,
    TOUCH_AT,
    TOUCH_GUARD,
    first_crossing,
    is_rounding,
    leading_sign,
    refine,
    side_of_leaving,
    to_bernstein,
)
from saltus.kernels.lanes import fma, load, root, store
from saltus.kernels.status import (
    BUDGET_EVENTS,
    BUDGET_STEPS,
    CONTACT_SPEED,
    CROSSING,
    EVENTS,
    FINISHED,
    GAP_MARGIN,
    GRAZE_SHALLOW,
    GRAZE_UNRESOLVED,
    HOLD_LAW,
    MODE_VIOLATION,
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


# -- one gap over one step -------------------------------------------------------------------------
@inner
def side_of(g, mode):
    """+1 where the gap of a guard is positive, -1 where it is negative."""
    return 1.0 if (mode >> g) & 1 else -1.0


@kernel
def terms_of(i, g, side, batch, m):
    """Terms of the gap of a guard on its side, on [0, 1], to p; returns its rounding error."""
    r, sign = m.row_of[g], side * m.sign_of[g]
    away = m.offset[int(batch.carry[i, SET]), g]
    for k in range(ORDER + 1):
        m.p[k] = sign * m.q[r, k]
    m.p[0] += side * away
    return ROUNDED * (m.errors[r, 2] + abs(away))


@kernel
def decide(i, g, batch, m):
    """Outcome of a gap over the step: CLEAR, CROSSES, or OPEN: a shorter step must tell. The place
    of a crossing goes to found[g, 0]; found[g, 1] says whether that is final.
    """
    side = side_of(g, batch.mode[i])
    noise = terms_of(i, g, side, batch, m)
    error, slope_error = m.errors[m.row_of[g], 0], m.errors[m.row_of[g], 1]
    exact, known = error <= noise, known_zeros(i, g, batch)
    fresh, degree = known > 0, ORDER - known
    if fresh:
        for k in range(ORDER + 1):
            m.p[k] = m.p[k + known] if k <= degree else 0.0
        error = slope_error
        if known > 1 and not exact:
            return OPEN
        if exact and is_rounding(m.p, degree, noise):
            m.found[g, 2] = 1.0  # it is ridden
            return CLEAR
        if exact and leading_sign(m.p, degree) < 0:
            m.found[g, 0], m.found[g, 1] = 0.0, 1.0
            return CROSSES
        if not exact and m.p[0] <= error:
            return OPEN
    elif not exact and m.p[0] <= error:
        return OPEN
    elif m.p[0] <= noise:
        if m.p[0] < -noise and m.laws[g, KIND] != HOLD_LAW:
            batch.status[i] = MODE_VIOLATION
            return CLEAR
        # what presses a contact at rest jumps where the state does
        if m.p[0] < -noise or side_of_leaving(m.p, degree, False, noise) < 0:
            m.found[g, 0], m.found[g, 1] = 0.0, 1.0
            return CROSSES
    to_bernstein(m.p, degree, m.bern[0])
    least, falls, turns = m.bern[0, 0], True, False
    for k in range(degree):
        change = m.bern[0, k + 1] - m.bern[0, k]
        least = min(least, m.bern[0, k + 1])
        turns = turns or (change > 0.0 and least < m.bern[0, 0])
        falls = falls and degree * change + slope_error < 0.0
    clear = least > error + noise
    if clear and (fresh or not turns or least - error >= m.out[MARGIN]):
        return CLEAR
    last = m.bern[0, degree]
    if not fresh and falls and last - error > noise:
        return CLEAR
    if not fresh and falls and last + error < -noise:
        m.found[g, 0], m.found[g, 1] = refine(m.p, degree, 0.0, 1.0, True), 0.0
        return CROSSES
    if not exact:
        return OPEN
    crosses, touched = first_crossing(
        m.p, degree, fresh, noise, g, m.bern, m.bounds, m.slopes, m.out, m.touches,
        min(int(m.found[0, 3]), MOST_TOUCHES - 1),
    )  # fmt: skip
    m.found[0, 3] = min(touched, MOST_TOUCHES - 1)
    m.found[g, 0], m.found[g, 1] = m.out[PLACE], 1.0
    return CROSSES if crosses else CLEAR


@kernel
def place_of(i, g, tau, h, modes, steady, batch, m):
    """Time after tau at which a gap that falls all the way crosses, by Newton's method on the modes
    inside a shrinking bracket.
    """
    which, side = int(batch.carry[i, SET]), side_of(g, batch.mode[i])
    sign, away = side * m.sign_of[g], side * m.offset[which, g]
    low, high, d = 0.0, h, m.found[g, 0] * h
    size = m.errors[m.row_of[g], 2] + abs(away)
    for _ in range(60):
        move(modes, d, m)
        drive(i, tau + d, batch, m)
        value, rate = gap_of_moved(m.row_of[g], modes, steady, which, m)
        value, rate = sign * value + away, sign * rate
        if value == 0.0:
            break
        if value > 0.0:
            low = d
        else:
            high = d
        new = d - value / rate if rate < 0.0 else 0.5 * (low + high)
        if not low <= new <= high:
            new = 0.5 * (low + high)
        change, d = abs(new - d), new
        if change <= 2.3e-16 * d or change * abs(rate) <= 2.3e-16 * size:
            break
    return d


@kernel
def reach(i, tau, h, modes, steady, batch, m):
    """The part of a step that is worth trying: as long as the modes that it follows leave less than
    half of each gap, or of its rate where that decides, to those that it bounds.
    """
    groups, which, most = m.sizes[MODE_GROUPS], int(batch.carry[i, SET]), 0
    for g in range(groups):
        real, imaginary = load(m.y, g, LANES), load(m.y, groups + g, LANES)
        store(m.moved, g, real)
        store(m.moved, groups + g, imaginary)
        store(m.size, g, root(fma(real, real, imaginary * imaginary)))
    for g in range(2 * groups, m.sizes[ROWS]):
        store(m.moved, g, load(m.y, g, LANES))
    waves = modes + groups * (3 + 4 * LANES * m.sizes[STATE_GROUPS])
    for g in range(m.sizes[GUARDS]):
        if not is_watched(g, batch.mode[i], m):
            continue
        r, side = m.row_of[g], side_of(g, batch.mode[i])
        value, rate = gap_of_moved(r, modes, steady, which, m)
        value, rate = side * (m.sign_of[g] * value + m.offset[which, g]), side * m.sign_of[g] * rate
        fresh = (batch.fresh[i] >> g) & 1 == 1
        slow = 0.5 * abs(rate) if fresh == (rate > 0.0) else 0.0
        value = 0.0 if fresh else 0.5 * value
        near, left, slope = groups, 0.0, 0.0
        while near > most:
            size = load(m.size, near - 1, LANES)
            size = size * load(m.modes, waves + 3 * groups * r + 2 * groups + near - 1, LANES)
            store(m.sums, 0, size)
            store(m.sums, 1, size * load(m.modes, modes + 2 * groups + near - 1, LANES))
            left, slope = left + total_of(m.sums, 0), slope + total_of(m.sums, 1)
            if left > value and slope > slow:
                break
            near -= 1
        most = max(most, near)
    fastest = m.modes[modes + 2 * groups + most - 1, LANES - 1] if most > 0 else 0.0
    fastest = max(fastest, block_limit(modes, m))
    return FOLLOWED / fastest if h * fastest > FOLLOWED else h


@kernel
def look(i, tau, h, modes, steady, batch, m):
    """Decide all gaps over a step: (OPEN, 0, 0) if a shorter one must tell, (CLEAR, h, 0), or
    CROSSES with the time after tau and the guards (bits).
    """
    which = int(batch.carry[i, SET])
    drive(i, tau, batch, m)
    follow_block(modes, h, m)
    for r in range(m.sizes[GAP_ROWS]):
        series_of(r, modes, steady, which, h, m)
    m.out[MARGIN], m.found[0, 3] = batch.minima[i, GAP_MARGIN], 0.0
    crossing, hits, first = 0, 0, h
    for g in range(m.sizes[GUARDS]):
        m.found[g, 2] = 0.0
        answer = decide(i, g, batch, m) if is_watched(g, batch.mode[i], m) else CLEAR
        if answer == OPEN:
            return OPEN, 0.0, 0
        if answer == CROSSES:
            crossing |= 1 << g
    for g in range(m.sizes[GUARDS]):
        if (crossing >> g) & 1:
            d = m.found[g, 0] * h
            if m.found[g, 1] == 0.0:
                d = place_of(i, g, tau, h, modes, steady, batch, m)
            together = abs(d - first) <= COINCIDENT * (batch.origin[i] + tau)
            if hits != 0 and together:
                hits |= 1 << g
            elif hits == 0 or d < first:
                hits, first = 1 << g, d
    return (CROSSES if hits != 0 else CLEAR), first, hits


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
    for j in range(m.sizes[STATES]):
        batch.rec_f[r, RECORD_FLOATS + j] = m.state[j // LANES, j % LANES]
    for j in range(m.sizes[STATES], m.sizes[STATES] + m.sizes[REMEMBERED]):
        batch.rec_f[r, RECORD_FLOATS + j] = batch.state[i, j]
    batch.rec_f[r, RECORD_FLOATS + batch.state.shape[1]] = time_of(i, tau, batch)


@kernel
def note_touches(i, tau, h, until, modes, steady, batch, m):
    """Count and record the tangencies of a step up to a time of it."""
    for j in range(int(m.found[0, 3])):
        d, g = m.touches[j, TOUCH_AT] * h, int(m.touches[j, TOUCH_GUARD])
        if d > until:
            continue
        batch.counters[i, UNRESOLVED] += 1
        state_after(i, tau, d, modes, steady, batch, m)
        _, rate = gap_of_moved(m.row_of[g], modes, steady, int(batch.carry[i, SET]), m)
        side = side_of(g, batch.mode[i])
        record(
            i, g, tau + d, GRAZE_SHALLOW, int(side), m.sign_of[g] * rate, batch.mode[i], h, batch, m
        )


@inner
def state_after(i, tau, d, modes, steady, batch, m):
    """The state a time d after tau, to `state`; its amplitudes to `moved`."""
    move(modes, d, m)
    drive(i, tau + d, batch, m)
    answer_now(steady, m)
    state_of(modes, m.moved, m)


@kernel
def write_samples(i, tau, until, modes, steady, batch, m):
    """Write the samples due up to a time of the period from the amplitudes at tau."""
    k = batch.cursor[i]
    while 0 <= k < batch.sample_count.shape[0] and batch.sample_count[k] <= batch.count[i]:
        due = (batch.sample_count[k] - batch.count[i]) * batch.period[i]
        due += batch.sample_fraction[k] * batch.period[i]
        if due > until:
            break
        state_after(i, tau, due - tau, modes, steady, batch, m)
        states = m.sizes[STATES]
        if due == tau and has_just_landed(i, tau, batch):
            for j in range(states):
                m.state[j // LANES, j % LANES] = batch.state[i, j]
        for j in range(states):
            batch.samples[i, k, j] = m.state[j // LANES, j % LANES]
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


# -- one trajectory --------------------------------------------------------------------------------
@kernel
def enter(i, tau, batch, m):
    """Begin in a contact state with the state of the trajectory: its amplitudes to `y`."""
    at = int(batch.carry[i, AT])
    for j in range(m.sizes[STATES]):
        m.state[j // LANES, j % LANES] = batch.state[i, j]
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
        for j in range(m.sizes[STATES]):
            batch.state[i, j] = m.state[j // LANES, j % LANES]


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
    state_after(i, tau, d, modes, steady, batch, m)
    for g in range(m.sizes[GUARDS]):
        if (hits >> g) & 1:
            _, rate = gap_of_moved(m.row_of[g], modes, steady, which, m)
            rate *= m.sign_of[g]
            size = m.errors[m.row_of[g], 2] + abs(m.offset[which, g])
            error = ROUNDED * size / abs(rate) if rate != 0.0 else math.inf
            after = before ^ hits
            direction = -1 if (before >> g) & 1 else 1
            batch.counters[i, EVENTS] += 1
            batch.minima[i, CONTACT_SPEED] = min(batch.minima[i, CONTACT_SPEED], abs(rate))
            record(i, g, tau + d, CROSSING, direction, rate, after, error, batch, m)
    if d > 0.0:
        know_nothing(i, batch)
    for g in range(m.sizes[GUARDS]):
        if (hits >> g) & 1:
            know_zeros(i, g, 1, batch)
    batch.mode[i] = before ^ hits
    leave(i, before, batch, m)
    if m.sizes[TANGENTS] != 0:
        batch.carry[i, WAITED] += d
        leave_columns(i, hits, at, tau + d, batch, m)
    return count_landing(i, tau + d, batch)


@inner
def keep_on(i, h, batch, m):
    """Take a step without a contact: boundaries that were ridden go on to be."""
    fresh = 0
    for g in range(m.sizes[GUARDS]):
        if m.found[g, 2] > 0.5:
            fresh |= 1 << g
    twice, thrice = int(batch.carry[i, TWICE]), int(batch.carry[i, THRICE])
    know_nothing(i, batch)
    batch.fresh[i] = fresh
    batch.carry[i, TWICE], batch.carry[i, THRICE] = float(twice & fresh), float(thrice & fresh)
    batch.carry[i, RIDES] = float(int(batch.carry[i, RIDES]) & fresh)
    batch.carry[i, NEXT_STEP] = 2.0 * h
    batch.minima[i, GAP_MARGIN] = m.out[MARGIN]


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
def is_lost(i, batch, m):
    """True if the amplitudes are no numbers any more."""
    total = 0.0
    for g in range(m.sizes[ROWS]):
        for k in range(LANES):
            total += abs(m.y[g, k])
    return not total < HUGE


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
    status = RUNNING
    while status == RUNNING and budget > 0 and batch.carry[i, AT] >= 0.0 and has_room(batch, m):
        at = int(batch.carry[i, AT])
        modes, steady = m.links[at, MODES], m.links[at, STEADY]
        if batch.carry[i, ASKS] > 0.5:
            rest_or_go(i, tau, modes, steady, batch, m)
            if batch.carry[i, ENTERS] > 0.5 and batch.carry[i, AT] >= 0.0:
                enter(i, tau, batch, m)
            continue
        write_samples(i, tau, tau, modes, steady, batch, m)
        end = end_of(i, batch)
        if tau >= end:
            if batch.count[i] < batch.end_count[i]:
                if m.sizes[COURSES] > 0:
                    keep_state(i, tau, batch, m)
                batch.count[i] += 1
                tau = 0.0
                begin_period(i, batch, m)
                take_up(i, tau, batch, m)
                write_samples(i, tau, tau, modes, steady, batch, m)
            if batch.count[i] >= batch.end_count[i] and tau >= batch.end_phase[i]:
                status = at_the_end(i, batch)
            continue
        budget -= 1
        following, wanted = next_break(m), batch.carry[i, NEXT_STEP]
        h = min(wanted, end - tau, following - tau)
        drive(i, tau, batch, m)
        set_block_drives(modes, m)
        h = reach(i, tau, h, modes, steady, batch, m)
        answer, d, hits = look(i, tau, h, modes, steady, batch, m)
        if batch.status[i] != RUNNING:
            status = batch.status[i]
        elif answer == OPEN:
            batch.counters[i, REJECTED] += 1
            batch.carry[i, NEXT_STEP] = 0.5 * h
        else:
            batch.counters[i, STEPS] += 1
            write_samples(i, tau, tau + d, modes, steady, batch, m)
            note_touches(i, tau, h, d, modes, steady, batch, m)
            if answer == CLEAR:
                move(modes, h, m)
                keep_moved(m)
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
                status = NONFINITE if is_lost(i, batch, m) else RUNNING
            else:
                status = land(i, tau, d, hits, modes, steady, batch, m)
                tau += d
                if batch.carry[i, AT] >= 0.0:
                    follow_courses(i, tau, batch, m)
                    enter(i, tau, batch, m)
        if status == RUNNING and batch.counters[i, EVENTS] >= batch.options[i, MOST_CONTACTS]:
            status = BUDGET_EVENTS
        if status == RUNNING and batch.counters[i, STEPS] >= batch.options[i, MOST_STEPS]:
            status = BUDGET_STEPS
    put_back(i, tau, status, batch, m)
    return budget


@kernel
def put_back(i, tau, status, batch, m):
    """Store a trajectory that has ended or is paused."""
    if batch.carry[i, ENTERS] < 0.5:
        at = int(batch.carry[i, AT])
        for k in range(m.sizes[ROWS] * LANES):
            batch.carry[i, AMPLITUDES + k] = m.y[k // LANES, k % LANES]
        keep_state(i, tau, batch, m)
        move_columns(i, at, tau, batch, m)
        keep_amplitudes(i, batch, m)
    batch.phase[i], batch.status[i] = tau, status


@entry
def propagate(
    period, origin, param, stride, state, count, phase, mode, fresh, carry, status, end_count,
    end_phase, counters, minima, sample_count, sample_fraction, cursor, samples, sample_mode,
    rec_first, rec_i, rec_f, rec_used, options, data, budget, sizes, row_of, sign_of, offset, rate,
    lag, modes, steady, links, course, pieces, laws, acts, presses, remembers, varied, shifts, y,
    moved, size, sums, q, errors, p, bern, bounds, slopes, out, touches, place, answer, angle,
    found, chain, follows, factor, column, columns, struck,
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
        struck,
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
