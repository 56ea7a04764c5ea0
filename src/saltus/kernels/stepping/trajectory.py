"""Template: one trajectory after the other, by any one-step method. codegen puts a generated head,
rates.py and the templates of a method before this text.

One step reads: step -> find the contact -> write samples -> land or go on. A method supplies

- ``begin_leg``, at the start, after a contact and at a break of time;
- ``step``, from NODE to NEXT, with the rate there at K_END and q at Q_STAGE;
- ``dense``, the state inside the step, to POINT;
- ``find_contact``, whose LEFT and RIGHT differ in sign where a gap closes;
- ``law_mode`` and ``settle_sides``: the sides that its right-hand side sees;
- ``at_once``, the time [s] within which it can't tell two contacts apart, and ``least_state``, the
  size below which it takes a state for zero.

Symbols
-------
t, t_new ends of a step; t_leg start of the leg (the first time, or the last contact); t_end end of
the trajectory; h = t_new - t. Times in s.
"""

import math

from saltus.kernels.batch import Batch
from saltus.kernels.status import (
    BUDGET_EVENTS,
    BUDGET_STEPS,
    CONTACT_SPEED,
    CROSSING,
    EVENTS,
    FINISHED,
    INVALID_FRICTION,
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
    RUNNING,
    SLIDING,
    STEPS,
    VIOLATIONS,
)

# Columns of `options` that all methods have.
LOCATE, MAX_STEPS, MAX_EVENTS = range(2, 5)


# -- sides -----------------------------------------------------------------------------------------
@inner
def check_sides(i, batch, work):
    """After a step without contact, take the sides of the gaps. A gap that has changed sides unseen
    is counted.
    """
    now = allowed(sides(AT_NEXT, work))
    if now != batch.mode[i]:
        for g in range(NGUARDS):
            if (now ^ batch.mode[i]) >> g & 1 and work[AT_NODE + g] != 0.0:
                batch.counters[i, VIOLATIONS] += 1
        batch.mode[i] = now


# -- samples ---------------------------------------------------------------------------------------
@inner
def due(i, batch):
    """Time of the next sample, infinite if there is none."""
    m = batch.cursor[i]
    if m < 0 or m >= batch.sample_count.shape[0]:
        return math.inf
    return (
        batch.origin[i]
        + batch.sample_count[m] * batch.period[i]
        + batch.sample_fraction[m] * batch.period[i]
    )


@kernel
def write_sample(i, time, state, batch, work):
    """Write a state as the next sample."""
    m = batch.cursor[i]
    for j in range(NSTATES):
        batch.samples[i, m, j] = work[state + j]
    drive_at(time, Q, work)
    gaps_at(time, state, Q, TRY, work)
    batch.sample_mode[i, m] = allowed(sides(TRY, work))
    batch.cursor[i] = m + 1


@kernel
def write_samples(i, t, h, t_node, batch, work):
    """Write the samples that the step has passed on its way from t to t_node, whose state is in
    NEXT.
    """
    time = due(i, batch)
    while time <= t_node:
        if time == t_node:
            write_sample(i, time, NEXT, batch, work)
        else:
            dense(time, t, h, work)
            write_sample(i, time, POINT, batch, work)
        time = due(i, batch)


@kernel
def write_samples_here(i, until, batch, work):
    """Write the samples due until a time from the state at NODE: at the start, and those that
    rounding has put past the end.
    """
    while due(i, batch) <= until:
        write_sample(i, due(i, batch), NODE, batch, work)


# -- contacts --------------------------------------------------------------------------------------
@kernel
def land(i, t, t_hit, t_new, t_leg, h, batch, work):
    """Cut the step at a contact: NEXT becomes the state there, K1 its rate, AT_NEXT its gaps; the
    contact is recorded.
    """
    if t_hit < t_new:
        dense(t_hit, t, h, work)
        for j in range(NSTATES):
            work[NEXT + j] = work[POINT + j]
    write_samples(i, t, h, t_hit, batch, work)
    drive_at(t_hit, Q, work)
    rate_at(t_hit, NEXT, Q, law_mode(i, batch), K1, work)
    gap_rates_at(t_hit, NEXT, K1, Q, RATE, work)
    gap_errors(i, t_hit, batch, work)
    if LAWS:
        before_strikes(i, t_hit, t_leg, h, batch, work)
    record_contacts(i, t_hit, batch, work)
    if LAWS:
        strike_all(i, t_hit, batch, work)
    if TANGENT or LAWS or law_mode(i, batch) != FROM_STATE:
        rate_at(t_hit, NEXT, Q, law_mode(i, batch), K1, work)
    gaps_at(t_hit, NEXT, Q, AT_NEXT, work)
    face(i, AT_NEXT, batch, work)


@kernel
def gap_errors(i, t_hit, batch, work):
    """Largest change of each gap by the errors of all steps so far, to TRY; the growth of errors
    from step to step is left out.
    """
    for j in range(NSTATES):
        work[BEHIND + j] = batch.carry[i, ERRORS + j]
    gap_changes(t_hit, TRY, work)


@kernel
def gap_changes(time, out, work):
    """Largest change of each gap by the changes in BEHIND of the states in NEXT, to `out`."""
    gap_rates_at(time, NEXT, REST, Q, RATE_AT_REST, work)
    for g in range(NGUARDS):
        work[out + g] = 0.0
    for j in range(NSTATES):
        work[REST + j] = work[BEHIND + j]
        gap_rates_at(time, NEXT, REST, Q, AT_NEXT, work)
        work[REST + j] = 0.0
        for g in range(NGUARDS):
            work[out + g] += abs(work[AT_NEXT + g] - work[RATE_AT_REST + g])


@inner
def record_contacts(i, t_hit, batch, work):
    """Count and record every gap that closes at t_hit without a jump of the state; set the mode."""
    before, after = batch.mode[i], batch.mode[i]
    for g in range(NGUARDS):
        if crosses(work, g):
            rises = work[RIGHT + g] > work[LEFT + g]
            before = before & ~(1 << g) if rises else before | (1 << g)
            after = after | (1 << g) if rises else after & ~(1 << g)
    for g in range(NGUARDS):
        if crosses(work, g):
            direction = 1 if work[RIGHT + g] > work[LEFT + g] else -1
            slowest(i, work[RATE + g], batch)
            note(i, g, t_hit, CROSSING, direction, work[RATE + g], before, after, batch, work)
    batch.mode[i] = after
    if TANGENT:
        saltate(i, t_hit, before, after, batch, work)


@inner
def crosses(work, g):
    """True if the gap closes at a contact without a jump of the state."""
    return changes_sign(work, LEFT, RIGHT, g) and not (LAWS and strikes(work, g))


@inner
def saltate(i, t_hit, before, after, batch, work):
    """Apply the jumps of the tangent that the states carry, guard by guard where several cross
    together.
    """
    mode = before
    for g in range(NGUARDS):
        if crosses(work, g):
            flipped = (mode & ~(1 << g)) | (after & (1 << g))
            h = part(work, H, HELD * NCLOCKS)
            jump(
                t_hit, part(work, NEXT, NSTATES), batch.param[i * batch.stride], h, mode, flipped, g
            )
            mode = flipped


@inner
def slowest(i, velocity, batch):
    """Keep the smallest speed of a contact."""
    batch.minima[i, CONTACT_SPEED] = min(batch.minima[i, CONTACT_SPEED], abs(velocity))


@inner
def note(i, g, t_hit, kind, direction, velocity, before, after, batch, work):
    """Count and record one contact."""
    batch.counters[i, EVENTS] += 1
    record(i, g, t_hit, kind, direction, velocity, before, after, batch, work)


@kernel
def record(i, g, t_hit, kind, direction, velocity, before, after, batch, work):
    """Write one contact, if there is a table and the contact is in a recorded period."""
    period, elapsed = batch.period[i], t_hit - batch.origin[i]
    count = math.floor(elapsed / period)
    if batch.rec_i.shape[0] == 0 or count < batch.rec_first[i]:
        return
    r = batch.rec_used[0]
    batch.rec_used[0] = r + 1
    row, values = batch.rec_i[r], batch.rec_f[r]
    row[REC_TRAJECTORY], row[REC_PERIOD], row[REC_GUARD], row[REC_KIND] = i, count, g, kind
    row[REC_DIRECTION] = direction
    row[REC_MODE_BEFORE], row[REC_MODE_AFTER], row[REC_STEPS] = (
        before,
        after,
        batch.counters[i, STEPS],
    )
    values[REC_PHASE], values[REC_VELOCITY] = elapsed - count * period, velocity
    values[REC_TIME_ERROR] = work[TRY + g] / abs(velocity) if velocity != 0.0 else math.inf
    for j in range(NSTATES):
        values[RECORD_FLOATS + j] = work[NEXT + j]
    values[RECORD_FLOATS + NSTATES] = t_hit


# -- one trajectory --------------------------------------------------------------------------------
@inner
def end_time(i, batch):
    """Time at which a trajectory ends."""
    return batch.origin[i] + batch.end_count[i] * batch.period[i] + batch.end_phase[i]


@inner
def go_on(rate, work):
    """Make the end of a step the start of the next: NEXT, a rate and AT_NEXT become NODE, K1 and
    AT_NODE.
    """
    for i in range(NSTATES):
        work[NODE + i] = work[NEXT + i]
        work[K1 + i] = work[rate + i]
    for g in range(NGUARDS):
        work[AT_NODE + g] = work[AT_NEXT + g]


@kernel
def take_up(i, t_end, batch, work):
    """Load a trajectory, from its start (mode < 0) or from its pause: (t, start of the leg, next
    break).
    """
    prepare(batch.param[i * batch.stride], part(work, C, NCONST))
    begins = batch.mode[i] < 0
    t, t_leg = batch.carry[i, TIME], batch.carry[i, LEG]
    if begins:
        t = batch.origin[i] + batch.count[i] * batch.period[i] + batch.phase[i]
    for j in range(NSTATES):
        work[NODE + j], work[REST + j] = batch.state[i, j], 0.0
    t_break = follow_clocks(i, t, False, batch, work)
    if begins:
        start_leg(i, t, t_end, True, batch, work)
        if LAWS:
            strike_at_start(i, t, t_end, batch, work)
        write_samples_here(i, t, batch, work)
        t_leg = t
    else:
        exchange_past(i, False, batch, work)
        drive_at(t, Q, work)
        gaps_at(t, NODE, Q, AT_NODE, work)
        face(i, AT_NODE, batch, work)
        rate_at(t, NODE, Q, law_mode(i, batch), K1, work)
    return t, t_leg, t_break


@kernel
def exchange_past(i, store, batch, work):
    """Exchange the memory of a multistep method with `carry`."""
    for j in range(MULTISTEP * ROWS * NSTATES):
        if store:
            batch.carry[i, PAST + j] = work[K1 + j]
        else:
            work[K1 + j] = batch.carry[i, PAST + j]
    size = NUMBERS_OF_METHOD + MATRICES * NSTATES * NSTATES
    for j in range(MULTISTEP * size):
        if store:
            batch.carry[i, PAST + ROWS * NSTATES + j] = work[S + j]
        else:
            work[S + j] = batch.carry[i, PAST + ROWS * NSTATES + j]


@kernel
def follow_clocks(i, t, known, batch, work):
    """Bring the clocks to their pieces at a time, from their present pieces if these are known;
    return the next break.
    """
    if NCLOCKS == 0:
        return math.inf
    n = part(work, N, (NUMBERS + 1) * NCLOCKS)
    place_clocks(batch.param[i * batch.stride], 0.0, 1.0, 0, n, batch.data)
    return set_clocks(t, 0.0, n, batch.data, known, part(work, H, HELD * NCLOCKS))


@kernel
def start_leg(i, t, t_end, look, batch, work):
    """Start afresh where the equations change, or begin: rates, gaps and, if wanted, sides at
    NODE.
    """
    drive_at(t, Q, work)
    gaps_at(t, NODE, Q, AT_NODE, work)
    if look:
        batch.mode[i] = allowed(sides(AT_NODE, work))
    rate_at(t, NODE, Q, law_mode(i, batch), K1, work)
    if look:
        settle_sides(i, t, batch, work)
    face(i, AT_NODE, batch, work)
    begin_leg(i, t, t_end, batch, work)


@kernel
def put_back(i, t, t_leg, status, batch, work):
    """Store a trajectory that has ended or is paused."""
    for j in range(NSTATES):
        batch.state[i, j] = work[NODE + j]
    batch.carry[i, TIME], batch.carry[i, LEG] = t, t_leg
    exchange_past(i, True, batch, work)
    batch.status[i] = status
    if batch.options[i, LOCATE] == 0.0:
        drive_at(t, Q, work)
        gaps_at(t, NODE, Q, AT_NODE, work)
        batch.mode[i] = allowed(sides(AT_NODE, work))
    batch.phase[i] = t - (batch.origin[i] + batch.count[i] * batch.period[i])
    if status == OK:
        write_samples_here(i, t + 4.0 * ulp(t), batch, work)
        batch.count[i], batch.phase[i] = batch.end_count[i], batch.end_phase[i]


@kernel
def pushes_on(i, t, batch, work):
    """True if a force of friction is negative at NODE."""
    mode = batch.mode[i]
    if batch.options[i, LOCATE] == 0.0:
        drive_at(t, Q, work)
        gaps_at(t, NODE, Q, TRY, work)
        mode = sides(TRY, work)
    p, h = batch.param[i * batch.stride], part(work, H, HELD * NCLOCKS)
    levels(t, part(work, NODE, NSTATES), p, h, mode, part(work, TOLD, 2))
    return work[TOLD] < 0.0


@inner
def status_at(i, t, t_end, batch, work):
    """Status of a trajectory at a node; a law of contact may have ended it."""
    if LAWS and batch.status[i] != RUNNING:
        return batch.status[i]
    if LEVELS and pushes_on(i, t, batch, work):
        return INVALID_FRICTION
    if t >= t_end:
        return OK
    if batch.counters[i, EVENTS] > batch.options[i, MAX_EVENTS]:
        return BUDGET_EVENTS
    if LAWS and batch.carry[i, AT_ONCE] > MOST_AT_ONCE:
        return BUDGET_EVENTS
    return BUDGET_STEPS if batch.counters[i, STEPS] >= batch.options[i, MAX_STEPS] else RUNNING


@inner
def has_room(batch):
    """True if the contacts of one more step fit in the table."""
    return batch.rec_i.shape[0] == 0 or batch.rec_used[0] + STEP_RECORDS <= batch.rec_i.shape[0]


@kernel
def advance(i, budget, batch, work):
    """Move a trajectory to its end, or until the budget of tries is used up or the table of
    contacts is full; returns the budget left.
    """
    locate = batch.options[i, LOCATE] != 0.0
    t_end = end_time(i, batch)
    t, t_leg, t_break = take_up(i, t_end, batch, work)
    status = status_at(i, t, t_end, batch, work)
    while status == RUNNING and budget > 0 and has_room(batch):
        t_new, h, fine, rejections = step(i, t, min(t_end, t_break), t_leg, t_end, batch, work)
        budget -= 1 + rejections
        batch.counters[i, REJECTED] += rejections
        if not fine:
            status = NONFINITE
            break
        t_hit, lands = t_new, False
        if locate:
            t_hit, t_new, h, lands, status = find_contact(i, t, t_new, t_leg, h, batch, work)
            if status != RUNNING:
                break
        elif LAWS:
            lands = goes_past(i, t_new, batch, work)
        batch.counters[i, STEPS] += 1
        for j in range(NSTATES):
            batch.carry[i, ERRORS + j] += abs(h * work[ERROR + j])
        if lands:
            land(i, t, t_hit, t_new, t_leg, h, batch, work)
            held = locate and is_held(i, t_hit, batch, work)
            go_on(K1, work)
            begin_leg(i, t_hit, t_end, batch, work)
            t = t_leg = t_hit
            if held:
                status = SLIDING
                break
        else:
            write_samples(i, t, h, t_new, batch, work)
            if locate:
                check_sides(i, batch, work)
            go_on(K_END, work)
            t = t_new
        if NCLOCKS > 0 and t + SAME_BREAK * abs(t) >= t_break:
            t_break = follow_clocks(i, t, True, batch, work)
            start_leg(i, t, t_end, locate, batch, work)
            t_leg = t
        status = status_at(i, t, t_end, batch, work)
    put_back(i, t, t_leg, status, batch, work)
    return budget


@entry
def propagate(
    period, origin, param, stride, state, count, phase, mode, fresh, carry, status, end_count,
    end_phase, counters, minima, sample_count, sample_fraction, cursor, samples, sample_mode,
    rec_first, rec_i, rec_f, rec_used, options, data, budget, work,
):  # fmt: skip
    """Move every trajectory whose status is RUNNING to its end, in `budget` tries of a step at
    most. See kernels/batch.py for the arrays.
    """
    batch = Batch(
        period, origin, param, stride, state, count, phase, mode, fresh, carry, status, end_count,
        end_phase, counters, minima, sample_count, sample_fraction, cursor, samples, sample_mode,
        rec_first, rec_i, rec_f, rec_used, options, data,
    )  # fmt: skip
    for i in range(status.shape[0]):
        if status[i] == RUNNING:
            budget = advance(i, budget, batch, work)
            if status[i] == RUNNING:
                return PAUSED
    return FINISHED
